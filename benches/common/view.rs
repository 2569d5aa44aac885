//! Windows that a silhouette fills.
//!
//! ```text
//!             ╭┬──────╮┬╮   columns run along the silhouette's long axis; the outermost corners
//!   source ◁──┼  body  ┼│   of the mesh lie on the window's four sides, so that π/4 of the rays hit
//!             ╰┴──────┴╯╯
//! ```

use chordfield::geometry::{RayGrid, TriMesh, Upstream};
use glam::{DVec2, DVec3};

use crate::body::Ellipsoid;

/// Where the benchmark's source stands, from the body's centre: askew to the axes of body and world.
pub const SOURCE_AWAY: DVec3 = DVec3::new(0.36, -0.8, 0.48);

/// From the source to the body's centre.
pub const SOURCE_DISTANCE_MM: f64 = 500.0;

/// The detector stands this many times as far from the source as the centre.
const MAGNIFICATION: f64 = 2.0;

/// A pinhole's frame: its source, and the axes of the plane that its rays go to.
pub struct Frame {
    source: DVec3,
    /// Towards the centre, of the length of that distance.
    depth: DVec3,
    right: DVec3,
    down: DVec3,
}

impl Frame {
    /// Looks at the origin from `source`, columns along an axis of the silhouette of `body` about the origin.
    pub fn along_silhouette(source: DVec3, body: &Ellipsoid) -> Self {
        let (x, y) = source.normalize().any_orthonormal_pair();
        // A ray's direction d touches the ellipsoid where (sᵀAd)² − (sᵀAs − 1)·dᵀAd = 0: a conic across the axis.
        let form = body.form();
        let tangent = |a: DVec3, b: DVec3| {
            let (s, sa) = (source, form * source);
            sa.dot(a) * sa.dot(b) - (s.dot(sa) - 1.0) * a.dot(form * b)
        };
        let roll = 0.5 * (2.0 * tangent(x, y)).atan2(tangent(x, x) - tangent(y, y));
        let (sin, cos) = roll.sin_cos();
        Self { source, depth: -source, right: cos * x + sin * y, down: cos * y - sin * x }
    }

    /// Looks at the origin from `source`, columns along `right`, which must be across.
    pub fn along(source: DVec3, right: DVec3) -> Self {
        Self { source, depth: -source, right, down: right.cross(source.normalize()) }
    }

    /// Where the ray to a point meets the plane through the centre, mm right and down.
    pub fn project(&self, point: DVec3) -> DVec2 {
        let from = point - self.source;
        let scale = self.depth.length_squared() / from.dot(self.depth);
        scale * DVec2::new(from.dot(self.right), from.dot(self.down))
    }

    /// The grid of `size`² rays, in the middles of equal pixels, whose window the meshes' corners fill.
    pub fn window<'a>(&self, meshes: impl IntoIterator<Item = &'a TriMesh>, size: u32) -> RayGrid {
        let (mut low, mut high) = (DVec2::INFINITY, DVec2::NEG_INFINITY);
        for corner in meshes.into_iter().flat_map(|mesh| &mesh.vertices) {
            let place = self.project(*corner);
            (low, high) = (low.min(place), high.max(place));
        }
        let pixel = (high - low) / f64::from(size);
        let first = low + 0.5 * pixel;
        let steps = [MAGNIFICATION * pixel.x * self.right, MAGNIFICATION * pixel.y * self.down];
        let origin = self.source + MAGNIFICATION * (self.depth + first.x * self.right + first.y * self.down);
        RayGrid::new(Upstream::Source(self.source), origin, steps, [size, size]).expect("a window")
    }
}

/// The benchmark's view of its body.
pub fn window(mesh: &TriMesh, size: u32) -> RayGrid {
    let source = SOURCE_DISTANCE_MM * SOURCE_AWAY;
    Frame::along_silhouette(source, &Ellipsoid::BENCH).window([mesh], size)
}
