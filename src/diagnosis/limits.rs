//! How strong an effect that was not found can be at most: it is put into the recording, stronger and stronger, until it
//! is found there (salting, as direct searches for dark matter call it).
//!
//! The library's own operators act on the recorded samples, after everything found was undone. A limit says what this
//! tool would have found in this recording; it knows nothing of variants that hide better than the one put in, for which
//! there is a margin.

use burn::tensor::{Device, Tensor};
use num_complex::Complex64;
use rayon::prelude::*;

use super::config::DiagnosisConfig;
use super::cube::Cube;
use super::detectors::DETECTORS;
use super::evidence::Evidence;
use super::score;
use crate::complex::Complex;
use crate::effects::{self, Context, EffectSetting, Effects};

/// Strengths between an effect's least and most.
const STEPS: usize = 12;
/// Added to the level that is found: phases, frequencies and places that hide better, dB.
const MARGIN_DB: f64 = 10.0;

/// An effect that can be put into recorded samples.
struct Salt {
    id: &'static str,
    /// Who would find it.
    detectors: &'static [&'static str],
    least: f64,
    most: f64,
    /// As a setting of some strength; levels are relative to the recording's peak.
    setting: fn(EffectSetting, f64, &Evidence) -> EffectSetting,
}

const STATIC_FIELD: &[&str] = &["still field", "still field, room unknown"];
const SLOW: &[&str] = &["slow time"];
const ALONG: &[&str] = &["along the chirp"];

const SALTS: [Salt; 15] = [
    Salt {
        id: effects::chirp_ripple::ID,
        detectors: &["chirp"],
        least: 1e3,
        most: 3e6,
        setting: |s, x, _| s.with("deviation_hz", [x]).with("ripple_hz", [4e5]),
    },
    Salt {
        id: effects::chirp_nonlinearity::ID,
        detectors: ALONG,
        least: 3e4,
        most: 1e7,
        setting: |s, x, _| s.with("peak_hz", [x]),
    },
    Salt { id: effects::chirp_droop::ID, detectors: ALONG, least: 0.1, most: 12.0, setting: |s, x, _| s.with("db", [x]) },
    Salt {
        id: effects::phase_noise::ID,
        detectors: SLOW,
        least: 1e-4,
        most: 1.0,
        setting: |s, x, _| s.with("per_chirp_rad", [x]),
    },
    Salt {
        id: effects::chirp_start_jitter::ID,
        detectors: SLOW,
        least: 1e-11,
        most: 1e-7,
        setting: |s, x, _| s.with("jitter_s", [x]),
    },
    Salt {
        id: effects::radar_vibration::ID,
        detectors: SLOW,
        least: 1e-8,
        most: 1e-3,
        setting: |s, x, _| s.with("amplitude_m", [x]).with("frequency_hz", [20.0]),
    },
    Salt { id: effects::gain_drift::ID, detectors: SLOW, least: 1e-3, most: 6.0, setting: |s, x, _| s.with("db", [x]) },
    Salt {
        id: effects::chirp_settling::ID,
        detectors: SLOW,
        least: 1e-4,
        most: 0.6,
        setting: |s, x, _| s.with("depth", [x]).with("chirps", [4.0]),
    },
    Salt {
        id: effects::channel_mismatch::ID,
        detectors: &["geometry"],
        least: 1e-2,
        most: 10.0,
        setting: |s, x, evidence| {
            // Every other receiver, so that no direction of the body does the same.
            let receivers = evidence.radar.rx_m.len();
            s.with("gain_db", (0..receivers).map(|rx| if rx % 2 == 1 { x } else { 0.0 }).collect::<Vec<_>>())
        },
    },
    Salt {
        id: effects::mutual_coupling::ID,
        detectors: &["geometry"],
        least: 1e-3,
        most: 0.5,
        setting: |s, x, _| s.with("level_db", [db(x)]),
    },
    Salt {
        id: effects::tx_leakage::ID,
        detectors: STATIC_FIELD,
        least: 1e-5,
        most: 1.0,
        setting: |s, x, _| s.with("level_db", [db(x)]).with("range_m", [0.1]),
    },
    Salt {
        id: effects::ramp_edge_transient::ID,
        detectors: STATIC_FIELD,
        least: 1e-4,
        most: 3.0,
        setting: |s, x, _| s.with("level_db", [db(x)]).with("samples", [2.0]),
    },
    Salt { id: effects::dc_offset::ID, detectors: STATIC_FIELD, least: 1e-6, most: 1.0, setting: |s, x, _| s.with("i", [x]) },
    Salt {
        id: effects::if_highpass::ID,
        detectors: STATIC_FIELD,
        least: 1e3,
        most: 1e6,
        setting: |s, x, _| s.with("corner_hz", [x]),
    },
    Salt {
        id: effects::spur::ID,
        detectors: &["spur"],
        least: 1e-6,
        most: 1.0,
        setting: |s, x, evidence| {
            // Amid the beat frequencies of the room, off every bin.
            let rate = evidence.radar.sample_rate_hz;
            s.with("level_db", [db(x)]).with("frequency_hz", [(0.23 + 0.37 / evidence.cube.dims[4] as f64) * rate])
        },
    },
];

fn db(amplitude: f64) -> f64 {
    20.0 * amplitude.log10()
}

/// An effect that was not found, and its energy at most, in dB relative to what moves in the recording.
pub struct Limit {
    pub id: &'static str,
    pub at_most_db: f64,
}

/// Limits on what is not among `found`; none for what would not be found at any strength.
///
/// `evidence`: with everything found taken into account; `moving_energy`: of the untouched recording.
pub fn limits(evidence: &Evidence, found: &[&str], moving_energy: f64, thresholds: &DiagnosisConfig) -> Vec<Limit> {
    if evidence.is_real() || moving_energy <= 0.0 {
        return vec![];
    }
    let reference = evidence.peak();
    let of = |salt: &Salt| {
        let strength = |step: usize| salt.least * (salt.most / salt.least).powf(step as f64 / (STEPS - 1) as f64);
        // The least step that is found, as if all above it were.
        let (mut low, mut high, mut energy) = (0, STEPS, None);
        while low < high {
            let step = (low + high) / 2;
            match salted(evidence, salt, strength(step), reference, thresholds) {
                Some(added) => (high, energy) = (step, Some(added)),
                None => low = step + 1,
            }
        }
        let at_most_db = 10.0 * (energy? / moving_energy).log10() + MARGIN_DB;
        at_most_db.is_finite().then_some(Limit { id: salt.id, at_most_db })
    };
    let scored = score::limits(evidence).into_iter().filter(|(id, energy)| !found.contains(id) && *energy > 0.0);
    let scored = scored.map(|(id, energy)| Limit { id, at_most_db: 10.0 * (energy / moving_energy).log10() });
    let salted: Vec<Limit> = SALTS.par_iter().filter(|salt| !found.contains(&salt.id)).filter_map(of).collect();
    // What both bound has the tighter of the two.
    let mut limits: Vec<Limit> = scored.filter(|limit| limit.at_most_db.is_finite()).chain(salted).collect();
    limits.sort_by(|a, b| (a.id, a.at_most_db).partial_cmp(&(b.id, b.at_most_db)).expect("finite"));
    limits.dedup_by_key(|limit| limit.id);
    limits
}

/// Puts an effect in; its energy if it is found.
fn salted(evidence: &Evidence, salt: &Salt, strength: f64, reference: f64, thresholds: &DiagnosisConfig) -> Option<f64> {
    let mut setting = (salt.setting)(EffectSetting::neutral(salt.id), strength, evidence);
    if crate::effects::info(salt.id)?.parameters.iter().any(|parameter| parameter.name == "reference") {
        setting = setting.with("reference", [reference]);
    }
    setting.check("effect").ok()?;
    let (cube, added) = put_in(evidence, &setting);
    let mut with = evidence.clone().changed();
    with.cube = cube;
    let detected = |(index, detector): (usize, &super::detectors::Detector)| {
        salt.detectors.contains(&detector.name)
            && (detector.find)(&with).iter().any(|candidate| {
                let named = candidate.id == Some(salt.id) || candidate.look_alikes.contains(&salt.id);
                named && thresholds.passes(index, candidate, true)
            })
    };
    DETECTORS.iter().enumerate().any(detected).then_some(added)
}

/// The samples with an effect, and the energy that it added.
fn put_in(evidence: &Evidence, setting: &EffectSetting) -> (Cube, f64) {
    let device = Device::flex();
    let effects = Effects::new(std::slice::from_ref(setting), &device);
    let [frames, tx, rx, loops, samples] = evidence.cube.dims;
    let size = tx * rx * loops * samples;
    let farthest_m = evidence.farthest_m();
    let mut cube = evidence.cube.clone();
    let mut added = 0.0;
    for (frame, values) in cube.samples.chunks_exact_mut(size).enumerate().take(frames) {
        let part = |of: fn(&Complex64) -> f64| -> Tensor<4> {
            let data: Vec<f32> = values.iter().map(|value| of(value) as f32).collect();
            Tensor::<1>::from_floats(data.as_slice(), &device).reshape([tx, rx, loops, samples])
        };
        let before = Complex::new(part(|v| v.re), part(|v| v.im));
        let context = Context { radar: &evidence.radar, frame, farthest_m };
        // The difference alone is taken over: the rest keeps its own precision.
        let difference = effects.apply(before.clone(), &context).sub(before).to_host();
        for (value, change) in values.iter_mut().zip(difference) {
            let change = Complex64::new(f64::from(change.re), f64::from(change.im));
            added += change.norm_sqr();
            *value += change;
        }
    }
    (cube, added)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::cube::{Loaded, Split};
    use crate::radar::Radar;

    #[test]
    fn every_salt_is_a_setting_that_the_library_takes_at_all_its_strengths() {
        let mut radar = Radar::small(8);
        (radar.loops_per_frame, radar.samples_per_chirp) = (16, 64);
        let dims = radar.dims();
        let samples = (0..dims.iter().product::<usize>()).map(|i| Complex64::cis(0.7 * (i % 64) as f64) * 100.0).collect();
        let loaded = Loaded {
            cube: Cube::new(dims, samples),
            split: Split { training: (0..6).collect(), held_out: vec![6, 7], block_loops: None },
            starts_s: (0..8).map(|frame| radar.chirp_time_s(frame, 0, 0)).collect(),
            radar,
            extremes: [-1e4, 1e4],
        };
        let evidence = Evidence::new(loaded, None, None);
        for salt in &SALTS {
            assert!(DETECTORS.iter().any(|detector| salt.detectors.contains(&detector.name)), "{}", salt.id);
            let mut before = 0.0;
            for strength in [salt.least, salt.most] {
                let setting = (salt.setting)(EffectSetting::neutral(salt.id), strength, &evidence);
                setting.check(salt.id).unwrap();
                let (_, added) = put_in(&evidence, &setting);
                assert!(added > before, "{} adds {added}, then {before}", salt.id);
                before = added;
            }
        }
    }
}
