//! The pictures of a diagnosis, drawn into its page.

use super::super::evidence::{Evidence, transform};
use super::super::finding::Curve;
use super::super::journey::Diagnosis;
use super::super::locate;
use super::super::simulate::Simulated;
use super::super::support::Support;
use crate::data::Scratch;
use crate::error::Result;
use crate::heatmap::{Axis, Map, range_axis, velocity_axis};
use crate::metrics::DbWindow;
use crate::pictures::page::{Markup, picture};
use crate::pictures::{Captions, Chart, Series, comparison, window};
use crate::radar::Radar;

/// Titles or names, and what they are of.
pub(super) struct Pictures {
    pub(super) maps: Vec<(String, Markup)>,
    curves: Vec<(String, Markup)>,
    pub(super) profiles: Vec<Markup>,
}

impl Pictures {
    pub(super) fn draw(diagnosis: &Diagnosis, simulated: Option<&Simulated>) -> Result<Self> {
        let folder = Scratch::new()?;
        let mut pictures = Self { maps: vec![], curves: vec![], profiles: vec![] };
        let Some(explanation) = &diagnosis.explanation else { return Ok(pictures) };
        let path = folder.path().join("picture.png");
        // One scale for both, from the noise (0 dB) up.
        let mut shown: Option<DbWindow> = None;
        for (title, first, evidence) in [
            ("Before: the recording against the baseline", "recording", &diagnosis.original),
            (
                "After: the recording with the effects taken out (what they hid is dark), against the baseline",
                "recording less effects",
                &explanation.evidence,
            ),
        ] {
            if explanation.accepted.is_empty() && !std::ptr::eq(evidence, &diagnosis.original) {
                continue;
            }
            let [measured, expected] = held_out_maps(evidence, &diagnosis.radar);
            let window = *shown.get_or_insert_with(|| DbWindow { low_db: 0.0, high_db: measured.max().max(20.0) });
            let captions = Captions { title: "Held-out data, dB over the noise", first, second: "baseline" };
            comparison(&path, captions, &measured, &expected, window)?;
            pictures.maps.push((title.into(), picture(&path, title)?));
        }
        if let Some(Simulated { maps: [measured, before, after], .. }) = simulated {
            let window = window(measured);
            for (title, map) in [("The trained simulator", before), ("The trained simulator with the effects", after)] {
                comparison(&path, Captions::simulated(title), measured, map, window)?;
                pictures.maps.push((title.into(), picture(&path, title)?));
            }
        }
        for accepted in &explanation.accepted {
            if let Some(curve) = &accepted.candidate.curve {
                chart(curve).save(&path)?;
                let name = accepted.candidate.id.unwrap_or(accepted.candidate.behaves_like.words());
                pictures.curves.push((name.into(), picture(&path, "fitted curve")?));
            }
        }
        let (before, after) = (locate::profiles(&diagnosis.original), locate::profiles(&explanation.evidence));
        for (before, after) in before.iter().zip(&after).filter(|(before, _)| before.at.len() > 1) {
            let compared = (!explanation.accepted.is_empty()).then_some(after);
            for chart in along(before, compared) {
                chart.save(&path)?;
                pictures.profiles.push(picture(&path, &chart.title)?);
            }
        }
        Ok(pictures)
    }

    /// Of what was found under a name, where it has one.
    pub(super) fn curve(&self, name: &str) -> Option<&Markup> {
        self.curves.iter().find(|(known, _)| known == name).map(|(_, picture)| picture)
    }
}

/// Along one axis: the excess, where the cells of the maps have that axis; and how unlikely each of its values is under the null.
fn along(before: &locate::Profile, after: Option<&locate::Profile>) -> Vec<Chart> {
    let (name, x_label) = match (before.axis, before.unit) {
        ("sample", _) => ("fast time", "sample of the chirp".to_string()),
        ("chirp", _) => ("slow time within a frame", "loop of the frame".into()),
        ("frame", _) => ("slow time", "frame".into()),
        ("range", unit) => ("beat frequency", format!("range ({unit})")),
        ("velocity", unit) => ("Doppler frequency", format!("velocity ({unit})")),
        (axis, _) => (axis, format!("{axis} (channel)")),
    };
    let drawn = |title: String, y_label: &str, of: &dyn Fn(&locate::Profile) -> Vec<f64>| {
        let series = |name: &str, profile: &locate::Profile| Series {
            name: name.into(),
            points: profile.at.iter().zip(of(profile)).map(|(&x, y)| [x, y]).collect(),
        };
        let mut lines = vec![series("before", before)];
        lines.extend(after.map(|after| series("with the effects", after)));
        Chart { title, x_label: x_label.clone(), y_label: y_label.into(), series: lines, ..Chart::default() }
    };
    // A product of probabilities may be too small for a number.
    let significance = |profile: &locate::Profile| profile.p_value.iter().map(|p| -p.max(f64::MIN_POSITIVE).log10()).collect();
    let mut charts = vec![];
    if ["range", "velocity", "frame"].contains(&before.axis) {
        let excess = |profile: &locate::Profile| profile.excess_db.clone();
        charts.push(drawn(format!("Power over what is expected, along {name}"), "excess (dB)", &excess));
    }
    charts.push(drawn(format!("Significance along {name}"), "-log10 of the chance under the null", &significance));
    charts
}

fn chart(curve: &Curve) -> Chart {
    let series = curve
        .series
        .iter()
        .map(|(name, x, y)| Series { name: name.clone(), points: x.iter().zip(y).map(|(&x, &y)| [x, y]).collect() });
    Chart {
        title: curve.title.clone(),
        x_label: curve.x_label.clone(),
        y_label: curve.y_label.clone(),
        series: series.collect(),
        ..Chart::default()
    }
}

/// Power over the noise, dB, mean over held-out frames and channels: measured, and what the baseline expects.
fn held_out_maps(evidence: &Evidence, radar: &Radar) -> [Map; 2] {
    let [_, _, _, loops, samples] = evidence.cube.dims;
    let support = Support::new(radar, evidence.room.as_ref());
    let channels = evidence.cube.channels();
    let count = (evidence.split.held_out.len() * channels).max(1) as f64;
    let (mut measured, mut expected) = (vec![0.0; loops * samples], vec![0.0; loops * samples]);
    for channel in 0..channels {
        let variance = evidence.noise()[channel].max(f64::MIN_POSITIVE) * count;
        let clutter = transform(&support.project(&evidence.clutter()[channel * samples..][..samples]).repeat(loops), samples);
        for &frame in &evidence.split.held_out {
            let seen = transform(evidence.cube.channel(frame, channel), samples);
            let moving = evidence.expected(frame);
            for cell in 0..loops * samples {
                measured[cell] += seen[cell].norm_sqr() / variance;
                expected[cell] += clutter[cell].norm_sqr() / variance + f64::from(moving[cell]) / count;
            }
        }
    }
    let (rows, columns) = (velocity_axis(radar), range_axis(radar));
    [measured, expected].map(|power| {
        // From FFT order to ascending velocities.
        let values = (0..loops)
            .flat_map(|row| (0..columns.len()).map(move |column| ((row + loops - loops / 2) % loops) * samples + column))
            .map(|cell| 10.0 * power[cell].max(1e-3).log10())
            .collect();
        Map::new(Axis::clone(&rows), Axis::clone(&columns), values)
    })
}

#[cfg(test)]
mod tests {
    use num_complex::Complex64;

    use super::*;

    /// A burst in one sample of every other chirp is nothing along slow time but for its frames, and all along fast time.
    #[test]
    fn the_score_is_drawn_along_every_axis_and_shows_where_it_is() {
        let radar = Radar { samples_per_chirp: 32, ..Radar::small(8) };
        let evidence = Evidence::in_noise(radar, 5, |[_, _, index, sample]| {
            Complex64::from(if sample == 11 && index % 2 == 0 { 6.0 } else { 0.0 })
        });
        let profiles = locate::profiles(&evidence);
        let charts: Vec<Chart> =
            profiles.iter().filter(|profile| profile.at.len() > 1).flat_map(|one| along(one, None)).collect();
        let titles: Vec<&str> = charts.iter().map(|chart| chart.title.as_str()).collect();
        for axis in ["fast time", "slow time", "slow time within a frame", "beat frequency", "Doppler frequency", "rx"] {
            assert!(titles.contains(&format!("Significance along {axis}").as_str()), "{axis}: {titles:?}");
        }
        let fast = charts.iter().find(|chart| chart.title == "Significance along fast time").unwrap();
        let largest = fast.series[0].points.iter().max_by(|a, b| a[1].total_cmp(&b[1])).unwrap();
        assert!(largest[0] == 11.0 && largest[1] > 10.0, "{largest:?}");
    }
}
