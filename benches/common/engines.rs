//! This crate's engines as contestants.

use chordfield::exact::bvh;
use chordfield::exact::clip::ConvexClipper;
use chordfield::geometry::{ClosedMesh, ConvexMesh};

use crate::body::closed;
use crate::rays::RaySet;
use crate::{Contestant, Tracer};

/// Half-space clipping.
pub struct Clip {
    clipper: ConvexClipper,
}

impl Clip {
    /// Proves the body convex and lays out its planes.
    pub fn new(surface: &ClosedMesh) -> Self {
        let body = ConvexMesh::new(closed(surface.mesh().clone())).expect("ellipsoids are convex");
        Self { clipper: ConvexClipper::new(&body) }
    }
}

impl Contestant for Clip {
    fn tracer<'a>(&'a self, rays: &'a RaySet) -> Option<Tracer<'a>> {
        if matches!(rays, RaySet::Grid(_)) {
            return None;
        }
        Some(Box::new(|region, lengths| {
            rays.each_of(region, |i, ray| {
                let chord = self.clipper.chord(ray.line());
                let within = chord.and_then(|chord| chord.intersection(&ray.reach()));
                lengths[i] = within.map_or(0.0, |part| part.length());
            });
        }))
    }
}

/// The box hierarchy and watertight crossings, one ray at a time.
pub struct BoxHierarchy {
    surface: ClosedMesh,
}

impl BoxHierarchy {
    /// Proves the surface closed, which builds its hierarchy.
    pub fn new(surface: &ClosedMesh) -> Self {
        Self { surface: closed(surface.mesh().clone()) }
    }
}

impl Contestant for BoxHierarchy {
    fn tracer<'a>(&'a self, rays: &'a RaySet) -> Option<Tracer<'a>> {
        Some(Box::new(|region, lengths| {
            let mut parts = Vec::new();
            rays.each_of(region, |i, ray| {
                bvh::chords(&self.surface, ray.line(), &mut parts);
                let within = parts.iter().filter_map(|part| part.intersection(&ray.reach()));
                lengths[i] = within.map(|part| part.length()).sum();
            });
        }))
    }
}
