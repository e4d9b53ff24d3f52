//! The proof on concealed data, step by step.

use std::{
    any::Any,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    path::Path,
    sync::{
        atomic::{AtomicBool, Ordering},
        mpsc::{self, RecvTimeoutError},
    },
    thread,
    time::Duration,
};

use super::{Notice, Notify, claimed};
use crate::{
    challenge::{
        ChallengeConfig,
        answer::{self, Answers, RunConfig},
        commitment::Commitment,
        score::{self, Score},
        seal, twins,
    },
    data::{Claim, Shard, atomic},
    error::Result,
};

/// Between two looks at whether whoever listens wants the work to end: a person notices twice as much (Nielsen, Usability
/// Engineering, 1993, sec. 5.5).
const LOOK: Duration = Duration::from_millis(50);
/// Of a thread that works: what the main thread of a program has.
const STACK_BYTES: usize = 8 << 20;

/// Which challenge is sealed.
pub struct Seal<'a> {
    /// A config such as configs/challenge.toml.
    pub config: &'a Path,
    /// `key=value` of its settings.
    pub sets: &'a [String],
    /// Secret text that everything is drawn from; without it the operating system draws one.
    pub seed: Option<&'a str>,
    pub out: &'a Path,
}

/// Makes the challenge's folder and settles its secret: shards of it need no seed then. How many cases it will have.
///
/// # Errors
/// Settings that cannot be a challenge; another seed, or other settings, than those begun with.
pub fn begin(what: &Seal<'_>) -> Result<usize> {
    let config = ChallengeConfig::read(what.config, what.sets)?;
    let _claim = Claim::take(what.out)?;
    seal::begin(&config, what.seed, what.out, Shard::ALL)?;
    Ok(config.cases)
}

/// Records the cases of a shard and commits to nothing: [`commit`] to the whole finds them done.
///
/// # Errors
/// As [`begin`], and whatever the recorder refuses.
pub fn cases(what: &Seal<'_>, shard: Shard, notify: &mut Notify<'_>) -> Result<()> {
    let config = ChallengeConfig::read(what.config, what.sets)?;
    let _claim = filled(what.out, shard)?;
    sealing(&config, shard, notify);
    notified_here(notify, |progress| seal::cases(&config, what.seed, what.out, shard, progress)).map(drop)
}

/// Records the cases of a shard that are not there yet, and commits to them.
///
/// # Errors
/// As [`cases`]; a commitment that is there already.
pub fn commit(what: &Seal<'_>, shard: Shard, notify: &mut Notify<'_>) -> Result<Commitment> {
    let config = ChallengeConfig::read(what.config, what.sets)?;
    let _claim = filled(what.out, shard)?;
    sealing(&config, shard, notify);
    notified_here(notify, |progress| seal::seal(&config, what.seed, what.out, shard, progress))
}

fn sealing(config: &ChallengeConfig, shard: Shard, notify: &mut Notify<'_>) {
    let steps = (0..config.cases).filter(|&index| shard.holds(index)).count();
    notify(Notice::Begun { what: "sealing", steps });
}

/// Has the cases diagnosed that have no answer yet.
///
/// # Errors
/// A challenge that cannot be read; answers that cannot be written.
pub fn run(challenge: &Path, out: &Path, config: &RunConfig, notify: &mut Notify<'_>) -> Result<Answers> {
    let _claim = filled(out, config.shard)?;
    notify(Notice::Begun { what: "diagnosing", steps: answer::waiting(challenge, out, config)? });
    answer::run(challenge, out, config, &mut counted(notify))
}

/// Diagnoses every scene once more without its effects; how many.
///
/// # Errors
/// Answers that are not complete; truths that are not what was committed to; reports that cannot be written.
pub fn twins(challenge: &Path, answers: &Path, out: &Path, config: &RunConfig, notify: &mut Notify<'_>) -> Result<usize> {
    let _claim = filled(out, config.shard)?;
    notify(Notice::Begun { what: "twins", steps: answer::waiting(challenge, out, config)? });
    twins::run(challenge, answers, out, config, &mut counted(notify))
}

/// What is held against each other.
pub struct Scoring<'a> {
    pub challenge: &'a Path,
    pub answers: &'a Path,
    /// The twins' reports; without them no recovered misfit is given.
    pub twins: Option<&'a Path>,
    /// Measure anew how strong the effects are.
    pub measure: bool,
    /// Folder for results.md, score.json and psychometric.png.
    pub out: &'a Path,
}

/// Opens the truths, verifies them, and holds the reports against them.
///
/// # Errors
/// Answers or truths that are not what was committed to; a folder that cannot be written.
pub fn score(what: &Scoring<'_>, notify: &mut Notify<'_>) -> Result<Score> {
    let steps = Commitment::read_all(what.challenge)?.iter().map(|part| part.cases).sum();
    let _claim = claimed(what.out)?;
    notify(Notice::Begun { what: "scoring", steps });
    let scored =
        notified_here(notify, |progress| score::score(what.challenge, what.answers, what.twins, what.measure, progress))?;
    scored.write(what.out)?;
    Ok(scored)
}

/// A folder that is filled by this process, or by one for each part.
pub fn filled(folder: &Path, shard: Shard) -> Result<Claim> {
    let claim = Claim::part(folder, shard)?;
    atomic::sweep_all(folder);
    Ok(claim)
}

/// Tells how many are done, or that it still works.
fn counted<'a>(notify: &'a mut Notify<'_>) -> impl FnMut(usize) + 'a {
    let mut known = 0;
    move |done| match std::mem::replace(&mut known, done) == done {
        true => notify(Notice::Still),
        false => notify(Notice::Done(done)),
    }
}

/// Does work whose progress several threads report, and passes the notices on in this one. Where whoever listens unwinds, the work ends at its next step.
fn notified_here<T: Send>(notify: &mut Notify<'_>, work: impl FnOnce(&(dyn Fn(usize) + Sync)) -> T + Send) -> T {
    let (sender, receiver) = mpsc::channel();
    let ended = &AtomicBool::new(false);
    thread::scope(|scope| {
        let working = move || {
            work(&|done| {
                if ended.load(Ordering::Relaxed) {
                    resume_unwind(Box::new("ended by whoever listens"));
                }
                let _ = sender.send(done);
            })
        };
        let worker =
            thread::Builder::new().stack_size(STACK_BYTES).spawn_scoped(scope, working).expect("a thread can be started");
        let received = catch_unwind(AssertUnwindSafe(|| {
            loop {
                match receiver.recv_timeout(LOOK) {
                    Ok(done) => notify(Notice::Done(done)),
                    Err(RecvTimeoutError::Timeout) => notify(Notice::Still),
                    Err(RecvTimeoutError::Disconnected) => break,
                }
            }
        }));
        ended.store(received.is_err(), Ordering::Relaxed);
        let worked = worker.join();
        let unwound: std::result::Result<T, Box<dyn Any + Send>> = received.and(worked);
        unwound.unwrap_or_else(|reason| resume_unwind(reason))
    })
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    #[test]
    fn what_many_threads_do_is_told_in_one_and_ends_when_it_unwinds() {
        let (mut received, here) = (0, thread::current().id());
        let sum = notified_here(
            &mut |notice| {
                assert_eq!(thread::current().id(), here);
                if let Notice::Done(done) = notice {
                    received += done;
                }
            },
            |progress| (1..=100usize).into_par_iter().inspect(|&done| progress(done)).sum::<usize>(),
        );
        assert_eq!((sum, received), (5050, 5050));

        let begun = std::sync::atomic::AtomicUsize::new(0);
        let caught = catch_unwind(AssertUnwindSafe(|| {
            notified_here(&mut |_| resume_unwind(Box::new("enough")), |progress| {
                for done in 0..1000 {
                    begun.store(done, Ordering::Relaxed);
                    thread::sleep(Duration::from_millis(10));
                    progress(done);
                }
            });
        }));
        assert_eq!(caught.unwrap_err().downcast_ref::<&str>(), Some(&"enough"));
        assert!(begun.load(Ordering::Relaxed) < 999);
    }
}
