//! Where an audit's errors are entered: by organ, by kind, by zone, by distance from the outline.
//!
//! Ledgers are filled by one thread each and merged in order: the same bits for any number of threads.

use std::ops::AddAssign;

use super::outline;
use super::worst::WorstList;
use crate::modes::figures::Tally;
use crate::modes::project::Found;

/// Where a ray passes an organ.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Zone {
    Interior,
    Silhouette,
}

/// What errors are held against.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Tolerances {
    pub length_mm: f64,
    pub transmission: f64,
}

/// Errors of one kind, in length and in transmission.
#[derive(Clone, Debug)]
pub(super) struct KindLedger {
    pub length_mm: Tally,
    pub transmission: Tally,
}

impl KindLedger {
    fn new(tolerances: Tolerances) -> Self {
        Self {
            length_mm: Tally::new(tolerances.length_mm),
            transmission: Tally::new(tolerances.transmission),
        }
    }

    pub fn add(&mut self, error_mm: f64, reference_mm: f64, [change, transmission]: [f64; 2]) {
        self.length_mm.add(error_mm, reference_mm);
        self.transmission.add(change, transmission);
    }
}

impl AddAssign<&Self> for KindLedger {
    fn add_assign(&mut self, other: &Self) {
        self.length_mm += &other.length_mm;
        self.transmission += &other.transmission;
    }
}

/// One organ's errors.
#[derive(Clone, Debug)]
pub(super) struct OrganLedger {
    /// Of the method against the reference.
    pub method: KindLedger,
    /// The same by how they were found, interpolated or traced, and by zone, interior or silhouette.
    pub parts: [[Tally; 2]; 2],
    /// Of sums along an image's rays against the reference.
    pub accumulation: KindLedger,
    /// Of the reference on the mesh against the closed form.
    pub mesh: KindLedger,
    /// Of the method against the closed form: all there is between the answer and the shape.
    pub total: KindLedger,
}

impl OrganLedger {
    pub fn new(tolerances: Tolerances) -> Self {
        let kind = KindLedger::new(tolerances);
        let tally = || Tally::new(tolerances.length_mm);
        Self {
            method: kind.clone(),
            parts: [[tally(), tally()], [tally(), tally()]],
            accumulation: kind.clone(),
            mesh: kind.clone(),
            total: kind,
        }
    }

    /// The tally of a part.
    pub fn part(&mut self, found: Found, zone: Zone) -> &mut Tally {
        &mut self.parts[usize::from(found != Found::Interpolated)][usize::from(zone == Zone::Silhouette)]
    }
}

impl AddAssign<&Self> for OrganLedger {
    fn add_assign(&mut self, other: &Self) {
        self.method += &other.method;
        self.accumulation += &other.accumulation;
        self.mesh += &other.mesh;
        self.total += &other.total;
        let others = other.parts.iter().flatten();
        self.parts.iter_mut().flatten().zip(others).for_each(|(part, other)| *part += other);
    }
}

/// All errors of some rays.
#[derive(Clone, Debug)]
pub(super) struct Ledger {
    tolerances: Tolerances,
    pub rays: u64,
    /// Traced lengths that differ from the reference's, but by no more than rounding may.
    pub decided_by_rounding: u64,
    /// Organs that no ray has met have none.
    organs: Vec<Option<Box<OrganLedger>>>,
    /// Of the whole ray's transmission, all organs' errors together.
    pub transmission: Tally,
    /// Of lengths, by distance from the outline: see [`outline::BINS`].
    pub by_distance: Vec<Tally>,
    pub worst: WorstList,
}

impl Ledger {
    pub fn new(organs: usize, tolerances: Tolerances) -> Self {
        Self {
            tolerances,
            rays: 0,
            decided_by_rounding: 0,
            organs: (0..organs).map(|_| None).collect(),
            transmission: Tally::new(tolerances.transmission),
            by_distance: vec![Tally::new(tolerances.length_mm); outline::BINS],
            worst: WorstList::default(),
        }
    }

    /// The ledger of an organ, opened if need be.
    pub fn organ(&mut self, organ: usize) -> &mut OrganLedger {
        let tolerances = self.tolerances;
        self.organs[organ].get_or_insert_with(|| Box::new(OrganLedger::new(tolerances)))
    }

    /// The organs that were met, by index.
    pub fn organs(&self) -> impl Iterator<Item = (usize, &OrganLedger)> {
        self.organs.iter().enumerate().filter_map(|(i, organ)| Some((i, organ.as_deref()?)))
    }

    /// All organs' errors together.
    pub fn whole(&self) -> OrganLedger {
        let mut whole = OrganLedger::new(self.tolerances);
        self.organs().for_each(|(_, organ)| whole += organ);
        whole
    }
}

impl AddAssign<&Self> for Ledger {
    fn add_assign(&mut self, other: &Self) {
        self.rays += other.rays;
        self.decided_by_rounding += other.decided_by_rounding;
        for (i, organ) in other.organs() {
            *self.organ(i) += organ;
        }
        self.transmission += &other.transmission;
        self.by_distance.iter_mut().zip(&other.by_distance).for_each(|(bin, other)| *bin += other);
        self.worst += &other.worst;
    }
}
