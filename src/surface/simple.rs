//! Spheres, discs and boxes, whose hits have closed forms.

use glam::DVec3;

use super::frame::Slabs;
use super::{Hit, Reach};
use crate::geometry::numeric::gamma;
use crate::geometry::{Bounds, Ray, Real, UnitDir, Vec3};

/// A sphere.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sphere {
    centre: DVec3,
    radius: f64,
}

impl Sphere {
    /// `None` unless all numbers are finite and the radius is positive.
    pub fn new(centre: DVec3, radius: f64) -> Option<Self> {
        (centre.is_finite() && radius.is_finite() && radius > 0.0).then_some(Self { centre, radius })
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        Bounds { min: self.centre - self.radius, max: self.centre + self.radius }
    }

    /// The nearest hit within reach. `None` if there is none.
    ///
    /// The discriminant is taken from the centre's distance to the line, which keeps its digits far away (Hearn & Baker;
    /// Haines et al., *Ray Tracing Gems* 2019, ch. 7).
    pub fn hit<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> Option<Hit<R>> {
        let to_centre = Vec3::of(self.centre) - ray.origin;
        let middle = to_centre.dot(ray.dir);
        let off = to_centre - ray.dir * middle;
        let discriminant = R::of(self.radius * self.radius) - off.dot(off);
        if discriminant.get() <= 0.0 {
            return None;
        }
        let half = discriminant.sqrt();
        let first = [(middle - half, true), (middle + half, false)].into_iter();
        let (t, enters) = first.into_iter().find(|&(t, enters)| reach.admits(t, enters))?;
        let normal = (ray.dir * (t - middle) - off) * R::of(1.0 / self.radius);
        let size = ray.origin.get().abs().max_element() + self.centre.abs().max_element() + self.radius;
        Some(Hit { t, normal, enters, class: 1, error: gamma(16) * size, part: None })
    }
}

/// A flat disc; a large one serves as a table or a wall.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Disc {
    centre: DVec3,
    normal: DVec3,
    radius: f64,
}

impl Disc {
    /// `None` unless all numbers are finite, the radius positive and the normal not zero.
    pub fn new(centre: DVec3, normal: DVec3, radius: f64) -> Option<Self> {
        let normal = UnitDir::new(normal)?.get();
        (centre.is_finite() && radius.is_finite() && radius > 0.0).then_some(Self { centre, normal, radius })
    }

    /// The box around it; flat if it lies across an axis.
    pub fn bounds(&self) -> Bounds {
        let reach = self.radius * (DVec3::ONE - self.normal * self.normal).max(DVec3::ZERO).map(f64::sqrt);
        Bounds { min: self.centre - reach, max: self.centre + reach }
    }

    /// A place mirrored at its plane.
    pub fn mirrored(&self, place: DVec3) -> DVec3 {
        place - 2.0 * (place - self.centre).dot(self.normal) * self.normal
    }

    /// A way mirrored at its plane.
    pub fn mirrored_way(&self, way: DVec3) -> DVec3 {
        way - 2.0 * way.dot(self.normal) * self.normal
    }

    /// The hit, if it is within reach. A ray in the disc's plane does not cross it.
    pub fn hit<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> Option<Hit<R>> {
        let normal = Vec3::of(self.normal);
        let steepness = ray.dir.dot(normal);
        if steepness.get() == 0.0 {
            return None;
        }
        let t = (Vec3::of(self.centre) - ray.origin).dot(normal) / steepness;
        let enters = steepness.get() < 0.0;
        if !reach.admits(t, enters) {
            return None;
        }
        let off = ray.at(t) - Vec3::of(self.centre);
        if off.dot(off).get() > self.radius * self.radius {
            return None;
        }
        let size = ray.origin.get().abs().max_element() + self.centre.abs().max_element() + self.radius;
        Some(Hit { t, normal, enters, class: 1, error: gamma(16) * size, part: None })
    }
}

/// A box along the axes. Each face is a class of its own: normals jump at edges.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Block {
    bounds: Bounds,
}

impl Block {
    /// The box between two corners. `None` if it is flat, inside out or not finite.
    pub fn new(low: DVec3, high: DVec3) -> Option<Self> {
        let size = high - low;
        (size.is_finite() && size.min_element() > 0.0)
            .then_some(Self { bounds: Bounds { min: low, max: high } })
    }

    /// Itself.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// The nearest hit within reach. `None` if there is none.
    pub fn hit<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> Option<Hit<R>> {
        let (near, far) = Slabs::new(ray).stretch(&self.bounds)?;
        let (t, enters) = [(near, true), (far, false)].into_iter().find(|&(t, e)| reach.admits(t, e))?;
        // The face is the one whose plane the place is nearest to, in box units.
        let place = (ray.at(t).get() - self.bounds.centre()) / self.bounds.size();
        let axis = (0..3).fold(0, |best, a| if place[a].abs() > place[best].abs() { a } else { best });
        let mut normal = DVec3::ZERO;
        normal[axis] = place[axis].signum();
        let class = 1 + 2 * axis as u32 + u32::from(place[axis] < 0.0);
        let size = ray.origin.get().abs().max_element() + self.bounds.max.abs().max_element();
        Some(Hit { t, normal: Vec3::of(normal), enters, class, error: gamma(16) * size, part: None })
    }
}
