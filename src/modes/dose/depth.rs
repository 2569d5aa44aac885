//! What is left of the photons on the way along one path: transmission over depth.

use serde::Serialize;

use super::block::{Block, pass};
use super::optics::dot;
use super::{Dose, Optics};
use crate::error::{Error, Result};
use crate::physics::Stretch;

/// How much is left at a depth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct DepthPoint {
    /// From the source, mm.
    pub depth_mm: f64,
    /// The organ before this depth, by index in the scene; `None` outside every organ.
    pub organ: Option<usize>,
    /// exp(−Σ μL) at the reference energy.
    pub transmission_reference: f64,
    /// The share of all photons.
    pub transmission_photons: f64,
    /// The share of their energy.
    pub transmission_energy: f64,
}

impl Dose<'_> {
    /// Follows one path, by its number in the study.
    ///
    /// # Errors
    /// A number that no path has.
    pub fn path(&self, number: u64) -> Result<Block> {
        let fields = self.study.fields();
        let index = fields.partition_point(|field| field.first_path() <= number).saturating_sub(1);
        if number >= self.study.paths() {
            let problem = format!("the study has {} paths, numbered from 0", self.study.paths());
            return Err(Error::input(format!("path {number}"), problem, "name one of them"));
        }
        let field = &fields[index];
        let optics = [(field.case(), Optics::new(self.study.case_of(field))?)];
        let mut block = Block::default();
        let at_field = number - field.first_path();
        block.follow(&self.at_work(index, &optics), at_field..at_field + 1, |path| {
            self.study.shot(field, path)
        })?;
        Ok(block)
    }

    /// Transmission along one path: at its ends, at every border of organs, and within organs at steps of `step_mm` at most.
    ///
    /// # Errors
    /// As for [`path`](Self::path); a step that is not positive.
    pub fn depths(&self, number: u64, step_mm: f64) -> Result<Vec<DepthPoint>> {
        if step_mm.is_nan() || step_mm <= 0.0 {
            let problem = format!("{step_mm} mm is no step");
            return Err(Error::input("the depths of a path", problem, "give millimetres, more than zero"));
        }
        let block = self.path(number)?;
        let case = self.study.case_of(&self.study.fields()[block.field]);
        let optics = Optics::new(case)?;
        let (mut left, mut mu_length) = (optics.shares.clone(), 0.0);
        let mut points = vec![point(&optics, 0.0, None, 0.0, &left)];
        for stretch in &block.stretches {
            points.push(point(&optics, stretch.entry_mm, None, mu_length, &left));
            let length_mm = stretch.exit_mm - stretch.entry_mm;
            let steps = (length_mm / step_mm).ceil().clamp(1.0, 1e5) as u32;
            let at = |step: u32| stretch.entry_mm + length_mm * f64::from(step) / f64::from(steps);
            for step in 0..steps {
                let part = Stretch { organ: stretch.organ, entry_mm: at(step), exit_mm: at(step + 1) };
                pass(&optics, &part, &mut left);
                mu_length += optics.organs[part.organ].mu_per_mm * (part.exit_mm - part.entry_mm);
                points.push(point(&optics, part.exit_mm, Some(part.organ), mu_length, &left));
            }
        }
        let length_mm = block.paths.first().map_or(0.0, |path| path.length_mm);
        points.push(point(&optics, length_mm, None, mu_length, &left));
        // Organs face to face, and ends in organs, have no way outside between them.
        points.dedup_by(|next, last| next.depth_mm == last.depth_mm && next.organ.is_none());
        Ok(points)
    }
}

fn point(optics: &Optics, depth_mm: f64, organ: Option<usize>, mu_length: f64, left: &[f64]) -> DepthPoint {
    DepthPoint {
        depth_mm,
        organ,
        transmission_reference: (-mu_length).exp(),
        transmission_photons: left.iter().sum(),
        transmission_energy: dot(left, &optics.energies_kev) / optics.mean_energy_kev,
    }
}
