//! How far interpolated lengths are from exact ones, on a seeded sample of the run's own rays.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};
use serde::Serialize;

use super::Projector;
use super::forest::holds_box;
use crate::exact::Engine;
use crate::geometry::Interval;
use crate::scene::View;

/// Errors of interpolated lengths against exact ones, mm, over sampled rays and organs that one of the two says are met.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct SampledError {
    /// Lengths compared: interpolated ones only, since traced ones are exact.
    pub compared: usize,
    /// The mean exact length.
    pub mean_length_mm: f64,
    /// The mean of |error|.
    pub mean_mm: f64,
    /// Half of the errors are no larger.
    pub p50_mm: f64,
    /// 99 % of the errors are no larger.
    pub p99_mm: f64,
    /// 99.9 % of the errors are no larger.
    pub p999_mm: f64,
    /// The largest.
    pub max_mm: f64,
}

impl Projector<'_> {
    /// Compares `rays` random pixels' rays of the views, all organs each. `None` without trees or without views.
    pub fn spot_check(&self, views: &[View], rays: usize, seed: u64) -> Option<SampledError> {
        let grove = self.forest.as_ref().filter(|_| !views.is_empty())?.enter();
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut below = |n: u64| rng.next_u64() % n.max(1);
        let (mut errors, mut total) = (Vec::new(), 0.0);
        let mut parts = Vec::new();
        for _ in 0..rays {
            let view = &views[below(views.len() as u64) as usize];
            let (columns, rows) = view.size();
            let ray = view.segment(below(columns.into()) as u32, below(rows.into()) as u32);
            for &organ in &self.traced {
                let body = &self.scene.organs[organ].body;
                let Some(tree) = grove.tree(organ).filter(|_| holds_box(&ray, &body.bounds())) else {
                    continue;
                };
                let Ok(chord) = grove.chord(tree, &ray) else { continue };
                let near = chord.map_or(0.0, |c| c.length());
                let mut length_by = |find: &dyn Fn(&mut Vec<Interval>)| -> f64 {
                    find(&mut parts);
                    parts.iter().map(Interval::length).sum()
                };
                // A walk finds the rays that are worth comparing; clipping, which takes no part in sampling large bodies,
                // is the judge of them.
                if near == 0.0 && length_by(&|parts| body.chords(ray.line(), parts)) == 0.0 {
                    continue;
                }
                let exact = length_by(&|parts| body.chords_by(Engine::Clip, ray.line(), parts));
                if exact > 0.0 || near > 0.0 {
                    errors.push((near - exact).abs());
                    total += exact;
                }
            }
        }
        errors.sort_unstable_by(f64::total_cmp);
        let count = errors.len().max(1) as f64;
        let quantile = |q: f64| errors.get((q * (count - 1.0)).ceil() as usize).copied().unwrap_or(0.0);
        Some(SampledError {
            compared: errors.len(),
            mean_length_mm: total / count,
            mean_mm: errors.iter().sum::<f64>() / count,
            p50_mm: quantile(0.5),
            p99_mm: quantile(0.99),
            p999_mm: quantile(0.999),
            max_mm: errors.last().copied().unwrap_or(0.0),
        })
    }
}
