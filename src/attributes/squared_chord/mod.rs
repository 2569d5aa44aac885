//! The squared chord: smooth where the chord itself is steep.
//!
//! ```text
//!    L ▲   ╭────╮         L² ▲    ╭──╮          A chord's length falls to zero with an infinite slope at the outline of
//!      │  │      │           │   ╱    ╲         a smooth body, its square with a finite one, and smoothly beyond. So the
//!      │  │      │           │  ╱      ╲        square is fitted, and the root taken at the end.
//!      └──┴──────┴──▶        └─╱────────╲──▶
//! ```
//!
//! Lines are given by their intercepts in a frame in which the body is about a ball (`LineFrame`). There, with λ from 0 to 1
//! between the planes, d the line's part between them and b its distance from the middle of a ball of radius r,
//!
//!   F = |d|⁴ (λ_out − λ_in)² = 4 |d|² (r² − b²)
//!
//! is a polynomial of degree 4 with small higher terms for an ellipsoid, and nearly one for a body that is like
//! an ellipsoid. A cell's F is one cubic, fitted to exact chords of the lines that hit.
//!
//! **The error.** Other lines, which take no part in the fit, say how far F may be off: by δ. The length L = √F · |d in mm| / |d|²
//! is then off by about δ |d in mm| / (2 |d|² √F). Where that exceeds the tolerance, F is below the leaf's threshold and the
//! line is traced exactly: a narrow band along the outline. So one number, a length in mm, says where cells are split, which
//! lines are traced, and how good the others are.
//!
//! **Few faces.** Along creases and on flat faces no cubic serves, but few faces are in sight: such cells keep the planes of
//! all of them (`planes`), by which their lines are clipped exactly.
//!
//! **What is proved.** That a cell is empty, that a pixel lies beyond the body's outline, and that a line passes by a ball around
//! the body. Any other line of a cell that some lines hit is taken to miss only by clipping: it is known, or traced.
//!
//! **Bodies that are not convex** have several chords on some lines, F stands for the square of their sum, and a thin part
//! between a cell's samples could go unseen. So a cell is fitted only if all its lines cross the surface equally often, which
//! is proved from the faces in its shaft (`shaft`); lines of all others are traced.

mod batch;
mod cubic;
mod fit;
mod image;
mod outline;
mod planes;
mod samples;
mod shaft;
#[cfg(test)]
mod tests;

use glam::{DMat3, DVec3};

use crate::exact::walk::Walker;
use crate::exact::{Body, Engine};
use crate::geometry::{Interval, Line};
use crate::linespace::{LineFrame, PlanePair, is_in_range, squared_span};
pub use batch::Asked;
use cubic::Cubic;
pub use image::{ImageChords, ImageLengths, Run, places_of};

/// Fits the squared chord of one body.
pub struct SquaredChord<'a> {
    body: &'a Body,
    engine: Engine,
    frame: LineFrame,
    tolerance_mm: f64,
    wants_places: bool,
    first_level: u32,
    /// Cells of this level are split no more.
    deepest_level: u32,
    /// The error of F that facets make, which no split mends.
    noise: f64,
    /// Whether facets or edges leave next to nothing to be known within the tolerance.
    is_hopeless: bool,
}

/// What answers the lines of a final cell. The order of these is part of the format of [kept](crate::ritree::kept) trees.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[expect(clippy::large_enum_variant, reason = "nearly all leaves are models, and the tree boxes each")]
pub enum ChordLeaf {
    /// No line meets the body, proved.
    Empty,
    /// All lines are traced.
    Traced,
    /// Lines are clipped by these planes of the body, by their places among all of its planes.
    Planes(Box<[u32]>),
    /// F is known, where it is not below a threshold.
    Model(ChordModel),
}

/// F in one cell.
#[derive(Clone, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ChordModel {
    centre: [f64; 4],
    /// From intercepts about the centre to the cell's local coordinates.
    scale: f64,
    cubic: Cubic,
    /// Lines with smaller F are traced.
    threshold: f64,
    /// |d|² times λ in the middle of the chord, where places are wanted.
    middle: Option<Box<Cubic>>,
}

impl ChordModel {
    #[inline(always)]
    fn local(&self, stuv: &[f64; 4]) -> [f64; 4] {
        std::array::from_fn(|a| (stuv[a] - self.centre[a]) * self.scale)
    }

    #[inline(always)]
    fn at(&self, stuv: &[f64; 4]) -> f64 {
        self.cubic.at(&self.local(stuv)) + quartic(stuv)
    }
}

/// The part of F that no cubic has, if the body is a ball in the frame: of 4 |d|² (r² − b²), where |d|² b² is the squared
/// moment of the line about the middle of the cube.
#[inline(always)]
fn quartic(stuv: &[f64; 4]) -> f64 {
    let [s, t, u, v] = stuv.map(|x| x - 0.5);
    let across = s * v - t * u;
    -4.0 * (across * across)
}

/// What is known of a line without tracing it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Known {
    /// It misses, proved.
    Miss,
    /// The length of its chord, mm.
    Length(f64),
    /// Nothing: it is to be traced.
    Nothing,
}

/// Whether a line with such intercepts may meet the box. What overflowed is in no range, but that proves no miss.
#[inline]
fn may_meet(stuv: &[f64; 4]) -> bool {
    is_in_range(stuv) || stuv.iter().any(|x| !x.is_finite())
}

/// The frame of a map that makes about a ball of radius 1 of a body.
fn frame_of(body: &Body, middle: DVec3, to_ball: DMat3) -> Option<LineFrame> {
    // A hundredth more does no harm.
    let reach = |axis: DVec3| {
        let normal = to_ball.transpose() * axis;
        body.surface().height_bound(normal, middle, 0.0, 0.01).0
    };
    let high = DVec3::new(reach(DVec3::X), reach(DVec3::Y), reach(DVec3::Z));
    let low = -DVec3::new(reach(-DVec3::X), reach(-DVec3::Y), reach(-DVec3::Z));
    LineFrame::new(middle, to_ball, low, high)
}

impl<'a> SquaredChord<'a> {
    /// The chords of `body` to within `tolerance_mm`; with `wants_places`, also where they lie. `None` if the body is too
    /// flat to have a frame.
    pub fn new(body: &'a Body, tolerance_mm: f64, wants_places: bool) -> Option<Self> {
        let (middle, to_ball) = body.ball_frame();
        let by_box = || DMat3::from_diagonal(DVec3::splat(2.0 / body.bounds().size().max_element()));
        let frame = frame_of(body, middle, to_ball).or_else(|| frame_of(body, middle, by_box()))?;
        let engine = body.engine_for_rays();
        let fitter = Self {
            body,
            engine,
            frame,
            tolerance_mm,
            wants_places,
            first_level: 0,
            deepest_level: 0,
            noise: 0.0,
            is_hopeless: false,
        };
        Some(fitter.with_first_level())
    }

    fn is_convex(&self) -> bool {
        self.body.convexity().is_ok()
    }

    /// The frame of its lines.
    pub fn frame(&self) -> &LineFrame {
        &self.frame
    }

    /// The line's place among the leaves. `None` if it passes the body's box by.
    #[inline]
    pub fn place_of(&self, line: &Line) -> Option<(PlanePair, [f64; 4])> {
        let (axis, stuv) = self.frame.place(line.origin().to_array(), line.dir().to_array());
        may_meet(&stuv).then_some((LineFrame::pair(axis as usize), stuv))
    }

    /// What a leaf knows of a line at `stuv`.
    #[inline]
    pub fn known(&self, leaf: &ChordLeaf, line: &Line, pair: PlanePair, stuv: &[f64; 4]) -> Known {
        let known = match leaf {
            ChordLeaf::Empty => return Known::Miss,
            ChordLeaf::Traced => Known::Nothing,
            ChordLeaf::Planes(few) => {
                return self.clip(few, line, pair).map_or(Known::Miss, |c| Known::Length(c.length()));
            }
            ChordLeaf::Model(model) => {
                let f = model.at(stuv);
                // Written so that NaN is traced.
                if f >= model.threshold {
                    // |d in mm| is 1 over what the line's direction advances from plane to plane.
                    let [k, ..] = pair.axes();
                    let advance = self.frame.advance(k, line.dir()).abs();
                    return Known::Length(f.sqrt() / (squared_span(stuv) * advance));
                }
                Known::Nothing
            }
        };
        // In cells along the outline, most lines that are not known pass even a ball around the body by.
        let passes_by = |walker: &Walker| walker.passes_by(line.origin(), line.dir());
        if self.body.walker().is_some_and(passes_by) { Known::Miss } else { known }
    }

    /// Where along a line the middle of its chord lies, mm from the line's origin. `None` if the leaf does not know.
    pub fn middle_mm(&self, leaf: &ChordLeaf, line: &Line, pair: PlanePair, stuv: &[f64; 4]) -> Option<f64> {
        let model = match leaf {
            ChordLeaf::Model(model) => model,
            ChordLeaf::Planes(few) => {
                return self.clip(few, line, pair).map(|chord| 0.5 * (chord.start() + chord.end()));
            }
            ChordLeaf::Empty | ChordLeaf::Traced => return None,
        };
        let middle = model.middle.as_ref()?.at(&model.local(stuv)) / squared_span(stuv);
        let [k, ..] = pair.axes();
        Some((middle - self.frame.point(line.origin())[k]) / self.frame.vector(line.dir())[k])
    }

    /// As [`known`](Self::known), as a part of the line; of no length if it misses. `None` if the line is to be traced.
    pub fn chord(
        &self,
        leaf: &ChordLeaf,
        line: &Line,
        pair: PlanePair,
        stuv: &[f64; 4],
    ) -> Option<Option<Interval>> {
        match self.known(leaf, line, pair, stuv) {
            Known::Miss => Some(None),
            Known::Nothing => None,
            Known::Length(length) => {
                // Without places, a chord is as good anywhere.
                let middle = self.middle_mm(leaf, line, pair, stuv).unwrap_or(0.5 * length);
                Some(Interval::new(middle - 0.5 * length, middle + 0.5 * length).filter(|c| c.length() > 0.0))
            }
        }
    }
}
