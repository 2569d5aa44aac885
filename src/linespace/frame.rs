//! The line space of a body's own frame: an affine map under which the body is about a ball.
//!
//! Ratios along a line are kept by affine maps, so that the share of the way between two planes at which a line enters a body
//! is the same in the frame and in the world.

use glam::{DAffine3, DMat3, DVec3};

use super::PlanePair;

/// An affine map between the world and the unit cube that holds a body; the planes of a pair are the cube's faces across
/// an axis. Lines are taken from the plane at 0 to the plane at 1, whichever way they run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LineFrame {
    to_unit: DAffine3,
    from_unit: DAffine3,
}

impl LineFrame {
    /// The frame whose map from mm about `middle` is `to_ball`, turned no further, scaled alike in all directions and moved
    /// so that the box [`low`, `high`] of that map is in the middle of the unit cube. `None` if something is not finite, or
    /// flat.
    pub fn new(middle: DVec3, to_ball: DMat3, low: DVec3, high: DVec3) -> Option<Self> {
        let largest = (high - low).max_element();
        let scale = 1.0 / largest;
        let matrix = scale * to_ball;
        let centre = scale * 0.5 * (low + high);
        let to_unit = DAffine3 { matrix3: matrix, translation: 0.5 - centre - matrix * middle };
        let from_unit = to_unit.inverse();
        (largest > 0.0 && to_unit.is_finite() && from_unit.is_finite()).then_some(Self { to_unit, from_unit })
    }

    /// A point of the world, mm, in the frame.
    #[inline]
    pub fn point(&self, p: DVec3) -> DVec3 {
        self.to_unit.transform_point3(p)
    }

    /// A vector of the world, mm, in the frame.
    #[inline]
    pub fn vector(&self, v: DVec3) -> DVec3 {
        self.to_unit.transform_vector3(v)
    }

    /// One component of a vector of the world, mm, in the frame.
    #[inline]
    pub fn advance(&self, axis: usize, v: DVec3) -> f64 {
        self.to_unit.matrix3.row(axis).dot(v)
    }

    /// A point of the frame in the world, mm.
    pub fn point_mm(&self, p: DVec3) -> DVec3 {
        self.from_unit.transform_point3(p)
    }

    /// The vector whose product with a way in the world, mm, is that of `normal` with the way in the frame.
    pub fn normal_mm(&self, normal: DVec3) -> DVec3 {
        self.to_unit.matrix3.transpose() * normal
    }

    /// The axis along which a line of the world, from `o` along `d`, is dominant in the frame, equal components going to the
    /// earlier axis; and where it meets the planes of that axis' pair. Nothing of it branches, so that many lines may be placed
    /// at a time, with the same bits.
    #[inline(always)]
    pub fn place(&self, o: [f64; 3], d: [f64; 3]) -> (u64, [f64; 4]) {
        let [x, y, z] = self.to_unit.matrix3.to_cols_array_2d();
        let moved = self.to_unit.translation.to_array();
        let turned =
            |v: [f64; 3]| -> [f64; 3] { std::array::from_fn(|a| x[a] * v[0] + y[a] * v[1] + z[a] * v[2]) };
        let (o, d) = (turned(o), turned(d));
        let o: [f64; 3] = std::array::from_fn(|a| o[a] + moved[a]);
        let size = d.map(f64::abs);
        let is_x = (size[0] >= size[1]) & (size[0] >= size[2]);
        let is_z = !is_x & (size[2] > size[1]);
        let pick = |x: f64, y: f64, z: f64| {
            if is_x {
                x
            } else if is_z {
                z
            } else {
                y
            }
        };
        let inverse = 1.0 / pick(d[0], d[1], d[2]);
        let height = pick(o[0], o[1], o[2]);
        let (slope_i, slope_j) = (pick(d[1], d[2], d[0]) * inverse, pick(d[2], d[0], d[1]) * inverse);
        let (s, t) = (pick(o[1], o[2], o[0]) - height * slope_i, pick(o[2], o[0], o[1]) - height * slope_j);
        let axis = if is_x { 0 } else { 1 + u64::from(is_z) };
        (axis, [s, t, s + slope_i, t + slope_j])
    }

    /// The plane pair of an axis.
    #[inline]
    pub fn pair(axis: usize) -> PlanePair {
        PlanePair::ALL[2 * axis]
    }

    /// The vector whose product with a way in the frame is that of `normal` with the way in the world, mm.
    pub fn normal_in_frame(&self, normal: DVec3) -> DVec3 {
        self.from_unit.matrix3.transpose() * normal
    }

    /// The places of a line's two intercepts, mm.
    pub fn ends(&self, axis: usize, [s, t, u, v]: [f64; 4]) -> [DVec3; 2] {
        let place = |plane: f64, across: [f64; 2]| {
            let mut p = DVec3::ZERO;
            p[axis] = plane;
            p[(axis + 1) % 3] = across[0];
            p[(axis + 2) % 3] = across[1];
            self.from_unit.transform_point3(p)
        };
        [place(0.0, [s, t]), place(1.0, [u, v])]
    }
}

/// The squared length, in the frame, of the part of a line between its planes.
#[inline]
pub fn squared_span([s, t, u, v]: &[f64; 4]) -> f64 {
    1.0 + (u - s) * (u - s) + (v - t) * (v - t)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_and_its_intercepts_are_the_same_line() {
        let to_ball = DMat3::from_rotation_y(0.3) * DMat3::from_diagonal(DVec3::new(0.01, 0.3, 2.0));
        let frame = LineFrame::new(
            DVec3::new(5.0, -40.0, 7.0),
            to_ball,
            DVec3::splat(-1.0),
            DVec3::new(1.0, 0.9, 0.5),
        )
        .expect("not flat");
        for (o, d) in [(DVec3::new(9.0, 3.0, -2.0), DVec3::X), (DVec3::ZERO, DVec3::new(-0.2, 0.9, 0.4))] {
            let (axis, stuv) = frame.place(o.to_array(), d.to_array());
            let size = frame.vector(d).abs();
            assert_eq!(size[axis as usize], size.max_element());
            let [start, end] = frame.ends(axis as usize, stuv);
            for place in [start, end] {
                let off = (place - o).cross(d).length() / d.length();
                assert!(off < 1e-9 * place.distance(o).max(1.0), "{off}");
            }
        }
    }
}
