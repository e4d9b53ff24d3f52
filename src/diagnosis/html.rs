//! `report.html`: the same as `report.json` for people; one file, nothing to load.

use std::fmt::Write;
use std::path::Path;

use base64::Engine;
use base64::prelude::BASE64_STANDARD;

use super::evidence::{Evidence, transform};
use super::finding::{Curve, Place};
use super::journey::Diagnosis;
use super::locate;
use super::report::{Effect, Report, Unexplained, Verdict};
use super::simulate::Simulated;
use super::support::Support;
use crate::data::{Scratch, files};
use crate::error::Result;
use crate::heatmap::{Axis, Map, range_axis, velocity_axis};
use crate::metrics::DbWindow;
use crate::pictures::{Chart, Series, comparison};
use crate::radar::Radar;
use crate::text::shown;

const STYLE: &str = "body{font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem;color:#1c1c1c}\
h1{font-size:1.6rem}h2{font-size:1.25rem;margin-top:2.2rem;border-bottom:1px solid #ccc}\
.lead{font-size:1.15rem;background:#eef3f8;padding:.8rem 1rem;border-left:4px solid #0072b2}\
table{border-collapse:collapse;margin:.6rem 0}td,th{padding:.2rem .8rem .2rem 0;text-align:left;vertical-align:top}\
th{font-weight:600;border-bottom:1px solid #999}img{max-width:100%}.bad{color:#b00020;font-weight:600}\
code{background:#f3f3f3;padding:0 .2rem}.small{color:#555;font-size:.9rem}";

/// The page.
///
/// # Errors
/// When pictures cannot be drawn (no temporary folder).
pub fn html(diagnosis: &Diagnosis, simulated: Option<&Simulated>) -> Result<String> {
    let report = &diagnosis.report;
    let pictures = Pictures::draw(diagnosis, simulated)?;
    let mut page = String::new();
    let _ = write!(
        page,
        "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Diagnosis of {name}</title><style>{STYLE}</style>\
         <h1>Why simulation and recording differ</h1><p class=\"small\">{name}</p><p class=\"lead\">{lead}</p>",
        name = escape(&report.recording),
        lead = escape(&lead(report)),
    );
    anything(&mut page, report);
    for (index, effect) in report.effects.iter().enumerate() {
        section(&mut page, index + 1, effect, pictures.curve(effect.id.as_str()));
    }
    for unexplained in &report.unexplained {
        without_name(&mut page, unexplained, pictures.curve(&unexplained.behaves_like));
    }
    if diagnosis.explanation.is_some() {
        fit(&mut page, report, &pictures);
        location(&mut page, report, &pictures);
    }
    audit(&mut page, report);
    limits(&mut page, report);
    page.push_str("</html>\n");
    Ok(page)
}

/// The sentence that comes first.
pub fn lead(report: &Report) -> String {
    let first = |statement: &str| statement.to_string();
    match report.verdict {
        Verdict::Undecided => format!("Nothing can be said about this recording: {}.", report.reason),
        Verdict::Damaged => format!("The recording is damaged: {}.", report.reason),
        Verdict::NoMismatch => {
            "Nothing was left out that this recording could show: body, static clutter and noise explain it.".into()
        }
        Verdict::Explained | Verdict::PartlyExplained => {
            let effect = &report.effects[0];
            let mut text = first(&effect.statement);
            if !effect.indistinguishable_from.is_empty() {
                let others: Vec<String> = effect.indistinguishable_from.iter().map(|id| title(id).to_lowercase()).collect();
                let _ = write!(text, " This recording cannot distinguish it from: {}.", others.join("; "));
            }
            if report.effects.len() > 1 {
                let _ = write!(text, " And {} more, below.", count(report.effects.len() - 1, "effect"));
            }
            if !report.unexplained.is_empty() {
                let remain = if report.unexplained.len() == 1 { "remains" } else { "remain" };
                let _ = write!(text, " Besides, {} without a name {remain}.", count(report.unexplained.len(), "mismatch"));
            }
            text
        }
        Verdict::Unexplained => {
            format!("Something is missing that the library has no name for: {}", first(&report.unexplained[0].statement))
        }
    }
}

/// How odd the recording is as a whole.
fn anything(page: &mut String, report: &Report) {
    let Some(p_value) = report.p_value else { return };
    let null = &report.null;
    let parts: Vec<String> = [
        ("beside body and room", null.beside),
        ("the body along the chirp", null.along_chirp),
        ("the body between receivers", null.between_receivers),
        ("the strongest suspicion, at most", null.suspicion),
    ]
    .into_iter()
    .filter_map(|(what, chance)| Some(format!("{what} {}", probability(chance?))))
    .collect();
    let _ = write!(
        page,
        "<p>Is anything missing at all? A recording with nothing missing looks as odd as this one with a chance of {} (p-value; {}).</p>",
        probability(p_value),
        parts.join("; ")
    );
    if let Some(calibrated) = &report.calibration {
        let _ = write!(
            page,
            "<p>That chance is calibrated: of {} recorded with nothing missing by a radar of this structure, {} looked at least as odd. \
             Without them it would be {}.</p>",
            count(calibrated.nulls, "recording"),
            calibrated.as_odd,
            probability(calibrated.p_value_raw)
        );
    }
}

fn count(number: usize, what: &str) -> String {
    let plural = if what.ends_with("ch") { "es" } else { "s" };
    if number == 1 { format!("one {what}") } else { format!("{number} {what}{plural}") }
}

/// Of an effect, or its id.
fn title(id: &str) -> &str {
    crate::effects::info(id).map_or(id, |info| info.title)
}

fn section(page: &mut String, number: usize, effect: &Effect, curve: Option<&str>) {
    let title = title(&effect.id);
    let _ = write!(
        page,
        "<h2>{number}. {title}</h2><p>{statement}</p>",
        title = escape(title),
        statement = escape(&effect.statement)
    );
    if let Some(info) = crate::effects::info(&effect.id) {
        let _ = write!(
            page,
            "<p>{} It enters the signal as <code>{}</code>.</p>",
            escape(info.explanation),
            escape(&effect.equation)
        );
    }
    page.push_str("<table><tr><th>parameter<th>value<th>90 % interval");
    for (name, parameter) in &effect.parameters {
        let _ = write!(page, "<tr><td>{}<td>{}<td>{}", escape(name), number_text(&parameter.value), number_text(&parameter.ci90));
    }
    page.push_str("</table>");
    let evidence = &effect.evidence;
    let _ = write!(
        page,
        "<p>How sure: chance of such a finding with nothing missing {}; the held-out data's log-likelihood grows by {:.0} \
         nats; mean squared dB error on held-out cells {:.2} → {:.2} dB².</p>",
        probability(evidence.p_value),
        evidence.held_out_loglik_gain,
        evidence.held_out_db_mse_before,
        evidence.held_out_db_mse_after
    );
    if effect.indistinguishable_from.is_empty() {
        page.push_str("<p>Nothing else in the library explains this recording as well.</p>");
    } else {
        let names: Vec<String> = effect.indistinguishable_from.iter().map(|id| format!("<code>{}</code>", escape(id))).collect();
        let separate = effect.separate_by.as_deref().unwrap_or("another recording");
        let _ = write!(
            page,
            "<p>This recording cannot distinguish it from {}. What would: {}.</p>",
            names.join(", "),
            escape(separate)
        );
    }
    let place = place_text(&effect.place);
    if !place.is_empty() {
        let _ = write!(page, "<p>Where: {}.</p>", escape(&place));
    }
    if let Some(curve) = curve {
        let _ = write!(page, "<p><img alt=\"fitted curve\" src=\"{curve}\">");
    }
}

fn without_name(page: &mut String, unexplained: &Unexplained, curve: Option<&str>) {
    let _ = write!(
        page,
        "<h2>Without a name: {}</h2><p>{}</p><p>Chance of such a finding with nothing missing {}; energy {:.1} dB against what \
         moves in the recording; the held-out data's log-likelihood grows by {:.0} nats with the fitted term.</p>",
        escape(&unexplained.behaves_like),
        escape(&unexplained.statement),
        probability(unexplained.p_value),
        unexplained.fraction_of_energy_db,
        unexplained.held_out_loglik_gain
    );
    let place = place_text(&unexplained.place);
    if !place.is_empty() {
        let _ = write!(page, "<p>Where: {}.</p>", escape(&place));
    }
    if let Some(curve) = curve {
        let _ = write!(page, "<p><img alt=\"fitted curve\" src=\"{curve}\">");
    }
}

fn fit(page: &mut String, report: &Report, pictures: &Pictures) {
    let _ = write!(
        page,
        "<h2>Held-out data, before and after</h2><p>{} are held out: static clutter, noise and the body's powers \
         come from the others, and a simulator is trained on those. They are not untouched: a finding stands only where it makes them \
         more probable, and what changes from chirp to chirp or from frame to frame is read in every one of them.</p>",
        held_out(report)
    );
    page.push_str("<table><tr><th><th>log-likelihood per sample<th>error, dB²<th>PSNR, dB");
    let rows = vec![("baseline", report.fit.before), ("with the effects", report.fit.after)];
    for (name, misfit) in rows {
        let _ =
            write!(page, "<tr><td>{name}<td>{:.4}<td>{:.2}<td>{:.2}", misfit.loglik_per_sample, misfit.db_mse, misfit.psnr_db);
    }
    page.push_str("</table>");
    if !report.effects.is_empty() && report.fit.after.loglik_per_sample <= report.fit.before.loglik_per_sample {
        page.push_str(
            "<p>These are windowed range-Doppler cells, amplitudes free, as the usual scores see them: what was found hardly shows \
             there. It shows in its own test on the same held-out data, given with each effect above.</p>",
        );
    }
    if let Some(simulator) = &report.simulator {
        page.push_str("<p>The trained simulator, with its own learned reflectivities:</p><table><tr><th><th>error, dB²<th>PSNR, dB<th>SSIM<th>person's cells, dB");
        for (name, scores) in [("as it was", simulator.before), ("with the effects", simulator.after)] {
            let person = scores.person_error_db.map_or("–".into(), |error| format!("{error:.2}"));
            let _ =
                write!(page, "<tr><td>{name}<td>{:.2}<td>{:.2}<td>{:.3}<td>{person}", scores.db_mse, scores.psnr_db, scores.ssim);
        }
        page.push_str("</table>");
    }
    for (title, picture) in &pictures.maps {
        let _ = write!(page, "<p>{}<br><img alt=\"{}\" src=\"{picture}\">", escape(title), escape(title));
    }
}

fn held_out(report: &Report) -> String {
    let indices = &report.held_out.indices;
    let list: Vec<String> = indices.iter().take(12).map(usize::to_string).collect();
    let more = if indices.len() > 12 { format!(" and {} more", indices.len() - 12) } else { String::new() };
    let mut axis = report.held_out.axis.clone();
    if let Some(first) = axis.get_mut(0..1) {
        first.make_ascii_uppercase();
    }
    format!("{axis} {}{more}", list.join(", "))
}

/// Where the untouched recording differs.
fn location(page: &mut String, report: &Report, pictures: &Pictures) {
    page.push_str("<h2>Where the recording holds more than expected</h2>");
    if report.located.regions.is_empty() {
        page.push_str("<p>No place in range, velocity and time stands out (false-discovery rate 5 %).</p>");
    } else {
        page.push_str("<table><tr><th>where<th>excess<th>chance");
        for region in report.located.regions.iter().take(10) {
            let _ = write!(
                page,
                "<tr><td>{}<td>{:.1} dB<td>{}",
                escape(&place_text(&region.place)),
                region.excess_db,
                probability(region.p_value)
            );
        }
        page.push_str("</table>");
    }
    for (title, shares) in [("Parts of the body", &report.located.body_parts), ("Walls", &report.located.walls)] {
        let standing_out: Vec<_> = shares.iter().filter(|share| share.p_value < 0.01 && share.excess_db > 0.0).collect();
        if !standing_out.is_empty() {
            let _ = write!(page, "<p>{title} at whose cells there is more than expected:</p><table>");
            for share in standing_out {
                let name = escape(&share.name.replace('_', " "));
                let _ = write!(page, "<tr><td>{name}<td>{:.1} dB<td>{}", share.excess_db, probability(share.p_value));
            }
            page.push_str("</table>");
        }
    }
    if !pictures.profiles.is_empty() {
        page.push_str(
            "<p class=\"small\">Significance is of each value alone: of a hundred values of a recording with nothing missing, one \
             reaches 2.</p>",
        );
    }
    for (title, picture) in &pictures.profiles {
        let _ = write!(page, "<p><img alt=\"{}\" src=\"{picture}\">", escape(title));
    }
}

fn audit(page: &mut String, report: &Report) {
    page.push_str("<h2>Conventions and numerics</h2><table><tr><th>check<th>expected<th>found");
    for check in &report.audit {
        let class = if check.ok { "" } else { " class=\"bad\"" };
        let _ = write!(
            page,
            "<tr><td>{}<td>{}<td{class}>{}",
            escape(&check.check.replace('_', " ")),
            escape(&check.expected),
            escape(&check.found)
        );
    }
    page.push_str("</table>");
}

fn limits(page: &mut String, report: &Report) {
    page.push_str("<h2>What this recording cannot show</h2><ul>");
    for note in &report.notes {
        let _ = write!(page, "<li>{}", escape(note));
    }
    for limit in &report.not_detectable {
        let bound = limit.at_most_db.map_or(String::new(), |db| format!("at most {db:.0} dB; "));
        let _ = write!(page, "<li><code>{}</code>: {bound}{}", escape(&limit.id), escape(&limit.reason));
    }
    let _ = write!(page, "</ul><p class=\"small\">Settings: <code>{}</code></p>", escape(&report.settings));
}

fn place_text(place: &Place) -> String {
    let mut parts = vec![];
    let span =
        |name: &str, unit: &str, span: &Option<[f64; 2]>| span.map(|[low, high]| format!("{name} {low:.2} to {high:.2} {unit}"));
    parts.extend(span("range", "m", &place.range_m));
    parts.extend(span("velocity", "m/s", &place.velocity_mps));
    parts.extend(span("azimuth", "°", &place.azimuth_deg));
    parts.extend(place.position_m.map(|[x, y, z]| format!("at x {x:.2}, y {y:.2}, z {z:.2} m")));
    parts.extend(place.boundary.as_ref().map(|boundary| format!("by way of the {boundary} boundary")));
    parts.extend(place.body_part.as_ref().map(|part| format!("on the {}", part.replace('_', " "))));
    for (name, list) in
        [("frames", &place.frames), ("chirps", &place.chirps), ("samples", &place.samples), ("tx", &place.tx), ("rx", &place.rx)]
    {
        if let Some(list) = list {
            let shown: Vec<String> = list.iter().take(10).map(usize::to_string).collect();
            let more = if list.len() > 10 { ", …" } else { "" };
            parts.push(format!("{name} {}{more}", shown.join(", ")));
        }
    }
    parts.join("; ")
}

fn probability(p: f64) -> String {
    if p < 1e-3 { format!("below 10<sup>{:.0}</sup>", p.max(1e-300).log10().ceil()) } else { format!("{p:.3}") }
}

fn number_text(value: &serde_json::Value) -> String {
    match value {
        serde_json::Value::Number(number) => short(number.as_f64().unwrap_or(0.0)),
        serde_json::Value::Array(list) => format!("[{}]", list.iter().map(number_text).collect::<Vec<_>>().join(", ")),
        serde_json::Value::String(text) => escape(text),
        _ => "–".into(),
    }
}

/// Four digits, without a tail of zeros.
fn short(value: f64) -> String {
    let size = value.abs();
    if size >= 1e5 || (size > 0.0 && size < 1e-3) { format!("{value:.3e}") } else { format!("{:.*}", digits(size), value) }
}

fn digits(size: f64) -> usize {
    if size >= 100.0 {
        1
    } else if size >= 1.0 {
        3
    } else {
        4
    }
}

fn escape(text: &str) -> String {
    shown(text).replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// PNGs as data addresses.
struct Pictures {
    maps: Vec<(String, String)>,
    curves: Vec<(String, String)>,
    profiles: Vec<(String, String)>,
}

impl Pictures {
    fn draw(diagnosis: &Diagnosis, simulated: Option<&Simulated>) -> Result<Self> {
        let folder = Scratch::new()?;
        let mut pictures = Self { maps: vec![], curves: vec![], profiles: vec![] };
        let Some(explanation) = &diagnosis.explanation else { return Ok(pictures) };
        let path = folder.path().join("picture.png");
        for (title, evidence) in [
            ("Before: the recording against the baseline", &diagnosis.original),
            (
                "After: what of the recording is left with the effects taken out (what they hid is dark), against the baseline",
                &explanation.evidence,
            ),
        ] {
            if explanation.accepted.is_empty() && !std::ptr::eq(evidence, &diagnosis.original) {
                continue;
            }
            let [measured, expected] = held_out_maps(evidence, &diagnosis.radar);
            let window = DbWindow { low_db: -5.0, high_db: measured.max().max(20.0) };
            comparison(&path, "", &measured, &expected, window)?;
            pictures.maps.push((title.into(), address(&path)?));
        }
        if let Some(Simulated { maps: [measured, before, after], .. }) = simulated {
            let window = DbWindow::below(measured.max(), 60.0);
            for (title, map) in [("The trained simulator", before), ("The trained simulator with the effects", after)] {
                comparison(&path, "", measured, map, window)?;
                pictures.maps.push((title.into(), address(&path)?));
            }
        }
        for accepted in &explanation.accepted {
            if let Some(curve) = &accepted.candidate.curve {
                chart(curve).save(&path)?;
                let name = accepted.candidate.id.unwrap_or(accepted.candidate.behaves_like);
                pictures.curves.push((name.into(), address(&path)?));
            }
        }
        let (before, after) = (locate::profiles(&diagnosis.original), locate::profiles(&explanation.evidence));
        for (before, after) in before.iter().zip(&after).filter(|(before, _)| before.at.len() > 1) {
            let compared = (!explanation.accepted.is_empty()).then_some(after);
            for chart in along(before, compared) {
                chart.save(&path)?;
                pictures.profiles.push((chart.title, address(&path)?));
            }
        }
        Ok(pictures)
    }

    fn curve(&self, name: &str) -> Option<&str> {
        self.curves.iter().find(|(known, _)| known == name).map(|(_, picture)| picture.as_str())
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
        Chart { title, x_label: x_label.clone(), y_label: y_label.into(), series: lines }
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
    Chart { title: curve.title.clone(), x_label: curve.x_label.clone(), y_label: curve.y_label.clone(), series: series.collect() }
}

fn address(path: &Path) -> Result<String> {
    let bytes = files::read(path)?;
    Ok(format!("data:image/png;base64,{}", BASE64_STANDARD.encode(bytes)))
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
        let still = transform(&support.project(&evidence.still()[channel * samples..][..samples]).repeat(loops), samples);
        for &frame in &evidence.split.held_out {
            let seen = transform(evidence.cube.channel(frame, channel), samples);
            let moving = evidence.expected(frame);
            for cell in 0..loops * samples {
                measured[cell] += seen[cell].norm_sqr() / variance;
                expected[cell] += still[cell].norm_sqr() / variance + f64::from(moving[cell]) / count;
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
