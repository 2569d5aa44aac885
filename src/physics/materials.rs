//! Materials and how they attenuate: NIST's mass attenuation coefficients, embedded (see `data/PROVENANCE.md`).
//!
//! Between the table's energies both coefficients are interpolated linearly in the logarithms of energy and coefficient, as is
//! usual for them (nearly power laws between edges; none of these materials has an edge above 10 keV). Outside 10 keV to 20 MeV
//! there is no answer but an error.

use std::sync::OnceLock;

use crate::{Error, Result};

/// The lowest energy of the attenuation table, keV.
pub const LOWEST_KEV: f64 = 10.0;
/// The highest energy of the attenuation table, keV.
pub const HIGHEST_KEV: f64 = 20_000.0;

const TABLE: &str = include_str!("data/attenuation.csv");

/// A material of the table, or vacuum. A handle: cheap to copy, equal if the material is the same.
#[derive(Clone, Copy, Debug)]
pub struct Material(&'static Entry);

/// Electrons per unit of atomic mass, ⟨Z/A⟩, of the table's materials: NIST's material constants (NISTIR 5632, Table 2).
const ELECTRONS_PER_AMU: [(&str, f64); 13] = [
    ("adipose", 0.55579),
    ("air", 0.49919),
    ("blood", 0.54999),
    ("bone_cortical", 0.51478),
    ("brain", 0.55239),
    ("breast", 0.55196),
    ("lung", 0.55048),
    ("lung_inflated", 0.55048),
    ("muscle", 0.55000),
    ("pmma", 0.53937),
    ("soft_tissue", 0.54996),
    ("soft_tissue_4comp", 0.54975),
    ("water", 0.55508),
];

#[derive(Debug)]
struct Entry {
    name: String,
    density_g_cm3: f64,
    /// Ascending energies; empty for vacuum.
    nodes: Vec<Node>,
}

#[derive(Debug)]
struct Node {
    energy_kev: f64,
    mu_rho_cm2_g: f64,
    mu_en_rho_cm2_g: f64,
}

impl PartialEq for Material {
    fn eq(&self, other: &Self) -> bool {
        std::ptr::eq(self.0, other.0)
    }
}

impl Eq for Material {}

impl Material {
    /// The material of this name. An error that lists all names if there is none.
    pub fn named(name: &str) -> Result<Self> {
        entries().iter().find(|entry| entry.name == name).map(Self).ok_or_else(|| {
            Error::input(
                format!("material {name:?}"),
                "is not in the attenuation table",
                format!("choose one of {}", Self::names().collect::<Vec<_>>().join(", ")),
            )
        })
    }

    /// All names, vacuum first, then as in the table.
    pub fn names() -> impl Iterator<Item = &'static str> {
        entries().iter().map(|entry| entry.name.as_str())
    }

    /// The name, as scenes write it.
    pub fn name(self) -> &'static str {
        &self.0.name
    }

    /// The usual density, g/cm³; 0 for vacuum.
    pub fn density_g_cm3(self) -> f64 {
        self.0.density_g_cm3
    }

    /// Electrons per unit of atomic mass, ⟨Z/A⟩; 0 for vacuum. Times the density it is the electron density, in moles/cm³.
    pub fn electrons_per_amu(self) -> f64 {
        let known = ELECTRONS_PER_AMU.iter().find(|(name, _)| *name == self.name());
        known.map_or(0.0, |(_, electrons)| *electrons)
    }

    /// Whether the material attenuates nothing at any density.
    pub fn is_vacuum(self) -> bool {
        self.0.nodes.is_empty()
    }

    /// Mass attenuation coefficient μ/ρ, cm²/g. An error outside 10 keV to 20 MeV or for NaN.
    pub fn mu_rho_cm2_g(self, energy_kev: f64) -> Result<f64> {
        self.interpolated(energy_kev, |node| node.mu_rho_cm2_g)
    }

    /// Mass energy-absorption coefficient μ_en/ρ, cm²/g. An error outside 10 keV to 20 MeV or for NaN.
    pub fn mu_en_rho_cm2_g(self, energy_kev: f64) -> Result<f64> {
        self.interpolated(energy_kev, |node| node.mu_en_rho_cm2_g)
    }

    /// Linear attenuation coefficient μ at a density, 1/cm. Errors as for [`Material::mu_rho_cm2_g`].
    pub fn mu_per_cm(self, energy_kev: f64, density_g_cm3: f64) -> Result<f64> {
        Ok(self.mu_rho_cm2_g(energy_kev)? * density_g_cm3)
    }

    /// Log-log interpolation of one coefficient, the table's own number at the table's own energies.
    fn interpolated(self, energy_kev: f64, coefficient: impl Fn(&Node) -> f64) -> Result<f64> {
        check_energy(energy_kev)?;
        if self.is_vacuum() {
            return Ok(0.0);
        }
        let nodes = &self.0.nodes;
        let above = nodes.partition_point(|node| node.energy_kev < energy_kev);
        let upper = &nodes[above];
        if upper.energy_kev == energy_kev {
            return Ok(coefficient(upper));
        }
        let lower = &nodes[above - 1];
        let fraction = (energy_kev / lower.energy_kev).ln() / (upper.energy_kev / lower.energy_kev).ln();
        let (from, to) = (coefficient(lower), coefficient(upper));
        Ok(from * (fraction * (to / from).ln()).exp())
    }
}

/// Refuses energies that the table does not cover, and NaN.
pub(super) fn check_energy(energy_kev: f64) -> Result<()> {
    if (LOWEST_KEV..=HIGHEST_KEV).contains(&energy_kev) {
        return Ok(());
    }
    Err(Error::input(
        format!("energy {energy_kev} keV"),
        "is outside the attenuation table, which is never extrapolated",
        format!("choose an energy from {LOWEST_KEV} to {HIGHEST_KEV} keV"),
    ))
}

fn entries() -> &'static [Entry] {
    static ENTRIES: OnceLock<Vec<Entry>> = OnceLock::new();
    ENTRIES.get_or_init(|| {
        let mut entries = vec![Entry { name: "vacuum".into(), density_g_cm3: 0.0, nodes: Vec::new() }];
        for line in TABLE.lines().skip(1) {
            let (name, numbers) = line.split_once(',').expect("the embedded table is tested");
            let mut numbers =
                numbers.split(',').map(|number| number.parse::<f64>().expect("the embedded table is tested"));
            let mut next = || numbers.next().expect("the embedded table is tested");
            let density_g_cm3 = next();
            let node = Node { energy_kev: next(), mu_rho_cm2_g: next(), mu_en_rho_cm2_g: next() };
            match entries.last_mut().filter(|entry| entry.name == name) {
                Some(entry) => entry.nodes.push(node),
                None => entries.push(Entry { name: name.into(), density_g_cm3, nodes: vec![node] }),
            }
        }
        entries
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn material(name: &str) -> Material {
        Material::named(name).expect("in the table")
    }

    fn table() -> impl Iterator<Item = Material> {
        Material::names().map(material).filter(|material| !material.is_vacuum())
    }

    #[test]
    fn electrons_per_mass_follow_from_the_elements() {
        /// Z and relative atomic mass (IUPAC 2021).
        const ELEMENTS: [(&str, f64, f64); 12] = [
            ("H", 1.0, 1.008),
            ("C", 6.0, 12.011),
            ("N", 7.0, 14.007),
            ("O", 8.0, 15.999),
            ("Na", 11.0, 22.990),
            ("Mg", 12.0, 24.305),
            ("P", 15.0, 30.974),
            ("S", 16.0, 32.06),
            ("Cl", 17.0, 35.45),
            ("Ar", 18.0, 39.95),
            ("K", 19.0, 39.098),
            ("Ca", 20.0, 40.078),
        ];
        // Percent by weight, ICRU Report 44; compounds from their formulas.
        let compositions = [
            ("water", "H 11.190 O 88.810"),
            ("pmma", "H 8.054 C 59.985 O 31.961"),
            ("air", "C 0.012 N 75.527 O 23.178 Ar 1.283"),
            ("adipose", "H 11.4 C 59.8 N 0.7 O 27.8 Na 0.1 S 0.1 Cl 0.1"),
            ("bone_cortical", "H 3.4 C 15.5 N 4.2 O 43.5 Na 0.1 Mg 0.2 P 10.3 S 0.3 Ca 22.5"),
            ("brain", "H 10.7 C 14.5 N 2.2 O 71.2 Na 0.2 P 0.4 S 0.2 Cl 0.3 K 0.3"),
            ("breast", "H 10.6 C 33.2 N 3.0 O 52.7 Na 0.1 P 0.1 S 0.2 Cl 0.1"),
            ("lung", "H 10.3 C 10.5 N 3.1 O 74.9 Na 0.2 P 0.2 S 0.3 Cl 0.3 K 0.2"),
            ("muscle", "H 10.2 C 14.3 N 3.4 O 71.0 Na 0.1 P 0.2 S 0.3 Cl 0.1 K 0.4"),
            ("soft_tissue", "H 10.2 C 14.3 N 3.4 O 70.8 Na 0.2 P 0.3 S 0.3 Cl 0.2 K 0.3"),
            ("soft_tissue_4comp", "H 10.117 C 11.1 N 2.6 O 76.183"),
        ];
        for (name, composition) in compositions {
            let words: Vec<&str> = composition.split(' ').collect();
            let share = |pair: &[&str]| {
                let element = ELEMENTS.iter().find(|e| e.0 == pair[0]).expect("an element");
                pair[1].parse::<f64>().expect("a number") / 100.0 * element.1 / element.2
            };
            let electrons: f64 = words.chunks(2).map(share).sum();
            let listed = material(name).electrons_per_amu();
            assert!((electrons - listed).abs() < 3e-5, "{name}: {electrons}, listed {listed}");
        }
        assert!(table().all(|material| material.electrons_per_amu() > 0.4));
    }

    #[test]
    fn the_table_is_whole() {
        assert_eq!(table().count(), 13);
        for material in table() {
            let nodes = &material.0.nodes;
            assert_eq!(nodes.len(), 28, "{}", material.name());
            assert_eq!((nodes[0].energy_kev, nodes[27].energy_kev), (LOWEST_KEV, HIGHEST_KEV));
            assert!(nodes.windows(2).all(|pair| pair[0].energy_kev < pair[1].energy_kev));
            assert!(
                nodes
                    .iter()
                    .all(|node| 0.0 < node.mu_en_rho_cm2_g && node.mu_en_rho_cm2_g < node.mu_rho_cm2_g)
            );
            assert!(material.density_g_cm3() > 0.0);
        }
    }

    #[test]
    fn known_values_are_found() {
        for (name, energy_kev, mu_rho, mu_en_rho) in [
            ("water", 60.0, 0.2059, 0.0319),
            ("bone_cortical", 60.0, 0.3148, 0.1400),
            ("air", 1000.0, 0.06358, 0.02789),
        ] {
            let found = material(name);
            let near = |value: f64, known: f64| (value / known - 1.0).abs() < 5e-4;
            assert!(near(found.mu_rho_cm2_g(energy_kev).expect("in range"), mu_rho), "μ/ρ of {name}");
            assert!(
                near(found.mu_en_rho_cm2_g(energy_kev).expect("in range"), mu_en_rho),
                "μ_en/ρ of {name}"
            );
        }
        assert_eq!(material("lung_inflated").density_g_cm3(), 0.26);
        assert_eq!(material("water").mu_per_cm(60.0, 0.5).expect("in range"), 0.2059 * 0.5);
    }

    #[test]
    fn nodes_are_exact_and_between_them_the_logarithms_are_linear() {
        for material in table() {
            for pair in material.0.nodes.windows(2) {
                assert_eq!(material.mu_rho_cm2_g(pair[0].energy_kev).expect("a node"), pair[0].mu_rho_cm2_g);
                assert_eq!(
                    material.mu_en_rho_cm2_g(pair[1].energy_kev).expect("a node"),
                    pair[1].mu_en_rho_cm2_g
                );
                // Halfway in log energy is halfway in log coefficient: the geometric mean of both.
                let middle = (pair[0].energy_kev * pair[1].energy_kev).sqrt();
                let mean = (pair[0].mu_rho_cm2_g * pair[1].mu_rho_cm2_g).sqrt();
                let found = material.mu_rho_cm2_g(middle).expect("in range");
                assert!((found / mean - 1.0).abs() < 1e-14, "{} at {middle} keV", material.name());
            }
        }
    }

    #[test]
    fn attenuation_is_monotone_between_nodes() {
        for material in table() {
            for pair in material.0.nodes.windows(2) {
                let at = |step: i32| {
                    let energy = pair[0].energy_kev
                        + f64::from(step) / 20.0 * (pair[1].energy_kev - pair[0].energy_kev);
                    material.mu_rho_cm2_g(energy).expect("in range")
                };
                let falls = pair[1].mu_rho_cm2_g < pair[0].mu_rho_cm2_g;
                assert!((0..20).all(|step| (at(step + 1) < at(step)) == falls), "{}", material.name());
            }
        }
    }

    #[test]
    fn energies_outside_the_table_are_errors() {
        for energy_kev in [9.999, 20_000.1, 0.0, -60.0, f64::NAN, f64::INFINITY] {
            for name in ["water", "vacuum"] {
                let error = material(name).mu_rho_cm2_g(energy_kev).expect_err("outside");
                assert!(error.to_string().contains("keV"), "{error}");
            }
        }
    }

    #[test]
    fn an_unknown_material_is_answered_with_all_names() {
        let Err(Error::Input { remedy, .. }) = Material::named("bone") else { panic!("bone is not a name") };
        for name in ["vacuum", "water", "bone_cortical", "lung_inflated"] {
            assert!(remedy.contains(name), "{remedy}");
        }
    }

    #[test]
    fn vacuum_attenuates_nothing() {
        let vacuum = material("vacuum");
        assert!(vacuum.is_vacuum());
        assert_eq!(vacuum.mu_rho_cm2_g(60.0).expect("in range"), 0.0);
        assert_eq!(vacuum.density_g_cm3(), 0.0);
    }
}
