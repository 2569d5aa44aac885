//! What attributes of surfaces share: lines of one object's box, and the distance of two output rays.

use glam::DVec3;

use super::chord::LEAST_SEPARATION;
use crate::geometry::{Bounds, Ray, Real, Vec3, convex_hull};
use crate::linespace::{Cell, LinePoint, LineSpace, PlanePair};
use crate::surface::Surface;

/// A surface with the line space of a cube around it and the points of its hull.
#[derive(Clone, Debug)]
pub struct SurfaceLines<'a> {
    surface: &'a Surface,
    space: LineSpace,
    hull: Vec<DVec3>,
}

impl<'a> SurfaceLines<'a> {
    /// `None` if the surface has no extent.
    pub fn new(surface: &'a Surface) -> Option<Self> {
        let bounds = surface.bounds();
        // The cube of the longest side, with room for the rounding of depths, which are told in its unit: planes as near to
        // each other as a sheet is thick would tell directions no finer than 30° at the greatest depth.
        let half = DVec3::splat((0.5 + 1e-6) * bounds.size().max_element());
        let space = LineSpace::new(Bounds { min: bounds.centre() - half, max: bounds.centre() + half })?;
        let points = surface.hull_points();
        let hull = convex_hull(&points).map_or(points, |mesh| mesh.vertices);
        Some(Self { surface, space, hull })
    }

    /// The surface.
    pub fn surface(&self) -> &'a Surface {
        self.surface
    }

    /// The line space of a cube around it.
    pub fn space(&self) -> &LineSpace {
        &self.space
    }

    /// A sample's line as a ray from its front plane, outside the object.
    pub fn ray<R: Real>(&self, line: LinePoint) -> Ray<R> {
        self.space.ray_of(line.pair, line.stuv.map(R::of))
    }

    /// Where a ray's line lies in line space.
    pub fn point_of<R: Real>(&self, ray: &Ray<R>) -> LinePoint {
        let pair = self.space.pair_of(ray.dir);
        LinePoint { pair, stuv: self.space.intercepts(ray, pair).map(R::get) }
    }

    /// How far along the dominant axis a place lies, box units.
    pub fn depth<R: Real>(&self, place: Vec3<R>, pair: PlanePair) -> R {
        let [k, ..] = pair.axes();
        (place.axis(k) - R::of(self.space.min()[k])) * R::of(1.0 / self.space.size()[k])
    }

    /// How far along a ray of the pair's direction that depth is reached.
    pub fn distance_to<R: Real>(&self, depth: R, ray: &Ray<R>, pair: PlanePair) -> R {
        let [k, ..] = pair.axes();
        (depth * R::of(self.space.size()[k]) + R::of(self.space.min()[k]) - ray.origin.axis(k))
            / ray.dir.axis(k)
    }

    /// The distance of two rays: that of their intercepts with the planes of the second one's pair (§2.3), box units.
    /// Infinite if the first runs along those planes or the other way.
    pub fn ray_distance<R: Real>(&self, a: &Ray<R>, b: &Ray<R>) -> f64 {
        let pair = self.space.pair_of(b.dir);
        let [k, ..] = pair.axes();
        if a.dir.axis(k).get() * b.dir.axis(k).get() <= 0.0 {
            return f64::INFINITY;
        }
        let (a, b) = (self.space.intercepts(a, pair), self.space.intercepts(b, pair));
        let squares = (0..4).map(|i| (a[i] - b[i]) * (a[i] - b[i]));
        squares.fold(R::of(0.0), |sum, x| sum + x).sqrt().get()
    }

    /// Whether no line of the cell meets the surface, proved: a plane of the cell's [shaft](Cell::shaft_planes) has all of the
    /// hull behind it.
    pub fn is_certainly_empty<R: Real>(&self, pair: PlanePair, cell: &Cell) -> bool {
        let (min, size) = (self.space.min(), self.space.size());
        cell.shaft_planes(pair).any(|(normal, least)| {
            let n = Vec3::<R>::of(normal / size);
            let limit = least - LEAST_SEPARATION + n.dot(Vec3::of(min)).get();
            self.hull.iter().all(|&p| n.dot(Vec3::of(p)).get() < limit)
        })
    }
}
