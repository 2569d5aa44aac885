//! What the sweeps found, and what it says about the paper's curves.

use serde::Serialize;

use super::direction::{Series, Way, knee, peak, trend};
use super::plan::Plan;
use super::{Dial, Input, Published, Verdict};
use crate::modes::bench::{Machine, Program, Samples, Times};
use crate::modes::raytrace::Trees;

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct PaperReport {
    /// The program.
    #[serde(flatten)]
    pub program: Program,
    /// The command line; set by whoever knows it.
    pub command: String,
    /// Where it was measured.
    pub machine: Machine,
    /// Whether only a few values were measured.
    pub quick: bool,
    /// The pictures' sides as a share of the paper's.
    pub scale: f64,
    /// The sweeps, in the order of the paper's figures and tables.
    pub sweeps: Vec<Sweep>,
    /// Whether all that was to be measured was; not so after an interruption.
    pub complete: bool,
}

/// One setting varied on one input.
#[derive(Clone, Debug, Serialize)]
pub struct Sweep {
    /// What is rendered.
    pub input: Input,
    /// What is varied.
    pub dial: Dial,
    /// Where the paper shows it.
    pub place: &'static str,
    /// Columns and rows of the pictures.
    pub size: [u32; 2],
    /// Rays per pixel.
    pub samples: u32,
    /// What errors are a mean of.
    pub error_unit: &'static str,
    /// Every ray traced.
    pub exact: Exact,
    /// The values measured.
    pub rows: Vec<Row>,
    /// Whether the paper's direction is found again. None if too little was measured to say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub verdict: Option<Verdict>,
    /// How many of the rows that the paper has are at least as good as the paper's, in a sentence.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub beside_the_paper: Option<String>,
}

/// What tracing every ray takes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct Exact {
    /// Its times. None if it was interrupted before.
    pub time: Option<Times>,
    /// Its floating-point operations; 0 if they were not counted.
    pub operations: u64,
}

/// Trees at one value of the setting.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Row {
    /// The value.
    pub value: f64,
    /// All settings.
    pub trees: Trees,
    /// Operations of tracing every ray over those with trees. None if they were not counted.
    pub flop_speed_up: Option<f64>,
    /// Seconds likewise. None if it was interrupted before.
    pub cpu_speed_up: Option<SpeedUp>,
    /// Seconds with trees, all views. None if it was interrupted before.
    pub time: Option<Times>,
    /// The mean error.
    pub error: f64,
    /// The share of questions that trees answered by interpolation, 0 to 1; other rays are traced and have no error.
    pub interpolated: f64,
    /// Nodes and samples at the end, MB of 10⁶ bytes, mean of the views.
    pub memory_mb: f64,
    /// Cells looked at, mean of the views: a node each, but where the cache is too small the same ones again.
    pub nodes: f64,
    /// Lines sampled, likewise.
    pub samples: f64,
    /// How often old leaves were forgotten, likewise.
    pub prunes: f64,
    /// The paper's figures.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub published: Option<Published>,
}

impl Row {
    /// The mean error of what is interpolated. `None` where nothing is.
    fn error_of_interpolated(&self) -> Option<f64> {
        (self.interpolated > 0.0).then(|| self.error / self.interpolated)
    }
}

/// A ratio of times over rounds.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct SpeedUp {
    /// The median.
    pub median: f64,
    /// Half the distance between the quartiles, as a share of the median.
    pub spread: f64,
    /// Whether the spread is over a tenth.
    pub unsteady: bool,
}

impl SpeedUp {
    /// Of the rounds' ratios. `None` of none.
    pub fn of(ratios: &Samples) -> Option<Self> {
        let times = ratios.times();
        (times.rounds > 0).then_some(Self {
            median: times.seconds,
            spread: times.spread,
            unsteady: times.unsteady,
        })
    }
}

/// The row at one value has a figure, or has not.
type Figure<T> = fn(&T) -> Option<f64>;

impl Sweep {
    /// A sweep of which nothing is measured yet.
    pub(super) fn of(plan: &Plan, size: [u32; 2]) -> Self {
        Self {
            input: plan.input,
            dial: plan.dial,
            place: plan.place,
            size,
            samples: plan.input.picture().1,
            error_unit: plan.input.error_unit(),
            exact: Exact::default(),
            rows: Vec::new(),
            verdict: None,
            beside_the_paper: None,
        }
    }

    /// Says what the rows say.
    pub(super) fn judge(&mut self) {
        let error = self.series("error", |row| Some(row.error), |paper| Some(paper.error));
        let of_interpolated =
            self.series("error over the share interpolated", Row::error_of_interpolated, |_| None);
        let cpu = self.series("CPU speed-up", |row| Some(row.cpu_speed_up?.median), |p| Some(p.cpu_speed_up));
        let flop = self.series("FLOP speed-up", |row| row.flop_speed_up, |p| Some(p.flop_speed_up));
        let memory = self.series("memory in MB", |row| Some(row.memory_mb), |paper| paper.memory_mb);
        // Operations do not depend on what else the machine does.
        let speed_up = if flop.ours.len() > 1 { &flop } else { &cpu };
        let claims = match self.dial {
            Dial::DistanceThreshold | Dial::AngularThreshold => {
                vec![trend(&error, Way::Rises), trend(speed_up, Way::Rises)]
            }
            Dial::MaxDepth => vec![
                trend(&error, Way::Falls),
                // With depth fewer rays are traced, whose error is none.
                trend(&of_interpolated, Way::Falls),
                trend(&memory, Way::Rises),
                peak(speed_up),
            ],
            Dial::CacheSize => {
                let holds_all = self.rows.iter().find(|row| row.prunes == 0.0).map(|row| row.value);
                vec![knee(&cpu, holds_all)]
            }
        };
        self.verdict = Verdict::of(claims.into_iter().flatten().collect());
        self.beside_the_paper = self.beside_the_paper();
    }

    fn series(&self, name: &'static str, ours: Figure<Row>, paper: Figure<Published>) -> Series {
        Series {
            name,
            ours: self.rows.iter().filter_map(|row| Some([row.value, ours(row)?])).collect(),
            paper: self.rows.iter().filter_map(|row| Some([row.value, paper(&row.published?)?])).collect(),
        }
    }

    fn beside_the_paper(&self) -> Option<String> {
        let both: Vec<(&Row, Published)> =
            self.rows.iter().filter_map(|row| Some((row, row.published?))).collect();
        let share = |name: &str, is_as_good: fn(&Row, &Published) -> Option<bool>| {
            let known: Vec<bool> = both.iter().filter_map(|(row, paper)| is_as_good(row, paper)).collect();
            let good = known.iter().filter(|good| **good).count();
            (!known.is_empty()).then(|| format!("{name} in {good} of {}", known.len()))
        };
        let errors = share("error", |row, paper| Some(row.error <= paper.error));
        let parts = [
            errors.filter(|_| self.input.errors_compare()),
            share("FLOP speed-up", |row, paper| Some(row.flop_speed_up? >= paper.flop_speed_up)),
            share("CPU speed-up", |row, paper| Some(row.cpu_speed_up?.median >= paper.cpu_speed_up)),
            share("memory", |row, paper| Some(row.memory_mb <= paper.memory_mb?)),
        ];
        let parts: Vec<String> = parts.into_iter().flatten().collect();
        (!parts.is_empty()).then(|| {
            format!("At or better than the paper's figure at the same setting: {}.", parts.join(", "))
        })
    }
}
