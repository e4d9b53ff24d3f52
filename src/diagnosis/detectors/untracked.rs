//! Movers of a recording in which nobody is tracked: power in the range-Doppler maps away from static clutter.
//!
//! Whether something moves is judged frame by frame. Where it is and how fast is then read from the longest stretch without
//! a gap, because blocks of a long frame resolve velocities poorly; two people who pass one another at one range differ in
//! nothing else.

mod moving_radar;
mod stretch;

use num_complex::Complex64;

use stretch::{Cell, NEAREST_BIN, Stretch};

use super::azimuth::{Azimuth, azimuth};
use super::cfar;
use super::receiver::wandering;
use super::region::{Region, floor, mean_map, moves, power_gain, removal, run};
use crate::diagnosis::behaviour::Behaviour;
use crate::diagnosis::evidence::{Evidence, MAY_MOVE, REACH_M, signed};
use crate::diagnosis::finding::{Candidate, Estimate, Place};
use crate::diagnosis::statistics;
use crate::effects::{self, Stage};

/// Standard deviation of how high something stands, which receivers in a row do not show, over its range.
const HEIGHT: f64 = 0.3;
/// Factor by which a mover's cell must exceed the median over velocities: a floor is no more even than that.
const ABOVE_FLOOR: f64 = 4.0;
/// Chance, over all cells, at which a cell of the floor stands out of it as much.
const OF_FLOOR: f64 = 0.01;
/// Power over the noise of a mover beside one that was found already: what its removal leaves is less.
const BESIDE_ANOTHER: f64 = 100.0;

/// At most one candidate: the strongest mover, else a radar that moves. None where somebody is tracked.
pub fn find(evidence: &Evidence) -> Vec<Candidate> {
    if evidence.body.is_some() {
        return vec![];
    }
    strongest(evidence).or_else(|| moving_radar::find(evidence)).into_iter().collect()
}

/// The strongest mover, if any.
fn strongest(evidence: &Evidence) -> Option<Candidate> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let (training, held_out) = (&evidence.split.training, &evidence.split.held_out);
    let cells = loops * samples;
    let mean = mean_map(evidence, training);
    let peak = peak(evidence, &mean)?;
    let (doppler, range) = (peak / samples, peak % samples);
    let count = training.len() as f64 * evidence.cube.channels() as f64;
    let p_value = statistics::corrected(statistics::mean_power_tail(mean[peak], count), cells as f64);
    let another = evidence.accepted.contains(&effects::moving_reflector::ID);
    if p_value > 0.01 || held_out.is_empty() || another && mean[peak] < BESIDE_ANOTHER {
        return None;
    }
    // What keeps its beat frequency whatever its Doppler frequency says is no return.
    let tone = wandering::find(evidence).filter(|tone| tone.p_value < 0.01 && tone.is_at([doppler, range], [loops, samples]));
    if tone.is_some() {
        return None;
    }
    if evidence.is_said_to_move() {
        return None;
    }
    let mover = Mover::new(evidence, [doppler, range]);
    let gain: f64 = (0..cells)
        .filter(|&cell| cell == peak || moves(cell / samples, loops) && mover.holds(cell / samples, cell % samples))
        .flat_map(|cell| held_out.iter().map(move |&f| (f, cell)))
        .map(|(f, cell)| power_gain(evidence, f, cell, mean[cell]))
        .sum();
    if gain < 3.0 {
        return None;
    }
    let found = mover.candidate(10.0 * mean[peak].log10(), p_value, gain);
    Some(if evidence.may_move() { relative(found) } else { found })
}

/// The same where nothing says that the radar stands still.
fn relative(found: Candidate) -> Candidate {
    let statement = format!("{} {MAY_MOVE}.", found.statement);
    Candidate { id: None, estimates: vec![], statement, ..found }
}

/// The strongest cell that moves and stands out of its range's floor, `doppler · samples + range`.
fn peak(evidence: &Evidence, mean: &[f64]) -> Option<usize> {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let bins = evidence.range_bins();
    let moving: Vec<usize> = (0..loops).filter(|&doppler| moves(doppler, loops)).collect();
    // A floor over all velocities is the modulation of something strong, no mover.
    let floor: Vec<Option<f64>> = (0..bins).map(|r| floor(evidence, mean, r, 1)).collect();
    let (frames, channels) = (evidence.split.training.len() as f64, evidence.cube.channels() as f64);
    let law = cfar::Cells { frames, channels, values: (moving.len() as f64 / cfar::BINS_PER_VALUE).max(1.0) };
    let tried = (bins * moving.len()) as f64;
    let stands_out =
        |power: f64, floor: f64| power > ABOVE_FLOOR * floor && statistics::corrected(law.tail(power, floor), tried) < OF_FLOOR;
    let candidates: Vec<usize> = (moving.iter())
        .flat_map(|&d| (NEAREST_BIN..bins).map(move |r| (d, r)))
        .filter(|&(d, r)| floor[r].is_some_and(|floor| stands_out(mean[d * samples + r], floor)))
        .map(|(d, r)| d * samples + r)
        .collect();
    candidates.iter().copied().max_by(|&a, &b| mean[a].total_cmp(&mean[b]))
}

/// A mover in the longest stretch without a gap.
struct Mover<'a> {
    evidence: &'a Evidence,
    /// Frames transformed as one.
    run: usize,
    stretch: Stretch,
    top: Cell,
    /// +1 or −1.
    sign: i64,
    region: Vec<Cell>,
    /// The region's ends.
    dopplers: [f64; 2],
    ranges: [f64; 2],
}

impl<'a> Mover<'a> {
    /// From its strongest cell in the maps of single frames.
    fn new(evidence: &'a Evidence, [doppler, range]: [usize; 2]) -> Self {
        let signed = signed(doppler as f64, evidence.cube.dims[3]);
        let run = run(evidence);
        let stretch = Stretch::new(evidence, run);
        let sign = signed.signum() as i64;
        let top = stretch.peak([signed as i64 * run as i64, range as i64], run as i64 + run as i64 / 2, sign);
        let reach = (REACH_M / evidence.radar.range_resolution_m()).max(2.0) as i64;
        let region = stretch.around(top, sign, reach, evidence.range_bins());
        let span = |axis: usize| {
            let values = region.iter().map(|cell| cell[axis]);
            [values.clone().min().unwrap_or(top[axis]) as f64, values.max().unwrap_or(top[axis]) as f64]
        };
        let (dopplers, ranges) = (span(0), span(1));
        Self { evidence, run, stretch, top, sign, region, dopplers, ranges }
    }

    /// Whether a cell of a single frame's maps is within its region.
    fn holds(&self, d: usize, r: usize) -> bool {
        let scaled = signed(d as f64, self.evidence.cube.dims[3]) * self.run as f64;
        let (dopplers, ranges) = (self.dopplers, self.ranges);
        (dopplers[0]..=dopplers[1]).contains(&scaled) && (ranges[0]..=ranges[1]).contains(&(r as f64))
    }

    fn energy(&self) -> f64 {
        let noise = self.evidence.total_noise();
        self.region.iter().map(|&cell| (self.stretch.at(cell) - 1.0).max(0.0)).sum::<f64>()
            * noise
            * (self.evidence.cube.dims[0] / self.run) as f64
    }

    /// What is taken away with it.
    fn cut(&self) -> Region {
        let (dopplers, ranges) = (self.dopplers, self.ranges);
        // Past zero Doppler it would be somebody else's.
        Region {
            range: [ranges[0] - 1.0, ranges[1] + 1.0],
            doppler: if self.sign > 0 { [dopplers[0] - 1.0, dopplers[1] + 2.0] } else { [dopplers[0] - 2.0, dopplers[1] + 1.0] },
        }
    }

    fn candidate(&self, decibel: f64, p_value: f64, gain: f64) -> Candidate {
        let &Self { evidence, run, ref stretch, top, dopplers, ranges, .. } = self;
        let radar = &evidence.radar;
        let (bin_m, bin_mps) = (radar.range_resolution_m(), radar.velocity_resolution_mps() / run as f64);
        let centre = top[1] as f64 + stretch.summit(top, [0, 1]);
        let range_m = centre * bin_m;
        let velocity_mps = (top[0] as f64 + stretch.summit(top, [1, 0])) * bin_mps;
        // On the flank of what is slower, nothing says how slow.
        let slower = (dopplers[0].abs().max(dopplers[1].abs()) + 0.5) * bin_mps;
        let modulo = format!("(modulo {:.2} m/s)", 2.0 * radar.max_velocity_mps());
        let (velocities, motion) = if stretch.is_flank(top) {
            ([-slower, slower], format!("more slowly than {slower:.2} m/s {modulo}"))
        } else {
            ([(dopplers[0] - 0.5) * bin_mps, (dopplers[1] + 0.5) * bin_mps], format!("with {velocity_mps:+.2} m/s {modulo}"))
        };
        let snapshots: Vec<Vec<Complex64>> =
            stretch.maps.iter().map(|channels| channels.iter().map(|map| map[stretch.index(top)]).collect()).collect();
        let azimuth = azimuth(evidence, &snapshots, top[0] as f64 / stretch.loops as f64);
        let direction = azimuth.map_or(String::new(), |azimuth| format!(", {:+.0}° to the side", azimuth.degrees));
        let estimates = azimuth.map_or(vec![], |Azimuth { degrees, deviation }| {
            let (s, c) = degrees.to_radians().sin_cos();
            let across = range_m * deviation.to_radians();
            let centre = radar.centre_m();
            vec![Estimate::list(
                "position_m",
                &[centre[0] + range_m * s, centre[1] + range_m * c, centre[2]],
                &[(across * c).abs().max(0.3 * bin_m), (across * s).abs().max(0.3 * bin_m), HEIGHT * range_m],
            )]
        });
        let place = Place {
            range_m: Some([(ranges[0] - 0.5).max(0.0) * bin_m, (ranges[1] + 0.5) * bin_m]),
            velocity_mps: Some(velocities),
            azimuth_deg: azimuth.map(|Azimuth { degrees, deviation }| [degrees - 2.0 * deviation, degrees + 2.0 * deviation]),
            ..Place::at(Stage::Scene)
        };
        Candidate {
            id: Some(effects::moving_reflector::ID),
            estimates,
            statement: format!(
                "Something moves at {range_m:.2} m {motion} along the line of sight{direction}, {decibel:.0} dB above the noise, and nobody is tracked there."
            ),
            energy: self.energy(),
            correction: removal(evidence, run, self.cut()),
            ..Candidate::new(Behaviour::PathLike, place, p_value, gain)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::diagnosis::cube::{Cube, Loaded, Split};
    use crate::radar::Radar;
    use crate::support;

    /// Four blocks of one long frame; movers as (range bin, Doppler bin of the long frame, sine of the azimuth, amplitude).
    fn evidence(movers: &[(f64, f64, f64, f64)]) -> Evidence {
        shaken(movers, 3, 0.0)
    }

    /// The same where the phase of all that is received is drawn anew for every chirp, with this standard deviation.
    fn shaken(movers: &[(f64, f64, f64, f64)], seed: u64, deviation: f64) -> Evidence {
        let (blocks, loops, samples) = (4, 16, 64);
        let mut radar = Radar::small(blocks);
        radar.loops_per_frame = loops;
        radar.samples_per_chirp = samples;
        radar.frame_period_s = loops as f64 * radar.loop_period_s();
        let dims = radar.dims();
        let wavelength = radar.wavelength_m();
        let mut normal = support::normal(seed);
        let phases: Vec<f64> = (0..blocks * loops * dims[1]).map(|_| deviation * normal()).collect();
        let mut values = vec![];
        for (frame, tx, rx) in (0..blocks).flat_map(|f| (0..dims[1]).flat_map(move |t| (0..dims[2]).map(move |r| (f, t, r)))) {
            let across = radar.tx_m[tx][0] + radar.rx_m[rx][0];
            for (l, n) in (0..loops).flat_map(|l| (0..samples).map(move |n| (l, n))) {
                let turn = tx as f64 / dims[1] as f64 + (frame * loops + l) as f64;
                let mut value = Complex64::from_polar(50.0, 0.4 * n as f64);
                for &(range, doppler, sine, amplitude) in movers {
                    let turns =
                        range * n as f64 / samples as f64 + doppler * turn / (blocks * loops) as f64 - across * sine / wavelength;
                    value += Complex64::from_polar(amplitude, std::f64::consts::TAU * turns);
                }
                let noise = Complex64::new(normal(), normal()) * 0.5f64.sqrt();
                values.push(value * Complex64::cis(phases[(frame * loops + l) * dims[1] + tx]) + noise);
            }
        }
        let starts_s = (0..blocks).map(|block| block as f64 * radar.frame_period_s).collect();
        let split = Split { training: vec![0, 1, 3], held_out: vec![2], block_loops: Some(loops) };
        let cube = Cube::new(dims, values);
        Evidence::new(Loaded { cube, radar, split, starts_s, extremes: [-100.0, 100.0] }, None, None)
    }

    #[test]
    fn two_who_pass_one_another_are_found_with_their_velocities_and_then_nobody() {
        let mut evidence = evidence(&[(20.3, 8.4, -0.1, 5.0), (20.0, -9.0, 0.3, 4.0)]);
        let bin_mps = evidence.radar.velocity_resolution_mps() / 4.0;
        for doppler in [8.4, -9.0] {
            let found = find(&evidence);
            assert_eq!(found.len(), 1);
            let [low, high] = found[0].place.velocity_mps.unwrap();
            assert!(found[0].p_value < 1e-6 && found[0].nats > 10.0, "{found:?}");
            assert!(low < doppler * bin_mps && doppler * bin_mps < high && low * high > 0.0, "{low} to {high} m/s");
            evidence = evidence.with(&found[0]);
        }
        assert!(find(&evidence).is_empty(), "{:?}", find(&evidence));
    }

    #[test]
    fn nobody_is_seen_in_a_static_room() {
        let found = find(&evidence(&[]));
        assert!(found.iter().all(|candidate| candidate.p_value > 5e-4), "{found:?}");
    }

    /// What is left there, of which no floor is known, is nobody.
    #[test]
    fn nobody_is_seen_where_all_was_taken_out() {
        let mut evidence = evidence(&[(20.3, 8.4, -0.1, 5.0)]);
        evidence.emptied.push(std::sync::Arc::new(|_, range| (15..26).contains(&range)));
        let found = find(&evidence);
        assert!(found.iter().all(|candidate| candidate.p_value > 5e-4), "{found:?}");
    }

    /// Its Doppler sidelobes are static clutter's, as those of a few chirps are uneven.
    #[test]
    fn nobody_is_seen_where_phases_are_random_from_chirp_to_chirp() {
        for seed in 0..20 {
            let found = find(&shaken(&[], seed, 0.2));
            assert!(found.is_empty(), "{seed}: {found:?}");
        }
        let found = find(&shaken(&[(20.3, 5.0, -0.1, 60.0)], 3, 0.05));
        assert_eq!(found.len(), 1);
    }
}
