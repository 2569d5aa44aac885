//! Images in memory, and where their pixels are in space.

use std::io::{self, Write};

use ::image::{ImageBuffer, Luma, Pixel};
pub use ::image::{RgbImage, RgbaImage};
use glam::DVec3;

use crate::scene::panel::MAX_SKEW_DEG;
use crate::{Error, Result};

/// An image of single-precision numbers, the first row at the top: a transmission, a projection value p, a length
/// in mm.
pub type FloatImage = ImageBuffer<Luma<f32>, Vec<f32>>;

/// The image of `columns` × `rows` pixels whose samples are given pixel after pixel, row after row from the top.
///
/// # Errors
/// If a side is 0 or beyond 2³¹ − 1 (what PNG can say), or if there are not `columns · rows` pixels. (The buffer's
/// own constructor takes sides of 0 and drops surplus samples unseen.)
pub fn image_of<P: Pixel>(
    columns: usize,
    rows: usize,
    samples: Vec<P::Subpixel>,
) -> Result<ImageBuffer<P, Vec<P::Subpixel>>> {
    const LONGEST_SIDE: usize = i32::MAX as usize;
    let channels = usize::from(P::CHANNEL_COUNT);
    let given = samples.len();
    let refused = || {
        Error::input(
            "image",
            format!("{given} samples do not make {columns} columns of {rows} rows of {channels} per pixel"),
            "give both sides from 1 to 2147483647 and the samples of every pixel",
        )
    };
    let sides_fit = (1..=LONGEST_SIDE).contains(&columns) && (1..=LONGEST_SIDE).contains(&rows);
    let needed = columns.checked_mul(rows).and_then(|pixels| pixels.checked_mul(channels));
    if !sides_fit || needed != Some(given) {
        return Err(refused());
    }
    // Sides below 2³¹ fit 32 bits.
    ImageBuffer::from_raw(columns as u32, rows as u32, samples).ok_or_else(refused)
}

/// The rows of an image from the top, each with the samples of its pixels.
pub(super) fn sample_rows<P: Pixel>(
    image: &ImageBuffer<P, Vec<P::Subpixel>>,
) -> impl Iterator<Item = &[P::Subpixel]> {
    // An image without columns has no samples; chunks of none would be refused.
    let row_length = image.width() as usize * usize::from(P::CHANNEL_COUNT);
    image.as_raw().chunks_exact(row_length.max(1)).take(image.height() as usize)
}

/// Writes all pixels as little-endian 32-bit floats, row after row; one row at a time is copied.
pub(super) fn write_little_endian(image: &FloatImage, out: &mut dyn Write) -> io::Result<()> {
    let mut bytes = Vec::with_capacity(4 * image.width() as usize);
    for row in sample_rows(image) {
        bytes.clear();
        bytes.extend(row.iter().flat_map(|value| value.to_le_bytes()));
        out.write_all(&bytes)?;
    }
    Ok(())
}

/// Where an image's pixels are, in the patient frame (DICOM LPS: +x left, +y posterior, +z superior), mm.
///
/// ```text
/// origin ──► column axis (pixel to pixel within a row)
///   │
///   ▼ row axis (row to row)              normal along column axis × row axis
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Geometry {
    origin_mm: DVec3,
    axes: [DVec3; 3],
    spacing_mm: [f64; 3],
}

impl Geometry {
    /// The geometry of an image whose first pixel has its centre at `origin_mm`, whose columns advance along
    /// `column_axis` and rows along `row_axis`, unit vectors at a right angle, give or take the skew that calibrated
    /// detectors have ([`MAX_SKEW_DEG`]). `spacing_mm` is the distance of neighbouring pixel centres along the column
    /// axis, along the row axis, and the slice's thickness.
    ///
    /// # Errors
    /// If a number is not finite, a spacing not positive, an axis not of length 1 within 10⁻⁹ or the axes more skewed.
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
        let is_unit = |axis: DVec3| (axis.length() - 1.0).abs() <= AXIS_TOLERANCE;
        let most_skewed = MAX_SKEW_DEG.to_radians().sin() + AXIS_TOLERANCE;
        // Written so that NaN is refused as well.
        if !(is_unit(column_axis) && is_unit(row_axis) && column_axis.dot(row_axis).abs() <= most_skewed) {
            return Err(refused(
                format!("the axes {column_axis} and {row_axis} are not unit vectors at a right angle"),
                "give directions of length 1 that are perpendicular",
            ));
        }
        let normal = column_axis.cross(row_axis).normalize();
        Ok(Self { origin_mm, axes: [column_axis, row_axis, normal], spacing_mm })
    }

    /// The centre of the first pixel, mm.
    pub fn origin_mm(&self) -> DVec3 {
        self.origin_mm
    }

    /// Unit vectors: along which columns advance, along which rows advance, and the normal, columns × rows.
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
        let image = image_of::<Luma<u8>>(3, 2, vec![0, 1, 2, 10, 11, 12]).expect("an image");
        assert_eq!((image.width(), image.height()), (3, 2));
        assert_eq!(image.get_pixel_checked(2, 1), Some(&Luma([12])));
        assert_eq!((image.get_pixel_checked(3, 0), image.get_pixel_checked(0, 2)), (None, None));
        assert_eq!(sample_rows(&image).nth(1), Some(&[10, 11, 12][..]));
        let colours: RgbImage = image_of(1, 2, vec![1, 2, 3, 4, 5, 6]).expect("an image");
        assert_eq!(sample_rows(&colours).collect::<Vec<_>>(), [[1, 2, 3], [4, 5, 6]]);
    }

    #[test]
    fn sizes_that_do_not_fit_the_pixels_are_refused() {
        for (columns, rows) in [(0, 0), (3, 0), (2, 2), (2, 1), (usize::MAX, 2), (1 << 33, 1 << 31)] {
            assert!(image_of::<Luma<u8>>(columns, rows, vec![0u8; 3]).is_err(), "{columns}×{rows}");
        }
        assert!(image_of::<Luma<u8>>(0, 5, vec![]).is_err());
        assert!(image_of::<::image::Rgb<u8>>(2, 1, vec![0; 5]).is_err());
    }

    #[test]
    fn an_image_without_pixels_has_no_rows() {
        assert_eq!(sample_rows(&FloatImage::new(0, 3)).count(), 0);
    }

    #[test]
    fn skewed_long_or_unfinished_geometries_are_refused() {
        let good = |o, c, r, s| Geometry::new(o, c, r, s).is_ok();
        let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::ZERO);
        let geometry = Geometry::new(z, x, DVec3::NEG_Z, [1.0, 2.0, 3.0]).expect("a geometry");
        assert_eq!(geometry.axes()[2], DVec3::Y);
        assert!(!good(z, 1.001 * x, y, [1.0; 3]));
        assert!(good(z, x, (y + 0.017 * x).normalize(), [1.0; 3]), "a calibrated detector's skew");
        assert!(!good(z, x, (y + 0.018 * x).normalize(), [1.0; 3]));
        assert!(!good(z, x, DVec3::NAN, [1.0; 3]));
        assert!(!good(DVec3::INFINITY, x, y, [1.0; 3]));
        for wrong in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(!good(z, x, y, [1.0, wrong, 1.0]));
        }
    }
}
