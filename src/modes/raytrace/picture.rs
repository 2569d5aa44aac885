//! Pictures as rendering leaves them, and where in a pixel its rays go.

use rand_pcg::rand_core::{Rng, SeedableRng};

use super::{Tile, Work};
use crate::geometry::Region;
use crate::physics::composite::encode_srgb;

/// A rendered view: linear colours, row by row.
#[derive(Clone, Debug, PartialEq)]
pub struct Picture {
    size: (u32, u32),
    colours: Vec<[f32; 3]>,
    traced: Vec<bool>,
    work: Work,
}

impl Picture {
    pub(super) fn of_tiles(size: (u32, u32), tiles: Vec<(Region, Tile)>) -> Self {
        let pixels = size.0 as usize * size.1 as usize;
        let mut picture = Self {
            size,
            colours: vec![[0.0; 3]; pixels],
            traced: vec![false; pixels],
            work: Work::default(),
        };
        for (region, tile) in tiles {
            for ((column, row), (colour, traced)) in
                region.places().zip(tile.colours.into_iter().zip(tile.traced))
            {
                let at = row as usize * size.0 as usize + column as usize;
                (picture.colours[at], picture.traced[at]) = (colour, traced);
            }
            picture.work += tile.work;
        }
        picture
    }

    /// A picture of greys, row by row; black where there is none.
    pub(in crate::modes) fn of_greys(size: (u32, u32), greys: &[f32], traced: Vec<bool>, work: Work) -> Self {
        Self { size, colours: greys.iter().map(|&grey| [grey; 3]).collect(), traced, work }
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        self.size
    }

    /// Linear RGB of each pixel; highlights may exceed 1.
    pub fn colours(&self) -> &[[f32; 3]] {
        &self.colours
    }

    /// Whether a ray of the pixel was traced through an object that has a tree.
    pub fn traced(&self) -> &[bool] {
        &self.traced
    }

    /// What it took.
    pub fn work(&self) -> Work {
        self.work
    }

    /// The mean distance of two pictures' encoded colours, each channel from 0 to 1 (§3.2). `None` for pictures of
    /// different sizes.
    pub fn mean_distance(&self, other: &Self) -> Option<f64> {
        let distance = |(a, b): (&[f32; 3], &[f32; 3])| {
            let squares = (0..3).map(|i| (encode_srgb(a[i]) - encode_srgb(b[i])).powi(2));
            squares.sum::<f64>().sqrt()
        };
        let sum: f64 = self.colours.iter().zip(&other.colours).map(distance).sum();
        (self.size == other.size).then(|| sum / self.colours.len() as f64)
    }
}

/// Where in a pixel its rays go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Samples {
    side: u32,
    seed: Option<u64>,
}

/// One ray, through the middle.
impl Default for Samples {
    fn default() -> Self {
        Self { side: 1, seed: None }
    }
}

impl Samples {
    /// `count` rays per pixel on a regular lattice or, with a seed, one at random in each of its cells. `None` unless the
    /// count is the square of 1 to 16.
    pub fn new(count: u32, seed: Option<u64>) -> Option<Self> {
        let side = count.isqrt();
        (side * side == count && (1..=16).contains(&side)).then_some(Self { side, seed })
    }

    /// The places in one pixel, row by row, from 0 to 1 along columns and rows.
    pub fn of_pixel(&self, column: u32, row: u32) -> impl Iterator<Item = [f64; 2]> {
        let pixel = u64::from(row) << 32 | u64::from(column);
        let mut random = self
            .seed
            .map(|seed| rand_pcg::Pcg64Mcg::seed_from_u64(seed ^ pixel.wrapping_mul(0x9e37_79b9_7f4a_7c15)));
        let mut within =
            move || random.as_mut().map_or(0.5, |r| (r.next_u64() >> 11) as f64 / (1u64 << 53) as f64);
        let side = self.side;
        (0..side * side)
            .map(move |n| [n % side, n / side].map(|i| (f64::from(i) + within()) / f64::from(side)))
    }

    /// How many rays a pixel has.
    pub fn count(&self) -> u32 {
        self.side * self.side
    }
}
