//! Images in memory, and where their pixels are in space.

use std::io::{self, Write};

use glam::DVec3;

use crate::{Error, Result};

/// Pixels in rows, the first row at the top.
#[derive(Clone, Debug, PartialEq)]
pub struct Image<T> {
    columns: usize,
    rows: usize,
    pixels: Vec<T>,
}

/// An image of single-precision numbers: a transmission, a projection value p, a length in mm.
pub type FloatImage = Image<f32>;

impl<T> Image<T> {
    /// The image of `columns` × `rows` pixels, row after row.
    ///
    /// # Errors
    /// If a side is 0 or beyond 2³¹ − 1 (what PNG can say), or if there are not `columns · rows` pixels.
    pub fn new(columns: usize, rows: usize, pixels: Vec<T>) -> Result<Self> {
        const LONGEST_SIDE: usize = i32::MAX as usize;
        let sides_fit = (1..=LONGEST_SIDE).contains(&columns) && (1..=LONGEST_SIDE).contains(&rows);
        if !sides_fit || columns.checked_mul(rows) != Some(pixels.len()) {
            return Err(Error::input(
                "image",
                format!("{} pixels do not make {columns} columns of {rows} rows", pixels.len()),
                "give both sides from 1 to 2147483647 and one value per pixel",
            ));
        }
        Ok(Self { columns, rows, pixels })
    }

    /// Pixels in a row.
    pub fn columns(&self) -> usize {
        self.columns
    }

    /// Pixels in a column.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// All pixels, row after row from the top.
    pub fn pixels(&self) -> &[T] {
        &self.pixels
    }

    /// All pixels, to be changed in place.
    pub fn pixels_mut(&mut self) -> &mut [T] {
        &mut self.pixels
    }

    /// The pixel in a column and a row, both counted from 0. `None` outside the image.
    pub fn get(&self, column: usize, row: usize) -> Option<&T> {
        (column < self.columns).then(|| self.pixels.get(row * self.columns + column)).flatten()
    }

    /// The rows from the top, each a slice of `columns` pixels.
    pub fn each_row(&self) -> impl ExactSizeIterator<Item = &[T]> {
        self.pixels.chunks_exact(self.columns)
    }
}

impl FloatImage {
    /// Writes all pixels as little-endian 32-bit floats, row after row; one row at a time is copied.
    pub(super) fn write_little_endian(&self, out: &mut dyn Write) -> io::Result<()> {
        let mut bytes = Vec::with_capacity(4 * self.columns);
        for row in self.each_row() {
            bytes.clear();
            bytes.extend(row.iter().flat_map(|value| value.to_le_bytes()));
            out.write_all(&bytes)?;
        }
        Ok(())
    }
}

/// Where an image's pixels are, in the patient frame (DICOM LPS: +x left, +y posterior, +z superior), mm.
///
/// ```text
/// origin ──► column axis (pixel to pixel within a row)
///   │
///   ▼ row axis (row to row)              normal = column axis × row axis
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    origin_mm: DVec3,
    axes: [DVec3; 3],
    spacing_mm: [f64; 3],
}

impl Geometry {
    /// The geometry of an image whose first pixel has its centre at `origin_mm`, whose columns advance along
    /// `column_axis` and rows along `row_axis`, unit vectors at a right angle. `spacing_mm` is the distance of
    /// neighbouring pixel centres along the column axis, along the row axis, and the slice's thickness.
    ///
    /// # Errors
    /// If a number is not finite, a spacing not positive, an axis not of length 1 or the axes not at a right
    /// angle, within 10⁻⁹.
    pub fn new(origin_mm: DVec3, column_axis: DVec3, row_axis: DVec3, spacing_mm: [f64; 3]) -> Result<Self> {
        /// A micrometre over a kilometre; unit vectors made in f64 are exact to some 10⁻¹⁶.
        const AXIS_TOLERANCE: f64 = 1e-9;
        let refused = |problem: String, remedy: &str| Error::input("image geometry", problem, remedy);
        if !origin_mm.is_finite() {
            return Err(refused(format!("the origin is {origin_mm}"), "give finite coordinates in mm"));
        }
        if !spacing_mm.iter().all(|s| s.is_finite() && *s > 0.0) {
            return Err(refused(
                format!("the spacing is {spacing_mm:?} mm"),
                "give three positive distances in mm",
            ));
        }
        let deviations =
            [column_axis.length() - 1.0, row_axis.length() - 1.0, column_axis.dot(row_axis)].map(f64::abs);
        // Written so that NaN is refused as well.
        if !deviations.iter().all(|d| *d <= AXIS_TOLERANCE) {
            return Err(refused(
                format!("the axes {column_axis} and {row_axis} are not unit vectors at a right angle"),
                "give directions of length 1 that are perpendicular",
            ));
        }
        Ok(Self { origin_mm, axes: [column_axis, row_axis, column_axis.cross(row_axis)], spacing_mm })
    }

    /// The centre of the first pixel, mm.
    pub fn origin_mm(&self) -> DVec3 {
        self.origin_mm
    }

    /// Unit vectors: along which columns advance, along which rows advance, and their cross product.
    pub fn axes(&self) -> [DVec3; 3] {
        self.axes
    }

    /// Distances of neighbouring pixel centres along the axes, mm; the third is the slice's thickness.
    pub fn spacing_mm(&self) -> [f64; 3] {
        self.spacing_mm
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_counted_from_the_top_and_columns_from_the_left() {
        let image = Image::new(3, 2, vec![0, 1, 2, 10, 11, 12]).expect("an image");
        assert_eq!((image.columns(), image.rows()), (3, 2));
        assert_eq!(image.get(2, 1), Some(&12));
        assert_eq!((image.get(3, 0), image.get(0, 2)), (None, None));
        assert_eq!(image.each_row().nth(1), Some(&[10, 11, 12][..]));
    }

    #[test]
    fn sizes_that_do_not_fit_the_pixels_are_refused() {
        for (columns, rows) in [(0, 0), (3, 0), (2, 2), (usize::MAX, 2), (1 << 33, 1 << 31)] {
            assert!(Image::new(columns, rows, vec![0u8; 3]).is_err(), "{columns}×{rows}");
        }
        assert!(Image::<u8>::new(0, 5, vec![]).is_err());
    }

    #[test]
    fn skewed_long_or_unfinished_geometries_are_refused() {
        let good = |o, c, r, s| Geometry::new(o, c, r, s).is_ok();
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::ZERO);
        let geometry = Geometry::new(z, x, DVec3::NEG_Z, [1.0, 2.0, 3.0]).expect("a geometry");
        assert_eq!(geometry.axes()[2], DVec3::Y);
        assert!(!good(z, 1.001 * x, y, [1.0; 3]));
        assert!(!good(z, x, (y + 0.001 * x).normalize(), [1.0; 3]));
        assert!(!good(z, x, DVec3::NAN, [1.0; 3]));
        assert!(!good(DVec3::INFINITY, x, y, [1.0; 3]));
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(!good(z, x, y, [1.0, wrong, 1.0]));
        }
    }
}
