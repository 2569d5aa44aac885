//! Cutting smooth bodies: points where cut planes meet the true surface.
//!
//! ```text
//!          ·  ·  ·                 · points of the uncut surface, kept where inside all cuts
//!       ·           ·              ∘ points of the true surface within a cut's plane, found by rays from the
//!      ∘─────∘─────∘─○ cut 1         section's centre, so that the cut face is inscribed in the true section
//!       ╲   ╱   ╱   ╱              ○ where two planes meet the surface: ends of the chord of their common line
//!        · ·  ·   ╱ cut 2
//! ```

use std::f64::consts::TAU;

use glam::{DVec2, DVec3};

use super::body::Body;
use super::frame::Frame;
use super::volume::clip_polygon;
use crate::geometry::{Bounds, Interval, Line, TriMesh, UnitDir};

/// Rays for a section's size and shape, then for its outline. Both only set the spacing of points, which
/// are then placed exactly: 96 and 720 keep spacing even to a few per cent for sections up to 50 times longer than wide.
const SHAPE_RAYS: usize = 96;
const OUTLINE_RAYS: usize = 720;

/// A cut's outline has at least this many points, or a small cut face would be a poor figure.
const LEAST_OUTLINE: usize = 12;

/// Points of the uncut surface nearer to a cut plane than this fraction of the spacing are left out: the outline
/// takes their place, and faces stay fat.
const CLEARANCE: f64 = 0.35;

/// Within this fraction of the body's size of a plane, a point counts as lying in it. Far above the rounding of a
/// chord (some 1e-15), far below any tessellation.
const IN_PLANE: f64 = 1e-10;

/// A half-space: points with `normal · p ≤ offset`; `normal` is of unit length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Cut {
    pub normal: DVec3,
    pub offset: f64,
}

impl Cut {
    /// How far `p` is beyond the plane, mm.
    pub fn height(&self, p: DVec3) -> f64 {
        self.normal.dot(p) - self.offset
    }

    /// The part of a line in the half-space.
    pub fn chord(&self, line: &Line) -> Option<Interval> {
        let (height, climb) = (self.height(line.origin()), self.normal.dot(line.dir()));
        let crossing = -height / climb;
        if climb == 0.0 || !crossing.is_finite() {
            (height <= 0.0).then_some(Interval::EVERYTHING)
        } else if climb > 0.0 {
            Interval::new(f64::NEG_INFINITY, crossing)
        } else {
            Interval::new(crossing, f64::INFINITY)
        }
    }

    /// Puts a point that lies in the plane up to rounding into it exactly, where the plane is across an axis.
    fn snap(&self, mut p: DVec3) -> DVec3 {
        for axis in 0..3 {
            if self.normal[axis].abs() == 1.0 {
                p[axis] = self.offset * self.normal[axis];
            }
        }
        p
    }
}

/// The body in its place with its cuts: what points are asked of.
pub(super) struct CutBody<'a> {
    pub body: &'a Body,
    pub frame: Frame,
    pub cuts: &'a [Cut],
}

/// Everything about the cuts of a body that does not depend on the spacing.
pub(super) struct CutPlan<'a> {
    whole: &'a CutBody<'a>,
    /// The body's size, mm.
    extent: f64,
    /// Cuts and flat sides, organ coordinates; cuts first.
    planes: Vec<Cut>,
    sections: Vec<Section>,
    /// Ends of the common lines of two planes, with the planes they lie in.
    corners: Vec<(DVec3, [usize; 2])>,
}

/// The face a cut leaves: its plane, a point within, and its outline as lengths over directions.
struct Section {
    plane: usize,
    centre: DVec3,
    /// In-plane vectors: directions are `cos φ · long + sin φ · short`.
    long: DVec3,
    short: DVec3,
    /// The outline's length from direction 0 up to each of [`OUTLINE_RAYS`] directions, and once around.
    lengths: Vec<f64>,
}

impl CutBody<'_> {
    /// The line's part in the cut body, mm; `ignored` are local half-spaces of the body, `skipped` indices of cuts.
    pub fn chord(&self, line: &Line, ignored: &[Cut], skipped: &[usize]) -> Option<Interval> {
        let local = self.frame.line_to_local(line)?;
        let chord = self.body.chord(&local, ignored)?;
        let cuts = self.cuts.iter().enumerate().filter(|(i, _)| !skipped.contains(i));
        cuts.map(|(_, cut)| cut.chord(line)).try_fold(chord, |sofar, part| sofar.intersection(&part?))
    }

    /// How far the true surface is from `p` in the cut body along `direction`, mm.
    pub fn distance_to_surface(&self, p: DVec3, direction: DVec3) -> f64 {
        let line = UnitDir::new(direction).and_then(|d| Line::new(p, d));
        line.and_then(|l| self.chord(&l, &[], &[])).map_or(0.0, |chord| chord.end().max(0.0))
    }
}

impl<'a> CutPlan<'a> {
    /// `rough` is an inscribed mesh of the uncut body, organ coordinates; it tells where each plane meets the body.
    pub fn new(whole: &'a CutBody<'a>, rough: &TriMesh) -> Self {
        let flat_sides = whole.body.flat_sides.iter().map(|side| whole.frame.cut_to_organ(side));
        let planes: Vec<Cut> = whole.cuts.iter().copied().chain(flat_sides).collect();
        let extent = Bounds::of(rough.vertices.iter().copied()).diagonal();
        let mut plan = Self { whole, extent, planes, sections: Vec::new(), corners: Vec::new() };
        plan.sections = (0..whole.cuts.len()).filter_map(|i| plan.section(i, rough)).collect();
        plan.corners = plan.find_corners(rough.bounds().centre());
        plan
    }

    /// The cut body's points, given those of the uncut surface at this spacing.
    pub fn points(&self, uncut: &[DVec3], spacing_mm: f64) -> Vec<DVec3> {
        let clearance = CLEARANCE * spacing_mm;
        let cuts = self.whole.cuts;
        let kept = |p: &&DVec3| {
            cuts.iter().enumerate().all(|(i, cut)| {
                // A cut that leaves no face only takes what is beyond it.
                let margin = if self.sections.iter().any(|s| s.plane == i) { -clearance } else { 0.0 };
                cut.height(**p) <= margin
            })
        };
        let mut points: Vec<DVec3> = uncut.iter().filter(kept).copied().collect();
        for section in &self.sections {
            points.extend(self.outline(section, spacing_mm));
        }
        points.extend(self.corners.iter().map(|&(p, _)| p));
        points
    }

    fn section(&self, plane: usize, rough: &TriMesh) -> Option<Section> {
        let cut = self.planes[plane];
        let (e1, e2) = in_plane_axes(cut.normal);
        let centre = self.section_centre(plane, rough, e1, e2)?;
        let mut section = Section { plane, centre, long: e1, short: e2, lengths: Vec::new() };
        let around = |n: usize| (0..n).map(move |i| TAU * i as f64 / n as f64);
        let outline: Vec<DVec2> = around(SHAPE_RAYS)
            .map(|angle| self.exit(&section, angle) - centre)
            .map(|v| DVec2::new(v.dot(e1), v.dot(e2)))
            .collect();
        (section.long, section.short) = principal_axes(&outline, e1, e2);
        let points: Vec<DVec3> = around(OUTLINE_RAYS).map(|angle| self.exit(&section, angle)).collect();
        section.lengths.push(0.0);
        for i in 0..OUTLINE_RAYS {
            let step = points[i].distance(points[(i + 1) % OUTLINE_RAYS]);
            section.lengths.push(section.lengths[i] + step);
        }
        (section.lengths[OUTLINE_RAYS] > 0.0).then_some(section)
    }

    /// A point well within the plane's section of the body and of all other cuts. `None` if there is no section.
    fn section_centre(&self, plane: usize, rough: &TriMesh, e1: DVec3, e2: DVec3) -> Option<DVec3> {
        let cut = self.planes[plane];
        let base = cut.offset * cut.normal;
        let mut crossings = Vec::new();
        for [a, b, c] in rough.triangles() {
            for (p, q) in [(a, b), (b, c), (c, a)] {
                let (hp, hq) = (cut.height(p), cut.height(q));
                // Each edge is met twice, once each way; one is enough.
                if hp <= 0.0 && hq > 0.0 {
                    let crossing = p + (hp / (hp - hq)) * (q - p) - base;
                    crossings.push(DVec2::new(crossing.dot(e1), crossing.dot(e2)));
                }
            }
        }
        let mean = crossings.iter().sum::<DVec2>() / crossings.len().max(1) as f64;
        crossings.sort_by(|p, q| (*p - mean).to_angle().total_cmp(&(*q - mean).to_angle()));
        let mut polygon: Vec<[f64; 2]> = crossings.iter().map(|p| [p.x, p.y]).collect();
        for (i, other) in self.whole.cuts.iter().enumerate().filter(|&(i, _)| i != plane) {
            let normal = [other.normal.dot(e1), other.normal.dot(e2)];
            // Of two cuts in one plane, the first makes the face.
            let doubled =
                self.planes[i].normal.dot(cut.normal) > 0.0 && normal[0].hypot(normal[1]) <= IN_PLANE;
            if doubled && (other.height(base) < 0.0 || i > plane) {
                continue;
            }
            polygon = clip_polygon(&polygon, normal, -other.height(base));
        }
        let centroid = polygon_centroid(&polygon, (IN_PLANE * self.extent).powi(2))?;
        Some(cut.snap(base + centroid[0] * e1 + centroid[1] * e2))
    }

    /// Where the ray from the section's centre leaves the cut body within the plane.
    fn exit(&self, section: &Section, angle: f64) -> DVec3 {
        let direction = angle.cos() * section.long + angle.sin() * section.short;
        let line = UnitDir::new(direction).and_then(|d| Line::new(section.centre, d));
        let exit = line.and_then(|l| {
            let chord = self.whole.chord(&l, &[], &[section.plane])?;
            Some(l.at(chord.end().max(0.0)))
        });
        self.planes[section.plane].snap(exit.unwrap_or(section.centre))
    }

    /// Points of a section's outline on the curved surface: evenly spaced, straight stretches left out.
    fn outline(&self, section: &Section, spacing_mm: f64) -> Vec<DVec3> {
        let total = section.lengths[OUTLINE_RAYS];
        let count = ((total / spacing_mm).ceil() as usize).max(LEAST_OUTLINE);
        let near = IN_PLANE * self.extent;
        let in_other_plane = |p: DVec3| {
            self.planes.iter().enumerate().any(|(i, pl)| i != section.plane && pl.height(p).abs() <= near)
        };
        let mut loop_points: Vec<(f64, DVec3, bool)> = (0..count)
            .map(|i| section.direction_at(total * i as f64 / count as f64))
            .map(|angle| (angle, self.exit(section, angle), false))
            .filter(|&(_, p, _)| !in_other_plane(p))
            .collect();
        let own_corners = self.corners.iter().filter(|(_, planes)| planes.contains(&section.plane));
        loop_points.extend(own_corners.map(|&(p, _)| (section.direction_of(p), p, true)));
        loop_points.sort_by(|a, b| a.0.total_cmp(&b.0));
        without_collinear(&loop_points, near)
    }

    fn find_corners(&self, middle: DVec3) -> Vec<(DVec3, [usize; 2])> {
        let cuts = self.whole.cuts.len();
        let mut corners = Vec::new();
        for i in 0..cuts {
            for j in i + 1..self.planes.len() {
                let Some(line) = common_line(&self.planes[i], &self.planes[j], middle) else { continue };
                let ignored: Vec<Cut> =
                    j.checked_sub(cuts).map(|side| self.whole.body.flat_sides[side]).into_iter().collect();
                let Some(chord) = self.whole.chord(&line, &ignored, &[i, j]) else { continue };
                if chord.length() > IN_PLANE * self.extent && chord.length().is_finite() {
                    let snap = |p: DVec3| self.planes[j].snap(self.planes[i].snap(p));
                    corners.push((snap(line.at(chord.start())), [i, j]));
                    corners.push((snap(line.at(chord.end())), [i, j]));
                }
            }
        }
        corners
    }
}

impl Section {
    /// The direction up to which the outline has this length.
    fn direction_at(&self, length: f64) -> f64 {
        let i = self.lengths.partition_point(|&l| l <= length).clamp(1, OUTLINE_RAYS);
        let step = self.lengths[i] - self.lengths[i - 1];
        let share = if step > 0.0 { (length - self.lengths[i - 1]) / step } else { 0.0 };
        TAU * (i as f64 - 1.0 + share) / OUTLINE_RAYS as f64
    }

    fn direction_of(&self, p: DVec3) -> f64 {
        let v = p - self.centre;
        let (u, w) =
            (v.dot(self.long) / self.long.length_squared(), v.dot(self.short) / self.short.length_squared());
        w.atan2(u).rem_euclid(TAU)
    }
}

/// Two unit vectors that span the plane; along the axes if the normal is.
fn in_plane_axes(normal: DVec3) -> (DVec3, DVec3) {
    let axis = (0..3).find(|&i| normal[i].abs() == 1.0);
    match axis {
        Some(0) => (DVec3::Y, DVec3::Z),
        Some(1) => (DVec3::Z, DVec3::X),
        Some(_) => (DVec3::X, DVec3::Y),
        None => normal.any_orthonormal_pair(),
    }
}

/// The outline's principal axes, each as long as its spread, so that even steps of the angle are near even steps of
/// length on an ellipse.
fn principal_axes(outline: &[DVec2], e1: DVec3, e2: DVec3) -> (DVec3, DVec3) {
    let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
    for p in outline {
        (xx, xy, yy) = (xx + p.x * p.x, xy + p.x * p.y, yy + p.y * p.y);
    }
    let angle = 0.5 * (2.0 * xy).atan2(xx - yy);
    let (sin, cos) = angle.sin_cos();
    let long = xx * cos * cos + 2.0 * xy * cos * sin + yy * sin * sin;
    let short = (xx + yy - long).max(1e-6 * long);
    (long.sqrt() * (cos * e1 + sin * e2), short.sqrt() * (cos * e2 - sin * e1))
}

/// The centroid of a convex polygon. `None` if its area is not above `least_area`.
fn polygon_centroid(polygon: &[[f64; 2]], least_area: f64) -> Option<[f64; 2]> {
    let first = *polygon.first()?;
    let (mut area, mut moment) = (0.0, [0.0, 0.0]);
    for pair in polygon[1..].windows(2) {
        let [u, v] = [pair[0], pair[1]].map(|p| [p[0] - first[0], p[1] - first[1]]);
        let twice = u[0] * v[1] - u[1] * v[0];
        area += 0.5 * twice;
        moment = [moment[0] + twice * (u[0] + v[0]) / 6.0, moment[1] + twice * (u[1] + v[1]) / 6.0];
    }
    (area.abs() > least_area).then(|| [first[0] + moment[0] / area, first[1] + moment[1] / area])
}

/// The line two planes share, through its point nearest to `middle`. `None` if they are parallel.
fn common_line(a: &Cut, b: &Cut, middle: DVec3) -> Option<Line> {
    let along = a.normal.cross(b.normal);
    let sine_squared = along.length_squared();
    if sine_squared <= IN_PLANE {
        return None;
    }
    let cosine = a.normal.dot(b.normal);
    let (ha, hb) = (a.height(middle), b.height(middle));
    let point = middle
        - ((ha - cosine * hb) / sine_squared) * a.normal
        - ((hb - cosine * ha) / sine_squared) * b.normal;
    Line::new(point, UnitDir::new(along)?)
}

/// The points of a convex loop that are not corners, without those on the straight line between their neighbours.
fn without_collinear(points: &[(f64, DVec3, bool)], near_mm: f64) -> Vec<DVec3> {
    let n = points.len();
    let mut kept = Vec::new();
    // The neighbour before: the last point kept, or, for the first, the loop's last.
    let mut before = match points.last() {
        Some(&(_, p, _)) => p,
        None => return kept,
    };
    for (i, &(_, p, is_corner)) in points.iter().enumerate() {
        let after = points[(i + 1) % n].1;
        let along = (after - before).normalize_or_zero();
        let off_line = (p - before).cross(along).length();
        if is_corner || off_line > near_mm {
            before = p;
            if !is_corner {
                kept.push(p);
            }
        }
    }
    kept
}
