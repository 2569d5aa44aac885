//! What an error of length means in transmission.
//!
//! An organ's own length is its chord less its children's, so the exponent of T = exp(−Σ μ·own) is a sum over chords too:
//!
//! ```text
//!   Σ μᵢ (Lᵢ − Σ L of i's children)  =  Σ (μᵢ − μ of i's parent) Lᵢ
//! ```
//!
//! and an error e of one chord makes T·(exp(−(μᵢ − μ_parent)·e) − 1), whatever the other organs are.

use crate::error::Result;
use crate::scene::Scene;

/// The organs' attenuation at one energy.
pub(super) struct Optics {
    energy_kev: f64,
    /// Per organ: its attenuation less that of the organ around it, per mm.
    contrast_per_mm: Vec<f64>,
}

impl Optics {
    /// At the mean energy of the scene's photons: the effective energy at which ΔT is told.
    ///
    /// # Errors
    /// An energy off a material's table.
    pub fn new(scene: &Scene) -> Result<Self> {
        let energy_kev = scene.spectrum.mean_energy_kev();
        let mu_per_mm = |organ: usize| -> Result<f64> {
            let organ = &scene.organs[organ];
            Ok(organ.material.mu_per_cm(energy_kev, organ.density_g_cm3)? / 10.0)
        };
        let contrast = |organ: usize| -> Result<f64> {
            let around = scene.organs[organ].parent.map_or(Ok(0.0), mu_per_mm)?;
            Ok(mu_per_mm(organ)? - around)
        };
        let contrast_per_mm = (0..scene.organs.len()).map(contrast).collect::<Result<_>>()?;
        Ok(Self { energy_kev, contrast_per_mm })
    }

    /// The energy, keV.
    pub fn energy_kev(&self) -> f64 {
        self.energy_kev
    }

    /// By how much `length_mm` of a chord adds to the exponent p.
    pub fn exponent(&self, organ: usize, length_mm: f64) -> f64 {
        self.contrast_per_mm[organ] * length_mm
    }

    /// How T changes if p does.
    pub fn change(transmission: f64, exponent: f64) -> f64 {
        if exponent == 0.0 { 0.0 } else { transmission * (-exponent).exp_m1() }
    }
}
