//! What the sky's noise looks like from its middle, as a texture on the six sides of a cube.
//!
//! ```text
//!    ┌──┬──┬──┬──┐        Five octaves of noise cost some three hundred operations, and a picture looks at the same places of
//!    ├──┼──┼──┼──┤        the sky again and again. So the noise is evaluated at the points of a lattice, when they are asked
//!    ├──┼─●┼──┼──┤  ◄──   for first, and mixed bilinearly between them: some fifteen operations. The lattice is twice as fine
//!    ├──┼──┼──┼──┤        as that of the finest octave, whose tops are rounded: by three quarters of 1/255 in the mean. Slow octaves
//!    └──┴──┴──┴──┘        are evaluated at every second point. Sides share the points on their edges, where the noise is that
//!                         of the place and not of the side.
//! ```

use super::cube::OnCube;
use super::lazy::Lazy;
use crate::geometry::{Real, Vec3};
use crate::scene::trace::{Noise, Sky};

/// Cells of the texture along a cell of the noise's finest octave, where the sides are nearest to the sky and cells largest.
const CELLS_PER_OCTAVE_CELL: f64 = 2.0;

/// Cells along a side, at most: noise of more than 8 waves is evaluated for each ray. Textures so hold 16 MB at most.
const MOST_CELLS: usize = 512;

/// Octaves before this one are slow: halfway between two points they are the mean of both, but for no more than the finest one is
/// off by halfway between two of its own.
const FIRST_FAST: i32 = 3;

/// A sky with its texture.
pub struct SkyMap<'a> {
    sky: &'a Sky,
    /// Cells along a side, an even number; 0 for no texture.
    cells: usize,
    /// Shares at the points of the six sides, x, y, z from below and from above, each row by row.
    points: Vec<Lazy>,
    /// What the slow octaves add up to at every second point of every second row.
    slow: Vec<Lazy>,
}

impl<'a> SkyMap<'a> {
    /// The texture of a sky, of which nothing is made yet.
    pub fn new(sky: &'a Sky) -> Self {
        // A side spans two radii.
        let cells = (2.0 * sky.frequency.abs() * Noise::FINEST * CELLS_PER_OCTAVE_CELL).ceil();
        let cells = if cells <= MOST_CELLS as f64 { (cells as usize).max(1).next_multiple_of(2) } else { 0 };
        let points = |cells: usize| if cells == 0 { 0 } else { 6 * (cells + 1) * (cells + 1) };
        Self { sky, cells, points: Lazy::many(points(cells)), slow: Lazy::many(points(cells / 2)) }
    }

    /// What a ray sees that meets the sky at a place.
    pub fn colour_at<R: Real>(&self, place: Vec3<R>) -> Vec3<R> {
        let share = if self.cells == 0 { self.sky.share(place) } else { self.share(place) };
        self.sky.colour(share)
    }

    /// As [`Sky::share`], by the texture.
    fn share<R: Real>(&self, place: Vec3<R>) -> R {
        let OnCube { side, cell, at } = OnCube::of(place, self.cells);
        let within: [R; 2] = std::array::from_fn(|i| at[i] - R::of(cell[i] as f64));
        let point = |bits: usize| R::of(self.point::<R>(side, [cell[0] + (bits & 1), cell[1] + (bits >> 1)]));
        let mix = |a: R, b: R, share: R| a + (b - a) * share;
        mix(mix(point(0), point(1), within[0]), mix(point(2), point(3), within[0]), within[1])
    }

    /// The share at a point of a side.
    #[inline]
    fn point<R: Real>(&self, side: usize, at: [usize; 2]) -> f64 {
        self.points[index(self.cells, side, at)].get(|| {
            let slow = self.slow::<R>(side, at);
            let fast = self.sky.octaves(self.place::<R>(side, at), FIRST_FAST..Noise::OCTAVES);
            Noise::share_of(slow + fast).get()
        })
    }

    /// What the slow octaves add up to at a point.
    fn slow<R: Real>(&self, side: usize, at: [usize; 2]) -> R {
        let at_even = |at: [usize; 2]| {
            let known = &self.slow[index(self.cells / 2, side, at.map(|x| x / 2))];
            R::of(known.get(|| self.sky.octaves(self.place::<R>(side, at), 0..FIRST_FAST).get()))
        };
        let mean = |a: R, b: R| (a + b) * R::of(0.5);
        let along_row = |row: usize| match at[0] % 2 {
            0 => at_even([at[0], row]),
            _ => mean(at_even([at[0] - 1, row]), at_even([at[0] + 1, row])),
        };
        if at[1].is_multiple_of(2) {
            along_row(at[1])
        } else {
            mean(along_row(at[1] - 1), along_row(at[1] + 1))
        }
    }

    /// Where a point of a side lies on the sky, from its centre.
    fn place<R: Real>(&self, side: usize, at: [usize; 2]) -> Vec3<R> {
        let (k, half) = (side / 2, R::of(0.5 * self.cells as f64));
        let mut way = [half; 3];
        way[k] = if side % 2 == 1 { half } else { -half };
        for (i, at) in at.into_iter().enumerate() {
            way[(k + 1 + i) % 3] = R::of(at as f64) - half;
        }
        Vec3::new(way[0], way[1], way[2]).normalized() * R::of(self.sky.radius)
    }
}

/// Of a point among those of six sides with so many cells along each.
fn index(cells: usize, side: usize, at: [usize; 2]) -> usize {
    (side * (cells + 1) + at[1]) * (cells + 1) + at[0]
}

#[cfg(test)]
mod tests {
    use glam::DVec3;
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::scene::trace::bezier_surface;

    #[test]
    fn textures_are_the_noise_but_for_its_sharpest_tops() {
        let world = bezier_surface(1);
        let map = SkyMap::new(&world.sky);
        let mut rng = rand_pcg::Pcg64::seed_from_u64(3);
        let (mut off, mut greatest, n) = (0.0, 0.0_f64, 20_000);
        for _ in 0..n {
            let dir = DVec3::from([(); 3].map(|()| rng.random_range(-1.0..1.0))).normalize();
            let origin = Vec3::<f64>::of(40.0 * dir.any_orthonormal_vector());
            let place = world.sky.from(origin).place(Vec3::of(dir));
            let missed = (map.share(place) - world.sky.share(place)).abs();
            (off, greatest) = (off + missed, greatest.max(missed));
        }
        assert!(
            off / f64::from(n) < 0.8 / 255.0 && greatest < 6.0 / 255.0,
            "{} {greatest}",
            off / f64::from(n)
        );
    }

    #[test]
    fn sides_join() {
        let world = bezier_surface(2);
        let map = SkyMap::new(&world.sky);
        for i in 0..500 {
            // Across an edge of the cube, and past a corner.
            let along = f64::from(i) / 250.0 - 1.0;
            let share = |shift: f64| map.share(Vec3::<f64>::of(DVec3::new(1.0 + shift, along, 1.0 - shift)));
            assert!((share(1e-9) - share(-1e-9)).abs() < 1e-6, "{along}");
        }
    }

    #[test]
    fn noise_of_many_waves_is_no_texture() {
        let world = bezier_surface(1);
        let sky = Sky { frequency: 40.0, ..world.sky };
        let map = SkyMap::new(&sky);
        let place = sky.from(Vec3::<f64>::default()).place(Vec3::of(DVec3::new(0.6, 0.0, 0.8)));
        assert_eq!(map.cells, 0);
        assert_eq!(map.colour_at(place), sky.colour(sky.share(place)));
    }
}
