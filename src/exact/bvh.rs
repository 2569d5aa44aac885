//! All crossings of a line with a closed surface, convex or not, watertight.
//!
//! ```text
//!   tree, f32, conservative        faces, f32, conservative        exact, f64
//!   8 boxes at a time       ──▶    8 triangles at a time    ──▶    shear and exact signs
//!   (node)                         (leaf)                          (crossing)
//! ```
//!
//! The sieves of f32 hold back only what the exact test would not count; what they let through is decided by that test
//! alone, and it takes no crossing twice or loses one: see `exact::crossing`.

mod build;
mod line_box;
mod local;
mod node;

use super::crossing::Crossing;
use super::parts::Parts;
use super::record::Record;
use super::shear::Shear;
use crate::geometry::{ClosedMesh, Interval, Line, MAX_DEPTH, Segment};
use build::Builder;
use line_box::LineBoxTest;
use local::{Frame, LocalLine};
use node::{LANES, Leaf, Node};
use pulp::{Simd, WithSimd};

/// A closed surface's faces in an eight-wide hierarchy of boxes, split by the surface-area heuristic.
///
/// 68 to 77 bytes per face of ellipsoids. The surface is not held: each query must be given the one it was built from.
#[derive(Clone, Debug)]
pub struct Bvh {
    frame: Frame,
    nodes: Vec<Node>,
    leaves: Vec<Leaf>,
}

impl Bvh {
    /// The hierarchy over the faces of `surface`. Deterministic.
    pub fn new(surface: &ClosedMesh) -> Self {
        let frame = Frame::of(surface);
        let Builder { nodes, leaves, .. } = Builder::build(surface, frame);
        Self { frame, nodes, leaves }
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        std::mem::size_of_val(&*self.nodes) + std::mem::size_of_val(&*self.leaves)
    }

    /// Reports to `record` where `segment`, as ray number `ray`, crosses `surface`; mm from its source.
    ///
    /// The body is closed: a ray in a face's plane counts its length in the face. Crossings are exact for a surface each of
    /// whose vertices has moved by no more than γ₈ of its distance from the source: a vertex is rounded by itself, alike for
    /// all its faces, so neighbouring vertices may move apart, and no one shift of the ray stands for all.
    pub fn trace(&self, surface: &ClosedMesh, ray: usize, segment: &Segment, record: &mut impl Record) {
        self.trace_all(surface, ray, std::slice::from_ref(segment), record);
    }

    /// As [`trace`](Self::trace), for many segments, numbered from `first_ray` on. No memory is taken per ray.
    pub fn trace_all(
        &self,
        surface: &ClosedMesh,
        first_ray: usize,
        segments: &[Segment],
        record: &mut impl Record,
    ) {
        crate::dispatch::arch().dispatch(Trace { bvh: self, surface, first_ray, segments, record });
    }

    /// Finds the parts of `line` inside `surface`, mm along `dir`, in order and disjoint; written to `found`. As exact as
    /// [`trace`](Self::trace).
    pub fn chords(&self, surface: &ClosedMesh, line: &Line, found: &mut Vec<Interval>) {
        let mut parts = Parts::default();
        crate::dispatch::arch().dispatch(Cross { bvh: self, surface, line, parts: &mut parts });
        found.clear();
        found.extend(parts.intervals());
    }

    #[inline(always)]
    fn trace_one(
        &self,
        surface: &ClosedMesh,
        ray: usize,
        segment: &Segment,
        parts: &mut Parts,
        record: &mut impl Record,
    ) {
        let Some([from, to]) = self.cross(surface, segment.line(), parts) else { return };
        if from >= 0.0 && to <= segment.length_mm() {
            parts.report_all(ray, record);
        } else {
            parts.report(ray, &segment.reach(), record);
        }
    }

    /// Gathers the crossings of the whole of `line`. Returns between which parameters, mm, they lie; `None` if there are none.
    #[inline(always)]
    fn cross(&self, surface: &ClosedMesh, line: &Line, parts: &mut Parts) -> Option<[f64; 2]> {
        parts.clear();
        let shear = Shear::new(line);
        let local = self.frame.line(line, &shear)?;
        self.visit(
            &local,
            #[inline(always)]
            |face| parts.add(face, Crossing::of(surface, face, &shear)),
        );
        (!parts.is_empty()).then_some(local.reach_mm)
    }

    /// Calls `face` for each face that `line` may meet.
    #[inline(always)]
    fn visit(&self, line: &LocalLine, mut face: impl FnMut(u32)) {
        // Siblings yet to be seen: their node, and a bit for each.
        let mut pending = [(0u32, 0u32); MAX_DEPTH];
        let mut depth = 0;
        let (mut at, mut lanes) = (0, self.nodes[0].sift(line));
        loop {
            if lanes == 0 {
                if depth == 0 {
                    return;
                }
                depth -= 1;
                (at, lanes) = pending[depth];
                continue;
            }
            let child = self.nodes[at as usize].children[lanes.trailing_zeros() as usize % LANES];
            lanes &= lanes - 1;
            if child.is_leaf() {
                let leaf = &self.leaves[child.index()];
                let mut near = leaf.sift(line);
                while near != 0 {
                    face(leaf.faces[near.trailing_zeros() as usize % LANES]);
                    near &= near - 1;
                }
            } else {
                if lanes != 0 {
                    pending[depth] = (at, lanes);
                    depth += 1;
                }
                at = child.index() as u32;
                lanes = self.nodes[at as usize].sift(line);
            }
        }
    }
}

/// [`Bvh::trace_all`], compiled for each set of wide instructions. A closure would not do: its body may remain a function
/// of the baseline.
struct Trace<'a, R> {
    bvh: &'a Bvh,
    surface: &'a ClosedMesh,
    first_ray: usize,
    segments: &'a [Segment],
    record: &'a mut R,
}

impl<R: Record> WithSimd for Trace<'_, R> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let mut parts = Parts::default();
        for (i, segment) in self.segments.iter().enumerate() {
            self.bvh.trace_one(self.surface, self.first_ray + i, segment, &mut parts, self.record);
        }
    }
}

/// [`Bvh::chords`], likewise.
struct Cross<'a> {
    bvh: &'a Bvh,
    surface: &'a ClosedMesh,
    line: &'a Line,
    parts: &'a mut Parts,
}

impl WithSimd for Cross<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        self.bvh.cross(self.surface, self.line, self.parts);
    }
}

/// As [`Bvh::chords`], for a line on its own through a surface that has no [`Bvh`]: by the surface's own tree, one box and one
/// face at a time.
pub fn chords(surface: &ClosedMesh, line: &Line, found: &mut Vec<Interval>) {
    found.clear();
    found.extend(parts_of(surface, line).intervals());
}

/// As [`Bvh::trace`], likewise.
pub fn trace(surface: &ClosedMesh, ray: usize, segment: &Segment, record: &mut impl Record) {
    parts_of(surface, segment.line()).report(ray, &segment.reach(), record);
}

fn parts_of(surface: &ClosedMesh, line: &Line) -> Parts {
    let mut parts = Parts::default();
    let shear = Shear::new(line);
    let near_line = LineBoxTest::new(line);
    surface
        .tree()
        .visit(|b| near_line.may_hit(b), |face| parts.add(face, Crossing::of(surface, face, &shear)));
    parts
}

#[cfg(test)]
mod tests;
