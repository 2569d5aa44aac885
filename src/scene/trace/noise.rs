//! Gradient noise: smooth, seeded, the same everywhere.

use std::ops::Range;

use crate::geometry::{Real, Vec3};

/// Perlin's gradient noise (2002, doi:10.1145/566654.566636) on a seeded lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Noise {
    seed: u64,
}

impl Noise {
    /// Octaves of turbulence; the finest is 1/16 of the first wave.
    pub const OCTAVES: i32 = 5;

    /// Cells of the finest octave's lattice along the first one's.
    pub const FINEST: f64 = (1 << (Self::OCTAVES - 1)) as f64;

    /// The noise of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// What octaves add up to, each of half the amplitude of the one before it.
    pub fn octaves<R: Real>(&self, place: Vec3<R>, octaves: Range<i32>) -> R {
        octaves.fold(R::of(0.0), |sum, octave| {
            let scale = 2f64.powi(octave);
            sum + self.at(place * R::of(scale)) * R::of(1.0 / scale)
        })
    }

    /// Turbulence, 0 to 1, of what octaves add up to, which is seldom more than 0.7.
    pub fn share_of<R: Real>(sum: R) -> R {
        (R::of(0.5) + sum * R::of(0.7)).max(R::of(0.0)).min(R::of(1.0))
    }

    /// One octave: −1 to 1, 0 at the lattice's points, with continuous second derivatives.
    pub fn at<R: Real>(&self, place: Vec3<R>) -> R {
        let p = [place.x, place.y, place.z];
        let cell = p.map(|x| x.get().floor());
        let within: [R; 3] = std::array::from_fn(|a| p[a] - R::of(cell[a]));
        let fade = within.map(|x| x * x * x * (x * (x * R::of(6.0) - R::of(15.0)) + R::of(10.0)));
        let from = [within, within.map(|x| x - R::of(1.0))];
        // By corner, axis and sign: a random sign that is looked up is no branch to be guessed.
        let signed = from.map(|side| side.map(|x| [x, -x]));
        let slopes = self.slopes(cell.map(|x| x as i64));
        let corner = |bits: usize| {
            let slope = slopes[bits];
            // Of the three parts of the product one is zero.
            let part = |i: usize| signed[bits >> slope.axes[i] & 1][slope.axes[i]][slope.signs[i]];
            part(0) + part(1)
        };
        let mix = |a: R, b: R, share: R| a + (b - a) * share;
        let edge = |bits: usize| mix(corner(bits), corner(bits | 1), fade[0]);
        let face = |bits: usize| mix(edge(bits), edge(bits | 2), fade[1]);
        mix(face(0), face(4), fade[2])
    }

    /// The gradients at the corners of a cell of the lattice, by the corner's bits.
    fn slopes(&self, [x, y, z]: [i64; 3]) -> [Slope; 8] {
        // splitmix64 over the coordinates: cheap, and as good as random for the eye.
        let mix = |hash: u64, x: i64| {
            let z = (hash ^ x as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ z >> 31
        };
        let of_x = [0, 1].map(|i| mix(self.seed, x + i));
        let of_xy: [u64; 4] = std::array::from_fn(|bits| mix(of_x[bits & 1], y + (bits as i64 >> 1)));
        std::array::from_fn(|bits| Slope::of(mix(of_xy[bits & 3], z + (bits as i64 >> 2))))
    }
}

/// One of the twelve gradients to the edges of a cube: two axes, and for each whether it runs backwards.
#[derive(Clone, Copy)]
struct Slope {
    axes: [usize; 2],
    signs: [usize; 2],
}

impl Slope {
    fn of(hash: u64) -> Self {
        let [a, b] = [hash >> 32 & 1, hash >> 33 & 1].map(|sign| sign as usize);
        match hash % 3 {
            0 => Self { axes: [2, 1], signs: [a, b] },
            1 => Self { axes: [0, 2], signs: [a, b] },
            _ => Self { axes: [0, 1], signs: [a, b] },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_smooth_across_cells_and_zero_on_the_lattice() {
        let noise = Noise::new(3);
        let at = |x: f64| noise.at(Vec3::new(x, 0.4, -2.7));
        assert_eq!(noise.at(Vec3::new(2.0, -1.0, 5.0)), 0.0);
        for cell in -3..3 {
            let x = f64::from(cell);
            assert!((at(x - 1e-9) - at(x + 1e-9)).abs() < 1e-8);
            let slope = |x: f64| (at(x + 1e-6) - at(x - 1e-6)) / 2e-6;
            assert!((slope(x - 1e-5) - slope(x + 1e-5)).abs() < 1e-3);
        }
        let spread = (0..1000)
            .map(|i| at(0.037 * f64::from(i)))
            .fold((0.0_f64, 0.0_f64), |(l, h), x| (l.min(x), h.max(x)));
        assert!(spread.0 < -0.2 && spread.1 > 0.2, "{spread:?}");
    }
}
