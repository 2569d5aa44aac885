//! The face that the last ray of an image went through, ready for rays from the same source: whether they go through it too is
//! three products with their directions, and where is one quotient.
//!
//! ```text
//!             b        A ray from the source o passes the edge a–b on the inner side if its direction does the plane through
//!            ╱ ╲       o, a and b: if d · (a − o) × (b − o) > 0. Such products are made when rays stay on faces for long.
//!       ────╱ × ╲───▷
//!          a─────c
//! ```

use glam::DVec3;

use super::{Face, STEEP, Walker};
use crate::geometry::numeric::gamma;

/// A face, as rays from one source see it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    face: u32,
    /// Normals, inward, of the planes through the source and each edge.
    sides: [DVec3; 3],
    /// Products greater than this, over the direction's |x| + |y| + |z|, are right, mm².
    sure: f64,
    normal: DVec3,
    /// Of the face's plane over the source, mm.
    height: f64,
    sign: f64,
}

impl Held {
    /// Rays go through it in (`sign` −1) or out (1).
    pub fn new(walker: &Walker, source: DVec3, face: u32, sign: f64) -> Self {
        let Face { corners, normal, .. } = walker.faces[face as usize];
        let [a, b, c] = corners.map(|v| walker.vertices[v as usize] - source);
        let sides = [a.cross(b), b.cross(c), c.cross(a)].map(|side| sign * side);
        // No vertex is seen farther off in the line's frame: see `LineView`. Its sides, times the longest component of the
        // direction, are these products, and in doubt below γ₆₄ of the square: the ends are then those of a walk to the
        // last bit. The products' own rounding, γ₈ of six times the square, is far less than the rest.
        let largest = 2.0 * ((source - walker.centre).abs().max_element() + walker.reach);
        let height = normal.dot(walker.vertices[corners[0] as usize] - source);
        Self { face, sides, sure: gamma(256) * largest * largest, normal, height, sign }
    }

    /// Where the ray along `dir` goes through the face, in the unit of `dir`. `None` if it does not for sure.
    #[inline(always)]
    pub fn crossing(&self, dir: DVec3) -> Option<f64> {
        let size = dir.x.abs() + dir.y.abs() + dir.z.abs();
        let sides = self.sides.map(|side| side.dot(dir));
        let slope = self.normal.dot(dir);
        let is_pierced = sides[0].min(sides[1]).min(sides[2]) > self.sure * size;
        (is_pierced && slope * self.sign > STEEP * size).then(|| self.height / slope)
    }
}

/// One of the two walks of an image's rays, from each ray to the next.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Follower {
    held: Option<Held>,
    /// Rays that the last walk's face has served so far.
    served: u32,
    /// Rays that faces serve lately.
    usual: u32,
}

/// Rays that a face must serve to be worth holding.
const WORTH_HOLDING: u32 = 8;

impl Follower {
    /// Where the ray along `dir` goes through the face held, if there is one and it does; and that face.
    #[inline(always)]
    pub fn crossing(&mut self, dir: DVec3) -> Option<(f64, u32)> {
        let held = self.held.as_ref()?;
        let t = held.crossing(dir)?;
        self.served += 1;
        Some((t, held.face))
    }

    /// Learns that a walk went from one face to another, and holds it if that seems worth it.
    #[inline]
    pub fn walked(&mut self, walker: &Walker, source: DVec3, [from, to]: [u32; 2], sign: f64) {
        if from == to {
            self.served += 1;
        } else {
            (self.usual, self.served) = (self.served, 1);
        }
        if self.served.max(self.usual) >= WORTH_HOLDING && self.held.is_none_or(|held| held.face != to) {
            self.held = Some(Held::new(walker, source, to, sign));
        } else if from != to {
            self.held = None;
        }
    }
}
