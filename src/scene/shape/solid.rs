//! The kinds of shapes: their equations, points and closed-form volumes, in local coordinates.

use std::f64::consts::PI;

use glam::DVec3;

use super::Cut;
use super::body::{Body, Piece, Quadric};
use super::layout::{Dome, HalfAxes, dome, ring};
use super::tube::{EllipticTube, TorusSector};
use crate::geometry::TriMesh;

/// A shape before it is placed and cut. Lengths in mm; numbers are validated by the schema.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Solid {
    Smooth(Smooth),
    /// A convex polyhedron as its own mesh.
    Polytope(TriMesh),
    EllipticTube(EllipticTube),
    TorusSector(TorusSector),
}

/// Convex bodies with curved sides.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Smooth {
    /// Eight octants of ellipsoids, semi-axes by the sign of each coordinate.
    Ellipsoid { centre: DVec3, axes: HalfAxes },
    /// The half of an ellipsoid towards +z.
    HalfEllipsoid { centre: DVec3, half_axes: DVec3 },
    /// Two ellipses of equal shape across z and everything between; `top_scale` is their ratio.
    Frustum { bottom: DVec3, top: DVec3, half_axes: [f64; 2], top_scale: f64 },
    /// An upright elliptic cylinder with half an ellipsoid on top.
    CappedCylinder { bottom: DVec3, height: f64, half_axes: DVec3 },
    /// A half ball below, a round cone frustum above.
    RoundedFrustum { centre: DVec3, radius: f64, top_radius: f64, height: f64 },
}

const fn side(x: f64, y: f64, z: f64, offset: f64) -> Cut {
    Cut { normal: DVec3::new(x, y, z), offset }
}

fn below(z: f64) -> Cut {
    side(0.0, 0.0, 1.0, z)
}

fn above(z: f64) -> Cut {
    side(0.0, 0.0, -1.0, -z)
}

fn cone(bottom: DVec3, top: DVec3, half_axes: [f64; 2], top_scale: f64) -> Quadric {
    let height = top.z - bottom.z;
    Quadric::Cone {
        z0: bottom.z,
        centre: [bottom.x, bottom.y],
        lean: [(top.x - bottom.x) / height, (top.y - bottom.y) / height],
        half_axes,
        growth: (top_scale - 1.0) / height,
    }
}

fn piece(quadric: Quadric, half_spaces: Vec<Cut>) -> Piece {
    Piece { quadric: Some(quadric), half_spaces }
}

impl Smooth {
    /// The equations.
    pub fn body(&self) -> Body {
        match *self {
            Self::Ellipsoid { centre, axes } if axes.negative == axes.positive => Body {
                pieces: vec![piece(Quadric::Ellipsoid { centre, half_axes: axes.positive }, vec![])],
                flat_sides: vec![],
            },
            Self::Ellipsoid { centre, axes } => {
                Body { pieces: (0..8).map(|i| octant(centre, &axes, i)).collect(), flat_sides: vec![] }
            }
            Self::HalfEllipsoid { centre, half_axes } => {
                let base = above(centre.z);
                let pieces = vec![piece(Quadric::Ellipsoid { centre, half_axes }, vec![base])];
                Body { pieces, flat_sides: vec![base] }
            }
            Self::Frustum { bottom, top, half_axes, top_scale } => {
                let caps = vec![above(bottom.z), below(top.z)];
                let pieces = vec![piece(cone(bottom, top, half_axes, top_scale), caps.clone())];
                Body { pieces, flat_sides: caps }
            }
            Self::CappedCylinder { bottom, height, half_axes } => {
                let seam = bottom + height * DVec3::Z;
                let mantle = cone(bottom, seam, [half_axes.x, half_axes.y], 1.0);
                let cap = Quadric::Ellipsoid { centre: seam, half_axes };
                let base = above(bottom.z);
                let pieces = vec![piece(mantle, vec![base, below(seam.z)]), piece(cap, vec![above(seam.z)])];
                Body { pieces, flat_sides: vec![base] }
            }
            Self::RoundedFrustum { centre, radius, top_radius, height } => {
                let top = centre + height * DVec3::Z;
                let ball = Quadric::Ellipsoid { centre, half_axes: DVec3::splat(radius) };
                let mantle = cone(centre, top, [radius; 2], top_radius / radius);
                let lid = below(top.z);
                let pieces =
                    vec![piece(ball, vec![below(centre.z)]), piece(mantle, vec![above(centre.z), lid])];
                Body { pieces, flat_sides: vec![lid] }
            }
        }
    }

    /// Points on the surface, about `spacing_mm` apart where it is curved both ways; mantles need points at their
    /// rims only, because a hull spans them.
    pub fn points(&self, spacing_mm: f64) -> Vec<DVec3> {
        let circle = |centre: DVec3, [a, b]: [f64; 2], scale: f64| -> Vec<DVec3> {
            // The spacing of the wide rim on both rims, so that lines between them are rulings.
            let unit = ring([[a, a], [b, b]], 1.0, spacing_mm);
            unit.into_iter().map(|[u, v]| centre + DVec3::new(u * scale, v * scale, 0.0)).collect()
        };
        let placed = |centre: DVec3, points: Vec<DVec3>| points.into_iter().map(move |p| centre + p);
        match *self {
            Self::Ellipsoid { centre, axes } => {
                placed(centre, dome(&axes, Dome::Whole, spacing_mm)).collect()
            }
            Self::HalfEllipsoid { centre, half_axes } => {
                placed(centre, dome(&HalfAxes::symmetric(half_axes), Dome::Upper, spacing_mm)).collect()
            }
            Self::Frustum { bottom, top, half_axes: [a, b], top_scale } => {
                // Spaced for the wider end.
                let widest = top_scale.max(1.0);
                let axes = [a * widest, b * widest];
                let mut points = circle(bottom, axes, 1.0 / widest);
                if top_scale == 0.0 {
                    points.push(top);
                } else {
                    points.extend(circle(top, axes, top_scale / widest));
                }
                points
            }
            Self::CappedCylinder { bottom, height, half_axes } => {
                let mut points = circle(bottom, [half_axes.x, half_axes.y], 1.0);
                let cap = dome(&HalfAxes::symmetric(half_axes), Dome::Upper, spacing_mm);
                points.extend(placed(bottom + height * DVec3::Z, cap));
                points
            }
            Self::RoundedFrustum { centre, radius, top_radius, height } => {
                let ball = HalfAxes::symmetric(DVec3::splat(radius));
                let mut points: Vec<DVec3> = placed(centre, dome(&ball, Dome::Lower, spacing_mm)).collect();
                points.extend(circle(centre + height * DVec3::Z, [radius; 2], top_radius / radius));
                points
            }
        }
    }

    /// The volume, mm³.
    pub fn volume(&self) -> f64 {
        let frustum = |a: f64, b: f64, height: f64, w: f64| PI * a * b * height * (1.0 + w + w * w) / 3.0;
        match *self {
            Self::Ellipsoid { axes, .. } => PI / 6.0 * (axes.negative + axes.positive).element_product(),
            Self::HalfEllipsoid { half_axes, .. } => 2.0 / 3.0 * PI * half_axes.element_product(),
            Self::Frustum { bottom, top, half_axes: [a, b], top_scale } => {
                frustum(a, b, top.z - bottom.z, top_scale)
            }
            Self::CappedCylinder { height, half_axes, .. } => {
                PI * half_axes.x * half_axes.y * (height + 2.0 / 3.0 * half_axes.z)
            }
            Self::RoundedFrustum { radius, top_radius, height, .. } => {
                2.0 / 3.0 * PI * radius.powi(3) + frustum(radius, radius, height, top_radius / radius)
            }
        }
    }
}

/// The part of a piecewise ellipsoid in one octant; bit `k` of `index` chooses the positive side of axis `k`.
fn octant(centre: DVec3, axes: &HalfAxes, index: usize) -> Piece {
    let mut half_axes = DVec3::ZERO;
    let mut half_spaces = Vec::new();
    for axis in 0..3 {
        let positive = index >> axis & 1 == 1;
        half_axes[axis] = if positive { axes.positive[axis] } else { axes.negative[axis] };
        let mut normal = DVec3::ZERO;
        normal[axis] = if positive { -1.0 } else { 1.0 };
        half_spaces.push(Cut { normal, offset: normal.dot(centre) });
    }
    piece(Quadric::Ellipsoid { centre, half_axes }, half_spaces)
}

/// The half-spaces of a convex mesh, as a body without curved sides.
pub(super) fn polytope_body(mesh: &TriMesh) -> Body {
    let half_spaces: Vec<Cut> = mesh
        .triangles()
        .map(|[a, b, c]| {
            let normal = (b - a).cross(c - a).normalize_or_zero();
            Cut { normal, offset: normal.dot(a) }
        })
        .collect();
    Body { pieces: vec![Piece { quadric: None, half_spaces }], flat_sides: vec![] }
}
