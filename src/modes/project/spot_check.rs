//! How far interpolated lengths are from exact ones, on a seeded sample of the run's own rays.

use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::Projector;
use super::forest::holds_box;
use crate::exact::Engine;
use crate::geometry::Interval;
use crate::modes::audit::DEFAULT_TOLERANCE_MM;
use crate::modes::figures::{Figures, Tally};
use crate::scene::View;

impl Projector<'_> {
    /// Errors of interpolated lengths against exact ones, mm, over `rays` random pixels' rays of the views and all organs that
    /// one of the two says are met; traced lengths are exact and not compared. `None` without trees or without views.
    ///
    /// A glance at each run; [`audit`](crate::modes::audit) looks at every ray and at the other kinds of error.
    pub fn spot_check(&self, views: &[View], rays: usize, seed: u64) -> Option<Figures> {
        let grove = self.forest.as_ref().filter(|_| !views.is_empty())?.enter();
        let mut rng = Pcg64::seed_from_u64(seed);
        let mut below = |n: u64| rng.next_u64() % n.max(1);
        let mut errors = Tally::new(DEFAULT_TOLERANCE_MM);
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
                let Ok(near) = grove.length_mm(&mut tree.descent(), &ray) else { continue };
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
                    errors.add(near - exact, exact);
                }
            }
        }
        Some(errors.figures(true))
    }
}
