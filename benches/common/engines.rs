//! This crate's engines as contestants.

use std::hint::black_box;

use chordfield::exact::{Body, Engine, Lengths};
use chordfield::geometry::ClosedMesh;

use crate::body::closed;
use crate::rays::RaySet;
use crate::{Contestant, Tracer};

/// A body, traced by one engine.
pub struct OneEngine {
    body: Body,
    engine: Engine,
}

impl OneEngine {
    /// Proves the surface closed and, if it is, convex; and makes what the engine needs.
    pub fn new(surface: &ClosedMesh, engine: Engine) -> Self {
        let body = Body::new(closed(surface.mesh().clone()));
        match engine {
            Engine::Walk => drop(black_box(body.walker())),
            Engine::Bvh => drop(black_box(body.bvh())),
            Engine::Raster => drop(black_box(body.patches())),
            Engine::Clip => {}
        }
        Self { body, engine }
    }
}

impl Contestant for OneEngine {
    fn tracer<'a>(&'a self, rays: &'a RaySet) -> Option<Tracer<'a>> {
        match rays {
            RaySet::Grid(_) if self.engine == Engine::Clip => None,
            RaySet::Grid(grid) => {
                let view = self.body.view(grid, Some(self.engine));
                Some(Box::new(move |region, lengths| view.trace(region, &mut Lengths(lengths))))
            }
            RaySet::Batch(_) if self.engine == Engine::Raster => None,
            RaySet::Batch(rays) => Some(Box::new(move |region, lengths| {
                let rays = &rays[region.columns.start as usize..region.columns.end as usize];
                self.body.trace(self.engine, 0, rays, &mut Lengths(lengths));
            })),
        }
    }
}
