//! What is recorded of a run of `chordfield trace`.

use serde::Serialize;

use crate::cli::args::Application;
use crate::modes::bench::Samples as Times;
use crate::modes::raytrace::{Trees, Work};
use crate::ritree::BuildCounts;

/// A run's record: what was rendered, how, and what it took.
#[derive(Debug, Serialize)]
pub struct Record {
    pub scene: String,
    pub application: Application,
    pub objects: usize,
    pub size: [u32; 2],
    pub samples: u32,
    pub method: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub settings: Option<Trees>,
    pub views: usize,
    pub threads: usize,
    pub run: Run,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub exact: Option<Comparison>,
}

/// One rendering of all views.
#[derive(Debug, Default, Serialize)]
pub struct Run {
    pub seconds: f64,
    /// Of one thread, for each ray: from the camera, turned, or to a light.
    pub nanoseconds_per_ray: f64,
    /// What each view took; trees live from the first to the last.
    pub of_views: Vec<Took>,
    #[serde(flatten)]
    pub work: Work,
    /// The share of pixels with a ray traced through an object that has a tree.
    pub traced_pixels: f64,
    pub tree_bytes: usize,
    #[serde(flatten)]
    pub build: BuildCounts,
}

impl Run {
    /// Adds what it took to make the world ready to the first view, and sums up.
    pub fn count_in(&mut self, seconds: f64) {
        if let Some(first) = self.of_views.first_mut() {
            first.seconds += seconds;
        }
        self.seconds = Took::sum(&self.of_views).seconds;
        let of_threads = 1e9 * self.seconds * rayon::current_num_threads() as f64;
        self.nanoseconds_per_ray = of_threads / self.work.rays.max(1) as f64;
    }
}

/// The same views traced exactly.
#[derive(Debug, Serialize)]
pub struct Comparison {
    pub seconds: f64,
    pub nanoseconds_per_ray: f64,
    #[serde(flatten)]
    pub work: Work,
    /// The mean distance of colours, sRGB from 0 to 1 per channel.
    pub mean_rgb_error: f64,
    /// Absorption: the mean difference of lengths, in half the longest side of the body.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mean_length_error: Option<f64>,
    /// How often both ways were timed, in turn.
    pub rounds: usize,
    #[serde(flatten)]
    pub speed_ups: SpeedUps,
}

/// What some views took.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Took {
    pub seconds: f64,
    #[serde(skip_serializing_if = "is_zero")]
    pub operations: u64,
}

fn is_zero(count: &u64) -> bool {
    *count == 0
}

impl Took {
    fn sum(views: &[Self]) -> Self {
        views.iter().fold(Self::default(), |sum, view| Self {
            seconds: sum.seconds + view.seconds,
            operations: sum.operations + view.operations,
        })
    }
}

/// What exact tracing took over what trees did.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct SpeedUp {
    /// In seconds: the median of the rounds.
    pub speed_up: f64,
    /// The least and the greatest of several rounds.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub range: Option<[f64; 2]>,
    /// In floating-point operations, if they were counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub operations_speed_up: Option<f64>,
}

impl SpeedUp {
    /// Of what exact tracing and trees took for the same views, round by round.
    fn of<'r>(rounds: impl Iterator<Item = [&'r [Took]; 2]>) -> Self {
        let sums: Vec<[Took; 2]> = rounds.map(|both| both.map(Took::sum)).collect();
        let ratios = Times(sums.iter().map(|[exact, own]| exact.seconds / own.seconds).collect()).times();
        let counted = sums.first().filter(|[exact, _]| exact.operations > 0);
        Self {
            speed_up: ratios.seconds,
            range: (ratios.rounds > 1).then_some([ratios.least, ratios.most]),
            operations_speed_up: counted
                .map(|[exact, own]| exact.operations as f64 / own.operations.max(1) as f64),
        }
    }
}

/// What the same views took in one round.
pub struct Round {
    /// By trees that have seen nothing, building included.
    pub own: Vec<Took>,
    /// Traced exactly.
    pub exact: Vec<Took>,
    /// By trees that have seen them all.
    pub warm: Vec<Took>,
}

/// The speed-ups of all views.
#[derive(Debug, Serialize)]
pub struct SpeedUps {
    /// Of all views, building included.
    #[serde(flatten)]
    all: SpeedUp,
    /// Of the first view, by trees that have seen nothing.
    first_view: SpeedUp,
    /// Of the others, by trees that have seen those before.
    #[serde(skip_serializing_if = "Option::is_none")]
    further_views: Option<SpeedUp>,
    /// Of all views once more, by trees that have seen them all.
    warm: SpeedUp,
}

impl SpeedUps {
    /// Of several rounds, one at the least.
    pub fn of(rounds: &[Round]) -> Self {
        let of = |views: fn(&[Took]) -> &[Took]| {
            SpeedUp::of(rounds.iter().map(|round| [views(&round.exact), views(&round.own)]))
        };
        let has_further = rounds.iter().all(|round| round.own.len() > 1);
        Self {
            all: of(|views| views),
            first_view: of(|views| &views[..1]),
            further_views: has_further.then(|| of(|views| &views[1..])),
            warm: SpeedUp::of(rounds.iter().map(|round| [&round.exact[..], &round.warm[..]])),
        }
    }
}
