//! An attribute of one's own in an RI-tree: how near a line passes to a point, and how well the tree knows it.
//!
//! `cargo run --release --example custom_attribute`

use chordfield::geometry::{Bounds, Line, UnitDir};
use chordfield::linespace::{Cell, LinePoint, LineSpace, PlanePair};
use chordfield::ritree::{Answer, Attribute, Cache, Parameters, RiTree};
use glam::DVec3;

/// The distance between a line and an organ at risk beside the box, mm: smooth, but for lines through the point itself.
struct ClosestApproach {
    space: LineSpace,
    centre: DVec3,
}

impl ClosestApproach {
    fn of(&self, line: &Line) -> f64 {
        (self.centre - line.origin()).cross(line.dir()).length()
    }
}

impl Attribute for ClosestApproach {
    type Output = f64;
    type Real = f64;

    fn sample(&self, line: LinePoint) -> f64 {
        self.space.line_of(line).map_or(f64::NAN, |line| self.of(&line))
    }

    fn class(&self, _: &f64) -> u32 {
        1 // No discontinuities: one class.
    }

    fn miss(&self) -> f64 {
        f64::INFINITY // Never asked for: no cell is empty.
    }

    fn is_miss(&self, _: u32) -> bool {
        false
    }

    fn distance(&self, a: &f64, b: &f64) -> f64 {
        (a - b).abs()
    }

    fn interpolate(&self, parts: &[(f64, &f64)]) -> f64 {
        parts.iter().map(|(weight, value)| weight * *value).sum()
    }

    fn is_symmetric(&self) -> bool {
        true
    }

    fn is_certainly_empty(&self, _: PlanePair, _: &Cell) -> bool {
        false
    }
}

fn main() -> std::io::Result<()> {
    let bounds = Bounds { min: DVec3::splat(-100.0), max: DVec3::splat(100.0) };
    let Some(space) = LineSpace::new(bounds) else { return Ok(()) };
    let attribute = ClosestApproach { space, centre: DVec3::new(30.0, -20.0, 180.0) };
    let parameters = Parameters { distance_threshold: 0.5, ..Parameters::default() };
    let (tree, cache) = (RiTree::new(attribute, parameters), Cache::new(100_000_000));

    let (mut worst, mut sum, mut count) = (0.0_f64, 0.0, 0);
    for i in 0..100_000_u32 {
        // A fan of lines from a source on a circle about the box.
        let angle = f64::from(i) * 1e-3;
        let source = DVec3::new(500.0 * angle.sin(), -500.0 * angle.cos(), 0.0);
        let target = DVec3::new(f64::from(i % 97) - 48.0, f64::from(i % 89) - 44.0, f64::from(i % 83) - 41.0);
        let Some(line) = UnitDir::new(target - source).and_then(|dir| Line::new(source, dir)) else {
            continue;
        };
        if let Some(Answer::Interpolated(near)) = tree.query(space.point_of(&line), &cache) {
            let error = (near - tree.attribute().of(&line)).abs();
            (worst, sum, count) = (worst.max(error), sum + error, count + 1);
        }
    }
    let built = tree.build_counts();
    let report = format!(
        "{count} lines from {} samples in {} bytes: mean error {:.3} mm, worst {worst:.3} mm\n",
        built.samples_taken,
        cache.used_bytes(),
        sum / f64::from(count.max(1)),
    );
    std::io::Write::write_all(&mut std::io::stdout(), report.as_bytes())
}
