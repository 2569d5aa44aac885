//! The report as one page of HTML: no network, no script; everything it shows is in it.

use std::fmt::Write as _;

use super::definitions::definitions;
use super::panels::Panel;
use crate::modes::audit::{AuditReport, Bar, KindFigures, OrganFigures};
use crate::modes::figures::Figures;
use crate::modes::project::Interpolation;
use crate::output::page::plot::{Form, Plot, Series, decade_name};
use crate::output::page::{BLACK, BLUE, GREY, ORANGE, document, escape, grouped, short};

/// The whole page; `panels` are pictures of the worst ray's view.
pub fn page(report: &AuditReport, panels: &[Panel]) -> String {
    let sections = [
        ("", what(report)),
        ("", tiles(report)),
        ("Kinds of error", kinds(report)),
        ("Errors by size", histogram(&report.whole.histogram)),
        ("Errors by view", by_section(report)),
        ("Errors by distance from the outline", by_distance(report)),
        ("The worst ray's view", pictures(report, panels)),
        ("Organs", organs(report)),
        ("The worst rays", worst(report)),
        ("How to read it", definitions(report)),
    ];
    document(&format!("Length errors: {}", report.scene), &sections)
}

/// What was compared with what.
fn what(report: &AuditReport) -> String {
    let seed = report.rays.seed.map(|seed| format!(", seed {seed}")).unwrap_or_default();
    let trees = report.trees.map_or(String::new(), |trees| match trees.interpolation {
        Interpolation::Quadrilinear { parameters } => format!(
            " (quadrilinear, distance threshold {}, depth {} at most)",
            parameters.distance_threshold, parameters.max_depth
        ),
        Interpolation::SquaredChord { tolerance_mm } => {
            format!(" (squared chords, tolerance {tolerance_mm} mm)")
        }
    });
    format!(
        "<p class=\"lead\"><b>{}</b>{trees} against <b>{}</b>, along {}{seed}: {} rays. Lengths are in mm; \
         changes of transmission ΔT, at {} keV, are shares of the unattenuated beam.</p>\
         <p class=\"command\"><code>{}</code><br>{} {}</p>",
        report.method,
        escape(&report.against),
        escape(&report.rays.set),
        grouped(report.rays.count),
        short(report.energy_kev),
        escape(&report.command),
        report.program,
        report.version,
    )
}

/// The first things to know.
fn tiles(report: &AuditReport) -> String {
    let whole = &report.whole;
    let f = &whole.method.length_mm;
    let interpolated = whole.interpolated_interior_mm.compared + whole.interpolated_silhouette_mm.compared;
    let tile = |value: String, words: String| format!("<div><b>{value}</b>{words}</div>");
    let mut all = vec![
        tile(
            format!("{} mm", short(f.mean)),
            format!("mean error; the mean length is {} mm", short(f.mean_reference)),
        ),
        tile(format!("{} mm", short(f.p99)), "99 % of errors are no larger".into()),
        tile(format!("{} mm", short(f.max)), "the largest error".into()),
        tile(
            format!("{} %", short(100.0 * f.beyond_tolerance)),
            format!("beyond {} mm", report.tolerance_mm),
        ),
        tile(short(report.transmission.max), "the largest ΔT of a ray".into()),
        tile(
            format!("{} %", short(100.0 * interpolated as f64 / f.compared.max(1) as f64)),
            format!("of {} lengths interpolated", grouped(f.compared)),
        ),
    ];
    if let Some(bounds) = f.confidence {
        let [low, high] = bounds.mean.map(short);
        all.push(tile(format!("{low} – {high} mm"), "the mean of all lines, with 95 %".into()));
        let [low, high] = bounds.beyond_tolerance.map(|share| short(100.0 * share));
        all.push(tile(
            format!("{low} – {high} %"),
            format!("of all lines are beyond {} mm, with 95 %", report.tolerance_mm),
        ));
    }
    if let Some(reference) = report.reference {
        let words = format!(
            "the reference's own largest error on {} lengths recomputed in rationals: {} units in the last place of \
             the distance, {} on average",
            reference.lengths,
            short(reference.max_ulps_of_distance),
            short(reference.mean_ulps_of_distance),
        );
        all.push(tile(format!("{} mm", short(reference.max_mm)), words));
    }
    format!("<div class=\"tiles\">{}</div>", all.concat())
}

const HEAD: &str = "<th>compared</th><th>mean length</th><th>bias</th><th>mean</th><th>RMS</th><th>p50</th>\
                    <th>p95</th><th>p99</th><th>p99.9</th><th>max</th><th>beyond</th>";

/// The cells of [`HEAD`].
fn cells(f: &Figures) -> String {
    let mut cells = format!("<td>{}</td>", grouped(f.compared));
    for value in [f.mean_reference, f.bias, f.mean, f.rms, f.p50, f.p95, f.p99, f.p999, f.max] {
        let _ = write!(cells, "<td>{}</td>", short(value));
    }
    let _ = write!(cells, "<td>{} %</td>", short(100.0 * f.beyond_tolerance));
    cells
}

fn kinds(report: &AuditReport) -> String {
    let whole = &report.whole;
    let row = |name: &str, class: &str, f: &Figures| match f.compared {
        0 => String::new(),
        _ => format!("<tr class=\"{class}\"><th>{name}</th>{}</tr>", cells(f)),
    };
    let kind = |name: &str, kind: &Option<KindFigures>| {
        kind.as_ref().map_or(String::new(), |kind| row(name, "", &kind.length_mm))
    };
    let change = |name: &str, kind: &KindFigures| row(name, "", &kind.transmission);
    let lengths = [
        row("method against reference", "strong", &whole.method.length_mm),
        row("interpolated, interior", "part", &whole.interpolated_interior_mm),
        row("interpolated, silhouette", "part", &whole.interpolated_silhouette_mm),
        row("traced, interior", "part", &whole.traced_interior_mm),
        row("traced, silhouette", "part", &whole.traced_silhouette_mm),
        kind("accumulation: an image's sums", &whole.accumulation),
        kind("mesh against closed form", &whole.mesh),
    ];
    let changes = [
        row("whole ray, all organs", "strong", &report.transmission),
        change("method, each organ", &whole.method),
        whole.accumulation.as_ref().map_or(String::new(), |kind| change("accumulation, each organ", kind)),
        whole.mesh.as_ref().map_or(String::new(), |kind| change("mesh, each organ", kind)),
    ];
    format!(
        "<div class=\"wide\"><table><thead><tr><th>lengths, mm</th>{HEAD}</tr></thead><tbody>{}</tbody>\
         <thead><tr><th>transmission, ΔT</th>{}</tr></thead><tbody>{}</tbody></table></div>\
         <p class=\"note\">Beyond: larger than {} mm, or {} in transmission.</p>",
        lengths.concat(),
        HEAD.replace("mean length", "mean T"),
        changes.concat(),
        report.tolerance_mm,
        report.transmission_tolerance,
    )
}

/// Counts of errors over their size, both on a logarithmic scale.
fn histogram(bars: &[Bar]) -> String {
    let zero = bars.first().copied().filter(|bar| bar.to_mm == 0.0);
    let shown: Vec<&Bar> = bars.iter().filter(|bar| bar.to_mm > 0.0).collect();
    let place = |bar: &&Bar| {
        let halves = (2.0 * bar.from_mm.log10()).round() as i32;
        if halves % 2 == 0 { decade_name(halves / 2) } else { String::new() }
    };
    // Names stand at every decade, which is every second bar; padded so that thinning keeps them.
    let first_is_decade = shown.first().is_some_and(|bar| !place(bar).is_empty());
    let shown = if first_is_decade || shown.is_empty() { shown } else { shown[1..].to_vec() };
    let series = |name, colour, count: &dyn Fn(&Bar) -> u64| Series {
        name,
        colour,
        values: shown.iter().map(|bar| count(bar) as f64).collect(),
    };
    let plot = Plot {
        across: "error from, mm (bars of half a decade)",
        up: "lengths",
        places: shown.iter().map(place).collect(),
        series: vec![
            series("interpolated", ORANGE, &|bar| bar.interpolated),
            series("traced", BLUE, &|bar| bar.traced),
        ],
        form: Form::Bars,
    };
    let svg = plot.svg();
    let zeros = zero.map_or(String::new(), |bar| {
        format!(
            "<p class=\"note\">Without any error: {} interpolated, {} traced.</p>",
            grouped(bar.interpolated),
            grouped(bar.traced)
        )
    });
    if svg.is_empty() { zeros } else { format!("<figure>{svg}</figure>{zeros}") }
}

fn curves<'a>(figures: impl Iterator<Item = &'a Figures> + Clone) -> Vec<Series> {
    let series = |name, colour, value: &dyn Fn(&Figures) -> f64| Series {
        name,
        colour,
        values: figures.clone().map(value).collect(),
    };
    vec![
        series("max", BLACK, &|f| f.max),
        series("p99", ORANGE, &|f| f.p99),
        series("mean", BLUE, &|f| f.mean),
        series("median", GREY, &|f| f.p50),
    ]
}

/// Errors against the gantry's angle, or by aim.
fn by_section(report: &AuditReport) -> String {
    let sections = &report.sections;
    if sections.len() < 2 {
        return String::new();
    }
    let angles: Option<Vec<String>> =
        sections.iter().map(|s| s.gantry_deg.map(|deg| format!("{deg:.4}"))).collect();
    let angles = angles.map(|a| {
        a.iter().map(|text| text.trim_end_matches('0').trim_end_matches('.').to_owned()).collect::<Vec<_>>()
    });
    let (across, places) = match angles {
        Some(angles) => ("gantry angle, degrees", angles),
        None => ("", sections.iter().map(|_| String::new()).collect()),
    };
    let series = curves(sections.iter().map(|s| &s.length_mm));
    let plot = Plot { across, up: "error, mm", places, series, form: Form::Lines };
    let figure = if across.is_empty() { String::new() } else { format!("<figure>{}</figure>", plot.svg()) };
    let rows: String = sections
        .iter()
        .map(|s| format!("<tr><th>{}</th>{}</tr>", escape(&s.label), cells(&s.length_mm)))
        .collect();
    let table = format!(
        "<div class=\"wide\"><table><thead><tr><th>mm</th>{HEAD}</tr></thead><tbody>{rows}</tbody></table></div>"
    );
    if figure.is_empty() {
        table
    } else {
        format!("{figure}<details><summary>As numbers</summary>{table}</details>")
    }
}

fn by_distance(report: &AuditReport) -> String {
    let seen = || report.by_distance.iter().filter(|d| d.length_mm.compared > 0);
    let name = |from: Option<f64>, to: Option<f64>| match (from, to) {
        (None, _) => "outside".into(),
        (Some(from), Some(to)) => format!("{from}–{to}"),
        (Some(from), None) => format!("over {from}"),
    };
    let plot = Plot {
        across: "distance of the ray from the organ's outline, mm where the organ is",
        up: "error, mm",
        places: seen().map(|d| name(d.from_mm, d.to_mm)).collect(),
        series: curves(seen().map(|d| &d.length_mm)),
        form: Form::Lines,
    };
    let svg = plot.svg();
    if svg.is_empty() { svg } else { format!("<figure>{svg}</figure>") }
}

fn pictures(report: &AuditReport, panels: &[Panel]) -> String {
    if panels.is_empty() {
        return String::new();
    }
    let place = report.worst.first().map(|worst| escape(&worst.place)).unwrap_or_default();
    let figures: String = panels
        .iter()
        .map(|panel| {
            format!(
                "<figure><img alt=\"{0}\" src=\"{1}\"><figcaption><b>{0}</b> {2}</figcaption></figure>",
                panel.title,
                panel.data,
                escape(&panel.note)
            )
        })
        .collect();
    format!(
        "<p>View {place}: p = Σ μL at {} keV.</p><div class=\"panels\">{figures}</div>",
        short(report.energy_kev)
    )
}

fn organs(report: &AuditReport) -> String {
    let row = |organ: &OrganFigures| {
        let mesh = match (&organ.mesh, organ.no_closed_form) {
            (Some(mesh), _) => {
                let f = &mesh.length_mm;
                format!("<td>{}</td><td>{}</td>", short(f.mean), short(f.max))
            }
            (None, why) => {
                let why = why.unwrap_or("no ray meets it");
                format!("<td class=\"none\" colspan=\"2\" title=\"{0}\">{0}</td>", escape(why))
            }
        };
        let compared = organ.method.length_mm.compared.max(1);
        let interpolated =
            organ.interpolated_interior_mm.compared + organ.interpolated_silhouette_mm.compared;
        format!(
            "<tr><th>{}</th><td>{}</td><td>{} %</td>{}<td>{}</td>{mesh}</tr>",
            escape(&organ.organ),
            organ.reference.unwrap_or(""),
            short(100.0 * interpolated as f64 / compared as f64),
            cells(&organ.method.length_mm),
            short(organ.method.transmission.max),
        )
    };
    let rows: String = report.organs.iter().map(row).collect();
    format!(
        "<div class=\"wide\"><table><thead><tr><th>mm</th><th>judged by</th><th>interpolated</th>{HEAD}\
         <th>max ΔT</th><th>mesh, mean</th><th>mesh, max</th></tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

fn worst(report: &AuditReport) -> String {
    let row = |w: &crate::modes::audit::WorstRay| {
        let pixel = w.pixel.map(|[_, column, row]| format!(" ({column}, {row})")).unwrap_or_default();
        format!(
            "<tr><td>{}</td><th>{}</th><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}{pixel}</td>\
             <td class=\"command\"><code>{}</code></td></tr>",
            w.rank,
            escape(&w.organ),
            short(w.error_mm),
            w.method_mm,
            w.reference_mm,
            w.rounding_mm.map(short).unwrap_or_default(),
            w.found,
            w.cell_depth.map(|d| d.to_string()).unwrap_or_default(),
            escape(&w.place),
            escape(&w.reproduce),
        )
    };
    if report.worst.is_empty() {
        return "<p>No ray shows any error.</p>".into();
    }
    let table = |rows: String| {
        format!(
            "<div class=\"wide\"><table><thead><tr><th></th><th>organ</th><th>error, mm</th><th>method, mm</th>\
             <th>reference, mm</th><th>rounding, mm</th><th>found</th><th>depth</th><th>view (column, row)</th><th>to see it again</th>\
             </tr></thead><tbody>{rows}</tbody></table></div>"
        )
    };
    let (first, rest) = report.worst.split_at(report.worst.len().min(10));
    let more = match rest.len() {
        0 => String::new(),
        n => {
            format!("<details><summary>{n} more</summary>{}</details>", table(rest.iter().map(row).collect()))
        }
    };
    table(first.iter().map(row).collect()) + &more
}
