//! `chordfield dose`.

use std::fmt::Write as _;
use std::io::Write;
use std::path::Path;

use serde::Serialize;

use super::args::{DoseArgs, FormatArg, TableArg};
use super::method::method;
use super::{Session, command_line, keep, print};
use crate::error::{Error, Result};
use crate::modes::Control;
use crate::modes::dose::{self, CaseFigures, Dose, DoseReport, Keeper, NOTICE, NoPaths, Shard, StudyWords};
use crate::modes::project::Method;
use crate::output::dose::{self as output, Format, PathFiles, Table};
use crate::output::page::short;
use crate::output::{create_folder, json, remove_stale};
use crate::study::Study;

/// Cases whose figures the summary tells; all are in the tables.
const TOLD_CASES: usize = 8;

/// Organs that the summary tells of a case.
const TOLD_ORGANS: usize = 8;

/// Follows a study's paths, or one part of them, or joins the parts. What will be done is said on `out` before it is begun.
pub fn run(args: &DoseArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    let method = keep::method(&args.keep, method(&(&args.method).into())?)?;
    let study = Study::load(&args.study, &args.settings, args.zip)?;
    let mut dose = Dose::new(&study, method)?;
    output::spare_inputs(&args.output, &args.study, &study)?;
    keep::load(&args.keep, &mut dose, session)?;
    if args.dry_run || !args.json {
        let plan = Plan::of(&dose, args.shard.unwrap_or(Shard::WHOLE));
        print(out, &if args.json { json::text(&plan)? } else { plan.text() })?;
    }
    match args.shard {
        _ if args.dry_run => Ok(()),
        Some(shard) => run_part(&dose, shard, method, args, session, out),
        None if args.join => {
            let report = join(&study, method, args, session)?;
            finish(&dose, report, args, session, out)
        }
        None => {
            session.begin_writing();
            create_folder(&args.output)?;
            remove_stale(&args.output.join(output::RECORD))?;
            let report = follow(&dose, Shard::WHOLE, &args.output, args, session, |keeper, control| {
                keeper.run(&dose, control)
            })?;
            keep::save(&args.keep, &dose, session)?;
            finish(&dose, report, args, session, out)
        }
    }
}

/// Whoever keeps the paths: files, or nobody.
enum Paths {
    Files(PathFiles),
    Nobody,
}

impl Paths {
    fn run(&mut self, dose: &Dose, control: &Control) -> Result<DoseReport> {
        match self {
            Self::Files(files) => dose.run(files, control),
            Self::Nobody => dose.run(&mut NoPaths, control),
        }
    }

    fn run_part(&mut self, dose: &Dose, shard: Shard, control: &Control) -> Result<dose::Part> {
        fn part(
            dose: &Dose,
            shard: Shard,
            keeper: &mut impl Keeper,
            control: &Control,
        ) -> Result<dose::Part> {
            dose.run_part(shard, keeper, control)
        }
        match self {
            Self::Files(files) => part(dose, shard, files, control),
            Self::Nobody => part(dose, shard, &mut NoPaths, control),
        }
    }
}

/// Follows paths with a bar for whoever watches, and lets the tables of paths appear.
fn follow<T>(
    dose: &Dose,
    shard: Shard,
    folder: &Path,
    args: &DoseArgs,
    session: &Session,
    work: impl FnOnce(&mut Paths, &Control) -> Result<T>,
) -> Result<T> {
    let tables: Vec<Table> = args.write.iter().filter_map(|arg| TableArg::table(*arg)).collect();
    let mut paths = match tables.is_empty() {
        true => Paths::Nobody,
        false => Paths::Files(PathFiles::begin(folder, &tables, &formats(args))?),
    };
    let bar = session.progress(dose.paths(shard), "paths");
    bar.set_message(dose.study().name().to_owned());
    let advance = |paths| bar.inc(paths);
    let control = Control::new(session.cancel(), &advance);
    let done = work(&mut paths, &control)?;
    bar.finish_and_clear();
    if let Paths::Files(files) = paths {
        files.commit()?;
    }
    Ok(done)
}

fn run_part(
    dose: &Dose,
    shard: Shard,
    method: Method,
    args: &DoseArgs,
    session: &Session,
    out: &mut dyn Write,
) -> Result<()> {
    let folder = output::part_folder(&args.output, shard);
    if args.resume
        && let Some(part) = output::read_part(&folder)?
        && part.is_of(dose.study(), method.name())
    {
        let told = format!("part {shard} is there already: {}\n", folder.display());
        return if args.json { Ok(()) } else { print(out, &told) };
    }
    session.begin_writing();
    create_folder(&folder)?;
    remove_stale(&folder.join(output::SUMS))?;
    let part =
        follow(dose, shard, &folder, args, session, |keeper, control| keeper.run_part(dose, shard, control))?;
    output::write_part(&folder, &part)?;
    keep::save(&args.keep, dose, session)?;
    if args.json {
        return print(out, &json::text(&Plan::of(dose, shard))?);
    }
    let paths = part.paths;
    print(out, &format!("part {shard}: {paths} paths; when all parts are there, join them with --join\n"))
}

/// The report of all parts, whose tables of paths are joined as well.
fn join(study: &Study, method: Method, args: &DoseArgs, session: &Session) -> Result<DoseReport> {
    let (folders, parts): (Vec<_>, Vec<_>) = output::read_parts(&args.output)?.into_iter().unzip();
    if parts.is_empty() {
        return Err(Error::input(
            args.output.display().to_string(),
            "there is no finished part of a study",
            "make the parts with --shard, and give their --output",
        ));
    }
    let report = dose::join(study, method.name(), parts)?;
    session.begin_writing();
    remove_stale(&args.output.join(output::RECORD))?;
    output::join_tables(&args.output, &folders)?;
    Ok(report)
}

fn finish(
    dose: &Dose,
    mut report: DoseReport,
    args: &DoseArgs,
    session: &Session,
    out: &mut dyn Write,
) -> Result<()> {
    report.command = command_line();
    let shown = dose.illustrations(&Control::new(session.cancel(), &|_| {}))?;
    output::write(&args.output, &report, &shown, &formats(args))?;
    print(out, &if args.json { json::text(&report)? } else { summary(&report, &args.output) })
}

fn formats(args: &DoseArgs) -> Vec<Format> {
    let mut formats: Vec<Format> = args.format.iter().map(|&arg: &FormatArg| arg.into()).collect();
    formats.dedup();
    formats
}

/// What is going to be followed.
#[derive(Debug, Serialize)]
struct Plan {
    notice: &'static str,
    study: StudyWords,
    scenes: Vec<String>,
    cases: usize,
    fields: usize,
    paths: u64,
    #[serde(skip_serializing_if = "Option::is_none")]
    shard: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    paths_of_shard: Option<u64>,
}

impl Plan {
    fn of(dose: &Dose, shard: Shard) -> Self {
        let study = dose.study();
        let is_part = shard != Shard::WHOLE;
        Self {
            notice: NOTICE,
            study: StudyWords::of(study),
            scenes: study.scenes().iter().map(|scene| scene.name.clone()).collect(),
            cases: study.cases().len(),
            fields: study.fields().len(),
            paths: study.paths(),
            shard: is_part.then(|| shard.to_string()),
            paths_of_shard: is_part.then(|| dose.paths(shard)),
        }
    }

    fn text(&self) -> String {
        let swept = match self.study.parameters.is_empty() {
            true => String::new(),
            false => format!(" (by {})", self.study.parameters.join(", ")),
        };
        let mut text = format!(
            "{} in {}: {} paths in {} fields of {} cases{swept}\n",
            self.study.name,
            self.scenes.join(", "),
            self.paths,
            self.fields,
            self.cases
        );
        if let (Some(shard), Some(paths)) = (&self.shard, self.paths_of_shard) {
            let _ = writeln!(text, "part {shard}: {paths} paths");
        }
        let _ = writeln!(text, "{NOTICE}");
        text
    }
}

/// The report in a few lines.
fn summary(report: &DoseReport, folder: &Path) -> String {
    let mut text = String::new();
    for case in report.cases.iter().take(TOLD_CASES) {
        tell(report, case, &mut text);
    }
    if report.cases.len() > TOLD_CASES {
        let _ = writeln!(text, "… {} more cases", report.cases.len() - TOLD_CASES);
    }
    for sample in &report.errors {
        let _ = writeln!(
            text,
            "lengths by {} in {}, {} paths of these against exact: mean error {} mm, p99 {} mm, max {} mm",
            report.method,
            sample.scene,
            sample.paths,
            short(sample.length_mm.mean),
            short(sample.length_mm.p99),
            short(sample.length_mm.max)
        );
    }
    let _ = writeln!(text, "report: {}; tables and record beside it", folder.join(output::PAGE).display());
    text
}

fn tell(report: &DoseReport, case: &CaseFigures, text: &mut String) {
    let values =
        report.study.parameters.iter().zip(&case.values).map(|(name, value)| format!(", {name} {value}"));
    let figures = &case.figures;
    let _ = writeln!(
        text,
        "case {}{}: {} paths, {} of {} keV photons left, {} of their energy absorbed",
        case.case,
        values.collect::<String>(),
        figures.paths,
        short(figures.transmitted_photons),
        short(case.mean_energy_kev),
        short(figures.absorbed_energy)
    );
    let mut organs: Vec<_> = figures.organs.iter().collect();
    organs.sort_by(|a, b| b.absorbed_share.total_cmp(&a.absorbed_share));
    for organ in organs.iter().take(TOLD_ORGANS) {
        let _ = writeln!(
            text,
            "  {:24}{:>10} % of photons, own length mean {:>7} max {:>7} mm, absorbed {:>9} keV per photon",
            organ.organ,
            short(100.0 * organ.met_share),
            short(organ.mean_length_mm),
            short(organ.longest_mm),
            short(organ.energy_imparted_kev)
        );
    }
    if organs.len() > TOLD_ORGANS {
        let _ = writeln!(text, "  … {} more organs", organs.len() - TOLD_ORGANS);
    }
}
