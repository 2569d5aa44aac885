//! Which of what was measured nothing beats, and what to use.

use super::{CurveReport, CurveRow};
use crate::modes::bench::two_digits;

/// The mean error that counts: none where it is rounding.
fn weight(row: &CurveRow) -> f64 {
    if row.exact { 0.0 } else { row.error_mm.mean }
}

/// Marks the rows that nothing of their size beats.
pub fn mark_fronts(rows: &mut [CurveRow]) {
    let is_beaten = |row: &CurveRow, time: &dyn Fn(&CurveRow) -> f64| {
        rows.iter().filter(|other| other.pixels == row.pixels).any(|other| {
            let no_worse = time(other) <= time(row) && weight(other) <= weight(row);
            no_worse && (time(other) < time(row) || weight(other) < weight(row))
        })
    };
    let marks: Vec<[bool; 2]> = rows
        .iter()
        .map(|row| [!is_beaten(row, &|r| r.cold.seconds), !is_beaten(row, &|r| r.warm.seconds)])
        .collect();
    for (row, [cold, warm]) in rows.iter_mut().zip(marks) {
        (row.on_cold_front, row.on_warm_front) = (cold, warm);
    }
}

/// What to use for the largest images measured.
pub fn recommendation(report: &CurveReport) -> Option<String> {
    let pixels = report.rows.last()?.pixels;
    let rows: Vec<&CurveRow> = report.rows.iter().filter(|row| row.pixels == pixels).collect();
    let quickest = |time: fn(&CurveRow) -> f64, rows: &[&CurveRow]| -> Option<CurveRow> {
        rows.iter().min_by(|a, b| time(a).total_cmp(&time(b))).map(|row| (*row).clone())
    };
    let exact: Vec<&CurveRow> = rows.iter().copied().filter(|row| row.exact).collect();
    let best = quickest(|row| row.cold.seconds, &exact)?;
    let mut text = format!(
        "For {} of {}×{} pixels on this machine use `{}`: exact, {} s",
        if report.views == 1 { "a view".into() } else { format!("{} views", report.views) },
        pixels[0],
        pixels[1],
        best.options,
        two_digits(best.cold.seconds)
    );
    let best_warm = quickest(|row| row.warm.seconds, &exact)?;
    let rivals = [
        ("from cold", best.cold.seconds, (|row| row.cold.seconds) as fn(&CurveRow) -> f64),
        ("once warm", best_warm.warm.seconds, |row| row.warm.seconds),
    ];
    for (when, to_beat, time) in rivals {
        let inexact: Vec<&CurveRow> =
            rows.iter().copied().filter(|row| !row.exact && time(row) < to_beat).collect();
        // Of those that are quicker, the most accurate.
        let rival = inexact.iter().min_by(|a, b| a.error_mm.mean.total_cmp(&b.error_mm.mean));
        text += &match rival {
            None => format!("; {when}, nothing inexact was quicker"),
            Some(row) => format!(
                "; {when}, `{}` takes {} s with errors of {} mm on average and {} mm in 99.9 % of lengths",
                row.options,
                two_digits(time(row)),
                two_digits(row.error_mm.mean),
                two_digits(row.error_mm.p999)
            ),
        };
    }
    Some(text + ".")
}
