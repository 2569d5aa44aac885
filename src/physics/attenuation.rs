//! From lengths to what the detector sees: the Beer–Lambert law over materials and energies.
//!
//! With own lengths L_i (mm), densities ρ_i, and fluence weights w_k, the detector's share of bin k is
//! W_k = w_k D_k / Σ w_k D_k (D: signal per photon), and
//!
//! ```text
//!   a_k = Σ_i (μ/ρ)_i(E_k) ρ_i L_i / 10        T = Σ_k W_k exp(−a_k)        p = −ln T
//! ```
//!
//! Organs of one material share a coefficient, so their mass thicknesses ρL are added first and each bin costs one product
//! per *material*. p is computed before T: the least exponent is factored out, so that thick objects (T < 1e-300) keep a finite
//! p, and the rest is a `ln_1p` of `expm1`s, so that thin objects keep all digits of a small one.

use super::{DetectorResponse, Material, Spectrum};
use crate::{Error, Result};

/// Where the sum Σ W_k exp(−(a_k − a_min)) is close enough to 1 for the `ln_1p` form. Below it the plain logarithm
/// loses nothing, while the other form would subtract nearly equal numbers.
const THIN: f64 = 0.5;

/// The organs' materials before one spectrum and one detector, prepared for many rays. Immutable and shared by threads.
#[derive(Clone, Debug)]
pub struct Attenuator {
    /// Per organ: its group, and g/cm² per mm of length; `None` if it attenuates nothing.
    organs: Vec<Option<(usize, f64)>>,
    materials: Vec<Material>,
    bins: Vec<EnergyBin>,
    /// μ/ρ of each bin's groups, cm²/g, bin after bin.
    mu_rho: Vec<f64>,
    response: DetectorResponse,
}

/// One energy of the prepared spectrum.
#[derive(Clone, Copy, Debug)]
struct EnergyBin {
    energy_kev: f64,
    /// Share of all photons.
    photons: f64,
    /// Share of the unattenuated signal, W_k.
    signal: f64,
}

impl Attenuator {
    /// Prepares organs, given in scene order as material and density in g/cm³. Organs of vacuum or of density 0 cost nothing per ray.
    /// An error if a density is negative or not finite.
    pub fn new(organs: &[(Material, f64)], spectrum: &Spectrum, response: DetectorResponse) -> Result<Self> {
        let mut materials: Vec<Material> = Vec::new();
        let mut grouped = Vec::with_capacity(organs.len());
        for (i, &(material, density_g_cm3)) in organs.iter().enumerate() {
            if !(density_g_cm3 >= 0.0 && density_g_cm3.is_finite()) {
                return Err(Error::input(
                    format!("organ {} ({})", i + 1, material.name()),
                    format!("density {density_g_cm3} g/cm³ is not a density"),
                    "give a density of zero or more",
                ));
            }
            if material.is_vacuum() || density_g_cm3 == 0.0 {
                grouped.push(None);
                continue;
            }
            let group = materials.iter().position(|known| *known == material).unwrap_or_else(|| {
                materials.push(material);
                materials.len() - 1
            });
            grouped.push(Some((group, density_g_cm3 / 10.0)));
        }

        let total: f64 = spectrum.bins().iter().map(|bin| bin.weight * response.signal(bin.energy_kev)).sum();
        let mut bins = Vec::with_capacity(spectrum.bins().len());
        let mut mu_rho = Vec::with_capacity(spectrum.bins().len() * materials.len());
        for bin in spectrum.bins() {
            let signal = bin.weight * response.signal(bin.energy_kev) / total;
            bins.push(EnergyBin { energy_kev: bin.energy_kev, photons: bin.weight, signal });
            for material in &materials {
                mu_rho.push(material.mu_rho_cm2_g(bin.energy_kev)?);
            }
        }
        Ok(Self { organs: grouped, materials, bins, mu_rho, response })
    }

    /// How many organs attenuate nothing and are skipped.
    pub fn skipped_organs(&self) -> usize {
        self.organs.iter().filter(|organ| organ.is_none()).count()
    }

    /// Whether the organ attenuates, so that its length is needed. Organs that do not exist do not.
    pub fn needs(&self, organ: usize) -> bool {
        self.organs.get(organ).is_some_and(Option::is_some)
    }

    /// The materials that attenuate, one group each, in order of first appearance.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The detector.
    pub fn response(&self) -> DetectorResponse {
        self.response
    }

    /// p = −ln T of one ray. `own_lengths_mm` has one length of zero or more per organ, in the order of [`Attenuator::new`]. Exactly +0 if all
    /// are 0; finite for every finite length; NaN if a length is.
    pub fn line_integral(&self, own_lengths_mm: &[f64]) -> f64 {
        let mut ray = RowMass::new(self, 1);
        for (organ, length_mm) in own_lengths_mm.iter().enumerate() {
            self.accumulate(organ, std::slice::from_ref(length_mm), &mut ray);
        }
        self.line_integral_of_masses(&ray.masses)
    }

    /// T = I/I₀ of one ray; lengths as for [`Attenuator::line_integral`]. Exactly 1 if all are 0.
    pub fn transmission(&self, own_lengths_mm: &[f64]) -> f64 {
        (-self.line_integral(own_lengths_mm)).exp()
    }

    /// Adds one organ's own lengths, mm, along the first rays of a row. Lengths of zero add nothing, and organs without attenuation
    /// cost nothing. Adding organs in scene order gives the same bits as [`Attenuator::line_integral`].
    pub fn accumulate(&self, organ: usize, own_lengths_mm: &[f64], row: &mut RowMass) {
        let Some(&Some((group, g_cm2_per_mm))) = self.organs.get(organ) else { return };
        let masses = row.masses.iter_mut().skip(group).step_by(row.groups);
        for (mass, length_mm) in masses.zip(own_lengths_mm) {
            *mass += g_cm2_per_mm * length_mm;
        }
    }

    /// p of every ray of a row, into the first places of `p`.
    pub fn line_integrals(&self, row: &RowMass, p: &mut [f64]) {
        for (ray, p) in p.iter_mut().enumerate().take(row.rays) {
            *p = self.line_integral_of_masses(row.masses_of(ray));
        }
    }

    /// p of mass thicknesses per group, g/cm².
    fn line_integral_of_masses(&self, masses: &[f64]) -> f64 {
        // Most pixels of most images see nothing at all.
        if masses.iter().all(|mass| *mass == 0.0) {
            return 0.0;
        }
        let exponent = |k: usize| self.exponent(k, masses);
        if self.bins.len() == 1 {
            return exponent(0);
        }
        let least = (0..self.bins.len()).map(exponent).fold(f64::INFINITY, f64::min);
        let signals = || self.bins.iter().enumerate().map(|(k, bin)| (bin.signal, least - exponent(k)));
        let left: f64 = signals().map(|(signal, deeper)| signal * deeper.exp()).sum();
        if left > THIN {
            let lost: f64 = signals().map(|(signal, deeper)| signal * deeper.exp_m1()).sum();
            return least - lost.ln_1p();
        }
        least - left.ln()
    }

    /// a_k, the exponent of bin `k`.
    fn exponent(&self, k: usize, masses: &[f64]) -> f64 {
        let groups = self.materials.len();
        let mu_rho = &self.mu_rho[k * groups..(k + 1) * groups];
        mu_rho.iter().zip(masses).map(|(mu_rho, mass)| mu_rho * mass).sum()
    }

    /// What is left of each bin behind the mass thicknesses of one ray of a row: its energy in keV, and its photons as a share
    /// of *all* photons before the patient.
    pub fn transmitted_photons<'a>(
        &'a self,
        row: &'a RowMass,
        ray: usize,
    ) -> impl Iterator<Item = (f64, f64)> + 'a {
        let masses = row.masses_of(ray);
        self.bins
            .iter()
            .enumerate()
            .map(move |(k, bin)| (bin.energy_kev, bin.photons * (-self.exponent(k, masses)).exp()))
    }

    /// The mean signal of one photon before the patient: keV, or 1 for a counting detector.
    pub fn mean_signal(&self) -> f64 {
        self.bins.iter().map(|bin| bin.photons * self.response.signal(bin.energy_kev)).sum()
    }
}

/// Mass thicknesses, g/cm², of a row of rays: what [`Attenuator::accumulate`] adds up. Made for one attenuator; reuse
/// it row after row.
#[derive(Clone, Debug)]
pub struct RowMass {
    groups: usize,
    rays: usize,
    /// Ray after ray, each with one mass per group.
    masses: Vec<f64>,
}

impl RowMass {
    /// A row of `rays` rays that have passed nothing yet.
    pub fn new(attenuator: &Attenuator, rays: usize) -> Self {
        let groups = attenuator.materials.len();
        // A step of zero has no meaning; without groups nothing is ever added.
        Self { groups: groups.max(1), rays, masses: vec![0.0; groups.max(1) * rays] }
    }

    /// Forgets what was added.
    pub fn clear(&mut self) {
        self.masses.fill(0.0);
    }

    fn masses_of(&self, ray: usize) -> &[f64] {
        &self.masses[ray * self.groups..(ray + 1) * self.groups]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use DetectorResponse::{Counting, EnergyIntegrating};

    fn material(name: &str) -> Material {
        Material::named(name).expect("in the table")
    }

    fn organs(names: &[&str]) -> Vec<(Material, f64)> {
        names.iter().map(|name| (material(name), material(name).density_g_cm3())).collect()
    }

    fn tube(kvp: u32) -> Spectrum {
        Spectrum::tungsten(kvp).expect("embedded")
    }

    fn attenuator(names: &[&str], spectrum: &Spectrum, response: DetectorResponse) -> Attenuator {
        Attenuator::new(&organs(names), spectrum, response).expect("an attenuator")
    }

    /// The definition, summed as it stands.
    fn by_definition(
        names: &[&str],
        spectrum: &Spectrum,
        response: DetectorResponse,
        lengths_mm: &[f64],
    ) -> f64 {
        let (mut signal, mut total) = (0.0, 0.0);
        let organs = organs(names);
        for bin in spectrum.bins() {
            let weight = bin.weight * response.signal(bin.energy_kev);
            let exponent = organs.iter().zip(lengths_mm).map(|((material, density), length)| {
                material.mu_per_cm(bin.energy_kev, *density).expect("in range") * length / 10.0
            });
            signal += weight * (-exponent.sum::<f64>()).exp();
            total += weight;
        }
        signal / total
    }

    #[test]
    fn one_energy_obeys_the_exponential_law() {
        let spectrum = Spectrum::mono(60.0).expect("in range");
        let attenuator = attenuator(&["water", "bone_cortical"], &spectrum, EnergyIntegrating);
        for (water_mm, bone_mm) in [(100.0, 0.0), (0.0, 20.0), (180.0, 31.5), (1e-9, 1e-7)] {
            let p = 0.2059 * water_mm / 10.0 + 0.3148 * 1.92 * bone_mm / 10.0;
            let found = attenuator.line_integral(&[water_mm, bone_mm]);
            assert!((found / p - 1.0).abs() < 1e-14, "{found} is not {p}");
            assert!((attenuator.transmission(&[water_mm, bone_mm]) / (-p).exp() - 1.0).abs() < 1e-13);
        }
    }

    #[test]
    fn a_spectrum_agrees_with_the_definition() {
        let names = ["muscle", "bone_cortical", "lung_inflated", "muscle"];
        for response in [EnergyIntegrating, Counting] {
            let attenuator = attenuator(&names, &tube(120), response);
            for lengths in [[10.0, 0.0, 0.0, 0.0], [120.0, 30.0, 90.0, 15.0], [0.0, 200.0, 0.0, 0.0]] {
                let expected = by_definition(&names, &tube(120), response, &lengths);
                let found = attenuator.transmission(&lengths);
                assert!(
                    (found / expected - 1.0).abs() < 1e-12,
                    "{response:?} {lengths:?}: {found} {expected}"
                );
            }
        }
    }

    #[test]
    fn the_beam_hardens_with_thickness() {
        for response in [EnergyIntegrating, Counting] {
            let attenuator = attenuator(&["water"], &tube(100), response);
            let effective_mu: Vec<f64> = [1.0, 10.0, 50.0, 100.0, 200.0, 400.0, 1e7]
                .iter()
                .map(|mm| attenuator.line_integral(&[*mm]) / mm)
                .collect();
            assert!(effective_mu.windows(2).all(|pair| pair[1] < pair[0]), "{effective_mu:?}");
            // Far behind only the hardest photons, 99.5 keV, are left; their share, 2e-4, fades against the length.
            let hardest = material("water").mu_per_cm(99.5, 0.1).expect("in range");
            assert!((effective_mu[6] / hardest - 1.0).abs() < 1e-4);
        }
    }

    #[test]
    fn an_integrating_detector_sees_a_harder_beam_than_a_counting_one() {
        let p = |response| attenuator(&["water"], &tube(100), response).line_integral(&[100.0]);
        assert!(p(EnergyIntegrating) < p(Counting) - 0.01);
        let mono = Spectrum::mono(70.0).expect("in range");
        let q = |response| attenuator(&["water"], &mono, response).line_integral(&[100.0]);
        assert_eq!(q(EnergyIntegrating), q(Counting), "one energy has one answer");
    }

    #[test]
    fn thin_objects_keep_their_digits() {
        let attenuator = attenuator(&["water"], &tube(100), EnergyIntegrating);
        // For p → 0, p is linear: the signal-weighted mean μ times the length.
        let slope = attenuator.line_integral(&[1e-3]) / 1e-3;
        for length_mm in [1e-6, 1e-9, 1e-12, 1e-100, 1e-300] {
            let found = attenuator.line_integral(&[length_mm]) / length_mm;
            // The next term of the series, at 1e-3 mm, is 1e-3 mm times the spread of μ (0.02/mm) relative to μ.
            assert!((found / slope - 1.0).abs() < 1e-4, "{length_mm} mm: {found} {slope}");
            let twice = attenuator.line_integral(&[2.0 * length_mm]) / (2.0 * length_mm);
            assert!((twice / found - 1.0).abs() < length_mm + 1e-13, "{length_mm} mm: {twice} {found}");
        }
    }

    #[test]
    fn thick_objects_keep_a_finite_p() {
        let attenuator = attenuator(&["bone_cortical"], &tube(60), EnergyIntegrating);
        let (at, beyond) = (attenuator.line_integral(&[1e5]), attenuator.line_integral(&[1.01e5]));
        assert_eq!(attenuator.transmission(&[1e5]), 0.0, "underflows");
        assert!(at.is_finite() && at > 700.0);
        // Only the hardest bin, 59.5 keV, is left: the slope is its μ.
        let hardest = material("bone_cortical").mu_per_cm(59.5, 0.192).expect("in range");
        assert!(((beyond - at) / 1e3 / hardest - 1.0).abs() < 1e-10);
        assert!(attenuator.line_integral(&[1e300]).is_finite());
    }

    #[test]
    fn nothing_in_the_way_is_exactly_one_and_plus_zero() {
        for spectrum in [Spectrum::mono(60.0).expect("in range"), tube(120)] {
            for names in [&["water", "bone_cortical"][..], &["vacuum"], &[]] {
                let attenuator = attenuator(names, &spectrum, EnergyIntegrating);
                let lengths = vec![0.0; names.len()];
                assert_eq!(attenuator.line_integral(&lengths).to_bits(), 0.0_f64.to_bits());
                assert_eq!(attenuator.transmission(&lengths), 1.0);
            }
        }
    }

    #[test]
    fn what_attenuates_nothing_is_skipped_and_counted() {
        let mut organs = organs(&["vacuum", "water", "air", "water"]);
        organs[2].1 = 0.0;
        let attenuator = Attenuator::new(&organs, &tube(80), Counting).expect("an attenuator");
        assert_eq!(attenuator.skipped_organs(), 2);
        assert_eq!(attenuator.materials().len(), 1, "both waters share a group");
        assert_eq!([0, 1, 2, 3, 4].map(|organ| attenuator.needs(organ)), [false, true, false, true, false]);
        assert_eq!(attenuator.line_integral(&[500.0, 0.0, 500.0, 0.0]), 0.0);
        assert!(attenuator.line_integral(&[0.0, 10.0, 0.0, 0.0]) > 0.0);
    }

    #[test]
    fn only_mass_thickness_matters_not_its_order_or_density() {
        let water = material("water");
        let organs = [(water, 1.0), (water, 0.5), (material("bone_cortical"), 1.92)];
        let attenuator = Attenuator::new(&organs, &tube(120), EnergyIntegrating).expect("an attenuator");
        let p = attenuator.line_integral(&[30.0, 40.0, 10.0]);
        for lengths in [[50.0, 0.0, 10.0], [0.0, 100.0, 10.0], [20.0, 60.0, 10.0]] {
            assert!((attenuator.line_integral(&lengths) / p - 1.0).abs() < 1e-14);
        }
        let reversed: Vec<_> = organs.iter().rev().copied().collect();
        let reversed = Attenuator::new(&reversed, &tube(120), EnergyIntegrating).expect("an attenuator");
        assert!((reversed.line_integral(&[10.0, 40.0, 30.0]) / p - 1.0).abs() < 1e-14);
    }

    #[test]
    fn rows_give_the_bits_of_single_rays() {
        let attenuator =
            attenuator(&["muscle", "vacuum", "bone_cortical", "muscle"], &tube(100), EnergyIntegrating);
        let lengths = [[0.0, 5.0, 1.25, 80.0], [9.0, 9.0, 9.0, 9.0], [1.0, 0.0, 0.0, 2.0], [0.0; 4]];
        let mut row = RowMass::new(&attenuator, 3);
        for rays in [&lengths[..3], &lengths[1..]] {
            row.clear();
            for organ in 0..4 {
                let along_row: Vec<f64> = rays.iter().map(|lengths| lengths[organ]).collect();
                attenuator.accumulate(organ, &along_row, &mut row);
            }
            let mut p = [f64::NAN; 3];
            attenuator.line_integrals(&row, &mut p);
            for (p, lengths) in p.iter().zip(rays) {
                assert_eq!(p.to_bits(), attenuator.line_integral(lengths).to_bits());
            }
        }
    }

    #[test]
    fn transmitted_photons_add_up_to_the_counting_transmission() {
        let attenuator = attenuator(&["water"], &tube(80), Counting);
        let mut row = RowMass::new(&attenuator, 1);
        attenuator.accumulate(0, &[75.0], &mut row);
        let left: f64 = attenuator.transmitted_photons(&row, 0).map(|(_, photons)| photons).sum();
        assert!((left / attenuator.transmission(&[75.0]) - 1.0).abs() < 1e-13);
        assert!((attenuator.mean_signal() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn a_length_that_is_not_a_number_is_not_hidden() {
        for spectrum in [Spectrum::mono(60.0).expect("in range"), tube(120)] {
            let attenuator = attenuator(&["water"], &spectrum, EnergyIntegrating);
            assert!(attenuator.line_integral(&[f64::NAN]).is_nan());
        }
    }

    #[test]
    fn impossible_densities_are_refused() {
        for density in [-1.0, f64::NAN, f64::INFINITY] {
            let organs = [(material("water"), density)];
            let error = Attenuator::new(&organs, &tube(80), Counting).expect_err("refused");
            assert!(error.to_string().contains("organ 1 (water)"), "{error}");
        }
    }
}
