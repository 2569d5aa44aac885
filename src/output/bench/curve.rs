//! Error against time.

use std::fmt::Write as _;

use super::{COLD_AND_WARM, Named, TIMES, machine, seconds, times};
use crate::modes::bench::curve::{CurveReport, CurveRow};
use crate::modes::bench::{EXACT_BELOW_MM, Times};
use crate::output::page::curves::{Axis, COLOURS, Curve, Curves, Point, Spacing};
use crate::output::page::{document, escape, grouped, short};

pub fn files(report: &CurveReport) -> Vec<Named> {
    let mut files = vec![("curve.html".into(), page(report)), ("curve.csv".into(), csv(report))];
    for (name, time) in [("curve-cold.svg", cold as Time), ("curve-warm.svg", warm)] {
        let svg = plot(report, largest(report), time, name.contains("cold")).file();
        if !svg.is_empty() {
            files.push((name.into(), svg));
        }
    }
    files
}

type Time = fn(&CurveRow) -> &Times;

fn cold(row: &CurveRow) -> &Times {
    &row.cold
}

fn warm(row: &CurveRow) -> &Times {
    &row.warm
}

fn largest(report: &CurveReport) -> [u32; 2] {
    report.rows.last().map_or([0; 2], |row| row.pixels)
}

fn sizes(report: &CurveReport) -> Vec<[u32; 2]> {
    let mut sizes: Vec<[u32; 2]> = report.rows.iter().map(|row| row.pixels).collect();
    sizes.dedup();
    sizes
}

/// Mean error over time, a curve for each method and kind of setting; exact methods lie on the line of what counts as none.
fn plot(report: &CurveReport, pixels: [u32; 2], time: Time, is_cold: bool) -> Curves<'static> {
    let kind = |row: &CurveRow| match row.setting {
        Some(dial) => format!("{} --{}", row.method, dial.option),
        None => row.method.to_owned(),
    };
    let mut kinds: Vec<String> = Vec::new();
    for row in &report.rows {
        if !kinds.contains(&kind(row)) {
            kinds.push(kind(row));
        }
    }
    let curve = |(i, name): (usize, &String)| {
        let own = report.rows.iter().filter(|row| row.pixels == pixels && kind(row) == *name);
        let point = |row: &CurveRow| Point {
            x: time(row).seconds,
            y: row.error_mm.mean.max(EXACT_BELOW_MM),
            name: row.options.clone(),
        };
        Curve {
            name: name.clone(),
            colour: COLOURS[i % COLOURS.len()],
            points: own.map(point).collect(),
            dashed: false,
        }
    };
    Curves {
        across: Axis {
            name: if is_cold { "seconds for all views, cold" } else { "seconds for all views, warm" },
            spacing: Spacing::Logarithmic,
        },
        up: Axis { name: "mean error, mm (1e-6: exact)", spacing: Spacing::Logarithmic },
        curves: kinds.iter().enumerate().map(curve).collect(),
    }
}

fn page(report: &CurveReport) -> String {
    let what = format!(
        "<p>{}: {} organs of {} faces; each run finds all lengths of {} view(s). Errors are lengths against exact clipping \
         on {} of the views' rays; a length depends on its ray alone, so they hold for every number of pixels.</p>",
        escape(&report.scene),
        report.organs,
        grouped(report.faces as u64),
        report.views,
        grouped(report.error_rays)
    );
    let recommendation = report
        .recommendation
        .as_ref()
        .map_or(String::new(), |words| format!("<p class=\"lead\"><b>{}</b></p>", code(words)));
    let plots: String = sizes(report)
        .iter()
        .rev()
        .map(|&pixels| {
            let [cold, warm] =
                [plot(report, pixels, cold, true), plot(report, pixels, warm, false)].map(|p| p.html());
            format!("<h3>{}×{}</h3><div class=\"panels\">{cold}{warm}</div>", pixels[0], pixels[1])
        })
        .collect();
    let left_out: String = report.left_out.iter().map(|words| format!("<li>{}</li>", code(words))).collect();
    let left_out =
        if left_out.is_empty() { String::new() } else { format!("<ul class=\"note\">{left_out}</ul>") };
    document(
        &format!("Error against time: {}", report.scene),
        &[
            (
                "",
                recommendation
                    + &machine(&report.machine, &report.command, report.complete, COLD_AND_WARM)
                    + &what,
            ),
            ("Curves", plots),
            ("Figures", rows(report)),
            ("Left out", left_out),
        ],
    )
}

/// Words with what stands between back-ticks set as code.
fn code(words: &str) -> String {
    let parts = escape(words);
    let mut text = String::new();
    for (i, part) in parts.split('`').enumerate() {
        if i % 2 == 1 {
            let _ = write!(text, "<code>{part}</code>");
        } else {
            text.push_str(part);
        }
    }
    text
}

fn rows(report: &CurveReport) -> String {
    let cells = |row: &CurveRow| {
        let front = match (row.on_cold_front, row.on_warm_front) {
            (true, true) => "cold, warm",
            (true, false) => "cold",
            (false, true) => "warm",
            _ => "",
        };
        let class = if front.is_empty() { "" } else { "strong" };
        let [mean, p999, max] = errors(row);
        format!(
            "<tr class=\"{class}\"><th>{}×{}</th><th><code>{}</code></th><td>{}</td><td>{}</td><td>{mean}</td><td>{p999}</td>\
             <td>{max}</td><td>{}</td><td>{front}</td></tr>",
            row.pixels[0],
            row.pixels[1],
            row.options,
            seconds(&row.cold),
            seconds(&row.warm),
            short(row.tree_bytes as f64 / 1e6),
        )
    };
    let body: String = report.rows.iter().map(cells).collect();
    format!(
        "<div class=\"wide\"><table><thead><tr><th>pixels</th><th>method</th><th>cold, s</th><th>warm, s</th>\
         <th>mean error, mm</th><th>p99.9, mm</th><th>max, mm</th><th>trees, MB</th><th>on the front</th></tr></thead>\
         <tbody>{body}</tbody></table></div><p class=\"note\">On the front: nothing measured at this size is both quicker \
         and no more wrong. ±: half the distance between the quartiles of the times is over a tenth of the median.</p>"
    )
}

/// Mean, p99.9 and max in few characters.
fn errors(row: &CurveRow) -> [String; 3] {
    [row.error_mm.mean, row.error_mm.p999, row.error_mm.max].map(short)
}

fn csv(report: &CurveReport) -> String {
    let mut text = format!(
        "columns,rows,method,setting,value,{TIMES},mean_error_mm,p99_9_error_mm,max_error_mm,exact,tree_bytes,on_cold_front,\
         on_warm_front\n",
    );
    for row in &report.rows {
        let (setting, value) =
            row.setting.map_or((String::new(), String::new()), |d| (d.option.into(), d.value.to_string()));
        let _ = writeln!(
            text,
            "{},{},{},{setting},{value},{},{},{},{},{},{},{},{}",
            row.pixels[0],
            row.pixels[1],
            row.method,
            times(&row.cold, &row.warm),
            row.error_mm.mean,
            row.error_mm.p999,
            row.error_mm.max,
            row.exact,
            row.tree_bytes,
            row.on_cold_front,
            row.on_warm_front,
        );
    }
    text
}

/// As text for a terminal.
pub fn table(report: &CurveReport) -> String {
    let mut text = format!(
        "{}: {} organs, {} faces, {} view(s); seconds cold and warm, errors in mm\n{:>11}  {:42}{:>10}{:>10}{:>10}{:>10}{:>10}  front\n",
        report.scene,
        report.organs,
        report.faces,
        report.views,
        "pixels",
        "method",
        "cold, s",
        "warm, s",
        "mean",
        "p99.9",
        "max"
    );
    for row in &report.rows {
        let [mean, p999, max] = errors(row);
        let front = [(row.on_cold_front, "cold"), (row.on_warm_front, "warm")];
        let front: Vec<&str> = front.into_iter().filter(|f| f.0).map(|f| f.1).collect();
        let _ = writeln!(
            text,
            "{:>11}  {:42}{:>10}{:>10}{mean:>10}{p999:>10}{max:>10}  {}",
            format!("{}×{}", row.pixels[0], row.pixels[1]),
            row.options,
            seconds(&row.cold),
            seconds(&row.warm),
            front.join(", ")
        );
    }
    for words in report.left_out.iter().chain(&report.recommendation) {
        let _ = writeln!(text, "{words}");
    }
    text
}
