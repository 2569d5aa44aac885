//! Quantum noise: a finite number of photons, counted.
//!
//! Each pixel would receive I₀ photons (mean) without a patient. Photons of each energy bin arrive independently, so a bin's count is
//! Poisson with mean I₀ w_k exp(−a_k); the detector adds the counts (counting) or their energies (energy-integrating: a
//! compound Poisson signal, whose variance is Σ E_k² of the means, more than a rescaled Poisson would have). Thinning a Poisson
//! stream gives a Poisson stream, so the bin means are all that the patient changes.
//!
//! The random numbers of a pixel are a function of (seed, view, pixel) alone: not of threads, tiles or the order of pixels.

use rand_distr::{Distribution, Poisson};
use rand_pcg::Pcg64;

use super::attenuation::{Attenuator, RowMass};
use crate::{Error, Result};

/// The most photons per pixel: far beyond any detector, and counts below it are exact in f64.
pub const MAX_PHOTONS_PER_PIXEL: f64 = 1e15;

/// The count that stands for "none" where a logarithm is taken: half a photon, the middle between none and one. So a noisy p is at most
/// ln(2 I₀).
pub const FLOOR_COUNTS: f64 = 0.5;

/// Poisson noise of a given number of photons per pixel and seed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PhotonNoise {
    photons_per_pixel: f64,
    seed: u64,
}

impl PhotonNoise {
    /// Noise of `photons_per_pixel` mean photons before the patient, I₀, at every pixel. An error unless above 0 and at most
    /// [`MAX_PHOTONS_PER_PIXEL`].
    pub fn new(photons_per_pixel: f64, seed: u64) -> Result<Self> {
        if photons_per_pixel > 0.0 && photons_per_pixel <= MAX_PHOTONS_PER_PIXEL {
            return Ok(Self { photons_per_pixel, seed });
        }
        Err(Error::input(
            "photons per pixel",
            format!("{photons_per_pixel} is not a number of photons"),
            format!("give a number above 0, at most {MAX_PHOTONS_PER_PIXEL:e}"),
        ))
    }

    /// Mean photons per pixel before the patient, I₀.
    pub fn photons_per_pixel(&self) -> f64 {
        self.photons_per_pixel
    }

    /// The seed.
    pub fn seed(&self) -> u64 {
        self.seed
    }

    /// The noisy transmission of ray `ray` of a row: signal over mean signal without a patient, 0 if no photon arrives, above 1 by
    /// chance. `view` and `pixel` (row-major index in the image) choose the random numbers.
    pub fn transmission(
        &self,
        attenuator: &Attenuator,
        row: &RowMass,
        ray: usize,
        view: u64,
        pixel: u64,
    ) -> f64 {
        let mut random = self.stream(view, pixel);
        let response = attenuator.response();
        let signal: f64 = attenuator
            .transmitted_photons(row, ray)
            .map(|(energy_kev, share)| {
                response.signal(energy_kev) * counts(self.photons_per_pixel * share, &mut random)
            })
            .sum();
        signal / (self.photons_per_pixel * attenuator.mean_signal())
    }

    /// p = −ln T of a noisy transmission, with [`FLOOR_COUNTS`] mean photons in the place of fewer. Negative where chance
    /// gave more photons than were sent.
    pub fn line_integral(&self, noisy_transmission: f64) -> f64 {
        let floor = FLOOR_COUNTS / self.photons_per_pixel;
        // Adding zero turns the −0 of T = 1 into 0. NaN stays NaN, which `max` would hide.
        if noisy_transmission < floor { -floor.ln() } else { -noisy_transmission.ln() + 0.0 }
    }

    /// The pixel's own random numbers.
    ///
    /// PCG's streams of one state are correlated at their start, so the state itself is hashed from the counters, with the finalizer of
    /// SplitMix64 (Steele, Lea & Flood 2014, doi:10.1145/2714064.2660195) after each: a bijection that avalanches.
    fn stream(&self, view: u64, pixel: u64) -> Pcg64 {
        let base = mixed(mixed(mixed(self.seed) ^ view) ^ pixel);
        let half = |i: u64| u128::from(mixed(base.wrapping_add(i)));
        Pcg64::new(half(1) << 64 | half(2), half(3) << 64 | half(4))
    }
}

/// SplitMix64's step and finalizer.
fn mixed(counter: u64) -> u64 {
    let mut z = counter.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ (z >> 31)
}

/// A Poisson count of the given mean; 0 where the mean underflowed to 0, NaN if it is not a number.
fn counts(mean: f64, random: &mut Pcg64) -> f64 {
    match Poisson::new(mean) {
        Ok(poisson) => poisson.sample(random),
        Err(_) if mean == 0.0 => 0.0,
        Err(_) => f64::NAN,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::physics::DetectorResponse::{self, Counting, EnergyIntegrating};
    use crate::physics::{Material, Spectrum};

    /// Seed of the statistical tests: fixed, so that they pass or fail alike everywhere.
    const SEED: u64 = 20_240_607;
    const SAMPLES: u64 = 40_000;

    fn water_row(spectrum: &Spectrum, response: DetectorResponse, length_mm: f64) -> (Attenuator, RowMass) {
        let water = Material::named("water").expect("in the table");
        let attenuator = Attenuator::new(&[(water, 1.0)], spectrum, response).expect("an attenuator");
        let mut row = RowMass::new(&attenuator, 1);
        attenuator.accumulate(0, &[length_mm], &mut row);
        (attenuator, row)
    }

    /// Checks mean and variance of T over many pixels against Σ of the bins' Poisson moments.
    fn assert_moments(spectrum: &Spectrum, response: DetectorResponse, length_mm: f64, photons: f64) {
        let (attenuator, row) = water_row(spectrum, response, length_mm);
        let noise = PhotonNoise::new(photons, SEED).expect("noise");
        let samples: Vec<f64> =
            (0..SAMPLES).map(|pixel| noise.transmission(&attenuator, &row, 0, 3, pixel)).collect();
        let n = SAMPLES as f64;
        let mean = samples.iter().sum::<f64>() / n;
        let variance = samples.iter().map(|t| (t - mean).powi(2)).sum::<f64>() / (n - 1.0);

        // Cumulants of a compound Poisson variable: Σ λ_k e_k^m, here for T.
        let unit =
            photons * spectrum.bins().iter().map(|b| b.weight * response.signal(b.energy_kev)).sum::<f64>();
        let cumulant = |m: i32| -> f64 {
            let bins = spectrum.bins().iter().map(|bin| {
                let mu = Material::named("water")
                    .and_then(|w| w.mu_per_cm(bin.energy_kev, 1.0))
                    .expect("in range");
                let arriving = photons * bin.weight * (-mu * length_mm / 10.0).exp();
                arriving * (response.signal(bin.energy_kev) / unit).powi(m)
            });
            bins.sum()
        };
        let mean_error = (cumulant(2) / n).sqrt();
        assert!((mean - cumulant(1)).abs() < 4.5 * mean_error, "mean {mean}, expected {}", cumulant(1));
        let variance_error = ((cumulant(4) + 2.0 * cumulant(2).powi(2)) / n).sqrt();
        let off = (variance - cumulant(2)).abs();
        assert!(off < 4.5 * variance_error, "variance {variance}, expected {}", cumulant(2));
    }

    #[test]
    fn one_energy_has_poisson_moments() {
        let spectrum = Spectrum::mono(60.0).expect("in range");
        for (length_mm, photons) in [(0.0, 1000.0), (100.0, 1000.0), (100.0, 2.0), (300.0, 1e6)] {
            assert_moments(&spectrum, Counting, length_mm, photons);
        }
    }

    #[test]
    fn a_spectrum_has_compound_poisson_moments() {
        let spectrum = Spectrum::tungsten(100).expect("embedded");
        for response in [Counting, EnergyIntegrating] {
            assert_moments(&spectrum, response, 80.0, 500.0);
        }
    }

    #[test]
    fn a_pixel_has_the_same_bits_in_any_order_of_pixels() {
        let (attenuator, row) =
            water_row(&Spectrum::tungsten(80).expect("embedded"), EnergyIntegrating, 40.0);
        let noise = PhotonNoise::new(200.0, 7).expect("noise");
        let at = |pixel| noise.transmission(&attenuator, &row, 0, 1, pixel).to_bits();
        let forwards: Vec<u64> = (0..50).map(at).collect();
        let mut backwards: Vec<u64> = (0..50).rev().map(at).collect();
        backwards.reverse();
        assert_eq!(forwards, backwards);
    }

    #[test]
    fn seed_view_and_pixel_each_choose_other_numbers() {
        let (attenuator, row) = water_row(&Spectrum::mono(60.0).expect("in range"), Counting, 0.0);
        let image = |seed: u64, view: u64| -> Vec<f64> {
            let noise = PhotonNoise::new(1e6, seed).expect("noise");
            (0..SAMPLES).map(|pixel| noise.transmission(&attenuator, &row, 0, view, pixel) - 1.0).collect()
        };
        let correlation = |a: &[f64], b: &[f64]| {
            let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
            dot(a, b) / (dot(a, a) * dot(b, b)).sqrt()
        };
        // A correlation of independent samples is normal with a standard error of 1/√n.
        let limit = 4.5 / (SAMPLES as f64).sqrt();
        let here = image(SEED, 0);
        for (other, what) in
            [(image(SEED, 1), "views"), (image(SEED + 1, 0), "seeds"), (image(SEED ^ 1, 1), "both")]
        {
            let found = correlation(&here, &other);
            assert!(found.abs() < limit, "{what} correlate: {found}");
        }
        for lag in [1, 2, 64] {
            let found = correlation(&here[lag..], &here[..here.len() - lag]);
            assert!(found.abs() < limit, "pixels {lag} apart correlate: {found}");
        }
    }

    #[test]
    fn no_photons_are_half_a_photon_for_the_logarithm() {
        let noise = PhotonNoise::new(100.0, 0).expect("noise");
        assert!((noise.line_integral(0.0) - 200.0_f64.ln()).abs() < 1e-14);
        assert_eq!(noise.line_integral(0.004), noise.line_integral(0.0));
        assert_eq!(noise.line_integral(0.01), -0.01_f64.ln(), "one photon is no floor");
        assert_eq!(noise.line_integral(1.0).to_bits(), 0.0_f64.to_bits());
        assert!(noise.line_integral(1.1) < 0.0);
        assert!(noise.line_integral(f64::NAN).is_nan());
    }

    #[test]
    fn behind_an_opaque_wall_no_photon_arrives() {
        let (attenuator, row) = water_row(&Spectrum::mono(20.0).expect("in range"), Counting, 1e6);
        let noise = PhotonNoise::new(1e15, 0).expect("noise");
        assert_eq!(noise.transmission(&attenuator, &row, 0, 0, 0), 0.0);
    }

    #[test]
    fn impossible_photon_numbers_are_refused() {
        for photons in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e16] {
            assert!(PhotonNoise::new(photons, 0).is_err(), "{photons}");
        }
    }
}
