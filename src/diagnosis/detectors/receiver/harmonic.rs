//! Products of the signal with itself that no effect of the library makes: |s|² beside s².
//!
//! What was measured is the best prediction of what drives them: see [`Products`](crate::diagnosis::products::Products).

use crate::diagnosis::Evidence;
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::finding::{Candidate, Correction, Place, Volume};
use crate::diagnosis::products::{Law, Product, without};
use crate::effects::{self, Stage};

/// At most one candidate: products that no single effect of the library makes. None of real samples, nor once the receiver was
/// found to bend the signal.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    let is_bent =
        evidence.accepted.contains(&effects::adc_saturation::ID) || evidence.accepted_unnamed.contains(&Behaviour::Quadratic);
    if evidence.is_real() || is_bent {
        return vec![];
    }
    evidence.products().mixed().map(|laws| nameless(evidence, laws)).into_iter().collect()
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
    let (p_value, nats) = (laws.iter().map(|law| law.p_value).fold(1.0, f64::min), laws.iter().map(|law| law.gain).sum());
    let energy = evidence.cube.samples.iter().map(|&value| (value - without(&laws, value)).norm_sqr()).sum();
    Candidate {
        statement,
        energy,
        correction: Correction::inverse(Volume::BY_SAMPLE, move |cube| {
            cube.each_chirp(|_, chirp| {
                chirp.iter_mut().for_each(|value| *value = without(&laws, *value));
            });
        }),
        ..Candidate::new(Behaviour::Quadratic, Place::at(Stage::Receiver), p_value, nats)
    }
}
