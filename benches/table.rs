//! The table: engines and rivals in turns, A B C A B C …, so that the machine's drift hits all alike.
//!
//! Times are medians over rounds, ± half the distance of the quartiles; ratios are medians of each round's own. What is
//! timed is checked: mean lengths against the first entrant's, and rays lost. Exit code 1 if a mean is off, or if an engine
//! of this crate loses a ray.
//!
//! Making ready for a view is part of its times. What a body needs once (for this crate's engines with all proofs that it is
//! closed, or convex) is its build.
//!
//! `cargo bench --bench table -- [--quick] [1280] [20480] [327680] [organs] [600] [2048] [random] [raster] [obvhs] …`
//!
//! `cargo bench --bench table -- choice` prints instead, on one thread, whether the engine taken unasked is the quickest.

use std::io::{Result, Write, stdout};
use std::process::ExitCode;
use std::time::{Duration, Instant};

use chordfield::exact::Engine;
use common::body::{Ellipsoid, SUBDIVISIONS};
use common::choice::{Choice, each_choice};
use common::organs::Organs;
use common::race::{Figures, race, race_of_organs};
use common::rays::RaySet;
use common::samples::Samples;
use common::{Contestant, Entrant, YARDSTICK, field, machine, random, view};

/// The bodies by their faces, and the picture of many.
const SCENES: [&str; 4] = ["1280", "20480", "327680", "organs"];

/// Who may enter.
const NAMES: [&str; 6] = ["clip", "bvh", "walk", "raster", YARDSTICK, "parry3d"];

/// Images by their side, and the batch.
const RAY_SETS: [&str; 3] = ["600", "2048", "random"];

/// An engine may be chosen that takes this part more time than the quickest.
const MOST_OVER_BEST: f64 = 1.3;

/// What to run, from the command line.
struct Options {
    quick: bool,
    /// Scenes, sets of rays and entrants by name; all scenes if no scene is named, and so on.
    only: Vec<String>,
}

impl Options {
    /// Flags that cargo adds are not ours.
    fn from_arguments() -> Self {
        let (flags, only): (Vec<_>, Vec<_>) = std::env::args().skip(1).partition(|a| a.starts_with("--"));
        Self { quick: flags.iter().any(|flag| flag == "--quick"), only }
    }

    /// Whether a member of a group is named, or none is.
    fn wants(&self, member: &str, group: &[&str]) -> bool {
        let named = |name: &str| self.only.iter().any(|only| only == name);
        named(member) || !group.iter().any(|name| named(name))
    }

    /// Those who enter for a body of so many faces.
    fn field(&self, faces: usize) -> Vec<Entrant> {
        field(faces).into_iter().filter(|entrant| self.wants(entrant.name, &NAMES)).collect()
    }

    fn rounds(&self) -> usize {
        if self.quick { 3 } else { 7 }
    }

    /// The sets of rays to a body, and their column heads.
    fn ray_sets(&self, subdivisions: u32) -> Vec<(&'static str, RaySet)> {
        let mesh = Ellipsoid::BENCH.mesh(subdivisions);
        let count = if self.quick { random::COUNT / 10 } else { random::COUNT };
        let mut sets = Vec::new();
        for name in RAY_SETS {
            if !self.wants(name, &RAY_SETS) || (self.quick && name == "2048") {
                continue;
            }
            sets.push(match name.parse() {
                Ok(size) => (name, RaySet::Grid(view::window(&mesh, size))),
                Err(_) => (name, RaySet::Batch(random::rays(count))),
            });
        }
        sets
    }
}

fn main() -> ExitCode {
    match print_tables(&Options::from_arguments()) {
        Ok(true) => ExitCode::SUCCESS,
        _ => ExitCode::FAILURE,
    }
}

/// Prints each table as soon as it is there. Whether all means agree.
fn print_tables(options: &Options) -> Result<bool> {
    writeln!(stdout(), "{}\nRatios are {YARDSTICK}'s time over the row's.", machine::heading())?;
    if options.only.iter().any(|only| only == "choice") {
        return print_choices(options);
    }
    let mut sound = true;
    for (scene, subdivisions) in SCENES.into_iter().zip(SUBDIVISIONS) {
        let faces = 20 * 4usize.pow(subdivisions);
        assert_eq!(scene, faces.to_string());
        if options.wants(scene, &SCENES) {
            sound &= print_body(options, &options.field(faces), subdivisions, faces)?;
        }
    }
    if options.wants("organs", &SCENES) {
        sound &= print_organs(options)?;
    }
    Ok(sound)
}

/// One body: each entrant's build, then a race on each set of rays.
fn print_body(options: &Options, entrants: &[Entrant], subdivisions: u32, faces: usize) -> Result<bool> {
    let (contestants, builds) = build(options, entrants, subdivisions);
    let sets = options.ray_sets(subdivisions);
    let races: Vec<Vec<Option<Figures>>> =
        sets.iter().map(|(_, rays)| race(entrants, &contestants, rays, options.rounds())).collect();

    let out = &mut stdout().lock();
    writeln!(out, "\n## An ellipsoid of {faces} faces\n")?;
    write!(out, "| | build, ms |")?;
    for (name, _) in &sets {
        write!(out, " {name}: ns per ray | ratio | two threads |")?;
    }
    writeln!(out, "\n|---|--:|{}", "--:|--:|--:|".repeat(sets.len()))?;
    for (row, entrant) in entrants.iter().enumerate() {
        write!(out, "| {} | {} |", entrant.name, with_spread(&builds[row], 1e3))?;
        for ((_, rays), figures) in sets.iter().zip(&races) {
            write_figures(out, row, entrants, figures, 1e9 / rays.count() as f64)?;
        }
        writeln!(out)?;
    }
    let mut sound = true;
    writeln!(out, "\n| checked | rays | mean, mm | mean off by, mm | hit | lost | invented | worst, mm |")?;
    writeln!(out, "|---|---|--:|--:|--:|--:|--:|--:|")?;
    for ((name, _), figures) in sets.iter().zip(&races) {
        for (entrant, figures) in entrants.iter().zip(figures) {
            if let Some(figures) = figures {
                sound &= write_check(out, entrant, name, figures)?;
            }
        }
    }
    Ok(sound)
}

/// Builds every contestant, in turns. Times in seconds.
fn build(
    options: &Options,
    entrants: &[Entrant],
    subdivisions: u32,
) -> (Vec<Box<dyn Contestant>>, Vec<Samples>) {
    /// Slow builders are not waited for much longer than this.
    const PATIENCE: Duration = Duration::from_secs(2);
    let surface = Ellipsoid::BENCH.surface(subdivisions);
    let mut times = vec![Samples::default(); entrants.len()];
    let mut contestants: Vec<_> = entrants.iter().map(|entrant| (entrant.build)(&surface)).collect();
    for _ in 0..options.rounds() {
        for (row, entrant) in entrants.iter().enumerate() {
            if times[row].0.iter().sum::<f64>() < PATIENCE.as_secs_f64() {
                let start = Instant::now();
                contestants[row] = (entrant.build)(&surface);
                times[row].0.push(start.elapsed().as_secs_f64());
            }
        }
    }
    (contestants, times)
}

/// Twenty organs: all lengths of each on its own rectangle of pixels.
fn print_organs(options: &Options) -> Result<bool> {
    let size = if options.quick { 300 } else { 600 };
    let organs = Organs::new(size);
    let (count, faces) = (organs.surfaces.len(), organs.surfaces[0].mesh().faces.len());
    let entrants = options.field(faces);
    let figures = race_of_organs(&entrants, &organs, options.rounds());

    let out = &mut stdout().lock();
    writeln!(out, "\n## {count} organs of {faces} faces each, {size}²\n")?;
    writeln!(out, "| | all lengths, ms | ratio | two threads |\n|---|--:|--:|--:|")?;
    for (row, entrant) in entrants.iter().enumerate() {
        write!(out, "| {} |", entrant.name)?;
        write_figures(out, row, &entrants, &figures, 1e3)?;
        writeln!(out)?;
    }
    let mut sound = true;
    writeln!(out, "\n| checked | rays | mean, mm | mean off by, mm | hit | lost | invented | worst, mm |")?;
    writeln!(out, "|---|---|--:|--:|--:|--:|--:|--:|")?;
    for (entrant, figures) in entrants.iter().zip(&figures) {
        if let Some(figures) = figures {
            sound &= write_check(out, entrant, "organs", figures)?;
        }
    }
    Ok(sound)
}

/// The engine taken unasked beside all that serve. All is well if it takes no more than [`MOST_OVER_BEST`] of the best one's time.
fn print_choices(options: &Options) -> Result<bool> {
    writeln!(
        stdout(),
        "\n| body | faces | rays | clip, ns | walk | raster | bvh | chosen | over the best |"
    )?;
    writeln!(stdout(), "|---|--:|---|--:|--:|--:|--:|---|--:|")?;
    let (mut sound, mut written) = (true, Ok(()));
    each_choice(options.rounds(), |choice| {
        let is_good = choice.over_best() <= MOST_OVER_BEST;
        sound &= is_good;
        let time = |engine| match choice.times.iter().find(|of| of.0 == engine) {
            Some((_, time)) => format!("{:.3}", Significant(*time)),
            None => "–".to_owned(),
        };
        let [clip, walk, raster, bvh] = [Engine::Clip, Engine::Walk, Engine::Raster, Engine::Bvh].map(time);
        let (Choice { shape, faces, rays, .. }, chosen) = (choice, choice.chosen.name());
        let verdict = if is_good { "" } else { " **OFF**" };
        let row = writeln!(
            stdout(),
            "| {shape} | {faces} | {rays} | {clip} | {walk} | {raster} | {bvh} | {chosen} | {:.2}{verdict} |",
            choice.over_best()
        );
        if written.is_ok() {
            written = row;
        }
    });
    written.map(|()| sound)
}

/// Time in a unit of which a second has `scale`, ratio, and speed-up of two threads.
fn write_figures(
    out: &mut impl Write,
    row: usize,
    entrants: &[Entrant],
    figures: &[Option<Figures>],
    scale: f64,
) -> Result<()> {
    let Some(own) = &figures[row] else { return write!(out, " – | – | – |") };
    let yardstick = entrants.iter().position(|entrant| entrant.name == YARDSTICK);
    let ratio = match yardstick.and_then(|row| figures[row].as_ref()) {
        Some(yardstick) => format!("{:.2}", yardstick.one_thread.ratio_to(&own.one_thread)),
        None => "–".to_owned(),
    };
    let speed_up = own.one_thread.ratio_to(&own.two_threads);
    write!(out, " {} | {ratio} | ×{speed_up:.2} |", with_spread(&own.one_thread, scale))
}

fn with_spread(samples: &Samples, scale: f64) -> String {
    format!("{:.4} ±{:.0} %", Significant(scale * samples.median()), 100.0 * samples.spread())
}

/// A number to as many significant digits as its precision says.
struct Significant(f64);

impl std::fmt::Display for Significant {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let before_point = 1 + self.0.abs().max(1.0).log10() as usize;
        let decimals = f.precision().unwrap_or(3).saturating_sub(before_point);
        write!(f, "{:.decimals$}", self.0)
    }
}

/// Whether the entrant's lengths are the judge's, as far as it claims.
fn write_check(out: &mut impl Write, entrant: &Entrant, rays: &str, figures: &Figures) -> Result<bool> {
    let check = &figures.check;
    let sound = check.mean_off_mm <= entrant.mean_tolerance_mm
        && (entrant.may_lose_rays || check.lost + check.invented == 0);
    let verdict = if sound { "" } else { " **OFF**" };
    writeln!(
        out,
        "| {} | {rays} | {:.6} | {:.1e} | {:.2} % | {} | {} | {:.1e}{verdict} |",
        entrant.name,
        check.mean_mm,
        check.mean_off_mm,
        100.0 * check.share_hit,
        check.lost,
        check.invented,
        check.worst_mm
    )?;
    Ok(sound)
}
