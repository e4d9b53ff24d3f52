//! The paper's numbers ("HybridSim: A Physics-Learning Hybrid Digital Twin for mmWave Human Sensing"), to stand beside ours.
//! They were measured on real recordings of another radar, people and room: orders and differences can be compared, levels
//! cannot.

use super::config::BaselineName;
use super::plan::Method;
use super::variants::Variant;

/// What the paper reports of one method under one heading; not all of it everywhere.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Paper {
    pub psnr_db: Option<f64>,
    pub ssim: Option<f64>,
    pub lpips: Option<f64>,
    /// Per cent.
    pub accuracy: Option<f64>,
    pub f1: Option<f64>,
    pub seconds_per_frame: Option<&'static str>,
}

fn scores(psnr_db: f64, ssim: f64, lpips: f64) -> Paper {
    Paper { psnr_db: Some(psnr_db), ssim: Some(ssim), lpips: Some(lpips), ..Default::default() }
}

fn recognised(accuracy: f64, f1: f64) -> Paper {
    Paper { accuracy: Some(accuracy), f1: Some(f1), ..Default::default() }
}

/// Table 1, unseen frames of the training subject.
pub fn intra(method: Method) -> Paper {
    match method {
        Method::Baseline(BaselineName::RfGenesis) => scores(20.03, 0.219, 0.274),
        Method::Baseline(BaselineName::Mmgpe) => scores(20.09, 0.221, 0.261),
        Method::Variant(Variant::Ours) => scores(22.30, 0.262, 0.089),
        _ => Paper::default(),
    }
}

/// Tables 1 (unseen human), 3 and 5, and the recognition of table 2 and of section 4.7, all on the unseen subject.
pub fn cross(method: Method) -> Paper {
    let (found, recognition) = match method {
        Method::Baseline(BaselineName::RfGenesis) => (scores(20.02, 0.218, 0.271), recognised(30.68, 0.2584)),
        Method::Baseline(BaselineName::Mmgpe) => (scores(20.09, 0.220, 0.253), recognised(54.22, 0.4990)),
        Method::Variant(Variant::Ours) => {
            let seconds_per_frame = Some("< 1 (RTX 4090)");
            (scores(22.29, 0.262, 0.084), Paper { seconds_per_frame, ..recognised(92.07, 0.9216) })
        }
        Method::Variant(Variant::Coupled) => (scores(19.12, 0.252, 0.099), recognised(85.61, 0.8492)),
        Method::Variant(Variant::WithoutIndirect) => (Paper::default(), recognised(88.96, 0.8874)),
        Method::Baseline(BaselineName::TwoBounce) => {
            let recognition = Paper { accuracy: Some(41.6), seconds_per_frame: Some("3.44"), ..Default::default() };
            (Paper::default(), recognition)
        }
        Method::Variant(Variant::WithoutNoise) => (Paper::default(), recognised(72.79, 0.6790)),
        Method::Variant(Variant::FixedNoise) => (Paper::default(), recognised(90.51, 0.9068)),
        Method::Variant(Variant::GcnAtInference) => (scores(22.292, 0.2623, 0.085), recognised(86.79, 0.8629)),
        _ => (Paper::default(), Paper::default()),
    };
    with_recognition(found, recognition)
}

/// Table 6: static-removed maps of walking back and forth with arm swing.
pub fn arm_swing(method: Method) -> Paper {
    match method {
        Method::Variant(Variant::GcnAtInference) => scores(22.08, 0.3017, 0.0856),
        Method::Variant(Variant::Ours) => scores(22.41, 0.3023, 0.0854),
        _ => Paper::default(),
    }
}

/// Supplement 8: one more unseen male subject.
pub fn additional(method: Method) -> Paper {
    match method {
        Method::Variant(Variant::Ours) => with_recognition(scores(22.37, 0.262, 0.092), recognised(97.02, 0.9702)),
        _ => Paper::default(),
    }
}

/// Section 4.7: trained on eight of twelve other actions in another room, evaluated on four.
pub fn second_scene(method: Method) -> Paper {
    match method {
        Method::SceneOurs => with_recognition(scores(22.01, 0.241, 0.108), recognised(88.68, 0.8875)),
        _ => Paper::default(),
    }
}

fn with_recognition(found: Paper, recognition: Paper) -> Paper {
    Paper { psnr_db: found.psnr_db, ssim: found.ssim, lpips: found.lpips, ..recognition }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scores_and_recognition_of_a_method_stand_together() {
        let ours = cross(Method::Variant(Variant::Ours));
        assert_eq!((ours.psnr_db, ours.accuracy, ours.f1), (Some(22.29), Some(92.07), Some(0.9216)));
        let fixed = cross(Method::Variant(Variant::FixedNoise));
        assert_eq!((fixed.psnr_db, fixed.accuracy), (None, Some(90.51)));
    }
}
