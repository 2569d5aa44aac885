//! The rays that came out worst.

use std::ops::AddAssign;

use serde::Serialize;

use super::compare::rounding_shift_mm;
use super::{Audit, RaySet};
use crate::exact::Body;
use crate::exact::judge::length_in_parallel_body;
use crate::geometry::Segment;
use crate::modes::project::Found;

/// How many are kept.
pub(super) const KEPT: usize = 100;

/// Where a ray of an audit comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Origin {
    /// A pixel: view, column, row.
    Pixel { view: usize, column: u32, row: u32 },
    /// The so-manieth line.
    Line(u64),
}

/// A ray and an organ whose length is off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Suspect {
    pub organ: usize,
    pub origin: Origin,
    pub ray: Segment,
    pub method_mm: f64,
    pub reference_mm: f64,
    pub found: Found,
}

impl Suspect {
    /// The magnitude of the error, mm; infinite if it is not a number.
    pub fn magnitude(&self) -> f64 {
        let error = (self.method_mm - self.reference_mm).abs();
        if error.is_nan() { f64::INFINITY } else { error }
    }

    /// Worst first; equals by origin, then by organ: the order does not depend on who found them.
    fn order(&self, other: &Self) -> std::cmp::Ordering {
        let by_magnitude = other.magnitude().total_cmp(&self.magnitude());
        by_magnitude.then(self.origin.cmp(&other.origin)).then(self.organ.cmp(&other.organ))
    }
}

/// The worst of all that was entered.
#[derive(Clone, Debug, Default)]
pub(super) struct WorstList {
    suspects: Vec<Suspect>,
    /// What is smaller is not among the worst.
    threshold: f64,
}

impl WorstList {
    /// Whether an error of this magnitude may be among the worst.
    pub fn wants(&self, magnitude: f64) -> bool {
        magnitude > 0.0 && magnitude >= self.threshold
    }

    pub fn add(&mut self, suspect: Suspect) {
        if !self.wants(suspect.magnitude()) {
            return;
        }
        self.suspects.push(suspect);
        if self.suspects.len() >= 2 * KEPT {
            self.trim();
        }
    }

    fn trim(&mut self) {
        self.suspects.sort_unstable_by(Suspect::order);
        self.suspects.truncate(KEPT);
        if self.suspects.len() == KEPT {
            self.threshold = self.suspects[KEPT - 1].magnitude();
        }
    }

    /// Worst first.
    pub fn sorted(mut self) -> Vec<Suspect> {
        self.trim();
        self.suspects
    }
}

impl AddAssign<&Self> for WorstList {
    fn add_assign(&mut self, other: &Self) {
        other.suspects.iter().for_each(|suspect| self.add(*suspect));
    }
}

/// One of the worst rays.
#[derive(Clone, Debug, Serialize)]
pub struct WorstRay {
    /// From 1.
    pub rank: usize,
    /// The organ.
    pub organ: String,
    /// The method's length less the reference's, mm.
    pub error_mm: f64,
    /// The method's length, mm.
    pub method_mm: f64,
    /// The reference's, mm.
    pub reference_mm: f64,
    /// `interpolated` or `traced`.
    pub found: &'static str,
    /// The depth of the tree's cell that answered.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub cell_depth: Option<u32>,
    /// By how much the length changes if all planes of a convex body move out, or in, by as much as rounding may move
    /// them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub rounding_mm: Option<f64>,
    /// The view, or where lines come from.
    pub place: String,
    /// View (from 0), column and row, if it is a pixel's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub pixel: Option<[u32; 3]>,
    /// Where it starts, patient LPS, mm.
    pub source_mm: [f64; 3],
    /// The way to its end, mm.
    pub path_mm: [f64; 3],
    /// The arguments that find it again.
    pub reproduce: String,
}

/// See [`WorstRay::rounding_mm`].
fn rounding_mm(body: &Body, ray: &Segment) -> Option<f64> {
    let mesh = body.convexity().ok()?;
    let shift_mm = rounding_shift_mm(body, ray);
    Some(length_in_parallel_body(mesh, ray, shift_mm) - length_in_parallel_body(mesh, ray, -shift_mm))
}

/// The worst rays as a report tells of them.
pub(super) fn rays(audit: &Audit, suspects: Vec<Suspect>) -> Vec<WorstRay> {
    let ranked = suspects.into_iter().enumerate();
    ranked.filter_map(|(i, suspect)| worst_ray(audit, i + 1, &suspect)).collect()
}

fn worst_ray(audit: &Audit, rank: usize, suspect: &Suspect) -> Option<WorstRay> {
    let (source, path) = audit.shot(suspect.origin)?;
    let organ = &audit.scene.organs[suspect.organ].name;
    let pixel = match suspect.origin {
        Origin::Pixel { view, column, row } => Some([view as u32, column, row]),
        Origin::Line(_) => None,
    };
    let place = match (suspect.origin, &audit.settings().rays) {
        (Origin::Pixel { view, .. }, RaySet::Views(views)) => views.get(view)?.label(),
        (Origin::Line(line), _) => format!("line {line}"),
        _ => String::new(),
    };
    // An image's engine sees a vertex as the image rounds it: its pixels are found again in the image.
    let needs_image = audit.method.needs_image(suspect.organ) || audit.against.needs_image(suspect.organ);
    let ray = match pixel.filter(|_| needs_image) {
        Some([view, column, row]) => format!("--pixel {view},{column},{row}"),
        None => format!("--ray={},{},{},{},{},{}", source.x, source.y, source.z, path.x, path.y, path.z),
    };
    Some(WorstRay {
        rank,
        organ: organ.clone(),
        error_mm: suspect.method_mm - suspect.reference_mm,
        method_mm: suspect.method_mm,
        reference_mm: suspect.reference_mm,
        found: if suspect.found == Found::Interpolated { "interpolated" } else { "traced" },
        cell_depth: audit.method.depth(suspect.organ, &suspect.ray),
        rounding_mm: rounding_mm(&audit.scene.organs[suspect.organ].body, &suspect.ray),
        place,
        pixel,
        source_mm: source.to_array(),
        path_mm: path.to_array(),
        reproduce: format!("{ray} --organ {}", shell_word(organ)),
    })
}

/// A word as a shell takes it.
pub fn shell_word(word: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_.,:=/+".contains(c);
    if !word.is_empty() && word.chars().all(is_plain) {
        return word.into();
    }
    format!("'{}'", word.replace('\'', r"'\''"))
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn the_worst_are_the_same_in_whatever_order_they_come() {
        let ray = Segment::along(DVec3::ZERO, DVec3::X).expect("a ray");
        let suspect = |i: u64| Suspect {
            organ: 0,
            origin: Origin::Line(i),
            ray,
            // Each error comes seven times, so that the list is cut among equals.
            method_mm: (i / 7 % 100) as f64,
            reference_mm: 0.0,
            found: Found::Interpolated,
        };
        let worst = |order: &mut dyn Iterator<Item = u64>| {
            let mut parts = [WorstList::default(), WorstList::default()];
            order.for_each(|i| parts[(i % 3 == 0) as usize].add(suspect(i)));
            let [mut whole, other] = parts;
            whole += &other;
            whole.sorted().iter().map(|s| (s.magnitude(), s.origin)).collect::<Vec<_>>()
        };
        let forward = worst(&mut (0..5_000));
        assert_eq!(forward, worst(&mut (0..5_000).rev()));
        assert_eq!((forward.len(), forward[0].0), (KEPT, 99.0));
        assert!(forward.windows(2).all(|w| w[0].0 >= w[1].0));
    }
}
