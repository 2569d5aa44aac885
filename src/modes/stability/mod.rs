//! Numerical stability: every exact engine, along rays aimed at what is hard, against exact rationals.
//!
//! ```text
//!   Case ─► rays ─► engine ─► length ─┬─► longer or shorter than rounding explains?     every ray      ─► beyond, lost
//!                                     └─► less the length in exact rationals            a sample of them ─► error
//! ```
//!
//! # What rounding explains
//!
//! With u = 2⁻⁵³ and γₙ = nu / (1 − nu), each engine's length is exact for a surface that differs from the body's by a shift s
//! (the engines' own pages derive it):
//!
//! * `clip` finds a plane's crossing n·(v − o) / n·d by three differences, two scalar products of three terms and a quotient:
//!   exact for planes moved by γ₈ of their distance D to the source.
//! * `walk` and `bvh` round each vertex once into the line's frame, a difference, a product and a sum in three coordinates, and
//!   decide all else by exact signs: exact for vertices moved by γ₈ D.
//! * `raster` rounds each vertex once into the image; at a right angle, as here, by γ₉₆ D.
//! * Planes and vertices are one body but for the rounding of normals, γ₈ of its size, and for how far vertices stand out of
//!   planes, which is measured.
//!
//! A convex body whose surface moves by s at most lies between the two bodies parallel to it, all of whose planes are moved by
//! −s and +s, and so does its chord: **no length may be outside theirs**, at vertices, edges and outlines alike. (They are
//! clipped in f64 too, which the promise taken twice allows for.) From there follows what an error may be: a face seen at the
//! angle whose sine is a moves its end of the chord by s / a; a chord whose middle is h below the outline of a ball of radius R
//! is 2√(2Rh) long, and √(s / h) of that, relatively, is open; a tangent is hit or missed by chance, whole in the plane of a
//! flat side. So errors of 10⁻⁶ mm of tangents are no fault, and a vertex missed from outside of s is one. Bodies that are not
//! convex have no parallel ones. But a point farther than s from their surface is inside after a move if it was before: **no
//! length may differ from the exact one by more than the part of the ray that is within s of the surface.**
//!
//! A ray is **lost** if even the body moved inwards has a chord along it and the engine says 0.
//!
//! # What was found
//!
//! `cargo run --release --example stability` prints this; `-- 1e8` aims a hundred million rays, tells their count at the end, and
//! fails if one is lost. *Disagree* are lengths that
//! no rounding explains. Of the rays recomputed in rationals, against the exact planes for `clip` and the exact triangles for all
//! others, *open* are those whose length rounding may change by more than a millionth of the body's size: tangents, and rays in
//! flat sides, where engine and rationals may differ by the whole side. The error is the largest of all others, and the relative
//! one is in the length, or in a thousandth of the body's size where the chord is shorter.
//!
//! No length disagrees. Three faults were found so: rays lost by `bvh` along denormal directions, faces all but edge-on crossed
//! anywhere between their corners by `bvh`, and the same by `raster`, whose depths there are differences of huge numbers
//! (chords that began at such a face's edge were up to a micrometre too long).
//!
#![doc = include_str!("table.md")]

mod bodies;
mod cases;
mod judge;
mod table;

use std::ops::AddAssign;

use rayon::prelude::*;
use serde::Serialize;

use super::Control;
use super::audit::Archer;
use crate::error::Result;
use crate::exact::rational::{RationalChord, of_planes, of_triangles};
use crate::exact::{Body, Engine, Lengths};
use crate::geometry::{RayGrid, Segment, Upstream};

pub use bodies::{HARD_BODIES, HardBody};
pub use cases::Case;
pub use table::{table, totals};

/// The engines that are held to their promise.
pub const ENGINES: [Engine; 4] = [Engine::Clip, Engine::Walk, Engine::Raster, Engine::Bvh];

/// Rays aimed with one stream of random numbers.
const BLOCK: u64 = 1024;

/// Bodies of more faces than this are asked along fewer rays, in proportion: what a ray costs grows with the faces.
const FACES_AT_FULL_EFFORT: u64 = 500;

/// One ray of so many is an image of its own for the raster; and each that is recomputed.
const RASTER_SHARE: usize = 4;

/// Of the body's size: rounding that may change a length by more leaves it open.
const OPEN_SHARE: f64 = 1e-6;

/// How much is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Effort {
    /// Rays for each body and case; fewer of bodies with thousands of faces, and of those that are not convex, whose every ray
    /// is recomputed.
    pub rays: u64,
    /// Of those, recomputed in rationals.
    pub recomputed: u64,
    /// Of the random numbers.
    pub seed: u64,
}

impl Default for Effort {
    fn default() -> Self {
        Self { rays: 5_000, recomputed: 100, seed: 1 }
    }
}

impl Effort {
    /// The least effort by which a sweep of these bodies aims so many rays in all, or a few more.
    pub fn aiming<'a>(at_least: u64, bodies: impl IntoIterator<Item = &'a Body> + Clone, seed: u64) -> Self {
        let effort = |rays| Self { rays, seed, ..Self::default() };
        let suffices = |each: u64| rays(bodies.clone(), effort(each)) >= at_least;
        let (mut too_few, mut enough) = (0, 1_u64);
        while !suffices(enough) && enough < at_least {
            (too_few, enough) = (enough, enough.saturating_mul(2));
        }
        while enough - too_few > 1 {
            let middle = too_few + (enough - too_few) / 2;
            *(if suffices(middle) { &mut enough } else { &mut too_few }) = middle;
        }
        effort(enough)
    }

    fn of(self, body: &Body) -> Self {
        let faces = body.surface().mesh().faces.len() as u64;
        let share =
            |rays: u64| (rays.saturating_mul(FACES_AT_FULL_EFFORT) / faces.max(FACES_AT_FULL_EFFORT)).max(8);
        let recomputed = share(self.recomputed.min(self.rays));
        let rays = if body.convexity().is_ok() { share(self.rays) } else { recomputed };
        Self { rays, recomputed, ..self }
    }
}

/// What became of the rays of one case through one body by one engine.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Found {
    /// The body.
    pub body: String,
    /// The case.
    pub case: Case,
    /// The engine.
    pub engine: Engine,
    /// The figures.
    #[serde(flatten)]
    pub figures: Figures,
}

/// What became of rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Figures {
    /// How many there were.
    pub rays: u64,
    /// Disagreements: lengths that no rounding explains, lost rays among them.
    pub beyond: u64,
    /// Rays that surely meet the body and came out as 0.
    pub lost: u64,
    /// How many were recomputed in rationals.
    pub recomputed: u64,
    /// Of those, whose length rounding leaves open by more than a millionth of the body's size.
    pub open: u64,
    /// Of those again, hit by one and missed by the other.
    pub hit_or_missed: u64,
    /// The largest error of those recomputed and not open, mm.
    pub max_error_mm: f64,
    /// The largest share of the exact length, or of a thousandth of the body's size if that is more.
    pub max_relative_error: f64,
    /// The ray that is to blame for the first disagreement, else for the largest error: source and target, mm.
    pub worst_ray: Option<[[f64; 3]; 2]>,
}

impl Figures {
    /// Enters a length, and between which rounding explains it. `exact` is given for those recomputed.
    fn add(
        &mut self,
        body: &Body,
        ray: &Aimed,
        length_mm: f64,
        [least, most]: [f64; 2],
        exact: Option<&RationalChord>,
    ) {
        self.rays += 1;
        // Also what is not a number is beyond.
        if !(least <= length_mm && length_mm <= most) {
            if self.beyond == 0 {
                self.worst_ray = Some(ray.ends.map(|end| end.to_array()));
            }
            self.beyond += 1;
            self.lost += u64::from(least > 0.0 && length_mm == 0.0);
        }
        let Some(exact) = exact else { return };
        let exact_mm = exact.length_mm();
        self.recomputed += 1;
        if most - least > OPEN_SHARE * body.bounds().diagonal() {
            self.open += 1;
            self.hit_or_missed += u64::from((length_mm == 0.0) != (exact_mm == 0.0));
            return;
        }
        let error_mm =
            if length_mm.is_finite() { exact.rounding_of(length_mm).error_mm.abs() } else { f64::INFINITY };
        if error_mm > self.max_error_mm && self.beyond == 0 {
            self.worst_ray = Some(ray.ends.map(|end| end.to_array()));
        }
        self.max_error_mm = self.max_error_mm.max(error_mm);
        let scale_mm = exact_mm.max(1e-3 * body.bounds().diagonal());
        self.max_relative_error = self.max_relative_error.max(error_mm / scale_mm);
    }
}

impl AddAssign for Figures {
    fn add_assign(&mut self, other: Self) {
        let is_worse = (other.beyond > 0, other.max_error_mm) > (self.beyond > 0, self.max_error_mm);
        if (is_worse && !(self.beyond > 0 && other.beyond > 0)) || self.worst_ray.is_none() {
            self.worst_ray = other.worst_ray;
        }
        self.rays += other.rays;
        self.beyond += other.beyond;
        self.lost += other.lost;
        self.recomputed += other.recomputed;
        self.open += other.open;
        self.hit_or_missed += other.hit_or_missed;
        self.max_error_mm = self.max_error_mm.max(other.max_error_mm);
        self.max_relative_error = self.max_relative_error.max(other.max_relative_error);
    }
}

/// How many rays a sweep of these bodies aims in all.
pub fn rays<'a>(bodies: impl IntoIterator<Item = &'a Body>, effort: Effort) -> u64 {
    bodies.into_iter().map(|body| effort.of(body).rays * Case::ALL.len() as u64).sum()
}

/// Sweeps all cases through a body called `name`, by every engine that serves it. The same for any number of threads.
///
/// # Errors
/// [`Error::Interrupted`](crate::Error::Interrupted) within a block's time of a request to stop.
pub fn sweep(name: &str, body: &Body, effort: Effort, control: &Control) -> Result<Vec<Found>> {
    let effort = effort.of(body);
    let blocks = effort.rays.div_ceil(BLOCK);
    let jobs = Case::ALL.len() as u64 * blocks;
    let of_jobs: Vec<[Figures; ENGINES.len()]> = (0..jobs)
        .into_par_iter()
        .map(|job| {
            control.check()?;
            let (case, block) = (Case::ALL[(job / blocks) as usize], job % blocks);
            let rays = aim(body, case, effort, job, block);
            let figures = trace_block(body, &rays, effort.recomputed.saturating_sub(block * BLOCK));
            control.advance(BLOCK.min(effort.rays - block * BLOCK));
            Ok(figures)
        })
        .collect::<Result<_>>()?;
    let of_case = |(case, blocks): (Case, &[[Figures; ENGINES.len()]])| {
        let of_engine = |(i, engine): (usize, Engine)| {
            let mut figures = Figures::default();
            blocks.iter().for_each(|block| figures += block[i]);
            Found { body: name.to_owned(), case, engine, figures }
        };
        ENGINES
            .into_iter()
            .enumerate()
            .map(of_engine)
            .filter(|found| found.figures.rays > 0)
            .collect::<Vec<_>>()
    };
    Ok(Case::ALL.into_iter().zip(of_jobs.chunks(blocks.max(1) as usize)).flat_map(of_case).collect())
}

/// A ray as it was aimed.
struct Aimed {
    ends: [glam::DVec3; 2],
    segment: Segment,
}

fn aim(body: &Body, case: Case, effort: Effort, stream: u64, block: u64) -> Vec<Aimed> {
    let mut archer = Archer::of_block(effort.seed, stream);
    let ray = |_| {
        let ends = case.ray(body, &mut archer)?;
        Some(Aimed { ends, segment: Segment::between(ends[0], ends[1])? })
    };
    (0..BLOCK.min(effort.rays - block * BLOCK)).filter_map(ray).collect()
}

/// By engine; of the first `recomputed` rays with the exact lengths.
fn trace_block(body: &Body, rays: &[Aimed], recomputed: u64) -> [Figures; ENGINES.len()] {
    let segments: Vec<Segment> = rays.iter().map(|ray| ray.segment).collect();
    let exact = rays.iter().take(recomputed as usize).map(|Aimed { segment, .. }| {
        let planes =
            body.convexity().ok().map(|convex| of_planes(convex, segment.line()).within(&segment.reach()));
        (planes, of_triangles(body.surface(), segment.line()).within(&segment.reach()))
    });
    let exact: Vec<(Option<RationalChord>, RationalChord)> = exact.collect();
    let explained = judge::Explained::new(body, &segments);
    ENGINES.map(|engine| {
        let mut figures = Figures::default();
        if !engine.serves(body) {
            return figures;
        }
        let lengths = match engine {
            // Each ray is an image of its own, and dear.
            Engine::Raster => {
                let share = exact.len().max(rays.len() / RASTER_SHARE);
                rays.iter().take(share).map(|ray| length_by_raster(body, ray)).collect()
            }
            _ => {
                let mut lengths = vec![0.0; segments.len()];
                body.trace(engine, 0, &segments, &mut Lengths(&mut lengths));
                lengths
            }
        };
        for (i, (ray, length_mm)) in rays.iter().zip(lengths).enumerate() {
            let exact = exact.get(i).map(|(planes, triangles)| match (engine, planes) {
                (Engine::Clip, Some(planes)) => planes,
                _ => triangles,
            });
            let between = explained.by_rounding(engine, i, exact);
            figures.add(body, ray, length_mm, between, exact);
        }
        figures
    })
}

/// As the one pixel of an image across the ray.
fn length_by_raster(body: &Body, ray: &Aimed) -> f64 {
    let [source, target] = ray.ends;
    let (u, v) = ray.segment.line().dir().any_orthonormal_pair();
    let step = 1e-2 * body.bounds().diagonal();
    let Some(grid) = RayGrid::new(Upstream::Source(source), target, [step * u, step * v], [1, 1]) else {
        return f64::NAN;
    };
    let mut length = [0.0];
    body.view(&grid, Some(Engine::Raster)).trace(&grid.whole(), &mut Lengths(&mut length));
    length[0]
}
