//! Differences between two methods, recording by recording: recordings differ more than methods do, and paired, less of that is in
//! the way.

use serde::Serialize;

use super::config::BaselineName;
use super::plan::Method;
use super::variants::Variant;
use crate::evaluation::{Evaluation, ScoreSummary};
use crate::metrics::Spread;

/// Paired differences of PSNR, dB.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Behind {
    pub global: Option<Spread>,
    pub moving: Option<Spread>,
    pub person: Option<Spread>,
}

impl Behind {
    /// The first less the second, `[draw][recording]`; what was drawn once is held against every draw of the other. None where
    /// the two were not scored on as many recordings, or were drawn several times but not equally often. The caller sees to it
    /// that the recordings are the same.
    pub fn of(first: &[Vec<Evaluation>], second: &[Vec<Evaluation>]) -> Option<Self> {
        let draws = first.len().max(second.len());
        let [first, second] = [first, second].map(|found| -> Option<Vec<&[Evaluation]>> {
            match found {
                [once] => Some(vec![once; draws]),
                found => (found.len() == draws).then(|| found.iter().map(Vec::as_slice).collect()),
            }
        });
        let (first, second) = (first?, second?);
        let recordings = first.first()?.len();
        if recordings == 0 || first.iter().chain(&second).any(|draw| draw.len() != recordings) {
            return None;
        }
        let region = |of: fn(&Evaluation) -> Option<&ScoreSummary>| {
            let difference = |recording: usize| -> Option<Vec<f64>> {
                let psnr = |draw: &[Evaluation]| Some(of(&draw[recording])?.psnr_db.mean);
                first.iter().zip(&second).map(|(first, second)| Some(psnr(first)? - psnr(second)?)).collect()
            };
            Spread::crossed(&(0..recordings).filter_map(difference).collect::<Vec<_>>())
        };
        Some(Self {
            global: region(|evaluation| evaluation.global.as_ref()),
            moving: region(|evaluation| evaluation.moving.as_ref()),
            person: region(|evaluation| evaluation.person.as_ref()),
        })
    }
}

/// On which recordings a pair is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum On {
    UnseenHuman,
    /// Of the training subject, in the second room.
    HeldOutFrames,
    SecondScene,
}

impl On {
    /// As in tables.
    pub fn title(self) -> &'static str {
        match self {
            Self::UnseenHuman => "unseen human",
            Self::HeldOutFrames => "second room, held-out frames",
            Self::SecondScene => "second scene, other actions",
        }
    }
}

/// Two methods that a reader will want to hold against each other; the full simulator's lead over every other one on the
/// unseen human has a table of its own.
pub fn asked_for(methods: &[Method]) -> Vec<(Method, Method, On)> {
    let noisy = Method::ReceiverNoise;
    let dense = Method::Variant(Variant::DenseSurface);
    let physical = Method::Variant(Variant::Physical);
    let (direct, mirrored) = (Method::Variant(Variant::PhysicalDirect), Method::Variant(Variant::Mirrored));
    let (lobes, dense_lobes) = (noisy(BaselineName::Mmgpe), noisy(BaselineName::MmgpeSurface));
    let mut pairs = vec![
        (physical, dense_lobes, On::UnseenHuman),
        (physical, dense, On::UnseenHuman),
        (physical, Method::Variant(Variant::Likelihood), On::UnseenHuman),
        (physical, Method::OtherMesh, On::UnseenHuman),
        (physical, direct, On::UnseenHuman),
        (mirrored, direct, On::UnseenHuman),
        (mirrored, physical, On::UnseenHuman),
        (mirrored, noisy(BaselineName::TwoBounce), On::UnseenHuman),
        (Method::Variant(Variant::Likelihood), lobes, On::UnseenHuman),
        (dense, dense_lobes, On::UnseenHuman),
        (dense, lobes, On::UnseenHuman),
        (dense, Method::OtherMesh, On::UnseenHuman),
        (dense_lobes, Method::OtherMesh, On::UnseenHuman),
        (dense_lobes, lobes, On::UnseenHuman),
        (Method::Variant(Variant::WithEffects), Method::OtherMesh, On::UnseenHuman),
        (noisy(BaselineName::TwoBounce), Method::Variant(Variant::WithoutIndirect), On::UnseenHuman),
        (Method::OtherMesh, Method::Again, On::UnseenHuman),
        (Method::SceneOurs, Method::SceneUnadapted, On::SecondScene),
        (Method::SceneOurs, Method::SceneAgain, On::SecondScene),
    ];
    for &method in methods {
        if let Method::Adapted(frames) = method
            && frames > 0
        {
            pairs.push((method, Method::FromScratch(frames), On::HeldOutFrames));
            pairs.push((method, Method::Adapted(0), On::HeldOutFrames));
        }
    }
    pairs.retain(|(first, second, _)| methods.contains(first) && methods.contains(second));
    pairs
}

/// A pair with its difference.
#[derive(Clone, Debug, Serialize)]
pub struct Pair {
    pub first: String,
    pub second: String,
    #[serde(skip)]
    pub methods: (Method, Method),
    pub on: On,
    /// The first less the second.
    pub difference: Behind,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pairs_are_asked_for_where_both_are_there() {
        let dense = Method::Variant(Variant::DenseSurface);
        let methods =
            [dense, Method::OtherMesh, Method::Adapted(0), Method::Adapted(4), Method::FromScratch(4), Method::SceneOurs];
        let wanted = vec![
            (dense, Method::OtherMesh, On::UnseenHuman),
            (Method::Adapted(4), Method::FromScratch(4), On::HeldOutFrames),
            (Method::Adapted(4), Method::Adapted(0), On::HeldOutFrames),
        ];
        assert_eq!(asked_for(&methods), wanted);
        assert!(asked_for(&[dense]).is_empty());
    }
}
