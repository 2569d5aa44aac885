//! The judge judged: the f64 reference against the same lengths without rounding.

use rayon::prelude::*;
use serde::Serialize;

use super::{Audit, AuditReport};
use crate::exact::{Body, Engine};
use crate::modes::project::Method;
use crate::modes::reference::{ReferenceFigures, RoundingFigures};

/// Rays recomputed for each organ, besides the worst.
const RAYS_PER_ORGAN: usize = 16;

/// The error of the f64 reference itself, on a sample of rays recomputed in rationals: the worst, and some that meet each
/// organ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct ReferenceError {
    /// Lengths recomputed.
    pub lengths: u64,
    /// Of those, met by one of the two only.
    pub met_by_one: u64,
    /// The mean error, units in the last place of the length.
    pub mean_ulps: f64,
    /// The largest. Short chords far from the source have large ones.
    pub max_ulps: f64,
    /// The mean error, units in the last place of the distance from the source to the chord's far end.
    pub mean_ulps_of_distance: f64,
    /// The largest.
    pub max_ulps_of_distance: f64,
    /// The largest, mm.
    pub max_mm: f64,
}

impl ReferenceError {
    fn of(organs: &[RoundingFigures]) -> Option<Self> {
        let lengths: u64 = organs.iter().map(|organ| organ.compared).sum();
        let mean = |of: fn(&RoundingFigures) -> f64| {
            organs.iter().map(|organ| organ.compared as f64 * of(organ)).sum::<f64>() / lengths as f64
        };
        let max = |of: fn(&RoundingFigures) -> f64| organs.iter().map(of).fold(0.0, f64::max);
        (lengths > 0).then(|| Self {
            lengths,
            met_by_one: organs.iter().map(|organ| organ.met_by_one).sum(),
            mean_ulps: mean(|f| f.mean_ulps),
            max_ulps: max(|f| f.max_ulps),
            mean_ulps_of_distance: mean(|f| f.mean_ulps_of_distance),
            max_ulps_of_distance: max(|f| f.max_ulps_of_distance),
            max_mm: max(|f| f.max_mm),
        })
    }
}

impl Audit<'_> {
    /// Recomputes a sample of the report's lengths. `None` if they were not found by an engine for single rays.
    pub(super) fn reference_error(&self, report: &AuditReport) -> Option<ReferenceError> {
        let chosen = match self.settings.against {
            None => Engine::Clip,
            Some(Method::Exact(Some(engine))) if engine != Engine::Raster => engine,
            Some(_) => return None,
        };
        let engine = |body: &Body| if chosen.serves(body) { chosen } else { Engine::Bvh };
        let of_organ = |(organ, rays): (usize, Vec<_>)| {
            let body = &self.scene.organs[organ].body;
            let figures = ReferenceFigures::measure(body, engine(body), &rays);
            figures.against_planes.unwrap_or(figures.against_triangles)
        };
        let organs: Vec<RoundingFigures> =
            self.reference_sample(report, RAYS_PER_ORGAN).into_par_iter().map(of_organ).collect();
        ReferenceError::of(&organs)
    }
}
