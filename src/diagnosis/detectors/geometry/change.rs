//! Ways in which the body may be elsewhere, or at another time, than predicted.

use std::sync::Arc;

use crate::diagnosis::finding::Correction;
use crate::diagnosis::prediction::{BodyPrediction, Centre, Echo, Point};
use crate::diagnosis::vector::{difference, norm};

/// One of the effects that move the body in the maps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Change {
    /// All ranges are longer by this, metres.
    Range(f64),
    /// All ranges are longer by this share of them.
    Scale(f64),
    /// The body stands elsewhere, metres.
    Offset([f64; 3]),
    /// The body is this much later in its motion, seconds.
    Clock(f64),
    /// The motion runs faster by this share.
    Drift(f64),
    /// From frame `at` on, `count` frames later.
    Drop { at: usize, count: usize },
    /// The body is seen by a longer way, too.
    Replica(Echo),
}

/// The body with changes of place and time.
pub struct Moves {
    centre_m: [f64; 3],
}

impl Moves {
    /// `centre_m`: of the antennas.
    pub fn new(centre_m: [f64; 3]) -> Self {
        Self { centre_m }
    }

    /// How much later in its motion a frame shows the body.
    fn delay_s(&self, body: &BodyPrediction, frame: usize, change: Change) -> f64 {
        match change {
            Change::Clock(delay) => delay,
            Change::Drift(rate) => rate * body.middle_s[frame],
            Change::Drop { at, count } if frame >= at => count as f64 * frame_period_s(body),
            _ => 0.0,
        }
    }

    /// Points of a frame after the change, as far as they are seen directly, and whether they are still a prediction: beyond the recording's ends, points are
    /// only carried on as they moved.
    pub fn points(&self, body: &BodyPrediction, frame: usize, change: Change) -> (Vec<Point>, bool) {
        let delay = self.delay_s(body, frame, change);
        if delay != 0.0 {
            let (nearest, rest) = nearest(body, frame, delay);
            return body.later(nearest, rest);
        }
        let moved = |point: &Point| Point { position_m: self.moved(point.position_m, change), ..*point };
        (body.frames[frame].iter().map(moved).collect(), true)
    }

    /// Where something is seen after a change of place.
    fn moved(&self, position_m: [f64; 3], change: Change) -> [f64; 3] {
        let sight = difference(position_m, self.centre_m);
        let range = norm(sight).max(1e-6);
        let shift: [f64; 3] = match change {
            Change::Range(offset) => sight.map(|x| x / range * offset),
            Change::Scale(relative) => sight.map(|x| x * relative),
            Change::Offset(offset) => offset,
            _ => [0.0; 3],
        };
        std::array::from_fn(|axis| position_m[axis] + shift[axis])
    }

    /// The whole prediction after the change.
    pub fn correction(self, change: Change) -> Correction {
        Correction::Body(Arc::new(move |body| self.apply(body, change)))
    }

    fn apply(&self, body: &mut BodyPrediction, change: Change) {
        if let Change::Replica(echo) = change {
            body.echoes.push(echo);
            return;
        }
        let frames = 0..body.frames.len();
        let moved = frames.clone().map(|frame| self.points(body, frame, change).0).collect();
        let track = |frame: usize| {
            let (nearest, rest) = nearest(body, frame, self.delay_s(body, frame, change));
            body.track(nearest).map(|track| track.from(rest))
        };
        let centres = |frame: usize| -> Vec<Centre> {
            let Some(centres) = body.centres.get(frame) else { return vec![] };
            let delay_s = self.delay_s(body, frame, change);
            let later = |centre: &Centre| -> [f64; 3] {
                std::array::from_fn(|axis| centre.position_m[axis] + delay_s * centre.velocity_mps[axis])
            };
            centres.iter().map(|centre| Centre { position_m: self.moved(later(centre), change), ..*centre }).collect()
        };
        let (centres, tracks) = (frames.clone().map(centres).collect(), frames.filter_map(track).collect());
        (body.centres, body.tracks) = (centres, tracks);
        body.frames = moved;
        for (points, _) in &mut body.beyond {
            points.iter_mut().for_each(|point| point.position_m = self.moved(point.position_m, change));
        }
    }
}

/// The frame in which the body was seen nearest to what is shown so much later, and what remains from what that frame
/// shows now.
fn nearest(body: &BodyPrediction, frame: usize, delay: f64) -> (usize, f64) {
    let times = |frame: usize| match body.track(frame) {
        Some(track) => track.seen_and_shown_s(),
        None => (body.middle_s[frame], body.middle_s[frame]),
    };
    let time = times(frame).1 + delay;
    let apart = |frame: &usize| (times(*frame).0 - time).abs();
    let nearest = (0..body.frames.len() + body.beyond.len()).min_by(|a, b| apart(a).total_cmp(&apart(b))).unwrap_or(frame);
    (nearest, time - times(nearest).1)
}

/// Median step between frames.
pub fn frame_period_s(body: &BodyPrediction) -> f64 {
    let mut steps: Vec<f64> = body.middle_s.windows(2).map(|pair| pair[1] - pair[0]).collect();
    crate::diagnosis::statistics::median(&mut steps)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::prediction::Track;

    /// One point that accelerates along boresight.
    fn falling() -> BodyPrediction {
        let point = |time: f64| Point {
            position_m: [0.0, 2.0 + 0.5 * time * time, 0.0],
            velocity_mps: [0.0, time, 0.0],
            normal: [0.0, -1.0, 0.0],
            area_m2: 1.0,
            part: 0,
        };
        let middle_s: Vec<f64> = (0..8).map(|frame| frame as f64 * 0.1).collect();
        let nodes = [-0.05, -0.025, 0.0, 0.025, 0.05];
        let track = |time: f64| {
            let step = |&node: &f64| vec![[0.0, (point(time + node).position_m[1] - point(time).position_m[1]) as f32, 0.0]];
            Track::new(time, nodes.to_vec(), nodes.iter().map(step).collect())
        };
        BodyPrediction {
            parts: vec!["body".into()],
            frames: middle_s.iter().map(|&time| vec![point(time)]).collect(),
            tracks: middle_s.iter().map(|&time| track(time)).collect(),
            middle_s,
            ..BodyPrediction::default()
        }
    }

    #[test]
    fn a_later_body_is_where_it_will_be() {
        let body = falling();
        let moves = Moves::new([0.0; 3]);
        for delay in [0.03, -0.04, 0.17] {
            let (points, inside) = moves.points(&body, 3, Change::Clock(delay));
            let time = 0.3 + delay;
            assert!(inside && (points[0].position_m[1] - 2.0 - 0.5 * time * time).abs() < 1e-7);
            assert!((points[0].velocity_mps[1] - time).abs() < 1e-5);
        }
        // A change in two steps is the change.
        let (mut once, mut twice) = (body.clone(), body.clone());
        moves.apply(&mut once, Change::Clock(0.07));
        moves.apply(&mut twice, Change::Clock(0.04));
        moves.apply(&mut twice, Change::Clock(0.03));
        assert!((once.frames[3][0].position_m[1] - twice.frames[3][0].position_m[1]).abs() < 1e-6);
        let drop = Change::Drop { at: 4, count: 2 };
        assert_eq!(moves.points(&body, 3, drop).0, body.frames[3]);
        assert!((moves.points(&body, 4, drop).0[0].position_m[1] - body.frames[6][0].position_m[1]).abs() < 1e-9);
        assert!(!moves.points(&body, 7, drop).1);
        // Unless the motion goes on.
        let mut longer = body.clone();
        let end = longer.frames.len() - 2;
        longer.middle_s.truncate(end);
        longer.beyond = longer.frames.split_off(end).into_iter().zip(longer.tracks.split_off(end)).collect();
        let (points, known) = moves.points(&longer, 5, drop);
        assert!(known && (points[0].position_m[1] - body.frames[7][0].position_m[1]).abs() < 1e-9);
        assert!(!moves.points(&longer, 5, Change::Drop { at: 4, count: 3 }).1);
        assert!(
            (moves.points(&body, 2, Change::Range(0.1)).0[0].position_m[1] - body.frames[2][0].position_m[1] - 0.1).abs() < 1e-9
        );
    }
}
