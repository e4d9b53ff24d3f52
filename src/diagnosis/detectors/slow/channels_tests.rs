//! The gain of one channel that hops, in made recordings.

use super::*;

#[test]
fn halves_that_change_alike_are_told_in_noise_and_others_are_not() {
    // Signal and noise of both halves are orthogonal to each other; the noise has half of the signal's energy.
    let half = |signal: [f64; 4], noise: [f64; 4]| Series {
        value: signal.iter().zip(noise).map(|(signal, noise)| (signal + 0.7 * noise).into()).collect(),
        weight: vec![1.0 / 0.49; 4],
        freedom: 20.0,
    };
    let (hops, stays) = ([1.0, -1.0, 1.0, -1.0], [1.0; 4]);
    let noise = [[1.0, 1.0, -1.0, -1.0], [1.0, -1.0, -1.0, 1.0]];
    let frames = [0, 1, 2, 3];
    let alike = correlation(&[half(hops, noise[0]), half(hops, noise[1])], &frames);
    assert!((alike - 1.0).abs() < 1e-9, "{alike}");
    let unlike = correlation(&[half(hops, noise[0]), half(stays, noise[1])], &frames);
    assert!(unlike.abs() < 0.5, "{unlike}");
    // Chance has it in the one and not in the other.
    let series = [half(hops, noise[0]), half(stays, noise[1])];
    assert!(chance(&series[0], &half(hops, noise[1]).likely(&frames), &frames) < 5e-3);
    assert!((chance(&series[1], &series[0].likely(&frames), &frames) - 0.5).abs() < 0.4);
    // A frame of which the pattern knows next to nothing, and what it knows is wrong, does no harm.
    let (mut own, mut rough) = (half(hops, noise[0]), half(hops, noise[1]));
    (rough.value[3], rough.weight[3], own.weight[3]) = (Complex64::from(10.0), 1e-3, 10.0);
    assert!(chance(&own, &rough.value, &frames) > 0.1 && chance(&own, &rough.likely(&frames), &frames) < 1e-2);
    // A frame that one half hardly knows says nothing.
    let mut hardly = half(hops, noise[1]);
    hardly.weight[3] = 1e-3;
    let alike = correlation(&[half(hops, noise[0]), hardly], &frames);
    assert!(alike > 0.5, "{alike}");
    // No more than the noise.
    assert_eq!(correlation(&[half([0.0; 4], noise[0].map(|noise| 0.9 * noise)), half(hops, noise[1])], &frames), 0.0);
}

#[test]
fn the_body_says_of_a_receivers_gain_what_the_static_ranges_say_and_groups_that_differ_say_less() {
    let relative = || Relative {
        members: vec![0],
        value: [0.1, -0.1, 0.1, -0.1, 0.1, -0.1].map(Complex64::from).to_vec(),
        weight: vec![100.0; 6],
        groups: 1,
        freedom: 10.0,
        excess: 1.0,
    };
    let (training, hops) = ([0, 1, 2, 3, 4, 5], [0.1, -0.1, 0.1, -0.1, 0.1, -0.1]);
    // Off by the same in all frames; groups of a frame scatter as they must, and ten times as much.
    let body = |apart: f64| -> Vec<Vec<[f64; 2]>> {
        hops.map(|hop| vec![[0.7 + hop + apart, 200.0], [0.7 + hop - apart, 200.0]]).to_vec()
    };
    for (apart, weight) in [(0.05, 100.0), (0.5, 1.0)] {
        let mut relative = relative();
        relative.add_body(&body(apart), &training);
        assert_eq!((relative.groups, relative.freedom), (3, 16.0));
        assert!((relative.weight[1] - weight).abs() < 1e-9, "{}", relative.weight[1]);
        let observed = relative.series(&training, |group| group > 0).expect("six frames");
        assert!(observed.value.iter().zip(hops).all(|(value, hop)| (value - hop).norm() < 1e-9), "{:?}", observed.value);
    }
}
