//! Noise that is made: white, shaped, and shared between receivers.

use super::*;
use crate::diagnosis::cube::{Loaded, analytic};
use crate::radar::{Radar, Sampling};
use crate::room::Room;
use crate::support;

/// Noise of four receivers; `shared`: amplitude of what is common to all of them, by frame and chirp.
fn noise(shared: impl Fn(usize, usize) -> f64) -> Evidence {
    let mut radar = Radar::small(12);
    (radar.loops_per_frame, radar.samples_per_chirp) = (32, 64);
    radar.rx_m = (0..4).map(|rx| [0.0019 * f64::from(rx), 0.0, 0.0]).collect();
    let mut part = support::normal(5);
    let mut normal = || Complex64::new(part(), part());
    let mut samples = vec![];
    for frame in 0..12 {
        let common: Vec<Complex64> = (0..32 * 64).map(|i| normal() * shared(frame, i / 64)).collect();
        for _ in 0..4 {
            samples.extend(common.iter().map(|common| common + normal()));
        }
    }
    Evidence::new(Loaded::of_samples(radar, samples, [-1e3, 1e3]), None, None)
}

/// White noise of a receiver without quadrature, in a stated room.
fn real_noise(seed: u64) -> Evidence {
    let mut radar = Radar::small(12);
    (radar.loops_per_frame, radar.samples_per_chirp, radar.sampling) = (32, 128, Sampling::Real);
    radar.rx_m = vec![[0.0; 3], [0.0019, 0.0, 0.0]];
    let parts: Vec<f32> = std::iter::repeat_with(support::normal(seed)).take(12 * 2 * 32 * 128).map(|part| part as f32).collect();
    let walls = Room { left_m: Some(1.2), right_m: Some(1.2), floor_m: Some(1.2), ceiling_m: Some(1.2), ..Room::default() };
    let room = Room { front_m: Some(3.0), ..walls };
    Evidence::new(Loaded::of_samples(radar, analytic(&parts, 128), [-1e3, 1e3]), Some(room), None)
}

#[test]
fn beat_frequencies_that_a_receiver_without_quadrature_has_twice_are_no_colour() {
    let all = |evidence: &Evidence| {
        let mut taken_for_complex = evidence.clone();
        taken_for_complex.radar.sampling = Sampling::Complex;
        let empty = empty_bins(&taken_for_complex);
        coloured(evidence, &(2..127).filter(|&bin| empty[bin]).collect::<Vec<_>>())
    };
    let (mut found, mut found_in_all) = (0, 0);
    for seed in 0..6 {
        let evidence = real_noise(seed);
        found += find(&evidence).len();
        found_in_all += usize::from(all(&evidence).is_some());
    }
    // Where an analytic signal holds nothing, what is beside it has a colour.
    assert_eq!((found, found_in_all), (0, 6));
}

#[test]
fn what_receivers_share_all_the_time_is_correlated_noise_and_bursts_are_none() {
    let bins: Vec<usize> = (2..63).collect();
    let always = correlated(&noise(|_, _| 0.3), &bins).expect("nothing found");
    let rho = always.estimates[0].values[0];
    assert!((rho - 0.09 / 1.09).abs() < 0.02, "{rho}");
    let bursts = noise(|frame, chirp| if [0, 5].contains(&frame) && chirp % 8 == 0 { 2.0 } else { 0.0 });
    assert!(correlated(&bursts, &bins).is_none());
    assert!(correlated(&noise(|_, _| 0.0), &bins).is_none());
}

#[test]
fn what_receivers_share_more_in_some_frames_has_no_name() {
    let bins: Vec<usize> = (2..63).collect();
    let found = correlated(&noise(|frame, _| if frame < 5 { 0.7 } else { 0.4 }), &bins).expect("nothing found");
    assert!(found.id.is_none() && found.estimates.is_empty(), "{found:?}");
}

#[test]
fn noise_that_is_shaped_is_flat_and_one_in_the_maps() {
    let evidence = shaped(|bin| if bin < 10.0 { 0.2 } else { 1.0 });
    let mean = |bins: std::ops::Range<usize>| {
        let cells = evidence.maps().values().chunks_exact(64).flat_map(|row| row[bins.clone()].to_vec());
        cells.map(f64::from).sum::<f64>() / (12 * 32 * bins.len()) as f64
    };
    for bins in [3..8, 14..50] {
        assert!((mean(bins.clone()) - 1.0).abs() < 0.08, "{bins:?}: {}", mean(bins.clone()));
    }
}

#[test]
fn products_of_independent_noise_scatter_as_so_many_independent_ones() {
    let evidence = noise(|_, _| 0.0);
    let bins: Vec<usize> = (2..63).collect();
    let of_frame = |frame: usize| {
        let shared = Shared::of(&evidence, frame, &bins);
        let found = shared.correlations(&shared.scales());
        pairs_of(4).map(|pair| found[pair].norm_sqr()).sum::<f64>() * shared.independent()
    };
    // 72 products: a standard error of 0.12.
    let mean = (0..12).map(of_frame).sum::<f64>() / 72.0;
    assert!((0.65..1.35).contains(&mean), "{mean}");
}

/// Noise of two receivers, whose power over beat frequency (bins from zero, to either side) is so many times what it is elsewhere.
fn shaped(power: impl Fn(f64) -> f64) -> Evidence {
    let mut radar = Radar::small(12);
    (radar.loops_per_frame, radar.samples_per_chirp) = (32, 64);
    radar.rx_m = vec![[0.0; 3], [0.0019, 0.0, 0.0]];
    let mut normal = support::normal(11);
    let inverse = hybridsim_fft::FftPlanner::new().plan_fft_inverse(64);
    let mut samples = vec![];
    for _ in 0..12 * 2 * 32 {
        let mut chirp: Vec<Complex64> =
            (0..64usize).map(|bin| Complex64::new(normal(), normal()) * power(bin.min(64 - bin) as f64).sqrt()).collect();
        inverse.process(&mut chirp);
        samples.extend(chirp);
    }
    Evidence::new(Loaded::of_samples(radar, samples, [-1e3, 1e3]), None, None)
}

#[test]
fn colour_has_a_name_where_it_follows_the_law_and_the_library_has_it() {
    let bins: Vec<usize> = (2..63).collect();
    let knee = |bin: f64| 1.0 + 6.0 / bin.max(0.5);
    let law = coloured(&shaped(knee), &bins).expect("a colour");
    assert_eq!(law.id, Some(effects::coloured_noise::ID));
    // A quarter of the band is louder by 2 dB: no knee has that.
    let other = coloured(&shaped(|bin| if (16.0..24.0).contains(&bin) { 1.6 } else { 1.0 }), &bins).expect("a colour");
    assert!(other.id.is_none() && other.estimates.is_empty() && other.nats > 15.0, "{other:?}");
    assert!(coloured(&shaped(|_| 1.0), &bins).is_none());
    let unknown = coloured(&shaped(knee).lacking(&[effects::coloured_noise::ID]), &bins).expect("a colour");
    assert!(unknown.id.is_none() && unknown.nats > 15.0, "{unknown:?}");
}

#[test]
fn what_receivers_share_is_observed_where_the_library_has_no_name_for_it() {
    let evidence = noise(|_, _| 0.3).lacking(&[effects::correlated_noise::ID]);
    let found = correlated(&evidence, &(2..63).collect::<Vec<_>>()).expect("nothing found");
    assert!(found.id.is_none() && found.behaves_like == Behaviour::NoiseSharedByReceivers && found.nats > 15.0);
}
