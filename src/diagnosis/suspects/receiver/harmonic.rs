//! Non-linear receivers: the second harmonic s + κ s² and compression s − κ |s|² s.
//!
//! What was measured is the best prediction of what drives them: see [`Products`](crate::diagnosis::products::Products).

use std::sync::Arc;

use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::finding::{Candidate, Correction, Estimate, Place, Volume};
use crate::diagnosis::products::{Law, Product, without};
use crate::diagnosis::{Cube, Evidence, denoised};
use crate::effects::{self, Stage};

pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.is_real() || evidence.accepted.contains(&effects::adc_saturation::ID) {
        return vec![];
    }
    let known = |id: &str| evidence.accepted.contains(&id);
    let bent = evidence.accepted_unnamed.contains(&Behaviour::Quadratic);
    let products = evidence.products();
    if let Some(laws) = products.mixed() {
        return if bent { vec![] } else { vec![nameless(evidence, laws)] };
    }
    let square = products.square.filter(|_| !known(effects::second_harmonic::ID) && !bent);
    let cube = products.cube.filter(|_| !known(effects::compression::ID));
    square.into_iter().chain(cube).map(|law| candidate(evidence, law)).collect()
}

fn candidate(evidence: &Evidence, law: Law) -> Candidate {
    let Law { product, scatter, .. } = law;
    let share = law.share();
    let level = share.norm();
    let level_db = 20.0 * level.log10();
    let (id, estimate, statement) = if product == Product::Cube {
        (
            effects::compression::ID,
            Estimate::normal("level", -share.re, (0.71 * scatter).hypot(2.0 * denoised::PEAK_DB / 8.7 * level)),
            format!(
                "strong samples come out too small: the receiver compresses, the strongest sample by {:.2} %; its third-order \
                 products lie where neither the room nor the body can be",
                -100.0 * share.re
            ),
        )
    } else {
        (
            effects::second_harmonic::ID,
            Estimate::normal("level_db", level_db, denoised::PEAK_DB.hypot(8.7 * 0.71 * scatter / level)),
            format!(
                "everything has a second harmonic, at twice its beat frequency and velocity: {level_db:.1} dB at the strongest \
                 sample; it follows the square of the measured signal in phase"
            ),
        )
    };
    Candidate { id: Some(id), estimates: vec![estimate], ..nonlinear(evidence, Behaviour::NonLinear, vec![law], statement) }
}

fn nameless(evidence: &Evidence, laws: Vec<Law>) -> Candidate {
    let level = |product: Product| {
        let law = laws.iter().find(|law| law.product == product);
        law.map_or("not seen".into(), |law| format!("{:.1} dB at the strongest sample", 20.0 * law.kappa.norm().log10()))
    };
    let statement = format!(
        "products of the signal with itself lie where neither the room nor the body can be, at differences of beat frequencies \
         and velocities ({}) and at sums ({}): more than a second harmonic; something that the whole signal drives, such as \
         an oscillator that it pulls",
        level(Product::Magnitude),
        level(Product::Square)
    );
    nonlinear(evidence, Behaviour::Quadratic, laws, statement)
}

/// Without a name.
fn nonlinear(evidence: &Evidence, behaves_like: Behaviour, laws: Vec<Law>, statement: String) -> Candidate {
    let (p_value, gain) = (laws.iter().map(|law| law.p_value).fold(1.0, f64::min), laws.iter().map(|law| law.gain).sum());
    let energy = evidence.cube.samples.iter().map(|&value| (value - without(&laws, value)).norm_sqr()).sum();
    Candidate {
        id: None,
        behaves_like,
        estimates: vec![],
        choice: None,
        place: Place::at(Stage::Receiver),
        p_value,
        gain,
        errs_alike: false,
        look_alikes: vec![],
        statement,
        curve: None,
        energy,
        correction: Correction::Inverse(
            Arc::new(move |cube: &mut Cube| {
                cube.each_chirp(|_, chirp| {
                    chirp.iter_mut().for_each(|value| *value = without(&laws, *value));
                });
            }),
            Volume::BY_SAMPLE,
        ),
    }
}
