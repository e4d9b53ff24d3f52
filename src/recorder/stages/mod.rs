//! Where the signal meets the effects: scene, paths, oscillator, antennas, IF filter, nonlinearity, what is added, noise,
//! converter. The laws are those of [`super::effects`]; here is their order, and what several of them share.

mod chain;
mod channels;
mod clock;
mod front_end;
mod if_filter;
mod mirror_plan;
mod movers;
mod noise;
mod onto;
mod oscillator;

pub use chain::{Chain, damage};
pub use clock::Clock;
pub use front_end::Stages;
pub use mirror_plan::MirrorPlan;
pub use movers::{Mover, Stage, movers, vibration};
pub use noise::shape as shape_noise;
pub use onto::{Ground, Onto};
