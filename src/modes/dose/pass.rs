//! Photons of many energies along one stretch: the inner loop of a study with a spectrum.
//!
//! Bins are taken [`LANES`] at a time, so that the compiler can use wide instructions where the processor has them; operations
//! and their order are the same without, and so are the bits. The exponential is an own one for the same reason: the C
//! library's is another from processor to processor.

use super::optics::{Optics, OrganOptics};

/// Bins taken at a time; spectra are filled up to a multiple of it with bins without photons.
pub const LANES: usize = 4;

/// Exponents below this are taken for no photons at all: e⁻⁷⁰⁰ is 10⁻³⁰⁴.
const LEAST_EXPONENT: f64 = -700.0;

/// 1.5 · 2⁵²: added to a number and taken off again, it leaves the nearest whole one.
const ROUNDER: f64 = 6_755_399_441_055_744.0;

/// ln 2 as a sum, its first part with so few digits that small multiples of it are exact (fdlibm's `e_exp.c`).
const LN_2: [f64; 2] = [6.931_471_803_691_238e-1, 1.908_214_929_270_587_7e-10];

/// 1/n! for n from 13 down to 0: for |r| ≤ ln 2 / 2 what is left out is less than 5·10⁻¹⁸.
const TAYLOR: [f64; 14] = [
    1.0 / 6_227_020_800.0,
    1.0 / 479_001_600.0,
    1.0 / 39_916_800.0,
    1.0 / 3_628_800.0,
    1.0 / 362_880.0,
    1.0 / 40_320.0,
    1.0 / 5_040.0,
    1.0 / 720.0,
    1.0 / 120.0,
    1.0 / 24.0,
    1.0 / 6.0,
    0.5,
    1.0,
    1.0,
];

/// Takes photons, the share of each bin that is `left`, along `length_mm` of an organ; returns the energy that they lose there,
/// and that which is absorbed there, keV.
pub fn pass(optics: &Optics, organ: &OrganOptics, length_mm: f64, left: &mut [f64]) -> (f64, f64) {
    crate::dispatch::arch().dispatch(Pass { optics, organ, length_mm, left })
}

struct Pass<'a> {
    optics: &'a Optics,
    organ: &'a OrganOptics,
    length_mm: f64,
    left: &'a mut [f64],
}

impl pulp::WithSimd for Pass<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn with_simd<S: pulp::Simd>(self, _: S) -> (f64, f64) {
        let (left, _) = self.left.as_chunks_mut::<LANES>();
        let (mu, _) = self.organ.mu_bins_per_mm.as_chunks::<LANES>();
        let (absorbed, _) = self.organ.absorbed_kev.as_chunks::<LANES>();
        let (energies, _) = self.optics.energies_kev.as_chunks::<LANES>();
        let (mut removed_kev, mut absorbed_kev) = ([0.0; LANES], [0.0; LANES]);
        for (((left, mu), absorbed), energies) in left.iter_mut().zip(mu).zip(absorbed).zip(energies) {
            for lane in 0..LANES {
                let behind = left[lane] * exp_of_negative(-mu[lane] * self.length_mm);
                let lost = left[lane] - behind;
                left[lane] = behind;
                removed_kev[lane] += energies[lane] * lost;
                absorbed_kev[lane] += absorbed[lane] * lost;
            }
        }
        (removed_kev.iter().sum(), absorbed_kev.iter().sum())
    }
}

/// eˣ for x ≤ 0, within two units in the last place; 0 below [`LEAST_EXPONENT`]. Without a branch.
#[inline(always)]
fn exp_of_negative(x: f64) -> f64 {
    let rounded = x * std::f64::consts::LOG2_E + ROUNDER;
    let halvings = rounded - ROUNDER;
    let rest = (x - halvings * LN_2[0]) - halvings * LN_2[1];
    let mut series = TAYLOR[0];
    for coefficient in &TAYLOR[1..] {
        series = series * rest + coefficient;
    }
    // The low bits of `rounded` are the whole number; a shift brings them into a float's exponent.
    let scale = f64::from_bits((rounded.to_bits() << 52).wrapping_add(1.0_f64.to_bits()));
    if x >= LEAST_EXPONENT { series * scale } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exponential_is_the_librarys_within_two_units_in_the_last_place() {
        let mut worst = 0.0_f64;
        for i in 0..2_000_000 {
            let x = -f64::from(i) * 3.5e-4 - 1e-9 * f64::from(i % 7);
            let relative = exp_of_negative(x) / x.exp() - 1.0;
            worst = worst.max(if x >= LEAST_EXPONENT { relative.abs() } else { 0.0 });
        }
        assert!(worst < 2.5 * f64::EPSILON, "{worst:e}");
        assert_eq!((exp_of_negative(0.0), exp_of_negative(-0.0)), (1.0, 1.0));
        assert_eq!((exp_of_negative(-1e4), exp_of_negative(f64::NEG_INFINITY)), (0.0, 0.0));
        assert!((exp_of_negative(-1e-12) - (1.0 - 1e-12)).abs() < 2e-16);
    }

    #[test]
    fn wide_and_narrow_instructions_give_the_same_bits() {
        let bins = 112;
        let ramp = |from: f64, step: f64| (0..bins).map(|i| from + step * f64::from(i)).collect::<Vec<f64>>();
        let optics = Optics { energies_kev: ramp(10.0, 1.0), ..Optics::default() };
        let organ = OrganOptics {
            mu_bins_per_mm: ramp(0.3, -0.0025),
            absorbed_kev: ramp(9.0, 0.1),
            ..OrganOptics::default()
        };
        for length_mm in [1e-9, 0.37, 12.0, 190.0, 1e5] {
            let [mut wide, mut narrow] = [ramp(1e-3, 1e-5), ramp(1e-3, 1e-5)];
            let of_wide = pass(&optics, &organ, length_mm, &mut wide);
            let of_narrow = pulp::WithSimd::with_simd(
                Pass { optics: &optics, organ: &organ, length_mm, left: &mut narrow },
                pulp::Scalar,
            );
            assert_eq!((of_wide, wide), (of_narrow, narrow), "{length_mm} mm");
        }
    }
}
