//! Many walks abreast: each takes a step in turn, so that the ways to memory and the long operations of one are spent on the
//! others, and no step depends on a branch that could not be foreseen.
//!
//! ```text
//!   ray 1  ●──▶●──▶●            ray 1 is there after two steps, ray 2 after one, …; rays that are
//!   ray 2  ●──▶●                there leave the ranks, and those left go on.
//!   ray 3  ●──▶●──▶●──▶●
//! ```
//!
//! Every sign and every step is that of the walk proper ([`Walker::pass_from`]), so that where both faces of a line are found, and
//! not near their edges, the way through them is what a walk would find, to the last bit. All else is left to it: lines that
//! miss or are in doubt, and walks that take long; it begins where these got.

use glam::DVec3;

use super::{Face, LineView, Pass, Seeds, Standing, Unsure, Walker, cross};

/// Rays that are walked abreast.
pub(super) const ABREAST: usize = 32;

/// A number of each of them.
pub(super) type OfRays = [f64; ABREAST];

/// Walks that are longer are left to the walk proper.
pub(super) const MOST_STEPS: usize = 24;

/// Two walks of a ray: to its entry and to its exit.
const WALKS: usize = 2 * ABREAST;

/// Where an edge's number counted from another edge leads.
pub(super) const ROUND: [usize; 5] = [0, 1, 2, 0, 1];

/// Walks under way.
pub(super) struct Ranks {
    views: [LineView; ABREAST],
    standings: [Standing; WALKS],
    /// Numbers of the walks that are not there yet.
    walking: [u8; WALKS],
    /// Where the last steps led.
    stepped: [u32; WALKS],
}

impl Default for Ranks {
    fn default() -> Self {
        Self {
            views: [LineView::default(); ABREAST],
            standings: [Standing::default(); WALKS],
            walking: [0; WALKS],
            stepped: [0; WALKS],
        }
    }
}

impl Ranks {
    /// Walks to the entries and exits of rays (origin, direction and seeds), no more than [`ABREAST`].
    #[inline(always)]
    pub fn walk(&mut self, walker: &Walker, rays: impl Iterator<Item = Option<(DVec3, DVec3, Seeds)>>) {
        let mut count = 0;
        for (i, (ray, view)) in rays.zip(&mut self.views).enumerate() {
            let Some((origin, dir, seeds)) = ray else { continue };
            *view = LineView::new(walker, origin, dir);
            for (walk, face, sign) in [(2 * i, seeds.entry, -1.0), (2 * i + 1, seeds.exit, 1.0)] {
                let standing = walker.stand_on(view, face, sign);
                // Branches would not be foreseen.
                self.walking[count] = walk as u8;
                count += usize::from(standing.least() <= 0.0);
                self.standings[walk] = standing;
            }
        }
        for _ in 0..MOST_STEPS {
            if count == 0 {
                break;
            }
            let mut left = 0;
            for i in 0..count {
                let walk = self.walking[i] as usize % WALKS;
                let sign = if walk.is_multiple_of(2) { -1.0 } else { 1.0 };
                let next = self.standings[walk].step(walker, &self.views[walk / 2], sign);
                // At the outline it stays where it is.
                let is_on = next.area() > 0.0;
                self.walking[left] = walk as u8;
                left += usize::from(is_on && next.least() <= 0.0);
                if is_on {
                    self.standings[walk] = next;
                }
                self.stepped[i] = next.half_edge;
            }
            walker.read_faces(&self.stepped[..count]);
            count = left;
        }
    }

    /// The way of one of the rays through the body, as of [`Walker::pass_from`], and the faces where its walks ended.
    #[inline(always)]
    pub fn pass(&self, walker: &Walker, ray: usize) -> (Result<Option<Pass>, Unsure>, Seeds) {
        let (view, entry, exit) = (&self.views[ray], &self.standings[2 * ray], &self.standings[2 * ray + 1]);
        let mut seeds = Seeds { entry: entry.face(), exit: exit.face() };
        let is_found = entry.is_surely_pierced(view) && exit.is_surely_pierced(view);
        let answer = if is_found {
            walker.pass_through(view, seeds)
        } else {
            walker.pass_from(view.origin, view.dir, &mut seeds)
        };
        (answer, seeds)
    }
}

impl Standing {
    #[inline(always)]
    fn least(&self) -> f64 {
        let [s0, s1, s2] = self.sides;
        let least = if s0 < s1 { s0 } else { s1 };
        if least < s2 { least } else { s2 }
    }

    /// Steps over the edge that has the line farthest on its outer side.
    #[inline(always)]
    fn step(&self, walker: &Walker, view: &LineView, sign: f64) -> Self {
        let [s0, s1, s2] = self.sides;
        let edge = if s0 <= s1 && s0 <= s2 { 0 } else { 1 + usize::from(s2 < s1) };
        let Face { twins, apexes, .. } = &walker.faces[self.half_edge as usize / 4];
        let edge_of_face = ROUND[(self.half_edge as usize % 4 + edge).min(4)];
        let apex = walker.place(view, apexes[edge_of_face]);
        let (a, b) = (self.corners[ROUND[edge + 1]], self.corners[edge]);
        Self {
            corners: [a, b, apex],
            sides: [-self.sides[edge], sign * cross(b, apex), sign * cross(apex, a)],
            half_edge: twins[edge_of_face],
        }
    }
}
