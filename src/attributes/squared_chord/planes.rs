//! Cells that see few faces of a convex body: exact, without a fit.
//!
//! ```text
//!   A cell's lines fill a shaft S, convex as the body K is. If one of them meets K, and K_P is the intersection of the
//!   half-spaces of all faces that may lie in S,
//!
//!        ╲ K_P ╱        then K_P is K itself within S: a way from a point of K ∩ S to a point of K_P ∩ S that left K would leave
//!     ━━━━╲━━━╱━━━━ S   it through a face in S, whose plane has all of K_P behind. So a line of the cell is clipped by these
//!          ╲_╱          planes, and by its own pair's, as it would be by all.
//! ```

use std::ops::ControlFlow;

use pulp::{Simd, WithSimd};

use super::SquaredChord;
use super::image::{BLOCK, place_in};
use super::shaft::Shaft;
use crate::geometry::{Interval, Line, Plane, Region};
use crate::linespace::PlanePair;
use crate::linespace::image::{ImageLines, PixelForm, Runs};

/// Cells of more planes are not clipped.
pub(super) const MOST_PLANES: usize = 48;

/// The planes that lines of a cell may meet.
pub(super) struct FewPlanes {
    /// By their places among the body's. None prove that no line meets the body.
    pub planes: Vec<u32>,
    /// Whether a line of the cell is known to meet the body. Without one, the planes prove nothing: some may have been kept
    /// that are not in the shaft, and alone they bound anything.
    pub is_met: bool,
}

impl SquaredChord<'_> {
    /// The planes of all faces that may lie in a cell's shaft. `None` if they are more than [`MOST_PLANES`], or if the body is
    /// not convex.
    pub(super) fn few_planes(&self, shaft: &Shaft) -> Option<FewPlanes> {
        let convex = self.body.convexity().ok()?;
        let (mut planes, mut is_met) = (Vec::new(), false);
        let are_few = shaft.all_faces(|face| {
            // A face without area has no plane; its neighbours close the body.
            let plane = convex.plane_of(face).filter(|plane| !planes.contains(plane));
            planes.extend(plane);
            is_met |= self.body.surface().mesh().triangle(face).into_iter().any(|p| shaft.holds(p));
            if planes.len() > MOST_PLANES { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        planes.sort_unstable();
        are_few.then_some(FewPlanes { planes, is_met })
    }

    /// Whether these may be the planes of a leaf: some, not too many, in order, each of the body.
    pub(super) fn are_planes(&self, few: &[u32]) -> bool {
        let count = self.body.convexity().map_or(0, |convex| convex.planes().len());
        (1..=MOST_PLANES).contains(&few.len())
            && few.is_sorted_by(|a, b| a < b)
            && few.iter().all(|&plane| (plane as usize) < count)
    }

    fn planes_of<'s>(&'s self, few: &'s [u32]) -> impl Iterator<Item = &'s Plane> {
        let all = self.body.convexity().map_or(&[][..], |convex| convex.planes());
        few.iter().filter_map(|&plane| all.get(plane as usize))
    }

    /// The chord of a line of a cell with so few planes. `None` if it misses.
    pub(super) fn clip(&self, few: &[u32], line: &Line, pair: PlanePair) -> Option<Interval> {
        let (o, d) = (line.origin(), line.dir());
        let [k, ..] = pair.axes();
        let (height, advance) = (self.frame.point(o)[k], self.frame.advance(k, d));
        let ends = [0.0, 1.0].map(|plane| (plane - height) / advance);
        let (mut enter, mut leave) = (ends[0].min(ends[1]), ends[0].max(ends[1]));
        for plane in self.planes_of(few) {
            let (height, slope) = (plane.normal.dot(plane.point - o), plane.normal.dot(d));
            if slope < 0.0 {
                enter = enter.max(height / slope);
            } else if slope > 0.0 {
                leave = leave.min(height / slope);
            } else if height < 0.0 {
                return None;
            }
        }
        Interval::new(enter, leave).filter(|chord| chord.length() > 0.0)
    }

    /// For each of few planes, and for the two of `axis`: the height over the rays' starts, and what a ray rises towards it on
    /// its way, in the frame.
    pub(super) fn plane_forms(&self, few: &[u32], lines: &ImageLines, axis: usize) -> Vec<[PixelForm; 2]> {
        let constant = |value: f64| PixelForm::default().plus_constant(value);
        let [start, path] = [lines.start(), lines.path()];
        let of_pair = [
            [start[axis], PixelForm::default().plus(-1.0, path[axis])],
            [constant(1.0).plus(-1.0, start[axis]), path[axis]],
        ];
        let of_face = self.planes_of(few).map(|plane| {
            let (normal, point) = (self.frame.normal_in_frame(plane.normal), self.frame.point(plane.point));
            (0..3).fold([constant(normal.dot(point)), constant(0.0)], |[height, slope], i| {
                [height.plus(-normal[i], start[i]), slope.plus(normal[i], path[i])]
            })
        });
        of_pair.into_iter().chain(of_face).collect()
    }
}

/// Clips the rays of runs of a block by planes.
pub(super) struct ClipRuns<'e> {
    pub planes: &'e [[PixelForm; 2]],
    pub path_mm: &'e [PixelForm; 3],
    pub pixels: &'e Runs,
    pub region: &'e Region,
    pub lengths: &'e mut [f64],
    pub middles: Option<&'e mut [f64]>,
}

impl WithSimd for ClipRuns<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(mut self, _: S) {
        for (row, columns) in self.pixels.iter() {
            let (first, r) = (columns.start as i32, f64::from(row));
            // Of whole columns, not of those since the run's first, which depends on the region.
            let column = |i: usize| (first + i as i32) as f64;
            let mut enter = [f64::NEG_INFINITY; BLOCK as usize];
            let mut leave = [f64::INFINITY; BLOCK as usize];
            let (enter, leave) = (&mut enter[..columns.len()], &mut leave[..columns.len()]);
            for [height, slope] in self.planes {
                let [h0, h1] = [height.at(0.0, r), height.per_column()];
                let [s0, s1] = [slope.at(0.0, r), slope.per_column()];
                for (i, (enter, leave)) in enter.iter_mut().zip(leave.iter_mut()).enumerate() {
                    let c = column(i);
                    let (height, slope) = (h0 + h1 * c, s0 + s1 * c);
                    let t = height / slope;
                    let entering = if slope < 0.0 { t } else { f64::NEG_INFINITY };
                    let leaving = if slope > 0.0 { t } else { f64::INFINITY };
                    // A ray along the plane, and beyond it.
                    let leaving = if slope == 0.0 && height < 0.0 { f64::NEG_INFINITY } else { leaving };
                    *enter = if entering > *enter { entering } else { *enter };
                    *leave = if leaving < *leave { leaving } else { *leave };
                }
            }
            let at = place_in(self.region, row, &columns);
            let path = self.path_mm.map(|form| [form.at(0.0, r), form.per_column()]);
            let path_mm = |i: usize| {
                let c = column(i);
                path.iter().map(|[p0, p1]| (p0 + p1 * c) * (p0 + p1 * c)).sum::<f64>().sqrt()
            };
            let ends = enter.iter().zip(leave.iter()).enumerate();
            for (length, (i, (enter, leave))) in self.lengths[at.clone()].iter_mut().zip(ends.clone()) {
                // Written so that NaN misses.
                let share = if leave > enter { leave - enter } else { 0.0 };
                *length = share * path_mm(i);
            }
            if let Some(middles) = &mut self.middles {
                for (middle, (i, (enter, leave))) in middles[at].iter_mut().zip(ends) {
                    *middle = 0.5 * (enter + leave) * path_mm(i);
                }
            }
        }
    }
}
