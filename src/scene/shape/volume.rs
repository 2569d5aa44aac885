//! Volumes of cut bodies: exact slice areas, integrated adaptively.
//!
//! Across z a piece is an ellipse, its half-spaces are half-planes, and an affine map makes the ellipse the unit
//! disc: the slice's area is then the area of a disc in a polygon, in closed form. Only the last integral, over z, is
//! numerical.

use super::Cut;
use super::body::{Piece, Quadric};

/// The integral stops refining where two rules agree to this fraction of the whole piece. Well below the 1e-8 that
/// is promised, well above rounding.
const RELATIVE_TOLERANCE: f64 = 1e-11;

/// Bisections of the slice integral's range at most. A slice area's worst points are kinks of order 3/2 or jumps
/// (a cut across z), which bisection isolates by a factor 2 a time: 2⁻⁴⁸ of the range is below the tolerance.
const MAX_BISECTIONS: u32 = 48;

/// Panels to start from, so that no narrow feature hides between the nodes of a single rule.
const PANELS: u32 = 24;

/// The volume of a piece in all `cuts`, mm³, to 1e-8 of the uncut piece. All in local coordinates.
pub(super) fn cut_piece_volume(piece: &Piece, cuts: &[Cut]) -> f64 {
    let Some(quadric) = piece.quadric else { return 0.0 };
    let (mut low, mut high) = match quadric {
        Quadric::Ellipsoid { centre, half_axes } => (centre.z - half_axes.z, centre.z + half_axes.z),
        Quadric::Cone { .. } => (f64::NEG_INFINITY, f64::INFINITY),
    };
    let mut slanted = Vec::new();
    for cut in piece.half_spaces.iter().chain(cuts) {
        match (cut.normal.x == 0.0 && cut.normal.y == 0.0, cut.normal.z > 0.0) {
            (false, _) => slanted.push(*cut),
            (true, true) => high = high.min(cut.offset / cut.normal.z),
            (true, false) => low = low.max(cut.offset / cut.normal.z),
        }
    }
    if low >= high || !(high - low).is_finite() {
        return 0.0;
    }
    let area = |z: f64| slice_area(&quadric, &slanted, z);
    let width = (high - low) / f64::from(PANELS);
    let panels = (0..PANELS).map(|i| {
        let start = low + width * f64::from(i);
        (start, if i + 1 == PANELS { high } else { start + width })
    });
    let uncut = |z: f64| slice_area(&quadric, &[], z);
    let whole: f64 = panels.clone().map(|(a, b)| gauss_kronrod(&uncut, a, b).0).sum();
    let tolerance = RELATIVE_TOLERANCE * whole;
    panels.map(|(a, b)| integrate(&area, a, b, tolerance, MAX_BISECTIONS)).sum::<f64>().max(0.0)
}

/// The area of the slice at height `z`, mm².
fn slice_area(quadric: &Quadric, half_spaces: &[Cut], z: f64) -> f64 {
    let (centre, radii) = match *quadric {
        Quadric::Ellipsoid { centre, half_axes } => {
            let height = (z - centre.z) / half_axes.z;
            let shrink = ((1.0 - height) * (1.0 + height)).max(0.0).sqrt();
            ([centre.x, centre.y], [half_axes.x * shrink, half_axes.y * shrink])
        }
        Quadric::Cone { z0, centre, lean, half_axes, growth } => {
            let dz = z - z0;
            let shrink = (1.0 + growth * dz).max(0.0);
            let at = [centre[0] + lean[0] * dz, centre[1] + lean[1] * dz];
            (at, [half_axes[0] * shrink, half_axes[1] * shrink])
        }
    };
    let half_planes = half_spaces.iter().map(|cut| {
        let offset = cut.offset - cut.normal.z * z - cut.normal.x * centre[0] - cut.normal.y * centre[1];
        ([cut.normal.x * radii[0], cut.normal.y * radii[1]], offset)
    });
    radii[0] * radii[1] * disc_area_within(half_planes)
}

/// The area of the unit disc where `n · p ≤ offset` for all half-planes.
pub(super) fn disc_area_within(half_planes: impl Iterator<Item = ([f64; 2], f64)>) -> f64 {
    let mut polygon = vec![[-2.0, -2.0], [2.0, -2.0], [2.0, 2.0], [-2.0, 2.0]];
    for (normal, offset) in half_planes {
        polygon = clip_polygon(&polygon, normal, offset);
    }
    let edges = (0..polygon.len()).map(|i| (polygon[i], polygon[(i + 1) % polygon.len()]));
    edges.map(|(p, q)| disc_area_under_edge(p, q)).sum()
}

/// The part of a convex polygon where `n · p ≤ offset`: Sutherland–Hodgman.
pub(super) fn clip_polygon(polygon: &[[f64; 2]], normal: [f64; 2], offset: f64) -> Vec<[f64; 2]> {
    let height = |p: [f64; 2]| normal[0] * p[0] + normal[1] * p[1] - offset;
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (i, &p) in polygon.iter().enumerate() {
        let q = polygon[(i + 1) % polygon.len()];
        let (hp, hq) = (height(p), height(q));
        if hp <= 0.0 {
            kept.push(p);
        }
        if (hp < 0.0 && hq > 0.0) || (hp > 0.0 && hq < 0.0) {
            let t = hp / (hp - hq);
            kept.push([p[0] + t * (q[0] - p[0]), p[1] + t * (q[1] - p[1])]);
        }
    }
    kept
}

/// The signed area of the unit disc within the triangle (0, p, q).
fn disc_area_under_edge(p: [f64; 2], q: [f64; 2]) -> f64 {
    let d = [q[0] - p[0], q[1] - p[1]];
    let (a, b) = (dot(d, d), dot(p, d));
    let discriminant = b * b - a * (dot(p, p) - 1.0);
    if a == 0.0 {
        return 0.0;
    }
    if discriminant <= 0.0 {
        return sector(p, q);
    }
    let root = discriminant.sqrt();
    let (enter, leave) = (((-b - root) / a).clamp(0.0, 1.0), ((-b + root) / a).clamp(0.0, 1.0));
    let at = |t: f64| [p[0] + t * d[0], p[1] + t * d[1]];
    if enter == leave {
        return sector(p, q);
    }
    sector(p, at(enter)) + 0.5 * cross(at(enter), at(leave)) + sector(at(leave), q)
}

/// The signed area of the unit disc's sector from the direction of `p` to that of `q`.
fn sector(p: [f64; 2], q: [f64; 2]) -> f64 {
    0.5 * cross(p, q).atan2(dot(p, q))
}

fn dot(p: [f64; 2], q: [f64; 2]) -> f64 {
    p[0] * q[0] + p[1] * q[1]
}

fn cross(p: [f64; 2], q: [f64; 2]) -> f64 {
    p[0] * q[1] - p[1] * q[0]
}

/// Adaptive bisection on the 7–15-point Gauss–Kronrod pair.
fn integrate(f: &impl Fn(f64) -> f64, a: f64, b: f64, tolerance: f64, bisections: u32) -> f64 {
    let (value, error) = gauss_kronrod(f, a, b);
    if error <= tolerance || bisections == 0 {
        return value;
    }
    let middle = 0.5 * (a + b);
    integrate(f, a, middle, tolerance, bisections - 1) + integrate(f, middle, b, tolerance, bisections - 1)
}

/// The 15-point Kronrod value and its difference from the 7-point Gauss value. Nodes and weights: QUADPACK
/// (Piessens et al. 1983), qk15.
fn gauss_kronrod(f: &impl Fn(f64) -> f64, a: f64, b: f64) -> (f64, f64) {
    const NODES: [f64; 8] = [
        0.991_455_371_120_812_6,
        0.949_107_912_342_758_5,
        0.864_864_423_359_769_1,
        0.741_531_185_599_394_4,
        0.586_087_235_467_691_1,
        0.405_845_151_377_397_2,
        0.207_784_955_007_898_47,
        0.0,
    ];
    const KRONROD: [f64; 8] = [
        0.022_935_322_010_529_224,
        0.063_092_092_629_978_55,
        0.104_790_010_322_250_18,
        0.140_653_259_715_525_92,
        0.169_004_726_639_267_9,
        0.190_350_578_064_785_4,
        0.204_432_940_075_298_9,
        0.209_482_141_084_727_83,
    ];
    const GAUSS: [f64; 4] =
        [0.129_484_966_168_869_7, 0.279_705_391_489_276_64, 0.381_830_050_505_118_9, 0.417_959_183_673_469_4];
    let (centre, half) = (0.5 * (a + b), 0.5 * (b - a));
    let (mut kronrod, mut gauss) = (0.0, 0.0);
    for i in 0..8 {
        let pair = if i == 7 { f(centre) } else { f(centre - half * NODES[i]) + f(centre + half * NODES[i]) };
        kronrod += KRONROD[i] * pair;
        if i % 2 == 1 {
            gauss += GAUSS[i / 2] * pair;
        }
    }
    (half * kronrod, (half * (kronrod - gauss)).abs())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use glam::DVec3;

    use super::*;

    fn ball() -> Piece {
        let quadric = Quadric::Ellipsoid { centre: DVec3::new(3.0, -2.0, 7.0), half_axes: DVec3::splat(5.0) };
        Piece { quadric: Some(quadric), half_spaces: vec![] }
    }

    fn cut_at(normal: DVec3, depth: f64) -> Cut {
        let normal = normal.normalize();
        Cut { normal, offset: normal.dot(DVec3::new(3.0, -2.0, 7.0)) + depth }
    }

    #[test]
    fn a_cap_cut_in_any_direction_has_its_closed_form() {
        // Cap of height h on a ball of radius r: π h² (3r − h) / 3.
        for normal in
            [DVec3::X, DVec3::Z, DVec3::NEG_Z, DVec3::new(1.0, -2.0, 0.5), DVec3::new(1e-9, 0.0, 1.0)]
        {
            for depth in [-4.9, -1.0, 0.0, 2.0, 4.99] {
                let kept = 5.0 + depth;
                let expected = PI * kept * kept * (15.0 - kept) / 3.0;
                let volume = cut_piece_volume(&ball(), &[cut_at(normal, depth)]);
                let whole = 4.0 / 3.0 * PI * 125.0;
                assert!((volume - expected).abs() < 1e-10 * whole, "{normal} {depth}: {volume} {expected}");
            }
        }
    }

    #[test]
    fn an_octant_is_an_eighth_and_nothing_is_nothing() {
        let cuts = [cut_at(DVec3::X, 0.0), cut_at(DVec3::NEG_Y, 0.0), cut_at(DVec3::new(0.0, 0.0, 1.0), 0.0)];
        let eighth = PI * 125.0 / 6.0;
        assert!((cut_piece_volume(&ball(), &cuts) - eighth).abs() < 1e-9 * eighth);
        assert_eq!(cut_piece_volume(&ball(), &[cut_at(DVec3::X, -5.1)]), 0.0);
    }

    #[test]
    fn a_wedge_of_two_planes_through_the_axis_has_its_angle() {
        let angle = 0.7;
        let cuts =
            [cut_at(DVec3::NEG_Y, 0.0), cut_at(DVec3::new(-f64::sin(angle), f64::cos(angle), 0.0), 0.0)];
        let expected = 2.0 / 3.0 * angle * 125.0;
        assert!((cut_piece_volume(&ball(), &cuts) - expected).abs() < 1e-9 * expected);
    }
}
