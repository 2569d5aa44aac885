//! What a detector makes of a photon.

use serde::{Deserialize, Serialize};

/// How much a detected photon adds to the signal. Every photon is detected: efficiency is 1 at all energies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum DetectorResponse {
    /// Its energy, as in scintillators and flat panels.
    #[default]
    EnergyIntegrating,
    /// One count, whatever its energy.
    Counting,
}

impl DetectorResponse {
    /// The signal of one photon: keV, or counts.
    pub fn signal(self, energy_kev: f64) -> f64 {
        match self {
            Self::EnergyIntegrating => energy_kev,
            Self::Counting => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integrating_weighs_by_energy_and_counting_does_not() {
        assert_eq!(DetectorResponse::EnergyIntegrating.signal(60.0), 60.0);
        assert_eq!(DetectorResponse::Counting.signal(60.0), 1.0);
    }
}
