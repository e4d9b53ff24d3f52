//! The recorder: an independent float64 world that turns a person, a room and a radar into a recording.
//!
//! It shares settings, errors and files with the simulator and nothing else: skinning, geometry, visibility, amplitudes
//! and sums are done here a second time, in plain Rust, so that what the simulator learns from it is not itself.
//!
//! The signal of a frame, in the order in which it comes about:
//! - [`body`], [`skinning`], [`timeline`]: the mesh at any time
//! - [`surface`], [`triangle`]: the mesh as elements that can be summed, flat pieces in closed form
//! - [`visibility`], [`mirror`]: who is seen, directly and over the walls
//! - [`material`], [`amplitude`]: physical optics with Fresnel reflection and roughness
//! - [`chirp`], [`scatter`]: delays while the chirp runs, the reference sum and the fast one
//! - `surroundings`: rough walls, mirror images of the radar, furniture
//! - [`receiver`]: unknown phase, thermal noise, converter
//!
//! Not modelled: shadows of the body on the walls, diffraction around its edges, returns that meet the body twice,
//! polarisation, and what the body's inside sends back.

pub mod amplitude;
pub mod body;
mod checks;
pub mod chirp;
pub mod config;
mod delay;
mod draws;
pub mod effects;
mod lanes;
pub mod material;
mod mesh;
pub mod mirror;
mod paths;
mod physiology;
pub mod range_grid;
pub mod receiver;
mod record;
mod resample;
pub mod scatter;
mod signal;
mod sinusoid;
pub mod skinning;
pub mod stages;
pub mod surface;
mod surroundings;
pub mod timeline;
pub mod triangle;
mod truth;
pub mod vector;
pub mod visibility;
mod white;
pub mod world;
mod write;

#[cfg(test)]
mod laws;
#[cfg(test)]
pub(crate) mod test_support;

pub use config::{ActorConfig, RadarChoice, RecorderConfig};
pub use effects::EffectsConfig;
pub use material::Material;
pub use receiver::{Level, ReceiverConfig};
pub use record::{Recorder, record};
pub use surface::{Returns, SurfaceConfig};
pub use timeline::Interpolation;
pub use truth::truth;
pub use world::{Reflector, WallsConfig, World};
pub use write::{Labels, record_to, write_world};
