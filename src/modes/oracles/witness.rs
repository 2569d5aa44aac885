//! What oracles question: a way to find lengths.

use super::Rays;
use crate::exact::{Body, Engine, Lengths, Record, Spans};
use crate::geometry::{Interval, Segment};
use crate::modes::project::forest::{Forest, Grove, holds_box};
use crate::modes::project::{Interpolation, Method};

/// A way to find the lengths of rays in bodies.
pub trait Witness: Sync {
    /// The length of each ray in `body`, mm.
    fn lengths(&self, body: &Body, rays: &Rays) -> Vec<f64>;

    /// The parts of the rays in `body`, mm from their sources, with the ray's number; by ray.
    fn parts(&self, body: &Body, rays: &Rays) -> Vec<(usize, Interval)>;

    /// As [`parts`](Self::parts), of several sets of rays: for witnesses that learn from one what they need for the next.
    fn parts_of_each(&self, body: &Body, sets: &[Rays]) -> Vec<Vec<(usize, Interval)>> {
        sets.iter().map(|rays| self.parts(body, rays)).collect()
    }

    /// As [`lengths`](Self::lengths), of several sets of rays.
    fn lengths_of_each(&self, body: &Body, sets: &[Rays]) -> Vec<Vec<f64>> {
        sets.iter().map(|rays| self.lengths(body, rays)).collect()
    }

    /// What the size of the error is promised to be at most in the mean over rays that meet `body`, mm; 0 if lengths are exact but
    /// for rounding.
    fn promised_error_mm(&self, _body: &Body) -> f64 {
        0.0
    }

    /// As [`lengths`](Self::lengths), of a body `factor` times as large as one asked for before: what the witness is told in mm
    /// is told in as many times more.
    fn lengths_at_scale(&self, _factor: f64, body: &Body, rays: &Rays) -> Vec<f64> {
        self.lengths(body, rays)
    }

    /// Whether it finds the lengths of lists of rays in `body`, not of images only.
    fn takes_lists(&self, _body: &Body) -> bool {
        true
    }
}

/// A method of projections as a witness.
pub struct MethodWitness {
    method: Method,
}

impl MethodWitness {
    /// The witness of `method`.
    pub fn new(method: Method) -> Self {
        Self { method }
    }

    fn trace<R: Record>(body: &Body, engine: Option<Engine>, rays: &Rays, record: &mut R) {
        match rays {
            Rays::Image(grid) => body.view(grid, engine).trace(&grid.whole(), record),
            Rays::List(_) => {
                body.trace(engine.unwrap_or_else(|| body.engine_for_rays()), 0, &rays.segments(), record)
            }
        }
    }
}

impl Witness for MethodWitness {
    fn lengths(&self, body: &Body, rays: &Rays) -> Vec<f64> {
        match self.method {
            Method::Exact(engine) => {
                let mut lengths = vec![0.0; rays.count()];
                Self::trace(body, engine, rays, &mut Lengths(&mut lengths));
                lengths
            }
            Method::RiTree(_) | Method::Auto(_) => sums(rays, self.parts(body, rays)),
        }
    }

    fn parts(&self, body: &Body, rays: &Rays) -> Vec<(usize, Interval)> {
        match self.method {
            Method::Exact(engine) => {
                let (mut spans, mut parts) = (Spans::default(), Vec::new());
                Self::trace(body, engine, rays, &mut spans);
                spans.drain(|ray, part| parts.push((ray, part)));
                parts
            }
            Method::RiTree(settings) | Method::Auto(settings) => {
                let forest = Forest::new(vec![body], settings, true);
                interpolate_all(&forest, body, rays)
            }
        }
    }

    fn parts_of_each(&self, body: &Body, sets: &[Rays]) -> Vec<Vec<(usize, Interval)>> {
        match self.method {
            Method::Exact(_) => sets.iter().map(|rays| self.parts(body, rays)).collect(),
            // One tree for all: what becomes of a cell does not depend on who asks.
            Method::RiTree(settings) | Method::Auto(settings) => {
                let forest = Forest::new(vec![body], settings, true);
                sets.iter().map(|rays| interpolate_all(&forest, body, rays)).collect()
            }
        }
    }

    fn lengths_of_each(&self, body: &Body, sets: &[Rays]) -> Vec<Vec<f64>> {
        match self.method {
            Method::Exact(_) => sets.iter().map(|rays| self.lengths(body, rays)).collect(),
            Method::RiTree(_) | Method::Auto(_) => {
                let parts = self.parts_of_each(body, sets);
                sets.iter().zip(parts).map(|(rays, parts)| sums(rays, parts)).collect()
            }
        }
    }

    /// The tree's promise: where a cell's middle is off by more than the distance threshold, it splits. That is said of
    /// middles, and is held here to the mean over all rays.
    fn promised_error_mm(&self, body: &Body) -> f64 {
        match self.method {
            Method::RiTree(settings) | Method::Auto(settings)
                if Forest::new(vec![body], settings, true).grows(0) =>
            {
                match settings.interpolation {
                    Interpolation::Quadrilinear { parameters } => {
                        parameters.distance_threshold * 0.5 * body.bounds().size().max_element()
                    }
                    Interpolation::SquaredChord { tolerance_mm } => tolerance_mm,
                }
            }
            _ => 0.0,
        }
    }

    fn lengths_at_scale(&self, factor: f64, body: &Body, rays: &Rays) -> Vec<f64> {
        let mut method = self.method;
        if let Method::RiTree(settings) | Method::Auto(settings) = &mut method
            && let Interpolation::SquaredChord { tolerance_mm } = &mut settings.interpolation
        {
            *tolerance_mm *= factor;
        }
        Self { method }.lengths(body, rays)
    }

    fn takes_lists(&self, _: &Body) -> bool {
        self.method != Method::Exact(Some(Engine::Raster))
    }
}

/// Each ray's length, from its parts.
fn sums(rays: &Rays, parts: Vec<(usize, Interval)>) -> Vec<f64> {
    let mut lengths = vec![0.0; rays.count()];
    parts.into_iter().for_each(|(ray, part)| lengths[ray] += part.length());
    lengths
}

/// The parts of all rays by the one tree of `forest`.
fn interpolate_all(forest: &Forest, body: &Body, rays: &Rays) -> Vec<(usize, Interval)> {
    let (mut parts, mut of_ray) = (Vec::new(), Vec::new());
    let grove = forest.enter();
    for (i, ray) in rays.segments().iter().enumerate() {
        interpolate(&grove, body, ray, &mut of_ray);
        parts.extend(of_ray.drain(..).map(|part| (i, part)));
    }
    drop(grove);
    forest.prune_if_full();
    parts
}

/// The parts of a ray by the body's tree; traced if there is none, or if it says so.
fn interpolate(grove: &Grove, body: &Body, ray: &Segment, parts: &mut Vec<Interval>) {
    let tree = grove.tree(0).filter(|_| holds_box(ray, &body.bounds()));
    match tree.map(|tree| grove.chord(&mut tree.descent(), ray)) {
        Some(Ok(chord)) => parts.extend(chord),
        Some(Err(_)) | None => body.chords_of_segment(ray, parts),
    }
}
