//! The rays that came out worst.

use std::ops::AddAssign;

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
