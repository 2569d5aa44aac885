//! A surface in the image: where each of its patches is seen.

use std::borrow::Cow;

use rayon::prelude::*;

use super::aspect::Aspect;
use super::face::Care;
use super::near::Cut;
use super::patches::Patches;
use super::pixels::Pixels;
use super::projection::{Projection, Sight};
use super::{chords, edge_on};
use crate::exact::round;
use crate::geometry::numeric::gamma;
use crate::geometry::{ClosedMesh, RayGrid, Upstream};

/// A surface in the image.
#[derive(Clone, Debug)]
pub struct Seen<'a> {
    pub projection: Projection,
    pub patches: Cow<'a, Patches>,
    /// Where each patch is seen.
    sights: Vec<PatchSight>,
    /// The pixels that a face may cover.
    pub bounds: Pixels,
    pub source_is_inside: bool,
    /// Whether faces cover few pixels each, and the source is not inside: see `chords`.
    pub is_fine: bool,
    pub crossing_error: f64,
    pub place_error: f64,
    pub care: Care,
}

/// Where a patch is seen.
#[derive(Clone, Debug)]
pub struct PatchSight {
    /// The pixels that its faces may cover, and one more on all sides: a pixel on the outline may lie on an edge-on face.
    around: Pixels,
    /// Whether any of its points lies on a line of pixels. A face that lies on a pixel has it in its box, unless a corner lies
    /// on such a line; then all of a patch's faces are looked at, and not only those that may cover pixels.
    pub is_on_a_line: bool,
}

/// Fewer patches are looked at sooner than another thread would have begun.
const PATCHES_PER_JOB: usize = 256;

/// Places that err by more than this, in pixels, are not used. They usually err by 1e-11.
const LARGEST_PLACE_ERROR: f64 = 1e-4;

impl<'a> Seen<'a> {
    /// A surface all of whose points have a place. `None` if they err too much.
    pub fn plain(
        surface: &ClosedMesh,
        patches: Cow<'a, Patches>,
        projection: Projection,
        sight: &Sight,
        window: &Pixels,
    ) -> Option<Self> {
        let extent = [sight.columns, sight.rows].as_flattened().iter().fold(0.0, |e: f64, x| e.max(x.abs()));
        let error = projection.place_error(&surface.bounds(), sight.shares[0], 1.0 + extent);
        // A crossing may not be off by more than one part in as many of its depth.
        let depth = if projection.is_cone() {
            1.0 / sight.shares[1]
        } else {
            sight.shares[0].abs().max(sight.shares[1].abs())
        };
        let errors = Errors { place: error, extent: 1.0 + extent, depth };
        Self::new(projection, patches, errors, false, window)
    }

    /// A surface from which is cut off what the rays of a cone cannot see. `None` if the source is too near.
    pub fn cut(
        surface: &ClosedMesh,
        grid: &RayGrid,
        projection: Projection,
        window: &Pixels,
    ) -> Option<Self> {
        let Upstream::Source(source) = grid.upstream() else { return None };
        let Cut { places, corners, numbers, source_is_inside, share } =
            Cut::new(surface, grid, &projection, source)?;
        let used = || corners.iter().flatten().map(|&v| places[v as usize]);
        let extent = used().fold(1.0, |e: f64, p| e.max(p.x.abs()).max(p.y.abs()));
        let depth = used().fold(f64::INFINITY, |least, p| least.min(p.depth));
        let error = projection.place_error(&surface.bounds(), share, extent);
        let patches = Cow::Owned(Patches::of_places(&corners, &numbers, &places));
        Self::new(projection, patches, Errors { place: error, extent, depth }, source_is_inside, window)
    }

    fn new(
        projection: Projection,
        patches: Cow<'a, Patches>,
        errors: Errors,
        source_is_inside: bool,
        window: &Pixels,
    ) -> Option<Self> {
        // Written so that NaN is not sound.
        let is_sound = errors.place < LARGEST_PLACE_ERROR && errors.extent < round::LARGEST;
        if !is_sound {
            return None;
        }
        let near_a_line = 2.0 * edge_on::NEAR * errors.place;
        let jobs: Vec<usize> = (0..patches.count()).step_by(PATCHES_PER_JOB).collect();
        let look = |&first: &usize| {
            let range = first..patches.count().min(first + PATCHES_PER_JOB);
            let sights = Look { patches: &patches, projection: &projection, range, near_a_line };
            crate::dispatch::arch().dispatch(sights)
        };
        let sights: Vec<Vec<PatchSight>> = jobs.par_iter().map(look).collect();
        let sights = sights.concat();
        let all = sights.iter().fold(Pixels::NONE, |all, sight| all.union(&sight.around));
        let bounds = if source_is_inside { window.clone() } else { all.intersection(window) };
        let pixels = bounds.columns.len() * bounds.rows.len();
        Some(Self {
            is_fine: !source_is_inside && pixels <= chords::MOST_PIXELS * patches.face_count(),
            projection,
            patches,
            sights,
            bounds,
            source_is_inside,
            // A difference, a slope of three roundings, a product and a sum: γ₅ of twice the extent, and γ₁ of it.
            crossing_error: gamma(12) * errors.extent,
            place_error: errors.place,
            care: Care::new(errors.place, errors.depth),
        })
    }

    /// Where a patch is seen.
    pub fn sight(&self, patch: u32) -> &PatchSight {
        &self.sights[patch as usize]
    }

    /// Lists the patches that may be seen in a region, of those `among` which there are, or of all. Their order is the same for
    /// all regions.
    pub fn list_near(&self, region: &Pixels, among: Option<&[u32]>, near: &mut Vec<u32>) {
        near.clear();
        let is_near = |&patch: &u32| self.sights[patch as usize].around.meets(region);
        match among {
            Some(among) => near.extend(among.iter().copied().filter(is_near)),
            None => near.extend((0..self.sights.len() as u32).filter(is_near)),
        }
    }
}

struct Errors {
    place: f64,
    extent: f64,
    depth: f64,
}

/// A look at some patches.
struct Look<'p> {
    patches: &'p Patches,
    projection: &'p Projection,
    range: std::ops::Range<usize>,
    near_a_line: f64,
}

impl pulp::WithSimd for Look<'_> {
    type Output = Vec<PatchSight>;

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> Vec<PatchSight> {
        let mut aspect = Aspect::default();
        let mut sights = Vec::with_capacity(self.range.len());
        for patch in self.range {
            let patch = self.patches.get(patch);
            let count = patch.points[0].len();
            aspect.place_points(&patch, self.projection, self.patches.are_places());
            sights.push(PatchSight {
                around: aspect.pixels_of_points(count).grown(1),
                is_on_a_line: aspect.is_near_a_line(count, self.near_a_line),
            });
        }
        sights
    }
}
