use std::sync::Arc;

use super::*;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::{Candidate, Correction, Place, Volume};
use crate::effects::Stage;
use crate::radar::Radar;

/// A static return, whose samples have an image where no reflector can be.
fn static_return(image: Complex64) -> Evidence {
    let mut radar = Radar::small(12);
    (radar.loops_per_frame, radar.samples_per_chirp) = (16, 64);
    let mut evidence = Evidence::in_noise(radar, 3, |[.., n]| Complex64::cis(0.8 * n as f64) * 30.0);
    evidence.cube.each_chirp(|_, chirp| chirp.iter_mut().for_each(|value| *value += image * value.conj()));
    evidence.changed()
}

fn without(image: Complex64) -> Candidate {
    let undo = move |cube: &mut Cube| {
        let scale = (1.0 - image.norm_sqr()).recip();
        cube.each_chirp(|_, chirp| chirp.iter_mut().for_each(|value| *value = (*value - image * value.conj()) * scale));
    };
    Candidate {
        correction: Correction::Inverse(Arc::new(undo), Volume::BY_SAMPLE),
        ..Candidate::new(Behaviour::ConjugateImage, Place::at(Stage::Receiver), 0.0, 0.0)
    }
}

#[test]
fn a_law_that_is_inverted_leaves_what_there_was_without_it() {
    let image = Complex64::new(0.06, -0.08);
    let (with, clean) = (static_return(image), Misfit::of(&static_return(Complex64::ZERO)));
    let before = Misfit::of(&with);
    let after = |image: Complex64| Misfit::after(&with, &with.with(&without(image))).loglik_per_sample;
    // As a density of what was recorded: its volumes were shrunk by 1 − |μ|².
    let wanted = clean.loglik_per_sample - (1.0 - image.norm_sqr()).ln();
    let recovered = (after(image) - before.loglik_per_sample) / (wanted - before.loglik_per_sample);
    assert!((recovered - 1.0).abs() < 0.02, "{recovered} of {}", wanted - before.loglik_per_sample);
    // A wrong one gains nothing.
    assert!(after(-image) < before.loglik_per_sample + 0.02 * (wanted - before.loglik_per_sample));
}

#[test]
fn a_stretch_changes_no_likelihood_but_by_its_volume() {
    let with = static_return(Complex64::ZERO);
    let twice = |cube: &mut Cube| cube.samples.iter_mut().for_each(|value| *value *= 2.0);
    for volume in [Volume::BY_SAMPLE, Volume { alike: 2.0 * 2f64.ln(), ..Volume::KEPT }] {
        let candidate =
            Candidate { correction: Correction::Inverse(Arc::new(twice), volume.clone()), ..without(Complex64::ZERO) };
        let stretched = Misfit::after(&with, &with.with(&candidate));
        let law = stretched.loglik_per_sample - Misfit::of(&with).loglik_per_sample;
        // Nothing is gained; of several laws that all say the same, some say something else.
        assert!((-0.01..1e-6).contains(&law), "{volume:?} {law}");
    }
}
