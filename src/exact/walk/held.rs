//! The face that the last ray of an image went through, ready for rays from the same source: whether they go through it too is
//! three products with their directions, and where is one quotient. What is held changes no bit of what walks would find.
//!
//! ```text
//!             b        A ray from the source o passes the edge a–b on the inner side if its direction does the plane through
//!            ╱ ╲       o, a and b: if d · (a − o) × (b − o) > 0. Such products are made when rays stay on faces for long.
//!       ────╱ × ╲───▷
//!          a─────c
//! ```

use glam::DVec3;

use super::{Face, Pass, STEEP, Seeds, Walker};
use crate::geometry::Interval;
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

/// What is kept from ray to ray besides seeds.
pub(super) trait Holding {
    /// The way of the ray along `dir`, if it is known without a walk.
    fn pass(&self, dir: DVec3) -> Option<Pass>;

    /// Learns where walks began and ended.
    fn walked(&mut self, walker: &Walker, from: Seeds, to: &Pass);

    /// Begins a new row.
    fn forget(&mut self);
}

/// Nothing is held.
pub(super) struct Alone;

impl Holding for Alone {
    #[inline(always)]
    fn pass(&self, _: DVec3) -> Option<Pass> {
        None
    }

    #[inline(always)]
    fn walked(&mut self, _: &Walker, _: Seeds, _: &Pass) {}

    #[inline(always)]
    fn forget(&mut self) {}
}

/// The faces of the entry and of the exit, for rays from one source.
pub(super) struct Followers {
    source: DVec3,
    entry: Follower,
    exit: Follower,
}

impl Followers {
    pub fn new(source: DVec3) -> Self {
        Self { source, entry: Follower::default(), exit: Follower::default() }
    }
}

impl Holding for Followers {
    #[inline(always)]
    fn pass(&self, dir: DVec3) -> Option<Pass> {
        let (entry, exit) = (self.entry.held.as_ref()?, self.exit.held.as_ref()?);
        let chord = Interval::new(entry.crossing(dir)?, exit.crossing(dir)?)?;
        Some(Pass { chord, entry_face: entry.face, exit_face: exit.face })
    }

    #[inline]
    fn walked(&mut self, walker: &Walker, from: Seeds, to: &Pass) {
        self.entry.walked(walker, self.source, [from.entry, to.entry_face], -1.0);
        self.exit.walked(walker, self.source, [from.exit, to.exit_face], 1.0);
    }

    fn forget(&mut self) {
        (self.entry, self.exit) = Default::default();
    }
}

/// The face of one of the walks.
#[derive(Clone, Copy, Debug, Default)]
struct Follower {
    held: Option<Held>,
    /// Walks that ended on the last one's face.
    stayed: u32,
}

/// Walks that end on the same face before it is held.
const WORTH_HOLDING: u32 = 2;

impl Follower {
    /// Learns that a walk went from one face to another, and holds that if walks stay there.
    #[inline]
    fn walked(&mut self, walker: &Walker, source: DVec3, [from, to]: [u32; 2], sign: f64) {
        let is_held = self.held.is_some_and(|held| held.face == to);
        if is_held {
            return;
        }
        self.stayed = if from == to { self.stayed + 1 } else { 0 };
        self.held = (self.stayed >= WORTH_HOLDING).then(|| Held::new(walker, source, to, sign));
    }
}
