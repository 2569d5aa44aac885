//! The rays of a sweep, case by case.

use glam::DVec3;
use serde::Serialize;

use crate::exact::Body;
use crate::geometry::Bounds;
use crate::modes::audit::{Aim, Archer};

/// What the rays of a sweep have in common.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Case {
    /// Through a vertex.
    Vertices,
    /// Through a point of an edge.
    Edges,
    /// Along an edge, through both its ends.
    AlongEdges,
    /// In the plane of a face, through a point of it.
    FacePlanes,
    /// Past the farthest vertex of some direction, or through just within it: by 10⁻³ … 10⁻¹⁵ of the body's size.
    Tangents,
    /// On the border of a cell of the body's line space.
    CellBorders,
    /// All but parallel to a plane pair of the body's box.
    PlaneParallel,
    /// Two components of the direction equal in units of the box.
    AxisTies,
    /// Two components of the direction equal in mm, or one unit in the last place apart.
    TiesByUlp,
    /// From a point of a face.
    SourceOn,
    /// From a point of the box, inside the body or close by.
    SourceInside,
    /// From 10⁹ mm away.
    SourceFar,
    /// Along a direction with a denormal component.
    Denormal,
}

/// How far off the sources of [`Case::SourceFar`] are, mm.
const FAR_MM: f64 = 1e9;

impl Case {
    /// All of them.
    pub const ALL: [Self; 13] = [
        Self::Vertices,
        Self::Edges,
        Self::AlongEdges,
        Self::FacePlanes,
        Self::Tangents,
        Self::CellBorders,
        Self::PlaneParallel,
        Self::AxisTies,
        Self::TiesByUlp,
        Self::SourceOn,
        Self::SourceInside,
        Self::SourceFar,
        Self::Denormal,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vertices => "through vertices",
            Self::Edges => "through edges",
            Self::AlongEdges => "along edges",
            Self::FacePlanes => "in planes of faces",
            Self::Tangents => "tangent, 1e-3 to 1e-15 of the size off",
            Self::CellBorders => "on borders of cells",
            Self::PlaneParallel => "all but parallel to a plane pair",
            Self::AxisTies => "ties of the dominant axis",
            Self::TiesByUlp => "ties, and one ulp off",
            Self::SourceOn => "source on the surface",
            Self::SourceInside => "source in the body's box",
            Self::SourceFar => "source 1e9 mm away",
            Self::Denormal => "denormal components",
        }
    }

    /// A ray of the case: its source and its target, mm. `None` if the dice give none.
    pub(super) fn ray(self, body: &Body, archer: &mut Archer) -> Option<[DVec3; 2]> {
        let bounds = body.bounds();
        let mesh = body.surface().mesh();
        let [a, b, c] = mesh.triangle(archer.below(mesh.faces.len() as u64) as usize);
        let aimed = |archer: &mut Archer, aim| archer.aimed(aim, body);
        let (point, dir) = match self {
            Self::Vertices => aimed(archer, Aim::Vertices)?,
            Self::Edges => aimed(archer, Aim::Edges)?,
            Self::FacePlanes => aimed(archer, Aim::Silhouettes)?,
            Self::CellBorders => aimed(archer, Aim::CellBorders)?,
            Self::PlaneParallel => aimed(archer, Aim::PlaneParallel)?,
            Self::AxisTies => aimed(archer, Aim::AxisTies)?,
            Self::AlongEdges => (a, (b - a).try_normalize()?),
            Self::Tangents => tangent(body, archer)?,
            Self::TiesByUlp => (archer.inside(&bounds), tie(archer).try_normalize()?),
            Self::SourceOn => {
                let (u, v) = (archer.unit(), archer.unit());
                let on = if u + v <= 1.0 { a + u * (b - a) + v * (c - a) } else { a };
                return Some([on, on + 2.0 * bounds.diagonal() * archer.direction()]);
            }
            Self::SourceInside => {
                let within = archer.inside(&bounds);
                return Some([within, within + 2.0 * bounds.diagonal() * archer.direction()]);
            }
            Self::SourceFar => {
                let (point, dir) = aimed(archer, Aim::Vertices)?;
                return Some([point - FAR_MM * dir, point + bounds.diagonal() * dir]);
            }
            Self::Denormal => {
                let mut dir = archer.direction();
                // From the least denormal number up; below half an ulp of the target's coordinate it survives only on an
                // axis through 0.
                dir[archer.below(3) as usize] = f64::from_bits(1 + archer.below(1 << 52));
                let mut point = archer.inside(&bounds);
                let axis = archer.below(3) as usize;
                point[axis] = 0.0;
                (point, dir.try_normalize()?)
            }
        };
        Some(across(point, dir, &bounds))
    }
}

/// From before the body to behind it.
fn across(point: DVec3, dir: DVec3, bounds: &Bounds) -> [DVec3; 2] {
    // A power of two, so that points of few digits are hit to the last bit.
    let reach = (2.0 * bounds.diagonal() + (point - bounds.centre()).length()).log2().ceil().exp2();
    [point - reach * dir, point + reach * dir]
}

/// Past a vertex that no other is beyond, in some direction: outside or inside by a small share of the size.
fn tangent(body: &Body, archer: &mut Archer) -> Option<(DVec3, DVec3)> {
    let normal = archer.direction();
    let vertices = body.surface().mesh().vertices.iter();
    let farthest = vertices.copied().max_by(|p, q| normal.dot(*p).total_cmp(&normal.dot(*q)))?;
    let along = normal.cross(archer.direction()).try_normalize()?;
    let off = body.bounds().diagonal() * 10f64.powi(-3 - archer.below(13) as i32);
    let side = if archer.below(2) == 0 { 1.0 } else { -1.0 };
    Some((farthest + side * off * normal, along))
}

/// A direction two of whose components are equal but for the sign and up to an ulp.
fn tie(archer: &mut Archer) -> DVec3 {
    let (equal, third) = (archer.unit().max(1e-3), archer.below(3) as usize);
    let mut dir = DVec3::splat(equal);
    dir[third] = equal * (2.0 * archer.unit() - 1.0);
    let other = (third + 1) % 3;
    dir[other] = match archer.below(3) {
        0 => equal,
        1 => equal.next_up(),
        _ => equal.next_down(),
    };
    if archer.below(2) == 0 {
        dir[other] = -dir[other];
    }
    dir
}
