//! Gradient noise: smooth, seeded, the same everywhere.

use crate::geometry::{Real, Vec3};

/// Octaves of turbulence; the finest is 1/32 of the first wave.
const OCTAVES: i32 = 5;

/// Perlin's gradient noise (2002, doi:10.1145/566654.566636) on a seeded lattice.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Noise {
    seed: u64,
}

impl Noise {
    /// The noise of a seed.
    pub fn new(seed: u64) -> Self {
        Self { seed }
    }

    /// Noise of several octaves, each of half the amplitude: 0 to 1.
    pub fn turbulence<R: Real>(&self, place: Vec3<R>) -> R {
        let sum = (0..OCTAVES).fold(R::of(0.0), |sum, octave| {
            let scale = 2f64.powi(octave);
            sum + self.at(place * R::of(scale)) * R::of(1.0 / scale)
        });
        // Octaves seldom add up to more than 0.7.
        (R::of(0.5) + sum * R::of(0.7)).max(R::of(0.0)).min(R::of(1.0))
    }

    /// One octave: −1 to 1, 0 at the lattice's points, with continuous second derivatives.
    pub fn at<R: Real>(&self, place: Vec3<R>) -> R {
        let p = [place.x, place.y, place.z];
        let cell = p.map(|x| x.get().floor());
        let within: [R; 3] = std::array::from_fn(|a| p[a] - R::of(cell[a]));
        let fade = within.map(|x| x * x * x * (x * (x * R::of(6.0) - R::of(15.0)) + R::of(10.0)));
        let from = [within, within.map(|x| x - R::of(1.0))];
        let corner = |bits: usize| {
            let off: [usize; 3] = std::array::from_fn(|a| bits >> a & 1);
            let slope = self.slope(std::array::from_fn(|a| cell[a] as i64 + off[a] as i64));
            // Of the three parts of the product one is zero.
            let part = |a: usize| if slope[a] < 0 { -from[off[a]][a] } else { from[off[a]][a] };
            let zero = slope.iter().position(|&s| s == 0).unwrap_or(0);
            part((zero + 1) % 3) + part((zero + 2) % 3)
        };
        let mix = |a: R, b: R, share: R| a + (b - a) * share;
        let edge = |bits: usize| mix(corner(bits), corner(bits | 1), fade[0]);
        let face = |bits: usize| mix(edge(bits), edge(bits | 2), fade[1]);
        mix(face(0), face(4), fade[2])
    }

    /// The gradient at a point of the lattice: one of the twelve to the edges of a cube.
    fn slope(&self, point: [i64; 3]) -> [i8; 3] {
        // splitmix64 over the coordinates: cheap, and as good as random for the eye.
        let mix = |hash: u64, x: i64| {
            let z = (hash ^ x as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
            let z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
            z ^ z >> 31
        };
        let hash = point.into_iter().fold(self.seed, mix);
        let (zero, signs) = ((hash % 3) as usize, hash >> 32);
        let sign = |bit: u64| if signs >> bit & 1 == 0 { 1 } else { -1 };
        let mut slope = [sign(0), sign(1), 0];
        slope.swap(2, zero);
        slope
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
