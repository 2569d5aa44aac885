//! Surfaces of revolution as Bezier patches.

use glam::{DVec2, DVec3};

use super::patch::BezierPatch;

/// The control distance of the cubic that stands for a quarter circle, (4/3)(√2 − 1): it meets the circle at both ends
/// and in the middle and lies outside in between, by at most 2.73·10⁻⁴ of the radius.
pub const ARC: f64 = 0.552_284_749_830_793_4;

/// How far the cubic lies beyond the quarter circle, at most, as a share of the radius.
#[cfg(test)]
pub(super) const ARC_EXCESS: f64 = 2.73e-4;

/// The patches of a profile of cubic Bezier curves of (radius, height), turned about the z axis: four for each curve.
/// Quarter circles are the standard cubics ([`ARC`]), not rational ones, so that bicubic patches serve. Normals point away
/// from the axis where the profile runs upwards.
pub fn revolve(profile: &[[DVec2; 4]]) -> Vec<BezierPatch> {
    let quarter = |[x, y]: [DVec2; 2]| [x, x + ARC * y, ARC * x + y, y];
    let axes = [DVec2::X, DVec2::Y, -DVec2::X, -DVec2::Y];
    profile
        .iter()
        .flat_map(|curve| {
            (0..4).map(move |k| {
                let arc = quarter([axes[k], axes[(k + 1) % 4]]);
                BezierPatch::new(arc.map(|c| curve.map(|p| DVec3::new(p.x * c.x, p.x * c.y, p.y))))
            })
        })
        .collect()
}
