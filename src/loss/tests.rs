use burn::tensor::{DType, Device, TensorData};
use rand::{RngExt, SeedableRng};

use super::*;
use crate::heatmap::{Window, synthetic};

const DIMS: [usize; 5] = [1, 2, 2, 4, 6];

fn radar() -> Radar {
    let mut radar = Radar { loops_per_frame: 4, samples_per_chirp: 6, ..synthetic::radar() };
    radar.rx_m.truncate(2);
    radar
}

fn noise(seed: u64) -> Vec<f64> {
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
    (0..DIMS.iter().product()).map(|_| random.random::<f64>() - 0.5).collect()
}

fn tensor(values: Vec<f64>, device: &Device) -> Tensor<5> {
    Tensor::from_data(TensorData::new(values, DIMS), (device, DType::F64))
}

fn signal(seed: u64, device: &Device) -> Complex<5> {
    Complex::new(tensor(noise(seed), device), tensor(noise(seed + 100), device))
}

/// The paper's loss.
fn db() -> LossConfig {
    LossConfig { scale: Scale::Db, ..Default::default() }
}

fn loss(config: &LossConfig, device: &Device) -> DbLoss {
    DbLoss::new(&radar(), &HeatmapConfig::default(), config, 0.2, (device, DType::F64)).unwrap()
}

#[test]
fn a_signal_has_no_distance_to_itself_and_ten_times_its_amplitude_is_twenty_decibels_away() {
    let device = Device::flex();
    for combine in [Combine::Each, Combine::Mean] {
        let loss = loss(&LossConfig { combine, ..db() }, &device);
        let measured = loss.maps_db(signal(1, &device));
        assert_eq!(loss.loss(signal(1, &device), measured.clone()).into_scalar::<f64>(), 0.0);
        let louder = loss.loss(signal(1, &device).scale_by(10.0), measured).into_scalar::<f64>();
        assert!((louder - 400.0).abs() < 1e-3, "{combine:?}: {louder}");
    }
}

#[test]
fn a_linear_loss_hardly_sees_what_is_weak() {
    let device = Device::flex();
    // Half the amplitude, of everything or of what is far below the strongest cell: decibels weigh both alike.
    let lost = |scale: Scale, level: f64| {
        let loss = loss(&LossConfig { scale, ..Default::default() }, &device);
        let measured = loss.maps_db(signal(1, &device).scale_by(level));
        loss.loss(signal(1, &device).scale_by(0.5 * level), measured).into_scalar::<f64>()
    };
    let ratio = |scale: Scale| lost(scale, 0.01) / lost(scale, 1.0);
    assert!((ratio(Scale::Linear) - 1e-4).abs() < 1e-6, "{}", ratio(Scale::Linear));
    assert!((ratio(Scale::Db) - 1.0).abs() < 0.01, "{}", ratio(Scale::Db));
}

#[test]
fn the_likelihood_finds_a_level_in_speckle_and_noise_where_decibels_do_not() {
    let device = Device::flex();
    let dims = [1, 1, 1, 64, 64];
    let radar = Radar { loops_per_frame: 64, samples_per_chirp: 64, tx_m: vec![[0.0; 3]], rx_m: vec![[0.0; 3]], ..radar() };
    let draw = |seed: u64, scale: f64| {
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(seed);
        let values = (0..4096).map(|_| scale * rand_distr::Distribution::<f64>::sample(&rand_distr::StandardNormal, &mut random));
        let values: Vec<f64> = values.collect();
        Tensor::<5>::from_data(TensorData::new(values, dims), (&device, DType::F64))
    };
    // Signal and noise of equal power; the same law simulates a level that is not known.
    let measured = Complex::new(draw(1, 2f64.sqrt()), draw(2, 2f64.sqrt()));
    let best = |value: &dyn Fn(f64) -> f64| {
        let levels: Vec<f64> = (-60..=60).map(|step| f64::from(step) / 10.0).collect();
        levels.into_iter().min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap()
    };
    let silent = || Complex::new(draw(3, 0.0), draw(3, 0.0));
    let scale = |level_db: f64| 10f64.powf(level_db / 20.0);
    let of = |scale: Scale| {
        let config = LossConfig { scale, ..Default::default() };
        DbLoss::new(&radar, &HeatmapConfig::default(), &config, 100.0, (&device, DType::F64)).unwrap()
    };
    let exact = of(Scale::Likelihood);
    let variance =
        |level_db: f64| Tensor::<1>::from_data(TensorData::from([2.0 * scale(level_db).powi(2)]), (&device, DType::F64));
    let found = best(&|level| exact.deviance(silent(), Some(variance(level)), measured.clone()).into_scalar::<f64>());
    assert!(found.abs() < 0.2, "{found} dB");
    // The mean of the decibels of an exponential is 2.5 dB below those of its mean: Euler's constant in dB.
    let decibels = of(Scale::Db);
    let expected = decibels.maps_db(measured).mean().into_scalar::<f64>()
        - 10.0 * (2.0 * HeatmapConfig::default().noise_gain(&radar)).log10();
    assert!((expected + 2.5).abs() < 0.2, "{expected} dB");
}

#[test]
fn a_level_is_found_from_one_draw_of_speckle_in_another() {
    let device = Device::flex();
    let count = 1 << 16;
    let tensor = |values: Vec<f64>| Tensor::<3>::from_data(TensorData::new(values, [1, 1, count]), (&device, DType::F64));
    let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(11);
    let mut draws = |mean: f64| -> Vec<f64> {
        (0..count).map(|_| mean * rand_distr::Distribution::<f64>::sample(&rand_distr::Exp1, &mut random)).collect()
    };
    let mut worst = [0.0f64; 2];
    for over_noise_db in [0.0, 10.0, 20.0, 30.0] {
        let mean = 10f64.powf(over_noise_db / 10.0);
        let (measured, simulated) = (tensor(draws(mean + 1.0)).log(), tensor(draws(mean)));
        let deviance = |level_db: f64, as_a_draw: bool| {
            let power = simulated.clone() * 10f64.powf(level_db / 10.0);
            let expected = power.clone() + 1.0;
            let ratio_db = (measured.clone() - expected.clone().log()) * (10.0 / std::f64::consts::LN_10);
            let share = if as_a_draw { power.clone() / (power + expected) } else { power * 0.0 };
            likelihood::moving_deviance(ratio_db, share).mean().into_scalar::<f64>()
        };
        for (worst, as_a_draw) in worst.iter_mut().zip([true, false]) {
            let levels = (-20..=40).map(|step| f64::from(step) / 4.0);
            let value = |level_db: f64| deviance(level_db, as_a_draw);
            let found = levels.min_by(|a, b| value(*a).total_cmp(&value(*b))).unwrap();
            *worst = worst.max(found.abs());
        }
    }
    assert!(worst[0] <= 1.0, "{} dB", worst[0]);
    // A draw that is taken for the mean makes what moves too strong.
    assert!(worst[1] >= 6.0, "{} dB", worst[1]);
}

/// A radar of one antenna pair, and its likelihood.
fn likelihood(loops: usize, samples: usize, heatmap: &HeatmapConfig, device: &Device) -> DbLoss {
    let one = vec![[0.0; 3]];
    let radar = Radar { loops_per_frame: loops, samples_per_chirp: samples, tx_m: one.clone(), rx_m: one, ..radar() };
    let config = LossConfig { scale: Scale::Likelihood, ..Default::default() };
    DbLoss::new(&radar, heatmap, &config, 1.0, (device, DType::F64)).unwrap()
}

#[test]
fn under_noise_alone_each_kind_of_cell_has_the_deviance_of_its_law() {
    let device = Device::flex();
    let (loops, samples) = (16, 4096);
    for window in [Window::Hann, Window::Hamming, Window::Rectangular] {
        let heatmap = HeatmapConfig { doppler_window: window, range_window: Window::Rectangular, ..Default::default() };
        let loss = likelihood(loops, samples, &heatmap, &device);
        let mut random = rand_chacha::ChaCha8Rng::seed_from_u64(5);
        let mut draw = || {
            let normal = (0..loops * samples).map(|_| rand_distr::Distribution::sample(&rand_distr::StandardNormal, &mut random));
            let values: Vec<f64> = normal.collect();
            Tensor::<5>::from_data(TensorData::new(values, [1, 1, 1, loops, samples]), (&device, DType::F64))
        };
        let measured = loss.cells(Complex::new(draw(), draw()), None, None);
        let silence = draw() * 0.0;
        let noise = Tensor::from_data(
            TensorData::from([[[likelihood::mean_logarithm(loss.noise.static_profile)]]]),
            (&device, DType::F64),
        );
        let silent = loss.cells(Complex::new(silence.clone(), silence), Some(loss.noise.moving.clone()), Some(noise));
        // Row by row: the mean of x − ln x − 1 of an exponential is γ. A rectangular window leaves nothing at zero Doppler.
        let share = silent.share(loss.floor_amplitude.powi(2));
        let rows = likelihood::moving_deviance(measured.moving_db - silent.moving_db, share).mean_dim(2);
        for (row, deviance) in rows.into_data().iter::<f64>().enumerate() {
            let expected = if window == Window::Rectangular && row == loops / 2 { 0.0 } else { 0.5772 };
            assert!((deviance - expected).abs() < 0.05, "{window:?} {row}: {deviance}");
        }
        let ratio = measured.static_db.unwrap() - silent.static_db.unwrap();
        assert!(ratio.clone().mean().into_scalar::<f64>().abs() < 0.3, "{window:?}: {ratio}");
        let deviance = likelihood::static_deviance(ratio).mean().into_scalar::<f64>();
        assert!((deviance - 0.5).abs() < 0.05, "{window:?}: {deviance}");
    }
}

#[test]
fn a_static_return_that_is_not_there_is_pulled_by_its_error_and_one_that_moves_is_not() {
    let device = Device::flex().autodiff();
    let (loops, samples) = (8, 16);
    let loss = likelihood(loops, samples, &HeatmapConfig::default(), &device);
    // A tone in one range cell, at zero Doppler or three cells beside it; 40 dB above what is measured, and 80.
    let pull = |doppler: f64, level_db: f64| {
        let tone = |scale: f64, part: fn(f64) -> f64| {
            let angle = |index: usize, sample: usize| {
                std::f64::consts::TAU * (5.0 * sample as f64 / samples as f64 + doppler * index as f64 / loops as f64)
            };
            let values: Vec<f64> = (0..loops * samples).map(|n| scale * part(angle(n / samples, n % samples))).collect();
            Tensor::<5>::from_data(TensorData::new(values, [1, 1, 1, loops, samples]), (&device, DType::F64))
        };
        let signal = |scale: f64| Complex::new(tone(scale, f64::cos), tone(scale, f64::sin));
        // In nepers, so that the gradient is a pull for each relative change.
        let level = Tensor::<1>::from_data(TensorData::from([level_db * std::f64::consts::LN_10 / 20.0]), (&device, DType::F64));
        let level = level.require_grad();
        let amplitude = level.clone().exp().reshape([1, 1, 1, 1, 1]);
        let clean = Complex::new(tone(1e-5, f64::cos) * amplitude.clone(), tone(1e-5, f64::sin) * amplitude);
        let variance = Tensor::<1>::from_data(TensorData::from([1e-20]), (&device, DType::F64));
        let gradients = loss.deviance(clean, Some(variance), signal(1e-5)).backward();
        level.grad(&gradients).unwrap().into_scalar::<f64>()
    };
    let ratio = |doppler: f64| pull(doppler, 80.0) / pull(doppler, 40.0);
    assert!((ratio(0.0) - 2.0).abs() < 0.01, "static: {}", ratio(0.0));
    assert!((ratio(3.0) - 1.0).abs() < 0.01, "moving: {}", ratio(3.0));
}

#[test]
fn static_returns_count_in_the_likelihood_where_they_are_not_removed() {
    let device = Device::flex();
    let deviance = |static_removed: bool, signal: Complex<5>| {
        let loss = loss(&LossConfig { scale: Scale::Likelihood, static_removed, ..Default::default() }, &device);
        loss.deviance(signal, None, self::signal(1, &device)).into_scalar::<f64>()
    };
    let shifted = || {
        let signal = signal(1, &device);
        Complex::new(signal.re + 0.5, signal.im)
    };
    assert!(deviance(false, shifted()) > deviance(false, signal(1, &device)) + 1e-3);
    assert!((deviance(true, shifted()) - deviance(true, signal(1, &device))).abs() < 1e-9);
}

#[test]
fn the_likelihood_has_no_clamp() {
    let config = LossConfig { scale: Scale::Likelihood, clamp_db: Some(-40.0), ..Default::default() };
    let error = DbLoss::new(&radar(), &HeatmapConfig::default(), &config, 1.0, &Device::flex()).unwrap_err();
    assert!(error.to_string().contains("clamp_db"), "{error}");
}

#[test]
fn antennas_are_chosen_and_averaged_as_the_settings_say() {
    let device = Device::flex();
    let dims = |config: LossConfig| loss(&config, &device).maps_db(signal(1, &device)).dims();
    assert_eq!(dims(db()), [4, 4, 6]);
    assert_eq!(dims(LossConfig { channels: vec![3, 0], ..db() }), [2, 4, 6]);
    assert_eq!(dims(LossConfig { combine: Combine::Mean, ..db() }), [1, 4, 6]);
    let all = loss(&db(), &device).maps_db(signal(1, &device));
    let last = loss(&LossConfig { channels: vec![3], ..db() }, &device).maps_db(signal(1, &device));
    assert_eq!((all.narrow(0, 3, 1) - last).abs().max().into_scalar::<f64>(), 0.0);
    let error = DbLoss::new(&radar(), &HeatmapConfig::default(), &LossConfig { channels: vec![4], ..db() }, 1.0, &device);
    assert_eq!(error.unwrap_err().to_string(), "`loss.channels` is 4, expected 0 to 3: one for each antenna pair");
}

pub(crate) fn gradients_agree_with_central_differences_for_every_setting() {
    let device = Device::flex().autodiff();
    let settings = [
        db(),
        LossConfig { combine: Combine::Mean, channels: vec![1, 2], ..db() },
        LossConfig { clamp_db: Some(-15.0), static_removed: true, ..db() },
        LossConfig { scale: Scale::Linear, ..Default::default() },
        LossConfig { scale: Scale::Likelihood, ..Default::default() },
        LossConfig { scale: Scale::Likelihood, static_removed: true, combine: Combine::Mean, ..Default::default() },
    ];
    for config in settings {
        let loss = loss(&config, &device);
        let measured = signal(2, &device);
        let start = noise(1);
        let value = |re: Tensor<5>| {
            let simulated = Complex::new(re.clone(), tensor(noise(101), &device));
            // The noise's level may follow the signal.
            let variance = (re.clone() * re).mean() * 0.1;
            match loss.is_likelihood() {
                true => loss.deviance(simulated, Some(variance), measured.clone()),
                false => loss.loss(simulated, loss.maps_db(measured.clone())),
            }
        };
        let tracked = tensor(start.clone(), &device).require_grad();
        let gradients = value(tracked.clone()).backward();
        let found: Vec<f64> = tracked.grad(&gradients).unwrap().into_data().iter::<f64>().collect();
        let step = 1e-6;
        for index in (0..start.len()).step_by(5) {
            let moved = |by: f64| {
                let mut values = start.clone();
                values[index] += by;
                value(tensor(values, &device)).into_scalar::<f64>()
            };
            let wanted = (moved(step) - moved(-step)) / (2.0 * step);
            crate::support::compared(&[wanted]);
            let difference = (found[index] - wanted).abs();
            assert!(difference < 1e-5 * (1.0 + wanted.abs()), "{config:?} {index}: found {}, wanted {wanted}", found[index]);
        }
    }
}

#[test]
fn a_clamped_cell_does_not_pull_and_silence_gives_no_nan() {
    let device = Device::flex().autodiff();
    let loss = loss(&LossConfig { clamp_db: Some(-40.0), ..db() }, &device);
    let quiet = |scale: f64| tensor(noise(1), &device) * scale;
    let measured = loss.maps_db(Complex::new(quiet(1e-9), quiet(0.0))).detach();
    for scale in [0.0, 1e-8] {
        let tracked = quiet(scale).detach().require_grad();
        let value = loss.loss(Complex::new(tracked.clone(), quiet(0.0)), measured.clone());
        let gradients = value.backward();
        assert_eq!(value.into_scalar::<f64>(), 0.0);
        let gradient: Vec<f64> = tracked.grad(&gradients).unwrap().into_data().iter::<f64>().collect();
        assert!(gradient.iter().all(|g| *g == 0.0), "{gradient:?}");
    }
}

#[test]
fn a_silent_recording_is_refused() {
    let error = DbLoss::new(&radar(), &HeatmapConfig::default(), &db(), 0.0, &Device::flex()).unwrap_err();
    assert!(error.to_string().contains("strongest cell has amplitude 0"), "{error}");
    assert!(error.hint().is_some());
}
