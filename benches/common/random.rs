//! Random rays: from a sphere around the body towards a ball about its centre.

use chordfield::geometry::Segment;
use glam::DVec3;
use rand::{RngExt, SeedableRng};
use rand_pcg::Pcg64;

/// Rays in a batch.
pub const COUNT: usize = 1_000_000;

const SEED: u64 = 20_480;

/// Where rays start.
const START_RADIUS_MM: f64 = 500.0;

/// Aimed into a ball of this radius, three quarters of the rays hit the benchmark's body.
const AIM_RADIUS_MM: f64 = 101.4;

/// Rays end beyond the body.
const LENGTH_MM: f64 = 1000.0;

/// The first `count` rays: from anywhere on the sphere towards anywhere in the ball, in no order.
pub fn rays(count: usize) -> Vec<Segment> {
    let mut rng = Pcg64::seed_from_u64(SEED);
    (0..count)
        .map(|_| {
            let start = START_RADIUS_MM * in_unit_ball(&mut rng).normalize();
            let aim = AIM_RADIUS_MM * in_unit_ball(&mut rng);
            let end = start + LENGTH_MM * (aim - start).normalize();
            Segment::between(start, end).expect("the ball of aims lies within the sphere of starts")
        })
        .collect()
}

fn in_unit_ball(rng: &mut Pcg64) -> DVec3 {
    loop {
        let place = DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0)));
        if (f64::MIN_POSITIVE..=1.0).contains(&place.length_squared()) {
            return place;
        }
    }
}
