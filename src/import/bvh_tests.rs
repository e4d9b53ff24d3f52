use super::*;

const ARM: &str = "HIERARCHY
ROOT hip one
{
\tOFFSET 0 1 0
\tCHANNELS 6 Xposition Yposition Zposition Zrotation Xrotation Yrotation
\tJOINT elbow {
\t\tOFFSET 2 0 0
\t\tCHANNELS 3 Yrotation Xrotation Zrotation
\t\tEnd Site
\t\t{
\t\t\tOFFSET 0.5 0 0
\t\t}
\t}
}
MOTION
Frames: 2
Frame Time: 0.01
0 1 0 0 0 0 0 0 0
3 1 -1 90 0 0 -90 0 0
";

fn refused(from: &str, to: &str) -> String {
    assert!(ARM.contains(from), "{from}");
    Bvh::parse(&ARM.replacen(from, to, 1)).unwrap_err()
}

#[test]
fn a_file_gives_its_joints_and_frames() {
    let bvh = Bvh::parse(ARM).unwrap();
    assert_eq!(bvh.joints.iter().map(|joint| joint.name.as_str()).collect::<Vec<_>>(), ["hip one", "elbow"]);
    assert_eq!(bvh.joints[1].parent, Some(0));
    assert_eq!(bvh.joints[1].end_offset, Some([0.5, 0.0, 0.0]));
    assert_eq!(bvh.joints[1].channels, [Channel::Rotation(1), Channel::Rotation(0), Channel::Rotation(2)]);
    assert_eq!((bvh.frames.len(), bvh.frame_time_s), (2, 0.01));
    assert_eq!(Bvh::parse(&ARM.replace('\n', "\r\n")).unwrap(), bvh);
}

#[test]
fn channels_turn_in_their_order_and_positions_replace_the_offset() {
    let pose = Bvh::parse(ARM).unwrap().pose(1);
    assert_eq!(pose.places[0], Vector3::new(3.0, 1.0, -1.0));
    // The root turns +x to +y.
    assert!((pose.places[1] - Vector3::new(3.0, 3.0, -1.0)).norm() < 1e-12);
    // The elbow first turns +x to +z in its parent's frame, which the parent leaves.
    assert!((pose.turns[1] * Vector3::x() - Vector3::z()).norm() < 1e-12);
}

#[test]
fn each_mistake_gets_its_line() {
    assert_eq!(refused("HIERARCHY", "HIERARCHIE"), "line 1: found `HIERARCHIE`, expected `HIERARCHY`");
    assert_eq!(refused("ROOT", "JOINT"), "line 2: found `JOINT hip one`, expected `ROOT`");
    assert_eq!(refused("OFFSET 2 0 0", "OFFSET 2 0"), "line 7: OFFSET has 2 values, expected 3");
    assert_eq!(refused("CHANNELS 3", "CHANNELS 4"), "line 8: CHANNELS says `4`, but 3 names follow");
    assert_eq!(
        refused("Yrotation Xrotation Zrotation", "Yrotation Xscale Zrotation"),
        "line 8: found channel `Xscale`, expected such as `Xposition` or `Zrotation`"
    );
    assert_eq!(refused("elbow", "hip one"), "line 6: there are two joints named `hip one`");
    assert_eq!(refused("End Site", "Site"), "line 9: found `Site`, expected `JOINT`, `End Site` or `}`");
    assert_eq!(refused("MOTION", "}"), "line 15: found `}`, expected `MOTION`");
    assert_eq!(refused("Frame Time: 0.01", "Frame Time: 0"), "line 17: `Frame Time:` is `0`, expected seconds above zero");
}

#[test]
fn tables_that_lie_are_refused() {
    assert_eq!(refused("Frames: 2", "Frames: 0"), "line 16: `Frames:` is 0, expected at least one frame");
    assert_eq!(refused("Frames: 2", "Frames: two"), "line 16: `Frames:` is `two`, expected a whole number");
    assert_eq!(refused("Frames: 2", "Frames: 3"), "line 19: the file ends after 2 frames, `Frames:` says 3");
    assert_eq!(refused("Frames: 2", "Frames: 1"), "line 19: `Frames:` says 1, but more lines follow");
    assert_eq!(refused("90 0 0 -90", "90 0 0 nan"), "line 19: value 7 is `nan`, expected a finite number for joint `elbow`");
    assert_eq!(refused("-90 0 0", "-90 0"), "line 19: found 8 values, expected 9 (one per channel)");
    let cut = &ARM[..ARM.find("MOTION").unwrap()];
    assert_eq!(Bvh::parse(cut).unwrap_err(), "line 14: the file ends, expected `MOTION`");
}

#[test]
fn a_missing_file_is_named() {
    let message = Bvh::read(Path::new("no/such.bvh")).unwrap_err().to_string();
    assert!(message.starts_with("no/such.bvh: cannot be read"), "{message}");
}
