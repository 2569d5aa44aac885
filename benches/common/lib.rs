//! What the benchmarks share: bodies, the rays to them, and the contestants.
//!
//! ```text
//!   body ───► view   ─► RaySet::Grid  ─┐
//!        └──► random ─► RaySet::Batch ─┴─► Contestant::tracer ─► lengths of a region, mm
//! ```
//!
//! Engines of this crate enter in [`engines`], other crates in [`rivals`]; a row of the table is a line in [`field()`].

pub mod body;
pub mod choice;
pub mod engines;
pub mod machine;
pub mod organs;
pub mod race;
pub mod random;
pub mod rays;
pub mod rivals;
pub mod samples;
pub mod view;

use chordfield::exact::Engine;
use chordfield::geometry::{ClosedMesh, Region};
use engines::OneEngine;
use rays::RaySet;

/// Finds the lengths of a region's rays, mm, listed row by row, into a slice of zeros.
pub type Tracer<'a> = Box<dyn Fn(&Region, &mut [f64]) + Sync + 'a>;

/// A body as one engine or rival keeps it.
pub trait Contestant: Sync {
    /// Makes ready for a set of rays: what it costs is part of what tracing costs. `None` if the contestant does not take
    /// such a set, or takes longer with it than anybody would wait.
    fn tracer<'a>(&'a self, rays: &'a RaySet) -> Option<Tracer<'a>>;
}

/// A row of the table.
pub struct Entrant {
    /// Its name.
    pub name: &'static str,
    /// Builds the contestant from a body; timed.
    pub build: fn(&ClosedMesh) -> Box<dyn Contestant>,
    /// How far its mean length may lie from the first entrant's over the rays it has not lost, mm.
    pub mean_tolerance_mm: f64,
    /// Whether losing rays is a figure of the table, not a fault.
    pub may_lose_rays: bool,
}

/// The name of the entrant that all ratios are to.
pub const YARDSTICK: &str = "obvhs";

/// Lengths in f64 of one surface by different operations: γₙ of distances of 500 mm, more at silhouettes, averaged.
const F64_MEAN_TOLERANCE_MM: f64 = 1e-9;

/// Lengths in f32 of vertices rounded to f32: 2⁻²⁴ of 500 mm per crossing, averaged.
const F32_MEAN_TOLERANCE_MM: f64 = 1e-3;

/// Clipping costs three microseconds per ray and thousand faces: beyond this many nobody would wait for a million rays.
const MOST_CLIPPED_FACES: usize = 2000;

/// All who enter for a body of so many faces. The first that takes a set of rays judges the others.
pub fn field(faces: usize) -> Vec<Entrant> {
    let ours =
        |name, build| Entrant { name, build, mean_tolerance_mm: F64_MEAN_TOLERANCE_MM, may_lose_rays: false };
    let rival =
        |name, build, mean_tolerance_mm| Entrant { name, build, mean_tolerance_mm, may_lose_rays: true };
    let mut entrants = vec![
        ours("clip", |surface| Box::new(OneEngine::new(surface, Engine::Clip))),
        ours("bvh", |surface| Box::new(OneEngine::new(surface, Engine::Bvh))),
        ours("walk", |surface| Box::new(OneEngine::new(surface, Engine::Walk))),
        ours("raster", |surface| Box::new(OneEngine::new(surface, Engine::Raster))),
        rival(YARDSTICK, |surface| Box::new(rivals::Obvhs::new(surface)), F32_MEAN_TOLERANCE_MM),
        rival("parry3d", |surface| Box::new(rivals::Parry::new(surface)), F64_MEAN_TOLERANCE_MM),
    ];
    entrants.retain(|entrant| entrant.name != "clip" || faces <= MOST_CLIPPED_FACES);
    entrants
}
