//! Run time against error, on the user's own scene and machine.
//!
//! ```text
//!   contenders ─► race: turns, round by round ─► Samples ─► Times    median and spread, cold and warm
//!       │                                                     │
//!       └──────► audit of the same rays ─► Figures ───────────┴─► rows ─► which are on the front, what to use
//! ```
//!
//! *Cold* is from a scene just read to all lengths of all views: trees and whatever an engine makes ready are part of it.
//! *Warm* is the same views once more. Contenders take turns, so that whatever slows the machine slows them all; times are
//! medians, and told to be unsteady where they are.

pub mod choice;
pub mod curve;
mod machine;
pub mod paper;
mod race;
mod samples;
pub mod scale;

use std::time::Instant;

use serde::Serialize;

pub use machine::Machine;
pub use race::{LEAST_ROUNDS, Patience};
pub use samples::{Samples, Times};

use crate::error::Result;
use crate::exact::Engine;
use crate::modes::Control;
use crate::modes::project::{Interpolation, Method, Projector, TreeSettings, Wanted};
use crate::ritree::Parameters;
use crate::scene::{Scene, View};

/// Errors below this are rounding: methods that make no larger ones are called exact, mm.
pub const EXACT_BELOW_MM: f64 = 1e-6;

/// A way to find lengths that takes part.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Contender {
    /// The method with its settings.
    pub method: Method,
    /// The setting by which it differs from others of its kind.
    pub dial: Option<Dial>,
}

/// A setting and its value.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Dial {
    /// The option that sets it, without dashes.
    pub option: &'static str,
    /// Its value.
    pub value: f64,
}

impl Contender {
    /// An exact method; by the quickest engine for each organ if none is named.
    pub fn exact(engine: Option<Engine>) -> Self {
        Self { method: Method::Exact(engine), dial: None }
    }

    /// The paper's trees at a distance threshold.
    pub fn paper(distance_threshold: f64) -> Self {
        let parameters = Parameters { distance_threshold, ..Parameters::default() };
        let interpolation = Interpolation::Quadrilinear { parameters };
        Self {
            method: Method::RiTree(TreeSettings { interpolation, ..TreeSettings::default() }),
            dial: Some(Dial { option: "distance-threshold", value: distance_threshold }),
        }
    }

    /// Trees of squared chords that keep to a tolerance, mm.
    pub fn tolerance(tolerance_mm: f64) -> Self {
        let interpolation = Interpolation::SquaredChord { tolerance_mm };
        Self {
            method: Method::RiTree(TreeSettings { interpolation, ..TreeSettings::default() }),
            dial: Some(Dial { option: "tolerance", value: tolerance_mm }),
        }
    }

    /// The options that choose it.
    pub fn options(&self) -> String {
        let dial = self.dial.map(|dial| format!(" --{} {}", dial.option, dial.value)).unwrap_or_default();
        let interpolation = match self.method {
            Method::RiTree(TreeSettings { interpolation: Interpolation::Quadrilinear { .. }, .. }) => {
                " --interpolation quadrilinear"
            }
            _ => "",
        };
        format!("--method {}{interpolation}{dial}", self.method.name())
    }
}

/// Only lengths are measured: what the methods differ in.
const LENGTHS: Wanted = Wanted { lengths: true, attenuation: false, colour: false };

/// What projecting some views took.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    /// Seconds from the scene as read to the last length.
    cold: f64,
    /// Seconds for the same views again.
    warm: f64,
    /// Bytes of trees at the end.
    tree_bytes: usize,
    /// Cells of trees looked at, cold and warm.
    cells: u64,
}

/// Projects the views cold and warm.
fn run(scene: &mut Scene, method: Method, views: &[View], control: &Control) -> Result<Run> {
    scene.organs.iter_mut().for_each(|organ| organ.body.forget_engines());
    let quiet = control.without_progress();
    let start = Instant::now();
    let projector = Projector::new(scene, LENGTHS, None, method)?;
    let project =
        || -> Result<()> { views.iter().try_for_each(|view| projector.project(view, 0, &quiet).map(drop)) };
    project()?;
    let cold = start.elapsed().as_secs_f64();
    let start = Instant::now();
    project()?;
    let warm = start.elapsed().as_secs_f64();
    let forest = projector.forest().unwrap_or_default();
    Ok(Run { cold, warm, tree_bytes: forest.tree_bytes, cells: forest.build.cells() })
}

/// The program, as reports name it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Program {
    /// Its name.
    pub program: &'static str,
    /// Its version.
    pub version: &'static str,
}

impl Program {
    /// This one.
    pub const THIS: Self = Self { program: "chordfield", version: env!("CARGO_PKG_VERSION") };
}

/// A number to two digits.
fn two_digits(value: f64) -> String {
    digits(value, 2)
}

/// A number to so many digits, none of them a power of ten's.
fn digits(value: f64, count: i32) -> String {
    let decimals = (count - 1 - value.abs().max(1e-9).log10().floor() as i32).clamp(0, 9);
    format!("{value:.*}", decimals as usize)
}
