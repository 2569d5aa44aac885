//! How cost grows with faces, pixels, views, organs, threads and the cache.
//!
//! | study | scene | image |
//! |---|---|---|
//! | faces | one ellipsoid of ever more faces | one view, 600 × 600 |
//! | pixels | one ellipsoid of 20 000 faces | one square view, ever finer |
//! | views | one ellipsoid of 5 000 faces | an orbit of ever more views, 256 × 256 |
//! | organs | ever more ellipsoids of 2 000 faces on a grid | one view, 600 × 600 |
//! | threads | 27 ellipsoids of 5 000 faces | one view, 1024 × 1024 |
//! | cache | one ellipsoid of 2 000 faces, in a tree | one view, 256 × 256 |
//!
//! Exponents are slopes of straight lines through the logarithms of the upper half of the sizes, by least squares: cost ∝
//! size^exponent. Where a run would take a minute is told by the straight line through the last two sizes' times.

mod plan;

use std::time::Instant;

use serde::Serialize;

use super::machine::held_bytes;
use super::race::race;
use super::{Machine, Patience, Program, Run, Times, run};
use crate::error::{Error, Result};
use crate::modes::Control;
use crate::scene::{Folder, Scene, SceneText, View};
use plan::{PLANS, Plan};

/// Where time is said to stop: a run of so many seconds.
const END_OF_PATIENCE_S: f64 = 60.0;

/// How far the studies go.
#[derive(Clone, Debug, PartialEq)]
pub struct ScaleSettings {
    /// How long each point may take.
    pub patience: Patience,
    /// Only the first points of each study.
    pub quick: bool,
    /// The studies to run, by their [names](study_names); all if none is named.
    pub studies: Vec<String>,
}

/// What the studies are called.
pub fn study_names() -> impl Iterator<Item = &'static str> {
    PLANS.iter().map(Plan::short_name)
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct ScaleReport {
    /// The program.
    #[serde(flatten)]
    pub program: Program,
    /// The command line; set by whoever knows it.
    pub command: String,
    /// Where it was measured.
    pub machine: Machine,
    /// The studies, in order.
    pub studies: Vec<Study>,
    /// Whether all that was to be measured was; not so after an interruption.
    pub complete: bool,
}

/// Cost as one quantity grows.
#[derive(Clone, Debug, Serialize)]
pub struct Study {
    /// What grows.
    pub name: &'static str,
    /// What else there is.
    pub setup: String,
    /// Measurements: by size, then by method.
    pub rows: Vec<ScaleRow>,
    /// Exponents by method.
    pub fits: Vec<Fit>,
}

/// One method at one size.
#[derive(Clone, Debug, Serialize)]
pub struct ScaleRow {
    /// Of what grows.
    pub size: f64,
    /// The options that choose the method.
    pub options: String,
    /// From the scene as read to the last length.
    pub cold: Times,
    /// The same views again.
    pub warm: Times,
    /// Seconds to read, build and check the scene, once.
    pub load_s: f64,
    /// By how much reading the scene made the process grow, bytes, where the system tells and memory was not reused.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scene_bytes: Option<u64>,
    /// Bytes of trees after the views.
    pub tree_bytes: usize,
    /// Cells of trees looked at, cold and warm: where the cache is too small, the same ones again.
    pub tree_cells: u64,
}

/// A straight line through logarithms.
#[derive(Clone, Debug, Serialize)]
pub struct Fit {
    /// The options that choose the method.
    pub options: String,
    /// Cost from cold grows with this power of the size.
    pub cold_exponent: f64,
    /// The same once warm.
    pub warm_exponent: f64,
    /// The size at which a run from cold takes a minute, if every further unit costs what it did between the last two sizes.
    /// None where cost shrinks.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_at_a_minute: Option<f64>,
    /// The size at which the scene fills the memory that the system has left, at the last size's bytes per unit.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub size_at_full_memory: Option<f64>,
}

/// How many turns [`scale`] takes at most, for its progress.
pub fn turns(settings: &ScaleSettings) -> u64 {
    let turns = |plan: &Plan| {
        let sizes = sizes(plan, settings);
        sizes.iter().map(|&s| (plan.contenders)(s).len() * (settings.patience.rounds + 1)).sum::<usize>()
    };
    PLANS.iter().map(turns).sum::<usize>() as u64
}

fn sizes(plan: &Plan, settings: &ScaleSettings) -> Vec<u32> {
    if !settings.studies.is_empty() && !settings.studies.iter().any(|name| name == plan.short_name()) {
        return Vec::new();
    }
    let count = if settings.quick { plan.quick_sizes } else { plan.sizes.len() };
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let is_there = |&&size: &&u32| plan.threads.is_none_or(|threads| threads(size) <= cores);
    plan.sizes.iter().take(count).filter(is_there).copied().collect()
}

/// Runs all studies. An interruption ends them with what there is.
///
/// # Errors
/// Threads that the system does not give.
pub fn scale(settings: &ScaleSettings, control: &Control) -> Result<ScaleReport> {
    let mut report = ScaleReport {
        program: Program::THIS,
        command: String::new(),
        machine: Machine::this(),
        studies: Vec::new(),
        complete: true,
    };
    for plan in &PLANS {
        let mut study =
            Study { name: plan.name, setup: plan.setup.into(), rows: Vec::new(), fits: Vec::new() };
        let ended = measure(plan, settings, control, &mut study);
        if plan.is_fitted {
            study.fits = fits(&study.rows, report.machine.available_bytes);
        }
        if !study.rows.is_empty() {
            report.studies.push(study);
        }
        match ended {
            Err(Error::Interrupted) => {
                report.complete = false;
                break;
            }
            other => other?,
        }
    }
    Ok(report)
}

fn measure(plan: &Plan, settings: &ScaleSettings, control: &Control, study: &mut Study) -> Result<()> {
    for size in sizes(plan, settings) {
        control.check()?;
        let (start, held) = (Instant::now(), held_bytes());
        let text = SceneText::new(format!("{}.toml", plan.name), (plan.scene)(size));
        let mut scene = Scene::build(&text, &Folder::none())?;
        let load_s = start.elapsed().as_secs_f64();
        let scene_bytes = held_bytes().zip(held).and_then(|(now, before)| now.checked_sub(before));
        let views: Vec<View> = scene.beam.views()?;
        let contenders = (plan.contenders)(size);
        let mut trees = vec![(0, 0); contenders.len()];
        let pool = plan.threads.map(|threads| pool(threads(size))).transpose()?;
        let results = race(contenders.len(), settings.patience, control, |i| {
            let mut once = || run(&mut scene, contenders[i].method, &views, control);
            let Run { cold, warm, tree_bytes, cells } = match &pool {
                Some(pool) => pool.install(once),
                None => once(),
            }?;
            trees[i] = (tree_bytes, cells);
            Ok([cold, warm])
        })?;
        for ((contender, [cold, warm]), (tree_bytes, tree_cells)) in
            contenders.iter().zip(&results.times).zip(trees)
        {
            if !cold.0.is_empty() {
                study.rows.push(ScaleRow {
                    size: (plan.measure)(size),
                    options: contender.options(),
                    cold: cold.times(),
                    warm: warm.times(),
                    load_s,
                    scene_bytes,
                    tree_bytes,
                    tree_cells,
                });
            }
        }
        if results.interrupted {
            return Err(Error::Interrupted);
        }
    }
    Ok(())
}

fn pool(threads: usize) -> Result<rayon::ThreadPool> {
    let built = rayon::ThreadPoolBuilder::new().num_threads(threads).build();
    built.map_err(|e| Error::input(format!("{threads} threads"), e.to_string(), "close other programs"))
}

/// The options of the methods that were measured, each once, in the order of their first rows.
pub fn methods(rows: &[ScaleRow]) -> Vec<&str> {
    let mut methods: Vec<&str> = Vec::new();
    for row in rows {
        if !methods.contains(&row.options.as_str()) {
            methods.push(&row.options);
        }
    }
    methods
}

/// A fit for each method that was measured at two sizes or more.
fn fits(rows: &[ScaleRow], available_bytes: Option<u64>) -> Vec<Fit> {
    let fit = |options: &str| {
        let own: Vec<&ScaleRow> = rows.iter().filter(|row| row.options == options).collect();
        let points =
            |time: fn(&ScaleRow) -> f64| own.iter().map(move |r| [r.size, time(r)]).collect::<Vec<_>>();
        let cold = points(|row| row.cold.seconds);
        let (last, upper) = (own.last()?, own.len() / 2);
        let upper = upper.min(own.len().saturating_sub(2));
        let cold_exponent = exponent(&cold[upper..])?;
        let [[size, seconds], [next_size, next_seconds]] = *cold.last_chunk()?;
        let per_unit = (next_seconds - seconds) / (next_size - size);
        let size_at_a_minute =
            (per_unit > 0.0).then(|| next_size + (END_OF_PATIENCE_S - next_seconds) / per_unit);
        let bytes_each = last.scene_bytes.filter(|&bytes| bytes > 1 << 20).map(|b| b as f64 / last.size);
        Some(Fit {
            options: options.into(),
            cold_exponent,
            warm_exponent: exponent(&points(|row| row.warm.seconds)[upper..])?,
            size_at_a_minute,
            size_at_full_memory: bytes_each.zip(available_bytes).map(|(each, all)| all as f64 / each),
        })
    };
    methods(rows).into_iter().filter_map(fit).collect()
}

/// The slope of the straight line through the logarithms of points, by least squares. `None` of fewer than two sizes.
fn exponent(points: &[[f64; 2]]) -> Option<f64> {
    let logs: Vec<[f64; 2]> = points.iter().map(|p| p.map(f64::ln)).collect();
    let mean = |i: usize| logs.iter().map(|p| p[i]).sum::<f64>() / logs.len() as f64;
    let (x, y) = (mean(0), mean(1));
    let (mut above, mut below) = (0.0, 0.0);
    for p in &logs {
        above += (p[0] - x) * (p[1] - y);
        below += (p[0] - x) * (p[0] - x);
    }
    (below > 0.0).then(|| above / below)
}

#[cfg(test)]
mod tests {
    use super::super::Samples;
    use super::*;

    fn row(size: f64, seconds: f64) -> ScaleRow {
        let times = Samples(vec![seconds; 3]).times();
        ScaleRow {
            size,
            options: "--method walk".into(),
            cold: times,
            warm: times,
            load_s: 1.0,
            scene_bytes: Some((size * 1e7) as u64),
            tree_bytes: 0,
            tree_cells: 0,
        }
    }

    #[test]
    fn exponents_are_those_of_powers_and_ends_lie_on_straight_lines() {
        let rows: Vec<ScaleRow> = [1.0, 2.0, 4.0, 8.0].map(|x: f64| row(x, 0.01 * x.powf(1.5))).into();
        let affine: Vec<ScaleRow> = [1.0, 2.0, 4.0].map(|x: f64| row(x, 1.0 + x)).into();
        assert!((fits(&affine, None)[0].size_at_a_minute.expect("it grows") - 59.0).abs() < 1e-9);
        let fit = &fits(&rows, Some(1_000_000_000))[0];
        assert!((fit.cold_exponent - 1.5).abs() < 1e-12 && (fit.warm_exponent - 1.5).abs() < 1e-12);
        assert!((fit.size_at_full_memory.expect("bytes are known") - 100.0).abs() < 1e-6);
        assert!(fits(&rows[..1], None).is_empty(), "one size has no slope");
        let shrinking: Vec<ScaleRow> = [1.0, 2.0].map(|x: f64| row(x, 1.0 / x)).into();
        assert_eq!(fits(&shrinking, None)[0].size_at_a_minute, None);
    }

    #[test]
    fn the_scenes_of_all_plans_are_scenes() {
        for plan in &PLANS {
            let text = (plan.scene)(plan.sizes[0]);
            let scene = Scene::build(&SceneText::new("scale.toml", text), &Folder::none());
            let scene = scene.unwrap_or_else(|e| panic!("{}: {e}", plan.name));
            assert!(!scene.beam.views().expect("views").is_empty());
            assert!(!(plan.contenders)(plan.sizes[0]).is_empty());
        }
        let orbit = Scene::build(&SceneText::new("a", (PLANS[2].scene)(16)), &Folder::none());
        assert_eq!(orbit.expect("a scene").beam.views().expect("views").len(), 16);
    }
}
