//! How a patch of faces is seen: its points' places, found anew for each block of pixels, as that takes less time than to keep
//! and to fetch them.

use super::patches::Patch;
use super::projection::{Place, Projection};
use super::round;

/// As many as a byte can number.
const POINTS: usize = 256;

/// The points of one patch in the image.
pub struct Aspect {
    x: [f64; POINTS],
    y: [f64; POINTS],
    depth: [f64; POINTS],
    /// Least columns and rows that are not less than the places.
    columns: [i32; POINTS],
    rows: [i32; POINTS],
}

impl Default for Aspect {
    fn default() -> Self {
        Self {
            x: [0.0; POINTS],
            y: [0.0; POINTS],
            depth: [0.0; POINTS],
            columns: [0; POINTS],
            rows: [0; POINTS],
        }
    }
}

impl Aspect {
    /// Looks at a patch; its points are places already, or vertices.
    #[inline(always)]
    pub fn look_at(&mut self, patch: &Patch, projection: &Projection, are_places: bool) {
        let count = patch.points[0].len();
        let (x, y, depth) = (&mut self.x[..count], &mut self.y[..count], &mut self.depth[..count]);
        let [px, py, pz] = patch.points.map(|points| &points[..count]);
        if are_places {
            x.copy_from_slice(px);
            y.copy_from_slice(py);
            depth.copy_from_slice(pz);
        } else if projection.is_cone() {
            project::<true>(projection, [px, py, pz], [x, y, depth]);
        } else {
            project::<false>(projection, [px, py, pz], [x, y, depth]);
        }
        for (ceilings, places) in [(&mut self.columns, &self.x), (&mut self.rows, &self.y)] {
            for (ceiling, place) in ceilings[..count].iter_mut().zip(&places[..count]) {
                *ceiling = round::ceil(*place);
            }
        }
    }

    /// A point's place.
    #[inline(always)]
    pub fn place(&self, point: u8) -> Place {
        let point = point as usize;
        Place { x: self.x[point], y: self.y[point], depth: self.depth[point] }
    }

    /// The ceilings of a point's column and row.
    #[inline(always)]
    pub fn ceilings(&self, point: u8) -> [i32; 2] {
        [self.columns[point as usize], self.rows[point as usize]]
    }

    /// The least and the greatest ceilings of the first `count` points: of columns, and of rows.
    #[inline(always)]
    pub fn extremes(&self, count: usize) -> [[i32; 2]; 2] {
        [&self.columns, &self.rows].map(|ceilings| {
            let mut extremes = [i32::MAX, i32::MIN];
            for &ceiling in &ceilings[..count] {
                extremes = [extremes[0].min(ceiling), extremes[1].max(ceiling)];
            }
            extremes
        })
    }

    /// Whether a line of pixels runs so near, in pixels, to one of the first `count` points.
    #[inline(always)]
    pub fn is_near_a_line(&self, count: usize, near: f64) -> bool {
        let mut is_near = false;
        for places in [&self.x, &self.y] {
            for &place in &places[..count] {
                is_near |= round::nearest(place).1.abs() <= near;
            }
        }
        is_near
    }
}

/// Finds the places of points.
#[inline(always)]
fn project<const CONE: bool>(projection: &Projection, points: [&[f64]; 3], places: [&mut [f64]; 3]) {
    let ([px, py, pz], [x, y, depth]) = (points, places);
    for i in 0..px.len().min(py.len()).min(pz.len()).min(x.len()).min(y.len()).min(depth.len()) {
        let point = projection.homogeneous(glam::DVec3::new(px[i], py[i], pz[i]));
        let place = projection.place_in::<CONE>(point);
        (x[i], y[i], depth[i]) = (place.x, place.y, place.depth);
    }
}
