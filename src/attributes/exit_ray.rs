//! The ray that leaves an object which mirrors or refracts.

use std::marker::PhantomData;

use super::lines::SurfaceLines;
use super::memo::Memo;
use super::surface::{Seen, blend, blended, distance, f32s, vector};
use crate::geometry::{Ray, Real, Vec3};
use crate::linespace::{Cell, LinePoint, PlanePair};
use crate::ritree::{Attribute, Sampling};
use crate::surface::optics::{Optics, follow, reflected};
use crate::surface::{Hit, Reach};

/// The first hit of a line, and the ray that leaves the object at last: {normal, point, exit point, exit direction}.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Through {
    /// The first hit.
    pub seen: Seen,
    /// How the ray was turned on its way, and by which patch last; a part of the class.
    pub way: u32,
    /// Where it leaves.
    pub exit_point: [f32; 3],
    /// Which way, unit length (interpolated, as long as the samples' mean); zero if it does not leave within the limit.
    pub exit_dir: [f32; 3],
}

/// A line's sample with the first hit that it was made of.
pub type Known<R> = (Through, Option<Hit<R>>);

/// The way of a ray that is not followed yet.
const UNKNOWN: u32 = u32::MAX;

impl Through {
    const MISS: Self = Self { seen: Seen::MISS, way: 0, exit_point: [0.0; 3], exit_dir: [0.0; 3] };

    fn outline(seen: Seen) -> Self {
        let way = if seen == Seen::MISS { 0 } else { UNKNOWN };
        Self { seen, way, ..Self::MISS }
    }

    fn is_finished(&self) -> bool {
        self.way != UNKNOWN
    }

    /// How often the ray is turned.
    pub fn turns(&self) -> u32 {
        self.way & 0xff
    }

    /// The exit ray. `None` if the ray does not leave.
    pub fn exit<R: Real>(&self) -> Option<Ray<R>> {
        let leaves = self.exit_dir != [0.0; 3];
        // As f32 tells it the direction is not of unit length, and places along the ray would not be where they are.
        leaves.then(|| Ray { origin: vector(self.exit_point), dir: vector(self.exit_dir).normalized() })
    }
}

/// See [`Sampling::levels_spared`]: samples of glass cost the most, and many of its discontinuities lie within its outline.
const GLASS_LEVELS_SPARED: u32 = 6;

/// How far along a ray a hit may lie from where its depth says, box units: depths of up to 1 are rounded to f32 along the
/// axis, and rays are at most √3 times as long.
const DEPTH_ROUNDING: f64 = 2.0 * f32::EPSILON as f64;

/// What of a mirrored ray's way to the farthest things counts as its lever: it turns twice as far as the normal, but much of
/// what it shows is nearer. Measured, it keeps pictures of a waving sheet and of a bowl truer than the paper's at the paper's
/// thresholds; an eighth more would cost 1 % more operations of the sheet for a twentieth less error.
const LEVERAGE: f64 = 0.265;

/// The attribute of objects that mirror or refract.
///
/// Rays that are turned differently often, or leave by patches of different classes, are of different classes: between
/// them the exit ray jumps.
pub struct ExitRay<'a, R> {
    lines: SurfaceLines<'a>,
    optics: Optics,
    limit: u32,
    /// How far a mirrored ray moves on what it shows by a unit turn of the normal, box units.
    leverage: f64,
    memo: Memo<Known<R>>,
    number: PhantomData<R>,
}

impl<'a, R: Real> ExitRay<'a, R> {
    /// The exit rays of a surface, after at most `limit` turns. Mirrored ones go on for at most `reach`, a length.
    pub fn new(lines: SurfaceLines<'a>, optics: Optics, limit: u32, reach: f64) -> Self {
        let leverage = LEVERAGE * reach / lines.side();
        Self { lines, optics, limit, leverage, memo: Memo::default(), number: PhantomData }
    }

    /// The surface's lines.
    pub fn lines(&self) -> &SurfaceLines<'a> {
        &self.lines
    }
}

impl<R: Real> Attribute for ExitRay<'_, R> {
    type Output = Through;
    type Real = R;

    fn sample(&self, line: LinePoint) -> Through {
        let mut output = self.outline(line);
        self.finish(line, &mut output);
        output
    }

    /// The first hit.
    fn outline(&self, line: LinePoint) -> Through {
        let outline = || {
            let (seen, hit) = Seen::along::<R>(&self.lines, line);
            (Through::outline(seen), hit)
        };
        Through::outline(self.memo.recall(line, outline).0.seen)
    }

    fn outline_class(&self, output: &Through) -> u32 {
        output.seen.class
    }

    fn sampling(&self) -> Sampling {
        match self.optics {
            Optics::Mirror => self.lines.sampling(),
            Optics::Glass { .. } => Sampling { levels_spared: GLASS_LEVELS_SPARED, ..self.lines.sampling() },
        }
    }

    /// A mirror's first hit has the normal that its rays are turned at.
    fn outline_within(&self, output: &Through) -> Option<Through> {
        (self.optics == Optics::Mirror).then(|| Through::outline(output.seen))
    }

    fn is_told_by_outline(&self, output: &Through) -> bool {
        self.is_plain_mirror(output)
    }

    fn finish(&self, line: LinePoint, output: &mut Through) {
        if !output.is_finished() {
            *output = match self.memo.get(&line) {
                Some((known, _)) if known.is_finished() => known,
                Some((_, hit)) => self.followed(line, output.seen, hit),
                None => self.followed(line, output.seen, None),
            };
        }
    }

    fn class(&self, output: &Through) -> u32 {
        // Patch classes are few: below 2¹² of either kind nothing is lost.
        output.seen.class ^ output.way.rotate_left(20)
    }

    fn miss(&self) -> Through {
        Through::MISS
    }

    fn is_miss(&self, class: u32) -> bool {
        class == 0
    }

    fn are_joined(&self, lines: [LinePoint; 2], outputs: [&Through; 2]) -> bool {
        self.lines.are_joined::<R>(lines, outputs.map(|output| &output.seen))
    }

    /// By its first hit, which costs little beside following the ray.
    fn locates(&self) -> bool {
        true
    }

    fn locate(&self, line: LinePoint) -> Through {
        Through::outline(Seen::along::<R>(&self.lines, line).0)
    }

    fn told(&self, outline: &Through, interpolated: Through) -> Through {
        Through { seen: outline.seen, ..interpolated }
    }

    /// The distance of the exit rays in line space (§2.3); of rays that do not leave, that of the hits' depths. A plain mirror
    /// turns the ray itself at the interpolated place: its distance is that of the normals,
    /// which move what a mirror shows the more the farther it lies.
    fn distance(&self, a: &Through, b: &Through) -> f64 {
        if self.is_plain_mirror(a) && self.is_plain_mirror(b) {
            return distance::<R>(&a.seen, &b.seen, self.leverage);
        }
        match (a.exit::<R>(), b.exit::<R>()) {
            (Some(a), Some(b)) => self.lines.ray_distance(&a, &b),
            _ => f64::from(a.seen.depth - b.seen.depth).abs(),
        }
    }

    /// A ray that a mirror turned once is mirrored at the interpolated normal, which keeps the law of reflection; all
    /// other exit rays are interpolated. That is left to [`exit_of`](Self::exit_of), which knows the ray.
    fn interpolate(&self, parts: &[(R, &Through)]) -> Through {
        let Some((_, first)) = parts.first() else { return Through::MISS };
        let seen = blended(parts.iter().map(|(weight, p)| (*weight, &p.seen)));
        if first.exit_dir == [0.0; 3] || self.is_plain_mirror(first) {
            return Through { seen, ..**first };
        }
        let point = blend(parts.iter().map(|(weight, p)| (*weight, &p.exit_point)));
        let dir = blend(parts.iter().map(|(weight, p)| (*weight, &p.exit_dir)));
        Through { seen, way: first.way, exit_point: f32s(point), exit_dir: f32s(dir) }
    }

    /// Of the exit ray; of a plain mirror, the normal, which is what is interpolated: lines of many slopes may share it.
    fn direction(&self, output: &Through) -> Option<Vec3<R>> {
        if self.is_plain_mirror(output) {
            return Some(vector(output.seen.normal));
        }
        (output.exit_dir != [0.0; 3]).then(|| vector(output.exit_dir))
    }

    /// A mirrored ray turns twice as far as the normal.
    fn angular_share(&self) -> f64 {
        if self.optics == Optics::Mirror { 0.5 } else { 1.0 }
    }

    fn is_certainly_empty(&self, pair: PlanePair, cell: &Cell) -> bool {
        self.lines.is_certainly_empty::<R>(pair, cell)
    }
}

impl<R: Real> ExitRay<'_, R> {
    /// The whole sample of a line whose first hit is known, or is found again where it must be.
    fn followed(&self, line: LinePoint, seen: Seen, hit: Option<Hit<R>>) -> Through {
        let ray = self.lines.ray::<R>(line);
        let surface = self.lines.surface();
        let again = || {
            let t = self.lines.distance_to(R::of(seen.depth.into()), &ray, line.pair);
            let room = R::of(DEPTH_ROUNDING * self.lines.side());
            // As exactly as it was found before, so that samples do not depend on what is remembered.
            let whole = Reach::whole().in_f32();
            let near = Reach { from: t - room, to: t + room, ..whole };
            surface.hit(&ray, near).or_else(|| surface.hit(&ray, whole))
        };
        let Some(hit) = hit.or_else(again) else { return Through::MISS };
        let path = follow(surface, &ray, hit, self.optics, self.limit);
        let (exit_point, exit_dir) =
            path.exit.map_or(([0.0; 3], [0.0; 3]), |exit| (f32s(exit.origin), f32s(exit.dir)));
        let way = path.turns.min(0xff) | path.last_class << 8;
        self.memo.put(line, (Through { seen, way, exit_point, exit_dir }, Some(hit))).0
    }

    /// Whether rays are turned once, at the first hit, as far as is known.
    fn is_plain_mirror(&self, output: &Through) -> bool {
        self.optics == Optics::Mirror && (output.turns() == 1 || !output.is_finished())
    }

    /// The exit ray of an interpolated output for the ray that asked, which meets the object at `place` with this unit normal.
    pub fn exit_of(&self, output: &Through, ray: &Ray<R>, place: Vec3<R>, normal: Vec3<R>) -> Option<Ray<R>> {
        if self.is_plain_mirror(output) {
            return Some(Ray { origin: place, dir: reflected(ray.dir, normal) });
        }
        output.exit()
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;
    use crate::attributes::lines::ByDirection;
    use crate::scene::trace::{Recipe, random_volumes};

    #[test]
    fn samples_do_not_depend_on_what_is_remembered() {
        let world = random_volumes(Recipe { seed: 2, count: 3 }).expect("a world");
        let surface = &world.objects[0].surface;
        let exits = || {
            let lines = SurfaceLines::new(surface, true, ByDirection::Much).expect("an extent");
            ExitRay::<f64>::new(lines, Optics::Glass { index: 1.4 }, 20, 1e3)
        };
        let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
        let mut line = || LinePoint {
            pair: PlanePair::ALL[rng.random_range(0..6)],
            stuv: std::array::from_fn(|_| rng.random_range(0.2..0.8)),
        };
        let (forgetful, mindful) = (exits(), exits());
        let lines: Vec<LinePoint> = (0..300).map(|_| line()).collect();
        let outlines: Vec<Through> = lines.iter().map(|line| forgetful.outline(*line)).collect();
        // So many that of the first none is remembered.
        for _ in 0..60_000 {
            forgetful.outline(line());
        }
        let (mut hits, mut forgotten) = (0, 0);
        for (line, mut told) in lines.iter().zip(outlines) {
            forgotten += u32::from(forgetful.memo.get(line).is_none());
            forgetful.finish(*line, &mut told);
            assert_eq!(told, mindful.sample(*line), "{line:?}");
            hits += u32::from(told != Through::MISS);
        }
        assert!(hits > 100 && forgotten == 300, "{hits} hits, {forgotten} forgotten");
    }
}
