//! The rays that an audit looks along.
//!
//! ```text
//!   views         every pixel of each view                         as a projection would
//!   random        ●──▶  uniform, isotropic, through the ball       as chance would: figures are estimates with bounds
//!                 around the scene
//!   adversarial   at vertices, edges, outlines, cell borders …     as an enemy would
//! ```

use std::ops::Range;

use glam::DVec3;
use rand_distr::{Distribution, UnitDisc, UnitSphere};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde::Serialize;

use crate::exact::Body;
use crate::geometry::{Bounds, Segment};
use crate::linespace::{LinePoint, LineSpace, PlanePair};
use crate::scene::View;

/// Which rays are audited.
#[derive(Clone, Debug, PartialEq)]
pub enum RaySet {
    /// Every pixel's ray of these views.
    Views(Vec<View>),
    /// So many random lines through the ball around the scene: uniform and isotropic, the measure that rigid motions keep.
    Random {
        /// How many.
        rays: u64,
        /// Of the random numbers.
        seed: u64,
    },
    /// Lines aimed at what is hard, so many for each organ and each [`Aim`].
    Adversarial {
        /// How many for each organ and aim.
        rays: u64,
        /// Of the random numbers.
        seed: u64,
    },
    /// These lines, a random sample of a study's.
    Sample {
        /// Where each starts, and the way to its end, mm.
        lines: Vec<(DVec3, DVec3)>,
        /// Of what they are a sample, in words.
        of: String,
        /// Of the random numbers that chose them.
        seed: u64,
    },
}

/// What an adversarial line is aimed at.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Aim {
    /// A vertex of the organ's surface.
    Vertices,
    /// A point of an edge.
    Edges,
    /// The outline: within a face's plane, through a point of the face.
    Silhouettes,
    /// The border of a cell of the organ's line space.
    CellBorders,
    /// Two components of the direction equal, in units of the organ's box: the plane pair hangs on a tie.
    AxisTies,
    /// The direction all but within one of the planes of the organ's box.
    PlaneParallel,
}

impl Aim {
    /// All of them.
    pub const ALL: [Self; 6] = [
        Self::Vertices,
        Self::Edges,
        Self::Silhouettes,
        Self::CellBorders,
        Self::AxisTies,
        Self::PlaneParallel,
    ];

    /// In words.
    pub fn name(self) -> &'static str {
        match self {
            Self::Vertices => "aimed at vertices",
            Self::Edges => "aimed at edges",
            Self::Silhouettes => "in the planes of faces",
            Self::CellBorders => "on borders of cells",
            Self::AxisTies => "at ties of the dominant axis",
            Self::PlaneParallel => "all but parallel to a plane pair",
        }
    }
}

/// Lines are made in blocks with random numbers of their own, so that they are the same for any number of threads.
pub(super) const BLOCK: u64 = 4096;

/// The smallest angle, in units of the box, between a [`Aim::PlaneParallel`] line and its plane: 2⁻³⁰ and up to one.
const LEAST_SLOPE: f64 = 9.313_225_746_154_785e-10;

/// The finest cells whose borders are aimed at: depth 28 halves each axis seven times.
const FINEST_HALVINGS: u64 = 7;

/// A line as it was made: where it starts, and the way to its end, mm. [`Segment::along`] gives its ray, the same bits each
/// time.
pub(super) type Shot = (DVec3, DVec3);

/// The lines of a set without views, in blocks.
pub(super) struct Lines<'a> {
    bodies: Vec<&'a Body>,
    ball: Ball,
    rays: u64,
    seed: u64,
    aims: &'static [Aim],
    /// Lines that need not be made.
    given: &'a [Shot],
}

impl<'a> Lines<'a> {
    /// `None` if the set is one of views.
    pub fn of(set: &'a RaySet, bodies: Vec<&'a Body>) -> Option<Self> {
        let (rays, seed, aims, given): (_, _, &[Aim], &[Shot]) = match set {
            RaySet::Views(_) => return None,
            RaySet::Random { rays, seed } => (*rays, *seed, &[], &[]),
            RaySet::Adversarial { rays, seed } => (*rays, *seed, &Aim::ALL, &[]),
            RaySet::Sample { lines, seed, .. } => (lines.len() as u64, *seed, &[], lines),
        };
        let ball = Ball::around(bodies.iter().fold(Bounds::EMPTY, |all, body| all.union(body.bounds())));
        Some(Self { bodies, ball, rays, seed, aims, given })
    }

    /// The set's parts, with their blocks.
    pub fn sections(&self) -> Vec<(&'static str, Range<u64>)> {
        let blocks = self.rays.div_ceil(BLOCK);
        if self.aims.is_empty() {
            let name = if self.given.is_empty() { "random lines" } else { "a sample of lines" };
            return vec![(name, 0..blocks)];
        }
        let of_aim = blocks * self.bodies.len() as u64;
        (0..).zip(self.aims).map(|(i, aim)| (aim.name(), i * of_aim..(i + 1) * of_aim)).collect()
    }

    /// The lines of a block.
    pub fn block(&self, block: u64) -> Vec<Shot> {
        if !self.given.is_empty() {
            return self.given.chunks(BLOCK as usize).nth(block as usize).unwrap_or_default().to_vec();
        }
        let (blocks, organs) = (self.rays.div_ceil(BLOCK).max(1), self.bodies.len() as u64);
        let count = BLOCK.min(self.rays - block % blocks * BLOCK);
        let mut archer = Archer::of_block(self.seed, block);
        let aimed = self.aims.get((block / (blocks * organs.max(1))) as usize);
        let shot = |_| {
            let (point, dir) = match aimed {
                None => archer.random(&self.ball),
                Some(&aim) => archer.aimed(aim, self.bodies[(block / blocks % organs) as usize])?,
            };
            self.ball.across(point, dir)
        };
        (0..count).filter_map(shot).collect()
    }
}

/// A ball that holds a scene.
#[derive(Clone, Copy, Debug)]
struct Ball {
    centre: DVec3,
    radius_mm: f64,
}

impl Ball {
    fn around(bounds: Bounds) -> Self {
        Self { centre: bounds.centre(), radius_mm: 0.5 * bounds.diagonal() }
    }

    /// The line through `point` along `dir`, from far before the ball to far behind.
    fn across(&self, point: DVec3, dir: DVec3) -> Option<Shot> {
        let before = 1.5 * self.radius_mm + (point - self.centre).length();
        let shot = (point - before * dir, 2.0 * before * dir);
        Segment::along(shot.0, shot.1).map(|_| shot)
    }
}

fn block_rng(seed: u64, block: u64) -> Pcg64 {
    // Any odd constant spreads blocks over seeds that have nothing in common.
    Pcg64::seed_from_u64(seed ^ block.wrapping_add(1).wrapping_mul(0x9e37_79b9_7f4a_7c15))
}

/// Makes lines: a point and a direction of unit length each.
pub(in crate::modes) struct Archer {
    rng: Pcg64,
}

impl Archer {
    /// With the random numbers of a block.
    pub fn of_block(seed: u64, block: u64) -> Self {
        Self { rng: block_rng(seed, block) }
    }

    /// Uniform and isotropic: a direction uniform on the sphere, and a point uniform on the ball's disc across it.
    fn random(&mut self, ball: &Ball) -> (DVec3, DVec3) {
        let dir = self.direction();
        let [x, y]: [f64; 2] = UnitDisc.sample(&mut self.rng);
        let (across, along) = dir.any_orthonormal_pair();
        (ball.centre + ball.radius_mm * (x * across + y * along), dir)
    }

    /// At what is hard of one body.
    pub fn aimed(&mut self, aim: Aim, body: &Body) -> Option<(DVec3, DVec3)> {
        let bounds = body.bounds();
        let mesh = body.surface().mesh();
        let [a, b, c] = mesh.triangle(self.below(mesh.faces.len() as u64) as usize);
        let (share, other) = (self.unit(), self.unit());
        match aim {
            Aim::Vertices => Some((a, self.direction())),
            Aim::Edges => Some((a + share * (b - a), self.direction())),
            Aim::Silhouettes => {
                let along = (b - a) * (share - 0.5) + (c - a) * (other - 0.5);
                Some(((a + b + c) / 3.0, along.try_normalize()?))
            }
            Aim::CellBorders => {
                let space = LineSpace::new(bounds)?;
                let mut stuv = std::array::from_fn(|_| 0.5 + 0.8 * (self.unit() - 0.5));
                let halvings = 1 + self.below(FINEST_HALVINGS);
                let axis = self.below(4) as usize;
                // A multiple of the cell's side from the least intercept.
                let side = 3.0 / (1_u64 << halvings) as f64;
                stuv[axis] = -1.0 + side * ((stuv[axis] + 1.0) / side).round();
                let pair = PlanePair::ALL[self.below(6) as usize];
                let line = space.line_of(LinePoint { pair, stuv })?;
                Some((line.origin(), line.dir()))
            }
            Aim::AxisTies => {
                let mut dir = DVec3::from(std::array::from_fn::<f64, 3, _>(|_| 2.0 * share - 1.0));
                let third = self.below(3) as usize;
                dir[third] *= other;
                dir[(third + 1) % 3] *= if self.below(2) == 0 { 1.0 } else { -1.0 };
                Some((self.inside(&bounds), (bounds.size() * dir).try_normalize()?))
            }
            Aim::PlaneParallel => {
                let mut dir = self.direction();
                dir[self.below(3) as usize] *= LEAST_SLOPE.powf(share);
                Some((self.inside(&bounds), (bounds.size() * dir).try_normalize()?))
            }
        }
    }

    /// A point of the box.
    pub fn inside(&mut self, bounds: &Bounds) -> DVec3 {
        bounds.min + bounds.size() * DVec3::new(self.unit(), self.unit(), self.unit())
    }

    /// Uniform over the sphere.
    pub fn direction(&mut self) -> DVec3 {
        DVec3::from(Distribution::<[f64; 3]>::sample(&UnitSphere, &mut self.rng))
    }

    /// From 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        (self.rng.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON)
    }

    /// A whole number from 0 to below `n`.
    pub fn below(&mut self, n: u64) -> u64 {
        self.rng.next_u64() % n.max(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::ClosedMesh;
    use crate::geometry::primitives::icosphere;

    #[test]
    fn random_lines_meet_a_convex_body_as_often_as_its_surface_says() {
        // Of the uniform lines through a ball of radius R, a share S(K)/4πR² meets a convex body K in it, and the mean of its
        // chord over them is 4V/S (Cauchy–Crofton).
        let rays = 10 * BLOCK;
        let [body, far] = [0.0, 2.0].map(|x| ball_at(DVec3::new(x, 0.0, 0.0)));
        let set = RaySet::Random { rays, seed: 5 };
        let lines = Lines::of(&set, vec![&body, &far]).expect("lines");
        let ball = lines.ball;
        let (mut hits, mut total) = (0.0, 0.0);
        for (source, path) in (0..10).flat_map(|block| lines.block(block)) {
            let segment = Segment::along(source, path).expect("a ray");
            let mut parts = Vec::new();
            body.chords_of_segment(&segment, &mut parts);
            hits += f64::from(u32::from(!parts.is_empty()));
            total += parts.iter().map(|p| p.length()).sum::<f64>();
        }
        let surface = body.surface();
        let share = surface.mesh().area() / (4.0 * std::f64::consts::PI * ball.radius_mm.powi(2));
        let (n, deviation) = (rays as f64, (share * (1.0 - share) / rays as f64).sqrt());
        assert!((hits / n - share).abs() < 4.5 * deviation, "{} of the lines, not {share}", hits / n);
        let mean = 4.0 * surface.volume_mm3() / surface.mesh().area();
        // Chords of a ball have a standard deviation of 0.35 of their mean.
        assert!((total / hits / mean - 1.0).abs() < 4.5 * 0.36 / hits.sqrt(), "{}, not {mean}", total / hits);
    }

    #[test]
    fn aimed_lines_hold_the_whole_scene_between_their_ends() {
        let [body, far] = [0.0, -4.0].map(|x| ball_at(DVec3::new(x, 0.0, 0.0)));
        let set = RaySet::Adversarial { rays: 100, seed: 7 };
        let lines = Lines::of(&set, vec![&body, &far]).expect("lines");
        let sections = lines.sections();
        assert_eq!(sections.len(), Aim::ALL.len());
        for (name, blocks) in sections {
            assert_eq!(blocks.end - blocks.start, 2, "{name}");
            for block in blocks {
                let shots = lines.block(block);
                assert!(shots.len() > 95, "{name}");
                for end in shots.iter().flat_map(|&(source, path)| [source, source + path]) {
                    assert!((end - lines.ball.centre).length() > lines.ball.radius_mm, "{name}");
                }
            }
        }
    }

    fn ball_at(centre: DVec3) -> Body {
        Body::new(ClosedMesh::new(icosphere(3).map_vertices(|v| v + centre)).expect("closed").0)
    }
}
