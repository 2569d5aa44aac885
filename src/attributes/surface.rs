//! The first hit of a line on a surface: place and normal.

use std::marker::PhantomData;

use super::lines::SurfaceLines;
use super::memo::Memo;
use crate::geometry::{Real, Vec3};
use crate::linespace::{Cell, LinePoint, PlanePair};
use crate::ritree::{Attribute, Sampling};
use crate::surface::{Hit, Reach};

/// What is known of a line's first hit, as samples hold it: {normal, point} of the paper, the point by how far along the
/// dominant axis it lies, since it lies on the line. f32: its rounding is far below any useful threshold.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seen {
    /// Within one class outputs are interpolated; 0 is a miss.
    pub class: u32,
    /// The place along the dominant axis, box units.
    pub depth: f32,
    /// The normal, unit length; interpolated, as long as the samples' mean.
    pub normal: [f32; 3],
}

impl Seen {
    /// Nothing is hit.
    pub const MISS: Self = Self { class: 0, depth: 0.0, normal: [0.0; 3] };

    /// The class of the patch that is hit, and the side it is hit from.
    pub(super) fn of<R: Real>(hit: &Hit<R>, depth: R) -> Self {
        let class = 1 + u32::from(hit.enters) + (hit.class << 1);
        Self { class, depth: depth.get() as f32, normal: f32s(hit.normal) }
    }

    /// The first hit of a line, and as it was found.
    pub(super) fn along<R: Real>(lines: &SurfaceLines, line: LinePoint) -> (Self, Option<Hit<R>>) {
        let ray = lines.ray::<R>(line);
        let hit = lines.surface().hit(&ray, Reach::whole().in_f32());
        let seen = |hit: Hit<R>| Self::of(&hit, lines.depth(hit.place(&ray), line.pair));
        (hit.map_or(Self::MISS, seen), hit)
    }

    /// Whether the hit comes from the side that the normal points to.
    pub fn enters(&self) -> bool {
        self.class.wrapping_sub(1) & 1 == 1
    }
}

/// The parts of a vector as samples hold them.
pub(super) fn f32s<R: Real>(v: Vec3<R>) -> [f32; 3] {
    v.get().to_array().map(|x| x as f32)
}

/// A vector that samples hold.
pub(crate) fn vector<R: Real>(v: [f32; 3]) -> Vec3<R> {
    Vec3::new(R::of(v[0].into()), R::of(v[1].into()), R::of(v[2].into()))
}

/// A weighted sum of vectors.
pub(super) fn blend<'a, R: Real>(parts: impl Iterator<Item = (R, &'a [f32; 3])>) -> Vec3<R> {
    let weighted = parts.map(|(weight, v)| vector(*v) * weight);
    weighted.reduce(|sum, v| sum + v).unwrap_or_default()
}

/// The weighted sum of depths and normals.
pub(super) fn blended<'a, R: Real>(parts: impl Iterator<Item = (R, &'a Seen)> + Clone) -> Seen {
    let depth = parts.clone().map(|(weight, seen)| weight * R::of(seen.depth.into()));
    let depth = depth.reduce(|sum, depth| sum + depth).unwrap_or_default();
    let normal = blend(parts.clone().map(|(weight, seen)| (weight, &seen.normal)));
    let class = parts.into_iter().next().map_or(0, |(_, seen)| seen.class);
    Seen { class, depth: depth.get() as f32, normal: f32s(normal) }
}

/// How far two hits of one line are apart, box units, where a turn of the normal counts `leverage` times.
pub(super) fn distance<R: Real>(a: &Seen, b: &Seen, leverage: f64) -> f64 {
    let turned = (vector::<R>(a.normal) - vector(b.normal)) * R::of(leverage);
    let moved = R::of(a.depth.into()) - R::of(b.depth.into());
    (moved * moved + turned.dot(turned)).sqrt().get()
}

/// The attribute of surfaces that neither mirror nor refract.
pub struct FirstHit<'a, R> {
    lines: SurfaceLines<'a>,
    memo: Memo<Seen>,
    number: PhantomData<R>,
}

impl<'a, R: Real> FirstHit<'a, R> {
    /// The first hits on a surface.
    pub fn new(lines: SurfaceLines<'a>) -> Self {
        Self { lines, memo: Memo::default(), number: PhantomData }
    }

    /// The surface's lines.
    pub fn lines(&self) -> &SurfaceLines<'a> {
        &self.lines
    }
}

impl<R: Real> Attribute for FirstHit<'_, R> {
    type Output = Seen;
    type Real = R;

    fn sample(&self, line: LinePoint) -> Seen {
        self.memo.recall(line, || Seen::along::<R>(&self.lines, line).0)
    }

    fn sampling(&self) -> Sampling {
        self.lines.sampling()
    }

    fn class(&self, output: &Seen) -> u32 {
        output.class
    }

    fn miss(&self) -> Seen {
        Seen::MISS
    }

    fn is_miss(&self, class: u32) -> bool {
        class == Seen::MISS.class
    }

    fn are_joined(&self, lines: [LinePoint; 2], outputs: [&Seen; 2]) -> bool {
        self.lines.are_joined::<R>(lines, outputs)
    }

    /// The paper's distance is that of the rays (point, normal) in line space. On one line that is, but for slopes of at
    /// most 1, how far the points and the normals' ends are apart, box units.
    fn distance(&self, a: &Seen, b: &Seen) -> f64 {
        distance::<R>(a, b, 1.0)
    }

    fn interpolate(&self, parts: &[(R, &Seen)]) -> Seen {
        blended(parts.iter().map(|(weight, seen)| (*weight, *seen)))
    }

    fn direction(&self, output: &Seen) -> Option<Vec3<R>> {
        (output.class != Seen::MISS.class).then(|| vector(output.normal))
    }

    fn is_certainly_empty(&self, pair: PlanePair, cell: &Cell) -> bool {
        self.lines.is_certainly_empty::<R>(pair, cell)
    }
}
