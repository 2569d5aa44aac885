//! `chordfield bench`.

use std::io::Write;
use std::path::Path;

use serde::Serialize;

use super::args::{BenchCommand, ChoiceArgs, CurveArgs, PaperArgs, RunArgs, ScaleArgs, SourceArgs};
use super::project::{change, open};
use super::{Session, command_line, print};
use crate::error::{Error, Result};
use crate::modes::Control;
use crate::modes::bench::Patience;
use crate::modes::bench::choice::{self, ChoiceSettings};
use crate::modes::bench::curve::{self, CurveSettings};
use crate::modes::bench::paper::{self, PaperSettings};
use crate::modes::bench::scale::{self, ScaleSettings};
use crate::output::{bench as output, create_folder, json};

/// A contender leaves its race after so long, seconds, once there are enough rounds for a median.
const PATIENCE_S: f64 = 3.0;

/// The same in a hurry.
const HURRY: Patience = Patience { rounds: 3, seconds: 0.5 };

/// A contender that would take longer for one size is left out in a hurry, seconds.
const HURRY_LIMIT_S: f64 = 10.0;

/// Sizes in a hurry are no larger than this, columns times rows.
const SMALL: u64 = 600 * 600;

/// Sides of the paper's pictures in a hurry, as a share.
const QUICK_SCALE: f64 = 0.1;

/// Measures, writes the report if a folder is named, and says its sum on `out`. What was measured before an interruption is
/// written and said, too.
///
/// # Errors
/// What stopped it; [`Error::Interrupted`] once the partial report is written.
pub fn run(command: &BenchCommand, session: &Session, out: &mut dyn Write) -> Result<()> {
    match command {
        BenchCommand::Curve(args) => run_curve(args, session, out),
        BenchCommand::Scale(args) => run_scale(args, session, out),
        BenchCommand::Choice(args) => run_choice(args, session, out),
        BenchCommand::Paper(args) => run_paper(args, session, out),
    }
}

fn run_curve(args: &CurveArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    let mut scene = open(&args.scene)?;
    let unchanged = SourceArgs { energy_kev: None, kvp: None, response: None };
    change(&mut scene, &args.beam, &unchanged)?;
    let mut sizes = args.sizes.clone();
    sizes.sort_unstable_by_key(|[columns, rows]| u64::from(*columns) * u64::from(*rows));
    if args.run.quick {
        let small = sizes.iter().filter(|[c, r]| u64::from(*c) * u64::from(*r) <= SMALL).count();
        sizes.truncate(small.max(1));
    }
    if args.limit_s.is_nan() || args.limit_s <= 0.0 {
        return Err(Error::input(
            "--limit-s",
            format!("{} does not serve", args.limit_s),
            "give seconds, over 0",
        ));
    }
    let settings = CurveSettings {
        contenders: CurveSettings::contenders(args.run.quick),
        sizes,
        patience: patience(&args.run),
        limit_s: if args.run.quick { args.limit_s.min(HURRY_LIMIT_S) } else { args.limit_s },
    };
    settings.check(&scene)?;
    let mut report = measure(session, &args.run, curve::turns(&settings), &scene.name, |control| {
        curve::curve(&scene, &settings, control)
    })?;
    report.command = command_line();
    finish(&args.run, &report, report.complete, output::write_curve, output::curve_table, out)
}

fn run_scale(args: &ScaleArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    let settings =
        ScaleSettings { patience: patience(&args.run), quick: args.run.quick, studies: args.studies.clone() };
    let mut report = measure(session, &args.run, scale::turns(&settings), "scale", |control| {
        scale::scale(&settings, control)
    })?;
    report.command = command_line();
    finish(&args.run, &report, report.complete, output::write_scale, output::scale_table, out)
}

fn run_choice(args: &ChoiceArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    let small = |&side: &u32| !args.run.quick || u64::from(side) * u64::from(side) <= SMALL;
    let settings = ChoiceSettings {
        subdivisions: args.subdivisions.clone(),
        sizes: args.sizes.iter().copied().filter(small).collect(),
        tolerances_mm: args.tolerances.clone(),
        patience: patience(&args.run),
    };
    let mut report = measure(session, &args.run, choice::turns(&settings), "choice", |control| {
        choice::choice(&settings, control)
    })?;
    report.command = command_line();
    finish(&args.run, &report, report.complete, output::write_choice, output::choice_table, out)
}

fn run_paper(args: &PaperArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    let settings = PaperSettings {
        inputs: args.scenes.clone(),
        patience: patience(&args.run),
        quick: args.run.quick,
        scale: args.scale.unwrap_or(if args.run.quick { QUICK_SCALE } else { 1.0 }),
    };
    settings.check()?;
    let mut report = measure(session, &args.run, paper::turns(&settings), "paper", |control| {
        paper::paper(&settings, control)
    })?;
    report.command = command_line();
    finish(&args.run, &report, report.complete, output::write_paper, output::paper_table, out)
}

fn patience(args: &RunArgs) -> Patience {
    if args.quick { HURRY } else { Patience { rounds: args.rounds.into(), seconds: PATIENCE_S } }
}

fn measure<T>(
    session: &Session,
    args: &RunArgs,
    turns: u64,
    name: &str,
    work: impl FnOnce(&Control) -> Result<T>,
) -> Result<T> {
    if let Some(folder) = &args.output {
        // A folder that cannot be made is better known before the measurement than after it. From here on an interruption
        // ends the measurement, not the program: there is something to write.
        session.begin_writing();
        create_folder(folder)?;
    }
    let bar = session.progress(turns, "turns");
    bar.set_message(name.to_owned());
    let advance = |turns| bar.inc(turns);
    work(&Control::new(session.cancel(), &advance))
}

fn finish<T: Serialize>(
    args: &RunArgs,
    report: &T,
    complete: bool,
    write: fn(&Path, &T) -> Result<()>,
    table: fn(&T) -> String,
    out: &mut dyn Write,
) -> Result<()> {
    if let Some(folder) = &args.output {
        write(folder, report)?;
    }
    print(out, &if args.json { json::text(report)? } else { table(report) })?;
    if complete { Ok(()) } else { Err(Error::Interrupted) }
}
