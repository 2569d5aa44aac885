//! Points on a smooth body's surface, nearly evenly spaced, mirrored bit for bit.
//!
//! Points stand on rings (ellipses) between poles. A ring is four quarter arcs divided evenly by length, so every
//! ring has a point exactly on each symmetry plane, and mirror images differ in signs only. All points of a ring
//! that lies across the local z axis share the bits of z: caps are flat exactly.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;

/// Steps of the length table of a quarter arc. The table only sets the spacing: points are on the ellipse whatever
/// it says, and 96 steps even out spacing to a few per cent up to aspect ratios of about 20.
const ARC_STEPS: usize = 96;

/// Semi-axes towards −x, −y, −z and +x, +y, +z, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HalfAxes {
    pub negative: DVec3,
    pub positive: DVec3,
}

impl HalfAxes {
    pub fn symmetric(half_axes: DVec3) -> Self {
        Self { negative: half_axes, positive: half_axes }
    }

    fn sum(&self) -> DVec3 {
        self.negative + self.positive
    }
}

/// Which part of a domed surface gets points; the equator belongs to all.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Dome {
    Whole,
    /// The half towards +z.
    Upper,
    /// The half towards −z.
    Lower,
}

/// Points of an ellipsoid, its semi-axes chosen by the sign of each coordinate, about the origin.
pub(super) fn dome(axes: &HalfAxes, part: Dome, spacing_mm: f64) -> Vec<DVec3> {
    // A cut or capped dome ends in a flat ring, so its pole is z.
    let pole = if part == Dome::Whole { most_even_pole(axes.sum()) } else { 2 };
    // Cyclic, so that (first, second, pole) is right-handed.
    let (first, second) = ((pole + 1) % 3, (pole + 2) % 3);
    let place = |u: f64, v: f64, w: f64| {
        let mut p = DVec3::ZERO;
        (p[first], p[second], p[pole]) = (u, v, w);
        p
    };
    let ring_axes =
        [[axes.negative[first], axes.positive[first]], [axes.negative[second], axes.positive[second]]];
    let equator: Vec<DVec3> =
        ring(ring_axes, 1.0, spacing_mm).into_iter().map(|[u, v]| place(u, v, 0.0)).collect();
    let mean_radius = 0.25 * ring_axes.iter().flatten().sum::<f64>();
    let mut points = equator;
    let mut half = |height: f64, sign: f64| {
        let meridian = quarter_arc(mean_radius, height, spacing_mm);
        for &[shrink, rise] in &meridian[1..meridian.len() - 1] {
            let w = sign * (height * rise);
            points.extend(ring(ring_axes, shrink, spacing_mm).into_iter().map(|[u, v]| place(u, v, w)));
        }
        points.push(place(0.0, 0.0, sign * height));
    };
    if part != Dome::Lower {
        half(axes.positive[pole], 1.0);
    }
    if part != Dome::Upper {
        half(axes.negative[pole], -1.0);
    }
    points
}

/// The axis whose rings are nearest to circles: there meridians are alike and spacing is most even.
fn most_even_pole(axes: DVec3) -> usize {
    let unevenness = |pole: usize| {
        let (a, b) = (axes[(pole + 1) % 3], axes[(pole + 2) % 3]);
        (a / b).max(b / a)
    };
    // z wins ties, so that a sphere stands upright.
    [2, 1, 0]
        .into_iter()
        .reduce(|best, p| if unevenness(p) < unevenness(best) { p } else { best })
        .unwrap_or(2)
}

/// Points on an ellipse of given semi-axes `[[−u, +u], [−v, +v]]` times `shrink`, counter-clockwise from +u, with
/// about `spacing_mm` between them, at least four.
pub(super) fn ring(
    [[a_minus, a_plus], [b_minus, b_plus]]: [[f64; 2]; 2],
    shrink: f64,
    spacing_mm: f64,
) -> Vec<[f64; 2]> {
    let mut points = Vec::new();
    let mut quadrant = |a: f64, b: f64, signs: [f64; 2], backwards: bool| {
        let (a, b) = (a * shrink, b * shrink);
        let arc = quarter_arc(a, b, spacing_mm);
        let mut on_ellipse: Vec<[f64; 2]> =
            arc.iter().map(|[cos, sin]| [signs[0] * (a * cos), signs[1] * (b * sin)]).collect();
        if backwards {
            on_ellipse.reverse();
        }
        // The last point is the next quadrant's first.
        on_ellipse.pop();
        points.append(&mut on_ellipse);
    };
    quadrant(a_plus, b_plus, [1.0, 1.0], false);
    quadrant(a_minus, b_plus, [-1.0, 1.0], true);
    quadrant(a_minus, b_minus, [-1.0, -1.0], false);
    quadrant(a_plus, b_minus, [1.0, -1.0], true);
    points
}

/// Cosine and sine of the ellipse's parameter at points that divide a quarter arc evenly by length, both ends exact.
fn quarter_arc(a: f64, b: f64, spacing_mm: f64) -> Vec<[f64; 2]> {
    let step = FRAC_PI_2 / ARC_STEPS as f64;
    let mut lengths = vec![0.0];
    for i in 0..ARC_STEPS {
        let (sin, cos) = ((i as f64 + 0.5) * step).sin_cos();
        lengths.push(lengths[i] + step * (a * sin).hypot(b * cos));
    }
    let total = lengths[ARC_STEPS];
    let parts = (total / spacing_mm).round().max(1.0) as usize;
    let mut arc = vec![[1.0, 0.0]];
    for part in 1..parts {
        let wanted = total * part as f64 / parts as f64;
        let i = lengths.partition_point(|&l| l <= wanted).clamp(1, ARC_STEPS);
        let share = (wanted - lengths[i - 1]) / (lengths[i] - lengths[i - 1]);
        let (sin, cos) = ((i as f64 - 1.0 + share) * step).sin_cos();
        arc.push([cos, sin]);
    }
    arc.push([0.0, 1.0]);
    arc
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_lie_on_the_ellipsoid_and_mirror_bit_for_bit() {
        let axes = DVec3::new(40.0, 15.0, 55.0);
        let points = dome(&HalfAxes::symmetric(axes), Dome::Whole, 4.0);
        for &p in &points {
            assert!(((p / axes).length_squared() - 1.0).abs() < 8.0 * f64::EPSILON);
            for mirror in [DVec3::new(-1.0, 1.0, 1.0), DVec3::new(1.0, -1.0, 1.0), DVec3::new(1.0, 1.0, -1.0)]
            {
                assert!(points.contains(&(p * mirror)), "{p} has no mirror image");
            }
        }
        for axis in 0..3 {
            assert!(points.iter().filter(|p| p[axis] == 0.0).count() > 20, "symmetry plane {axis}");
        }
    }

    #[test]
    fn rings_are_evenly_spaced() {
        let ring = ring([[100.0, 100.0], [40.0, 40.0]], 1.0, 5.0);
        let gaps: Vec<f64> = (0..ring.len())
            .map(|i| {
                let ([x0, y0], [x1, y1]) = (ring[i], ring[(i + 1) % ring.len()]);
                (x1 - x0).hypot(y1 - y0)
            })
            .collect();
        let (least, most) = gaps.iter().fold((f64::MAX, 0.0), |(l, m): (f64, f64), &g| (l.min(g), m.max(g)));
        assert!(most / least < 1.02, "{least}–{most} mm");
    }
}
