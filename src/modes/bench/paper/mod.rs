//! The paper's Tables 1 and 2 and Figures 5 to 8 on this machine, beside the paper's own figures.
//!
//! ```text
//!   plan ─► for each sweep of one setting: ─► counted run: operations, error, memory, nodes ─┐
//!           rays traced one by one, and         rounds of timed runs, in turns: CPU speed-up ─┼─► rows ─► direction
//!           trees at each value                                     published ────────────────┘
//! ```
//!
//! Speed-ups are against tracing every ray, sampling included, as in the paper (§3.2). A sweep is one race, so that
//! whatever slows the machine slows all its settings; a speed-up is the median of those of the rounds.

pub mod direction;
mod input;
mod plan;
mod published;
mod report;

pub use direction::{Claim, Verdict};
pub use input::Input;
pub use plan::Dial;
pub use published::Published;
pub use report::{Exact, PaperReport, Row, SpeedUp, Sweep};

use super::race::race;
use super::{Machine, Patience, Program, Samples};
use crate::error::{Error, Result};
use crate::geometry::Counted;
use crate::modes::Control;
use crate::modes::raytrace::{Tracing, Trees};
use input::{Outcome, Subject};
use plan::{PLANS, Plan};

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct PaperSettings {
    /// The test inputs.
    pub inputs: Vec<Input>,
    /// How long each sweep may take.
    pub patience: Patience,
    /// Only a few values of each setting.
    pub quick: bool,
    /// The pictures' sides as a share of the paper's.
    pub scale: f64,
}

/// Pictures have so many columns and rows at least.
const LEAST_SIDE: f64 = 4.0;

impl PaperSettings {
    /// Whether they serve.
    ///
    /// # Errors
    /// A scale that is not over 0 and at most 4; fewer than two rounds, the first of which counts and warms up.
    pub fn check(&self) -> Result<()> {
        if !(self.scale > 0.0 && self.scale <= 4.0) {
            return Err(Error::input(
                "the scale",
                format!("{} does not serve", self.scale),
                "give a share of the paper's pictures, over 0 and at most 4",
            ));
        }
        if self.patience.rounds < 2 {
            return Err(Error::input("the rounds", "are too few for a median", "give 2 or more"));
        }
        Ok(())
    }

    fn plans(&self) -> impl Iterator<Item = &'static Plan> {
        let is_wanted =
            |plan: &&Plan| self.inputs.contains(&plan.input) && !plan.settings(self.quick).is_empty();
        PLANS.iter().filter(is_wanted)
    }

    fn size(&self, plan: &Plan) -> [u32; 2] {
        let side = |n: u32| (f64::from(n) * self.scale).round().max(LEAST_SIDE) as u32;
        plan.input.picture().0.map(side)
    }
}

/// How many turns [`paper`] takes at most, for its progress.
pub fn turns(settings: &PaperSettings) -> u64 {
    let of = |plan: &Plan| (plan.settings(settings.quick).len() + 1) * (settings.patience.rounds + 1);
    settings.plans().map(of).sum::<usize>() as u64
}

/// Runs all sweeps. An interruption ends them with what there is.
///
/// # Errors
/// Settings that do not serve, a scene that cannot be made.
pub fn paper(settings: &PaperSettings, control: &Control) -> Result<PaperReport> {
    settings.check()?;
    let mut report = PaperReport {
        program: Program::THIS,
        command: String::new(),
        machine: Machine::this(),
        quick: settings.quick,
        scale: settings.scale,
        sweeps: Vec::new(),
        complete: true,
    };
    for plan in settings.plans() {
        let mut sweep = Sweep::of(plan, settings.size(plan));
        let ended = measure(plan, settings, control, &mut sweep);
        if !sweep.rows.is_empty() {
            sweep.judge();
            report.sweeps.push(sweep);
        }
        match ended {
            Err(Error::Interrupted) => {
                report.complete = false;
                break;
            }
            other => other?,
        }
    }
    Ok(report)
}

/// One sweep: rays traced exactly are the first contender, trees at each value the others. The round that warms up is the
/// one in which operations are counted and errors found.
fn measure(plan: &Plan, settings: &PaperSettings, control: &Control, sweep: &mut Sweep) -> Result<()> {
    control.check()?;
    let mut subject = plan.input.subject(sweep.size)?;
    let dials = plan.settings(settings.quick);
    let tracing = |contender: usize| match contender.checked_sub(1) {
        None => Tracing::Exact,
        Some(i) => Tracing::RiTree(dials[i].1),
    };
    let mut reference: Option<Outcome> = None;
    let mut counted = 0;
    let results = race(1 + dials.len(), settings.patience, control, |contender| {
        if counted <= dials.len() {
            let outcome = count(&mut subject, plan, tracing(contender), control)?;
            counted += 1;
            match &reference {
                None => {
                    sweep.exact.operations = outcome.operations;
                    reference = Some(outcome);
                }
                Some(exact) => sweep.rows.push(row(plan, dials[contender - 1], &outcome, exact)),
            }
            return Ok([0.0]);
        }
        subject.run::<f64>(tracing(contender), control).map(|outcome| [outcome.seconds])
    })?;
    sweep.exact.time = timed(&results.times[0][0]);
    for (row, [own]) in sweep.rows.iter_mut().zip(&results.times[1..]) {
        row.time = timed(own);
        row.cpu_speed_up = SpeedUp::of(&results.times[0][0].ratios_to(own));
    }
    if results.interrupted { Err(Error::Interrupted) } else { Ok(()) }
}

fn timed(samples: &Samples) -> Option<super::Times> {
    (!samples.0.is_empty()).then(|| samples.times())
}

fn count(subject: &mut Subject, plan: &Plan, tracing: Tracing, control: &Control) -> Result<Outcome> {
    // Where caches are too small by far, counting would take minutes, and the paper's Figure 8 shows time.
    if plan.input.counts_operations() && plan.dial != Dial::CacheSize {
        subject.run::<Counted>(tracing, control)
    } else {
        subject.run::<f64>(tracing, control)
    }
}

fn row(plan: &Plan, (value, trees): (f64, Trees), outcome: &Outcome, exact: &Outcome) -> Row {
    let views = outcome.views.max(1) as f64;
    let is_counted = outcome.operations > 0;
    let published = (plan.dial != Dial::CacheSize).then(|| Published::find(plan.input, &trees.parameters));
    Row {
        value,
        trees,
        flop_speed_up: is_counted.then(|| exact.operations as f64 / outcome.operations as f64),
        cpu_speed_up: None,
        time: None,
        error: outcome.error(exact),
        memory_mb: outcome.tree_bytes as f64 / views / 1e6,
        nodes: outcome.build.cells() as f64 / views,
        samples: outcome.build.samples_taken as f64 / views,
        interpolated: outcome.interpolated as f64 / outcome.queries.max(1) as f64,
        prunes: outcome.build.prunes as f64 / views,
        published: published.flatten(),
    }
}

/// The inputs' names, for the command line.
pub fn input_named(name: &str) -> Option<Input> {
    Input::ALL.into_iter().find(|input| input.name() == name)
}

#[cfg(test)]
mod tests;
