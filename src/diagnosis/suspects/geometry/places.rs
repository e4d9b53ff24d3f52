//! Antennas that stand elsewhere than declared (card C2): the phase between two of them grows with the direction.
//!
//! Of every pair of neighbours along x the growth is fitted over the body's cells, whose directions are predicted. Pairs of one
//! baseline see the same body: what errors of the prediction do to one, they do to all of them. Only what differs between such
//! pairs is the antennas' own; what is common to all may as well be a body that is wider or narrower.

use std::f64::consts::TAU;

use nalgebra::{DMatrix, DVector};
use num_complex::Complex64;

use super::channels::Sums;
use super::estimated::Estimated;
use crate::diagnosis::statistics::corrected;
use crate::diagnosis::{Candidate, Correction, Estimate, Evidence, Place, Rung};
use crate::radar::Radar;

/// Baselines that differ by less than this share are one.
const SAME_BASELINE: f64 = 0.02;
/// What may differ between pairs without any displacement, radian per unit of the sine.
const FLOOR: f64 = 0.02;
/// Chance above which it is none.
const LIKELY: f64 = 1e-3;
/// The family's looks at the receivers.
const TRIED: f64 = 2.0;

/// Products of the neighbours along x over some cells, weighted with the powers 0, 1 and 2 of the sine of the cells' directions.
pub type Moments = [Complex64; 3];

/// Neighbours along x, the farther one first.
pub fn neighbours(radar: &Radar) -> Vec<[usize; 2]> {
    let mut order: Vec<usize> = (0..radar.rx_m.len()).collect();
    order.sort_by(|&a, &b| radar.rx_m[a][0].total_cmp(&radar.rx_m[b][0]));
    order.windows(2).map(|pair| [pair[1], pair[0]]).collect()
}

/// `frames`: groups of cells, by frame.
pub fn find(evidence: &Evidence, frames: &[&[Sums]]) -> Option<Candidate> {
    let contrast = contrast(&evidence.radar)?;
    let grown = |sums: &Sums| growth(sums, &contrast);
    let found = Estimated::new(frames, &vec![FLOOR; contrast.nrows()], grown)?;
    let p_value = corrected(found.p_value()?, TRIED);
    if p_value > LIKELY {
        return None;
    }
    let gain = found.foretold(frames, grown).filter(|gain| *gain > 0.0)?;
    Some(candidate(evidence, &contrast, &found, p_value, gain))
}

/// Differences between pairs of one baseline, `[difference, pair]` with orthonormal rows. None where no two pairs are alike.
pub fn contrast(radar: &Radar) -> Option<DMatrix<f64>> {
    let pairs = neighbours(radar);
    let baselines: Vec<f64> = pairs.iter().map(|[far, near]| radar.rx_m[*far][0] - radar.rx_m[*near][0]).collect();
    let alike = |a: f64, b: f64| (a - b).abs() < SAME_BASELINE * a.abs().max(b.abs());
    let mut rows: Vec<DVector<f64>> = vec![];
    for (index, &baseline) in baselines.iter().enumerate() {
        // Against the mean of those before it of the same baseline (Helmert).
        let before: Vec<usize> = (0..index).filter(|&other| alike(baselines[other], baseline)).collect();
        if baseline > 0.0 && !before.is_empty() {
            let mut row = DVector::zeros(pairs.len());
            before.iter().for_each(|&other| row[other] = -1.0 / before.len() as f64);
            row[index] = 1.0;
            rows.push(row.normalize());
        }
    }
    (!rows.is_empty()).then(|| DMatrix::from_fn(rows.len(), pairs.len(), |row, pair| rows[row][pair]))
}

/// In the contrasts, how the phase of a pair grows with the sine: a straight line through the phases of every pair, by weighted
/// least squares.
fn growth(sums: &Sums, contrast: &DMatrix<f64>) -> Option<DVector<f64>> {
    let slope = |moments: &Moments| {
        let [zero, one, two] = moments.map(|moment| moment * Complex64::cis(-moments[0].arg()));
        (one.im * zero.re - zero.im * one.re) / (zero.re * two.re - one.re * one.re)
    };
    let values = contrast * DVector::from_iterator(sums.along.len(), sums.along.iter().map(slope));
    values.iter().all(|value| value.is_finite()).then_some(values)
}

fn candidate(evidence: &Evidence, contrast: &DMatrix<f64>, found: &Estimated, p_value: f64, gain: f64) -> Candidate {
    let radar = &evidence.radar;
    let wave = TAU / radar.wavelength_m();
    let pairs = neighbours(radar);
    // An antenna that stands farther along x is reached earlier by what comes from there.
    let places = |of_pairs: DVector<f64>| -> DVector<f64> {
        let mut offsets: DVector<f64> = DVector::zeros(radar.rx_m.len());
        for ([far, near], growth) in pairs.iter().zip(of_pairs.iter()) {
            offsets[*far] = offsets[*near] - growth / wave;
        }
        let first = offsets[0];
        let offsets = offsets.add_scalar(-first);
        // What grows with the places is as well the body's: the offsets that are told have nothing of it.
        let along = DVector::from_iterator(radar.rx_m.len(), radar.rx_m.iter().map(|at| at[0] - radar.rx_m[0][0]));
        &offsets - &along * (along.dot(&offsets) / along.norm_squared().max(f64::MIN_POSITIVE))
    };
    let offsets = places(contrast.transpose() * &found.values);
    let mut variances: DVector<f64> = DVector::zeros(offsets.len());
    for direction in found.covariance.clone().symmetric_eigen().eigenvectors.column_iter() {
        let variance = (direction.transpose() * &found.covariance * direction)[(0, 0)].max(0.0);
        let moved = places(contrast.transpose() * direction);
        variances += moved.component_mul(&moved) * variance;
    }
    // How much is hidden so is not known, but it is likely to be as much as in any other direction.
    let usual = offsets.norm_squared() / found.values.len() as f64;
    let along = DVector::from_iterator(offsets.len(), radar.rx_m.iter().map(|at| at[0] - radar.rx_m[0][0]));
    variances += along.component_mul(&along) * (usual / along.norm_squared().max(f64::MIN_POSITIVE));
    let deviations: Vec<f64> = variances.iter().map(|variance| variance.sqrt()).collect();
    let list = offsets.iter().map(|offset| format!("{:.0}", 1e6 * offset)).collect::<Vec<_>>().join(", ");
    let growth = found.values.norm();
    let total: f64 = evidence.maps().iter().map(|&power| f64::from(power - 1.0).max(0.0)).sum();
    Candidate {
        id: Some("antenna_position"),
        behaves_like: "phase between receivers that grows with the direction",
        estimates: vec![Estimate::list("offset_m", offsets.as_slice(), &deviations)],
        choice: None,
        place: Place::at("antenna"),
        p_value,
        gain,
        rung: Rung::E,
        // Receivers that hear something of one another, in whatever way, turn phases with the direction as well.
        look_alikes: vec!["mutual_coupling"],
        statement: format!(
            "The phases between neighbouring receivers grow with the direction of the body, and not alike: the receivers stand {list} µm \
             farther along x than declared (against the first, and but for a common stretch, which nothing here would show).",
        ),
        curve: None,
        energy: total * evidence.noise().iter().sum::<f64>() * (growth * 0.2).powi(2),
        correction: Correction::None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::cube::Loaded;
    use crate::diagnosis::suspects::geometry::estimated::walking;

    const RECEIVERS: usize = 4;

    fn evidence() -> Evidence {
        let mut radar = Radar::small(12);
        radar.tx_m = vec![[0.0; 3]];
        radar.rx_m = (0..RECEIVERS).map(|rx| [0.5 * rx as f64 * radar.wavelength_m(), 0.0, 0.0]).collect();
        let samples = vec![Complex64::ONE; radar.dims().iter().product()];
        Evidence::new(Loaded::of_samples(radar, samples, [-1.0, 1.0]), None, None)
    }

    #[test]
    fn displaced_receivers_are_found_and_a_common_stretch_is_none() {
        let evidence = evidence();
        let look = |seed: u64, offsets_m: [f64; RECEIVERS]| {
            let wave = TAU / evidence.radar.wavelength_m();
            let frames = walking(&evidence.radar, seed, |rx, sine| Complex64::cis(-wave * offsets_m[rx] * sine));
            find(&evidence, &frames.iter().map(Vec::as_slice).collect::<Vec<_>>())
        };
        let offsets_m = [0.0, 3e-4, -2e-4, 1e-4];
        let found = look(1, offsets_m).expect("nothing found");
        assert!(found.id == Some("antenna_position") && found.p_value < 1e-4 && found.gain > 6.0, "{found:?}");
        for (offset, [low, high]) in offsets_m.iter().zip(&found.estimates[0].ci90) {
            assert!(low <= offset && offset <= high, "{:?}", found.estimates);
        }
        // As the simulator takes them: of every antenna, along all axes.
        let setting = found.setting(1.0, 1.0, &evidence.radar).expect("no setting");
        let values = &setting.parameters["offset_m"];
        assert!(values.len() == 3 * (1 + RECEIVERS) && values[6] == found.estimates[0].values[1], "{values:?}");
        for seed in 2..12 {
            assert!(look(seed, [0.0; RECEIVERS]).is_none());
        }
        assert!(look(12, [0.0, 2e-4, 4e-4, 6e-4]).is_none());
    }
}
