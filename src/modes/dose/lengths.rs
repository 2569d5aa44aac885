//! Where batches of paths run in organs, as a method finds it.

use crate::error::{Error, Result};
use crate::exact::{Body, Engine, Spans};
use crate::geometry::{Bounds, Interval, Segment};
use crate::modes::project::Method;
use crate::modes::project::forest::Forest;
use crate::scene::Scene;

/// A scene ready for paths.
pub struct Tracer<'a> {
    bodies: Vec<&'a Body>,
    bounds: Vec<Bounds>,
    engine: Option<Engine>,
    forest: Option<Forest<'a>>,
}

/// The chords of a batch, path by path; reused from batch to batch.
#[derive(Default)]
pub struct Chords {
    spans: Spans,
    /// The paths that may meet an organ: their places, and they themselves.
    near: Vec<u32>,
    near_rays: Vec<Segment>,
    /// As they are found: path, organ, chord.
    found: Vec<(u32, usize, Interval)>,
    /// Where each path's chords begin in `sorted`, and where the last's end.
    starts: Vec<u32>,
    sorted: Vec<(usize, Interval)>,
}

impl<'a> Tracer<'a> {
    /// # Errors
    /// The raster engine, which needs an image.
    pub fn new(scene: &'a Scene, method: Method) -> Result<Self> {
        let bodies: Vec<&Body> = scene.organs.iter().map(|organ| &organ.body).collect();
        let bounds = bodies.iter().map(|body| body.bounds()).collect();
        let (engine, forest) = match method {
            Method::Exact(Some(Engine::Raster)) => {
                return Err(Error::input(
                    "the raster engine",
                    "finds lengths along the rays of an image, not along single paths",
                    "name another method",
                ));
            }
            Method::Exact(engine) => (engine, None),
            Method::RiTree(settings) | Method::Auto(settings) => {
                (None, Some(Forest::new(bodies.clone(), settings, true)))
            }
        };
        Ok(Self { bodies, bounds, engine, forest })
    }

    /// Its trees.
    pub fn forest(&self) -> Option<&Forest<'a>> {
        self.forest.as_ref()
    }

    /// Its trees, to be replaced by others.
    pub fn forest_mut(&mut self) -> Option<&mut Forest<'a>> {
        self.forest.as_mut()
    }

    /// Finds the chords of all paths in all organs.
    pub fn trace(&self, paths: &[Segment], chords: &mut Chords) {
        chords.found.clear();
        for (organ, body) in self.bodies.iter().enumerate() {
            let Chords { spans, near, near_rays, found, .. } = &mut *chords;
            near.clear();
            near_rays.clear();
            let bounds = &self.bounds[organ];
            for (i, path) in (0..).zip(paths).filter(|(_, path)| bounds.ball_meets(path.line())) {
                near.push(i);
                near_rays.push(*path);
            }
            if near.is_empty() {
                continue;
            }
            let grove = self.forest.as_ref().filter(|forest| forest.grows(organ)).map(Forest::enter);
            if let Some(grove) = &grove
                && let Some(tree) = grove.tree(organ)
            {
                grove.chords(tree, body, near_rays, spans, |ray, _, part| {
                    found.extend(part.map(|part| (near[ray], organ, part)));
                });
            } else {
                let engine = self.engine.filter(|engine| engine.serves(body));
                body.trace(engine.unwrap_or_else(|| body.engine_for_rays()), 0, near_rays, spans);
                spans.drain(|ray, part| found.push((near[ray], organ, part)));
            }
            drop(grove);
            self.forest.iter().for_each(Forest::prune_if_full);
        }
        chords.sort(paths.len());
    }
}

impl Chords {
    /// Brings what was found in the order of paths; chords of one path stay in the order of organs.
    fn sort(&mut self, paths: usize) {
        self.starts.clear();
        self.starts.resize(paths + 1, 0);
        for (path, ..) in &self.found {
            self.starts[*path as usize + 1] += 1;
        }
        for i in 0..paths {
            self.starts[i + 1] += self.starts[i];
        }
        self.sorted.clear();
        self.sorted.resize(self.found.len(), (0, Interval::UNIT));
        for &(path, organ, chord) in &self.found {
            let at = &mut self.starts[path as usize];
            self.sorted[*at as usize] = (organ, chord);
            *at += 1;
        }
        // Each start has moved to the next one's place.
        self.starts.copy_within(..paths, 1);
        self.starts[0] = 0;
    }

    /// The chords of a path: organ, and mm from the source.
    pub fn of(&self, path: usize) -> &[(usize, Interval)] {
        &self.sorted[self.starts[path] as usize..self.starts[path + 1] as usize]
    }
}
