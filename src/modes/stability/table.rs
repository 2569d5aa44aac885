//! Sweeps as tables of Markdown.

use std::fmt::Write as _;

use super::{Case, ENGINES, Figures, Found};

/// Two tables: by case, over all bodies; and by body, over all cases; for each engine.
pub fn table(found: &[Found]) -> String {
    let mut bodies: Vec<&str> = Vec::new();
    for Found { body, .. } in found {
        if !bodies.contains(&body.as_str()) {
            bodies.push(body);
        }
    }
    let mut text = String::new();
    let by_case = Case::ALL.map(|case| (case.name(), found.iter().filter(|f| f.case == case).collect()));
    part(&mut text, "case", &by_case);
    text.push('\n');
    let by_body: Vec<_> =
        bodies.iter().map(|&body| (body, found.iter().filter(|f| f.body == body).collect())).collect();
    part(&mut text, "body", &by_body);
    text
}

/// In a sentence: how many rays were traced by each engine, how many of these were lost, and how many lengths disagree.
pub fn totals(found: &[Found]) -> String {
    let of = |engine, figure: fn(&Figures) -> u64| -> u64 {
        found.iter().filter(|f| f.engine == engine).map(|f| figure(&f.figures)).sum()
    };
    let traced =
        ENGINES.map(|engine| format!("{} by `{}`", of(engine, |f| f.rays), engine.name())).join(", ");
    let all = |figure: fn(&Figures) -> u64| ENGINES.into_iter().map(|engine| of(engine, figure)).sum::<u64>();
    let (lost, beyond, recomputed) = (all(|f| f.lost), all(|f| f.beyond), all(|f| f.recomputed));
    format!(
        "Rays traced: {traced}. Lost: {lost}. Disagree: {beyond}. Lengths recomputed in rationals: {recomputed}.\n"
    )
}

fn part(text: &mut String, of: &str, rows: &[(&str, Vec<&Found>)]) {
    // Writing to a string cannot fail.
    let _ = writeln!(
        text,
        "| {of} | engine | rays | lost | disagree | recomputed | open | error, mm | relative |\n\
         |---|---|--:|--:|--:|--:|--:|--:|--:|"
    );
    for (name, found) in rows {
        for engine in ENGINES {
            let mut figures = Figures::default();
            found.iter().filter(|f| f.engine == engine).for_each(|f| figures += f.figures);
            if figures.rays == 0 {
                continue;
            }
            let Figures { rays, lost, beyond, recomputed, open, max_error_mm, max_relative_error, .. } =
                figures;
            let _ = writeln!(
                text,
                "| {name} | `{}` | {rays} | {lost} | {beyond} | {recomputed} | {open} | {max_error_mm:.1e} | \
                 {max_relative_error:.1e} |",
                engine.name()
            );
        }
    }
}
