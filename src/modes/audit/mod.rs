//! Length-error audits: how wrong can this picture be?
//!
//! ```text
//!   RaySet ──▶ Comparison: method against reference ──▶ Ledger ──▶ AuditReport
//!   views,     length of every ray in every organ       errors     figures per organ, view and kind of error,
//!   random,                                                        the worst rays, each with what finds it again
//!   adversarial
//! ```
//!
//! Three kinds of error are kept apart, and told once more together:
//!
//! | kind | is | by |
//! |---|---|---|
//! | method | the method's length − the reference's | interpolation, or an engine's rounding |
//! | accumulation | sums along an image's rays − the reference's | rounding that grows with the distance from the source |
//! | mesh | the reference's − the closed form's | flat faces in place of the curved surface |
//! | total | the method's − the closed form's | both: how far the answer is from the shape that was meant |
//!
//! The reference is half-space clipping for convex bodies and the hierarchy of boxes for others, each ray by itself, unless
//! another method is named. A ray that misses an organ for both is not counted. Figures are the same for any
//! number of threads, to the last bit: answers depend on the ray alone, and ledgers are merged in order.

mod compare;
mod finder;
mod ledger;
mod optics;
mod outline;
mod picture;
mod rays;
mod reference;
mod report;
#[cfg(test)]
mod tests;
mod worst;

use std::io;

use glam::DVec3;

use super::Control;
use super::project::{KeepsTrees, Method, Source};
use crate::error::{Error, Result};
use crate::exact::{Body, Engine};
use crate::geometry::{Region, Segment};
use crate::modes::project::Found;
use crate::ritree::{Loaded, Unreadable};
use crate::scene::{Scene, View};
use compare::Comparison;
use finder::{Batch, ByMethod, Finder, Reference};
use ledger::{Ledger, Tolerances};
use optics::Optics;
use rays::Lines;
use worst::Origin;

pub use compare::SILHOUETTE_SHARE;
pub use picture::Pictures;
pub(super) use rays::Archer;
pub use rays::{Aim, RaySet};
pub use reference::ReferenceError;
pub use report::{AuditReport, Bar, DistanceFigures, KindFigures, OrganFigures, RayWords, SectionFigures};
pub use worst::{WorstRay, shell_word};

/// The tolerance of an audit that names none, mm: half a millimetre of soft tissue changes T by 1 %, about the noise of a
/// good radiograph's pixel.
pub const DEFAULT_TOLERANCE_MM: f64 = 0.5;

/// The tolerance of transmissions: one part in a thousand of the unattenuated beam, a step of a ten-bit image.
pub const TRANSMISSION_TOLERANCE: f64 = 1e-3;

/// What is audited.
#[derive(Clone, Debug, PartialEq)]
pub struct AuditSettings {
    /// Along which rays.
    pub rays: RaySet,
    /// What is judged.
    pub method: Method,
    /// By what; by the reference if `None`.
    pub against: Option<Method>,
    /// Errors beyond this are counted, mm.
    pub tolerance_mm: f64,
}

/// A ray to be looked at on its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Probe {
    /// From a point along a vector, as far as it reaches, mm.
    Ray {
        /// Where it starts.
        source: DVec3,
        /// The way to its end.
        path: DVec3,
    },
    /// The ray of a pixel of the audit's views.
    Pixel {
        /// The view's place in the list.
        view: usize,
        /// The pixel's column.
        column: u32,
        /// The pixel's row.
        row: u32,
    },
}

/// Both answers to one ray in one organ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ProbeAnswer {
    /// The method's length, mm.
    pub method_mm: f64,
    /// The reference's length, mm.
    pub reference_mm: f64,
    /// Whether the method interpolated it.
    pub interpolated: bool,
    /// The depth of the cell that answered.
    pub cell_depth: Option<u32>,
    /// The ray.
    pub ray: Segment,
}

/// A scene made ready to be audited.
pub struct Audit<'a> {
    scene: &'a Scene,
    settings: AuditSettings,
    method: Box<dyn Finder + 'a>,
    against: Box<dyn Finder + 'a>,
    sums: Box<dyn Finder + 'a>,
    optics: Optics,
}

impl<'a> Audit<'a> {
    /// Prepares an audit of `scene`.
    ///
    /// # Errors
    /// A tolerance that is negative or not a number, lines for an engine that needs an image, no rays at all, an energy off a
    /// material's table.
    pub fn new(scene: &'a Scene, settings: AuditSettings) -> Result<Self> {
        let method = Box::new(ByMethod::new(bodies(scene), settings.method));
        let against: Box<dyn Finder + 'a> = match settings.against {
            Some(method) => Box::new(ByMethod::new(bodies(scene), method)),
            None => Box::new(Reference::new(bodies(scene))),
        };
        Self::with_finders(scene, settings, method, against)
    }

    /// As [`new`](Self::new), with other sources of lengths: faults are planted so.
    fn with_finders(
        scene: &'a Scene,
        settings: AuditSettings,
        method: Box<dyn Finder + 'a>,
        against: Box<dyn Finder + 'a>,
    ) -> Result<Self> {
        check(&settings)?;
        let optics = Optics::new(scene)?;
        let sums = Box::new(ByMethod::new(bodies(scene), Method::Exact(Some(Engine::Raster))));
        Ok(Self { scene, settings, method, against, sums, optics })
    }

    /// The settings.
    pub fn settings(&self) -> &AuditSettings {
        &self.settings
    }

    /// How many rays there are, all but those that cannot be aimed.
    pub fn rays(&self) -> u64 {
        match &self.settings.rays {
            RaySet::Views(views) => views.iter().map(View::pixels).sum(),
            RaySet::Random { rays, .. } => *rays,
            RaySet::Sample { lines, .. } => lines.len() as u64,
            RaySet::Adversarial { rays, .. } => rays * (Aim::ALL.len() * self.scene.organs.len()) as u64,
        }
    }

    /// Looks along all rays.
    ///
    /// # Errors
    /// [`Error::Interrupted`] within a batch's time of a request to stop.
    pub fn run(&self, control: &Control) -> Result<AuditReport> {
        let tolerances = self.tolerances();
        let comparison = self.comparison();
        let mut total = Ledger::new(self.scene.organs.len(), tolerances);
        let mut sections = Vec::new();
        match &self.settings.rays {
            RaySet::Views(views) => {
                for (i, view) in views.iter().enumerate() {
                    let ledger = comparison.view(i, view, control)?;
                    sections.push(SectionFigures::of_view(view, &ledger));
                    total += &ledger;
                }
            }
            set => {
                let lines = Lines::of(set, bodies(self.scene));
                for (lines, (name, blocks)) in
                    lines.iter().flat_map(|l| l.sections().into_iter().map(move |s| (l, s)))
                {
                    let ledger = comparison.lines(lines, blocks, control)?;
                    sections.push(SectionFigures::of_lines(name, &ledger, self.is_sampled()));
                    total += &ledger;
                }
            }
        }
        let mut report = AuditReport::new(self, total, sections);
        report.reference = self.reference_error(&report);
        Ok(report)
    }

    /// Both answers to a single ray in an organ: for a ray of the audit the same numbers, to the last bit.
    ///
    /// # Errors
    /// A ray without a direction, a pixel that is not there.
    pub fn probe(&self, organ: usize, probe: Probe) -> Result<ProbeAnswer> {
        let refuse = |what: &str, remedy: &str| Error::input("the ray to reproduce", what, remedy);
        let (ray, view) = match probe {
            Probe::Ray { source, path } => {
                let ray = Segment::along(source, path).ok_or_else(|| {
                    refuse("it has no direction, or is not finite", "give x,y,z,dx,dy,dz in mm")
                })?;
                (ray, None)
            }
            Probe::Pixel { view, column, row } => {
                let views: &[View] = if let RaySet::Views(views) = &self.settings.rays { views } else { &[] };
                let seen = views.get(view).filter(|v| column < v.size().0 && row < v.size().1);
                let seen =
                    seen.ok_or_else(|| refuse("there is no such pixel", "give view,column,row from 0"))?;
                (seen.segment(column, row), Some((seen, column, row)))
            }
        };
        let region = view.map(|(_, column, row)| Region { columns: column..column + 1, rows: row..row + 1 });
        let find = |finder: &dyn Finder| {
            let mut answers = Vec::new();
            let batch = Batch { rays: std::slice::from_ref(&ray), region: region.as_ref() };
            finder.ready(view.map(|(view, ..)| view)).find(organ, batch, &mut answers);
            answers.first().copied().unwrap_or_default()
        };
        let (method, against) = (find(&*self.method), find(&*self.against));
        Ok(ProbeAnswer {
            method_mm: method.length_mm,
            reference_mm: against.length_mm,
            interpolated: method.found == Found::Interpolated,
            cell_depth: self.method.depth(organ, &ray),
            ray,
        })
    }

    /// Rays that the reference is worth being recomputed for, by organ: the report's worst, and of the audit's first rays those
    /// that meet the organ, up to `each`.
    pub fn reference_sample(&self, report: &AuditReport, each: usize) -> Vec<(usize, Vec<Segment>)> {
        let first: Vec<Segment> = match &self.settings.rays {
            RaySet::Views(views) => views.iter().flat_map(|view| lattice(view, each)).collect(),
            set => {
                let lines = Lines::of(set, bodies(self.scene));
                let shots = lines.into_iter().flat_map(|lines| lines.block(0));
                shots.filter_map(|(source, path)| Segment::along(source, path)).collect()
            }
        };
        let of_organ = |(organ, it): (usize, &crate::scene::Organ)| {
            let worst = report.worst.iter().filter(|worst| worst.organ == it.name);
            let worst = worst.filter_map(|w| Segment::along(w.source_mm.into(), w.path_mm.into()));
            let mut parts = Vec::new();
            let mut meets = |ray: &&Segment| {
                it.body.chords_of_segment(ray, &mut parts);
                !parts.is_empty()
            };
            (organ, worst.chain(first.iter().filter(|ray| meets(ray)).take(each).copied()).collect())
        };
        self.scene.organs.iter().enumerate().map(of_organ).collect()
    }

    fn comparison(&self) -> Comparison<'_> {
        Comparison {
            scene: self.scene,
            method: &*self.method,
            against: &*self.against,
            sums: &*self.sums,
            optics: &self.optics,
            tolerances: self.tolerances(),
        }
    }

    fn tolerances(&self) -> Tolerances {
        Tolerances { length_mm: self.settings.tolerance_mm, transmission: TRANSMISSION_TOLERANCE }
    }

    /// Whether the rays are a random sample of all lines.
    fn is_sampled(&self) -> bool {
        matches!(self.settings.rays, RaySet::Random { .. } | RaySet::Sample { .. })
    }

    /// Where the audit's ray of an origin starts, and its way, mm.
    fn shot(&self, origin: Origin) -> Option<(DVec3, DVec3)> {
        match (origin, &self.settings.rays) {
            (Origin::Pixel { view, column, row }, RaySet::Views(views)) => {
                let rays = views.get(view)?.rays();
                let target = rays.point(column, row);
                let source = rays.start_of(target);
                Some((source, target - source))
            }
            (Origin::Line(line), set) => {
                let shots = Lines::of(set, bodies(self.scene))?.block(line / rays::BLOCK);
                shots.get((line % rays::BLOCK) as usize).copied()
            }
            _ => None,
        }
    }
}

/// The trees of the method that is judged.
impl KeepsTrees for Audit<'_> {
    fn save_trees(&self, out: &mut dyn io::Write) -> io::Result<()> {
        self.method.save_trees(out)
    }

    fn load_trees(&mut self, source: &mut dyn Source) -> Result<Loaded, Unreadable> {
        self.method.load_trees(source)
    }
}

/// At least `count` of a view's rays, if there are as many, evenly spread.
fn lattice(view: &View, count: usize) -> impl Iterator<Item = Segment> + '_ {
    let (columns, rows) = view.size();
    let step = ((view.pixels() as f64 / count.max(1) as f64).sqrt() as usize).max(1);
    let tops = (0..rows).step_by(step);
    tops.flat_map(move |row| (0..columns).step_by(step).map(move |column| view.segment(column, row)))
}

fn bodies(scene: &Scene) -> Vec<&Body> {
    scene.organs.iter().map(|organ| &organ.body).collect()
}

fn check(settings: &AuditSettings) -> Result<()> {
    if !(settings.tolerance_mm >= 0.0 && settings.tolerance_mm.is_finite()) {
        let problem = format!("{} mm is no tolerance", settings.tolerance_mm);
        return Err(Error::input("the audit's tolerance", problem, "give millimetres, 0 or more"));
    }
    let rays = match &settings.rays {
        RaySet::Views(views) => views.len() as u64,
        RaySet::Sample { lines, .. } => lines.len() as u64,
        RaySet::Random { rays, .. } | RaySet::Adversarial { rays, .. } => *rays,
    };
    if rays == 0 {
        return Err(Error::input("the audit", "has no rays", "give views, or a number of rays of 1 or more"));
    }
    let is_raster = |method: &Method| *method == Method::Exact(Some(Engine::Raster));
    let needs_image = is_raster(&settings.method) || settings.against.as_ref().is_some_and(is_raster);
    if needs_image && !matches!(settings.rays, RaySet::Views(_)) {
        return Err(Error::input(
            "the raster engine",
            "finds lengths along the rays of an image, not along single lines",
            "audit views, or name another method",
        ));
    }
    Ok(())
}
