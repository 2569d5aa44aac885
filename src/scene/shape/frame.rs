//! Where a shape stands: rotated about its local origin, then moved.

use glam::{DMat3, DVec3};

use super::{Cut, ShapeProblem};
use crate::geometry::{Line, UnitDir};

/// How far the rows of `axes` may be from an orthonormal frame. Published frames are printed with four digits, so
/// lengths and angles miss by up to about 1e-4; what differs more is a mistake. Accepted frames are made orthonormal.
const AXES_TOLERANCE: f64 = 5e-4;

/// `organ = rotation · local + translation`, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::scene) struct Frame {
    /// `None` leaves every bit of a coordinate as it is.
    rotation: Option<DMat3>,
    translation: DVec3,
}

impl Frame {
    /// The frame of a shape that is only moved.
    pub fn moved(translation: DVec3) -> Self {
        Self { rotation: None, translation }
    }

    /// Turned about the fixed x axis, then y, then z, in degrees; then moved.
    pub fn turned(degrees: DVec3, translation: DVec3) -> Self {
        let rotation = about_z(degrees.z) * about_y(degrees.y) * about_x(degrees.x);
        Self { rotation: (rotation != DMat3::IDENTITY).then_some(rotation), translation }
    }

    /// Local axes given as rows in organ coordinates, `local = axes · (organ − translation)`.
    ///
    /// Errors if the rows are not an orthonormal right-handed frame within [`AXES_TOLERANCE`].
    pub fn of_axes(rows: [DVec3; 3], translation: DVec3) -> Result<Self, ShapeProblem> {
        let [x, y, z] = rows;
        let skew = [x.length() - 1.0, y.length() - 1.0, z.length() - 1.0, x.dot(y), y.dot(z), z.dot(x)]
            .into_iter()
            .fold(0.0, |worst: f64, miss| worst.max(miss.abs()));
        if skew.is_nan() || skew > AXES_TOLERANCE {
            return Err(ShapeProblem::new(
                "axes",
                format!("the rows miss an orthonormal frame by {skew:.2e}"),
                "give three unit vectors at right angles, or use `rotate_deg`",
            ));
        }
        if x.cross(y).dot(z) < 0.0 {
            return Err(ShapeProblem::new(
                "axes",
                "the rows are a left-handed frame, which would mirror the shape",
                "reverse one row; mirror a shape by its numbers instead",
            ));
        }
        let z = z.normalize();
        let x = (x - x.dot(z) * z).normalize();
        let rotation = DMat3::from_cols(x, z.cross(x), z);
        Ok(Self { rotation: (rotation != DMat3::IDENTITY).then_some(rotation), translation })
    }

    /// From local to organ coordinates, mm.
    pub fn to_organ(self, local: DVec3) -> DVec3 {
        self.rotation.map_or(local, |r| r * local) + self.translation
    }

    /// From organ to local coordinates, mm.
    pub fn to_local(self, organ: DVec3) -> DVec3 {
        let relative = organ - self.translation;
        self.rotation.map_or(relative, |r| r.transpose() * relative)
    }

    /// A line in local coordinates; parameters are kept, because a rotation keeps lengths.
    pub fn line_to_local(self, line: &Line) -> Option<Line> {
        let dir = self.rotation.map_or(line.dir(), |r| r.transpose() * line.dir());
        Line::new(self.to_local(line.origin()), UnitDir::new(dir)?)
    }

    /// A half-space of organ coordinates in local ones.
    pub(super) fn cut_to_local(self, cut: &Cut) -> Cut {
        let normal = self.rotation.map_or(cut.normal, |r| r.transpose() * cut.normal);
        Cut { normal, offset: cut.offset - cut.normal.dot(self.translation) }
    }

    /// A half-space of local coordinates in organ ones.
    pub(super) fn cut_to_organ(self, cut: &Cut) -> Cut {
        let normal = self.rotation.map_or(cut.normal, |r| r * cut.normal);
        Cut { normal, offset: cut.offset + normal.dot(self.translation) }
    }
}

fn about_x(degrees: f64) -> DMat3 {
    let (sin, cos) = exact_sin_cos(degrees);
    DMat3::from_cols(DVec3::X, DVec3::new(0.0, cos, sin), DVec3::new(0.0, -sin, cos))
}

fn about_y(degrees: f64) -> DMat3 {
    let (sin, cos) = exact_sin_cos(degrees);
    DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos))
}

fn about_z(degrees: f64) -> DMat3 {
    let (sin, cos) = exact_sin_cos(degrees);
    DMat3::from_cols(DVec3::new(cos, sin, 0.0), DVec3::new(-sin, cos, 0.0), DVec3::Z)
}

/// Sine and cosine of degrees, without rounding at multiples of 90°: a cap turned by a right angle stays flat.
pub(super) fn exact_sin_cos(degrees: f64) -> (f64, f64) {
    match degrees.rem_euclid(360.0) {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        other => other.to_radians().sin_cos(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_angles_are_exact_and_turn_x_before_y_before_z() {
        let frame = Frame::turned(DVec3::new(90.0, 90.0, 0.0), DVec3::ZERO);
        // About x: z goes to −y; about y: −y stays.
        assert_eq!(frame.to_organ(DVec3::Z), DVec3::NEG_Y);
        // About x: y goes to z; about y: z goes to x.
        assert_eq!(frame.to_organ(DVec3::Y), DVec3::X);
        assert_eq!(frame.to_local(DVec3::X), DVec3::Y);
    }

    #[test]
    fn axes_are_the_local_axes_written_as_rows() {
        let rows = [DVec3::Y, DVec3::Z, DVec3::X];
        let frame = Frame::of_axes(rows, DVec3::new(1.0, 2.0, 3.0)).expect("a frame");
        assert_eq!(frame.to_organ(DVec3::X), DVec3::new(1.0, 3.0, 3.0));
        assert_eq!(frame.to_local(DVec3::new(1.0, 3.0, 3.0)), DVec3::X);
    }

    #[test]
    fn skew_and_left_handed_axes_are_refused() {
        let skew = [DVec3::X, DVec3::new(0.01, 1.0, 0.0), DVec3::Z];
        assert_eq!(Frame::of_axes(skew, DVec3::ZERO).expect_err("skew").key, "axes");
        let mirrored = [DVec3::X, DVec3::Z, DVec3::Y];
        assert!(Frame::of_axes(mirrored, DVec3::ZERO).expect_err("mirrored").problem.contains("left-handed"));
    }
}
