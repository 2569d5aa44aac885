//! The chord of a line in a smooth convex body: what the paper's volume visualization keeps (§3), in numbers whose operations
//! can be counted.

use super::lines::{ByDirection, SurfaceLines};
use super::memo::Memo;
use super::surface::{f32s, vector};
use crate::geometry::{Ray, Real, Vec3};
use crate::linespace::{Cell, LinePoint, PlanePair};
use crate::ritree::{Attribute, Sampling};
use crate::surface::{Crossing, Hit, Reach, Surface};

/// A chord, as samples hold it: its length with the normal where it begins, whose turning tells how much the surface bends
/// between samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SmoothChord {
    /// The square of its length, mm² (the scene's unit): as lines come near the outline the length falls ever steeper, and its
    /// square evenly.
    pub squared: f32,
    /// The outward unit normal where it begins.
    pub normal: [f32; 3],
}

/// See [`Sampling::levels_spared`]: two intersections are soon found, and what is interpolated beyond an outline is off by
/// more than all the rest. With six levels fewer a picture of the paper's size takes the fewest operations.
const LEVELS_SPARED: u32 = 6;

/// See [`Attribute::angular_share`]: normals turn faster than lengths change. Where they may turn four fifths as far again
/// as the threshold says, errors are those of the paper.
const ANGULAR_SHARE: f64 = 1.8;

/// The square of a chord of which only the beginning is known.
const UNKNOWN: f32 = -1.0;

impl SmoothChord {
    /// Its length, mm.
    pub fn length<R: Real>(&self) -> R {
        R::of(self.squared.into()).sqrt()
    }

    fn is_finished(&self) -> bool {
        self.squared != UNKNOWN
    }
}

/// The chord of a ray of unit direction, from outside, in a closed convex surface: two intersections. `None` if it misses.
pub fn chord<R: Real>(surface: &Surface, ray: &Ray<R>) -> Option<R> {
    let enters = entry(surface, ray, Reach::whole())?;
    Some(leaving(surface, ray, Reach { from: enters.t, ..Reach::whole() })? - enters.t)
}

fn entry<R: Real>(surface: &Surface, ray: &Ray<R>, reach: Reach<R>) -> Option<Hit<R>> {
    surface.hit(ray, reach.only(Crossing::Entering))
}

/// Where a ray leaves that enters where it is first in reach. A ray that grazes may be found to enter and not to leave: there is
/// nothing between.
fn leaving<R: Real>(surface: &Surface, ray: &Ray<R>, reach: Reach<R>) -> Option<R> {
    surface.hit(ray, reach.only(Crossing::Leaving)).map(|leaves| leaves.t)
}

/// The attribute of smooth convex bodies that are looked through. The distance of two chords is that of their lengths, in
/// half the longest side of the body's box: the unit of the distance threshold, as for bodies of faces.
pub struct SmoothChords<'a, R> {
    lines: SurfaceLines<'a>,
    unit: f64,
    memo: Memo<Known<R>>,
}

/// A line's sample with where it enters.
type Known<R> = (Option<SmoothChord>, R);

impl<'a, R: Real> SmoothChords<'a, R> {
    /// Bytes of the samples remembered beside the cache, which do not grow.
    pub const TABLE_BYTES: usize = Memo::<Known<R>>::BYTES;

    /// The chords of a closed convex surface. `None` if it has no extent.
    pub fn new(surface: &'a Surface) -> Option<Self> {
        let unit = 0.5 * surface.bounds().size().max_element();
        Some(Self {
            lines: SurfaceLines::new(surface, true, ByDirection::Little)?,
            unit,
            memo: Memo::default(),
        })
    }

    /// The body's lines.
    pub fn lines(&self) -> &SurfaceLines<'a> {
        &self.lines
    }

    /// The unit of the distance threshold, mm.
    pub fn unit(&self) -> f64 {
        self.unit
    }

    /// The line's sample as far as its outline.
    fn begun(&self, line: LinePoint) -> Known<R> {
        self.memo.recall(line, || {
            let begin =
                |hit: Hit<R>| (Some(SmoothChord { squared: UNKNOWN, normal: f32s(hit.normal) }), hit.t);
            let entry = entry(self.lines.surface(), &self.lines.ray(line), Reach::whole().in_f32());
            entry.map_or((None, R::of(0.0)), begin)
        })
    }
}

const HIT: u32 = 1;
const MISS: u32 = 0;

impl<R: Real> Attribute for SmoothChords<'_, R> {
    /// `None` if the line misses.
    type Output = Option<SmoothChord>;
    type Real = R;

    fn sample(&self, line: LinePoint) -> Self::Output {
        let mut output = self.outline(line);
        self.finish(line, &mut output);
        output
    }

    /// Whether the line enters, and with which normal: one intersection of the two.
    fn outline(&self, line: LinePoint) -> Self::Output {
        self.begun(line).0.map(|chord| SmoothChord { squared: UNKNOWN, ..chord })
    }

    fn finish(&self, line: LinePoint, output: &mut Self::Output) {
        let Some(begun) = output.filter(|chord| !chord.is_finished()) else { return };
        let (known, enters) = self.begun(line);
        *output = known.filter(SmoothChord::is_finished).or_else(|| {
            let beyond = Reach { from: enters, ..Reach::whole().in_f32() };
            let leaves = leaving(self.lines.surface(), &self.lines.ray(line), beyond).unwrap_or(enters);
            let squared = ((leaves - enters) * (leaves - enters)).get() as f32;
            self.memo.put(line, (Some(SmoothChord { squared, ..begun }), enters)).0
        });
    }

    fn sampling(&self) -> Sampling {
        Sampling { levels_spared: LEVELS_SPARED, ..self.lines.sampling() }
    }

    fn class(&self, output: &Self::Output) -> u32 {
        if output.is_some() { HIT } else { MISS }
    }

    fn miss(&self) -> Self::Output {
        None
    }

    fn is_miss(&self, class: u32) -> bool {
        class == MISS
    }

    fn distance(&self, a: &Self::Output, b: &Self::Output) -> f64 {
        let length = |chord: &Self::Output| chord.map_or(R::of(0.0), |c| c.length());
        ((length(a) - length(b)).abs() * R::of(1.0 / self.unit)).get()
    }

    fn interpolate(&self, parts: &[(R, &Self::Output)]) -> Self::Output {
        let known = || parts.iter().filter_map(|(weight, chord)| chord.as_ref().map(|c| (*weight, c)));
        let squared = known().map(|(weight, c)| weight * R::of(c.squared.into()));
        let squared = squared.reduce(|sum, part| sum + part)?;
        // Extrapolated beyond the outline, a square would be negative.
        let squared = squared.get().max(0.0) as f32;
        Some(SmoothChord { squared, normal: known().next()?.1.normal })
    }

    /// The normal.
    fn direction(&self, output: &Self::Output) -> Option<Vec3<R>> {
        output.map(|chord| vector(chord.normal))
    }

    fn angular_share(&self) -> f64 {
        ANGULAR_SHARE
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
            let exact = chord(&surface, &ray).unwrap_or(0.0);
            assert!((exact - expected).abs() < 1e-6, "{exact}, not {expected}");
            hits += usize::from(exact > 0.0);
            let point = tree.attribute().lines().point(&ray);
            if let Some(Answer::Interpolated(near)) = tree.query(point, &cache) {
                sum += (near.map_or(0.0, |c| c.length::<f64>()) - exact).abs();
                interpolated += 1;
            }
        }
        assert!(
            (300..1300).contains(&hits) && interpolated > 800,
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
            assert_eq!(chord(&surface, &plain), length.map(Real::get));
            assert!(operations > 0);
        }
    }
}
