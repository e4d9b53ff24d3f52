use super::*;

#[test]
fn the_library_is_complete_and_consistent() {
    assert!(library().windows(2).all(|pair| pair[0].stage <= pair[1].stage), "out of the signal's order");
    for effect in library() {
        assert!(std::ptr::eq(info(effect.id).unwrap(), *effect), "{} is there twice", effect.id);
        for text in [effect.title, effect.explanation, effect.equation, effect.separate_by] {
            assert!(!text.is_empty(), "{}", effect.id);
        }
        for parameter in effect.parameters {
            assert!(parameter.least < parameter.most && parameter.neutral.is_finite(), "{}: {parameter:?}", effect.id);
        }
    }
    assert!(info("no_such_effect").is_none());
}

#[test]
fn every_look_alike_exists_is_stated_once_and_is_mutual() {
    for effect in library() {
        for (index, other) in effect.look_alikes.iter().enumerate() {
            let known = info(other).unwrap_or_else(|| panic!("{} looks like {other}, which does not exist", effect.id));
            assert!(known.id != effect.id, "{} looks like itself", effect.id);
            let again = known.look_alikes.contains(&effect.id) || effect.look_alikes[..index].contains(other);
            assert!(!again, "{} and {other} are stated twice", effect.id);
        }
        assert!(look_alikes(effect).next().is_some(), "{} has none", effect.id);
        for other in look_alikes(effect) {
            assert!(look_alikes(other).any(|back| back.id == effect.id), "{} and {}", effect.id, other.id);
        }
    }
}

use burn::tensor::{Device, Tensor};

use super::test_support::*;
use crate::complex::Complex;
use crate::support::{assert_close, check_gradient, input, tensor, values as host};

/// Every operator on the summed signal away from its neutral values, the parameters that learn first.
fn signal_cases() -> Vec<(EffectSetting, &'static [&'static str])> {
    [cases_up_to_the_antennas(), receiver_cases()].concat()
}

fn cases_up_to_the_antennas() -> Vec<(EffectSetting, &'static [&'static str])> {
    let of = EffectSetting::neutral;
    vec![
        (of("range_bias").with("offset_m", [0.03]), &["offset_m"]),
        (
            of("radar_vibration").with("amplitude_m", [1e-4]).with("frequency_hz", [30.0]).with("phase_rad", [0.4]),
            &["amplitude_m", "frequency_hz", "phase_rad"],
        ),
        (
            of("object_radar_object").with("coefficient", [0.2]).with("phase_rad", [0.5]).with("reference", [2.0]),
            &["coefficient", "phase_rad"],
        ),
        (
            of("range_alias").with("range_m", [11.0]).with("re", [0.1]).with("im", [0.2]).with("reference", [2.0]),
            &["range_m", "re", "im"],
        ),
        (of("start_frequency_error").with("relative", [2e-5]), &["relative"]),
        (of("adc_start_error").with("offset_s", [3e-8]), &["offset_s"]),
        (of("slope_error").with("relative", [0.004]), &["relative"]),
        (of("chirp_nonlinearity").with("peak_hz", [1e6, -5e5]), &["peak_hz"]),
        (
            of("chirp_ripple").with("deviation_hz", [5e5]).with("ripple_hz", [4e5]).with("phase_rad", [0.2]),
            &["deviation_hz", "ripple_hz", "phase_rad"],
        ),
        (of("phase_noise").with("per_chirp_rad", [0.1]), &["per_chirp_rad"]),
        (of("chirp_start_jitter").with("jitter_s", [1e-9]), &["jitter_s"]),
        (of("channel_mismatch").with("gain_db", [0.5, -1.0, 0.2, 0.0]).with("phase_deg", [3.0, -8.0]), &["gain_db", "phase_deg"]),
        (of("mutual_coupling").with("level_db", [-20.0]).with("re", [0.05]).with("im", [0.1]), &["level_db", "re", "im"]),
    ]
}

fn receiver_cases() -> Vec<(EffectSetting, &'static [&'static str])> {
    let of = EffectSetting::neutral;
    vec![
        (
            of("tx_leakage")
                .with("range_m", [0.09])
                .with("level_db", [-10.0])
                .with("re", [0.1, 0.2, -0.3, 0.4])
                .with("im", [0.3, 0.0, 0.1, -0.1])
                .with("reference", [2.0]),
            &["range_m", "level_db", "re", "im"],
        ),
        (of("chirp_droop").with("db", [2.0, 0.3]), &["db"]),
        (of("chirp_settling").with("depth", [0.3]).with("chirps", [2.5]), &["depth", "chirps"]),
        (of("gain_drift").with("db", [0.5, 1.0, -0.3]), &["db"]),
        (
            of("interference")
                .with("frame", [2.0, 1.0, 2.0])
                .with("chirp", [1.0, 2.0, 5.0])
                .with("first", [3.0])
                .with("length", [6.0])
                .with("re", [0.4, 0.5, 0.6])
                .with("im", [0.1, 0.2, 0.3])
                .with("reference", [2.0]),
            &["re", "im"],
        ),
        (of("second_harmonic").with("re", [0.1]).with("im", [0.05]).with("reference", [2.0]), &["re", "im"]),
        (of("compression").with("level", [0.1]).with("reference", [2.0]), &["level"]),
        (of("if_delay").with("delay_s", [2e-8]), &["delay_s"]),
        (of("if_highpass").with("corner_hz", [3e5]).with("order", [2.0]), &["corner_hz"]),
        (of("if_lowpass").with("corner_hz", [4e6]), &["corner_hz"]),
        (
            of("spur").with("frequency_hz", [7e5]).with("re", [0.1]).with("im", [0.2]).with("reference", [2.0]),
            &["frequency_hz", "re", "im"],
        ),
        (
            of("ramp_edge_transient").with("samples", [2.0]).with("re", [1.0, 2.0]).with("im", [0.5]).with("reference", [2.0]),
            &["re", "im"],
        ),
        (of("iq_imbalance").with("gain_db", [0.5]).with("phase_deg", [2.0]), &["gain_db", "phase_deg"]),
        (of("dc_offset").with("i", [0.1, 0.2]).with("q", [-0.1]).with("reference", [2.0]), &["i", "q"]),
        (of("adc_saturation").with("level", [0.6]).with("reference", [2.0]), &["level"]),
    ]
}

fn apply(setting: &EffectSetting, values: &Values, of: Complex<4>, context: &Context<'_>) -> Complex<4> {
    let apply = operator(&setting.id).on_signal().unwrap();
    apply(of, values, context)
}

#[test]
fn every_operator_on_the_signal_has_a_case() {
    let cases: Vec<String> = signal_cases().into_iter().map(|(setting, _)| setting.id).collect();
    let on_signal: Vec<&str> = library().iter().filter(|info| info.operator.on_signal().is_some()).map(|info| info.id).collect();
    assert_eq!(cases, on_signal, "in the library's order");
}

#[test]
fn operators_on_the_signal_are_of_the_kind_that_they_state() {
    let radar = radar();
    let echoes: Tensor<1> = tensor(&echoes(&radar, &[0.7, 2.1]), [2 * 192], &Device::flex());
    for (case, _) in signal_cases() {
        let after =
            |scale: f64| host(&flat(apply(&case, &values(&case), signal(echoes.clone() * scale, &radar), &context(&radar))));
        let size = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>().sqrt();
        let (once, twice) = (after(1.0), after(2.0));
        let beyond: Vec<f64> = twice.iter().zip(&once).map(|(twice, once)| twice - 2.0 * once).collect();
        let (silence, beyond) = (size(&after(0.0)), size(&beyond) / size(&once));
        let kind = info(&case.id).unwrap().operator;
        let stated = match kind {
            Operator::Signal(_) => silence == 0.0 && beyond < 1e-9,
            Operator::Added(_) => silence > 0.0,
            Operator::Nonlinear(_) => silence == 0.0 && beyond > 1e-6,
            _ => false,
        };
        assert!(stated, "{} is {kind:?}: {silence} of silence, {beyond} beyond proportion", case.id);
    }
}

#[test]
fn neutral_values_change_nothing_at_all() {
    let radar = radar();
    for dtype in [burn::tensor::DType::F32, burn::tensor::DType::F64] {
        let parts: Tensor<1> = tensor(&echoes(&radar, &[0.7, 2.1]), [2 * 192], &Device::flex()).cast(dtype);
        let before = host(&parts);
        for (case, learning) in signal_cases() {
            // With all parameters named, at their neutral values.
            let mut neutral = EffectSetting::neutral(&case.id);
            for name in learning {
                neutral = neutral.with(name, [info(&case.id).unwrap().parameter(name).unwrap().neutral]);
            }
            for setting in [neutral, EffectSetting::neutral(&case.id)] {
                let effects = Effects::new(&[setting], &Device::flex());
                let after = host(&flat(effects.apply(signal(parts.clone(), &radar), &context(&radar))));
                assert_eq!(before, after, "{} in {dtype:?}", case.id);
            }
            let changed =
                apply(&case, &values(&case), signal(parts.clone().cast(burn::tensor::DType::F64), &radar), &context(&radar));
            assert_ne!(before, host(&flat(changed)), "{} does something", case.id);
        }
    }
}

pub(crate) fn gradients_of_every_operator_on_the_signal_agree_with_central_differences() {
    let radar = radar();
    let parts = echoes(&radar, &[0.7, 2.1]);
    for (case, learning) in signal_cases() {
        for name in learning {
            let start = case.parameters[*name].clone();
            let size = start.iter().fold(0.0f64, |size, value| size.max(value.abs()));
            // In shares of the value, so that one step serves micrometres and megahertz.
            let shares: Vec<f64> = start.iter().map(|value| value / size).collect();
            // A spur's phase has turned a hundred thousand times by now.
            let step = if *name == "frequency_hz" && case.id == "spur" { 1e-9 } else { 1e-5 };
            eprintln!("{} {name}", case.id);
            check_gradient(&[input("value", shares)], step, 1e-5, |inputs| {
                let all = values_of(&case, &[(name, inputs[0].clone() * size)], &inputs[0]);
                let constant = tensor(&parts, [parts.len()], &inputs[0].device());
                flat(apply(&case, &all, signal(constant, &radar), &context(&radar)))
            });
        }
        if case.id == "adc_saturation" {
            continue; // passed straight through, by design
        }
        let weights = crate::support::numbers(5, parts.len(), -1.0, 1.0);
        // Along one random direction: every sample's own derivative would be the same check 384 times.
        check_gradient(&[input("signal", [0.0])], 1e-5, 1e-6, |inputs| {
            let device = inputs[0].device();
            let moved = tensor(&parts, [parts.len()], &device) + tensor(&weights, [parts.len()], &device) * inputs[0].clone();
            let all = values_of(&case, &[], &inputs[0]);
            flat(apply(&case, &all, signal(moved, &radar), &context(&radar)))
        });
    }
}

#[test]
fn effects_act_in_the_order_of_the_signal_and_not_of_the_settings() {
    let radar = radar();
    let (leak, filter) = (
        EffectSetting::neutral("tx_leakage").with("re", [0.5]).with("reference", [2.0]),
        EffectSetting::neutral("if_highpass").with("corner_hz", [3e5]),
    );
    let parts: Tensor<1> = tensor(&echoes(&radar, &[0.7, 2.1]), [2 * 192], &Device::flex());
    let run = |settings: &[EffectSetting]| {
        host(&flat(Effects::new(settings, &Device::flex()).apply(signal(parts.clone(), &radar), &context(&radar))))
    };
    let found = run(&[filter.clone(), leak.clone()]);
    assert_eq!(found, run(&[leak.clone(), filter.clone()]));
    // The filter acts on the leakage too, so the other order gives something else.
    let leaked = apply(&leak, &values(&leak), signal(parts.clone(), &radar), &context(&radar));
    let wanted = host(&flat(apply(&filter, &values(&filter), leaked, &context(&radar))));
    assert_close("leakage, then filter", &found, &wanted, 1e-6);
    let filtered = apply(&filter, &values(&filter), signal(parts.clone(), &radar), &context(&radar));
    let other = host(&flat(apply(&leak, &values(&leak), filtered, &context(&radar))));
    assert!(found.iter().zip(other).any(|(a, b)| (a - b).abs() > 0.1));
}

#[test]
fn effects_that_are_switched_off_do_nothing_and_learned_values_are_read_back() {
    let radar = radar();
    let setting = EffectSetting::neutral("chirp_droop").with("db", [2.0, 0.3]);
    let mut effects = Effects::new(std::slice::from_ref(&setting), &Device::flex());
    assert!(!effects.is_empty() && effects.list.iter().any(|effect| effect.id() == "chirp_droop"));
    let read = effects.settings()[0].parameters["db"].clone();
    assert_close("db", &read, &[2.0, 0.3], 1e-6);
    assert!(!effects.switch_off(Some("dc_offset")));
    assert!(effects.switch_off(Some("chirp_droop")) && effects.is_empty());
    let parts: Tensor<1> = tensor(&echoes(&radar, &[0.7]), [2 * 192], &Device::flex());
    let after = host(&flat(effects.apply(signal(parts.clone(), &radar), &context(&radar))));
    assert_eq!(after, host(&parts));
}
