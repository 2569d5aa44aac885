//! Surfaces of many Bezier patches, their pieces in a hierarchy of boxes.

use glam::DVec3;
use rayon::prelude::*;

use super::frame::{Slabs, steady_gap};
use super::patch::BezierPatch;
use super::piece::{Piece, Root};
use super::{Hit, Reach};
use crate::geometry::{Bounds, BoxTree, Ray, Real, Search, Vec3};

/// Bezier patches of one object. Patches of one class join smoothly; a ray through a shared edge hits one of the two.
#[derive(Clone, Debug)]
pub struct Shell {
    patches: Vec<BezierPatch>,
    classes: Vec<u32>,
    pieces: Vec<Piece>,
    tree: BoxTree,
    bounds: Bounds,
}

impl Shell {
    /// The surface of patches, each with its equivalence class. `None` if there is none, or a coordinate is not finite.
    pub fn new(patches: Vec<(BezierPatch, u32)>) -> Option<Self> {
        let is_finite = |patch: &BezierPatch| patch.net().iter().flatten().all(|p| p.is_finite());
        if patches.is_empty() || !patches.iter().all(|(patch, _)| is_finite(patch)) {
            return None;
        }
        let (patches, classes): (Vec<_>, Vec<_>) = patches.into_iter().unzip();
        let of_patch = |(index, patch)| Piece::of_patch(patch, index as u32);
        let pieces: Vec<Piece> = patches.par_iter().enumerate().flat_map_iter(of_patch).collect();
        let tree = BoxTree::build(&pieces.iter().map(|piece| piece.bounds).collect::<Vec<_>>());
        let bounds = tree.bounds();
        Some(Self { patches, classes, pieces, tree, bounds })
    }

    /// The box around all patches.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The patches.
    pub fn patches(&self) -> &[BezierPatch] {
        &self.patches
    }

    /// At most so many boxes around all of its pieces.
    pub fn parts(&self, at_most: usize) -> Vec<Bounds> {
        self.tree.parts(at_most)
    }

    /// All control points.
    pub fn control_points(&self) -> impl Iterator<Item = DVec3> + '_ {
        self.patches.iter().flat_map(|patch| patch.net().iter().flatten().copied())
    }

    /// The nearest hit within reach. `None` if there is none.
    pub fn hit<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> Option<Hit<R>> {
        let mut search = Nearest { aim: Aim::new(self, ray), reach, best: None, any: false };
        self.tree.search(&mut search);
        search.best
    }

    /// Whether there is a hit within reach.
    pub fn is_met<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> bool {
        let mut search = Nearest { aim: Aim::new(self, ray), reach, best: None, any: true };
        self.tree.search(&mut search);
        search.best.is_some()
    }

    /// All hits of the whole ray, sorted; a hit on a shared edge counts once.
    pub fn hits<R: Real>(&self, ray: &Ray<R>) -> Vec<Hit<R>> {
        let mut search = All { aim: Aim::new(self, ray), hits: Vec::new() };
        self.tree.search(&mut search);
        let mut hits = search.hits;
        hits.sort_by(|a, b| a.t.get().total_cmp(&b.t.get()));
        hits.dedup_by(|next, kept| {
            let gap = steady_gap(kept.error.max(next.error), ray.dir.dot(kept.normal).get());
            next.enters == kept.enters && (next.t - kept.t).get() <= 2.0 * gap
        });
        hits
    }
}

/// One ray held against one shell.
struct Aim<'a, R> {
    shell: &'a Shell,
    ray: &'a Ray<R>,
    slabs: Slabs<R>,
    /// The ray's origin is no farther from the world's than this.
    magnitude: f64,
}

impl<'a, R: Real> Aim<'a, R> {
    fn new(shell: &'a Shell, ray: &'a Ray<R>) -> Self {
        let magnitude = ray.origin.get().abs().max_element();
        Self { shell, ray, slabs: Slabs::new(ray), magnitude }
    }

    fn roots(&self, item: u32, reach: &Reach<R>, mut found: impl FnMut(Hit<R>)) {
        let piece = &self.shell.pieces[item as usize];
        let patch = &self.shell.patches[piece.patch as usize];
        let class = self.shell.classes[piece.patch as usize];
        let is_leaving = reach.left == Some(item);
        piece.roots(patch, self.ray, self.magnitude, is_leaving, reach.accuracy, &mut |root: Root<R>| {
            let enters = self.ray.dir.dot(root.normal).get() < 0.0;
            found(Hit { t: root.t, normal: root.normal, enters, class, error: root.error, part: Some(item) });
        });
    }
}

struct Nearest<'a, R> {
    aim: Aim<'a, R>,
    reach: Reach<R>,
    best: Option<Hit<R>>,
    /// Whether any hit ends the search.
    any: bool,
}

impl<R: Real> Search for Nearest<'_, R> {
    type Distance = R;

    fn entry(&self, bounds: &Bounds) -> Option<R> {
        self.aim.slabs.entry(bounds, self.reach.from, self.reach.to)
    }

    fn is_beyond(&self, entry: R) -> bool {
        entry > self.reach.to
    }

    fn item(&mut self, item: u32) {
        if self.entry(&self.aim.shell.pieces[item as usize].bounds).is_none() {
            return;
        }
        let searched = self.reach;
        let (reach, best, any) = (&mut self.reach, &mut self.best, self.any);
        self.aim.roots(item, &searched, |hit| {
            if reach.admits(hit.t, hit.enters) {
                reach.to = if any { R::of(f64::NEG_INFINITY) } else { hit.t };
                *best = Some(Hit { normal: hit.normal.normalized(), ..hit });
            }
        });
    }
}

struct All<'a, R> {
    aim: Aim<'a, R>,
    hits: Vec<Hit<R>>,
}

impl<R: Real> Search for All<'_, R> {
    type Distance = R;

    fn entry(&self, bounds: &Bounds) -> Option<R> {
        self.aim.slabs.entry(bounds, R::of(0.0), R::of(f64::INFINITY))
    }

    fn is_beyond(&self, _: R) -> bool {
        false
    }

    fn item(&mut self, item: u32) {
        let hits = &mut self.hits;
        self.aim.roots(item, &Reach::whole(), |hit| {
            if hit.t.get() > 0.0 {
                hits.push(Hit { normal: hit.normal.normalized(), ..hit });
            }
        });
    }
}

/// The vector of a place, for those who have but a hit.
impl<R: Real> Hit<R> {
    /// Where it is.
    pub fn place(&self, ray: &Ray<R>) -> Vec3<R> {
        ray.at(self.t)
    }
}
