//! A detector's pixels in space.

use glam::DVec3;

use super::problem::BeamProblem;

/// The largest coordinate that a beam may have, mm: a thousand kilometres. Far above any machine, far below where the
/// squares and triple products of f64 coordinates could overflow.
pub const MAX_COORDINATE_MM: f64 = 1e9;

/// The most pixels of one view: 8192 × 8192, some four times the finest flat panels (430 mm wide, pixels of 0.1 mm).
/// At [`BYTES_PER_PIXEL`] that is 3 GB; lengths of more organs come on top.
pub const MAX_PIXELS: u64 = 1 << 26;

/// About what one pixel of a view takes in memory while it is projected and written, bytes: p and T (8), colour as floats
/// (16), both again while an image is put together (16) and encoded (4), and the length of one organ (4). Each
/// further organ whose length is asked for takes 4 more where it is seen.
pub const BYTES_PER_PIXEL: u64 = 48;

/// How far detector rows and columns may be from perpendicular, degrees. Calibrated matrices have a skew of small fractions of a degree;
/// more means that the numbers are not a camera of square-cut pixels.
pub const MAX_SKEW_DEG: f64 = 1.0;

/// A claim of a detector; a [`View`](super::View) is the proof that it can be seen from its source. Patient LPS, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Panel {
    /// Centre of pixel (0, 0).
    pub origin_mm: DVec3,
    /// From the centre of pixel (c, r) to that of (c+1, r).
    pub column_step_mm: DVec3,
    /// From the centre of pixel (c, r) to that of (c, r+1).
    pub row_step_mm: DVec3,
    /// Pixels per row.
    pub columns: u32,
    /// Pixels per column.
    pub rows: u32,
}

impl Panel {
    /// The panel around `centre_mm`, its steps as given.
    pub fn centred(
        centre_mm: DVec3,
        column_step_mm: DVec3,
        row_step_mm: DVec3,
        [columns, rows]: [u32; 2],
    ) -> Self {
        let half = |pixels: u32| 0.5 * (f64::from(pixels) - 1.0);
        let origin_mm = centre_mm - half(columns) * column_step_mm - half(rows) * row_step_mm;
        Self { origin_mm, column_step_mm, row_step_mm, columns, rows }
    }

    /// The centre of the whole panel, mm.
    pub fn centre_mm(&self) -> DVec3 {
        let half = |pixels: u32| 0.5 * (f64::from(pixels) - 1.0);
        self.origin_mm + half(self.columns) * self.column_step_mm + half(self.rows) * self.row_step_mm
    }

    /// The centres of the four corner pixels, mm.
    pub(super) fn corners(&self) -> [DVec3; 4] {
        let (last_column, last_row) = (f64::from(self.columns) - 1.0, f64::from(self.rows) - 1.0);
        [(0.0, 0.0), (last_column, 0.0), (0.0, last_row), (last_column, last_row)]
            .map(|(c, r)| self.origin_mm + c * self.column_step_mm + r * self.row_step_mm)
    }

    /// Columns × rows, of unit length.
    pub(super) fn normal(&self) -> DVec3 {
        self.column_step_mm.normalize().cross(self.row_step_mm.normalize()).normalize()
    }

    /// Refuses panels that are empty, too large, flat, skewed or not finite.
    pub(super) fn check(&self) -> Result<(), BeamProblem> {
        let pixels = u64::from(self.columns) * u64::from(self.rows);
        if pixels == 0 {
            return Err(BeamProblem::new(
                "detector.pixels",
                format!("{} × {} pixels are no image", self.columns, self.rows),
                "choose at least one column and one row",
            ));
        }
        if pixels > MAX_PIXELS {
            let gigabytes = pixels as f64 * BYTES_PER_PIXEL as f64 / 1e9;
            return Err(BeamProblem::new(
                "detector.pixels",
                format!(
                    "a view of {} × {} pixels would take some {gigabytes:.1} GB of memory",
                    self.columns, self.rows
                ),
                format!("choose at most {MAX_PIXELS} pixels in all, such as 8192 × 8192"),
            ));
        }
        let (column, row) = (self.column_step_mm, self.row_step_mm);
        // The steps too: a panel of one column would hide any column step.
        check_coordinates("detector.size_mm", &self.corners())?;
        check_coordinates("detector.size_mm", &[column, row])?;
        // Below this, the square of a length underflows.
        if column.length().min(row.length()) < f64::MIN_POSITIVE.sqrt() {
            return Err(BeamProblem::new(
                "detector.size_mm",
                "the distance between neighbouring pixels vanishes",
                "give the detector a positive width and height in millimetres",
            ));
        }
        let skew_deg = column.normalize().dot(row.normalize()).clamp(-1.0, 1.0).asin().to_degrees();
        if skew_deg.abs() > MAX_SKEW_DEG {
            return Err(BeamProblem::new(
                "row_direction",
                format!("detector rows and columns are {:.4}° from perpendicular", skew_deg.abs()),
                format!("make them perpendicular within {MAX_SKEW_DEG}°"),
            ));
        }
        Ok(())
    }
}

/// The largest magnitude of any coordinate.
pub(super) fn largest_coordinate(points: &[DVec3]) -> f64 {
    points.iter().map(|p| p.abs().max_element()).fold(0.0, f64::max)
}

/// Refuses points that are not finite or too far away.
pub(super) fn check_coordinates(key: &'static str, points: &[DVec3]) -> Result<(), BeamProblem> {
    if points.iter().all(|p| p.is_finite()) && largest_coordinate(points) <= MAX_COORDINATE_MM {
        return Ok(());
    }
    Err(BeamProblem::new(
        key,
        format!("a coordinate is not finite or beyond {MAX_COORDINATE_MM:e} mm"),
        "give distances in millimetres",
    ))
}
