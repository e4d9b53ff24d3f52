//! The paper's experiments, from nothing to tables: all of them, or one stage after the other, wherever it is done.

use std::path::{Path, PathBuf};

use burn::tensor::Device;

use super::{Notice, Notify, plausible};
use crate::{
    data::{Shard, atomic, files},
    error::{Error, Result},
    experiments::{self, Event, Plan, ReproduceConfig, Store, report, results, stage::read_record, stage::stage_folder},
    lpips::{Lpips, LpipsConfig},
};

/// What is reproduced.
pub struct Reproduce<'a> {
    pub config: &'a Path,
    /// `key=value` of its settings.
    pub sets: &'a [String],
    /// In place of the config's.
    pub lpips: Option<LpipsConfig>,
    pub out: &'a Path,
}

/// A stage of the plan.
pub struct Listed {
    /// `NAME-HASH`, below `out/stages`.
    pub folder: String,
    /// The stages that must be done before, by their places in the list.
    pub parents: Vec<usize>,
    /// Into how many pieces it can be divided.
    pub pieces: usize,
    /// How long it took, if it is done.
    pub seconds: Option<f64>,
}

/// A reproduction that is planned.
pub struct Planned {
    config: ReproduceConfig,
    /// Absolute: stages name each other's files.
    out: PathBuf,
    plan: Plan,
}

impl Planned {
    /// Plans, and does nothing.
    ///
    /// # Errors
    /// Settings that cannot work; a folder that cannot be written.
    pub fn new(what: &Reproduce<'_>) -> Result<Self> {
        Self::by(what, experiments::plan)
    }

    /// The same for who has planned it before.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn again(what: &Reproduce<'_>) -> Result<Self> {
        Self::by(what, experiments::plan_again)
    }

    fn by(what: &Reproduce<'_>, plan: fn(&ReproduceConfig, &Path) -> Result<Plan>) -> Result<Self> {
        let mut config = ReproduceConfig::read(what.config, what.sets)?;
        if let Some(lpips) = &what.lpips {
            config.comparison.lpips = Some(lpips.clone());
        }
        // The folder is made by whoever works in it, and removed again where it stays empty ([`crate::data::Claim`]).
        let out = std::path::absolute(what.out).map_err(|error| Error::write(what.out, error))?;
        files::utf8(&out)?;
        Ok(Self { plan: plan(&config, &out)?, config, out })
    }

    /// All stages, in an order in which they can be done.
    ///
    /// # Errors
    /// A site's settings that cannot be.
    pub fn stages(&self) -> Result<Vec<Listed>> {
        let listed = |stage: &experiments::plan::Stage| {
            let seconds = read_record(&stage_folder(&self.out, &stage.key)).map(|record| record.seconds);
            Ok(Listed { folder: stage.key.folder(), parents: stage.parents.clone(), pieces: stage.pieces()?, seconds })
        };
        self.plan.stages.iter().map(listed).collect()
    }

    /// Asks whether the sites can be, and whether the files that are given are what they must be.
    ///
    /// # Errors
    /// What cannot be, unless it is taken as stated.
    pub fn look(&self, devices: &[Device], as_stated: bool, notify: &mut Notify<'_>) -> Result<()> {
        let config = &self.config;
        let scene = config.second_scene.as_ref().map(|scene| &scene.site);
        for site in std::iter::once(&config.site).chain(&config.second_room).chain(scene) {
            plausible::site(site, as_stated, notify)?;
        }
        if let Some(lpips) = &config.comparison.lpips {
            // A file that is none is refused now, not after the trainings.
            Lpips::open(lpips, &devices[0])?;
        }
        Ok(())
    }

    /// Does what is not done yet, so many stages at a time, and writes the tables. `command`: what was typed, for them.
    ///
    /// # Errors
    /// As [`Self::look`]; whatever a stage refuses; what was done before stays done.
    pub fn run(&self, command: &str, devices: &[Device], jobs: usize, as_stated: bool, notify: &mut Notify<'_>) -> Result<()> {
        self.look(devices, as_stated, notify)?;
        let store = self.store(devices)?;
        let all = (0..self.plan.stages.len()).collect();
        let records =
            experiments::with_jobs(&self.plan, &all, &store, devices, jobs, &mut |event| notify(Notice::Stage(&event)))?;
        let results = results::collect(&self.plan, &store, &records)?;
        report::write(&self.out, &self.config, &results, command)
    }

    /// Does the stages whose names begin so, and what they need; how many of how many stages are done then.
    ///
    /// # Errors
    /// As [`Self::run`]; a beginning that no stage has.
    pub fn run_some(
        &self,
        beginnings: &[String],
        devices: &[Device],
        jobs: usize,
        as_stated: bool,
        notify: &mut Notify<'_>,
    ) -> Result<[usize; 2]> {
        let wanted = self.plan.needed(beginnings)?;
        self.look(devices, as_stated, notify)?;
        let store = self.store(devices)?;
        experiments::with_jobs(&self.plan, &wanted, &store, devices, jobs, &mut |event| notify(Notice::Stage(&event)))?;
        let done = self.plan.stages.iter().filter(|stage| store.done(&stage.key).is_some()).count();
        Ok([done, self.plan.stages.len()])
    }

    /// Does one stage, whose parents are done, or some of its pieces, beside other processes that do others. Nothing is asked
    /// that [`Self::look`] asks.
    ///
    /// # Errors
    /// A folder that no stage has; a parent that is not done; another process that does the same; whatever the stage refuses.
    pub fn run_one(&self, folder: &str, pieces: Shard, devices: &[Device], notify: &mut Notify<'_>) -> Result<()> {
        let stage = self.plan.find(folder)?;
        let name = format!("stage-{}", self.plan.stages[stage].key.hash);
        let piece = match pieces {
            Shard::ALL => name,
            Shard { number, of } => format!("{name}-{number}-of-{of}"),
        };
        let store = Store::open_for(&self.out, device_name(devices), &piece)?;
        experiments::run_one(&self.plan, stage, pieces, &store, devices, &mut |event: Event| notify(Notice::Stage(&event)))
    }

    /// Of the whole reproduction.
    fn store(&self, devices: &[Device]) -> Result<Store> {
        let store = Store::open(&self.out, device_name(devices))?;
        atomic::write_text(self.out.join("config.toml"), &self.config.to_toml())?;
        Ok(store)
    }
}

/// As Burn prints it, without the wrapping type.
fn device_name(devices: &[Device]) -> String {
    format!("{:?}", devices[0]).trim_start_matches("Device<").trim_end_matches('>').to_lowercase()
}
