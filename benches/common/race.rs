//! Races: all contestants on one set of rays, in turns, on one thread and on two.

use std::time::{Duration, Instant};

use chordfield::geometry::Region;
use rayon::prelude::*;

use crate::organs::Organs;
use crate::rays::RaySet;
use crate::samples::Samples;
use crate::{Contestant, Entrant};

/// Stretches of a batch, which two threads share.
const STRETCHES: u32 = 16;

/// Columns and rows of a tile of an image, at most: the zeros to which lengths are added are then still in the second-level cache, as
/// those of the program's tiles are, and two threads share the tiles.
const TILE: [u32; 2] = [640, 64];

/// A contestant leaves the race after this long on one thread, but not before it has run [`LEAST_ROUNDS`].
const PATIENCE: Duration = Duration::from_secs(2);

/// Fewer make no median.
const LEAST_ROUNDS: usize = 3;

/// What a contestant achieved.
pub struct Figures {
    /// Seconds for all rays, one thread.
    pub one_thread: Samples,
    /// Seconds for all rays, two threads.
    pub two_threads: Samples,
    /// Its lengths beside the judge's.
    pub check: Check,
}

/// Lengths beside those of the judge, the first contestant.
#[derive(Clone, Copy, Debug, Default)]
pub struct Check {
    /// The mean over all rays.
    pub mean_mm: f64,
    /// By how much it differs from the judge's, but for rays lost and invented.
    pub mean_off_mm: f64,
    /// The share of rays with a length.
    pub share_hit: f64,
    /// Rays without a length to which the judge gives more than [`CERTAIN_HIT_MM`].
    pub lost: usize,
    /// Rays with more than that to which the judge gives none.
    pub invented: usize,
    /// The largest difference on one ray.
    pub worst_mm: f64,
}

/// A ray missed by more is lost, not rounded: in f32, a silhouette moves by some 3e-5 mm, and with it a ray that should
/// have missed a body of 100 mm gets √(8 · 100 mm · 3e-5 mm) = 0.15 mm.
pub const CERTAIN_HIT_MM: f64 = 1.0;

impl Check {
    fn new(lengths: &[f64], judge: &[f64]) -> Self {
        let mut check = Self::default();
        for (&own, &true_length) in lengths.iter().zip(judge) {
            check.mean_mm += own;
            check.share_hit += f64::from(u8::from(own > 0.0));
            check.worst_mm = check.worst_mm.max((own - true_length).abs());
            if own == 0.0 && true_length > CERTAIN_HIT_MM {
                check.lost += 1;
            } else if true_length == 0.0 && own > CERTAIN_HIT_MM {
                check.invented += 1;
            } else {
                check.mean_off_mm += own - true_length;
            }
        }
        let count = lengths.len() as f64;
        check.mean_mm /= count;
        check.share_hit /= count;
        check.mean_off_mm = (check.mean_off_mm / count).abs();
        check
    }
}

/// All lengths, from making ready to the last.
type Task<'a> = Box<dyn Fn(&mut [f64], Share) + Sync + 'a>;

/// Whether a task's parts run one after the other, or on the threads of the pool it runs in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Share {
    InTurn,
    Abreast,
}

/// Races on one set of rays. `None` for contestants that do not take it.
pub fn race(
    entrants: &[Entrant],
    contestants: &[Box<dyn Contestant>],
    rays: &RaySet,
    rounds: usize,
) -> Vec<Option<Figures>> {
    assert_eq!(entrants.len(), contestants.len());
    let tasks = contestants.iter().map(|contestant| task(contestant.as_ref(), rays)).collect();
    race_tasks(tasks, rays.count(), rounds)
}

/// Races to all lengths of all organs, each organ on its rectangle of pixels: a tree of each, which only the rays near it
/// descend, is no slower than one tree of all.
pub fn race_of_organs(entrants: &[Entrant], organs: &Organs, rounds: usize) -> Vec<Option<Figures>> {
    let rays = RaySet::Grid(organs.grid);
    let built: Vec<Vec<Box<dyn Contestant>>> =
        entrants.iter().map(|entrant| organs.surfaces.iter().map(|s| (entrant.build)(s)).collect()).collect();
    let count: usize = organs.surfaces.iter().map(|surface| organs.pixels_of(surface).pixels()).sum();
    let tasks = built.iter().map(|contestants| task_of_organs(contestants, organs, &rays)).collect();
    race_tasks(tasks, count, rounds)
}

fn task<'a>(contestant: &'a dyn Contestant, rays: &'a RaySet) -> Option<Task<'a>> {
    contestant.tracer(rays).is_some().then_some(())?;
    let parts = match rays {
        RaySet::Grid(grid) => RaySet::tiles(grid, TILE),
        RaySet::Batch(_) => rays.parts(STRETCHES),
    };
    Some(Box::new(move |lengths, share| {
        let tracer = contestant.tracer(rays).expect("it took them before");
        let trace = |(part, lengths): (&Region, &mut [f64])| {
            lengths.fill(0.0);
            tracer(part, lengths);
        };
        let jobs = share_out(&parts, lengths);
        match share {
            Share::InTurn => jobs.into_iter().for_each(trace),
            Share::Abreast => jobs.into_par_iter().with_max_len(1).for_each(trace),
        }
    }))
}

fn task_of_organs<'a>(
    contestants: &'a [Box<dyn Contestant>],
    organs: &'a Organs,
    rays: &'a RaySet,
) -> Option<Task<'a>> {
    contestants[0].tracer(rays).is_some().then_some(())?;
    let trace = move |i: usize, region: &Region, lengths: &mut [f64]| {
        lengths.fill(0.0);
        contestants[i].tracer(rays).expect("the first took them")(region, lengths);
    };
    Some(Box::new(move |lengths, share| {
        let regions: Vec<Region> = organs.surfaces.iter().map(|s| organs.pixels_of(s)).collect();
        let jobs: Vec<_> = share_out(&regions, lengths).into_iter().enumerate().collect();
        match share {
            Share::InTurn => jobs.into_iter().for_each(|(i, (region, lengths))| trace(i, region, lengths)),
            Share::Abreast => jobs
                .into_par_iter()
                .with_max_len(1)
                .for_each(|(i, (region, lengths))| trace(i, region, lengths)),
        }
    }))
}

/// Cuts a list of lengths into those of each region, one after the other.
fn share_out<'a>(regions: &'a [Region], mut lengths: &'a mut [f64]) -> Vec<(&'a Region, &'a mut [f64])> {
    let mut shares = Vec::with_capacity(regions.len());
    for region in regions {
        let (share, rest) = lengths.split_at_mut(region.pixels());
        shares.push((region, share));
        lengths = rest;
    }
    shares
}

fn race_tasks(tasks: Vec<Option<Task<'_>>>, count: usize, rounds: usize) -> Vec<Option<Figures>> {
    let pool = |threads| rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
    let (one, two) = (pool(1), pool(2));
    let (mut lengths, mut judge) = (vec![0.0; count], None);
    // The check also warms caches and pages.
    let mut figures: Vec<Option<Figures>> = tasks
        .iter()
        .map(|task| {
            let task = task.as_ref()?;
            two.install(|| task(&mut lengths, Share::Abreast));
            let check = Check::new(&lengths, judge.get_or_insert_with(|| lengths.clone()));
            Some(Figures { one_thread: Samples::default(), two_threads: Samples::default(), check })
        })
        .collect();
    for _ in 0..rounds {
        for (task, figures) in tasks.iter().zip(&mut figures) {
            let (Some(task), Some(figures)) = (task, figures) else { continue };
            let so_far = &figures.one_thread.0;
            if so_far.len() >= LEAST_ROUNDS && so_far.iter().sum::<f64>() > PATIENCE.as_secs_f64() {
                continue;
            }
            let runs = [
                (&one, Share::InTurn, &mut figures.one_thread),
                (&two, Share::Abreast, &mut figures.two_threads),
            ];
            for (pool, share, times) in runs {
                let start = Instant::now();
                pool.install(|| task(&mut lengths, share));
                times.0.push(start.elapsed().as_secs_f64());
            }
        }
    }
    figures
}
