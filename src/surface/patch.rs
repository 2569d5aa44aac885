//! Bicubic Bezier patches.

use glam::DVec3;

use crate::geometry::{Bounds, Real, Vec3};

/// A bicubic Bezier patch: point (i, j) of its net belongs to the i-th Bernstein polynomial in u and the j-th in v.
/// Its normal is S_u × S_v.
#[derive(Clone, Debug, PartialEq)]
pub struct BezierPatch {
    net: [[DVec3; 4]; 4],
}

/// A place on a patch with its tangents.
#[derive(Clone, Copy, Debug)]
pub struct Jet<R> {
    /// S(u, v).
    pub point: Vec3<R>,
    /// ∂S/∂u.
    pub along_u: Vec3<R>,
    /// ∂S/∂v.
    pub along_v: Vec3<R>,
}

impl BezierPatch {
    /// The patch of a net of control points.
    pub fn new(net: [[DVec3; 4]; 4]) -> Self {
        Self { net }
    }

    /// The patch of a net of lower degree, 1 to 3 in each parameter, by degree elevation: the same surface. `None` for
    /// nets of other sizes.
    pub fn elevated(net: &[Vec<DVec3>]) -> Option<Self> {
        let rows: Vec<[DVec3; 4]> = net.iter().map(|row| elevated_curve(row)).collect::<Option<_>>()?;
        let columns: Vec<[DVec3; 4]> = (0..4)
            .map(|j| elevated_curve(&rows.iter().map(|row| row[j]).collect::<Vec<_>>()))
            .collect::<Option<_>>()?;
        Some(Self::new(std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i]))))
    }

    /// The control points.
    pub fn net(&self) -> &[[DVec3; 4]; 4] {
        &self.net
    }

    /// The patch with every control point mapped; of an affine map, the mapped surface.
    pub fn map(&self, map: impl Fn(DVec3) -> DVec3) -> Self {
        Self::new(self.net.map(|row| row.map(&map)))
    }

    /// The box around the control points, and so around the patch.
    pub fn bounds(&self) -> Bounds {
        Bounds::of(self.net.iter().flatten().copied())
    }

    /// The part over [u₀, u₁] × [v₀, v₁] as a patch of its own: its net is the blossom's values at the interval's ends.
    pub fn part(&self, [u0, u1]: [f64; 2], [v0, v1]: [f64; 2]) -> Self {
        let rows = self.net.map(|row| restricted(row, v0, v1));
        let columns: [[DVec3; 4]; 4] =
            std::array::from_fn(|j| restricted(std::array::from_fn(|i| rows[i][j]), u0, u1));
        Self::new(std::array::from_fn(|i| std::array::from_fn(|j| columns[j][i])))
    }

    /// The two halves across u or v, cut at `at`.
    pub fn split(&self, across_u: bool, at: f64) -> [Self; 2] {
        let (low, high, whole) = ([0.0, at], [at, 1.0], [0.0, 1.0]);
        if across_u {
            [self.part(low, whole), self.part(high, whole)]
        } else {
            [self.part(whole, low), self.part(whole, high)]
        }
    }

    /// Place and tangents at (u, v).
    pub fn jet<R: Real>(&self, u: R, v: R) -> Jet<R> {
        let rows = self.net.map(|row| cubic(row.map(Vec3::of), v));
        let (point, along_u) = cubic(rows.map(|(value, _)| value), u);
        let (along_v, _) = cubic(rows.map(|(_, slope)| slope), u);
        Jet { point, along_u, along_v }
    }

    /// The longest differences of neighbouring control vectors from the middle's tangents `a` and `b`: bounds of
    /// |S_u − a| and |S_v − b| on the whole patch, which are weighted means of them.
    pub(super) fn tangent_spread(&self, a: DVec3, b: DVec3) -> [f64; 2] {
        let (mut along_u, mut along_v) = (0.0_f64, 0.0_f64);
        for i in 0..3 {
            for j in 0..4 {
                along_u = along_u.max((3.0 * (self.net[i + 1][j] - self.net[i][j]) - a).length_squared());
                along_v = along_v.max((3.0 * (self.net[j][i + 1] - self.net[j][i]) - b).length_squared());
            }
        }
        [along_u.sqrt(), along_v.sqrt()]
    }

    /// A bound of |S_uu| + 2|S_uv| + |S_vv| on the whole patch, from its second differences.
    pub(super) fn bend(&self) -> f64 {
        let (mut uu, mut uv, mut vv) = (0.0_f64, 0.0_f64, 0.0_f64);
        let p = |i: usize, j: usize| self.net[i][j];
        for k in 0..4 {
            for i in 0..2 {
                uu = uu.max((p(i + 2, k) - 2.0 * p(i + 1, k) + p(i, k)).length_squared());
                vv = vv.max((p(k, i + 2) - 2.0 * p(k, i + 1) + p(k, i)).length_squared());
            }
        }
        for i in 0..3 {
            for j in 0..3 {
                uv = uv.max((p(i + 1, j + 1) - p(i + 1, j) - p(i, j + 1) + p(i, j)).length_squared());
            }
        }
        6.0 * uu.sqrt() + 18.0 * uv.sqrt() + 6.0 * vv.sqrt()
    }
}

/// A cubic Bezier curve's value and derivative at x, by its two quadratic halves (de Casteljau).
fn cubic<R: Real>([a, b, c, d]: [Vec3<R>; 4], x: R) -> (Vec3<R>, Vec3<R>) {
    let y = R::of(1.0) - x;
    let weights = [y * y, R::of(2.0) * x * y, x * x];
    let quadratic = |p: Vec3<R>, q: Vec3<R>, r: Vec3<R>| p * weights[0] + q * weights[1] + r * weights[2];
    let (low, high) = (quadratic(a, b, c), quadratic(b, c, d));
    (low * y + high * x, (high - low) * R::of(3.0))
}

/// The control points of a cubic over [a, b]: its blossom at aaa, aab, abb, bbb.
fn restricted(curve: [DVec3; 4], a: f64, b: f64) -> [DVec3; 4] {
    let blossom = |x: f64, y: f64, z: f64| {
        let [p, q, r, s] = curve;
        let [p, q, r] = [p.lerp(q, x), q.lerp(r, x), r.lerp(s, x)];
        let [p, q] = [p.lerp(q, y), q.lerp(r, y)];
        p.lerp(q, z)
    };
    [blossom(a, a, a), blossom(a, a, b), blossom(a, b, b), blossom(b, b, b)]
}

/// A Bezier curve of degree 1 to 3 as a cubic.
fn elevated_curve(points: &[DVec3]) -> Option<[DVec3; 4]> {
    if !(2..=4).contains(&points.len()) {
        return None;
    }
    let mut points = points.to_vec();
    while points.len() < 4 {
        let n = points.len() as f64;
        let raised = |i: usize| {
            let share = i as f64 / n;
            let before = if i > 0 { points[i - 1] * share } else { DVec3::ZERO };
            before + points.get(i).map_or(DVec3::ZERO, |p| *p * (1.0 - share))
        };
        points = (0..=points.len()).map(raised).collect();
    }
    points.try_into().ok()
}
