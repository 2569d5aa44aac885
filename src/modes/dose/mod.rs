//! Dose paths: what the primary beam of a study does along each path, in each organ, over each field.
//!
//! ```text
//!   Study ─► blocks of paths ─┬─► rows of paths, organs, stretches ─► whoever keeps them
//!            (on all cores)   └─► sums, in a tree ─► fields ─► cases ─► DoseReport
//! ```
//!
//! | quantity | is |
//! |---|---|
//! | own length | in an organ and in none of the organs within it; own lengths and the part outside add up to the path |
//! | mass thickness | Σ ρL, g/cm² |
//! | radiological path length | Σ μL, at the reference energy |
//! | water-equivalent length by μ | Σ μL / μ of water, at the reference energy: for photons of that energy |
//! | water-equivalent length by electrons | Σ ρ⟨Z/A⟩L / that of water: for electron density, as proton ranges scale with |
//! | transmission | exp(−Σ μL) at the reference energy; of a spectrum, Σ w e^(−Σ μL) by photons and by the detector's signal |
//! | fluence at the target | (reference distance / distance)² · transmission of photons |
//! | collision kerma | fluence of each energy · E · μ_en/ρ of the material at the target: in charged-particle equilibrium the primary's dose |
//! | energy imparted | of the energy that photons lose in an organ (1 − e^(−μL) of those that enter), the share μ_en/μ |
//!
//! Photons are followed to their first interaction: what is scattered there is neither followed nor counted as absorbed. Where each is
//! defined: Attix, *Introduction to Radiological Physics and Radiation Dosimetry* (1986), chapters 2 and 3; coefficients NISTIR
//! 5632.
//!
//! Results are the same bits for any number of threads, and for any split of the study into parts: paths depend on their number
//! alone, and sums are added in a tree over blocks that the field alone decides.

mod block;
mod depth;
mod lengths;
mod optics;
mod part;
mod pass;
mod picture;
mod report;
mod sums;

use std::io;
use std::ops::Range;

use glam::DVec3;
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;

use super::Control;
use super::audit::{Audit, AuditSettings, DEFAULT_TOLERANCE_MM, RaySet};
use super::project::forest::kept;
use super::project::{KeepsTrees, Method, Source};
use crate::error::Result;
use crate::geometry::Bounds;
use crate::ritree::{Loaded, Unreadable};
use crate::scene::Scene;
use crate::study::Study;
use block::FieldAtWork;
use lengths::Tracer;
use optics::Optics;
use report::Collector;
use sums::{Node, Nodes};

pub use block::{Block, OrganRow, PathRow};
pub use depth::DepthPoint;
pub use part::{Part, Piece, Shard, join};
pub use picture::{DepthCurve, FieldPicture, Illustrations};
pub use report::{
    BeamFigures, CaseFigures, DoseReport, FieldFigures, LengthBar, NOTICE, OrganErrors, OrganFigures,
    SampledErrors, StudyWords,
};
pub use sums::{FieldSums, LengthBin, OrganSums};

/// Paths of a block: enough for engines to work in batches, few enough that a block's rows fit a cache.
const BLOCK: u64 = 1024;

/// Blocks per thread whose rows are held at a time.
const WAVE: usize = 8;

/// Paths on which the method's error is looked at, of the whole study or of each part.
const SAMPLE: usize = 20_000;

/// The same for exact methods, which err by rounding only.
const SAMPLE_OF_EXACT: usize = 2_000;

/// The seed of the sample.
const SEED: u64 = 1;

/// Takes the paths of a study, block by block.
///
/// `keep` is called on all threads and makes of a block what is to be kept; `take` is called in the order of blocks.
pub trait Keeper: Sync {
    /// What is kept of a block.
    type Kept: Send;

    /// Makes it, on any thread.
    fn keep(&self, study: &Study, block: &Block) -> Self::Kept;

    /// Takes it, in order.
    ///
    /// # Errors
    /// If it cannot be put away; the run stops.
    fn take(&mut self, kept: Self::Kept) -> Result<()>;
}

/// Keeps no paths.
pub struct NoPaths;

impl Keeper for NoPaths {
    type Kept = ();

    fn keep(&self, _: &Study, _: &Block) {}

    fn take(&mut self, (): ()) -> Result<()> {
        Ok(())
    }
}

/// A study made ready to be followed.
pub struct Dose<'a> {
    study: &'a Study,
    method: Method,
    tracers: Vec<Tracer<'a>>,
    /// The boxes around all organs of each scene.
    bounds: Vec<Bounds>,
    /// The first block of each field, and the number of all.
    first_blocks: Vec<u64>,
}

impl KeepsTrees for Dose<'_> {
    fn save_trees(&self, out: &mut dyn io::Write) -> io::Result<()> {
        kept::save(&self.tracers.iter().filter_map(Tracer::forest).collect::<Vec<_>>(), out)
    }

    fn load_trees(&mut self, source: &mut dyn Source) -> Result<Loaded, Unreadable> {
        kept::load(&mut self.tracers.iter_mut().filter_map(Tracer::forest_mut).collect::<Vec<_>>(), source)
    }
}

impl<'a> Dose<'a> {
    /// Prepares a study.
    ///
    /// # Errors
    /// The raster engine, which needs an image.
    pub fn new(study: &'a Study, method: Method) -> Result<Self> {
        let around = |scene: &Scene| {
            scene.organs.iter().fold(Bounds::EMPTY, |all, organ| all.union(organ.body.bounds()))
        };
        let mut first_blocks = vec![0];
        for field in study.fields() {
            first_blocks.push(first_blocks.last().copied().unwrap_or(0) + field.paths().div_ceil(BLOCK));
        }
        Ok(Self {
            study,
            method,
            tracers: study.scenes().iter().map(|scene| Tracer::new(scene, method)).collect::<Result<_>>()?,
            bounds: study.scenes().iter().map(around).collect(),
            first_blocks,
        })
    }

    /// The study.
    pub fn study(&self) -> &'a Study {
        self.study
    }

    /// How many paths a part of the study has.
    pub fn paths(&self, shard: Shard) -> u64 {
        let paths = self.paths_of(self.blocks_of(shard));
        paths.end - paths.start
    }

    /// Follows all paths.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::Error::Interrupted) within some blocks' time of a request to stop; what `keeper` cannot put
    /// away.
    pub fn run(&self, keeper: &mut impl Keeper, control: &Control) -> Result<DoseReport> {
        let mut collector = Collector::new(self.study);
        self.follow(Shard::WHOLE, keeper, control, &mut |piece| collector.take(piece.nodes))?;
        Ok(collector.report(self.method.name(), self.errors(Shard::WHOLE, control)?))
    }

    /// Follows one part of the study; [`join`] makes a report of all parts.
    ///
    /// # Errors
    /// As for [`run`](Self::run).
    pub fn run_part(&self, shard: Shard, keeper: &mut impl Keeper, control: &Control) -> Result<Part> {
        let mut pieces = Vec::new();
        self.follow(shard, keeper, control, &mut |piece| pieces.push(piece))?;
        let errors = self.errors(shard, control)?;
        Ok(Part::new(self.study, self.method.name(), shard, self.paths(shard), pieces, errors))
    }

    /// Follows a part's blocks in waves; `finished` is told of each field, as much of it as is in the part, in order.
    fn follow<K: Keeper>(
        &self,
        shard: Shard,
        keeper: &mut K,
        control: &Control,
        finished: &mut dyn FnMut(Piece),
    ) -> Result<()> {
        let blocks = self.blocks_of(shard);
        let wave = WAVE * rayon::current_num_threads();
        let mut optics: Vec<(usize, Optics)> = Vec::new();
        let mut open: Option<Piece> = None;
        for start in blocks.clone().step_by(wave) {
            let end = (start + wave as u64).min(blocks.end);
            self.prepare(start..end, &mut optics)?;
            let shared: &K = keeper;
            let follow = |block: &mut Block, index: u64| -> Result<(usize, Node<FieldSums>, K::Kept)> {
                control.check()?;
                let at = self.at_work(self.field_of(index), &optics);
                let index = index - self.first_blocks[at.index];
                let paths = index * BLOCK..((index + 1) * BLOCK).min(at.field.paths());
                let count = paths.end - paths.start;
                let sum = block.follow(&at, paths, |path| self.study.shot(at.field, path))?;
                let kept = shared.keep(self.study, block);
                control.advance(count);
                Ok((at.index, Node { level: 0, index, sum }, kept))
            };
            let done: Vec<_> =
                (start..end).into_par_iter().map_init(Block::default, follow).collect::<Result<_>>()?;
            for (field, node, kept) in done {
                keeper.take(kept)?;
                if open.as_ref().is_some_and(|piece| piece.field != field) {
                    open.take().into_iter().for_each(&mut *finished);
                }
                open.get_or_insert_with(|| Piece { field, nodes: Nodes::default() }).nodes.push(node);
            }
        }
        open.into_iter().for_each(finished);
        Ok(())
    }

    /// Makes the optics of the blocks' cases, and forgets those of others.
    fn prepare(&self, blocks: Range<u64>, optics: &mut Vec<(usize, Optics)>) -> Result<()> {
        let case = |block: u64| self.study.fields()[self.field_of(block)].case();
        let cases = case(blocks.start)..case(blocks.end - 1) + 1;
        optics.retain(|(known, _)| cases.contains(known));
        let known: Vec<usize> = optics.iter().map(|(case, _)| *case).collect();
        let made: Vec<(usize, Optics)> = cases
            .into_par_iter()
            .filter(|case| !known.contains(case))
            .map(|case| Ok((case, Optics::new(&self.study.cases()[case])?)))
            .collect::<Result<_>>()?;
        optics.extend(made);
        optics.sort_unstable_by_key(|(case, _)| *case);
        Ok(())
    }

    fn at_work<'w>(&'w self, index: usize, optics: &'w [(usize, Optics)]) -> FieldAtWork<'w, 'a> {
        let field = &self.study.fields()[index];
        let case = self.study.case_of(field);
        FieldAtWork {
            index,
            field,
            case,
            organs: &self.study.scene_of(case).organs,
            bounds: self.bounds[case.scene()],
            // Cases follow each other without a gap.
            optics: &optics[field.case() - optics[0].0].1,
            tracer: &self.tracers[case.scene()],
        }
    }

    /// Errors of the method on a seeded sample of a part's paths, scene by scene, from the audit.
    fn errors(&self, shard: Shard, control: &Control) -> Result<Vec<SampledErrors>> {
        let most =
            if matches!(self.method, Method::RiTree(_) | Method::Auto(_)) { SAMPLE } else { SAMPLE_OF_EXACT };
        let mut lines = vec![Vec::new(); self.study.scenes().len()];
        for path in sample(self.paths_of(self.blocks_of(shard)), most) {
            let fields = self.study.fields();
            let field = &fields[fields.partition_point(|field| field.first_path() <= path).saturating_sub(1)];
            let shot = self.study.shot(field, path - field.first_path());
            lines[self.study.case_of(field).scene()].push((shot.source_mm, shot.path_mm));
        }
        let scenes = self.study.scenes().iter().zip(lines).filter(|(_, lines)| !lines.is_empty());
        scenes.map(|(scene, lines)| self.errors_in(scene, lines, control)).collect()
    }

    fn errors_in(
        &self,
        scene: &Scene,
        lines: Vec<(DVec3, DVec3)>,
        control: &Control,
    ) -> Result<SampledErrors> {
        let paths = lines.len() as u64;
        let rays = RaySet::Sample { lines, of: "the study's paths".into(), seed: SEED };
        let settings =
            AuditSettings { rays, method: self.method, against: None, tolerance_mm: DEFAULT_TOLERANCE_MM };
        let report = Audit::new(scene, settings)?.run(&control.without_progress())?;
        let of_organ = |organ: &super::audit::OrganFigures| OrganErrors {
            organ: organ.organ.clone(),
            length_mm: organ.method.length_mm,
        };
        Ok(SampledErrors {
            scene: scene.name.clone(),
            paths,
            seed: SEED,
            against: "clipping for convex organs, the hierarchy of boxes for others".into(),
            length_mm: report.whole.method.length_mm,
            transmission: report.transmission,
            organs: report.organs.iter().map(of_organ).collect(),
        })
    }

    /// The blocks of a part: as many as of each other part, or one less.
    fn blocks_of(&self, shard: Shard) -> Range<u64> {
        shard.share_of(self.first_blocks[self.study.fields().len()])
    }

    /// The numbers of the blocks' paths.
    fn paths_of(&self, blocks: Range<u64>) -> Range<u64> {
        let first = |block: u64| match self.study.fields().get(self.field_of(block)) {
            Some(field) => field.first_path() + (block - self.first_blocks[self.field_of(block)]) * BLOCK,
            None => self.study.paths(),
        };
        first(blocks.start)..first(blocks.end)
    }

    /// The field of a block; as many as there are fields for the block past the last.
    fn field_of(&self, block: u64) -> usize {
        self.first_blocks.partition_point(|first| *first <= block).saturating_sub(1)
    }
}

/// All of some numbers, if they are few, or as many random ones.
fn sample(of: Range<u64>, most: usize) -> Vec<u64> {
    let count = of.end - of.start;
    if count <= most as u64 {
        return of.collect();
    }
    let mut rng = Pcg64::seed_from_u64(SEED);
    (0..most).map(|_| of.start + rng.next_u64() % count).collect()
}
