//! What organs do to a case's photons, per millimetre.

use crate::error::Result;
use crate::physics::Material;
use crate::study::Case;

/// One keV per gram and photon/cm², in pGy·cm²: 1.602 176 634·10⁻¹⁶ J/keV (exact, SI 2019) · 10³ g/kg · 10¹² pGy/Gy.
pub const PGY_CM2_PER_KEV_CM2_G: f64 = 0.160_217_663_4;

/// A case's organs before its photons.
#[derive(Clone, Debug)]
pub struct Optics {
    /// Of each bin of the spectrum: its energy, keV.
    pub energies_kev: Vec<f64>,
    /// Its share of the photons.
    pub shares: Vec<f64>,
    /// What weighs its photons in the detector's signal.
    pub signals: Vec<f64>,
    /// The photons' mean energy, keV.
    pub mean_energy_kev: f64,
    /// Σ share · signal.
    pub mean_signal: f64,
    pub organs: Vec<OrganOptics>,
    /// μ_en/ρ of water of each bin, cm²/g.
    pub water_mu_en_rho: Vec<f64>,
}

/// One organ before the photons.
#[derive(Clone, Debug)]
pub struct OrganOptics {
    /// Mass thickness, g/cm² per mm.
    pub g_cm2_per_mm: f64,
    /// μ at the reference energy, 1/mm.
    pub mu_per_mm: f64,
    /// μ over that of water, at the reference energy.
    pub water_by_mu: f64,
    /// Electron density over that of water.
    pub water_by_electrons: f64,
    /// μ of each bin, 1/mm.
    pub mu_bins_per_mm: Vec<f64>,
    /// Of the energy of photons that interact in a bin, the share that is absorbed there: E · μ_en/μ, keV.
    pub absorbed_kev: Vec<f64>,
    /// μ_en/ρ of each bin, cm²/g.
    pub mu_en_rho: Vec<f64>,
}

impl Optics {
    /// # Errors
    /// An energy off the attenuation table.
    pub fn new(case: &Case) -> Result<Self> {
        let bins = case.spectrum.bins();
        let energies_kev: Vec<f64> = bins.iter().map(|bin| bin.energy_kev).collect();
        let shares: Vec<f64> = bins.iter().map(|bin| bin.weight).collect();
        let signals: Vec<f64> = energies_kev.iter().map(|&energy| case.response.signal(energy)).collect();
        let water = Material::named("water")?;
        let water_mu = water.mu_per_cm(case.reference_energy_kev, water.density_g_cm3())? / 10.0;
        let water_electrons = water.density_g_cm3() * water.electrons_per_amu();
        let organ = |&(material, density): &(Material, f64)| -> Result<OrganOptics> {
            let mu_per_mm = material.mu_per_cm(case.reference_energy_kev, density)? / 10.0;
            let mut organ = OrganOptics {
                g_cm2_per_mm: density / 10.0,
                mu_per_mm,
                water_by_mu: mu_per_mm / water_mu,
                water_by_electrons: density * material.electrons_per_amu() / water_electrons,
                mu_bins_per_mm: Vec::with_capacity(bins.len()),
                absorbed_kev: Vec::with_capacity(bins.len()),
                mu_en_rho: Vec::with_capacity(bins.len()),
            };
            for &energy in &energies_kev {
                let (mu_rho, mu_en_rho) = (material.mu_rho_cm2_g(energy)?, material.mu_en_rho_cm2_g(energy)?);
                organ.mu_bins_per_mm.push(mu_rho * density / 10.0);
                organ.absorbed_kev.push(if mu_rho > 0.0 { energy * mu_en_rho / mu_rho } else { 0.0 });
                organ.mu_en_rho.push(mu_en_rho);
            }
            Ok(organ)
        };
        Ok(Self {
            organs: case.organs.iter().map(organ).collect::<Result<_>>()?,
            water_mu_en_rho: energies_kev.iter().map(|&e| water.mu_en_rho_cm2_g(e)).collect::<Result<_>>()?,
            mean_energy_kev: dot(&energies_kev, &shares),
            mean_signal: dot(&signals, &shares),
            energies_kev,
            shares,
            signals,
        })
    }
}

/// Σ aᵢ bᵢ.
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}
