//! What leaves the tube: photons per energy, of one energy, of an embedded tungsten tube, or of the user's own table.

use serde::{Deserialize, Serialize};

use super::materials::{HIGHEST_KEV, LOWEST_KEV, Material, check_energy};
use crate::{Error, Result};

/// The largest share of a spectrum's photons that may lie below the attenuation table and be dropped: a hundred times the
/// rounding of a 16-bit image, far above the 2e-9 of the embedded spectra.
pub const MAX_DROPPED_FRACTION: f64 = 1e-6;

/// Tube voltages with an embedded spectrum.
pub const TUNGSTEN_KVP: [u32; 5] = [60, 80, 100, 120, 140];

const TUNGSTEN: &str = include_str!("data/spectra.csv");

/// The photons of one bin.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(rename_all = "snake_case")]
pub struct Bin {
    /// The bin's energy, keV.
    #[serde(rename = "energy_keV")]
    pub energy_kev: f64,
    /// Its share of all photons (of the fluence, not of the energy).
    pub weight: f64,
}

/// Photons per energy bin. Energies ascend and lie on the attenuation table; weights are positive and add to 1 within rounding.
#[derive(Clone, Debug, PartialEq)]
pub struct Spectrum {
    bins: Vec<Bin>,
    dropped_fraction: f64,
    filter_transmission: f64,
}

/// A sheet in the beam before the patient.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize)]
#[serde(deny_unknown_fields)]
pub struct Filter {
    /// A material of the attenuation table.
    pub material: String,
    /// How thick it is, mm.
    pub thickness_mm: f64,
}

impl Spectrum {
    /// Photons of a single energy. An error outside the attenuation table.
    pub fn mono(energy_kev: f64) -> Result<Self> {
        check_energy(energy_kev)?;
        let bins = vec![Bin { energy_kev, weight: 1.0 }];
        Ok(Self { bins, dropped_fraction: 0.0, filter_transmission: 1.0 })
    }

    /// The embedded spectrum of a tungsten tube (12° anode, 2.5 mm Al) at a voltage. An error that lists the voltages if there is
    /// none.
    pub fn tungsten(kvp: u32) -> Result<Self> {
        let subject = format!("tube voltage {kvp} kVp");
        if !TUNGSTEN_KVP.contains(&kvp) {
            return Err(Error::input(
                subject,
                "has no embedded spectrum",
                format!("choose one of {TUNGSTEN_KVP:?}, or give a table of energy_keV,weight"),
            ));
        }
        let rows = TUNGSTEN.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
        let of_tube = rows.filter(|fields| fields[0].parse() == Ok(kvp));
        let number = |field: &str| field.parse().unwrap_or(f64::NAN);
        let bins: Vec<(f64, f64)> = of_tube.map(|fields| (number(fields[1]), number(fields[3]))).collect();
        Self::from_pairs(&subject, &bins)
    }

    /// The spectrum of a list of (energy in keV, photons per bin), ascending; any common factor. Errors name `subject` and the pair's
    /// place, from 1: no pairs, NaN, negative or no photons, energies that do not ascend, energies off the attenuation table
    /// (below it, up to [`MAX_DROPPED_FRACTION`] of the photons are dropped and reported instead).
    pub fn from_pairs(subject: &str, pairs: &[(f64, f64)]) -> Result<Self> {
        Self::from_places(
            pairs.iter().enumerate().map(|(i, &pair)| (format!("{subject}, entry {}", i + 1), pair)),
            subject,
        )
    }

    /// The spectrum of a CSV text with the header `energy_keV,weight`; blank lines and lines that begin with `#` are passed over.
    /// Errors as for [`Spectrum::from_pairs`], with the line of `file`.
    pub fn from_csv(file: &str, text: &str) -> Result<Self> {
        let mut lines = text
            .trim_start_matches('\u{feff}')
            .lines()
            .enumerate()
            .map(|(i, line)| (format!("{file}:{}", i + 1), line.trim()))
            .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'));
        let names = |line: &str| line.split(',').map(str::trim).eq(["energy_keV", "weight"]);
        let (place, header) = lines.next().unwrap_or_else(|| (file.into(), ""));
        if !names(header) {
            return Err(Error::input(
                place,
                format!("the first line is {header:?}"),
                "begin the table with the header energy_keV,weight",
            ));
        }
        let pairs = lines.map(|(place, line)| {
            let mut fields = line.split(',').map(|field| field.trim().parse::<f64>());
            match (fields.next(), fields.next(), fields.next()) {
                (Some(Ok(energy_kev)), Some(Ok(weight)), None) => Ok((place, (energy_kev, weight))),
                _ => Err(Error::input(
                    place,
                    format!("{line:?} is not two numbers"),
                    "write energy_keV,weight",
                )),
            }
        });
        Self::from_places(pairs.collect::<Result<Vec<_>>>()?, file)
    }

    fn from_places(pairs: impl IntoIterator<Item = (String, (f64, f64))>, subject: &str) -> Result<Self> {
        let mut bins: Vec<Bin> = Vec::new();
        for (place, (energy_kev, weight)) in pairs {
            let refuse = |problem: String, remedy: &str| Err(Error::input(place.clone(), problem, remedy));
            if !(energy_kev > 0.0 && energy_kev <= HIGHEST_KEV) {
                let problem = format!("{energy_kev} keV is not an energy of the attenuation table");
                return refuse(problem, "give energies from 10 to 20000 keV");
            }
            if !(weight >= 0.0 && weight.is_finite()) {
                return refuse(
                    format!("weight {weight} is not a number of photons"),
                    "give weights of zero or more",
                );
            }
            if bins.last().is_some_and(|last| energy_kev <= last.energy_kev) {
                return refuse(
                    format!("{energy_kev} keV does not ascend"),
                    "sort the bins by energy, each once",
                );
            }
            bins.push(Bin { energy_kev, weight });
        }
        let total: f64 = bins.iter().map(|bin| bin.weight).sum();
        if !(total > 0.0 && total.is_finite()) {
            return Err(Error::input(
                subject,
                "the spectrum has no photons, or infinitely many",
                "give positive weights",
            ));
        }
        let below: f64 = bins.iter().filter(|bin| bin.energy_kev < LOWEST_KEV).map(|bin| bin.weight).sum();
        let dropped_fraction = below / total;
        if dropped_fraction > MAX_DROPPED_FRACTION {
            return Err(Error::input(
                subject,
                format!(
                    "a share of {dropped_fraction:.2e} of the photons is below {LOWEST_KEV} keV, off the attenuation table"
                ),
                format!("start the spectrum at {LOWEST_KEV} keV, or filter it"),
            ));
        }
        bins.retain(|bin| bin.energy_kev >= LOWEST_KEV && bin.weight > 0.0);
        Ok(Self { bins: normalized(bins), dropped_fraction, filter_transmission: 1.0 })
    }

    /// The spectrum behind further sheets. Errors: an unknown material, a thickness that is negative or not finite, or no
    /// photons left.
    pub fn filtered(mut self, filters: &[Filter]) -> Result<Self> {
        for (i, filter) in filters.iter().enumerate() {
            let subject = format!("filter {} ({})", i + 1, filter.material);
            if !(filter.thickness_mm >= 0.0 && filter.thickness_mm.is_finite()) {
                let problem = format!("thickness {} mm is not a thickness", filter.thickness_mm);
                return Err(Error::input(subject, problem, "give a thickness of zero or more millimetres"));
            }
            let material = Material::named(&filter.material)?;
            let mass = material.density_g_cm3() * filter.thickness_mm / 10.0;
            for bin in &mut self.bins {
                bin.weight *= (-mass * material.mu_rho_cm2_g(bin.energy_kev)?).exp();
            }
            // Dead bins must go before the weights are divided by their sum.
            self.bins.retain(|bin| bin.weight >= f64::MIN_POSITIVE);
            let passed: f64 = self.bins.iter().map(|bin| bin.weight).sum();
            if self.bins.is_empty() {
                return Err(Error::input(subject, "lets no photons through", "make the filter thinner"));
            }
            self.filter_transmission *= passed;
            self.bins = normalized(self.bins);
        }
        Ok(self)
    }

    /// The bins, ascending in energy.
    pub fn bins(&self) -> &[Bin] {
        &self.bins
    }

    /// The share of the photons that lay below the attenuation table and was dropped; at most [`MAX_DROPPED_FRACTION`].
    pub fn dropped_fraction(&self) -> f64 {
        self.dropped_fraction
    }

    /// The share of the photons that the added filters let through; 1 without filters.
    pub fn filter_transmission(&self) -> f64 {
        self.filter_transmission
    }

    /// The photons' mean energy, keV.
    pub fn mean_energy_kev(&self) -> f64 {
        self.bins.iter().map(|bin| bin.weight * bin.energy_kev).sum()
    }

    /// First half-value layer: the thickness that halves the air kerma, mm of `material` at its usual density. `None` for vacuum.
    /// Narrow beam, no scatter; kerma per photon is E · μ_en/ρ of air.
    pub fn half_value_layer_mm(&self, material: Material) -> Result<Option<f64>> {
        let density = material.density_g_cm3();
        self.half_value_layer(|energy_kev| Ok(material.mu_per_cm(energy_kev, density)? / 10.0))
    }

    /// The same for linear attenuation coefficients in 1/mm.
    fn half_value_layer(&self, mu_per_mm: impl Fn(f64) -> Result<f64>) -> Result<Option<f64>> {
        let air = Material::named("air")?;
        let mut parts = Vec::with_capacity(self.bins.len());
        for bin in &self.bins {
            let kerma = bin.weight * bin.energy_kev * air.mu_en_rho_cm2_g(bin.energy_kev)?;
            parts.push((kerma, mu_per_mm(bin.energy_kev)?));
        }
        let total: f64 = parts.iter().map(|(kerma, _)| kerma).sum();
        let least_mu = parts.iter().map(|(_, mu)| *mu).fold(f64::INFINITY, f64::min);
        if least_mu <= 0.0 {
            return Ok(None);
        }
        // The kerma is a sum of falling exponentials, so it falls and is convex: Newton from zero climbs to the root without
        // passing it. The first step from the left already covers the mono-energetic case to a quarter.
        let mut thickness_mm = 0.0;
        loop {
            let (mut value, mut slope) = (-0.5 * total, 0.0);
            for (kerma, mu) in &parts {
                let left = kerma * (-mu * thickness_mm).exp();
                value += left;
                slope += mu * left;
            }
            let step = value / slope;
            // Rounding of the sum stops the climb a few units in the last place from the root.
            if step <= 4.0 * f64::EPSILON * thickness_mm {
                return Ok(Some(thickness_mm));
            }
            thickness_mm += step;
        }
    }
}

/// The bins with weights that add to 1.
fn normalized(mut bins: Vec<Bin>) -> Vec<Bin> {
    let total: f64 = bins.iter().map(|bin| bin.weight).sum();
    for bin in &mut bins {
        bin.weight /= total;
    }
    bins
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Mass attenuation of aluminium (NIST, Hubbell & Seltzer), keV and cm²/g; its density is 2.699 g/cm³.
    const ALUMINIUM: [(f64, f64); 11] = [
        (10.0, 26.23),
        (15.0, 7.955),
        (20.0, 3.441),
        (30.0, 1.128),
        (40.0, 0.5685),
        (50.0, 0.3681),
        (60.0, 0.2778),
        (80.0, 0.2018),
        (100.0, 0.1704),
        (150.0, 0.1378),
        (200.0, 0.1223),
    ];

    fn aluminium_per_mm(energy_kev: f64) -> f64 {
        let above = ALUMINIUM.iter().position(|(energy, _)| *energy >= energy_kev).expect("in range").max(1);
        let ((e0, m0), (e1, m1)) = (ALUMINIUM[above - 1], ALUMINIUM[above]);
        0.2699 * m0 * (m1 / m0).powf((energy_kev / e0).ln() / (e1 / e0).ln())
    }

    fn water() -> Material {
        Material::named("water").expect("in the table")
    }

    #[test]
    fn tungsten_spectra_have_their_published_means_and_half_value_layers() {
        for (kvp, mean_kev, hvl_mm) in
            [(60, 36.0, 2.08), (80, 42.9, 2.73), (100, 49.2, 3.46), (120, 54.5, 4.22), (140, 59.2, 4.99)]
        {
            let spectrum = Spectrum::tungsten(kvp).expect("embedded");
            let total: f64 = spectrum.bins().iter().map(|bin| bin.weight).sum();
            assert!((total - 1.0).abs() < 1e-14);
            // Published to 0.1 keV, from finer bins than these of 1 keV.
            assert!((spectrum.mean_energy_kev() - mean_kev).abs() < 0.06, "mean at {kvp} kVp");
            let hvl = spectrum
                .half_value_layer(|energy| Ok(aluminium_per_mm(energy)))
                .expect("in range")
                .expect("finite");
            // 2 %: these eleven energies are coarse (a cubic through them halves the difference), and SpekPy takes its
            // coefficients from another compilation than NIST's. Neighbouring voltages differ by 20 %.
            assert!((hvl / hvl_mm - 1.0).abs() < 0.02, "{hvl} mm Al at {kvp} kVp, published {hvl_mm}");
        }
    }

    #[test]
    fn other_voltages_are_answered_with_a_list() {
        let Err(Error::Input { remedy, .. }) = Spectrum::tungsten(70) else {
            panic!("70 kVp is not embedded")
        };
        assert!(remedy.contains("60, 80, 100, 120, 140"), "{remedy}");
    }

    #[test]
    fn the_photons_below_the_table_are_dropped_and_reported() {
        let dropped = Spectrum::tungsten(60).expect("embedded").dropped_fraction();
        assert!((1e-9..3e-9).contains(&dropped), "{dropped}");
        assert_eq!(Spectrum::tungsten(140).expect("embedded").dropped_fraction(), 0.0);
        assert!(Spectrum::from_pairs("mine", &[(9.0, 1e-5), (60.0, 1.0)]).is_err(), "too many to drop");
        let kept = Spectrum::from_pairs("mine", &[(9.0, 1e-7), (60.0, 1.0)]).expect("few enough");
        assert_eq!(kept.bins(), [Bin { energy_kev: 60.0, weight: 1.0 }]);
    }

    #[test]
    fn one_energy_has_the_closed_forms() {
        let spectrum = Spectrum::mono(60.0).expect("in range");
        assert_eq!(spectrum.mean_energy_kev(), 60.0);
        let hvl_mm = spectrum.half_value_layer_mm(water()).expect("in range").expect("finite");
        assert!((hvl_mm / (10.0 * 2.0_f64.ln() / 0.2059) - 1.0).abs() < 1e-14, "{hvl_mm}");
        let vacuum = Material::named("vacuum").expect("known");
        assert_eq!(spectrum.half_value_layer_mm(vacuum).expect("in range"), None);
        assert!(Spectrum::mono(f64::NAN).is_err());
        assert!(Spectrum::mono(5.0).is_err());
    }

    #[test]
    fn a_filter_hardens_the_beam_and_two_halves_make_a_whole() {
        let sheet = |thickness_mm| Filter { material: "pmma".into(), thickness_mm };
        let bare = Spectrum::tungsten(100).expect("embedded");
        let whole = bare.clone().filtered(&[sheet(20.0)]).expect("filtered");
        let halves = bare.clone().filtered(&[sheet(10.0), sheet(10.0)]).expect("filtered");
        assert!(whole.mean_energy_kev() > bare.mean_energy_kev() + 1.0);
        assert!((whole.filter_transmission() / halves.filter_transmission() - 1.0).abs() < 1e-14);
        for (a, b) in whole.bins().iter().zip(halves.bins()) {
            assert!((a.weight / b.weight - 1.0).abs() < 1e-13, "{a:?} {b:?}");
        }
        let mono = Spectrum::mono(60.0).expect("in range");
        let mu = Material::named("pmma").expect("known").mu_per_cm(60.0, 1.19).expect("in range");
        let passed = mono.filtered(&[sheet(20.0)]).expect("filtered").filter_transmission();
        assert!((passed / (-2.0 * mu).exp() - 1.0).abs() < 1e-14);
    }

    #[test]
    fn impossible_filters_are_refused() {
        let spectrum = Spectrum::tungsten(100).expect("embedded");
        for (material, thickness_mm) in
            [("water", -1.0), ("water", f64::NAN), ("water", 1e9), ("aluminum", 1.0)]
        {
            let filter = Filter { material: material.into(), thickness_mm };
            assert!(spectrum.clone().filtered(&[filter]).is_err(), "{thickness_mm} mm of {material}");
        }
    }

    #[test]
    fn a_csv_table_is_read_and_normalized() {
        let text = "# from the tube's maker\n energy_keV, weight\r\n\n20,1\n40,0\n60,3\n";
        let spectrum = Spectrum::from_csv("tube.csv", text).expect("a table");
        let expected = [Bin { energy_kev: 20.0, weight: 0.25 }, Bin { energy_kev: 60.0, weight: 0.75 }];
        assert_eq!(spectrum.bins(), expected);
        assert_eq!(spectrum.mean_energy_kev(), 50.0);
    }

    #[test]
    fn bad_tables_are_refused_with_their_line() {
        for (text, place) in [
            ("", "tube.csv"),
            ("energy,weight\n20,1\n", "tube.csv:1"),
            ("energy_keV,weight\n", "tube.csv"),
            ("energy_keV,weight\n20,0\n", "tube.csv"),
            ("energy_keV,weight\n20,1\n30,x\n", "tube.csv:3"),
            ("energy_keV,weight\n20,1\n30\n", "tube.csv:3"),
            ("energy_keV,weight\n20,1,5\n", "tube.csv:2"),
            ("energy_keV,weight\n20,1\n\n30,NaN\n", "tube.csv:4"),
            ("energy_keV,weight\nNaN,1\n", "tube.csv:2"),
            ("energy_keV,weight\n20,-1\n", "tube.csv:2"),
            ("energy_keV,weight\n20,inf\n", "tube.csv:2"),
            ("energy_keV,weight\n20,1\n20,1\n", "tube.csv:3"),
            ("energy_keV,weight\n30,1\n20,1\n", "tube.csv:3"),
            ("energy_keV,weight\n30,1\n20001,1\n", "tube.csv:3"),
            ("energy_keV,weight\n20,1e308\n30,1e308\n", "tube.csv"),
        ] {
            let Err(Error::Input { subject, .. }) = Spectrum::from_csv("tube.csv", text) else {
                panic!("accepted {text:?}")
            };
            assert_eq!(subject, place, "{text:?}");
        }
    }
}
