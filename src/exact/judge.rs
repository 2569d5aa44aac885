//! What engines are held against, by tests and audits: the chords of the bodies parallel to a convex one.

use crate::geometry::{ConvexMesh, Interval, Segment};

/// The length of a segment in a convex body all of whose planes are moved outwards by `shift_mm`.
///
/// An engine that is exact for a surface whose points have moved by no more than a shift gives a length between those of the
/// body moved inwards and outwards by it: a bound that holds at outlines and edges too, where no fixed tolerance does.
pub fn length_in_parallel_body(body: &ConvexMesh, ray: &Segment, shift_mm: f64) -> f64 {
    let (o, d) = (ray.line().origin(), ray.line().dir());
    let (mut start, mut end) = (0.0, ray.length_mm());
    for plane in body.planes() {
        let (height, slope) = (plane.normal.dot(plane.point - o) + shift_mm, plane.normal.dot(d));
        match slope {
            _ if slope > 0.0 => end = f64::min(end, height / slope),
            _ if slope < 0.0 => start = f64::max(start, height / slope),
            _ if height < 0.0 => return 0.0,
            _ => {}
        }
    }
    Interval::new(start, end).map_or(0.0, |chord| chord.length())
}
