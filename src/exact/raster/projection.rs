//! Where points are seen: in columns and rows of a grid, and how deep.

use glam::DVec3;

use crate::geometry::numeric::gamma;
use crate::geometry::{Bounds, RayGrid, Upstream};

/// A point as a grid's rays see it: in columns and rows (pixel centres are integers), and its depth.
///
/// Depth is a measure that is affine over the image of a plane. With the share of a ray's way that lies before the point
/// (0 at the source, 1 at the pixel), it is 1 / share in a cone and the share itself in a parallel beam.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    pub x: f64,
    pub y: f64,
    pub depth: f64,
}

/// The map from space to a grid's columns, rows and shares.
///
/// A point on the ray to pixel (c, r) is `start + share · (c · column step + r · row step + axis)` in a cone; in a parallel
/// beam only the axis is shared out. So with the inverse of the matrix of those three vectors, a point becomes
/// (c · share, r · share, share) or (c, r, share).
#[derive(Clone, Copy, Debug)]
pub struct Projection {
    start: DVec3,
    /// Rows of the inverse.
    inverse: [DVec3; 3],
    is_cone: bool,
    is_mirrored: bool,
    /// |column step| · |row step| · |axis| over the volume they span: 1 if they are at right angles.
    obliquity: f64,
}

/// What the corners of a body's box tell of all its points.
#[derive(Clone, Copy, Debug)]
pub struct Sight {
    /// The least and the greatest share.
    pub shares: [f64; 2],
    /// The least and the greatest column and row. Meaningless in a cone unless all shares are positive.
    pub columns: [f64; 2],
    pub rows: [f64; 2],
}

impl Projection {
    pub fn new(grid: &RayGrid) -> Self {
        let [column_step, row_step] = grid.steps();
        let (start, axis, is_cone) = match grid.upstream() {
            Upstream::Source(source) => (source, grid.origin() - source, true),
            Upstream::Path(path) => (grid.origin() - path, path, false),
        };
        let volume = column_step.cross(row_step).dot(axis);
        let inverse =
            [row_step.cross(axis), axis.cross(column_step), column_step.cross(row_step)].map(|v| v / volume);
        let obliquity = column_step.length() * row_step.length() * axis.length() / volume.abs();
        Self { start, inverse, is_cone, is_mirrored: volume < 0.0, obliquity }
    }

    /// Whether rays start at one point.
    pub fn is_cone(&self) -> bool {
        self.is_cone
    }

    /// Whether columns, rows and depth are a left-handed frame: a face that looks along the rays is then seen wound clockwise.
    pub fn is_mirrored(&self) -> bool {
        self.is_mirrored
    }

    /// The point before it is divided by its share.
    #[inline(always)]
    pub fn homogeneous(&self, point: DVec3) -> DVec3 {
        let p = point - self.start;
        let [x, y, share] = self.inverse;
        DVec3::new(x.dot(p), y.dot(p), share.dot(p))
    }

    /// The place of a homogeneous point. In a cone, its share must be positive.
    #[inline(always)]
    pub fn place(&self, point: DVec3) -> Place {
        if self.is_cone { self.place_in::<true>(point) } else { self.place_in::<false>(point) }
    }

    /// As [`place`](Self::place), in a cone or in a parallel beam, as it must be.
    #[inline(always)]
    pub fn place_in<const CONE: bool>(&self, point: DVec3) -> Place {
        let depth = if CONE { 1.0 / point.z } else { point.z };
        let scale = if CONE { depth } else { 1.0 };
        Place { x: unless_tiny(point.x * scale), y: unless_tiny(point.y * scale), depth }
    }

    pub fn sight(&self, bounds: &Bounds) -> Sight {
        let mut sight = Sight { shares: NOWHERE, columns: NOWHERE, rows: NOWHERE };
        let add = |[low, high]: &mut [f64; 2], value: f64| (*low, *high) = (low.min(value), high.max(value));
        for corner in bounds.corners() {
            let point = self.homogeneous(corner);
            let place = self.place(point);
            add(&mut sight.shares, point.z);
            add(&mut sight.columns, place.x);
            add(&mut sight.rows, place.y);
        }
        sight
    }

    /// How far rounding may have moved the places of a body's points, in columns or rows, if none has a share below
    /// `least_share` nor is seen farther than `extent` from pixel (0, 0).
    ///
    /// A coordinate is a dot product of a difference (γ₄) with a row of the inverse, which errs by γ₅ in its cross product
    /// and by γ₆ of the obliquity in the volume; the quotient by the share has the error of both, and two roundings more:
    /// at most γ₃₂ of the obliquity, times three for sums of moduli over lengths.
    pub fn place_error(&self, bounds: &Bounds, least_share: f64, extent: f64) -> f64 {
        let distance = bounds.corners().iter().map(|c| (*c - self.start).length()).fold(0.0, f64::max);
        let [x, y, share] = self.inverse.map(|row| row.length() * distance);
        let divisor = if self.is_cone { least_share } else { 1.0 };
        let of_share = if self.is_cone { share * extent } else { 0.0 };
        gamma(96) * self.obliquity * ((x.max(y) + of_share) / divisor).max(extent)
    }
}

const NOWHERE: [f64; 2] = [f64::INFINITY, f64::NEG_INFINITY];

/// Zero for what is far below any rounding of a pixel: products of smaller coordinates would underflow, and the signs of
/// determinants would no longer be exact.
#[inline(always)]
fn unless_tiny(coordinate: f64) -> f64 {
    const TINY: f64 = 1e-60;
    if coordinate.abs() < TINY { 0.0 } else { coordinate }
}
