//! The chord of a line in a smooth convex body: what the paper's volume visualization keeps (§3), in numbers whose operations
//! can be counted.

use std::marker::PhantomData;

use super::lines::{ByDirection, SurfaceLines};
use super::surface::{blend, f32s, vector};
use crate::geometry::{Ray, Real, Vec3};
use crate::linespace::{Cell, LinePoint, PlanePair};
use crate::ritree::Attribute;
use crate::surface::{Crossing, Reach, Surface};

/// A chord, as samples hold it: its length with the normal where it begins, whose turning tells how much the surface bends
/// between samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothChord {
    /// Its length, in the scene's unit (mm).
    pub length: f32,
    /// The outward unit normal where it begins.
    pub normal: [f32; 3],
}

/// The chord of a ray of unit direction, from outside, in a closed convex surface: two intersections. `None` if it misses.
pub fn chord<R: Real>(surface: &Surface, ray: &Ray<R>) -> Option<(R, Vec3<R>)> {
    let enters = surface.hit(ray, Reach::whole().only(Crossing::Entering))?;
    // A ray that grazes may be found to enter and not to leave: there is nothing between.
    let beyond = Reach { from: enters.t, ..Reach::whole() };
    let leaves = surface.hit(ray, beyond.only(Crossing::Leaving))?;
    Some((leaves.t - enters.t, enters.normal))
}

/// The attribute of smooth convex bodies that are looked through. The distance of two chords is that of their lengths, in
/// half the longest side of the body's box: the unit of the distance threshold, as for bodies of faces.
pub struct SmoothChords<'a, R> {
    lines: SurfaceLines<'a>,
    unit: f64,
    number: PhantomData<R>,
}

impl<'a, R: Real> SmoothChords<'a, R> {
    /// The chords of a closed convex surface. `None` if it has no extent.
    pub fn new(surface: &'a Surface) -> Option<Self> {
        let unit = 0.5 * surface.bounds().size().max_element();
        Some(Self { lines: SurfaceLines::new(surface, ByDirection::Little)?, unit, number: PhantomData })
    }

    /// The body's lines.
    pub fn lines(&self) -> &SurfaceLines<'a> {
        &self.lines
    }

    /// The unit of the distance threshold, mm.
    pub fn unit(&self) -> f64 {
        self.unit
    }

    fn of(&self, line: LinePoint) -> Option<SmoothChord> {
        let (length, normal) = chord(self.lines.surface(), &self.lines.ray::<R>(line))?;
        Some(SmoothChord { length: length.get() as f32, normal: f32s(normal) })
    }
}

const HIT: u32 = 1;
const MISS: u32 = 0;

impl<R: Real> Attribute for SmoothChords<'_, R> {
    /// `None` if the line misses.
    type Output = Option<SmoothChord>;
    type Real = R;

    fn sample(&self, line: LinePoint) -> Self::Output {
        self.of(line)
    }

    fn class(&self, output: &Self::Output) -> u32 {
        if output.is_some() { HIT } else { MISS }
    }

    fn is_miss(&self, class: u32) -> bool {
        class == MISS
    }

    fn distance(&self, a: &Self::Output, b: &Self::Output) -> f64 {
        let length = |chord: &Self::Output| R::of(chord.map_or(0.0, |c| c.length.into()));
        ((length(a) - length(b)).abs() * R::of(1.0 / self.unit)).get()
    }

    fn interpolate(&self, parts: &[(R, &Self::Output)]) -> Self::Output {
        let known = || parts.iter().filter_map(|(weight, chord)| chord.as_ref().map(|c| (*weight, c)));
        known().next()?;
        let length = known().fold(R::of(0.0), |sum, (weight, c)| sum + weight * R::of(c.length.into()));
        let normal = blend(known().map(|(weight, c)| (weight, &c.normal)));
        // Extrapolated beyond the outline, a length would be negative.
        Some(SmoothChord { length: length.get().max(0.0) as f32, normal: f32s(normal.normalized()) })
    }

    /// One intersection of the two that a chord takes.
    fn locate(&self, line: LinePoint) -> Option<u32> {
        let ray = self.lines.ray::<R>(line);
        let is_hit = self.lines.surface().hit(&ray, Reach::whole().only(Crossing::Entering)).is_some();
        Some(if is_hit { HIT } else { MISS })
    }

    /// The normal.
    fn direction(&self, output: &Self::Output) -> Option<Vec3<R>> {
        output.map(|chord| vector(chord.normal))
    }

    fn is_certainly_empty(&self, pair: PlanePair, cell: &Cell) -> bool {
        self.lines.is_certainly_empty::<R>(pair, cell)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::geometry::Counted;
    use crate::ritree::{Answer, Cache, Parameters, RiTree};
    use crate::surface::Sphere;

    const RADIUS: f64 = 40.0;

    fn ball() -> Surface {
        Surface::Sphere(Sphere::new(DVec3::new(5.0, -2.0, 9.0), RADIUS).expect("a sphere"))
    }

    /// Rays from one place across the ball and past it, with the closed form of their chords.
    fn rays<R: Real>() -> impl Iterator<Item = (Ray<R>, f64)> {
        let (eye, centre) = (DVec3::new(-300.0, 20.0, 40.0), DVec3::new(5.0, -2.0, 9.0));
        (0..40).flat_map(move |i| (0..40).map(move |j| [i, j])).map(move |at| {
            let [y, z] = at.map(|k| 2.6 * (f64::from(k) - 19.3));
            let dir = (centre + DVec3::new(0.0, y, z) - eye).normalize();
            let off = (centre - eye) - (centre - eye).dot(dir) * dir;
            let under = RADIUS * RADIUS - off.length_squared();
            (Ray { origin: Vec3::of(eye), dir: Vec3::of(dir) }, 2.0 * under.max(0.0).sqrt())
        })
    }

    #[test]
    fn chords_are_the_closed_forms_and_interpolated_ones_are_near() {
        let surface = ball();
        let parameters = Parameters { distance_threshold: 0.01, ..Parameters::default() };
        let tree = RiTree::new(SmoothChords::<f64>::new(&surface).expect("extent"), parameters);
        let cache = Cache::new(1 << 30);
        let (mut hits, mut interpolated, mut sum) = (0, 0, 0.0);
        for (ray, expected) in rays::<f64>() {
            let exact = chord(&surface, &ray).map_or(0.0, |(length, _)| length);
            assert!((exact - expected).abs() < 1e-6, "{exact}, not {expected}");
            hits += usize::from(exact > 0.0);
            let point = tree.attribute().lines().point(&ray);
            if let Some(Answer::Interpolated(near)) = tree.query(point, &cache) {
                sum += (near.map_or(0.0, |c| f64::from(c.length)) - exact).abs();
                interpolated += 1;
            }
        }
        assert!(
            (300..1300).contains(&hits) && interpolated > 1000,
            "{hits} hits, {interpolated} interpolated"
        );
        assert!(sum / f64::from(interpolated) < 0.01 * 0.5 * RADIUS, "{}", sum / f64::from(interpolated));
        tree.check_invariants();
    }

    #[test]
    fn counting_changes_no_chord() {
        let surface = ball();
        for ((plain, _), (counted, _)) in rays::<f64>().zip(rays::<Counted>()) {
            let (length, operations) = Counted::count(|| chord(&surface, &counted));
            assert_eq!(chord(&surface, &plain).map(|c| c.0), length.map(|c| c.0.get()));
            assert!(operations > 0);
        }
    }
}
