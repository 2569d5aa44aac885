//! Closed bodies, and the engines that they have ready.

use std::sync::OnceLock;

use glam::{DMat3, DVec3};

use super::Engine;
use super::Record;
use super::bvh::Bvh;
use super::clip::ConvexClipper;
use super::raster::Patches;
use super::walk::{Unsure, Walker};
use crate::geometry::{
    Bounds, ClosedMesh, ConvexMesh, Interval, Line, NotConvex, RayGrid, Region, Segment, ball_of_inertia,
};

/// A closed body, ready for exact chords. What an engine needs beyond the surface is made when the engine is first used.
#[derive(Clone, Debug)]
pub struct Body {
    form: Form,
    bvh: OnceLock<Bvh>,
    patches: OnceLock<Patches>,
}

#[derive(Clone, Debug)]
enum Form {
    Convex(Box<Convex>),
    General { surface: ClosedMesh, why: NotConvex },
}

#[derive(Clone, Debug)]
struct Convex {
    mesh: ConvexMesh,
    clipper: ConvexClipper,
    walker: OnceLock<Walker>,
}

impl Body {
    /// The body inside `surface`.
    pub fn new(surface: ClosedMesh) -> Self {
        let form = match ConvexMesh::new(surface) {
            Ok(mesh) => Form::Convex(Box::new(Convex {
                clipper: ConvexClipper::new(&mesh),
                mesh,
                walker: OnceLock::new(),
            })),
            Err(refused) => {
                let (surface, why) = *refused;
                Form::General { surface, why }
            }
        };
        Self { form, bvh: OnceLock::new(), patches: OnceLock::new() }
    }

    /// Its surface.
    pub fn surface(&self) -> &ClosedMesh {
        match &self.form {
            Form::Convex(convex) => convex.mesh.surface(),
            Form::General { surface, .. } => surface,
        }
    }

    /// The proof that it is convex, or why it is not.
    pub fn convexity(&self) -> Result<&ConvexMesh, &NotConvex> {
        match &self.form {
            Form::Convex(convex) => Ok(&convex.mesh),
            Form::General { why, .. } => Err(why),
        }
    }

    /// The box around it, mm.
    pub fn bounds(&self) -> Bounds {
        self.surface().bounds()
    }

    /// The planes of its faces, to clip against. `None` if it is not convex.
    pub fn clipper(&self) -> Option<&ConvexClipper> {
        match &self.form {
            Form::Convex(convex) => Some(&convex.clipper),
            Form::General { .. } => None,
        }
    }

    /// Its surface, to walk over. `None` if it is not convex.
    pub fn walker(&self) -> Option<&Walker> {
        match &self.form {
            Form::Convex(convex) => Some(convex.walker.get_or_init(|| Walker::new(&convex.mesh))),
            Form::General { .. } => None,
        }
    }

    /// A point in the middle of the body, mm, and the linear map from mm about it to a frame in which the body is about a
    /// ball of radius 1: its ellipsoid of inertia becomes that ball.
    pub fn ball_frame(&self) -> (DVec3, DMat3) {
        match self.walker() {
            Some(walker) => walker.ball_frame(),
            None => ball_of_inertia(self.surface().mesh().triangles(), self.bounds()),
        }
    }

    /// The hierarchy over its faces.
    pub fn bvh(&self) -> &Bvh {
        self.bvh.get_or_init(|| Bvh::new(self.surface()))
    }

    /// Its faces in patches, for the raster.
    pub fn patches(&self) -> &Patches {
        self.patches.get_or_init(|| Patches::new(self.surface()))
    }

    /// Forgets what engines have made ready; the next to be used makes it again. For measuring what that costs.
    pub fn forget_engines(&mut self) {
        (self.bvh, self.patches) = (OnceLock::new(), OnceLock::new());
        if let Form::Convex(convex) = &mut self.form {
            convex.walker = OnceLock::new();
        }
    }

    /// The parts of `line` in the body, mm along `dir`, in order and disjoint; written to `parts`. By the engine that is
    /// the quickest for a line on its own.
    pub fn chords(&self, line: &Line, parts: &mut Vec<Interval>) {
        self.chords_by(self.engine_for_line(), line, parts);
    }

    /// As [`chords`](Self::chords), by an engine of choice; by another where that does not [serve](Engine::serves).
    pub fn chords_by(&self, engine: Engine, line: &Line, parts: &mut Vec<Interval>) {
        match self.convex_chord_by(engine, line) {
            Ok(chord) => {
                parts.clear();
                parts.extend(chord);
            }
            Err(Unsure) => self.bvh().chords(self.surface(), line, parts),
        }
    }

    /// From the entry to the last exit of `line`, mm along `dir`: the chord of a convex body. As [`chords`](Self::chords)
    /// finds them, but without a list. `None` if it misses.
    pub fn whole_chord(&self, line: &Line) -> Option<Interval> {
        self.convex_chord_by(self.engine_for_line(), line).unwrap_or_else(|Unsure| {
            let mut parts = Vec::new();
            self.bvh().chords(self.surface(), line, &mut parts);
            // A line along a face may leave and enter again within rounding.
            Interval::new(parts.first()?.start(), parts.last()?.end())
        })
    }

    /// The chord of a convex body by an engine for those. Another should look if it is in doubt, or there is none.
    fn convex_chord_by(&self, engine: Engine, line: &Line) -> Result<Option<Interval>, Unsure> {
        match (engine, &self.form) {
            (Engine::Clip, Form::Convex(convex)) => Ok(convex.clipper.chord(line)),
            (Engine::Walk, Form::Convex(_)) => self.walked(line),
            _ => Err(Unsure),
        }
    }

    /// The chord of a convex body by a walk; where that is in doubt, by clipping, if the planes are few.
    fn walked(&self, line: &Line) -> Result<Option<Interval>, Unsure> {
        let answer = self.walker().ok_or(Unsure)?.pass(line);
        match (answer, self.few_planes()) {
            (Ok(pass), _) => Ok(pass.map(|pass| pass.chord)),
            (Err(Unsure), Some(clipper)) => Ok(clipper.chord(line)),
            (Err(Unsure), None) => Err(Unsure),
        }
    }

    /// The parts of `segment` in the body, mm from its source, in order and disjoint; written to `parts`. A source
    /// or a target inside the body cuts its chord there.
    pub fn chords_of_segment(&self, segment: &Segment, parts: &mut Vec<Interval>) {
        self.chords(segment.line(), parts);
        keep_within(segment, parts);
    }

    /// Records where each ray, numbered from `first`, enters and leaves the body.
    pub fn trace<R: Record>(&self, engine: Engine, first: usize, rays: &[Segment], record: &mut R) {
        match (engine, self.walker_for(engine), self.clipper()) {
            (Engine::Walk, Some(walker), _) => {
                walker.trace_batch(first, rays, record, |ray, segment, record| {
                    self.trace_doubtful(ray, segment, record);
                })
            }
            (Engine::Clip, _, Some(clipper)) => clipper.trace_all(first, rays, record),
            _ => self.bvh().trace_all(self.surface(), first, rays, record),
        }
    }

    /// As [`trace`](Self::trace), for the rays of a region of an image, walking from ray to ray.
    pub(super) fn trace_grid_by_walk<R: Record>(
        &self,
        walker: &Walker,
        grid: &RayGrid,
        region: &Region,
        record: &mut R,
    ) {
        walker.trace_grid(grid, region, record, |ray, segment, record| {
            self.trace_doubtful(ray, segment, record);
        });
    }

    fn walker_for(&self, engine: Engine) -> Option<&Walker> {
        if engine == Engine::Walk { self.walker() } else { None }
    }

    /// A ray that a walk is in doubt of.
    #[cold]
    fn trace_doubtful(&self, ray: usize, segment: &Segment, record: &mut impl Record) {
        match self.few_planes() {
            Some(clipper) => clipper.trace(ray, segment, record),
            None => self.bvh().trace(self.surface(), ray, segment, record),
        }
    }

    /// The clipper, if clipping is quicker than a descent of the hierarchy.
    fn few_planes(&self) -> Option<&ConvexClipper> {
        self.clipper().filter(|clipper| clipper.plane_count() <= super::engine::FEW_PLANES)
    }
}

/// Cuts parts of a segment's line to the segment.
fn keep_within(segment: &Segment, parts: &mut Vec<Interval>) {
    let reach = segment.reach();
    parts.retain_mut(|part| match part.intersection(&reach) {
        Some(within) if within.length() > 0.0 => {
            *part = within;
            true
        }
        _ => false,
    });
}
