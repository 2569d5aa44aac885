//! The bodies: ellipsoids, turned so that no axis of theirs is one of the world's.

use chordfield::geometry::primitives::icosphere;
use chordfield::geometry::{ClosedMesh, TriMesh};
use glam::{DMat3, DVec3, EulerRot};

/// The benchmark's body has these half-axes before it is turned.
pub const HALF_AXES_MM: DVec3 = DVec3::new(100.0, 80.0, 60.0);

/// Subdivisions of the icosahedron: 1 280, 20 480 and 327 680 faces.
pub const SUBDIVISIONS: [u32; 3] = [3, 5, 7];

/// A turned ellipsoid about the origin.
#[derive(Clone, Copy, Debug)]
pub struct Ellipsoid {
    /// Half of each axis, mm.
    pub half_axes_mm: DVec3,
}

impl Ellipsoid {
    /// The benchmark's body.
    pub const BENCH: Self = Self { half_axes_mm: HALF_AXES_MM };

    /// How all ellipsoids are turned: about z, y and x, in radians.
    pub fn turn() -> DMat3 {
        DMat3::from_euler(EulerRot::ZYX, 0.7, -0.4, 0.3)
    }

    /// The inscribed mesh of an icosphere's faces.
    pub fn mesh(&self, subdivisions: u32) -> TriMesh {
        let place = Self::turn() * DMat3::from_diagonal(self.half_axes_mm);
        icosphere(subdivisions).map_vertices(|v| place * v)
    }

    /// The inscribed mesh as a surface.
    pub fn surface(&self, subdivisions: u32) -> ClosedMesh {
        closed(self.mesh(subdivisions))
    }

    /// How far the surface reaches along a unit vector, mm.
    pub fn reach_mm(&self, along: DVec3) -> f64 {
        (self.half_axes_mm * (Self::turn().transpose() * along)).length()
    }

    /// The symmetric form whose value is 1 on the surface, mm⁻².
    pub fn form(&self) -> DMat3 {
        let squares = DMat3::from_diagonal((self.half_axes_mm * self.half_axes_mm).recip());
        Self::turn() * squares * Self::turn().transpose()
    }
}

/// The surface of a mesh that is closed by construction.
pub fn closed(mesh: TriMesh) -> ClosedMesh {
    ClosedMesh::new(mesh).expect("icospheres are closed").0
}
