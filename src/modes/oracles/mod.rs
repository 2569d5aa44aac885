//! Oracles: what lengths must satisfy, whatever finds them. None needs a second engine to compare with.
//!
//! ```text
//!             ┌─ identities: the same question asked in another way ─── reversal, rotation, translation, scaling, affine map
//!   witness ◀─┼─ integrals: many answers that add up to a number ────── volumes from both sides and from a point, Crofton
//!    lengths  └─ bodies: answers for bodies that contain each other ─── split bodies, inclusion, own lengths
//! ```
//!
//! Identities are held ray by ray to what rounding may do there: how far engine, map and vertices may have moved the surface,
//! times the cosecants at which the ray pierces it. Integrals are taken over lattices with random offsets, which have
//! no bias, and held to standard errors. Interpolated lengths are held to the tree's own promise, in the mean over rays.

mod beams;
mod bodies;
mod bounds;
mod identities;
mod integrals;
#[cfg(test)]
mod tests;
mod verdict;
mod witness;

use rayon::prelude::*;

use super::Control;
use super::project::Method;
use crate::error::Result;
use crate::exact::Body;
use crate::scene::Scene;

pub use beams::{Random, Rays};
pub use verdict::{Outcome, Verdict, table};
pub use witness::{MethodWitness, Witness};

/// How much is asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Size {
    /// Pixels along each side of an image.
    pub pixels: u32,
    /// Random lines of the lists and of Cauchy and Crofton's means.
    pub lines: usize,
    /// Directions for volumes, each seen from both sides.
    pub directions: usize,
}

impl Default for Size {
    /// Some million rays for each organ.
    fn default() -> Self {
        Self { pixels: 48, lines: 20_000, directions: 3 }
    }
}

impl Size {
    /// What it takes to try a method: some million rays for each organ, or a tenth of that for trees. Their promise is hundreds
    /// of times as wide as what chance adds to a mean of so few, and each ray in a direction of its own grows them anew.
    pub fn of(method: Method) -> Self {
        match method {
            Method::Exact(_) => Self::default(),
            Method::RiTree(_) | Method::Auto(_) => Self { pixels: 24, lines: 4_000, directions: 1 },
        }
    }
}

/// Asks a witness about bodies and scenes.
pub struct Oracles<'a> {
    witness: &'a dyn Witness,
    size: Size,
    seed: u64,
}

impl<'a> Oracles<'a> {
    /// Holds `method` to all oracles that apply, over every organ of `scene`; in the order of organs, the whole scene last.
    /// The same for any number of threads.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::Error::Interrupted) within an organ's time of a request to stop.
    pub fn run(
        scene: &Scene,
        method: Method,
        seed: u64,
        size: Size,
        control: &Control,
    ) -> Result<Vec<Verdict>> {
        let witness = MethodWitness::new(method);
        let oracles = Oracles::new(&witness, seed, size);
        let of_organs: Vec<Vec<Verdict>> = scene
            .organs
            .par_iter()
            .map(|organ| {
                control.check()?;
                let mut verdicts = oracles.question(&organ.name, &organ.body);
                let parent = organ.parent.map(|parent| &scene.organs[parent]);
                verdicts.extend(parent.map(|parent| bodies::nesting(&oracles, organ, parent)));
                control.advance(1);
                Ok(verdicts)
            })
            .collect::<Result<_>>()?;
        control.check()?;
        let mut verdicts: Vec<Verdict> = of_organs.into_iter().flatten().collect();
        verdicts.extend(bodies::own_lengths(&oracles, scene));
        Ok(verdicts)
    }

    /// Oracles that ask `witness`.
    pub fn new(witness: &'a dyn Witness, seed: u64, size: Size) -> Self {
        let size = Size {
            pixels: size.pixels.max(8),
            lines: size.lines.max(64),
            directions: size.directions.max(1),
        };
        Self { witness, seed, size }
    }

    /// All verdicts on one body on its own, called `subject`.
    pub fn question(&self, subject: &str, body: &Body) -> Vec<Verdict> {
        let mut verdicts = identities::all(self, subject, body);
        verdicts.extend(integrals::all(self, subject, body));
        verdicts.extend(bodies::all(self, subject, body));
        verdicts
    }

    /// Random numbers for one subject and oracle.
    fn random(&self, subject: &str, oracle: &str) -> Random {
        Random::new(self.seed, &[subject, oracle])
    }
}
