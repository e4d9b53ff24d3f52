use super::test_support::{facts, walker};
use super::*;
use crate::room::Room;

fn room() -> Room {
    Room { front_m: Some(5.6), floor_m: Some(1.0), ..Room::default() }
}

#[test]
fn a_plausible_scene_has_no_findings() {
    assert_eq!(findings(&facts(&walker(&[[0.0, 2.0, -1.0], [0.0, 2.1, -1.0]]), room())), []);
}

#[test]
fn what_follows_from_a_wrong_unit_is_not_told_beside_it() {
    let mut facts = facts(&walker(&[[0.0, 8.0, -1.0], [0.0, 8.1, -1.0]]), room());
    assert!(findings(&facts).iter().all(|finding| finding.field == "vertices"));
    facts.radar.as_mut().unwrap().slope_hz_per_s = 60.012;
    let found = findings(&facts);
    assert_eq!(found.iter().map(|finding| finding.field.as_str()).collect::<Vec<_>>(), ["radar.slope_hz_per_s"]);
    facts.as_stated = true;
    assert!(findings(&facts).len() > 1);
}

#[test]
fn the_first_refusal_is_an_error_and_a_user_can_keep_his_word() {
    let far = facts(&walker(&[[0.0, 8.0, -1.0], [0.0, 8.1, -1.0]]), room());
    let sources = Sources { body: "vertices.npy".into(), ..Sources::one("recording.toml") };
    let verdict = Verdict::new(findings(&far), &sources, false);
    let error = verdict.into_result().unwrap_err();
    assert_eq!(
        error.to_string(),
        "vertices.npy: `vertices` is the body 2.80 m beyond the front boundary at 0.10 s, expected a body in the room, whose front \
         boundary is 5.6 m away (room.front_m)"
    );
    assert!(error.hint().unwrap().ends_with("; --as-stated takes it as it is"));
    let kept = Verdict::new(findings(&far), &sources, true);
    assert!(
        kept.notes.iter().any(|note| note.contains("front boundary") && note.contains(", taken as stated")),
        "{:?}",
        kept.notes
    );
    kept.into_result().unwrap();
}
