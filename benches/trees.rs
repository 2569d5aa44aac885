//! Trees of squared chords, and the paper's, against the exact engines: one thread, all in turns.
//!
//! Each tolerance is run until it is told what it costs and how far it is off: the mean error as a share of the mean chord, the
//! share of lengths within the tolerance, and the largest error in tolerances. Trees are built within the time, unless a column
//! says warm; what a body needs once (its proofs, and the walker's tables) is not in any engine's.
//!
//! `cargo bench --bench trees -- [--quick] [20480] [327680] [organs] [600] [2048] [orbit] [random] [quadrilinear] [0.5mm …]`

use std::io::{Result, Write, stdout};
use std::time::Instant;

use chordfield::attributes::chord::ChordLength;
use chordfield::attributes::squared_chord::{ImageChords, Known, SquaredChord};
use chordfield::exact::{Body, Engine, Lengths};
use chordfield::geometry::{RayGrid, Segment};
use chordfield::modes::project::DEFAULT_TOLERANCE_MM;
use chordfield::ritree::{Answer, Cache, FittedTree, Parameters, RiTree};
use common::body::Ellipsoid;
use common::organs::Organs;
use common::view::{Frame, SOURCE_DISTANCE_MM};
use common::{machine, random, view};
use glam::{DQuat, DVec3};

/// Subdivisions of the bodies, by their faces.
const BODIES: [(&str, u32); 2] = [("20480", 5), ("327680", 7)];

const TOLERANCES_MM: [f64; 5] = [0.1, 0.2, 0.5, 1.0, 2.0];
const THRESHOLDS: [f64; 3] = [0.05, 0.01, 0.002];
const ROUNDS: usize = 5;
const ROOMY: usize = 1 << 30;

/// What to run, from the command line.
struct Options {
    quick: bool,
    only: Vec<String>,
}

impl Options {
    fn wants(&self, name: &str, group: &[&str]) -> bool {
        let is_named = |name: &str| self.only.iter().any(|only| only == name);
        is_named(name) || !group.iter().any(|name| is_named(name))
    }

    /// The tolerances named, or all.
    fn tolerances_mm(&self) -> Vec<f64> {
        let named: Vec<f64> =
            self.only.iter().filter_map(|only| only.strip_suffix("mm")?.parse().ok()).collect();
        if named.is_empty() { TOLERANCES_MM.to_vec() } else { named }
    }
}

fn main() -> Result<()> {
    let (flags, only): (Vec<_>, Vec<_>) = std::env::args().skip(1).partition(|a| a.starts_with("--"));
    let options = Options { quick: flags.iter().any(|flag| flag == "--quick"), only };
    let out = &mut stdout().lock();
    writeln!(out, "{}", machine::heading())?;
    let scenes = ["20480", "327680", "organs"];
    if options.wants("organs", &scenes) {
        organs(out, if options.quick { 36 } else { 360 })?;
    }
    for (faces, subdivisions) in BODIES {
        if !options.wants(faces, &scenes) {
            continue;
        }
        let body = Body::new(Ellipsoid::BENCH.surface(subdivisions));
        body.walker();
        writeln!(out, "\n## An ellipsoid of {faces} faces\n")?;
        writeln!(
            out,
            "| rays | exact, ms | interpolation | cold, ms | × | warm, ms | × | traced | mean error / chord | within | worst / tolerance | leaves | MB |"
        )?;
        writeln!(out, "|---|--:|---|--:|--:|--:|--:|--:|--:|--:|--:|--:|--:|")?;
        let all = ["600", "2048", "orbit", "random", "quadrilinear"];
        let tolerances = &options.tolerances_mm();
        for size in [600, 2048] {
            if options.wants(&size.to_string(), &all) && !(options.quick && size == 2048) {
                let grid = view::window(body.surface().mesh(), size);
                views(out, &format!("{size}²"), &body, &[grid], tolerances)?;
            }
        }
        if options.wants("quadrilinear", &all) {
            quadrilinear(out, "600²", &body, &view::window(body.surface().mesh(), 600))?;
        }
        if options.wants("orbit", &all) {
            let count = if options.quick { 36 } else { 360 };
            views(out, &format!("{count} × 512²"), &body, &orbit(&body, count), tolerances)?;
        }
        if options.wants("random", &all) {
            random_rays(out, &body, if options.quick { 1_000_000 } else { 10_000_000 }, tolerances)?;
        }
    }
    Ok(())
}

/// Views from all around, each in its own window.
fn orbit(body: &Body, count: u32) -> Vec<RayGrid> {
    let axis = DVec3::new(0.2, 0.3, 1.0).normalize();
    let around = |i: u32| {
        let turn = DQuat::from_axis_angle(axis, std::f64::consts::TAU * f64::from(i) / f64::from(count));
        let source = turn * (SOURCE_DISTANCE_MM * axis.any_orthonormal_vector());
        Frame::along(source, axis).window([body.surface().mesh()], 512)
    };
    (0..count).map(around).collect()
}

fn seconds(task: impl FnOnce()) -> f64 {
    let start = Instant::now();
    task();
    start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_unstable_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Errors of lengths.
#[derive(Default)]
struct Errors {
    count: u64,
    sum: f64,
    chords: f64,
    beyond: u64,
    worst: f64,
}

impl Errors {
    fn add(&mut self, lengths: &[f64], exact: &[f64], tolerance: f64) {
        for (length, exact) in lengths.iter().zip(exact).filter(|(a, b)| **a > 0.0 || **b > 0.0) {
            let error = (length - exact).abs();
            self.count += 1;
            self.sum += error;
            self.chords += exact;
            self.beyond += u64::from(error > tolerance);
            self.worst = self.worst.max(error);
        }
    }

    fn cells(&self, tolerance: f64) -> String {
        format!(
            "{:.4} % | {:.3} % | {:.2}",
            100.0 * self.sum / self.chords,
            100.0 - 100.0 * self.beyond as f64 / self.count as f64,
            self.worst / tolerance
        )
    }
}

fn views(
    out: &mut impl Write,
    name: &str,
    body: &Body,
    grids: &[RayGrid],
    tolerances_mm: &[f64],
) -> Result<()> {
    let pixels = grids[0].whole().pixels();
    let rounds = if grids.len() > 1 { 1 } else { ROUNDS };
    let raster = |grid: &RayGrid, lengths: &mut [f64]| {
        lengths.fill(0.0);
        body.view(grid, Some(Engine::Raster)).trace(&grid.whole(), &mut Lengths(lengths));
    };
    for &tolerance in tolerances_mm {
        let (mut exact, mut lengths) = (vec![0.0; pixels], vec![0.0; pixels]);
        let (mut exact_s, mut cold_s, mut warm_s) = (Vec::new(), Vec::new(), Vec::new());
        let (mut errors, mut traced, mut tree) = (Errors::default(), 0, None);
        let cache = Cache::new(ROOMY);
        let mut runs = Vec::new();
        for _ in 0..rounds {
            exact_s.push(seconds(|| grids.iter().for_each(|grid| raster(grid, &mut exact))));
            let mut find = |tree: &FittedTree<SquaredChord>| {
                for grid in grids {
                    runs.clear();
                    let image = ImageChords::new(tree.fit(), grid).expect("the source is outside");
                    image.trace(tree, &grid.whole(), &cache, &mut lengths, &mut runs);
                }
            };
            cold_s.push(seconds(|| {
                let grown = FittedTree::new(SquaredChord::new(body, tolerance, false).expect("convex"));
                find(&grown);
                tree = Some(grown);
            }));
            warm_s.push(seconds(|| find(tree.as_ref().expect("grown"))));
        }
        let tree = tree.expect("grown");
        for grid in grids.iter().step_by(grids.len().div_ceil(12)) {
            runs.clear();
            ImageChords::new(tree.fit(), grid).expect("as before").trace(
                &tree,
                &grid.whole(),
                &cache,
                &mut lengths,
                &mut runs,
            );
            raster(grid, &mut exact);
            errors.add(&lengths, &exact, tolerance);
            traced += runs.iter().map(|run| run.1.len()).sum::<usize>();
        }
        let (exact_s, cold_s, warm_s) = (median(exact_s), median(cold_s), median(warm_s));
        let shape = tree.shape();
        writeln!(
            out,
            "| {name} | raster {:.2} | {tolerance} mm | {:.2} | {:.2} | {:.2} | {:.2} | {:.2} % | {} | {} | {:.2} |",
            1e3 * exact_s,
            1e3 * cold_s,
            exact_s / cold_s,
            1e3 * warm_s,
            exact_s / warm_s,
            100.0 * traced as f64 / errors.count as f64,
            errors.cells(tolerance),
            shape.smooth_leaves + shape.empty_leaves + shape.traced_leaves,
            tree_megabytes(&tree),
        )?;
        out.flush()?;
    }
    Ok(())
}

/// Twenty organs on an orbit at the tolerance that nobody need name: what their trees hold.
fn organs(out: &mut impl Write, views: u32) -> Result<()> {
    let organs = Organs::new(512);
    let bodies: Vec<Body> = organs.surfaces.iter().cloned().map(Body::new).collect();
    let cache = Cache::new(ROOMY);
    let new = |body| FittedTree::new(SquaredChord::new(body, DEFAULT_TOLERANCE_MM, false).expect("convex"));
    let trees: Vec<_> = bodies.iter().map(new).collect();
    let mut lengths = vec![0.0; organs.grid.whole().pixels()];
    let mut runs = Vec::new();
    let mut orbit_s = || {
        seconds(|| {
            for grid in organs.orbit(views) {
                for tree in &trees {
                    runs.clear();
                    let image = ImageChords::new(tree.fit(), &grid).expect("the source is outside");
                    image.trace(tree, &grid.whole(), &cache, &mut lengths, &mut runs);
                }
            }
        })
    };
    let (cold_s, warm_s) = (orbit_s(), orbit_s());
    let megabytes: f64 = trees.iter().map(tree_megabytes).sum();
    writeln!(
        out,
        "\n{} organs of {} faces, {views} views of 512², {DEFAULT_TOLERANCE_MM} mm: {megabytes:.1} MB of trees; cold {cold_s:.2} s, warm {warm_s:.2} s",
        bodies.len(),
        bodies[0].surface().mesh().faces.len(),
    )
}

fn tree_megabytes(tree: &FittedTree<SquaredChord>) -> f64 {
    let mut stamps = Vec::new();
    tree.collect_stamps(&mut stamps);
    stamps.iter().map(|s| s.1).sum::<usize>() as f64 / 1e6
}

/// The paper's tree on one view, ray by ray; what it does not know is walked.
fn quadrilinear(out: &mut impl Write, name: &str, body: &Body, grid: &RayGrid) -> Result<()> {
    let pixels = grid.whole().pixels();
    let mut exact = vec![0.0; pixels];
    body.view(grid, Some(Engine::Raster)).trace(&grid.whole(), &mut Lengths(&mut exact));
    for distance_threshold in THRESHOLDS {
        let parameters = Parameters { distance_threshold, ..Parameters::default() };
        let cache = Cache::new(ROOMY);
        let tree = RiTree::new(ChordLength::new(body).expect("convex"), parameters);
        let mut lengths = vec![0.0; pixels];
        let mut traced = 0;
        let mut find = || {
            let whole = grid.whole();
            let rays = whole.places().map(|(c, r)| grid.segment(c, r));
            traced = find_by(rays, body, &mut lengths, |ray| {
                let point = tree.attribute().space().point_of(ray.line());
                match tree.query(point, &cache) {
                    None | Some(Answer::Interpolated(None)) => Some(0.0),
                    Some(Answer::Interpolated(Some(chord))) => Some(f64::from(chord.length_mm)),
                    Some(Answer::Trace(_)) => None,
                }
            });
        };
        let (cold_s, warm_s) = (seconds(&mut find), seconds(&mut find));
        let mut errors = Errors::default();
        errors.add(&lengths, &exact, 1.0);
        writeln!(
            out,
            "| {name} | | quadrilinear {distance_threshold} | {:.2} | | {:.2} | | {:.2} % | {} (of 1 mm) | {} | {:.2} |",
            1e3 * cold_s,
            1e3 * warm_s,
            100.0 * traced as f64 / errors.count as f64,
            errors.cells(1.0),
            tree.shape().leaves_by_depth.iter().sum::<u64>(),
            cache.used_bytes() as f64 / 1e6,
        )?;
        out.flush()?;
    }
    Ok(())
}

/// Finds lengths ray by ray, and walks those that are not known; how many those are.
fn find_by(
    rays: impl Iterator<Item = Segment>,
    body: &Body,
    lengths: &mut [f64],
    mut known: impl FnMut(&Segment) -> Option<f64>,
) -> usize {
    let (mut open, mut open_rays) = (Vec::new(), Vec::new());
    for (i, ray) in rays.enumerate() {
        match known(&ray) {
            Some(length) => lengths[i] = length,
            None => {
                open.push(i);
                open_rays.push(ray);
            }
        }
    }
    let mut traced = vec![0.0; open.len()];
    body.trace(Engine::Walk, 0, &open_rays, &mut Lengths(&mut traced));
    open.iter().zip(&traced).for_each(|(&i, &length)| lengths[i] = length);
    open.len()
}

/// Rays in no order, in batches.
fn random_rays(out: &mut impl Write, body: &Body, count: usize, tolerances_mm: &[f64]) -> Result<()> {
    let rays = random::rays(count);
    let mut exact = vec![0.0; count];
    let walk_s = seconds(|| body.trace(Engine::Walk, 0, &rays, &mut Lengths(&mut exact)));
    for &tolerance in tolerances_mm {
        let tree = FittedTree::new(SquaredChord::new(body, tolerance, false).expect("convex"));
        let cache = Cache::new(ROOMY);
        let mut lengths = vec![0.0; count];
        let mut traced = 0;
        let mut find = || {
            traced = 0;
            let (mut open, mut open_rays, mut lengths_of_open) = (Vec::new(), Vec::new(), Vec::new());
            for (rays, lengths) in rays.chunks(4096).zip(lengths.chunks_mut(4096)) {
                open.clear();
                open_rays.clear();
                let lines = rays.iter().map(Segment::line).enumerate();
                SquaredChord::ask_all(&tree, lines, &cache, |i, line, asked| {
                    let known = asked
                        .map_or(Known::Miss, |(leaf, pair, stuv)| tree.fit().known(leaf, line, pair, stuv));
                    match known {
                        Known::Miss => lengths[i] = 0.0,
                        Known::Length(length) => lengths[i] = length,
                        Known::Nothing => {
                            open.push(i);
                            open_rays.push(rays[i]);
                        }
                    }
                });
                traced += open.len();
                lengths_of_open.clear();
                lengths_of_open.resize(open.len(), 0.0);
                body.trace(Engine::Walk, 0, &open_rays, &mut Lengths(&mut lengths_of_open));
                open.iter().zip(&lengths_of_open).for_each(|(&i, &length)| lengths[i] = length);
            }
        };
        let (cold_s, warm_s) = (seconds(&mut find), seconds(&mut find));
        let mut errors = Errors::default();
        errors.add(&lengths, &exact, tolerance);
        writeln!(
            out,
            "| {count} random | walk {:.0} | {tolerance} mm | {:.0} | {:.2} | {:.0} | {:.2} | {:.2} % | {} | {} | {:.2} |",
            1e3 * walk_s,
            1e3 * cold_s,
            walk_s / cold_s,
            1e3 * warm_s,
            walk_s / warm_s,
            100.0 * traced as f64 / errors.count as f64,
            errors.cells(tolerance),
            tree.shape().smooth_leaves,
            tree_megabytes(&tree),
        )?;
        out.flush()?;
    }
    Ok(())
}
