//! A recording folder from settings or from a world.

use std::collections::BTreeMap;
use std::path::Path;

use super::config::RecorderConfig;
use super::record::Recorder;
use super::truth::truth;
use super::world::World;
use crate::data::atomic::AtomicFolder;
use crate::data::{Recording, RecordingContents, write_recording_into};
use crate::error::Result;

/// What a recording says about itself, `[labels]`.
pub type Labels = BTreeMap<String, String>;

/// Records what `config` describes into `out` and opens it. Relative paths in `config` start at `settings_folder`;
/// `progress` receives how many of how many frames are done, from 0 on.
pub fn record_to(
    config: &RecorderConfig,
    settings_folder: &Path,
    out: &Path,
    progress: &mut dyn FnMut(usize, usize),
) -> Result<Recording> {
    let world = config.world(settings_folder)?;
    let named = [("action", config.action()), ("subject", config.subject())];
    let labels = named.into_iter().filter_map(|(key, value)| Some((key.to_string(), value?.to_string()))).collect();
    write_world(&world, labels, out, progress)
}

/// Records a world into a folder, frame by frame, with its truth beside it. The person that is written is the one the
/// world was given, not the displaced one that was recorded.
pub fn write_world(world: &World, labels: Labels, out: &Path, progress: &mut dyn FnMut(usize, usize)) -> Result<Recording> {
    // What cannot be written is said before anything is worked out.
    let target = AtomicFolder::create(out)?;
    let frames = world.radar.frames;
    progress(0, frames);
    let recorder = Recorder::new(world)?;
    let truth = truth(world, labels.get("action").map(String::as_str));
    let contents = RecordingContents {
        radar: &world.radar,
        room: (!world.room.boundaries().is_empty()).then_some(&world.room),
        person: world.person.as_ref(),
        body_file: None,
        labels,
        layout: recorder.layout(),
        truth: Some(&truth),
    };
    let mut recorded = recorder.frames();
    write_recording_into(target, &contents, &mut |frame| {
        let samples = recorded.next().expect("as many frames as the radar has")?;
        progress(frame + 1, frames);
        Ok(samples)
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::data::IfLayout;
    use crate::radar::{Radar, Sampling};
    use crate::recorder::receiver::ReceiverConfig;
    use crate::recorder::test_support::{gliding, sphere};

    #[test]
    fn a_null_recording_is_what_the_formats_say() {
        let world = World {
            room: crate::room::Room { front_m: Some(4.0), floor_m: Some(1.0), ..Default::default() },
            person: Some(gliding(sphere([0.0, 2.0, 0.0], 0.2, 2), [0.0, 0.5, 0.0])),
            radar: Radar::small(2),
            mesh_error_m: 1e-3,
            seed: 3,
            ..World::default()
        };
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("null");
        let mut received = vec![];
        let labels = Labels::from([("action".into(), "glide".into())]);
        let recording = write_world(&world, labels, &out, &mut |done, of| received.push((done, of))).unwrap();
        assert_eq!(received, [(0, 2), (1, 2), (2, 2)]);
        assert_eq!((recording.layout(), &recording.room), (IfLayout::Codes, &Some(world.room.clone())));
        assert_eq!(recording.labels["action"], "glide");
        // What is handed out is the undisplaced body.
        let Some(crate::person::Person::Meshes { vertices, .. }) = recording.person() else { panic!("a person of meshes") };
        assert!((vertices[0][0][1] - world.person.as_ref().map(first_y).unwrap()).abs() < 1e-6);
        let frame = recording.frame(1).unwrap();
        assert_eq!(frame, Recorder::new(&world).unwrap().frame(1).unwrap());
        let peak = frame.re.iter().chain(frame.im.as_ref().unwrap()).fold(0f32, |peak, value| peak.max(value.abs()));
        assert!((0.1 * 32767.0..0.5 * 32767.0).contains(&peak), "{peak}");
        let truth: serde_json::Value = serde_json::from_str(&std::fs::read_to_string(out.join("truth.json")).unwrap()).unwrap();
        assert_eq!(truth["effects"], serde_json::json!([]));
        assert_eq!(truth["action"], "glide");
    }

    fn first_y(person: &crate::person::Person) -> f64 {
        let crate::person::Person::Meshes { vertices, .. } = person else { unreachable!("meshes") };
        vertices[0][0][1]
    }

    #[test]
    fn a_real_sampled_radar_and_floating_point_samples_can_be_recorded() {
        for (sampling, adc, layout) in [
            (Sampling::Real, true, IfLayout::RealCodes),
            (Sampling::Real, false, IfLayout::Real),
            (Sampling::Complex, false, IfLayout::Complex),
        ] {
            let world = World {
                radar: Radar { sampling, ..Radar::small(1) },
                room: crate::room::Room { front_m: Some(4.0), ..Default::default() },
                receiver: ReceiverConfig { adc, ..ReceiverConfig::default() },
                ..World::default()
            };
            let folder = tempfile::tempdir().unwrap();
            let recording = write_world(&world, Labels::new(), &folder.path().join("r"), &mut |_, _| {}).unwrap();
            assert_eq!(recording.layout(), layout);
            assert!(recording.person().is_none());
        }
    }

    #[test]
    fn the_default_settings_record_the_embedded_person_and_a_short_motion_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let mut config = RecorderConfig { frames: Some(1), ..RecorderConfig::default() };
        config.surface.returns = crate::recorder::Returns::Vertices;
        let recording = record_to(&config, folder.path(), &folder.path().join("a"), &mut |_, _| {}).unwrap();
        assert_eq!((recording.labels["action"].as_str(), recording.labels["subject"].as_str()), ("walk_back_forth", "s1"));
        // A placement that starts after the recording does.
        config.person.placement =
            Some(crate::person::Placement { start_s: 1.0, origin_m: [0.0, 3.0, -1.0], ..Default::default() });
        let error = record_to(&config, folder.path(), &folder.path().join("b"), &mut |_, _| {}).unwrap_err();
        assert!(error.to_string().contains("within the motion, 1.0000 s"), "{error}");
        assert!(!folder.path().join("b").exists());
    }
}
