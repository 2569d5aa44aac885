//! Exact chords: the judge of every approximation and the fall-back of every query.
//!
//! | engine | bodies | cost per ray | error |
//! |---|---|---|---|
//! | [`clip`] | convex | every face plane | γ₈ of the distance, as a shift of the line |
//! | [`bvh`] | any closed surface | faces near the line | γ₈ of the distance, as a shift of each vertex |

pub mod bvh;
pub mod clip;
mod crossing;
mod parts;
mod record;
mod shear;

pub use record::{Lengths, Pierce, Pierced, Record, Spans, Way};

use std::sync::OnceLock;

use crate::geometry::{Bounds, ClosedMesh, ConvexMesh, Interval, Line, NotConvex, Segment};
use bvh::Bvh;
use clip::{ConvexClipper, NarrowedClipper};

/// Planes that are clipped in the time of one descent of a box hierarchy.
const CLIP_PLANES: usize = 200;

/// A closed body, ready for exact chords.
#[derive(Clone, Debug)]
pub struct Body {
    form: Form,
}

#[derive(Clone, Debug)]
enum Form {
    Convex { mesh: ConvexMesh, clipper: ConvexClipper, bvh: OnceLock<Bvh> },
    General { surface: ClosedMesh, bvh: Bvh, why: NotConvex },
}

impl Body {
    /// The body inside `surface`: clipped if it proves convex, otherwise traced by its box hierarchy.
    pub fn new(surface: ClosedMesh) -> Self {
        let form = match ConvexMesh::new(surface) {
            Ok(mesh) => Form::Convex { clipper: ConvexClipper::new(&mesh), mesh, bvh: OnceLock::new() },
            Err(refused) => {
                let (surface, why) = *refused;
                Form::General { bvh: Bvh::new(&surface), surface, why }
            }
        };
        Self { form }
    }

    /// Its surface.
    pub fn surface(&self) -> &ClosedMesh {
        match &self.form {
            Form::Convex { mesh, .. } => mesh.surface(),
            Form::General { surface, .. } => surface,
        }
    }

    /// The proof that it is convex, or why it is not.
    pub fn convexity(&self) -> Result<&ConvexMesh, &NotConvex> {
        match &self.form {
            Form::Convex { mesh, .. } => Ok(mesh),
            Form::General { why, .. } => Err(why),
        }
    }

    /// The hierarchy over its faces. That of a convex body, which seldom needs it, is built when first asked for.
    pub fn bvh(&self) -> &Bvh {
        match &self.form {
            Form::Convex { mesh, bvh, .. } => bvh.get_or_init(|| Bvh::new(mesh.surface())),
            Form::General { bvh, .. } => bvh,
        }
    }

    /// The engine that finds its chords.
    pub fn engine(&self) -> &'static str {
        match &self.form {
            Form::Convex { .. } => "clip",
            Form::General { .. } => "bvh",
        }
    }

    /// The box around it, mm.
    pub fn bounds(&self) -> Bounds {
        self.surface().bounds()
    }

    /// The parts of `line` in the body, mm along `dir`, in order and disjoint; written to `parts`.
    pub fn chords(&self, line: &Line, parts: &mut Vec<Interval>) {
        match &self.form {
            Form::Convex { clipper, .. } => {
                parts.clear();
                parts.extend(clipper.chord(line));
            }
            Form::General { surface, bvh, .. } => bvh.chords(surface, line, parts),
        }
    }

    /// As [`chords`](Self::chords), by whichever engine is the faster for one line on its own: beyond some hundred planes
    /// the box hierarchy, also of convex bodies. Both are exact; they may differ in the last bits.
    pub fn chords_of_lone_line(&self, line: &Line, parts: &mut Vec<Interval>) {
        match &self.form {
            Form::Convex { mesh, .. } if mesh.planes().len() > CLIP_PLANES => {
                self.bvh().chords(mesh.surface(), line, parts);
            }
            _ => self.chords(line, parts),
        }
    }

    /// The parts of `segment` in the body, mm from its source, in order and disjoint; written to `parts`. A source
    /// or a target inside the body cuts its chord there.
    pub fn chords_of_segment(&self, segment: &Segment, parts: &mut Vec<Interval>) {
        self.chords(segment.line(), parts);
        keep_within(segment, parts);
    }

    /// The body made ready for many segments in one convex region. `may_touch` must be
    /// true for every box that shares a point with the region.
    pub fn narrowed(&self, may_touch: impl Fn(&Bounds) -> bool) -> NarrowedBody<'_> {
        match &self.form {
            Form::Convex { mesh, clipper, .. } => {
                NarrowedBody::Convex(NarrowedClipper::new(mesh, clipper, may_touch))
            }
            Form::General { surface, bvh, .. } => NarrowedBody::General(surface, bvh),
        }
    }
}

/// A body made ready for many segments in one region: see [`Body::narrowed`].
#[derive(Clone, Debug)]
pub enum NarrowedBody<'a> {
    /// A convex one.
    Convex(NarrowedClipper<'a>),
    /// Any other; its hierarchy is narrow enough.
    General(&'a ClosedMesh, &'a Bvh),
}

impl NarrowedBody<'_> {
    /// As [`Body::chords_of_segment`], for a segment in the region.
    pub fn chords_of_segment(&mut self, segment: &Segment, parts: &mut Vec<Interval>) {
        match self {
            Self::Convex(clipper) => {
                parts.clear();
                parts.extend(clipper.chord(segment).filter(|part| part.length() > 0.0));
            }
            Self::General(surface, bvh) => {
                bvh.chords(surface, segment.line(), parts);
                keep_within(segment, parts);
            }
        }
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
