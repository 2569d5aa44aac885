//! A block of a field's paths: from their chords to what happens along each.
//!
//! ```text
//!   chords ─► own stretches ─► photons of each bin, stretch by stretch:   left · e^(−μL)        go on
//!                                                                  left · (1 − e^(−μL))  interact; of their energy
//!                                                                                        μ_en/μ is absorbed there
//! ```

use std::ops::Range;

use super::lengths::{Chords, Tracer};
use super::optics::{Optics, PGY_CM2_PER_KEV_CM2_G, dot};
use super::sums::{FieldSums, OrganPart};
use crate::error::{Error, Result};
use crate::geometry::{Bounds, Segment};
use crate::modes::project::sweep::own_stretches;
use crate::physics::Stretch;
use crate::scene::Organ;
use crate::study::{Case, Field, Shot};

/// How near to its end, in parts of its length, a path's last stretch must reach for the target to lie in its organ: engines
/// cut chords at the target to within a few units in the last place.
const AT_THE_END: f64 = 1.0 - 1e-12;

/// What happens along one path. Lengths mm, energies keV; photons are shares of those that leave the source along the path.
#[derive(Clone, Debug, PartialEq)]
pub struct PathRow {
    /// Its number in the study.
    pub number: u64,
    /// Where it runs.
    pub shot: Shot,
    /// From source to target, mm.
    pub length_mm: f64,
    /// The part outside every organ, mm.
    pub outside_mm: f64,
    /// Σ ρL, g/cm².
    pub mass_g_cm2: f64,
    /// Σ μL at the reference energy: the radiological path length.
    pub mu_length: f64,
    /// The length of water of the same Σ μL at the reference energy, mm.
    pub water_by_mu_mm: f64,
    /// The length of water with as many electrons per area, mm.
    pub water_by_electrons_mm: f64,
    /// exp(−Σ μL) at the reference energy.
    pub transmission_reference: f64,
    /// The share of all photons that reach the target unscattered.
    pub transmission_photons: f64,
    /// The same, weighted by the detector's signal.
    pub transmission_signal: f64,
    /// The mean energy of what reaches the target, keV; `None` if nothing does.
    pub mean_energy_kev: Option<f64>,
    /// (reference distance / length)²; 1 for parallel rays.
    pub inverse_square: f64,
    /// Primary fluence at the target over that at the reference distance in air.
    pub fluence: f64,
    /// The organ at the source.
    pub source_organ: Option<usize>,
    /// The organ at the target.
    pub target_organ: Option<usize>,
    /// Primary collision kerma at the target, in its organ's material, per fluence at the reference distance, pGy·cm²; `None`
    /// outside every organ.
    pub kerma_pgy_cm2: Option<f64>,
    /// The same in a little water there.
    pub water_kerma_pgy_cm2: f64,
    /// Whether the target is one of interest and lies outside the box around all organs.
    pub target_outside: bool,
    /// Its rows among the block's organs.
    pub organs: Range<usize>,
    /// Its stretches among the block's.
    pub stretches: Range<usize>,
}

/// One organ along one path.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct OrganRow {
    /// Its index in the scene.
    pub organ: usize,
    /// In which order organs are entered, from 1.
    pub order: u32,
    /// How many stretches it has.
    pub segments: u32,
    /// The length in it and in none of the organs within it, mm.
    pub own_length_mm: f64,
    /// Where it is first entered, mm from the source.
    pub entry_mm: f64,
    /// Where it is last left, mm from the source.
    pub exit_mm: f64,
    /// ρL, g/cm².
    pub mass_g_cm2: f64,
    /// μL at the reference energy.
    pub mu_length: f64,
    /// The length of water of the same μL at the reference energy, mm.
    pub water_by_mu_mm: f64,
    /// The length of water with as many electrons per area, mm.
    pub water_by_electrons_mm: f64,
    /// The mean energy that a photon of the path loses in it, keV.
    pub removed_kev: f64,
    /// Of that, what is absorbed there, keV.
    pub absorbed_kev: f64,
}

/// The paths of a block; reused from block to block.
#[derive(Default)]
pub struct Block {
    /// The field's index in the study.
    pub field: usize,
    /// The paths.
    pub paths: Vec<PathRow>,
    /// Their organs, path after path, in the order of entry.
    pub organs: Vec<OrganRow>,
    /// Their stretches, path after path, in order.
    pub stretches: Vec<Stretch>,
    work: Work,
}

#[derive(Default)]
struct Work {
    shots: Vec<Shot>,
    segments: Vec<Segment>,
    chords: Chords,
    stops: Vec<f64>,
    own: Vec<Stretch>,
    /// The photons left in each bin.
    left: Vec<f64>,
}

/// What is the same for all paths of a field.
pub struct FieldAtWork<'a, 's> {
    pub index: usize,
    pub field: &'a Field,
    pub case: &'a Case,
    pub organs: &'a [Organ],
    pub bounds: Bounds,
    pub optics: &'a Optics,
    pub tracer: &'a Tracer<'s>,
}

impl Block {
    /// Follows the field's paths of these numbers; returns their sums.
    ///
    /// # Errors
    /// A path without a direction.
    pub fn follow(
        &mut self,
        at: &FieldAtWork,
        paths: Range<u64>,
        shot: impl Fn(u64) -> Shot,
    ) -> Result<FieldSums> {
        self.field = at.index;
        self.paths.clear();
        self.organs.clear();
        self.stretches.clear();
        let mut work = std::mem::take(&mut self.work);
        work.shots.clear();
        work.segments.clear();
        for index in paths.clone() {
            let shot = shot(index);
            work.segments.push(shot.segment().ok_or_else(|| {
                let number = at.field.first_path() + index;
                Error::input(format!("path {number}"), "it has no direction", "move its source or its target")
            })?);
            work.shots.push(shot);
        }
        at.tracer.trace(&work.segments, &mut work.chords);
        let mut sums = FieldSums::new(at.organs.len());
        for (i, index) in paths.enumerate() {
            self.follow_one(at, i, at.field.first_path() + index, &mut work, &mut sums);
        }
        self.work = work;
        Ok(sums)
    }

    fn follow_one(&mut self, at: &FieldAtWork, i: usize, number: u64, work: &mut Work, sums: &mut FieldSums) {
        let (shot, length_mm) = (work.shots[i], work.segments[i].length_mm());
        let depth = |organ: usize| at.organs[organ].depth;
        own_stretches(work.chords.of(i), depth, &mut work.stops, &mut work.own);
        let (organs_from, stretches_from) = (self.organs.len(), self.stretches.len());
        self.stretches.extend_from_slice(&work.own);
        work.left.clear();
        work.left.extend_from_slice(&at.optics.shares);
        let (mut outside_mm, mut reached_mm) = (0.0, 0.0);
        for stretch in &work.own {
            outside_mm += f64::max(stretch.entry_mm - reached_mm, 0.0);
            reached_mm = stretch.exit_mm;
            let (removed_kev, absorbed_kev) = pass(at.optics, stretch, &mut work.left);
            let of_path = &mut self.organs[organs_from..];
            let row = match of_path.iter().position(|row| row.organ == stretch.organ) {
                Some(known) => &mut of_path[known],
                None => {
                    let order = of_path.len() as u32 + 1;
                    self.organs.push(OrganRow {
                        organ: stretch.organ,
                        order,
                        entry_mm: stretch.entry_mm,
                        ..OrganRow::default()
                    });
                    let last = self.organs.len() - 1;
                    &mut self.organs[last]
                }
            };
            row.segments += 1;
            row.own_length_mm += stretch.exit_mm - stretch.entry_mm;
            row.exit_mm = stretch.exit_mm;
            row.removed_kev += removed_kev;
            row.absorbed_kev += absorbed_kev;
        }
        outside_mm += f64::max(length_mm - reached_mm, 0.0);
        for row in &mut self.organs[organs_from..] {
            let organ = &at.optics.organs[row.organ];
            row.mass_g_cm2 = organ.g_cm2_per_mm * row.own_length_mm;
            row.mu_length = organ.mu_per_mm * row.own_length_mm;
            row.water_by_mu_mm = organ.water_by_mu * row.own_length_mm;
            row.water_by_electrons_mm = organ.water_by_electrons * row.own_length_mm;
        }
        let path = self.path_row(
            at,
            number,
            shot,
            [length_mm, outside_mm],
            &work.left,
            [organs_from, stretches_from],
        );
        self.enter(at, &path, &work.left, sums);
        self.paths.push(path);
    }

    fn path_row(
        &self,
        at: &FieldAtWork,
        number: u64,
        shot: Shot,
        [length_mm, outside_mm]: [f64; 2],
        left: &[f64],
        [organs_from, stretches_from]: [usize; 2],
    ) -> PathRow {
        let organs = &self.organs[organs_from..];
        let sum = |of: fn(&OrganRow) -> f64| organs.iter().map(of).sum::<f64>() + 0.0;
        let optics = at.optics;
        let mu_length = sum(|row| row.mu_length);
        let transmission_photons: f64 = left.iter().sum();
        let energy_kev = dot(left, &optics.energies_kev);
        let inverse_square =
            at.case.reference_distance_mm.map_or(1.0, |distance| (distance / length_mm).powi(2));
        let kerma = |mu_en_rho: &[f64]| {
            let per_photon: f64 = left
                .iter()
                .zip(&optics.energies_kev)
                .zip(mu_en_rho)
                .map(|((left, e), mu)| left * e * mu)
                .sum();
            PGY_CM2_PER_KEV_CM2_G * inverse_square * per_photon
        };
        let stretches = &self.stretches[stretches_from..];
        let is_at_target = |stretch: &&Stretch| stretch.exit_mm >= AT_THE_END * length_mm;
        let target_organ = stretches.last().filter(is_at_target).map(|stretch| stretch.organ);
        PathRow {
            number,
            shot,
            length_mm,
            outside_mm,
            mass_g_cm2: sum(|row| row.mass_g_cm2),
            mu_length,
            water_by_mu_mm: sum(|row| row.water_by_mu_mm),
            water_by_electrons_mm: sum(|row| row.water_by_electrons_mm),
            transmission_reference: (-mu_length).exp(),
            transmission_photons,
            transmission_signal: dot(left, &optics.signals) / optics.mean_signal,
            mean_energy_kev: (transmission_photons > 0.0).then(|| energy_kev / transmission_photons),
            inverse_square,
            fluence: inverse_square * transmission_photons,
            source_organ: stretches
                .first()
                .filter(|stretch| stretch.entry_mm <= 0.0)
                .map(|stretch| stretch.organ),
            target_organ,
            kerma_pgy_cm2: target_organ.map(|organ| kerma(&optics.organs[organ].mu_en_rho)),
            water_kerma_pgy_cm2: kerma(&optics.water_mu_en_rho),
            target_outside: at.case.has_targets() && !at.bounds.contains(shot.target_mm()),
            organs: organs_from..self.organs.len(),
            stretches: stretches_from..self.stretches.len(),
        }
    }

    /// Adds a path to the field's sums.
    fn enter(&self, at: &FieldAtWork, path: &PathRow, left: &[f64], sums: &mut FieldSums) {
        let Shot { photons, pencil, .. } = path.shot;
        sums.paths += 1;
        sums.paths_meeting_nothing += u64::from(path.organs.is_empty());
        sums.photons += photons;
        sums.length += photons * path.length_mm;
        sums.outside += photons * path.outside_mm;
        sums.transmitted += photons * path.transmission_photons;
        sums.transmitted_energy += photons * dot(left, &at.optics.energies_kev);
        sums.transmitted_reference += photons * path.transmission_reference;
        for row in &self.organs[path.organs.clone()] {
            let of_organ = self.stretches[path.stretches.clone()].iter().filter(|s| s.organ == row.organ);
            let volume_mm3 =
                pencil.map_or(0.0, |pencil| of_organ.map(|s| pencil.volume_mm3(s.entry_mm, s.exit_mm)).sum());
            let part = OrganPart {
                photons,
                length_mm: row.own_length_mm,
                mu_length: row.mu_length,
                removed_kev: row.removed_kev,
                absorbed_kev: row.absorbed_kev,
                path: path.number,
                area_mm2: pencil.map_or(0.0, |pencil| pencil.area_mm2),
                volume_mm3,
            };
            sums.organs[row.organ].add(&part, at.case.histogram_bin_mm);
        }
    }
}

/// Takes photons along a stretch; returns the energy that they lose there, and that which is absorbed there, keV.
pub(super) fn pass(optics: &Optics, stretch: &Stretch, left: &mut [f64]) -> (f64, f64) {
    let organ = &optics.organs[stretch.organ];
    let length_mm = stretch.exit_mm - stretch.entry_mm;
    let (mut removed_kev, mut absorbed_kev) = (0.0, 0.0);
    let bins = left.iter_mut().zip(&organ.mu_bins_per_mm).zip(&organ.absorbed_kev).zip(&optics.energies_kev);
    for (((left, mu_per_mm), absorbed), energy) in bins {
        let behind = *left * (-mu_per_mm * length_mm).exp();
        let lost = *left - behind;
        *left = behind;
        removed_kev += energy * lost;
        absorbed_kev += absorbed * lost;
    }
    (removed_kev, absorbed_kev)
}
