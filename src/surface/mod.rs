//! Smooth surfaces, where rays meet them, and which way light leaves them.
//!
//! ```text
//!   profile curves ─► revolution ─┐                    ┌─ sphere, disc, block: closed forms
//!   control lattice ─► spline ────┼─► BezierPatch ─► Shell ─┐
//!                                 │   pieces in a hierarchy  ├─► Surface ─► Hit ─► optics ─► Exit
//!   corners and normals ──────────┴───────────────► Mesh ──┘
//! ```
//!
//! Kernels are generic over the number ([`Real`]), so that the operations they take are counted,
//! not estimated. Lengths are in the scene's unit (mm unless it says otherwise).

mod frame;
mod mesh;

pub mod optics;
mod patch;
mod piece;
mod revolution;
mod shell;
mod simple;
mod spline;
#[cfg(test)]
mod tests;

pub use frame::{Slabs, steady_gap};
pub use mesh::SmoothMesh;
pub use patch::BezierPatch;
pub use revolution::{ARC, revolve};
pub use shell::Shell;
pub use simple::{Block, Disc, Sphere};
pub use spline::{lattice_patches, spline_curves};

use crate::geometry::{Bounds, Ray, Real, Vec3};

/// Where a ray meets a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit<R> {
    /// How far along the ray.
    pub t: R,
    /// The unit normal to shade with: outward on closed surfaces.
    pub normal: Vec3<R>,
    /// Whether the ray comes from the side that the surface's own normal points to.
    pub enters: bool,
    /// The equivalence class of the patch: within one, normals vary continuously across edges.
    pub class: u32,
    /// How far rounding may have moved the place, as a length.
    pub error: f64,
    /// The part of the surface that is hit, where it has parts.
    pub part: Option<u32>,
}

/// Which crossings count.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Crossing {
    /// All.
    Any,
    /// From the side of the normal: into a closed surface.
    Entering,
    /// Towards the side of the normal: out of a closed surface.
    Leaving,
}

impl Crossing {
    fn admits(self, enters: bool) -> bool {
        match self {
            Self::Any => true,
            Self::Entering => enters,
            Self::Leaving => !enters,
        }
    }
}

/// The part of a ray that is searched: beyond `from`, not beyond `to`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach<R> {
    /// Hits at this distance or nearer do not count.
    pub from: R,
    /// Hits beyond do not count.
    pub to: R,
    /// Which crossings count.
    pub crossing: Crossing,
    /// The [part](Hit::part) that the ray starts on. Where no line of its slope meets a part twice, it is not searched again.
    pub left: Option<u32>,
    /// How near to a hit its place is to be, as a share of the part that is hit, where it is sought by iteration.
    pub accuracy: f64,
}

/// The [accuracy](Reach::accuracy) of hits in f64, and of those that are told in f32.
const FULL: f64 = 1e-12;
const IN_F32: f64 = 1e-7;

impl<R: Real> Reach<R> {
    /// The whole ray, every crossing.
    pub fn whole() -> Self {
        Self {
            from: R::of(0.0),
            to: R::of(f64::INFINITY),
            crossing: Crossing::Any,
            left: None,
            accuracy: FULL,
        }
    }

    /// As this, for hits that are told in f32: a place is then known to 1e-7 of a part, which is a small share of its surface, and a
    /// normal to some 1e-4 of what it turns by on the part.
    pub fn in_f32(self) -> Self {
        Self { accuracy: IN_F32, ..self }
    }

    /// As this, for one kind of crossing.
    pub fn only(self, crossing: Crossing) -> Self {
        Self { crossing, ..self }
    }

    fn admits(&self, t: R, enters: bool) -> bool {
        t > self.from && t <= self.to && self.crossing.admits(enters)
    }
}

/// A surface of one object.
#[derive(Clone, Debug)]
pub enum Surface {
    /// A sphere.
    Sphere(Sphere),
    /// A flat disc, seen from both sides.
    Disc(Disc),
    /// An axis-aligned box.
    Block(Block),
    /// Bezier patches.
    Shell(Shell),
    /// Triangles with smooth normals.
    Mesh(SmoothMesh),
}

impl Surface {
    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Sphere(s) => s.bounds(),
            Self::Disc(s) => s.bounds(),
            Self::Block(s) => s.bounds(),
            Self::Shell(s) => s.bounds(),
            Self::Mesh(s) => s.bounds(),
        }
    }

    /// The nearest hit within reach. `None` if there is none.
    pub fn hit<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> Option<Hit<R>> {
        match self {
            Self::Sphere(s) => s.hit(ray, reach),
            Self::Disc(s) => s.hit(ray, reach),
            Self::Block(s) => s.hit(ray, reach),
            Self::Shell(s) => s.hit(ray, reach),
            Self::Mesh(s) => s.hit(ray, reach),
        }
    }

    /// Whether there is a hit within reach: as [`hit`](Self::hit), but any will do.
    pub fn is_met<R: Real>(&self, ray: &Ray<R>, reach: Reach<R>) -> bool {
        match self {
            Self::Shell(s) => s.is_met(ray, reach),
            Self::Mesh(s) => s.is_met(ray, reach),
            simple => simple.hit(ray, reach).is_some(),
        }
    }

    /// Whether hits are told by a formula.
    pub fn has_closed_form(&self) -> bool {
        matches!(self, Self::Sphere(_) | Self::Disc(_) | Self::Block(_))
    }

    /// At most so many boxes that hold all of the surface, each a part of it.
    pub fn parts(&self, at_most: usize) -> Vec<Bounds> {
        match self {
            Self::Shell(s) => s.parts(at_most),
            Self::Mesh(s) => s.parts(at_most),
            simple => vec![simple.bounds()],
        }
    }

    /// Points whose hull holds the surface.
    pub fn hull_points(&self) -> Vec<glam::DVec3> {
        match self {
            Self::Shell(s) => s.control_points().collect(),
            Self::Mesh(s) => s.corners().to_vec(),
            other => other.bounds().corners().to_vec(),
        }
    }
}
