//! `report.html`: the same as `report.json` for people; one file, nothing to load.

mod pictures;
mod quantity;

use super::finding::Place;
use super::journey::Diagnosis;
use super::report::{Effect, NOTHING, Report, Unexplained, Verdict};
use super::simulate::Simulated;
use crate::error::Result;
use crate::pictures::page::{Markup, html, page, shown, table};
use pictures::Pictures;

/// The page.
///
/// # Errors
/// When pictures cannot be drawn (no temporary folder).
pub fn html(diagnosis: &Diagnosis, simulated: Option<&Simulated>) -> Result<String> {
    let report = &diagnosis.report;
    let pictures = Pictures::draw(diagnosis, simulated)?;
    let content = html! {
        h1 { "Why simulation and recording differ" }
        p.small { (shown(&report.recording)) }
        p.lead { (shown(&lead(report))) }
        (anything(report))
        @for (index, effect) in report.effects.iter().enumerate() {
            (section(index + 1, effect, pictures.curve(effect.id.as_str())))
        }
        @for unexplained in &report.unexplained {
            (without_name(unexplained, pictures.curve(&unexplained.behaves_like)))
        }
        @if diagnosis.explanation.is_some() {
            (fit(report, &pictures))
            (location(report, &pictures))
        }
        (audit(report))
        (limits(report))
    };
    Ok(page(&format!("Diagnosis of {}", report.recording), &content))
}

/// The sentence that comes first.
pub fn lead(report: &Report) -> String {
    match report.verdict {
        Verdict::Undecided => format!("Nothing can be said about this recording: {}.", report.reason),
        Verdict::Damaged => format!("The recording is damaged: {}.", report.reason),
        Verdict::NoMismatch if report.reason != NOTHING => format!("Nothing was located, and yet {}.", report.reason),
        Verdict::NoMismatch => {
            "Nothing was left out that this recording could show: body, static clutter and noise explain it.".into()
        }
        Verdict::Explained | Verdict::PartlyExplained => {
            let effect = &report.effects[0];
            let mut text = effect.statement.clone();
            if !effect.indistinguishable_from.is_empty() {
                let others: Vec<String> = effect.indistinguishable_from.iter().map(|id| title(id).to_lowercase()).collect();
                text += &format!(" This recording cannot distinguish it from: {}.", others.join("; "));
            }
            if report.effects.len() > 1 {
                text += &format!(" And {} more, below.", count(report.effects.len() - 1, "effect"));
            }
            if !report.unexplained.is_empty() {
                let remain = if report.unexplained.len() == 1 { "remains" } else { "remain" };
                text += &format!(" Besides, {} without a name {remain}.", count(report.unexplained.len(), "mismatch"));
            }
            text
        }
        Verdict::Unexplained => {
            format!("Something is missing that the library has no name for: {}", report.unexplained[0].statement)
        }
    }
}

/// How odd the recording is as a whole.
fn anything(report: &Report) -> Markup {
    let Some(p_value) = report.p_value else { return html! {} };
    let null = &report.null;
    let parts: Vec<(&str, f64)> = [
        ("beside body and room", null.beside),
        ("the body along the chirp", null.along_chirp),
        ("the body between receivers", null.between_receivers),
        ("the most significant detector, at most", null.bound),
    ]
    .into_iter()
    .filter_map(|(what, chance)| Some((what, chance?)))
    .collect();
    html! {
        p {
            "Is anything missing at all? Where nothing is, a statistic at least as extreme has a probability of "
            (probability(p_value)) " (p-value"
            @for (what, chance) in &parts {
                "; "
                (what) " " (probability(*chance))
            }
            ")."
        }
        @if let Some(calibrated) = &report.calibration {
            p {
                "That probability is calibrated: of " (count(calibrated.nulls, "recording"))
                " recorded with nothing missing by a radar of this structure, " (calibrated.as_odd)
                " were at least as extreme. Without them it would be " (probability(calibrated.p_value_raw)) "."
            }
        }
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

fn section(number: usize, effect: &Effect, curve: Option<&Markup>) -> Markup {
    let evidence = &effect.evidence;
    let parameters: Vec<Vec<Markup>> = effect
        .parameters
        .iter()
        .map(|(name, found)| quantity::row(&effect.id, name, &found.value, &found.ci90).map(|text| html! { (text) }).to_vec())
        .collect();
    let names: Vec<Markup> = effect.indistinguishable_from.iter().map(|id| html! { code { (shown(id)) } }).collect();
    html! {
        h2 { (number) ". " (shown(title(&effect.id))) }
        p { (shown(&effect.statement)) }
        @if let Some(info) = crate::effects::info(&effect.id) {
            p { (info.explanation) " It enters the signal as " code { (shown(&effect.equation)) } "." }
        }
        (table(&["parameter", "value", "90 % interval"], &parameters))
        p {
            "How sure: " (percent(effect.probability)) " that it is this and none of what it is weighed against; chance of \
             such a finding with nothing missing " (probability(evidence.p_value)) "; the held-out data's log-likelihood grows by "
            (format!("{:.0}", evidence.held_out_loglik_gain)) " nats"
            @let [before, after] = [evidence.held_out_db_mse_before, evidence.held_out_db_mse_after].map(|db2| format!("{db2:.2}"));
            // The mean over all cells does not see what changes few.
            @if before != after { "; mean squared dB error of all held-out cells " (before) " → " (after) " dB²" }
            "."
        }
        @if names.is_empty() {
            p { "Nothing else in the library explains this recording as well." }
        } @else {
            p {
                "This recording cannot distinguish it from "
                @for (index, name) in names.iter().enumerate() { @if index > 0 { ", " } (name) }
                ". What would: " (shown(effect.separate_by.as_deref().unwrap_or("another recording"))) "."
            }
        }
        (where_and_how(&effect.place, curve))
    }
}

fn without_name(unexplained: &Unexplained, curve: Option<&Markup>) -> Markup {
    html! {
        h2 { "Without a name: " (shown(&unexplained.behaves_like)) }
        p { (shown(&unexplained.statement)) }
        p {
            "Chance of such a finding with nothing missing " (probability(unexplained.p_value))
            "; energy " (format!("{:.1}", unexplained.fraction_of_energy_db))
            " dB against what moves in the recording; the held-out data's log-likelihood grows by "
            (format!("{:.0}", unexplained.held_out_loglik_gain)) " nats with the fitted term."
        }
        (where_and_how(&unexplained.place, curve))
    }
}

fn where_and_how(place: &Place, curve: Option<&Markup>) -> Markup {
    let place = place_text(place);
    html! {
        @if !place.is_empty() { p { "Where: " (shown(&place)) "." } }
        @if let Some(curve) = curve { p { (curve) } }
    }
}

fn fit(report: &Report, pictures: &Pictures) -> Markup {
    let [before, after] = [report.fit.before, report.fit.after];
    let nothing_found = report.effects.is_empty() && report.unexplained.is_empty();
    let shown_fits = if nothing_found { 1 } else { 2 };
    let rows = [("baseline", before), ("with what was found", after)].into_iter().take(shown_fits).map(|(name, misfit)| {
        let numbers =
            [format!("{:.4}", misfit.loglik_per_sample), format!("{:.2}", misfit.db_mse), format!("{:.2}", misfit.psnr_db)];
        std::iter::once(html! { (name) }).chain(numbers.map(|text| html! { (text) })).collect()
    });
    let rows: Vec<Vec<Markup>> = rows.collect();
    html! {
        h2 { @if nothing_found { "Held-out data" } @else { "Held-out data, before and after" } }
        p {
            (shown(&held_out(report))) ": static clutter, noise and the body's powers come from the others, and a \
             simulator is trained on those. Held-out data are not untouched: a finding stands only where it makes them more probable, and what \
             changes from chirp to chirp or from frame to frame is read in all frames."
        }
        (table(&["", "log-likelihood per sample", "error, dB²", "PSNR, dB"], &rows))
        @if !nothing_found && after.loglik_per_sample <= before.loglik_per_sample {
            p {
                "These are windowed range-Doppler cells, amplitudes free, as the usual scores see them: what was found hardly shows \
                 there. It shows in its own test on the same held-out data, given with each effect above."
            }
        }
        @if let Some(simulator) = &report.simulator {
            p { "The trained simulator, with its own learned reflectivities:" }
            (table(
                &["", "error, dB²", "PSNR, dB", "SSIM", "person's cells, dB"],
                &[("as it was", simulator.before), ("with the effects", simulator.after)].map(|(name, scores)| {
                    let person = scores.person_error_db.map_or("–".into(), |error| format!("{error:.2}"));
                    let numbers =
                        [format!("{:.2}", scores.db_mse), format!("{:.2}", scores.psnr_db), format!("{:.3}", scores.ssim), person];
                    std::iter::once(html! { (name) }).chain(numbers.map(|text| html! { (text) })).collect()
                }),
            ))
        }
        @for (title, picture) in &pictures.maps { p { (title) br; (picture) } }
    }
}

/// "Frames 2, 5 are held out", "Loop 3 is held out".
fn held_out(report: &Report) -> String {
    let indices = &report.held_out.indices;
    let list: Vec<String> = indices.iter().take(12).map(usize::to_string).collect();
    let more = if indices.len() > 12 { format!(" and {} more", indices.len() - 12) } else { String::new() };
    let one = indices.len() == 1;
    let mut axis = if one { report.held_out.axis.trim_end_matches('s').to_string() } else { report.held_out.axis.clone() };
    if let Some(first) = axis.get_mut(0..1) {
        first.make_ascii_uppercase();
    }
    format!("{axis} {}{more} {} held out", list.join(", "), if one { "is" } else { "are" })
}

/// Where the untouched recording differs.
fn location(report: &Report, pictures: &Pictures) -> Markup {
    let located = &report.located;
    let regions: Vec<Vec<Markup>> = located
        .regions
        .iter()
        .take(10)
        .map(|region| {
            vec![
                html! { (shown(&place_text(&region.place))) },
                html! { (format!("{:.1} dB", region.excess_db)) },
                probability(region.p_value),
            ]
        })
        .collect();
    html! {
        h2 { "Where the recording holds more than expected" }
        @if regions.is_empty() {
            p { "No place in range, velocity and time stands out (false-discovery rate 5 %)." }
        } @else {
            (table(&["where", "excess", "chance"], &regions))
        }
        @for (title, shares) in [("Parts of the body", &located.body_parts), ("Walls", &located.walls)] {
            @let standing_out: Vec<Vec<Markup>> = shares
                .iter()
                .filter(|share| share.p_value < 0.01 && share.excess_db > 0.0)
                .map(|share| {
                    let name = shown(&share.name.replace('_', " "));
                    vec![html! { (name) }, html! { (format!("{:.1} dB", share.excess_db)) }, probability(share.p_value)]
                })
                .collect();
            @if !standing_out.is_empty() {
                p { (title) " at whose cells there is more than expected (whatever else is at those cells counts, too):" }
                (table(&["where", "excess", "chance"], &standing_out))
            }
        }
        @if !pictures.profiles.is_empty() {
            // Where nothing is missing they show nothing: they are there for whoever asks.
            details open[report.verdict != Verdict::NoMismatch] {
                summary { "Excess and significance along time, frequency and channels" }
                p.small {
                    "Significance is that of each value by itself: where nothing is missing, one value of a hundred exceeds 2 by chance."
                }
                @for picture in &pictures.profiles { p { (picture) } }
            }
        }
    }
}

fn audit(report: &Report) -> Markup {
    let rows: Vec<Vec<Markup>> = report
        .audit
        .iter()
        .map(|check| {
            let found = shown(&check.found);
            vec![
                html! { (shown(&check.check.replace('_', " "))) },
                html! { (shown(&check.expected)) },
                html! { @if check.ok { (found) } @else { span.bad { (found) } } },
            ]
        })
        .collect();
    html! { h2 { "Conventions and numerics" } (table(&["check", "expected", "found"], &rows)) }
}

fn limits(report: &Report) -> Markup {
    html! {
        h2 { "What this recording cannot show" }
        ul {
            @for note in &report.notes { li { (shown(note)) } }
            @for limit in &report.not_detectable {
                li {
                    code { (shown(&limit.id)) } ": "
                    @if let Some(db) = limit.at_most_db { (format!("at most {db:.0} dB; ")) }
                    (shown(&limit.reason))
                }
            }
        }
        p.small { "Settings: " code { (shown(&report.settings)) } }
    }
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

fn percent(probability: f64) -> String {
    if probability > 0.995 { "over 99 %".into() } else { format!("{:.0} %", 100.0 * probability) }
}

fn probability(p: f64) -> Markup {
    if p < 1e-3 {
        let exponent = format!("{:.0}", p.max(1e-300).log10().ceil());
        html! { "below 10" sup { (exponent) } }
    } else {
        html! { (format!("{p:.3}")) }
    }
}
