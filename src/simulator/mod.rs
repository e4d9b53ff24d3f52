//! The simulator: the whole journey as one Burn module.
//!
//! Features of the body (tri-plane) and of the room (encoded coordinates) are decoded into materials and Gaussian
//! patches; the scene says where they are and who is seen; paths and the coherent sum make IF samples of them.

mod config;
mod scene;
mod surfaces;

use std::collections::BTreeMap;

pub use config::{PathModel, SimulatorConfig};
pub use scene::{FrameView, Scene, Seen};
pub use surfaces::{SceneConstants, Surface, Surfaces};

use burn::{
    module::{Module, Param},
    tensor::{Device, Tensor, TensorData},
};

use crate::{
    complex::Complex,
    error::Result,
    features::{GraphConvolution, TriPlane},
    if_signal::Noise,
    scatterers::{GaussianDecoder, MaterialDecoder},
};
