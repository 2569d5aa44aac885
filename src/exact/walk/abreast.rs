//! Many walks abreast: each takes a step in turn, so that the ways to memory and the long operations of one are spent on the
//! others, and no step depends on a branch that could not be foreseen.
//!
//! ```text
//!   ray 1  ●──▶●──▶●            ray 1 is there after two steps, ray 2 after one, …; rays that are
//!   ray 2  ●──▶●                there leave the ranks, and those left go on.
//!   ray 3  ●──▶●──▶●──▶●
//! ```
//!
//! What comes of it are seeds: faces from which the walk proper ([`Walker::pass_from`]) has no step to take, or hardly any. So nothing
//! here need be exact.

use glam::DVec3;

use super::{Face, Seeds, Walker, cross};
use crate::exact::shear::Shear;

/// Rays that are walked abreast.
pub(super) const ABREAST: usize = 32;

/// Walks that are longer are left to the walk proper.
const MOST_STEPS: usize = 24;

/// Two walks of a ray: to its entry and to its exit.
const WALKS: usize = 2 * ABREAST;

/// Where an edge's number counted from another edge leads.
const ROUND: [usize; 5] = [0, 1, 2, 0, 1];

/// Walks under way.
pub(super) struct Ranks {
    frames: [Frame; ABREAST],
    standings: [Standing; WALKS],
    /// Numbers of the walks that are not there yet.
    walking: [u8; WALKS],
}

/// What places a vertex across a ray: products with its coordinates, and what is then added.
#[derive(Clone, Copy, Default)]
struct Frame {
    by: [DVec3; 2],
    offset: [f64; 2],
}

/// A face stood on, from one of its edges: as in the walk proper.
#[derive(Clone, Copy, Default)]
struct Standing {
    corners: [[f64; 2]; 3],
    sides: [f64; 3],
    half_edge: u32,
}

impl Default for Ranks {
    fn default() -> Self {
        Self {
            frames: [Frame::default(); ABREAST],
            standings: [Standing::default(); WALKS],
            walking: [0; WALKS],
        }
    }
}

impl Frame {
    #[inline(always)]
    fn new(origin: DVec3, dir: DVec3) -> Self {
        let by = Shear::of(origin, dir).rows_across();
        Self { by, offset: by.map(|by| -by.dot(origin)) }
    }

    #[inline(always)]
    fn place(&self, vertex: DVec3) -> [f64; 2] {
        [0, 1].map(|i| self.by[i].dot(vertex) + self.offset[i])
    }
}

impl Ranks {
    /// Walks from these seeds to the entries and exits of rays (origins and directions), no more than [`ABREAST`], and leaves the
    /// seeds where it got.
    #[inline]
    pub fn walk(&mut self, walker: &Walker, rays: &[Option<(DVec3, DVec3)>], seeds: &mut [Seeds]) {
        let mut count = 0;
        for (ray, (line, seeds)) in rays.iter().zip(&*seeds).enumerate() {
            let Some((origin, dir)) = *line else { continue };
            self.frames[ray] = Frame::new(origin, dir);
            for (walk, face, sign) in [(2 * ray, seeds.entry, -1.0), (2 * ray + 1, seeds.exit, 1.0)] {
                self.standings[walk] = Standing::on(walker, &self.frames[ray], face, sign);
                self.walking[count] = walk as u8;
                count += 1;
            }
        }
        for _ in 0..MOST_STEPS {
            if count == 0 {
                break;
            }
            let mut left = 0;
            for i in 0..count {
                let walk = self.walking[i];
                let (ray, sign) = (walk as usize / 2, if walk.is_multiple_of(2) { -1.0 } else { 1.0 });
                let at = &mut self.standings[walk as usize];
                let next = at.step(walker, &self.frames[ray], sign);
                // There, or at the outline.
                let is_there = at.least() > 0.0 || next.sides[0] + next.sides[1] + next.sides[2] <= 0.0;
                self.walking[left] = walk;
                left += usize::from(!is_there);
                if !is_there {
                    *at = next;
                }
            }
            count = left;
        }
        for (ray, seeds) in seeds.iter_mut().enumerate().filter(|(ray, _)| rays[*ray].is_some()) {
            seeds.entry = self.standings[2 * ray].half_edge / 4;
            seeds.exit = self.standings[2 * ray + 1].half_edge / 4;
        }
    }
}

impl Standing {
    #[inline(always)]
    fn on(walker: &Walker, frame: &Frame, face: u32, sign: f64) -> Self {
        let corners = walker.faces[face as usize].corners.map(|v| frame.place(walker.vertices[v as usize]));
        let [a, b, c] = corners;
        let sides = [sign * cross(a, b), sign * cross(b, c), sign * cross(c, a)];
        Self { corners, sides, half_edge: 4 * face }
    }

    #[inline(always)]
    fn least(&self) -> f64 {
        let [s0, s1, s2] = self.sides;
        let least = if s0 < s1 { s0 } else { s1 };
        if least < s2 { least } else { s2 }
    }

    /// Steps over the edge that has the line farthest on its outer side.
    #[inline(always)]
    fn step(&self, walker: &Walker, frame: &Frame, sign: f64) -> Self {
        let [s0, s1, s2] = self.sides;
        let edge = if s0 <= s1 && s0 <= s2 { 0 } else { 1 + usize::from(s2 < s1) };
        let Face { twins, apexes, .. } = &walker.faces[self.half_edge as usize / 4];
        let edge_of_face = ROUND[(self.half_edge as usize % 4 + edge).min(4)];
        let apex = frame.place(walker.vertices[apexes[edge_of_face] as usize]);
        let (a, b) = (self.corners[ROUND[edge + 1]], self.corners[edge]);
        Self {
            corners: [a, b, apex],
            sides: [-self.sides[edge], sign * cross(b, apex), sign * cross(apex, a)],
            half_edge: twins[edge_of_face],
        }
    }
}
