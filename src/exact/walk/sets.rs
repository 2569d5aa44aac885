//! Walks for sets of rays: the rays of an image, each from where the last one ended, and batches in any order.

use std::hint::black_box;

use super::abreast::{ABREAST, Ranks};
use super::cone::ConeRays;
use super::{Pass, Seeds, Unsure, Walker};
use crate::exact::raster::pixels_around;
use crate::exact::{Record, Way};
use crate::geometry::{Bounds, Interval, RayGrid, Region, Segment, Upstream};

/// Bodies of fewer faces stay in the second-level cache, where reading ahead gains nothing.
const FACES_IN_CACHE: usize = 10_000;

/// Over bodies of as many faces walks wait for memory.
const MANY_FACES: usize = 80_000;

/// Faces for each pixel of the body's rectangle from which on walks begin by the table.
const SPARSE_FACES: u64 = 2;

/// Fewer rows are walked sooner one by one than abreast.
const WORTH_IT: usize = 8;

impl Walker {
    /// Records the crossings of each ray of `region`, numbered row by row, in any order; rays in doubt go to `other`.
    pub fn trace_grid<R: Record>(
        &self,
        grid: &RayGrid,
        region: &Region,
        record: &mut R,
        other: impl FnMut(usize, &Segment, &mut R),
    ) {
        // From pixel to pixel would then be farther than from the table's face.
        let (low, high) = (self.centre - self.reach, self.centre + self.reach);
        let pixels = pixels_around(&Bounds::of([low, high]), grid);
        let is_sparse = self.faces.len() as u64 > SPARSE_FACES * pixels;
        match grid.upstream() {
            _ if region.rows.len() < WORTH_IT => self.trace_rows(grid, region, record, other, is_sparse),
            Upstream::Source(source) if !is_sparse => {
                let rays = ConeRays { walker: self, grid, source, region, record, other };
                crate::dispatch::arch().dispatch(rays);
            }
            _ => self.trace_rows_abreast(grid, region, record, other, is_sparse),
        }
    }

    /// Walks over one row after the other.
    fn trace_rows<R: Record>(
        &self,
        grid: &RayGrid,
        region: &Region,
        record: &mut R,
        mut other: impl FnMut(usize, &Segment, &mut R),
        is_sparse: bool,
    ) {
        let (mut seeds, mut has_missed) = (None, true);
        for (ray, (column, row)) in region.places().enumerate() {
            if column == region.columns.start {
                (seeds, has_missed) = (None, true);
            }
            let target = grid.point(column, row);
            let origin = grid.start_of(target);
            let dir = target - origin;
            // Where one ray misses, the next may pass by far enough to say so at once.
            if has_missed && self.seeds.passes_by(origin, dir) {
                continue;
            }
            let last = seeds.filter(|_| !is_sparse);
            let Some(mut near) = last.or_else(|| self.seeds.near(origin, dir)) else { continue };
            let answer = self.pass_from(origin, dir, &mut near);
            (seeds, has_missed) = (Some(near), answer == Ok(None));
            match answer {
                // The direction reaches from the source to the target: the segment is 0 to 1.
                Ok(Some(pass)) => note(record, ray, &pass, UNIT, dir.length()),
                Ok(None) => {}
                Err(Unsure) => other(ray, &grid.segment(column, row), record),
            }
        }
    }

    /// Walks over many rows abreast, column by column.
    fn trace_rows_abreast<R: Record>(
        &self,
        grid: &RayGrid,
        region: &Region,
        record: &mut R,
        mut other: impl FnMut(usize, &Segment, &mut R),
        is_sparse: bool,
    ) {
        let mut ranks = Ranks::default();
        for top in region.rows.clone().step_by(ABREAST) {
            let rows = top..region.rows.end.min(top + ABREAST as u32);
            let (mut seeds, mut has_missed) = ([None; ABREAST], [true; ABREAST]);
            for column in region.columns.clone() {
                let mut lines = [None; ABREAST];
                for (j, row) in rows.clone().enumerate() {
                    let target = grid.point(column, row);
                    let origin = grid.start_of(target);
                    let dir = target - origin;
                    // Where one ray misses, the next may pass by far enough to say so at once.
                    if has_missed[j] && self.seeds.passes_by(origin, dir) {
                        continue;
                    }
                    let last = seeds[j].filter(|_| !is_sparse);
                    let near = last.or_else(|| self.seeds.near(origin, dir));
                    has_missed[j] = near.is_none();
                    lines[j] = near.map(|near| (origin, dir, near));
                }
                ranks.walk(self, lines[..rows.len()].iter().copied());
                for (j, row) in rows.clone().enumerate() {
                    let Some((_, dir, _)) = lines[j] else { continue };
                    let ray = (row - region.rows.start) as usize * region.columns.len()
                        + (column - region.columns.start) as usize;
                    let (answer, ended) = ranks.pass(self, j);
                    (seeds[j], has_missed[j]) = (Some(ended), answer == Ok(None));
                    match answer {
                        Ok(Some(pass)) => note(record, ray, &pass, UNIT, dir.length()),
                        Ok(None) => {}
                        Err(Unsure) => other(ray, &grid.segment(column, row), record),
                    }
                }
            }
        }
    }

    /// Records the crossings of each ray, numbered from `first`; rays in doubt go to `other`.
    pub fn trace_batch<R: Record>(
        &self,
        first: usize,
        rays: &[Segment],
        record: &mut R,
        other: impl FnMut(usize, &Segment, &mut R),
    ) {
        crate::dispatch::arch().dispatch(Batch { walker: self, first, rays, record, other });
    }

    /// Reads what the walks will begin with: many reads that do not wait for each other, where each walk would wait for its
    /// own.
    fn touch(&self, seeds: &[Option<Seeds>]) {
        if self.faces.len() < FACES_IN_CACHE {
            return;
        }
        let faces = || {
            let used = seeds.iter().flatten();
            used.flat_map(|s| [&self.faces[s.entry as usize], &self.faces[s.exit as usize]])
        };
        black_box(faces().fold(0, |sum: u32, face| sum.wrapping_add(face.corners[0])));
        let corners = faces().flat_map(|face| face.corners);
        black_box(
            corners.fold(0, |sum: u64, corner| sum.wrapping_add(self.vertices[corner as usize].x.to_bits())),
        );
    }

    /// The same of the faces that walks have come to (4 · face and more).
    #[inline]
    pub(super) fn read_faces(&self, half_edges: &[u32]) {
        if self.faces.len() >= MANY_FACES {
            let faces = half_edges.iter().map(|half_edge| &self.faces[*half_edge as usize / 4]);
            black_box(faces.fold(0, |sum: u32, face| sum.wrapping_add(face.corners[0])));
        }
    }
}

/// Rays in any order.
struct Batch<'t, R, F> {
    walker: &'t Walker,
    first: usize,
    rays: &'t [Segment],
    record: &'t mut R,
    other: F,
}

impl<R: Record, F: FnMut(usize, &Segment, &mut R)> pulp::WithSimd for Batch<'_, R, F> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) {
        let Self { walker, first, rays, record, mut other } = self;
        let (mut ranks, mut near) = (Ranks::default(), [None; ABREAST]);
        for (i, rays) in rays.chunks(ABREAST).enumerate() {
            walker.seeds.near_all(rays, &mut near);
            walker.touch(&near[..rays.len()]);
            let of_ray = |(ray, near): (&Segment, &Option<Seeds>)| {
                near.map(|seeds| (ray.line().origin(), ray.line().dir(), seeds))
            };
            ranks.walk(walker, rays.iter().zip(&near).map(of_ray));
            for (j, ray) in rays.iter().enumerate().filter(|(j, _)| near[*j].is_some()) {
                let number = first + i * ABREAST + j;
                match ranks.pass(walker, j).0 {
                    Ok(Some(pass)) => note(record, number, &pass, ray.reach(), 1.0),
                    Ok(None) => {}
                    Err(Unsure) => other(number, ray, record),
                }
            }
        }
    }
}

/// A whole path, in its own length.
pub(super) const UNIT: Interval = Interval::UNIT;

/// Records a pass, cut to the reach of its ray.
#[inline]
pub(super) fn note(record: &mut impl Record, ray: usize, pass: &Pass, reach: Interval, unit_mm: f64) {
    if let Some(part) = pass.chord.intersection(&reach).filter(|part| part.length() > 0.0) {
        record.crossing(ray, part.start() * unit_mm, pass.entry_face, Way::In);
        record.crossing(ray, part.end() * unit_mm, pass.exit_face, Way::Out);
    }
}
