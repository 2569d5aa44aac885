//! From a line to faces near its entry and its exit: where walks begin if nothing is known.
//!
//! ```text
//!      z            A linear map makes a ball of the body's ellipsoid of inertia. Where the line crosses the ball, the
//!     ╱|╲           direction from the middle is flattened onto the octahedron |x| + |y| + |z| = 1 and that onto a square
//!    ╱ | ╲          (Cigolle et al. 2014, <https://jcgt.org/published/0003/02/01/>). Each cell of the square names the face
//!   x──┼──y         through which its direction leaves the body, and how far away that is.
//! ```
//!
//! For an ellipsoid the ball is the body; elsewhere the distance found first says where to look again.

use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::abreast::{ABREAST, OfRays};
use super::{Face, LineView, Seeds, Walker};
use crate::exact::round;
use crate::geometry::numeric::{gamma, greater, lesser};
use crate::geometry::{Bounds, Segment, ball_of_inertia};

/// A table of faces by direction from the middle.
#[derive(Clone, Debug)]
pub(super) struct SeedTable {
    middle: DVec3,
    /// From mm about the middle to the frame in which the body is about a ball of radius 1.
    to_ball: DMat3,
    /// The squared radius of the ball about the middle that holds the body.
    holding_squared: f64,
    /// About half the width of a few faces: so far within the outline are seeds for lines that pass by.
    inset: f64,
    /// By so much the surface's distance may differ from what was assumed. Farther off, it is looked up again.
    radius_tolerance: f64,
    /// Cells along each side of the square.
    side: usize,
    cells: Vec<Seed>,
}

/// A face, and its distance from the middle in the ball's frame.
#[derive(Clone, Copy, Debug, Default)]
struct Seed {
    face: u32,
    radius: f32,
}

/// The table has two cells for each face, so that most walks are of a step or none, up to two megabytes.
const LARGEST_SIDE: usize = 512;
const SMALLEST_SIDE: usize = 4;

/// A face seen less edge-on than this looks along a line whatever the rounding.
const FACING: f64 = 1e-3;

/// The least tolerance of the surface's distance.
const RADIUS_TOLERANCE: f64 = 0.02;

/// The corners of a round body of F faces lie beyond its ball by 3.7/F, 5 % if they are 80. To look up all lines again for that costs
/// more than a step: within this part of the inset, 1/√F, the face found is next to the right one.
const TOLERANCE_OF_INSET: f64 = 1.0 / 6.0;

/// A line passes a ball by surely if its squared distance from the middle is greater by this share of the origin's squared
/// distance: two linear maps of three products each, the foot of the perpendicular, a square: fewer than 40 roundings.
const PASSING_BY: f64 = gamma(64);

impl SeedTable {
    /// A table that knows no face but the first.
    pub fn empty() -> Self {
        Self {
            middle: DVec3::ZERO,
            to_ball: DMat3::IDENTITY,
            holding_squared: f64::INFINITY,
            inset: 0.0,
            radius_tolerance: RADIUS_TOLERANCE,
            side: 1,
            cells: vec![Seed::default()],
        }
    }

    /// The table of a body.
    pub fn new(walker: &Walker) -> Self {
        let side = (walker.faces.len() * 2).isqrt().clamp(SMALLEST_SIDE, LARGEST_SIDE);
        let bounds = Bounds::of(walker.vertices.iter().copied());
        let corners = walker.faces.iter().map(|face| face.corners.map(|v| walker.vertices[v as usize]));
        let (middle, to_ball) = ball_of_inertia(corners, bounds);
        let radius_squared = |v: &DVec3| (to_ball * (*v - middle)).length_squared();
        let farthest = walker.vertices.iter().map(radius_squared).fold(0.0, f64::max);
        let inset = 6.0 / (walker.faces.len() as f64).sqrt();
        let mut table = Self {
            middle,
            to_ball,
            holding_squared: farthest * (1.0 + PASSING_BY),
            inset,
            radius_tolerance: RADIUS_TOLERANCE.max(TOLERANCE_OF_INSET * inset),
            side,
            cells: vec![Seed::default(); side * side],
        };
        let from_ball = to_ball.inverse();
        // Each walk begins next to where the last ended: down the first column, then along the rows.
        let leaving = |column: usize, row: usize, near: u32| {
            let place = [column, row].map(|c| (c as f64 + 0.5) / side as f64);
            leaving(walker, middle, from_ball * direction(place), near)
        };
        let mut face = 0;
        let mut first_of_row = |row: usize| {
            face = leaving(0, row, face);
            face
        };
        let firsts: Vec<u32> = (0..side).map(&mut first_of_row).collect();
        let rows = table.cells.par_chunks_mut(side).zip(firsts).enumerate();
        rows.for_each(|(row, (cells, mut face))| {
            for (column, cell) in cells.iter_mut().enumerate() {
                face = leaving(column, row, face);
                let corner = walker.vertices[walker.faces[face as usize].corners[0] as usize];
                *cell = Seed { face, radius: radius_squared(&corner).sqrt() as f32 };
            }
        });
        table
    }

    /// The middle, and the map from mm about it to the ball's frame.
    pub fn ball_frame(&self) -> (DVec3, DMat3) {
        (self.middle, self.to_ball)
    }

    /// Seeds for the line from `o` along `d`, mm: the faces near where it would cross a ball about the middle as large as
    /// the body is there. `None` if it passes the ball by that holds the body, and so misses.
    #[inline]
    pub fn near(&self, o: DVec3, d: DVec3) -> Option<Seeds> {
        let (o, d) = (self.to_ball * (o - self.middle), self.to_ball * d);
        let inverse = 1.0 / d.length_squared();
        let foot = o - (o.dot(d) * inverse) * d;
        let offset_squared = foot.length_squared();
        if offset_squared > self.holding_squared + PASSING_BY * o.length_squared() {
            return None;
        }
        let crossing = |sign: f64| {
            let at = |radius: f64| {
                let half = (radius * radius - offset_squared).max(self.inset * self.inset) * inverse;
                self.cell(foot + (sign * half.sqrt()) * d)
            };
            let first = at(1.0);
            if self.is_near_ball(first) { first.face } else { at(f64::from(first.radius)).face }
        };
        Some(Seeds { entry: crossing(-1.0), exit: crossing(1.0) })
    }

    /// As [`near`](Self::near), for many lines, as many at a time as the instructions that the caller has. Lines that surely miss
    /// have no seeds.
    #[inline(always)]
    pub fn near_all(&self, rays: &[Segment], found: &mut [Option<Seeds>; ABREAST]) {
        found.fill(None);
        const NONE: OfRays = [0.0; ABREAST];
        let (mut origins, mut dirs) = ([NONE; 3], [NONE; 3]);
        for (i, ray) in rays.iter().take(ABREAST).enumerate() {
            let (o, d) = (ray.line().origin(), ray.line().dir());
            (origins[0][i], origins[1][i], origins[2][i]) = (o.x, o.y, o.z);
            (dirs[0][i], dirs[1][i], dirs[2][i]) = (d.x, d.y, d.z);
        }
        let (mut over, mut cells) = (NONE, [NONE; 2]);
        let last = self.side as f64 - 1.0;
        for i in 0..ABREAST {
            let o = self.to_ball * (DVec3::new(origins[0][i], origins[1][i], origins[2][i]) - self.middle);
            let d = self.to_ball * DVec3::new(dirs[0][i], dirs[1][i], dirs[2][i]);
            let inverse = 1.0 / d.length_squared();
            let foot = o - (o.dot(d) * inverse) * d;
            let offset_squared = foot.length_squared();
            over[i] = offset_squared - (self.holding_squared + PASSING_BY * o.length_squared());
            let half = (greater(1.0 - offset_squared, self.inset * self.inset) * inverse).sqrt();
            for (cells, sign) in cells.iter_mut().zip([-half, half]) {
                let [x, y] = flattened(foot + sign * d);
                let cell = |place: f64| lesser(greater(floor(place * (last + 1.0)), 0.0), last);
                cells[i] = round::WHOLE + (cell(y) * (last + 1.0) + cell(x));
            }
        }
        for (i, ray) in rays.iter().take(ABREAST).enumerate() {
            let seed = |cells: &OfRays| self.cells[round::whole(cells[i]) as usize];
            let (entry, exit) = (seed(&cells[0]), seed(&cells[1]));
            if over[i] > 0.0 {
                continue;
            }
            found[i] = if self.is_near_ball(entry) && self.is_near_ball(exit) {
                Some(Seeds { entry: entry.face, exit: exit.face })
            } else {
                self.near(ray.line().origin(), ray.line().dir())
            };
        }
    }

    /// Whether the line from `o` along `d`, mm, passes the ball by that holds the body, and so misses, surely.
    #[inline]
    pub fn passes_by(&self, o: DVec3, d: DVec3) -> bool {
        self.beyond_ball(self.to_ball * (o - self.middle), d) > 0.0
    }

    /// The same of lines from one point, of all rows: those that surely miss have positive numbers.
    #[inline(always)]
    pub fn beyond(&self, o: DVec3, dirs: &[OfRays; 3], beyond: &mut OfRays) {
        let o = self.to_ball * (o - self.middle);
        for (i, beyond) in beyond.iter_mut().enumerate() {
            *beyond = self.beyond_ball(o, DVec3::new(dirs[0][i], dirs[1][i], dirs[2][i]));
        }
    }

    /// Squared, and less what might be rounding; `o` in the ball's frame.
    #[inline(always)]
    fn beyond_ball(&self, o: DVec3, d: DVec3) -> f64 {
        let d = self.to_ball * d;
        let foot = o - (o.dot(d) / d.length_squared()) * d;
        foot.length_squared() - (self.holding_squared + PASSING_BY * o.length_squared())
    }

    /// The face at which the ball's plane across `normal` would touch.
    pub fn facing(&self, normal: DVec3) -> u32 {
        self.cell(self.to_ball.inverse().transpose() * normal).face
    }

    /// A face that looks along `dir`.
    pub fn towards(&self, walker: &Walker, dir: DVec3) -> u32 {
        let face = self.cell(self.to_ball * dir).face;
        let looks_along = walker.faces[face as usize].normal.dot(dir) > FACING * dir.length();
        if looks_along { face } else { leaving(walker, self.middle, dir, face) }
    }

    /// Whether the surface is there about where a ball of radius 1 is.
    #[inline(always)]
    fn is_near_ball(&self, seed: Seed) -> bool {
        (f64::from(seed.radius) - 1.0).abs() <= self.radius_tolerance
    }

    #[inline]
    fn cell(&self, towards: DVec3) -> Seed {
        let [x, y] = flattened(towards);
        let size = self.side as f64;
        let (x, y) = (((x * size) as usize).min(self.side - 1), ((y * size) as usize).min(self.side - 1));
        self.cells[y * self.side + x]
    }
}

/// The greatest integer that is surely not greater, but for numbers all but integers.
#[inline(always)]
fn floor(x: f64) -> f64 {
    ((x - 0.5) + round::WHOLE) - round::WHOLE
}

/// The face through which the ray from a point within the body leaves: by a walk from a face nearby that looks along it, or
/// else as the nearest plane of all.
fn leaving(walker: &Walker, from: DVec3, dir: DVec3, near: u32) -> u32 {
    let view = LineView::new(walker, from, dir);
    let start = walker.stand_on(&view, near, 1.0);
    if start.area() > view.sure_mm2
        && let Ok(Some(pierced)) = walker.walk(&view, start, &mut near.clone(), 1.0)
    {
        return pierced.face();
    }
    let inverse_distance = |f: &usize| {
        let Face { normal, corners: [corner, ..], .. } = walker.faces[*f];
        let height = normal.dot(walker.vertices[corner as usize] - from);
        if height > 0.0 { normal.dot(dir) / height } else { f64::NEG_INFINITY }
    };
    let faces = 0..walker.faces.len();
    faces.max_by(|f, g| inverse_distance(f).total_cmp(&inverse_distance(g))).unwrap_or(0) as u32
}

/// The place of a direction in the unit square.
#[inline]
fn flattened(v: DVec3) -> [f64; 2] {
    let inverse = 1.0 / (v.x.abs() + v.y.abs() + v.z.abs());
    let (x, y) = (v.x * inverse, v.y * inverse);
    let (far_x, far_y) = ((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y));
    let is_far = v.z < 0.0;
    [0.5 * if is_far { far_x } else { x } + 0.5, 0.5 * if is_far { far_y } else { y } + 0.5]
}

/// The direction of a place in the unit square; not of unit length.
fn direction(place: [f64; 2]) -> DVec3 {
    let [x, y] = place.map(|c| 2.0 * c - 1.0);
    let z = 1.0 - x.abs() - y.abs();
    if z >= 0.0 {
        return DVec3::new(x, y, z);
    }
    DVec3::new((1.0 - y.abs()).copysign(x), (1.0 - x.abs()).copysign(y), z)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn flattening_a_direction_and_back_gives_the_direction() {
        for x in -3..=3 {
            for y in -3..=3 {
                for z in -3..=3 {
                    let v = DVec3::new(f64::from(x), f64::from(y), f64::from(z) + 0.1);
                    let back = direction(flattened(v));
                    assert!(back.normalize().dot(v.normalize()) > 1.0 - 1e-12, "{v} {back}");
                }
            }
        }
    }
}
