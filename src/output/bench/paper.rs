//! The paper's tables and figures, ours beside its own.

use std::fmt::Write as _;

use super::{Named, machine};
use crate::modes::bench::paper::{Dial, PaperReport, Row, Sweep};
use crate::output::page::curves::{Axis, COLOURS, Curve, Curves, Point, Spacing};
use crate::output::page::{document, escape, grouped, short};

pub fn files(report: &PaperReport) -> Vec<Named> {
    let mut files = vec![("paper.html".into(), page(report)), ("paper.csv".into(), csv(report))];
    for sweep in &report.sweeps {
        for (what, plot) in plots(sweep) {
            let svg = plot.file();
            if !svg.is_empty() {
                files.push((format!("paper-{}-{}-{what}.svg", sweep.input.name(), sweep.dial.word()), svg));
            }
        }
    }
    files
}

/// A figure of a row: ours, and the paper's if it gives one.
type Figures = fn(&Row) -> [Option<f64>; 2];

fn flop(row: &Row) -> [Option<f64>; 2] {
    [row.flop_speed_up, row.published.map(|p| p.flop_speed_up)]
}

fn cpu(row: &Row) -> [Option<f64>; 2] {
    [row.cpu_speed_up.map(|s| s.median), row.published.map(|p| p.cpu_speed_up)]
}

fn error(row: &Row) -> [Option<f64>; 2] {
    [Some(row.error), row.published.map(|p| p.error)]
}

fn memory(row: &Row) -> [Option<f64>; 2] {
    [Some(row.memory_mb), row.published.and_then(|p| p.memory_mb)]
}

/// The plots of a sweep with a word for each: ours drawn through, the paper's dashed.
fn plots(sweep: &Sweep) -> Vec<(&'static str, Curves<'static>)> {
    let both = |name: &str, colour: usize, figures: Figures| {
        [false, true].map(|is_paper| {
            let point = |row: &Row| {
                let name = format!("{} {}", sweep.dial.title(), short(row.value));
                Some(Point { x: row.value, y: figures(row)[usize::from(is_paper)]?, name })
            };
            let points: Vec<Point> = sweep.rows.iter().filter_map(point).collect();
            let name = match (points.is_empty(), is_paper) {
                (true, _) => String::new(),
                (false, true) => format!("{name}, the paper's (dashed)"),
                (false, false) => name.to_owned(),
            };
            Curve { name, colour: COLOURS[colour], points, dashed: is_paper }
        })
    };
    let is_cache = sweep.dial == Dial::CacheSize;
    let across = Axis {
        name: sweep.dial.title(),
        spacing: if is_cache { Spacing::Logarithmic } else { Spacing::Between },
    };
    let plot = |name, spacing, curves: Vec<Curve>| Curves { across, up: Axis { name, spacing }, curves };
    let mut errors = both("error", 1, error).to_vec();
    if !sweep.input.errors_compare() {
        errors.truncate(1);
    }
    let speed_ups = [both("FLOP speed-up", 0, flop), both("CPU speed-up", 2, cpu)].concat();
    let mut plots = vec![("speed-up", plot("speed-up", Spacing::Linear, speed_ups))];
    if is_cache {
        // The cache changes no error, and memory is what it allows.
        return plots;
    }
    plots.insert(0, ("error", plot("mean error", Spacing::Linear, errors)));
    if sweep.dial == Dial::AngularThreshold {
        // It chooses among answers; the trees are the same.
        return plots;
    }
    plots.push((
        "memory",
        plot("MB", Spacing::Logarithmic, both("nodes and samples, MB", 3, memory).to_vec()),
    ));
    plots
}

fn heading(sweep: &Sweep) -> String {
    format!("{}: {} ({})", sweep.input.title(), sweep.dial.title(), sweep.place)
}

fn page(report: &PaperReport) -> String {
    let terms = "speed-ups are those of rays traced one by one on the same threads over those with trees, sampling included; a \
                 CPU speed-up is the median over rounds, FLOPs are counted, not estimated";
    let size = match report.scale {
        1.0 => "pictures as large as the paper's".to_owned(),
        scale => format!("pictures with {scale} times the paper's columns and rows"),
    };
    let mut lead = machine(&report.machine, &report.command, report.complete, terms);
    let _ = write!(
        lead,
        "<p>Atalay &amp; Mount, <i>Interpolation over Light Fields with Applications in Computer Graphics</i>: its Tables 1 and \
         2 and Figures 5 to 8 on this machine, {size}. Its scenes are made anew from its \
         description; its machine was of some twenty years ago. Trees are made anew for each view, so that speed-ups grow with the \
         number of pixels.</p>"
    );
    let judged = |sweep: &Sweep| {
        let verdict = sweep.verdict.as_ref()?;
        Some(format!("<li><b>{}</b>: {}</li>", escape(&heading(sweep)), escape(&verdict.sentence)))
    };
    let verdicts: String = report.sweeps.iter().filter_map(judged).collect();
    if !verdicts.is_empty() {
        let _ = write!(lead, "<ul>{verdicts}</ul>");
    }
    let headings: Vec<String> = report.sweeps.iter().map(|sweep| escape(&heading(sweep))).collect();
    let mut sections = vec![("", lead)];
    sections.extend(headings.iter().zip(&report.sweeps).map(|(h, sweep)| (h.as_str(), section(sweep))));
    document("The paper's figures on this machine", &sections)
}

fn section(sweep: &Sweep) -> String {
    let words = |words: Option<&String>, class: &str| {
        words.map_or(String::new(), |words| format!("<p class=\"{class}\">{}</p>", escape(words)))
    };
    let plots: String = plots(sweep).iter().map(|(_, plot)| plot.html()).collect();
    format!(
        "<p>{}.</p>{}{}<div class=\"panels\">{plots}</div>{}",
        escape(&setup(sweep)),
        words(sweep.verdict.as_ref().map(|v| &v.sentence), "lead"),
        words(sweep.beside_the_paper.as_ref(), ""),
        rows(sweep)
    )
}

/// What was rendered, how large, and how long it took to trace it exactly.
fn setup(sweep: &Sweep) -> String {
    let rays = if sweep.samples > 1 { format!(", {} rays per pixel", sweep.samples) } else { String::new() };
    let seconds = sweep.exact.time.map_or(String::new(), |time| format!(" in {} s", super::seconds(&time)));
    let operations = match sweep.exact.operations {
        0 => String::new(),
        operations => format!(" by {} operations", short(operations as f64)),
    };
    let exact = match (seconds.is_empty(), operations.is_empty()) {
        (true, true) => String::new(),
        _ => format!("; traced exactly{seconds}{operations}"),
    };
    let [columns, rows] = sweep.size;
    format!("{}×{}{rays}: {}{exact}; error: {}", columns, rows, sweep.input.setup(), sweep.error_unit)
}

fn or_dash(value: Option<f64>) -> String {
    value.map_or_else(|| "–".into(), short)
}

/// The median with a mark if it is unsteady.
fn speed_up(row: &Row) -> String {
    let mark = if row.cpu_speed_up.is_some_and(|s| s.unsteady) { " ±" } else { "" };
    or_dash(cpu(row)[0]) + mark
}

/// Of the questions, how many were answered by interpolation.
fn percent(row: &Row) -> String {
    format!("{:.1}", 100.0 * row.interpolated)
}

fn rows(sweep: &Sweep) -> String {
    let beside = |ours: String, paper: Option<f64>| {
        paper.map_or_else(|| ours.clone(), |paper| format!("{ours} <small>({})</small>", short(paper)))
    };
    let cells = |row: &Row| {
        let cells = [
            short(row.value),
            beside(or_dash(row.flop_speed_up), flop(row)[1]),
            beside(speed_up(row), cpu(row)[1]),
            beside(short(row.error), error(row)[1]),
            percent(row),
            beside(short(row.memory_mb), memory(row)[1]),
            grouped(row.nodes.round() as u64),
            grouped(row.samples.round() as u64),
            short(row.prunes),
            or_dash(row.time.map(|t| t.seconds)),
        ];
        format!("<tr>{}</tr>", cells.map(|cell| format!("<td>{cell}</td>")).concat())
    };
    let body: String = sweep.rows.iter().map(cells).collect();
    let unit = if sweep.input.errors_compare() {
        ""
    } else {
        " The paper's errors are in a unit of length of its own."
    };
    format!(
        "<div class=\"wide\"><table><thead><tr><th>{}</th><th>speed-up (FLOP)</th><th>speed-up (CPU)</th><th>error</th>\
         <th>interpolated, %</th><th>memory, MB</th><th>nodes</th><th>samples</th><th>prunings</th><th>s</th></tr></thead>\
         <tbody>{body}</tbody></table></div><p class=\"note\">In brackets, the paper's. ±: half the distance between the \
         quartiles of the rounds' speed-ups is over a tenth of their median.{unit}</p>",
        sweep.dial.title()
    )
}

fn csv(report: &PaperReport) -> String {
    let mut text = String::from(
        "input,parameter,value,columns,rows,samples,distance_threshold,angular_threshold_deg,max_depth,cache_bytes,\
         flop_speed_up,paper_flop_speed_up,cpu_speed_up,paper_cpu_speed_up,cpu_spread,error,paper_error,interpolated,\
         memory_mb,paper_memory_mb,nodes,samples_taken,prunes,trees_s,trees_least_s,trees_most_s,exact_s,rounds\n",
    );
    let or_nothing = |value: Option<f64>| value.map(|v| v.to_string()).unwrap_or_default();
    for sweep in &report.sweeps {
        for row in &sweep.rows {
            let parameters = row.trees.parameters;
            let pair = |figures: Figures| figures(row).map(or_nothing).join(",");
            let time = row.time.map(|t| [t.seconds, t.least, t.most]);
            let times: Vec<String> = (0..3).map(|i| or_nothing(time.map(|t| t[i]))).collect();
            let _ = writeln!(
                text,
                "{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{},{}",
                sweep.input.name(),
                sweep.dial.word(),
                row.value,
                sweep.size[0],
                sweep.size[1],
                sweep.samples,
                parameters.distance_threshold,
                parameters.angular_threshold_deg,
                parameters.max_depth,
                row.trees.cache_bytes,
                pair(flop),
                pair(cpu),
                or_nothing(row.cpu_speed_up.map(|s| s.spread)),
                pair(error),
                row.interpolated,
                pair(memory),
                row.nodes,
                row.samples,
                row.prunes,
                times.join(","),
                or_nothing(sweep.exact.time.map(|t| t.seconds)),
                row.time.map_or(0, |t| t.rounds),
            );
        }
    }
    text
}

/// As text for a terminal.
pub fn table(report: &PaperReport) -> String {
    let mut text = String::new();
    for sweep in &report.sweeps {
        let _ = writeln!(
            text,
            "{}\n  {}\n{:>12}{:>10}{:>9}{:>10}{:>9}{:>11}{:>9}{:>8}{:>10}{:>9}{:>10}",
            heading(sweep),
            setup(sweep),
            sweep.dial.word(),
            "FLOP",
            "(paper)",
            "CPU",
            "(paper)",
            "error",
            "(paper)",
            "int., %",
            "MB",
            "(paper)",
            "nodes"
        );
        for row in &sweep.rows {
            let paper =
                |figures: Figures| figures(row)[1].map_or_else(|| "–".into(), |v| format!("({})", short(v)));
            let _ = writeln!(
                text,
                "{:>12}{:>10}{:>9}{:>10}{:>9}{:>11}{:>9}{:>8}{:>10}{:>9}{:>10}",
                short(row.value),
                or_dash(row.flop_speed_up),
                paper(flop),
                speed_up(row),
                paper(cpu),
                short(row.error),
                paper(error),
                percent(row),
                short(row.memory_mb),
                paper(memory),
                row.nodes.round()
            );
        }
        for words in sweep.verdict.iter().map(|v| &v.sentence).chain(&sweep.beside_the_paper) {
            let _ = writeln!(text, "  {words}");
        }
        text.push('\n');
    }
    text
}
