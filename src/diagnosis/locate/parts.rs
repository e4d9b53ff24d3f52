//! Excess put back onto the body's parts and onto the walls.

use crate::diagnosis::Evidence;
use crate::diagnosis::power::Template;
use crate::diagnosis::prediction::range_and_velocity;
use crate::diagnosis::statistics::{corrected, mean_power_tail};

use super::residual::Residual;

/// Excess in the cells where something is seen.
#[derive(Clone, Debug)]
pub struct Seen {
    /// A part of the body or a boundary of the room.
    pub name: String,
    /// Measured over expected power, weighted by where its own power is expected.
    pub excess_db: f64,
    pub p_value: f64,
}

/// By part of the body; empty without a body.
pub fn by_part(evidence: &Evidence) -> Vec<Seen> {
    let (Some(body), Some(model), Some(residual)) = (&evidence.body, evidence.power(), Residual::new(evidence)) else {
        return vec![];
    };
    let parts = (0..body.parts.len()).map(|part| {
        let per_frame = (0..body.frames.len())
            .map(|frame| Template::keeping(&model.of_parts(frame, |other| other == part), |_, power| power > 0.0));
        seen(&residual, body.parts[part].clone(), per_frame)
    });
    adjusted(parts.flatten().collect())
}

/// By boundary of the room, in the cells of the body's image there (one reflection); empty without body or room.
pub fn by_wall(evidence: &Evidence) -> Vec<Seen> {
    let (Some(body), Some(room), Some(model), Some(residual)) =
        (&evidence.body, &evidence.room, evidence.power(), Residual::new(evidence))
    else {
        return vec![];
    };
    let radar = &evidence.radar;
    let walls = room.boundaries().into_iter().filter_map(|boundary| {
        let (axis, sign) = boundary.axis();
        let plane = sign * room.distance_m(boundary)?;
        let per_frame = body.frames.iter().enumerate().map(|(frame, points)| {
            let map = model.template(points.iter().map(|point| {
                let (near_m, near_mps) = range_and_velocity(radar, point.position_m, point.velocity_mps);
                let (mut position, mut velocity) = (point.position_m, point.velocity_mps);
                position[axis] = 2.0 * plane - position[axis];
                velocity[axis] *= -1.0;
                let (far_m, far_mps) = range_and_velocity(radar, position, velocity);
                (0.5 * (near_m + far_m), 0.5 * (near_mps + far_mps), point.area_m2 / (near_m * far_m).powi(2).max(1e-6))
            }));
            let support = model.support(frame);
            let least = 1e-3 * map.iter().copied().fold(0.0, f32::max);
            Template::keeping(&map, |cell, power| power > least && !support[cell])
        });
        seen(&residual, boundary.name().into(), per_frame)
    });
    adjusted(walls.collect())
}

/// `templates`: of every frame.
fn seen(residual: &Residual, name: String, templates: impl Iterator<Item = Template>) -> Option<Seen> {
    let (mut sum, mut weight, mut square) = (0.0, 0.0, 0.0);
    for (frame, Template { cells, power }) in templates.enumerate() {
        let (ratios, counts) = (residual.ratio.below([frame]), residual.count.below([frame]));
        let peak = power.iter().copied().fold(0.0, f32::max).max(f32::MIN_POSITIVE);
        for (cell, power) in cells.into_iter().zip(power) {
            let own = f64::from(power / peak);
            let count = f64::from(counts[cell as usize]);
            if count > 0.0 {
                sum += own * count * f64::from(ratios[cell as usize]);
                weight += own * count;
                square += own * own * count;
            }
        }
    }
    if weight <= 0.0 {
        return None;
    }
    let mean: f64 = sum / weight;
    // A weighted sum of gamma laws is nearly one of as many values as its variance says.
    let p_value = if mean > 1.0 { mean_power_tail(mean, weight * weight / square) } else { 1.0 };
    Some(Seen { name, excess_db: 10.0 * mean.max(1e-12).log10(), p_value })
}

fn adjusted(mut seen: Vec<Seen>) -> Vec<Seen> {
    let tried = seen.len() as f64;
    seen.iter_mut().for_each(|seen| seen.p_value = corrected(seen.p_value, tried));
    seen.sort_by(|a, b| a.p_value.total_cmp(&b.p_value).then(b.excess_db.total_cmp(&a.excess_db)));
    seen
}
