//! What is put onto clean samples is what the recorder makes of the same scene.

use super::*;
use crate::data::settings::read_text;
use crate::recorder::{Recorder, RecorderConfig};

/// A small recorder world without noise, and the same with effects and with the board's gain of the first.
fn worlds(effects: &str, sampling: &str) -> [Recorder; 2] {
    let text = format!(
        "seed = 7\nempty = true\n[receiver]\nnoise = false\n[radar]\nstart_frequency_hz = 77e9\n\
         slope_hz_per_s = 60.012e12\nsample_rate_hz = 2.2e6\nsampling = \"{sampling}\"\nsamples_per_chirp = 48\n\
         loops_per_frame = 4\nadc_start_s = 6e-6\nchirp_period_s = 72e-6\nframe_period_s = 0.1\nframes = 3\n\
         tx_m = [[0.0, 0.0, 0.0]]\nrx_m = [[0.0, 0.0, 0.0], [0.001916, 0.0, 0.0]]\n"
    );
    let clean: RecorderConfig = read_text(&text).unwrap();
    let clean = clean.world(std::path::Path::new(".")).unwrap();
    let plain = Recorder::new(&clean).unwrap();
    let effects: EffectsConfig = read_text(effects).unwrap();
    let receiver = ReceiverConfig { level: Some(plain.level()), ..clean.receiver };
    let planted = Recorder::new(&World { effects, receiver, ..clean }).unwrap();
    [plain, planted]
}

/// The recorder's peak in codes: the samples' own differs by the converter and by what is seen in previews.
fn ground(plain: &Recorder, rail: Option<[f64; 2]>) -> Ground {
    let level = plain.level();
    let peak = level.peak * level.gain;
    Ground { peak, largest_component: peak, sigma: 0.0, zero: Complex64::ZERO, rail }
}

/// Largest difference of a component, codes, and the root mean square difference that the effect makes.
fn differences(effects: &str, sampling: &str, rail: Option<[f64; 2]>) -> [f64; 2] {
    let [plain, planted] = worlds(effects, sampling);
    let onto = Onto::new(&plain.world().radar, &planted.world().effects, 7, &ground(&plain, rail)).unwrap();
    let (mut largest, mut square, mut count): (f64, f64, f64) = (0.0, 0.0, 0.0);
    for frame in 0..3 {
        let clean = plain.frame(frame).unwrap();
        let (salted, recorded) = (onto.apply(frame, &clean), planted.frame(frame).unwrap());
        let parts = |frame: &IfFrame| [frame.re.clone(), frame.im.clone().unwrap_or_default()].concat();
        for ((clean, salted), recorded) in parts(&clean).iter().zip(parts(&salted)).zip(parts(&recorded)) {
            largest = largest.max(f64::from((salted - recorded).abs()));
            square += f64::from(recorded - clean).powi(2);
            count += 1.0;
        }
    }
    [largest, (square / count).sqrt()]
}

const RAIL: Option<[f64; 2]> = Some([-32768.0, 32767.0]);

#[test]
fn an_effect_on_samples_is_the_effect_in_the_recorder_up_to_rounding() {
    // Twice rounded: half a code before, which a gain may enlarge, and half a code after.
    for effects in [
        "[iq_imbalance]\ngain_db = 1.0\nphase_deg = 4.0",
        "[dc_offset]\ni = 0.1\nq = -0.05",
        "[chirp_droop]\ndb = 3.0",
        "[gain_drift]\ndb = 2.0",
        "[chirp_settling]\ndepth = 0.4\nchirps = 2.0",
        "[compression]\nlevel = 0.2",
        "[second_harmonic]\nlevel_db = -20.0",
        "[spur]\nfrequency_hz = 3.1e5\nlevel_db = -20.0",
        "[interference]\nbursts = 6\nrelative = 1.0\nazimuth_deg = 20.0",
        "[ramp_edge_transient]\nsamples = 4\nlevel_db = -10.0",
        "[channel_mismatch]\ngain_db = [0.0, 2.0]\nphase_deg = [0.0, 20.0]",
        "[[outside]]\nkind = \"mains_gain_ripple\"\nrate_hz = 50.0\ndepth = 0.2",
        "[[outside]]\nkind = \"lo_pulling\"\npeak_rad = 0.5",
        "[[outside]]\nkind = \"chirp_afterglow\"\nlevel_db = -20.0",
        "[[outside]]\nkind = \"mux_crosstalk\"\nlevel_db = -20.0",
        "[[outside]]\nkind = \"buffer_slip\"\nframe = 1\nrx = 1\nsamples = 3",
        "[[outside]]\nkind = \"lsb_stuck\"\nrx = 0\nbit = 6",
    ] {
        let [largest, effect] = differences(effects, "complex", RAIL);
        assert!(largest <= 2.0 && effect > 20.0, "{effects}: {largest} codes apart, an effect of {effect}");
    }
    for effects in ["[chirp_droop]\ndb = 3.0", "[spur]\nfrequency_hz = 3.1e5\nlevel_db = -20.0", "[dc_offset]\ni = 0.1\nq = 0.0"]
    {
        let [largest, effect] = differences(effects, "real", RAIL);
        assert!(largest <= 2.0 && effect > 20.0, "real, {effects}: {largest} codes apart, an effect of {effect}");
    }
}

#[test]
fn a_leakage_is_the_recorders_but_for_the_phase_that_nobody_knows() {
    // The recorder's leakage comes before the unknown phase of its receiver: only its power can be the same.
    let [plain, planted] = worlds("[tx_leakage]\nrange_m = 0.1\nrelative = 0.3\nspread_db = 3.0", "complex");
    let onto = Onto::new(&plain.world().radar, &planted.world().effects, 7, &ground(&plain, RAIL)).unwrap();
    let clean = plain.frame(0).unwrap();
    let power = |with: &IfFrame| -> f64 {
        let apart = |a: &[f32], b: &[f32]| a.iter().zip(b).map(|(a, b)| f64::from(a - b).powi(2)).sum::<f64>();
        apart(&with.re, &clean.re) + apart(with.im.as_ref().unwrap(), clean.im.as_ref().unwrap())
    };
    let [salted, recorded] = [onto.apply(0, &clean), planted.frame(0).unwrap()].map(|frame| power(&frame));
    assert!((salted / recorded - 1.0).abs() < 1e-2, "{salted:e} {recorded:e}");
}

#[test]
fn phase_noise_by_turning_spectra_is_the_recorders_but_at_the_windows_ends() {
    let [plain, planted] = worlds("[phase_noise]\nper_chirp_rad = 0.3", "complex");
    let onto = Onto::new(&plain.world().radar, &planted.world().effects, 7, &ground(&plain, None)).unwrap();
    let (mut apart, mut effect) = (0.0, 0.0);
    let (clean, recorded) = (plain.frame(1).unwrap(), planted.frame(1).unwrap());
    let salted = onto.apply(1, &clean);
    for index in 0..clean.re.len() {
        apart += f64::from(salted.re[index] - recorded.re[index]).powi(2);
        effect += f64::from(recorded.re[index] - clean.re[index]).powi(2);
    }
    assert!(apart < 0.1 * effect, "{apart:e} of {effect:e}");
}

#[test]
fn added_noise_has_the_density_and_the_correlation_that_the_effects_state() {
    let radar = Radar { frames: 1, loops_per_frame: 64, samples_per_chirp: 64, ..Radar::small(1) };
    let ground = Ground { peak: 1.0, largest_component: 1.0, sigma: 2.0, zero: Complex64::ZERO, rail: None };
    let [_, tx, rx, loops, samples] = radar.dims();
    let silent =
        IfFrame::new([tx, rx, loops, samples], vec![0.0; tx * rx * loops * samples], Some(vec![0.0; tx * rx * loops * samples]));
    let power = |effects: EffectsConfig| {
        let salted = Onto::new(&radar, &effects, 3, &ground).unwrap().apply(0, &silent);
        salted.re.iter().map(|&value| f64::from(value).powi(2)).sum::<f64>() / salted.re.len() as f64
    };
    // 4 · 0.5 / 0.5, and 4 · 0.1 · (36 − 1).
    let correlated: EffectsConfig = read_text("[correlated_noise]\nrho = 0.5").unwrap();
    let impulsive: EffectsConfig = read_text("[impulsive_noise]\nrate = 0.1\nstrength = 6.0").unwrap();
    assert!((power(correlated) / 4.0 - 1.0).abs() < 0.1);
    assert!((power(impulsive) / 14.0 - 1.0).abs() < 0.1);
    // Σ (knee/f)² over the bins, of which the zero counts as half a bin.
    let bin_hz = radar.sample_rate_hz / 64.0;
    let coloured = format!("[coloured_noise]\nknee_hz = {bin_hz}\npower = 2.0");
    let wanted: f64 = (0..64).map(|bin: i32| f64::from(bin.min(64 - bin)).max(0.5).powi(-2)).sum::<f64>() / 64.0 * 4.0;
    assert!((power(read_text(&coloured).unwrap()) / wanted - 1.0).abs() < 0.1);
}

#[test]
fn a_lower_rail_clips_and_offset_binary_swings_about_its_own_zero() {
    let radar = Radar {
        rx_m: vec![[0.0; 3]],
        tx_m: vec![[0.0; 3]],
        frames: 1,
        loops_per_frame: 1,
        samples_per_chirp: 4,
        sampling: Sampling::Real,
        ..Radar::small(1)
    };
    let ground = Ground { peak: 100.0, largest_component: 100.0, sigma: 1.0, zero: 2048.0.into(), rail: Some([0.0, 4095.0]) };
    let frame = IfFrame::new([1, 1, 1, 4], vec![2148.0, 1948.0, 2058.0, 2048.0], None);
    let of = |effects: &str| Onto::new(&radar, &read_text(effects).unwrap(), 1, &ground).unwrap().apply(0, &frame).re;
    assert_eq!(of("[adc_saturation]\nlevel = 2.0"), [2098.0, 1998.0, 2058.0, 2048.0]);
    // The droop is of the signal, not of the code that stands for zero; 20 dB over three steps.
    assert_eq!(of("[chirp_droop]\ndb = 20.0"), [2148.0, 2002.0, 2050.0, 2048.0]);
    assert_eq!(of(""), frame.re[..]);
}

#[test]
fn what_a_radar_cannot_have_is_refused() {
    let radar = Radar { sampling: Sampling::Real, ..Radar::small(2) };
    let ground = Ground { peak: 1.0, largest_component: 1.0, sigma: 1.0, zero: Complex64::ZERO, rail: None };
    let of = |effects: &str| Onto::new(&radar, &read_text(effects).unwrap(), 1, &ground).unwrap_err().to_string();
    assert!(of("[iq_imbalance]\ngain_db = 1.0\nphase_deg = 0.0").contains("without quadrature"));
    assert!(of("[[outside]]\nkind = \"lsb_stuck\"\nrx = 0\nbit = 1").contains("lsb_stuck"));
}
