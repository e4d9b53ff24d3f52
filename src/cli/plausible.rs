//! The plausibility of what a verb is given: notes on standard error, the first refusal as the error.

use std::path::Path;

pub(super) use crate::verbs::plausible::facts;

use super::{Common, progress::notes};
use crate::{
    data::Recording,
    error::Result,
    person::Person,
    plausibility::{Facts, Sources},
    radar::Radar,
    room::Room,
    verbs::plausible,
};

pub(super) fn recording(recording: &Recording, common: &Common) -> Result<()> {
    plausible::recording(recording, common.as_stated, &mut notes)
}

pub(super) fn folder(folder: &Path, common: &Common) -> Result<()> {
    plausible::folder(folder, common.as_stated, &mut notes)
}

pub(super) fn scene(
    radar: Option<&Radar>,
    room: Option<&Room>,
    person: Option<&Person>,
    sources: &Sources,
    common: &Common,
) -> Result<()> {
    plausible::scene(radar, room, person, sources, common.as_stated, &mut notes)
}

pub(super) fn report(facts: Facts, sources: &Sources, common: &Common) -> Result<()> {
    plausible::judge(facts, sources, common.as_stated, &mut notes)
}
