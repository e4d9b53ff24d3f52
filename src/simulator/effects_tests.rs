//! Effects inside the simulator: neutral ones change nothing, others change the signal and learn.

use burn::{
    module::Module,
    tensor::{Device, Tensor},
};

use super::*;
use crate::{
    effects::{EffectSetting, Stage, info, library},
    person::{
        Person,
        actions::{self, Action, StyleConfig},
        procedural::{self, PersonConfig},
    },
    room::Room,
};

fn config(effects: Vec<EffectSetting>) -> SimulatorConfig {
    let mut config = SimulatorConfig { effects, ..SimulatorConfig::default() };
    config.room.patches = Some(60);
    config.triplane.resolution = 8;
    config.decoders.network.hidden = vec![8];
    config
}

fn person() -> Person {
    let model = procedural::person(&PersonConfig::default()).unwrap();
    let motion = actions::motion(Action::ArmSwing, &StyleConfig::default(), &model, &[], 1.5, 60.0).unwrap();
    Person::Skinned { model, motion, placement: actions::placement(1.0, 2.2) }
}

fn room() -> Room {
    Room { right_m: Some(2.4), front_m: Some(4.2), floor_m: Some(1.0), ..Room::default() }
}

/// The scene, and its radar with two transmitters, so that what differs between them shows.
fn scene() -> Scene {
    let radar = Radar { tx_m: vec![[0.0; 3], [0.004, 0.0, 0.0]], loops_per_frame: 4, chirp_period_s: 108e-6, ..Radar::small(4) };
    Scene::new(&radar, Some(&room()), Some(&person()), &config(vec![])).unwrap()
}

fn simulator(effects: Vec<EffectSetting>, scene: &Scene, device: &Device) -> Simulator {
    let config = config(effects);
    config.check().unwrap();
    let extent = Extent::around(scene.body.as_ref().unwrap().canonical_vertices(), config.triplane.margin);
    config.init(extent, 1, device)
}

/// Frame 1.
fn signal(simulator: &Simulator, scene: &Scene) -> Complex<4> {
    let surfaces = simulator.surfaces(&simulator.constants(scene), Mode::Inference);
    simulator.clean_signal(scene, &scene.view(1).unwrap(), &surfaces)
}

fn values(signal: Complex<4>) -> Vec<f32> {
    let part = |part: Tensor<4>| part.into_data().try_into_vec::<f32>().unwrap();
    [part(signal.re), part(signal.im)].concat()
}

fn chosen(setting: EffectSetting) -> EffectSetting {
    if setting.id == "wall_ghost" { setting.choosing("right") } else { setting }
}

/// Every effect with all its parameters neutral.
fn neutral() -> Vec<EffectSetting> {
    let of = |info: &&crate::effects::EffectInfo| {
        let start = chosen(EffectSetting::neutral(info.id));
        info.parameters.iter().fold(start, |setting, parameter| setting.with(parameter.name, [parameter.neutral]))
    };
    library().iter().map(of).collect()
}

/// Every effect with its parameters a little away from neutral.
fn away() -> Vec<EffectSetting> {
    let value = |id: &str, name: &str, neutral: f64, most: f64| match (id, name) {
        ("frame_drop", "at") => 1.0,
        ("frame_drop", "count") => 1.0,
        ("interference", "bursts") => 3.0,
        ("if_lowpass", "corner_hz") => 4e6,
        ("adc_saturation", "level") => 0.3,
        (_, "level_db") => -30.0,
        (_, "amplitude") => 0.01,
        (_, "reference" | "frame" | "chirp" | "first" | "samples" | "order" | "length" | "chirps") => neutral.max(1e-3),
        (_, "position_m") => 1.0,
        _ => neutral + 0.1 * (most - neutral),
    };
    let of = |info: &&crate::effects::EffectInfo| {
        let parameters = info.parameters.iter().filter(|parameter| {
            // Bursts by lot, not by list; levels relative to the frame.
            !(info.id == "interference" && ["frame", "chirp", "first"].contains(&parameter.name)) && parameter.name != "reference"
        });
        parameters.fold(chosen(EffectSetting::neutral(info.id)), |setting, parameter| {
            setting.with(parameter.name, [value(info.id, parameter.name, parameter.neutral, parameter.most)])
        })
    };
    library().iter().map(of).collect()
}

#[test]
fn all_effects_at_their_neutral_values_leave_every_bit_as_it_is() {
    let (scene, device) = (scene(), Device::flex());
    let plain = values(signal(&simulator(vec![], &scene, &device), &scene));
    assert!(plain.iter().any(|value| *value != 0.0));
    let mut with = simulator(neutral(), &scene, &device);
    let found = values(signal(&with, &scene));
    let different = plain.iter().zip(&found).filter(|(a, b)| a != b).count();
    assert_eq!(different, 0, "of {} numbers", plain.len());
    let silence = || Complex::zeros([2, 2, 4, 32], &device);
    let bare = simulator(vec![], &scene, &device);
    assert_eq!(values(bare.with_noise(&scene.radar, silence(), 3)), values(with.with_noise(&scene.radar, silence(), 3)));
    assert!(with.effects.switch_off(None) && with.effects.is_empty());
    assert_eq!(values(signal(&with, &scene)), plain);
}

#[test]
fn every_effect_changes_the_signal_or_the_noise_and_its_parameters_get_gradients() {
    let scene = scene();
    let device = Device::flex().autodiff();
    let plain = simulator(vec![], &scene, &device);
    let (before, level) = (values(signal(&plain, &scene)), 1.0 / 100.0);
    let mut wrong = Vec::new();
    for setting in away() {
        let id = setting.id.clone();
        let simulator = simulator(vec![setting], &scene, &device);
        let of_noise = info(&id).unwrap().stage == Stage::Noise;
        let shown = |simulator: &Simulator| {
            let clean = signal(simulator, &scene);
            if !of_noise {
                return clean;
            }
            let [tx, rx, loops, samples] = clean.dims();
            let ones =
                Complex::new(Tensor::ones([tx, rx, loops, samples], &device), Tensor::zeros([tx, rx, loops, samples], &device));
            simulator.with_noise(&scene.radar, ones, 3)
        };
        let reference = if of_noise { values(shown(&plain)) } else { before.clone() };
        let after = shown(&simulator);
        let found = values(after.clone());
        if found.iter().any(|value| !value.is_finite()) || found == reference {
            wrong.push(format!("{id}: not finite, or no change"));
        }
        let gradients = (after.re.sin() + after.im * level).sum().backward();
        for parameter in &simulator.effects.list[0].parameters {
            let gradient =
                parameter.raw.val().grad(&gradients).map(|gradient| gradient.into_data().try_into_vec::<f32>().unwrap());
            // What decides by lot has none.
            if id == "impulsive_noise" {
                continue;
            }
            match gradient {
                Some(gradient) if gradient.iter().all(|value| value.is_finite()) => {}
                other => wrong.push(format!("{id}: gradient {other:?}")),
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_coat_delays_the_torso_and_a_turned_body_leaves_the_room_alone() {
    let (scene, device) = (scene(), Device::flex());
    let room_alone = |effects: Vec<EffectSetting>| {
        let simulator = simulator(effects, &scene, &device);
        let surfaces = simulator.surfaces(&simulator.constants(&scene), Mode::Inference);
        let surfaces = Surfaces { body: None, ..surfaces };
        values(simulator.clean_signal(&scene, &scene.view(1).unwrap(), &surfaces))
    };
    let plain = room_alone(vec![]);
    for id in
        ["pose_offset", "clothing_delay", "breathing", "clock_offset", "part_reflectivity", "body_multibounce", "wall_ghost"]
    {
        let setting = away().into_iter().find(|setting| setting.id == id).unwrap();
        assert_eq!(room_alone(vec![setting]), plain, "{id}");
    }
}

#[test]
fn a_carried_object_follows_its_part_of_the_body() {
    let (scene, device) = (scene(), Device::flex());
    let energy = |part: &str| {
        let setting = EffectSetting::neutral("carried_reflector").with("amplitude", [1.0]).choosing(part);
        let simulator = simulator(vec![setting], &scene, &device);
        let nothing = Surfaces { body: None, room: None };
        let signal = simulator.clean_signal(&scene, &scene.view(1).unwrap(), &nothing);
        let still = signal.clone().mean_dim(2);
        let [moving, all] = [signal.clone().sub(still), signal].map(|part| f64::from(part.power().sum().into_scalar::<f32>()));
        moving / all
    };
    // The arms swing and the pelvis does not.
    assert!(energy("left_wrist") > 10.0 * energy("pelvis"), "{} and {}", energy("left_wrist"), energy("pelvis"));
}

#[test]
fn frozen_effects_keep_their_values() {
    let scene = scene();
    let device = Device::flex().autodiff();
    let mut simulator = simulator(vec![EffectSetting::neutral("chirp_droop").with("db", [1.0])], &scene, &device);
    simulator.effects = simulator.effects.no_grad();
    let gradients = signal(&simulator, &scene).power().sum().backward();
    assert!(simulator.effects.list[0].parameters[0].raw.val().grad(&gradients).is_none());
}
