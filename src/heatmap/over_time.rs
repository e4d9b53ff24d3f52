//! Maps over the frames of a recording: one column per frame.

use rayon::prelude::*;

use super::{Analysis, Axis, Gate, Map, Samples, Scan};

impl Analysis {
    /// Start of every frame, seconds.
    pub fn time_axis(&self, frames: usize) -> Axis {
        Axis::new("time", "s", (0..frames).map(|frame| self.radar.chirp_time_s(frame, 0, 0)).collect())
    }

    /// Power `[velocity, time]`, summed over the gate's ranges, a column a frame. Remove what is static before.
    pub fn time_doppler(&self, samples: Samples<'_>, gate: &Gate) -> Map {
        self.over_time(samples, self.velocity_axis(), |frame| {
            let map = self.range_doppler(frame);
            let row = |cells: &[f64]| {
                cells.iter().zip(&map.columns.values).filter(|(_, range)| gate.holds_range(**range)).map(|(power, _)| power).sum()
            };
            map.values.chunks_exact(map.columns.len()).map(row).collect()
        })
    }

    /// Power `[range, time]`, summed over the gate's velocities.
    pub fn time_range(&self, samples: Samples<'_>, gate: &Gate) -> Map {
        self.over_time(samples, self.range_axis(), |frame| {
            let map = self.range_doppler(frame);
            let mut sum = vec![0.0; map.columns.len()];
            for (cells, _) in
                map.values.chunks_exact(sum.len()).zip(&map.rows.values).filter(|(_, velocity)| gate.holds_velocity(**velocity))
            {
                sum.iter_mut().zip(cells).for_each(|(sum, power)| *sum += power);
            }
            sum
        })
    }

    /// Power `[angle, time]`, summed over the gate's ranges and velocities.
    pub fn time_angle(&self, samples: Samples<'_>, scan: &Scan, gate: &Gate) -> Map {
        self.over_time(samples, scan.axis().clone(), |frame| {
            let map = self.range_angle(frame, scan, gate);
            map.values.chunks_exact(map.columns.len()).map(|cells| cells.iter().sum()).collect()
        })
    }

    fn over_time(&self, samples: Samples<'_>, rows: Axis, column: impl Fn(&[num_complex::Complex32]) -> Vec<f64> + Sync) -> Map {
        let frames = samples.frames();
        let columns: Vec<Vec<f64>> = (0..frames).into_par_iter().map(|frame| column(samples.frame(frame))).collect();
        let values = (0..rows.len()).flat_map(|row| columns.iter().map(move |column| column[row])).collect();
        Map::new(rows, self.time_axis(frames), values)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::heatmap::{HeatmapConfig, synthetic};
    use crate::radar::Radar;

    /// Walks away for two frames, and comes back for two.
    fn walk(time: f64) -> f64 {
        if time < 0.1 { 3.0 + 2.0 * time } else { 3.2 - 2.0 * (time - 0.1) }
    }

    fn recording() -> (Radar, Vec<num_complex::Complex32>) {
        let radar = Radar { frames: 4, ..synthetic::radar() };
        let signal = synthetic::point(&radar, |time| [-walk(time) * 0.5, walk(time) * 0.75f64.sqrt(), 0.0]);
        (radar, signal)
    }

    fn peaks(map: &Map) -> Vec<f64> {
        let times = map.columns.values.clone();
        let row = |time: f64| map.peak_where(|_, column| column == time).unwrap()[0];
        times.into_iter().map(|time| map.rows.values[row(time)]).collect()
    }

    #[test]
    fn a_walker_who_turns_round_changes_velocity_and_range_over_time_and_keeps_his_angle() {
        let (radar, signal) = recording();
        let samples = Samples::new(&signal, radar.dims());
        let analysis = Analysis::new(&radar, &HeatmapConfig::default());
        let step = radar.velocity_resolution_mps();
        for (found, wanted) in peaks(&analysis.time_doppler(samples, &Gate::default())).iter().zip([2.0, 2.0, -2.0, -2.0]) {
            assert!((found - wanted).abs() < 0.6 * step, "found {found} m/s, wanted {wanted} m/s, bins of {step}");
        }
        let ranges = peaks(&analysis.time_range(samples, &Gate::default()));
        for (frame, found) in ranges.iter().enumerate() {
            // the middle of the loops
            let wanted = walk(frame as f64 * radar.frame_period_s + 0.5 * 48.0 * radar.loop_period_s());
            assert!((found - wanted).abs() < 0.6 * radar.range_resolution_m(), "found {found} m, wanted {wanted} m");
        }
        let angles = peaks(&analysis.time_angle(samples, &Scan::azimuth(75.0, 1.0), &Gate::range(2.0, 4.0)));
        assert!(angles.iter().all(|angle| (angle + 30.0).abs() <= 1.0), "{angles:?}");
    }

    #[test]
    fn a_gate_shuts_out_what_lies_beyond_it() {
        let (radar, signal) = recording();
        let samples = Samples::new(&signal, radar.dims());
        let analysis = Analysis::new(&radar, &HeatmapConfig::default());
        let (open, far) = (Gate::default(), Gate::range(10.0, 12.0));
        assert!(analysis.time_doppler(samples, &far).max() < 1e-3 * analysis.time_doppler(samples, &open).max());
        let approaching = Gate { velocity_mps: Some([-3.0, -1.0]), range_m: None };
        let map = analysis.time_range(samples, &approaching);
        let power = |frame| map.values.iter().skip(frame).step_by(4).sum::<f64>();
        assert!(power(0) < 1e-3 * power(3));
    }
}
