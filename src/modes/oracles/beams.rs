//! The rays that oracles ask for: images of a body with a random offset, and random lines.
//!
//! ```text
//!         ·  ·  ·  ·  ·            a lattice of pixels, turned by a random angle and moved by a random part of a pixel:
//!       ·  ·╭─────╮·  ·            every point of the shadow is as likely to be hit as any other, so that the sum over the
//!         ·  │· ·│  ·  ·           lattice, times the area of a cell, is the integral in the mean
//!           ·╰────╯  ·  ·
//! ```

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DVec2, DVec3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use crate::exact::Body;
use crate::geometry::{RayGrid, Segment, Upstream};

/// Random numbers of one seed and name.
pub struct Random(Pcg64);

impl Random {
    /// The stream of these names: the same names, the same numbers (FNV-1a,
    /// <https://datatracker.ietf.org/doc/draft-eastlake-fnv/>).
    pub fn new(seed: u64, names: &[&str]) -> Self {
        let bytes = names.iter().flat_map(|name| name.bytes().chain([0]));
        let hash = bytes.fold(0xcbf2_9ce4_8422_2325, |hash: u64, byte| {
            (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
        });
        Self(Pcg64::seed_from_u64(seed ^ hash))
    }

    /// Uniform in [0, 1).
    pub fn unit(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 * (0.5 * f64::EPSILON)
    }

    /// Uniform over the sphere (Archimedes: its height is uniform).
    pub fn direction(&mut self) -> DVec3 {
        let (z, angle) = (2.0 * self.unit() - 1.0, TAU * self.unit());
        let radius = (1.0 - z * z).max(0.0).sqrt();
        DVec3::new(radius * angle.cos(), radius * angle.sin(), z)
    }

    /// A frame with this third axis, turned about it at random.
    fn frame(&mut self, along: DVec3) -> [DVec3; 2] {
        let (sin, cos) = (TAU * self.unit()).sin_cos();
        let column = along.any_orthonormal_vector();
        let row = along.cross(column);
        [cos * column + sin * row, cos * row - sin * column]
    }
}

/// Rays from beyond a body to beyond it.
#[derive(Clone, Debug)]
pub enum Rays {
    /// Of an image.
    Image(RayGrid),
    /// One by one: source and target, mm.
    List(Vec<[DVec3; 2]>),
}

impl Rays {
    /// How many there are.
    pub fn count(&self) -> usize {
        match self {
            Self::Image(grid) => grid.whole().pixels(),
            Self::List(ends) => ends.len(),
        }
    }

    /// Sources and targets, mm, in order.
    pub fn ends(&self) -> Vec<[DVec3; 2]> {
        match self {
            Self::Image(grid) => {
                let target = |(column, row)| grid.point(column, row);
                grid.whole().places().map(target).map(|target| [grid.start_of(target), target]).collect()
            }
            Self::List(ends) => ends.clone(),
        }
    }

    /// The rays, in order. Sources and targets are far apart by construction.
    pub fn segments(&self) -> Vec<Segment> {
        match self {
            Self::Image(grid) => grid.whole().places().map(|(c, r)| grid.segment(c, r)).collect(),
            Self::List(ends) => ends.iter().filter_map(|&[from, to]| Segment::between(from, to)).collect(),
        }
    }

    /// Each from its target to its source. An image of a point source becomes a list.
    pub(super) fn reversed(&self) -> Self {
        if let Self::Image(grid) = self
            && let Upstream::Path(path) = grid.upstream()
            && let (columns, rows) = grid.size()
            && let Some(back) =
                RayGrid::new(Upstream::Path(-path), grid.origin() - path, grid.steps(), [columns, rows])
        {
            return Self::Image(back);
        }
        Self::List(self.ends().into_iter().map(|[from, to]| [to, from]).collect())
    }

    /// Each moved by `map`, which must not be singular.
    pub(super) fn mapped(&self, map: &DAffine3) -> Self {
        if let Self::Image(grid) = self
            && let (columns, rows) = grid.size()
            && let upstream = (match grid.upstream() {
                Upstream::Source(source) => Upstream::Source(map.transform_point3(source)),
                Upstream::Path(path) => Upstream::Path(map.transform_vector3(path)),
            })
            && let steps = grid.steps().map(|step| map.transform_vector3(step))
            && let Some(image) =
                RayGrid::new(upstream, map.transform_point3(grid.origin()), steps, [columns, rows])
        {
            return Self::Image(image);
        }
        Self::List(self.ends().into_iter().map(|ends| ends.map(|end| map.transform_point3(end))).collect())
    }
}

/// An image for an integral over the plane of its pixels.
pub(super) struct Lattice {
    pub rays: Rays,
    /// The area of a pixel, mm².
    pub cell_mm2: f64,
    /// From the source to the plane, mm; of parallel rays, anything.
    pub depth_mm: f64,
}

/// Parallel rays along `along`, through all of the body.
pub(super) fn parallel(body: &Body, along: DVec3, pixels: u32, random: &mut Random) -> Option<Lattice> {
    let reach = body.bounds().diagonal();
    let onto = |v: DVec3| v - (v - body.bounds().centre()).dot(along) * along + reach * along;
    lattice(body, along, pixels, onto, Upstream::Path(2.0 * reach * along), random)
}

/// Rays from a point three times the body's size before its middle, through all of it.
pub(super) fn cone(body: &Body, along: DVec3, pixels: u32, random: &mut Random) -> Option<Lattice> {
    let (middle, reach) = (body.bounds().centre(), body.bounds().diagonal());
    let source = middle - 3.0 * reach * along;
    let onto = |v: DVec3| source + (v - source) * (4.0 * reach / (v - source).dot(along));
    lattice(body, along, pixels, onto, Upstream::Source(source), random)
}

/// `onto` casts the body's corners on the plane of pixels. The outermost pixels lie beyond the shadow, wherever the lattice
/// is moved: half a pixel for the move, half for good measure.
fn lattice(
    body: &Body,
    along: DVec3,
    pixels: u32,
    onto: impl Fn(DVec3) -> DVec3,
    upstream: Upstream,
    random: &mut Random,
) -> Option<Lattice> {
    let axes = random.frame(along);
    let depth = 4.0 * body.bounds().diagonal();
    let corners = body.bounds().corners().map(onto);
    let places = corners.map(|v| DVec2::from(axes.map(|axis| axis.dot(v - corners[0]))));
    let low = places.into_iter().fold(DVec2::INFINITY, DVec2::min);
    let high = places.into_iter().fold(DVec2::NEG_INFINITY, DVec2::max);
    let step = (high - low) / f64::from(pixels.saturating_sub(2).max(1));
    let offset = DVec2::new(random.unit() - 0.5, random.unit() - 0.5);
    let first = 0.5 * (low + high) + (offset - 0.5 * f64::from(pixels - 1)) * step;
    let origin = corners[0] + first.x * axes[0] + first.y * axes[1];
    let grid = RayGrid::new(upstream, origin, [step.x * axes[0], step.y * axes[1]], [pixels, pixels])?;
    Some(Lattice { rays: Rays::Image(grid), cell_mm2: step.x * step.y, depth_mm: depth })
}

/// Lines that meet the ball around the body's box, uniform and isotropic: a direction, then a point of the disc across it.
/// Returns the area of the disc, mm².
pub(super) fn isotropic(body: &Body, lines: usize, random: &mut Random) -> (Rays, f64) {
    let (middle, radius) = (body.bounds().centre(), 0.5 * body.bounds().diagonal());
    let line = |_| {
        let along = random.direction();
        let [column, row] = random.frame(along);
        let (distance, angle) = (radius * random.unit().sqrt(), TAU * random.unit());
        let foot = middle + distance * (angle.cos() * column + angle.sin() * row);
        [foot - 2.0 * radius * along, foot + 2.0 * radius * along]
    };
    (Rays::List((0..lines).map(line).collect()), PI * radius * radius)
}
