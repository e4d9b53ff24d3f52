//! placeholder until merged
use crate::{error::Result, radar::Radar, room::Room};
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct RecorderConfig {}
pub struct W { pub radar: Radar, pub room: Room }
impl RecorderConfig {
    pub fn frames(&self) -> usize { 0 }
    pub fn world(&self) -> Result<W> { todo!() }
}
pub fn record_to(_c: &RecorderConfig, _f: &std::path::Path, _p: &mut dyn FnMut(usize)) -> Result<()> { todo!() }
