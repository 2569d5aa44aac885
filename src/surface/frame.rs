//! What several kinds of surface share: boxes met by rays, and gaps that rounding opens.

use crate::geometry::numeric::gamma;
use crate::geometry::{Bounds, Ray, Real, Vec3};

/// A ray made ready for many boxes.
#[derive(Clone, Copy, Debug)]
pub struct Slabs<R> {
    origin: Vec3<R>,
    inverse: Vec3<R>,
}

impl<R: Real> Slabs<R> {
    /// Divides by the ray's direction once.
    pub fn new(ray: &Ray<R>) -> Self {
        let one = R::of(1.0);
        Self { origin: ray.origin, inverse: Vec3::new(one / ray.dir.x, one / ray.dir.y, one / ray.dir.z) }
    }

    /// Where the ray enters and leaves a box. `None` if it misses it. Rounding loses no box (Ize 2013, *Robust BVH ray
    /// traversal*).
    pub fn stretch(&self, bounds: &Bounds) -> Option<(R, R)> {
        let (low, high) = (Vec3::<R>::of(bounds.min), Vec3::<R>::of(bounds.max));
        let (a, b) = ((low - self.origin).scaled(self.inverse), (high - self.origin).scaled(self.inverse));
        let near = a.x.min(b.x).max(a.y.min(b.y)).max(a.z.min(b.z));
        let far = a.x.max(b.x).min(a.y.max(b.y)).min(a.z.max(b.z));
        // Three operations to either end.
        let far = far * R::of(1.0 + 2.0 * gamma(3));
        (near <= far).then_some((near, far))
    }

    /// Where the ray enters a box between `from` and `to`; `from` if it starts inside.
    pub fn entry(&self, bounds: &Bounds, from: R, to: R) -> Option<R> {
        let (near, far) = self.stretch(bounds)?;
        let near = near.max(from);
        (near <= far && near <= to).then_some(near)
    }
}

/// How far along a ray rounding may put a surface that the ray meets at this cosine to the normal, when places on it err
/// by `error`: the tangent planes of both places are no farther apart.
pub fn steady_gap(error: f64, cosine: f64) -> f64 {
    2.0 * error / cosine.abs().max(f64::MIN_POSITIVE)
}
