//! The heatmaps that verbs draw of a recording, measured or simulated.

use std::path::{Path, PathBuf};

use num_complex::Complex32;

use crate::{
    error::{Error, Result},
    heatmap::{Analysis, Gate, HeatmapConfig, Map, Samples, Scan, StaticRemoval, remove_static},
    pictures,
    radar::Radar,
};

/// A picture's title, and its file.
pub type Drawn = (&'static str, PathBuf);

/// One heatmap of a recording.
pub struct Heatmap {
    /// Such as `range_doppler`.
    pub name: &'static str,
    pub title: &'static str,
    /// Power, linear.
    pub map: Map,
}

/// A trained simulator speaks for one radar; the number of frames is free.
pub fn same_radar(folder: &Path, found: &Radar, trained: &Radar) -> Result<()> {
    if found.is_same_board(trained) {
        return Ok(());
    }
    Err(Error::field(folder.join("recording.toml"), "radar", "another radar", "that of the checkpoint")
        .with_hint("train on a recording of this radar first; `hybridsim check` shows both"))
}

/// Draws heatmaps of recordings of one radar.
pub struct Pictures {
    radar: Radar,
    analysis: Analysis,
    heatmap: HeatmapConfig,
}

impl Pictures {
    /// Prepares the pictures of one radar's recordings.
    pub fn new(radar: &Radar, heatmap: &HeatmapConfig) -> Self {
        Self { radar: radar.clone(), analysis: Analysis::new(radar, heatmap), heatmap: heatmap.clone() }
    }

    /// Pictures of one recording, `[frame, tx, rx, loop, sample]`.
    pub fn show(&self, folder: &Path, samples: &[Complex32]) -> Result<Vec<Drawn>> {
        self.maps(samples)
            .into_iter()
            .map(|Heatmap { name, title, map }| {
                let (file, map) = (folder.join(format!("{name}.png")), self.db(&map, &map));
                pictures::heatmap(&file, title, &map, pictures::window(&map))?;
                Ok((title, file))
            })
            .collect()
    }

    /// Pictures of a measured recording, its simulation and their difference.
    pub fn compare(&self, folder: &Path, measured: &[Complex32], simulated: &[Complex32]) -> Result<Vec<Drawn>> {
        self.maps(measured)
            .into_iter()
            .zip(self.maps(simulated))
            .map(|(measured, simulated)| self.compared(folder, &measured, &simulated))
            .collect()
    }

    /// The same of time-Doppler alone, where there are two frames.
    pub fn compare_time_doppler(&self, folder: &Path, measured: &[Complex32], simulated: &[Complex32]) -> Result<Drawn> {
        let of = |samples: &[Complex32]| {
            let dims = self.dims(samples);
            let moving = remove_static(Samples::new(samples, dims), StaticRemoval::Loops);
            self.time_doppler(Samples::new(&moving, dims))
        };
        self.compared(folder, &of(measured), &of(simulated))
    }

    fn compared(&self, folder: &Path, measured: &Heatmap, simulated: &Heatmap) -> Result<Drawn> {
        let file = folder.join(format!("{}.png", measured.name));
        let [measured_db, simulated_db] = [measured, simulated].map(|heatmap| self.db(&heatmap.map, &measured.map));
        pictures::comparison(
            &file,
            pictures::Captions::simulated(measured.title),
            &measured_db,
            &simulated_db,
            pictures::window(&measured_db),
        )?;
        Ok((measured.title, file))
    }

    fn dims(&self, samples: &[Complex32]) -> [usize; 5] {
        let [_, tx, rx, loops, length] = self.radar.dims();
        [samples.len() / (tx * rx * loops * length), tx, rx, loops, length]
    }

    /// `moving`: without what is static.
    fn time_doppler(&self, moving: Samples<'_>) -> Heatmap {
        let map = self.analysis.spectrogram(moving, &Gate::default());
        Heatmap { name: "time_doppler", title: "Time-Doppler, static removed", map }
    }

    /// Decibels of a power map, with the floor of the settings below the strongest cell of another.
    pub fn db(&self, map: &Map, reference: &Map) -> Map {
        map.db(self.heatmap.floor_amplitude(reference.max().sqrt()))
    }

    /// Power of every heatmap of these samples, `[frame, tx, rx, loop, sample]`. Those over time need two frames, those over
    /// azimuth two antenna pairs.
    pub fn maps(&self, samples: &[Complex32]) -> Vec<Heatmap> {
        let dims @ [frames, tx, rx, ..] = self.dims(samples);
        let still = Samples::new(samples, dims);
        let moving = remove_static(still, StaticRemoval::Loops);
        let moving = Samples::new(&moving, dims);
        let middle = frames / 2;
        let everywhere = Gate::default();
        let scan = Scan::azimuth(60.0, 2.0);
        let mut maps = Vec::new();
        let mut add = |name, title, map| maps.push(Heatmap { name, title, map });
        add("range_doppler", "Range-Doppler, middle frame", self.analysis.range_doppler(still.frame(middle)));
        add(
            "range_doppler_moving",
            "Range-Doppler, middle frame, static removed",
            self.analysis.range_doppler(moving.frame(middle)),
        );
        if tx * rx > 1 {
            let map = self.analysis.range_angle(moving.frame(middle), &scan, &everywhere);
            add("range_azimuth", "Range-azimuth, middle frame, static removed", map);
        }
        if frames > 1 {
            let Heatmap { name, title, map } = self.time_doppler(moving);
            add(name, title, map);
            add("time_range", "Time-range, static removed", self.analysis.time_range(moving, &everywhere));
            if tx * rx > 1 {
                add("time_azimuth", "Time-azimuth, static removed", self.analysis.time_angle(moving, &scan, &everywhere));
            }
        }
        maps
    }
}
