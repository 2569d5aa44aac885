//! Directions as places on the six sides of a cube.

use crate::geometry::{Real, Vec3};

/// Where a way from a cube's middle leaves the cube.
#[derive(Clone, Copy, Debug)]
pub struct OnCube<R> {
    /// The side: x, y, z, each from below and from above.
    pub side: usize,
    /// The cell along the two axes after the side's own, in cyclic order.
    pub cell: [usize; 2],
    /// The place, in cells.
    pub at: [R; 2],
}

impl<R: Real> OnCube<R> {
    /// On sides of `cells` × `cells`. The way is not zero.
    #[inline]
    pub fn of(way: Vec3<R>, cells: usize) -> Self {
        let p = way.get().abs();
        let k = if p.x >= p.y && p.x >= p.z { 0 } else { 1 + usize::from(p.z > p.y) };
        let half = R::of(0.5 * cells as f64);
        let over = half / way.axis(k).abs();
        let at = [(k + 1) % 3, (k + 2) % 3].map(|axis| way.axis(axis) * over + half);
        // Rounding may reach beyond the last cell.
        let cell = at.map(|x| (x.get().max(0.0) as usize).min(cells - 1));
        Self { side: 2 * k + usize::from(way.axis(k).get() > 0.0), cell, at }
    }
}
