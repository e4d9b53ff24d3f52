use std::f64::consts::TAU;

use burn::tensor::Tensor;

use super::*;
use crate::complex::Complex;
use crate::diagnosis::DiagnosisConfig;
use crate::diagnosis::report::Findings;
use crate::diagnosis::select::explain;
use crate::effects::{Choice, Context, ParameterInfo, Stage, Values};
use crate::radar::Radar;

const fn part(name: &'static str) -> ParameterInfo {
    ParameterInfo { name, role: Role::Amplitude, unit: "1", neutral: 0.0, least: -0.5, most: 0.5 }
}

/// Two converters that take turns and differ: an effect that this module alone knows of.
static INTERLEAVED: EffectInfo = EffectInfo {
    id: "interleaved_converter",
    card: "",
    stage: Stage::Receiver,
    needs_person: false,
    title: "two interleaved converters that differ",
    explanation: "Even and odd samples have another gain and phase: everything appears again half a sample rate away.",
    equation: "s_n → s_n + (re + j im) (−1)^n s_n",
    parameters: &[part("re"), part("im")],
    choice: Choice::None,
    look_alikes: &[],
    separate_by: "a tone on the test input",
    operator: Operator::Signal(interleaved),
};

fn interleaved(signal: Complex<4>, values: &Values, context: &Context<'_>) -> Complex<4> {
    let samples = context.radar.samples_per_chirp;
    let turns: Tensor<4> = values.tensor((0..samples).map(|n| 1.0 - 2.0 * (n % 2) as f64).collect(), [1, 1, 1, samples]);
    let factor = Complex::new(turns.clone() * values.scalar::<4>("re"), turns * values.scalar::<4>("im"));
    signal.clone().add(signal.mul(factor))
}

/// Movers and static clutter, seen by a receiver that does something to every sample.
fn evidence(seed: u64, receiver: impl Fn(Complex64, usize) -> Complex64) -> Evidence {
    of_receivers(seed, |_, value, sample| receiver(value, sample))
}

/// The same with receivers that differ.
fn of_receivers(seed: u64, receiver: impl Fn(usize, Complex64, usize) -> Complex64) -> Evidence {
    let mut radar = Radar::small(12);
    (radar.loops_per_frame, radar.samples_per_chirp) = (32, 64);
    // Beat frequency and Doppler in cells, amplitude.
    let things = [(9.0, 6.3, 60.0), (11.5, -8.2, 50.0), (14.2, 10.4, 40.0), (7.3, 0.0, 90.0), (12.8, 0.0, 70.0)];
    Evidence::in_noise(radar, seed, |[frame, channel, index, sample]| {
        let of = |(range, doppler, amplitude): &(f64, f64, f64)| {
            // What moves is speckle: another phase in every frame and channel.
            let free =
                if *doppler == 0.0 { channel as f64 * range } else { (frame * frame) as f64 * 0.37 * range + channel as f64 };
            amplitude * Complex64::cis(TAU * (range * sample as f64 / 64.0 + doppler * index as f64 / 32.0) + free)
        };
        receiver(channel, things.iter().map(of).sum(), sample)
    })
}

fn by_interleaving(factor: Complex64) -> impl Fn(Complex64, usize) -> Complex64 {
    move |value, sample| value * (1.0 + factor * if sample % 2 == 0 { 1.0 } else { -1.0 })
}

fn library_with_it() -> &'static [&'static EffectInfo] {
    Box::leak([effects::library(), &[&INTERLEAVED]].concat().into_boxed_slice())
}

fn named<'a>(found: &'a [Candidate], id: &str) -> Option<&'a Candidate> {
    found.iter().find(|candidate| candidate.id == Some(id))
}

fn value(candidate: &Candidate, name: &str) -> (f64, [f64; 2]) {
    let estimate = candidate.estimates.iter().find(|estimate| estimate.name == name).unwrap();
    (estimate.values[0], estimate.ci90[0])
}

#[test]
fn an_effect_that_is_one_file_is_detected_fitted_undone_and_reported() {
    let truth = Complex64::new(0.03, -0.02);
    let mut evidence = evidence(5, by_interleaving(truth));
    assert!(named(&find(&evidence), INTERLEAVED.id).is_none());
    evidence.library = library_with_it().into();
    let found = find(&evidence);
    let candidate = named(&found, INTERLEAVED.id).unwrap_or_else(|| panic!("{found:?}"));
    for (name, wanted) in [("re", truth.re), ("im", truth.im)] {
        let (found, _) = value(candidate, name);
        assert!((found - wanted).abs() < 1e-3, "{name}: {found}");
    }
    let undone = evidence.with(candidate);
    assert!(named(&find(&undone), INTERLEAVED.id).is_none());
    let explanation = explain(evidence.clone(), &DiagnosisConfig::default(), &mut |_| {});
    let findings = Findings::of(&explanation, 1.0);
    let effect =
        findings.effects.iter().find(|effect| effect.id == INTERLEAVED.id).unwrap_or_else(|| panic!("{:?}", findings.effects));
    assert_eq!(effect.equation, INTERLEAVED.equation);
    assert!(effect.statement.contains("half a sample rate away") && effect.probability > 0.99, "{effect:?}");
    assert!(effect.evidence.held_out_loglik_gain > 100.0);
}

#[test]
fn an_effect_that_is_not_there_is_bounded() {
    let mut evidence = evidence(6, |value, _| value);
    evidence.library = library_with_it().into();
    assert!(find(&evidence).is_empty());
    let limits = limits(&evidence);
    let energy_of = |id: &str| limits.iter().find(|(known, _)| *known == id).unwrap().1;
    let all: f64 = evidence.cube.samples.iter().map(Complex64::norm_sqr).sum();
    // Some 1500 times below the signal, as the noise of so many samples lets tell: and not better than that.
    let level_db = 10.0 * (energy_of(INTERLEAVED.id) / all).log10();
    assert!((-75.0..-45.0).contains(&level_db), "{level_db}");
    assert!(energy_of(effects::iq_imbalance::ID) > 0.0);
}

/// Q' = g (Q cos φ + I sin φ).
fn unbalanced(value: Complex64, gain_db: f64, phase_deg: f64) -> Complex64 {
    let (gain, angle) = (10f64.powf(gain_db / 20.0), phase_deg.to_radians());
    Complex64::new(value.re, gain * (value.im * angle.cos() + value.re * angle.sin()))
}

#[test]
fn limits_hold() {
    let all = |evidence: &Evidence| evidence.cube.samples.clone();
    let held = (0..20).filter(|seed| {
        // Below what is found.
        let truth = Complex64::from_polar(3e-4, *seed as f64);
        let [mut with, without] = [truth, Complex64::ZERO].map(|factor| evidence(200 + seed, by_interleaving(factor)));
        with.library = library_with_it().into();
        let energy: f64 = all(&with).iter().zip(all(&without)).map(|(a, b)| (a - b).norm_sqr()).sum();
        limits(&with).iter().any(|(id, limit)| *id == INTERLEAVED.id && *limit > energy)
    });
    // Nine of ten at least: fewer than 15 of 20 would be by chance once in a hundred.
    let held = held.count();
    assert!(held >= 15, "{held} of 20");
}

#[test]
fn what_changes_each_sample_for_itself_is_told_from_what_does_not() {
    let evidence = evidence(12, |value, _| value);
    let size: usize = evidence.cube.dims[1..].iter().product();
    let is = |info: &'static EffectInfo, value: f64| {
        let directions = Direction::all(info);
        let values = vec![value; directions.len()];
        let drive = Drive::new(info, &evidence, evidence.peak()).unwrap();
        drive.is_by_sample(&evidence.cube.samples[..size], &Amplitudes { directions, values })
    };
    assert!(is(&effects::iq_imbalance::INFO, 0.3) && is(&effects::compression::INFO, 0.1));
    assert!(!is(&effects::object_radar_object::INFO, 0.1) && !is(&effects::chirp_nonlinearity::INFO, 1e6));
}

#[test]
fn receivers_that_differ_have_values_of_their_own() {
    let gains_db = [0.5, -0.3];
    let evidence = of_receivers(10, |receiver, value, _| unbalanced(value, gains_db[receiver], 1.0));
    let found = find(&evidence);
    let image = named(&found, effects::iq_imbalance::ID).unwrap_or_else(|| panic!("{found:?}"));
    let gains = image.estimates.iter().find(|estimate| estimate.name == "gain_db").unwrap();
    assert!(gains.values.iter().zip(gains_db).all(|(found, wanted)| (found - wanted).abs() < 0.03), "{gains:?}");
    assert!(named(&find(&evidence.with(image)), effects::iq_imbalance::ID).is_none());
}

#[test]
fn something_else_at_the_mirrored_place_of_one_return_is_no_image() {
    let radar = Radar { loops_per_frame: 32, samples_per_chirp: 64, ..Radar::small(12) };
    for seed in 0..8 {
        // The same in all frames, of any phase in each channel.
        let evidence = Evidence::in_noise(radar.clone(), seed, |[_, channel, _, sample]| {
            let tone =
                |range: f64, amplitude: f64, turns: f64| amplitude * Complex64::cis(TAU * (range * sample as f64 / 64.0 + turns));
            tone(9.0, 90.0, 0.1 * channel as f64) + tone(-9.0, 4.0, 0.37 * (seed as f64 + 1.0) * (channel as f64 + 1.0))
        });
        let found = find(&evidence);
        assert!(found.is_empty(), "{seed}: {found:?}");
    }
}

#[test]
fn without_its_effect_an_image_is_an_unknown_of_its_family() {
    let evidence = evidence(11, |value, _| unbalanced(value, 0.4, 2.0));
    let lacking = evidence.clone().lacking(&[effects::iq_imbalance::ID]);
    let found = find(&lacking);
    assert!(matches!(found.as_slice(), [Candidate { id: None, behaves_like: Behaviour::ConjugateImage, .. }]), "{found:?}");
    assert!(found[0].nats > 100.0 && find(&lacking.with(&found[0])).is_empty());
    // With it, the field has nothing to add.
    let found = find(&evidence);
    assert!(
        found.iter().all(|candidate| candidate.id.is_some()) && named(&found, effects::iq_imbalance::ID).is_some(),
        "{found:?}"
    );
}

#[test]
fn receivers_of_the_library_are_found_with_what_they_do() {
    let branches = find(&evidence(7, |value, _| unbalanced(value, 0.4, 2.0)));
    let image = named(&branches, effects::iq_imbalance::ID).unwrap();
    for (name, wanted, error) in [("gain_db", 0.4, 0.02), ("phase_deg", 2.0, 0.1)] {
        let (found, [low, high]) = value(image, name);
        assert!((found - wanted).abs() < error && (low..high).contains(&wanted), "{name}: {found} in {low} to {high}");
    }
    // Levels are relative to the strongest sample, which is some 300.
    let square = find(&evidence(8, |value, _| value + value * value * 1e-4));
    let harmonic = named(&square, effects::second_harmonic::ID).unwrap();
    let (level_db, _) = value(harmonic, "level_db");
    assert!((level_db - 20.0 * (1e-4 * 300f64).log10()).abs() < 1.0, "{level_db}");
    let cube = find(&evidence(9, |value, _| value * (1.0 - 1e-6 * value.norm_sqr())));
    assert!(cube.iter().all(|candidate| candidate.id.is_some()), "{cube:?}");
    let compression = named(&cube, effects::compression::ID).unwrap();
    let (level, _) = value(compression, "level");
    assert!((level / (1e-6 * 300f64.powi(2)) - 1.0).abs() < 0.2, "{level}");
}

#[test]
fn intervals_hold() {
    let truth = Complex64::new(0.03, -0.02);
    let held = (20..30).flat_map(|seed| {
        let mut evidence = evidence(seed, by_interleaving(truth));
        evidence.library = library_with_it().into();
        let found = find(&evidence);
        let candidate = named(&found, INTERLEAVED.id).unwrap_or_else(|| panic!("{found:?}"));
        [("re", truth.re), ("im", truth.im)].map(|(name, wanted)| {
            let (_, [low, high]) = value(candidate, name);
            (low..high).contains(&wanted)
        })
    });
    // Of 20 intervals of 90 % fewer hold once in a hundred times.
    let held = held.filter(|held| *held).count();
    assert!(held >= 15, "{held} of 20");
}

#[test]
fn chances_are_bounds_where_nothing_is_there() {
    let chances: Vec<f64> = (0..40)
        .flat_map(|seed| {
            let evidence = evidence(100 + seed, |value, _| value);
            let reference = evidence.peak();
            let asked = [&effects::iq_imbalance::INFO, &effects::second_harmonic::INFO];
            Fit::at_zero(&evidence, &asked, reference).into_iter().flatten().map(|fit| fit.p_value).collect::<Vec<_>>()
        })
        .collect();
    assert!(chances.len() >= 60, "{}", chances.len());
    // Corrected for movers and static clutter, and for receivers together and apart, of which some say the same.
    for level in [0.01, 0.05, 0.2, 0.5] {
        let below = chances.iter().filter(|chance| **chance < level).count();
        let chance = crate::diagnosis::statistics::poisson_tail(below, level * chances.len() as f64);
        assert!(chance > 1e-3, "{below} of {} below {level}: {chance}", chances.len());
    }
}
