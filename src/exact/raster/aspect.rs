//! How a patch of faces is seen: its points' places, and what follows from them for each face. Found anew for each block of
//! pixels, as that takes less time than to keep and to fetch it.
//!
//! All is done for as many faces at a time as the machine's instructions take: one list for each number of a face.

use super::face::{Care, Slope};
use super::patches::{MOST_FACES, MOST_POINTS, Patch};
use super::pixels::Pixels;
use super::projection::{Place, Projection};
use super::small::SMALL;
use crate::exact::round;
use crate::geometry::numeric::{greater, lesser};

/// As many as a byte can number.
const POINTS: usize = 256;
const _: () = assert!(MOST_POINTS <= POINTS);

/// A number of each face.
type OfFaces = [f64; MOST_FACES];

/// One patch in the image.
pub struct Aspect {
    /// Columns, rows and depths of the points.
    points: [[f64; POINTS]; 3],
    /// The same of each face's corners.
    pub corners: [[OfFaces; 3]; 3],
    /// Ceilings of the corners' columns and rows: the least and the greatest.
    pub low: [OfFaces; 2],
    pub high: [OfFaces; 2],
    /// Slopes of depth by column and by row.
    pub slopes: [OfFaces; 2],
    /// Depths that crossings are kept between.
    pub lowest: OfFaces,
    pub highest: OfFaces,
    /// Twice the areas, in pixels, positive if corners turn from columns to rows.
    pub areas: OfFaces,
    /// 1 for faces of few pixels, some of the block, that need no care; 0 for others.
    pub small: OfFaces,
    /// Whether the slopes are right.
    is_sure: [bool; MOST_FACES],
    is_near: [bool; MOST_FACES],
    /// Faces that may cover pixels of the block: the first so many.
    near: [u8; MOST_FACES],
    near_count: usize,
}

impl Default for Aspect {
    fn default() -> Self {
        const NONE: OfFaces = [0.0; MOST_FACES];
        Self {
            points: [[0.0; POINTS]; 3],
            corners: [[NONE; 3]; 3],
            low: [NONE; 2],
            high: [NONE; 2],
            slopes: [NONE; 2],
            lowest: NONE,
            highest: NONE,
            areas: NONE,
            small: NONE,
            is_sure: [false; MOST_FACES],
            is_near: [false; MOST_FACES],
            near: [0; MOST_FACES],
            near_count: 0,
        }
    }
}

impl Aspect {
    /// Finds the places of a patch's points; they may stand there already.
    #[inline(always)]
    pub fn place_points(&mut self, patch: &Patch, projection: &Projection, are_places: bool) {
        let count = patch.points[0].len();
        let [x, y, depth] = self.points.each_mut().map(|of| &mut of[..count]);
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
    }

    /// Looks at the faces of the patch whose points have places, and lists those that may cover pixels of a block; but if so
    /// asked not [`small`](Self::small) ones, which are told apart then.
    #[inline(always)]
    pub fn look_at_faces<const PART_SMALL: bool>(
        &mut self,
        patch: &Patch,
        block: &Pixels,
        care: Care,
        limits: [f64; 2],
    ) {
        for (face, &[a, b, c]) in patch.corners.iter().enumerate().take(MOST_FACES) {
            for (axis, points) in self.points.iter().enumerate() {
                self.corners[0][axis][face] = points[a as usize];
                self.corners[1][axis][face] = points[b as usize];
                self.corners[2][axis][face] = points[c as usize];
            }
        }
        self.find_boxes(block);
        self.find_slopes(care, limits);
        if PART_SMALL {
            self.part_small(patch.corners.len());
        }
        self.near_count = 0;
        // Where all are small there are none to list.
        if PART_SMALL && !self.is_near.iter().fold(false, |any, is_near| any | is_near) {
            return;
        }
        for face in 0..patch.corners.len() {
            self.near[self.near_count] = face as u8;
            self.near_count += usize::from(self.is_near[face]);
        }
    }

    #[inline(always)]
    fn find_boxes(&mut self, block: &Pixels) {
        let [[ax, ay, _], [bx, by, _], [cx, cy, _]] = &self.corners;
        for (axis, [a, b, c]) in [[ax, bx, cx], [ay, by, cy]].into_iter().enumerate() {
            let (low, high) = (&mut self.low[axis], &mut self.high[axis]);
            for i in 0..MOST_FACES {
                let [a, b, c] = [a[i], b[i], c[i]].map(round::ceiling);
                low[i] = lesser(a, lesser(b, c));
                high[i] = greater(a, greater(b, c));
            }
        }
        let [left, right, top, bottom] =
            [block.columns.start, block.columns.end, block.rows.start, block.rows.end].map(f64::from);
        let ([low_column, low_row], [high_column, high_row]) = (&self.low, &self.high);
        for i in 0..MOST_FACES {
            let columns = greater(low_column[i], left) < lesser(high_column[i], right);
            let rows = greater(low_row[i], top) < lesser(high_row[i], bottom);
            self.is_near[i] = columns & rows;
        }
    }

    #[inline(always)]
    fn find_slopes(&mut self, care: Care, limits: [f64; 2]) {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = &self.corners;
        let [per_column, per_row] = &mut self.slopes;
        for i in 0..MOST_FACES {
            let a = Place { x: ax[i], y: ay[i], depth: az[i] };
            let b = Place { x: bx[i], y: by[i], depth: bz[i] };
            let c = Place { x: cx[i], y: cy[i], depth: cz[i] };
            let (slope, is_sure) = Slope::new([&a, &b, &c], care, limits);
            per_column[i] = slope.per_column;
            per_row[i] = slope.per_row;
            self.lowest[i] = slope.lowest;
            self.highest[i] = slope.highest;
            self.areas[i] = (b.x - a.x) * (c.y - a.y) - (c.x - a.x) * (b.y - a.y);
            self.is_sure[i] = is_sure;
        }
    }

    /// Tells the small ones of the first `count` faces from the others.
    #[inline(always)]
    fn part_small(&mut self, count: usize) {
        let ([left, top], [right, bottom]) = (&self.low, &self.high);
        for i in 0..MOST_FACES {
            let is_small =
                (right[i] - left[i] <= f64::from(SMALL)) & (bottom[i] - top[i] <= f64::from(SMALL));
            let is_small = is_small & self.is_near[i] & self.is_sure[i];
            self.small[i] = if is_small { 1.0 } else { 0.0 };
            self.is_near[i] &= !is_small;
        }
        self.small[count..].fill(0.0);
    }

    /// How many faces may cover pixels of the block.
    #[inline(always)]
    pub fn near_count(&self) -> usize {
        self.near_count
    }

    /// One of them.
    #[inline(always)]
    pub fn near(&self, i: usize) -> usize {
        self.near[i] as usize
    }

    /// The places of some point.
    #[inline(always)]
    pub fn place_of_point(&self, point: u8) -> Place {
        let [x, y, depth] = self.points.each_ref().map(|of| of[point as usize]);
        Place { x, y, depth }
    }

    /// The place of a face's corner.
    #[inline(always)]
    pub fn corner(&self, face: usize, corner: usize) -> Place {
        let [x, y, depth] = self.corners[corner].each_ref().map(|of| of[face]);
        Place { x, y, depth }
    }

    /// A face's slope.
    #[inline(always)]
    pub fn slope(&self, face: usize) -> Slope {
        let [per_column, per_row] = self.slopes.each_ref().map(|of| of[face]);
        let (lowest, highest) = (self.lowest[face], self.highest[face]);
        Slope { base: self.corner(face, 0), per_column, per_row, lowest, highest }
    }

    /// Whether that is right.
    #[inline(always)]
    pub fn is_sure(&self, face: usize) -> bool {
        self.is_sure[face]
    }

    /// The pixels in whose columns and rows a face may cover any.
    #[inline(always)]
    pub fn pixels(&self, face: usize) -> Pixels {
        let range = |axis: usize| self.low[axis][face] as i32..self.high[axis][face] as i32;
        Pixels { columns: range(0), rows: range(1) }
    }

    /// The pixels in whose columns and rows any face may cover some, of the first `count` points.
    #[inline(always)]
    pub fn pixels_of_points(&self, count: usize) -> Pixels {
        let range = |points: &[f64]| {
            let (mut least, mut greatest) = (i32::MAX, i32::MIN);
            for &place in &points[..count] {
                let ceiling = round::ceil(place);
                (least, greatest) = (least.min(ceiling), greatest.max(ceiling));
            }
            least..greatest
        };
        Pixels { columns: range(&self.points[0]), rows: range(&self.points[1]) }
    }

    /// Whether a line of pixels runs so near, in pixels, to one of the first `count` points.
    #[inline(always)]
    pub fn is_near_a_line(&self, count: usize, near: f64) -> bool {
        let mut is_near = false;
        for places in &self.points[..2] {
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
