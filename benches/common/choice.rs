//! Whether the engine that is taken unasked is the quickest: over bodies of few and of many faces, convex and not, images of few
//! and of many pixels, and rays in no order, in a batch and one by one.

use std::hint::black_box;
use std::time::Instant;

use chordfield::exact::{Body, Engine, Lengths};
use chordfield::geometry::Segment;
use chordfield::geometry::primitives::icosphere;
use glam::{DMat3, DVec3};

use crate::body::{Ellipsoid, HALF_AXES_MM, closed};
use crate::rays::RaySet;
use crate::{MOST_CLIPPED_FACES, random, view};

/// Sides of the images.
const SIDES: [u32; 3] = [64, 600, 2048];

/// Rays in no order.
const BATCH: usize = 100_000;

/// Engines that trace ray by ray trace about so many; as many in each part of the set.
const ENOUGH: usize = 40_000;

/// Parts of a set of rays that are traced or left out, at most.
const PARTS: u32 = 64;

/// Rows of a part of an image, at least: the program's tiles have some, too.
const PART_ROWS: u32 = 32;

/// Fewer parts would not stand for all: there are more misses at the top of an image than in its middle.
const FEWEST_PARTS: usize = 6;

/// What is asked of a body.
enum Asked {
    /// The lengths of rays, all at once.
    AtOnce(RaySet),
    /// The parts of each ray's line.
    OneByOne(Vec<Segment>),
}

/// The engines' times for one body and one set of rays.
pub struct Choice {
    /// What the body is.
    pub shape: &'static str,
    /// How many faces it has.
    pub faces: usize,
    /// What the rays are.
    pub rays: String,
    /// Nanoseconds a ray, medians, of each engine that serves.
    pub times: Vec<(Engine, f64)>,
    /// The engine taken unasked.
    pub chosen: Engine,
}

impl Choice {
    /// The chosen engine's time over the quickest one's.
    pub fn over_best(&self) -> f64 {
        let best = self.times.iter().map(|of| of.1).fold(f64::INFINITY, f64::min);
        let own = self.times.iter().find(|of| of.0 == self.chosen).map_or(f64::INFINITY, |of| of.1);
        own / best
    }
}

/// Times all engines for all bodies and sets of rays, and hands each choice on as soon as it is there.
pub fn each_choice(rounds: usize, mut each: impl FnMut(&Choice)) {
    for subdivisions in 0..=7 {
        for (shape, body) in bodies(subdivisions) {
            let mesh = body.surface().mesh().clone();
            let images = SIDES.map(|side| (format!("{side}²"), RaySet::Grid(view::window(&mesh, side))));
            let batch = ("random".to_owned(), RaySet::Batch(random::rays(BATCH)));
            let sets = images.into_iter().chain([batch]).map(|(name, set)| (name, Asked::AtOnce(set)));
            let lines = ("one by one".to_owned(), Asked::OneByOne(random::rays(ENOUGH)));
            for (rays, asked) in sets.chain([lines]) {
                let serving = [Engine::Clip, Engine::Walk, Engine::Raster, Engine::Bvh]
                    .into_iter()
                    .filter(|engine| engine.serves(&body) && takes(*engine, &body, &asked));
                let times =
                    serving.map(|engine| (engine, nanoseconds_per_ray(&body, engine, &asked, rounds)));
                let chosen = match &asked {
                    Asked::AtOnce(RaySet::Grid(grid)) => body.view(grid, None).engine(),
                    Asked::AtOnce(RaySet::Batch(_)) => body.engine_for_rays(),
                    Asked::OneByOne(_) => body.engine_for_line(),
                };
                let faces = mesh.faces.len();
                each(&Choice { shape, faces, rays, times: times.collect(), chosen });
            }
        }
    }
}

/// A convex body, and one with a waist.
fn bodies(subdivisions: u32) -> Vec<(&'static str, Body)> {
    let place = Ellipsoid::turn() * DMat3::from_diagonal(HALF_AXES_MM);
    let waisted = |v: DVec3| place * (v * DVec3::new(1.0, 0.4 + 0.6 * v.x * v.x, 0.4 + 0.6 * v.x * v.x));
    let mut bodies = vec![("ellipsoid", Body::new(Ellipsoid::BENCH.surface(subdivisions)))];
    if subdivisions >= 2 {
        bodies.push(("waist", Body::new(closed(icosphere(subdivisions).map_vertices(waisted)))));
    }
    bodies
}

/// Whether an engine takes a set of rays, and not longer than anybody would wait.
fn takes(engine: Engine, body: &Body, asked: &Asked) -> bool {
    match engine {
        Engine::Clip => body.surface().mesh().faces.len() <= MOST_CLIPPED_FACES,
        Engine::Raster => matches!(asked, Asked::AtOnce(RaySet::Grid(_))),
        Engine::Walk | Engine::Bvh => true,
    }
}

/// The median over rounds, the first of which, that makes ready, is left out.
fn nanoseconds_per_ray(body: &Body, engine: Engine, asked: &Asked, rounds: usize) -> f64 {
    let once = || match asked {
        Asked::AtOnce(rays) => at_once(body, engine, rays),
        Asked::OneByOne(rays) => one_by_one(body, engine, rays),
    };
    let mut times: Vec<f64> = (0..=rounds).map(|_| once()).skip(1).collect();
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn one_by_one(body: &Body, engine: Engine, rays: &[Segment]) -> f64 {
    let mut parts = Vec::new();
    let start = Instant::now();
    for ray in rays {
        body.chords_by(engine, ray.line(), &mut parts);
        black_box(&parts);
    }
    1e9 * start.elapsed().as_secs_f64() / rays.len() as f64
}

/// The raster is timed on all rays, as it makes ready for them all; others on a share of them.
fn at_once(body: &Body, engine: Engine, rays: &RaySet) -> f64 {
    let parts = match rays {
        _ if engine == Engine::Raster => vec![rays.whole()],
        RaySet::Grid(grid) => rays.parts(PARTS.min(grid.size().1 / PART_ROWS)),
        RaySet::Batch(_) => rays.parts(PARTS),
    };
    let one_of = (rays.count() / ENOUGH).clamp(1, (parts.len() / FEWEST_PARTS).max(1));
    let parts = || parts.iter().step_by(one_of);
    let count: usize = parts().map(|part| part.pixels()).sum();
    // Written once before, so that no page is new.
    let mut lengths = vec![f64::NAN; count];
    let start = Instant::now();
    lengths.fill(0.0);
    let mut rest = &mut lengths[..];
    match rays {
        RaySet::Grid(grid) => {
            let view = body.view(grid, Some(engine));
            for part in parts() {
                let (own, others) = rest.split_at_mut(part.pixels());
                view.trace(part, &mut Lengths(own));
                rest = others;
            }
        }
        RaySet::Batch(rays) => {
            for part in parts() {
                let (own, others) = rest.split_at_mut(part.pixels());
                let rays = &rays[part.columns.start as usize..part.columns.end as usize];
                body.trace(engine, 0, rays, &mut Lengths(own));
                rest = others;
            }
        }
    }
    1e9 * start.elapsed().as_secs_f64() / count as f64
}
