//! Stages side by side: what can be done together, by several workers of one process.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::path::Path;
use std::sync::mpsc::{Sender, channel};
use std::sync::{Condvar, Mutex, MutexGuard};
use std::thread;

use burn::tensor::Device;

use super::plan::Plan;
use super::run::{Event, one, run_some};
use super::stage::{Record, Store};
use super::steps::Bench;
use super::task::Task;
use crate::error::{Error, Result};

/// What a worker has to tell.
enum Told {
    Begun {
        place: [usize; 2],
        stage: usize,
        known: bool,
    },
    /// `worked`: it was not done already.
    Done {
        stage: usize,
        record: Record,
        worked: bool,
    },
    Failed(Error),
}

/// Stages that one worker does one after the other.
type Group = Vec<usize>;

struct Queue {
    open: VecDeque<Group>,
    done: BTreeSet<usize>,
    /// Somebody trains a simulator. One does at a time: after every backward pass burn-autodiff 0.22.1 looks at all nodes of a graph
    /// that another thread is building, once for each of them (`GraphCleaner::cleanup_orphaned_entries`). What that costs was not
    /// measured.
    trains: bool,
    stopped: bool,
}

/// Shared by the workers.
struct Work<'a> {
    plan: &'a Plan,
    wanted: &'a BTreeSet<usize>,
    store: &'a Store,
    queue: Mutex<Queue>,
    changed: Condvar,
}

/// A worker that panics stops the others, who would wait for what it was at; the panic goes on when all have ended.
struct StopOnPanic<'a>(&'a Work<'a>);

impl Drop for StopOnPanic<'_> {
    fn drop(&mut self) {
        if thread::panicking() {
            self.0.lock().stopped = true;
            self.0.changed.notify_all();
        }
    }
}

/// As [`run_some`] by so many workers, each of which has its share of the cores. Sites are recorded first, by all cores; simulators
/// are trained one after the other. With several workers nothing is said of how far a stage is.
///
/// # Errors
/// The first that a stage has; what others are at is finished and kept.
///
/// # Panics
/// Without a worker.
pub fn with_jobs(
    plan: &Plan,
    wanted: &BTreeSet<usize>,
    store: &Store,
    devices: &[Device],
    jobs: usize,
    notify: &mut dyn FnMut(Event),
) -> Result<Vec<Record>> {
    if jobs == 1 {
        return run_some(plan, wanted, store, devices, notify);
    }
    let is_site = |&&stage: &&usize| matches!(plan.stages[stage].task, Task::Site { .. });
    let of = wanted.len();
    let mut records = BTreeMap::new();
    for (index, &stage) in wanted.iter().filter(is_site).enumerate() {
        records.insert(stage, one(plan, stage, [index, of], store, &mut Bench::new(devices), notify)?);
    }
    let queue = Queue { open: groups(plan, wanted), done: records.keys().copied().collect(), trains: false, stopped: false };
    let work = Work { plan, wanted, store, queue: Mutex::new(queue), changed: Condvar::new() };
    let threads = (thread::available_parallelism().map_or(1, usize::from) / jobs).max(1);
    let pools = (0..jobs).map(|_| rayon::ThreadPoolBuilder::new().num_threads(threads).build());
    let pools = pools.collect::<std::result::Result<Vec<_>, _>>().map_err(|error| Error::Usage {
        message: format!("{jobs} workers with {threads} threads each: {error}"),
        hint: Some("ask for fewer".into()),
    })?;
    let mut failed = None;
    thread::scope(|scope| {
        let (sender, received) = channel();
        for pool in &pools {
            let (work, sender) = (&work, sender.clone());
            scope.spawn(move || {
                let _stop = StopOnPanic(work);
                pool.install(|| work.until_empty(devices, &sender));
            });
        }
        drop(sender);
        for told in received {
            match told {
                Told::Begun { place: [index, of], stage, known } => {
                    notify(Event::Stage { index, of, name: &plan.stages[stage].key.name, known });
                }
                Told::Done { stage, record, worked } => {
                    if worked {
                        notify(Event::Done { name: &plan.stages[stage].key.name, seconds: record.seconds });
                    }
                    records.insert(stage, record);
                }
                Told::Failed(error) => failed = failed.take().or(Some(error)),
            }
        }
    });
    match failed {
        Some(error) => Err(error),
        None => Ok(records.into_values().collect()),
    }
}

/// Everything but sites, in the plan's order. Stages after one another that look at the same recording stay together: its geometry
/// is worked out once for all of them.
fn groups(plan: &Plan, wanted: &BTreeSet<usize>) -> VecDeque<Group> {
    let mut groups: VecDeque<Group> = VecDeque::new();
    let mut last: Option<&Path> = None;
    for &stage in wanted {
        let task = &plan.stages[stage].task;
        if matches!(task, Task::Site { .. }) {
            continue;
        }
        let recording = task.simulated_recording();
        match groups.back_mut().filter(|_| recording.is_some() && recording == last) {
            Some(group) => group.push(stage),
            None => groups.push_back(vec![stage]),
        }
        last = recording;
    }
    groups
}

impl Work<'_> {
    fn until_empty(&self, devices: &[Device], told: &Sender<Told>) {
        let mut bench = Bench::new(devices);
        while let Some(group) = self.next() {
            for &stage in &group {
                let done = self.done(stage, &mut bench, told);
                let mut queue = self.lock();
                match done {
                    Ok((record, worked)) => {
                        queue.done.insert(stage);
                        let _ = told.send(Told::Done { stage, record, worked });
                    }
                    Err(error) => {
                        queue.stopped = true;
                        let _ = told.send(Told::Failed(error));
                    }
                }
                self.changed.notify_all();
                if queue.stopped {
                    return;
                }
            }
            if self.trains(&group) {
                self.lock().trains = false;
                self.changed.notify_all();
            }
        }
    }

    /// The stage's record, and whether there was something to do.
    fn done(&self, stage: usize, bench: &mut Bench, told: &Sender<Told>) -> Result<(Record, bool)> {
        let place = [self.lock().done.len(), self.wanted.len()];
        let mut worked = true;
        let record = one(self.plan, stage, place, self.store, bench, &mut |event| {
            if let Event::Stage { known, .. } = event {
                worked = !known;
                let _ = told.send(Told::Begun { place, stage, known });
            }
        })?;
        Ok((record, worked))
    }

    /// The first stages whose parents are done; waits for them. None: nothing is left, or somebody has failed.
    fn next(&self) -> Option<Group> {
        let mut queue = self.lock();
        loop {
            if queue.stopped || queue.open.is_empty() {
                return None;
            }
            let ready = |group: &Group| {
                let parents = group.iter().flat_map(|&stage| &self.plan.stages[stage].parents);
                let free = !(queue.trains && self.trains(group));
                free && parents.into_iter().all(|parent| queue.done.contains(parent) || group.contains(parent))
            };
            if let Some(first) = queue.open.iter().position(ready) {
                let group = queue.open.remove(first);
                queue.trains |= group.as_ref().is_some_and(|group| self.trains(group));
                return group;
            }
            queue = self.changed.wait(queue).expect("no worker panics while it holds the queue");
        }
    }

    fn trains(&self, group: &Group) -> bool {
        group.iter().any(|&stage| matches!(self.plan.stages[stage].task, Task::Train { .. } | Task::Stability { .. }))
    }

    fn lock(&self) -> MutexGuard<'_, Queue> {
        self.queue.lock().expect("no worker panics while it holds the queue")
    }
}
