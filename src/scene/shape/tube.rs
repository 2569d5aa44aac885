//! Closed surfaces that are not convex: walls between two elliptic cylinders, and bent rods.
//!
//! ```text
//!        O₂────O₁          seen along z: the outer polygon is inscribed in its ellipse, the inner one is
//!       ╱ I₂──I₁ ╲         drawn around its own, so the mesh is inside the true wall on both sides and
//!      ╱ ╱      ╲ ╲        walls that do not cross keep not crossing. Opposite points are joined, so
//!     O₃I₃      I₀O₀       caps are strips of quadrilaterals.
//! ```

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::frame::exact_sin_cos;
use super::{Cut, ShapeProblem};
use crate::geometry::TriMesh;

/// An ellipse across z, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Ellipse {
    pub centre: [f64; 2],
    pub half_axes: [f64; 2],
}

impl Ellipse {
    /// The point at parameter `t`, drawn away from the centre by `factor`.
    fn at(&self, t: f64, factor: f64) -> [f64; 2] {
        let (sin, cos) = t.sin_cos();
        [self.centre[0] + factor * self.half_axes[0] * cos, self.centre[1] + factor * self.half_axes[1] * sin]
    }

    fn contains(&self, p: [f64; 2]) -> bool {
        let u = (p[0] - self.centre[0]) / self.half_axes[0];
        let v = (p[1] - self.centre[1]) / self.half_axes[1];
        u * u + v * v <= 1.0
    }

    /// The parameter where the ray from `origin`, inside the ellipse, towards `direction` leaves it.
    fn parameter_of_ray(&self, origin: [f64; 2], direction: [f64; 2]) -> f64 {
        let o = [
            (origin[0] - self.centre[0]) / self.half_axes[0],
            (origin[1] - self.centre[1]) / self.half_axes[1],
        ];
        let d = [direction[0] / self.half_axes[0], direction[1] / self.half_axes[1]];
        let (a, b) = (d[0] * d[0] + d[1] * d[1], o[0] * d[0] + o[1] * d[1]);
        let c = o[0] * o[0] + o[1] * o[1] - 1.0;
        let t = (-b + (b * b - a * c).max(0.0).sqrt()) / a;
        (o[1] + t * d[1]).atan2(o[0] + t * d[0])
    }

    /// The parameters of `range` where `normal · p ≤ offset`; one stretch, or none, or an error for two.
    fn arc_within(&self, range: [f64; 2], normal: [f64; 2], offset: f64) -> Result<Option<[f64; 2]>, ()> {
        let (x, y) = (normal[0] * self.half_axes[0], normal[1] * self.half_axes[1]);
        let level = (offset - normal[0] * self.centre[0] - normal[1] * self.centre[1]) / x.hypot(y);
        if level >= 1.0 {
            return Ok(Some(range));
        }
        if level <= -1.0 {
            return Ok(None);
        }
        let (middle, gap) = (y.atan2(x), level.acos());
        let allowed = [middle + gap, middle + TAU - gap];
        if range[1] - range[0] >= TAU {
            return Ok(Some(allowed));
        }
        let first_turn = ((range[0] - allowed[1]) / TAU).ceil();
        let mut parts = (0..3).filter_map(|k| {
            let shift = TAU * (first_turn + f64::from(k));
            let part = [range[0].max(allowed[0] + shift), range[1].min(allowed[1] + shift)];
            (part[0] < part[1]).then_some(part)
        });
        let part = parts.next();
        if parts.next().is_some() { Err(()) } else { Ok(part) }
    }

    /// `½∮(x dy − y dx)` along the arc: its share of the area by Green's theorem.
    fn green(&self, [t0, t1]: [f64; 2]) -> f64 {
        let ([cx, cy], [a, b]) = (self.centre, self.half_axes);
        0.5 * (a * b * (t1 - t0) + cx * b * (t1.sin() - t0.sin()) - cy * a * (t1.cos() - t0.cos()))
    }
}

/// A wall between two elliptic cylinders along local z, whole or a sector.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct EllipticTube {
    pub outer: Ellipse,
    pub inner: Ellipse,
    pub z: [f64; 2],
    /// Directions from the outer centre, degrees from +x towards +y.
    pub sector_deg: Option<[f64; 2]>,
}

/// What is left of a tube after its sector and cuts: one stretch of each arc.
struct Strip {
    outer: [f64; 2],
    inner: [f64; 2],
    z: [f64; 2],
    closed: bool,
}

impl EllipticTube {
    pub fn contains(&self, p: DVec3) -> bool {
        let xy = [p.x, p.y];
        let in_sector = self.sector_deg.is_none_or(|[from, to]| {
            let angle = (p.y - self.outer.centre[1]).atan2(p.x - self.outer.centre[0]).to_degrees();
            (angle - from).rem_euclid(360.0) <= to - from
        });
        self.z[0] <= p.z
            && p.z <= self.z[1]
            && in_sector
            && self.outer.contains(xy)
            && !self.inner.contains(xy)
    }

    /// Applies sector and cuts. Errors if what remains is not one strip whose ends are straight.
    fn strip(&self, cuts: &[Cut]) -> Result<Strip, ShapeProblem> {
        let full = [0.0, TAU];
        let mut strip = Strip { outer: full, inner: full, z: self.z, closed: self.sector_deg.is_none() };
        if let Some(sector) = self.sector_deg {
            let [from, to] = sector.map(|degrees| {
                let (sin, cos) = exact_sin_cos(degrees);
                [cos, sin]
            });
            for (ellipse, range) in [(&self.outer, &mut strip.outer), (&self.inner, &mut strip.inner)] {
                let start = ellipse.parameter_of_ray(self.outer.centre, from);
                let end = ellipse.parameter_of_ray(self.outer.centre, to);
                *range = [start, start + (end - start).rem_euclid(TAU)];
            }
        }
        for cut in cuts {
            self.cut_strip(&mut strip, cut)?;
        }
        Ok(strip)
    }

    fn cut_strip(&self, strip: &mut Strip, cut: &Cut) -> Result<(), ShapeProblem> {
        let problem = |what: &str, remedy: &str| ShapeProblem::new("cuts", what, remedy);
        let nothing = || problem("nothing is left of the tube", "move the cut or drop the organ");
        if cut.normal.x == 0.0 && cut.normal.y == 0.0 {
            let level = cut.offset / cut.normal.z;
            let [low, high] = &mut strip.z;
            if cut.normal.z > 0.0 {
                *high = high.min(level)
            } else {
                *low = low.max(level)
            }
            return if strip.z[0] < strip.z[1] { Ok(()) } else { Err(nothing()) };
        }
        if cut.normal.z != 0.0 {
            return Err(problem(
                "a tube is cut across or along its axis only",
                "make the normal parallel or perpendicular to the tube's z axis",
            ));
        }
        let normal = [cut.normal.x, cut.normal.y];
        let two_pieces = |()| {
            problem(
                "the cut leaves two pieces",
                "narrow `sector_deg` and write each piece as a shape of its own",
            )
        };
        let outer = self.outer.arc_within(strip.outer, normal, cut.offset).map_err(two_pieces)?;
        let inner = self.inner.arc_within(strip.inner, normal, cut.offset).map_err(two_pieces)?;
        let (Some(outer), Some(inner)) = (outer, inner) else {
            return Err(if outer.is_none() {
                nothing()
            } else {
                problem("the cut does not cross the whole wall", "move the cut")
            });
        };
        // An end is straight only if the same plane cuts both arcs there.
        let moved = |new: [f64; 2], old: [f64; 2], i: usize| strip.closed || new[i] != old[i];
        let both = (0..2).all(|i| moved(outer, strip.outer, i) == moved(inner, strip.inner, i));
        let opened = outer != strip.outer;
        if !both || (strip.closed && opened != (inner != strip.inner)) {
            return Err(problem(
                "an end of the wall is cut by two planes",
                "cut each end across the whole wall, or write the pieces as shapes of their own",
            ));
        }
        (strip.outer, strip.inner) = (outer, inner);
        strip.closed &= !opened;
        Ok(())
    }

    /// The volume after `cuts` (local), mm³; closed form.
    pub fn volume(&self, cuts: &[Cut]) -> Result<f64, ShapeProblem> {
        let strip = self.strip(cuts)?;
        let [o0, o1] = strip.outer.map(|t| self.outer.at(t, 1.0));
        let [i0, i1] = strip.inner.map(|t| self.inner.at(t, 1.0));
        let cross = |p: [f64; 2], q: [f64; 2]| 0.5 * (p[0] * q[1] - p[1] * q[0]);
        let ends = if strip.closed { 0.0 } else { cross(o1, i1) + cross(i0, o0) };
        let area = self.outer.green(strip.outer) - self.inner.green(strip.inner) + ends;
        Ok(area * (strip.z[1] - strip.z[0]))
    }

    /// The mesh and its depth under the true surface, mm.
    pub fn tessellate(&self, cuts: &[Cut], faces: usize) -> Result<(TriMesh, f64), ShapeProblem> {
        let strip = self.strip(cuts)?;
        let parts = (faces / 8).max(4);
        let points = if strip.closed { parts } else { parts + 1 };
        let outer_step = (strip.outer[1] - strip.outer[0]) / parts as f64;
        let outer: Vec<[f64; 2]> =
            (0..points).map(|i| self.outer.at(strip.outer[0] + outer_step * i as f64, 1.0)).collect();
        let (inner, inner_step) = self.inner_polygon(&strip, points);
        for i in 0..parts {
            let j = (i + 1) % points;
            if !is_left_turning(&[outer[i], outer[j], inner[j], inner[i]]) {
                return Err(ShapeProblem::new(
                    "inner_half_axes_mm",
                    "the wall is thinner than the tessellation's depth, or the inner ellipse leaves the outer one",
                    "shrink the inner ellipse or raise `faces`",
                ));
            }
        }
        let depth = self.outer.half_axes[0].max(self.outer.half_axes[1]) * (1.0 - (0.5 * outer_step).cos());
        let inner_depth =
            self.inner.half_axes[0].max(self.inner.half_axes[1]) * (1.0 / (0.5 * inner_step).cos() - 1.0);
        Ok((extrude(&outer, &inner, strip.z, strip.closed), depth.max(inner_depth)))
    }

    /// A polygon around the inner ellipse: corners where tangents meet, so that every edge touches the ellipse from
    /// outside. An open one starts and ends on the ellipse itself.
    fn inner_polygon(&self, strip: &Strip, points: usize) -> (Vec<[f64; 2]>, f64) {
        let [start, end] = strip.inner;
        if strip.closed {
            let step = (end - start) / points as f64;
            let factor = 1.0 / (0.5 * step).cos();
            return ((0..points).map(|i| self.inner.at(start + step * i as f64, factor)).collect(), step);
        }
        let step = (end - start) / (points - 2) as f64;
        let factor = 1.0 / (0.5 * step).cos();
        let corners = (0..points - 2).map(|i| self.inner.at(start + step * (i as f64 + 0.5), factor));
        let ends = [self.inner.at(start, 1.0), self.inner.at(end, 1.0)];
        (std::iter::once(ends[0]).chain(corners).chain(std::iter::once(ends[1])).collect(), step)
    }
}

/// Whether a quadrilateral is convex and counter-clockwise.
fn is_left_turning(quad: &[[f64; 2]; 4]) -> bool {
    (0..4).all(|i| {
        let [p, q, r] = [quad[i], quad[(i + 1) % 4], quad[(i + 2) % 4]];
        (q[0] - p[0]) * (r[1] - q[1]) - (q[1] - p[1]) * (r[0] - q[0]) > 0.0
    })
}

/// The prism between two polygons, joined point to point, from `z[0]` to `z[1]`.
fn extrude(outer: &[[f64; 2]], inner: &[[f64; 2]], z: [f64; 2], closed: bool) -> TriMesh {
    let n = outer.len();
    let mut mesh = TriMesh::default();
    for polygon in [outer, inner] {
        for height in z {
            mesh.vertices.extend(polygon.iter().map(|p| DVec3::new(p[0], p[1], height)));
        }
    }
    let vertex = |ring: usize, i: usize| (ring * n + i % n) as u32;
    let [ob, ot, ib, it] = [0, 1, 2, 3];
    let mut quad = |corners: [u32; 4]| {
        let [a, b, c, d] = corners;
        mesh.faces.extend([[a, b, c], [a, c, d]]);
    };
    for i in 0..if closed { n } else { n - 1 } {
        let j = i + 1;
        quad([vertex(ot, i), vertex(ot, j), vertex(it, j), vertex(it, i)]);
        quad([vertex(ob, j), vertex(ob, i), vertex(ib, i), vertex(ib, j)]);
        quad([vertex(ob, i), vertex(ob, j), vertex(ot, j), vertex(ot, i)]);
        quad([vertex(ib, j), vertex(ib, i), vertex(it, i), vertex(it, j)]);
    }
    if !closed {
        let last = n - 1;
        quad([vertex(ib, 0), vertex(ob, 0), vertex(ot, 0), vertex(it, 0)]);
        quad([vertex(ob, last), vertex(ib, last), vertex(it, last), vertex(ot, last)]);
    }
    mesh
}

/// A rod of circular section bent along a circle across local z.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct TorusSector {
    pub centre: DVec3,
    pub ring_radius: f64,
    pub tube_radius: f64,
    /// Directions from the centre, degrees from +x towards +y; less than a full turn.
    pub sector_deg: [f64; 2],
}

impl TorusSector {
    fn turn(&self) -> f64 {
        (self.sector_deg[1] - self.sector_deg[0]).to_radians()
    }

    pub fn contains(&self, p: DVec3) -> bool {
        let q = p - self.centre;
        let angle = q.y.atan2(q.x).to_degrees();
        let in_sector =
            (angle - self.sector_deg[0]).rem_euclid(360.0) <= self.sector_deg[1] - self.sector_deg[0];
        in_sector && (q.x.hypot(q.y) - self.ring_radius).hypot(q.z) <= self.tube_radius
    }

    /// The volume, mm³ (Pappus).
    pub fn volume(&self) -> f64 {
        PI * self.tube_radius.powi(2) * self.ring_radius * self.turn()
    }

    /// The mesh and its depth under the true surface, mm.
    ///
    /// Chords of a ring come nearer to the axis by the factor `c = cos(half a step)`, on the inner side out of the
    /// torus. So the section is drawn with a ring radius larger by 2/(1 + c) and a tube radius smaller by what is
    /// left of the swing, and the mesh stays inside.
    pub fn tessellate(&self, faces: usize) -> (TriMesh, f64) {
        let (big, small) = (self.ring_radius, self.tube_radius);
        // Square faces: 2·n·m of them, n along the ring and m around the tube.
        let ratio = big * self.turn() / (TAU * small);
        let around = (((faces as f64 / (2.0 * ratio)).sqrt() / 4.0).round() as usize * 4).max(8);
        let along = (faces / (2 * around)).max(2);
        let step = self.turn() / along as f64;
        let c = (0.5 * step).cos();
        let ring = big * 2.0 / (1.0 + c);
        let tube = small - (ring + small) * 0.5 * (1.0 - c);
        let mut mesh = TriMesh::default();
        for i in 0..=along {
            let share = i as f64 / along as f64;
            let (sin, cos) = exact_sin_cos(self.sector_deg[0] * (1.0 - share) + self.sector_deg[1] * share);
            for j in 0..around {
                let (up, out) = (TAU * j as f64 / around as f64).sin_cos();
                let radius = ring + tube * out;
                mesh.vertices.push(self.centre + DVec3::new(radius * cos, radius * sin, tube * up));
            }
        }
        let vertex = |i: usize, j: usize| (i * around + j % around) as u32;
        for i in 0..along {
            for j in 0..around {
                let [a, b, c, d] = [vertex(i, j), vertex(i + 1, j), vertex(i + 1, j + 1), vertex(i, j + 1)];
                mesh.faces.extend([[a, b, c], [a, c, d]]);
            }
        }
        for j in 1..around - 1 {
            mesh.faces.push([vertex(0, 0), vertex(0, j), vertex(0, j + 1)]);
            mesh.faces.push([vertex(along, 0), vertex(along, j + 1), vertex(along, j)]);
        }
        // Shrinking, both ways of the ring's swing, and the section's own sagitta.
        let depth = (small - tube)
            + (ring - big)
            + (ring + tube) * (1.0 - c)
            + tube * (1.0 - (PI / around as f64).cos());
        (mesh, depth)
    }
}
