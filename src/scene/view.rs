//! One pose of source and detector, ready to hand out rays.
//!
//! ```text
//!   cone:  source ○                          parallel:  source ○──┬──┬──┐  plane of starts, SDD upstream
//!                ╱│╲                                           │  │  │  │
//!               ╱ │ ╲   one ray per pixel                      │  │  │  │
//!   (0,0) ┌──┬──┬──┬──┐ → columns (patient left at gantry 0)   ▼  ▼  ▼  ▼
//!         ├──┼──┼──┼──┤                                        ┌──┬──┬──┐
//!       ↓ └──┴──┴──┴──┘ rows (towards the feet at gantry 0)    └──┴──┴──┘
//! ```
//!
//! Pixel (column, row) has its centre at `origin + column · column_step + row · row_step`. For beams of IEC angles,
//! columns run along +X_b and rows along −Y_b: the head is up, and at gantry 0° the patient's left is on the image's right, as in a
//! chest film. Columns × rows then points downstream, away from the source.

use std::ops::Range;

use glam::DVec3;
use serde::Serialize;

use super::frustum::Frustum;
use super::iec::{IecAngles, sin_cos_deg};
use super::panel::{MAX_COORDINATE_MM, Panel, check_coordinates, largest_coordinate};
use super::problem::BeamProblem;
use crate::geometry::{RayGrid, Segment, UnitDir, Upstream};

/// The least distance of the source from the detector's plane over the largest coordinate. Below it rounding (1e-16 per operation)
/// would decide on which side the source lies.
const LEAST_RELATIVE_DISTANCE: f64 = 1e-9;

/// Where a view's pose came from.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(tag = "from", rename_all = "kebab-case")]
pub enum Pose {
    /// Angles of a machine about an isocentre.
    Iec {
        /// The machine's angles and the patient's position.
        #[serde(flatten)]
        angles: IecAngles,
        /// Source to isocentre, mm.
        sad_mm: f64,
        /// Source to detector plane, mm.
        sdd_mm: f64,
        /// The isocentre, patient LPS, mm.
        isocentre_mm: [f64; 3],
    },
    /// Source and detector placed by hand.
    Free,
    /// A 3×4 matrix of the beam's list.
    Matrix {
        /// Its place in the list, from 0.
        index: usize,
    },
}

/// One source and detector pose. Every pixel has a ray: the constructors prove it. Patient LPS, mm.
#[derive(Clone, Debug, PartialEq)]
pub struct View {
    source_mm: DVec3,
    projection: Projection,
    panel: Panel,
    rays: RayGrid,
    pose: Pose,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Projection {
    Cone,
    Parallel { downstream: UnitDir, sdd_mm: f64 },
}

impl View {
    /// The view of a point source. An error if the panel is empty, flat, skewed, too large or not finite, or if
    /// the source lies in its plane.
    pub fn cone(source_mm: DVec3, panel: Panel, pose: Pose) -> Result<Self, BeamProblem> {
        panel.check()?;
        check_coordinates("source_mm", &[source_mm])?;
        let height = (panel.origin_mm - source_mm).dot(panel.normal()).abs();
        let scale = largest_coordinate(&panel.corners()).max(source_mm.abs().max_element());
        if height <= LEAST_RELATIVE_DISTANCE * scale {
            return Err(BeamProblem::new(
                "sdd_mm",
                format!(
                    "the source is {height} mm from the detector's plane, so rays would run within the detector"
                ),
                "move the source away from the plane of the detector",
            ));
        }
        Self::settled(source_mm, Projection::Cone, panel, pose)
    }

    /// The view of parallel rays along `downstream`. Each ray starts `sdd_mm` upstream of its pixel, so the plane of starts is
    /// parallel to the detector, and goes through the source point if that lies `sdd_mm` upstream of the panel.
    /// Errors as for [`View::cone`], and if the rays run within the detector's plane.
    pub fn parallel(
        source_mm: DVec3,
        downstream: UnitDir,
        sdd_mm: f64,
        panel: Panel,
        pose: Pose,
    ) -> Result<Self, BeamProblem> {
        panel.check()?;
        check_coordinates("source_mm", &[source_mm])?;
        super::problem::distance("sdd_mm", sdd_mm)?;
        let height = sdd_mm * downstream.get().dot(panel.normal()).abs();
        let scale = largest_coordinate(&panel.corners()).max(sdd_mm);
        if scale > MAX_COORDINATE_MM || height <= LEAST_RELATIVE_DISTANCE * scale {
            return Err(BeamProblem::new(
                "sdd_mm",
                format!("rays of {sdd_mm} mm start {height} mm from the detector's plane"),
                "let the rays cross the detector, from a distance in millimetres",
            ));
        }
        Self::settled(source_mm, Projection::Parallel { downstream, sdd_mm }, panel, pose)
    }

    /// Adding zero turns −0, which quarter turns produce, into 0, so that reports read well.
    fn settled(
        source_mm: DVec3,
        projection: Projection,
        mut panel: Panel,
        pose: Pose,
    ) -> Result<Self, BeamProblem> {
        for vector in [&mut panel.origin_mm, &mut panel.column_step_mm, &mut panel.row_step_mm] {
            *vector += DVec3::ZERO;
        }
        let source_mm = source_mm + DVec3::ZERO;
        let upstream = match projection {
            Projection::Cone => Upstream::Source(source_mm),
            Projection::Parallel { downstream, sdd_mm } => Upstream::Path(sdd_mm * downstream.get()),
        };
        let steps = [panel.column_step_mm, panel.row_step_mm];
        let rays = RayGrid::new(upstream, panel.origin_mm, steps, [panel.columns, panel.rows]);
        let rays = rays.ok_or_else(|| {
            BeamProblem::new(
                "detector.size_mm",
                "the detector is so small or so far away that its rays cannot be told apart",
                "give the detector and its distance in millimetres",
            )
        })?;
        Ok(Self { source_mm, projection, panel, rays, pose })
    }

    /// The rays of the image, one per pixel.
    pub fn rays(&self) -> &RayGrid {
        &self.rays
    }

    /// The path from the source to the centre of a pixel. Pixels off the panel have one as well, while finite.
    pub fn segment(&self, column: u32, row: u32) -> Segment {
        self.rays.segment(column, row)
    }

    /// The centre of a pixel, mm.
    pub fn pixel_centre(&self, column: u32, row: u32) -> DVec3 {
        self.rays.point(column, row)
    }

    /// Columns and rows of the image.
    pub fn size(&self) -> (u32, u32) {
        (self.panel.columns, self.panel.rows)
    }

    /// How many pixels there are.
    pub fn pixels(&self) -> u64 {
        u64::from(self.panel.columns) * u64::from(self.panel.rows)
    }

    /// Distance of neighbouring pixel centres along a row and along a column, mm at the detector.
    pub fn spacing_mm(&self) -> (f64, f64) {
        (self.panel.column_step_mm.length(), self.panel.row_step_mm.length())
    }

    /// Unit vectors: increasing columns, increasing rows, and their normal (columns × rows; downstream for IEC beams).
    pub fn direction(&self) -> [DVec3; 3] {
        [self.panel.column_step_mm.normalize(), self.panel.row_step_mm.normalize(), self.panel.normal()]
    }

    /// The centre of pixel (0, 0), mm.
    pub fn origin_mm(&self) -> DVec3 {
        self.panel.origin_mm
    }

    /// The source point, mm; of a parallel beam, the point that stands for it.
    pub fn source_mm(&self) -> DVec3 {
        self.source_mm
    }

    /// The detector.
    pub fn panel(&self) -> &Panel {
        &self.panel
    }

    /// Whether all rays are parallel.
    pub fn is_parallel(&self) -> bool {
        matches!(self.projection, Projection::Parallel { .. })
    }

    /// Source to detector, mm: for a cone its perpendicular distance from the plane, for parallel rays their length.
    pub fn source_to_detector_mm(&self) -> f64 {
        match self.projection {
            Projection::Cone => (self.panel.origin_mm - self.source_mm).dot(self.panel.normal()).abs(),
            Projection::Parallel { sdd_mm, .. } => sdd_mm,
        }
    }

    /// How much larger a small thing at `point`, parallel to the detector, is seen there: SDD over the point's depth below the
    /// source, 1 for parallel rays. `None` if the point is not downstream of the source.
    pub fn magnification_at(&self, point: DVec3) -> Option<f64> {
        if self.is_parallel() {
            return Some(1.0);
        }
        let normal = self.panel.normal();
        let ratio =
            (self.panel.origin_mm - self.source_mm).dot(normal) / (point - self.source_mm).dot(normal);
        (ratio.is_finite() && ratio > 0.0).then_some(ratio)
    }

    /// The area that one pixel stands for, mm², seen along the beam; at the detector. Sums of lengths times this area are
    /// volumes for parallel rays.
    pub fn pixel_area_mm2(&self) -> f64 {
        let cross = self.panel.column_step_mm.cross(self.panel.row_step_mm);
        match self.projection {
            Projection::Cone => cross.length(),
            Projection::Parallel { downstream, .. } => cross.dot(downstream.get()).abs(),
        }
    }

    /// Where the pose came from.
    pub fn pose(&self) -> &Pose {
        &self.pose
    }

    /// A short name from the pose, fit for a file name: `g090`, `g045-t010-c000`, `free`, `matrix-003`. Two views of one beam
    /// share it only if they share the pose.
    pub fn label(&self) -> String {
        match &self.pose {
            Pose::Free => "free".into(),
            Pose::Matrix { index } => format!("matrix-{index:03}"),
            Pose::Iec { angles, .. } => {
                let gantry = padded(angles.gantry_deg);
                if sin_cos_deg(angles.couch_deg).1 == 1.0 && sin_cos_deg(angles.collimator_deg).1 == 1.0 {
                    return format!("g{gantry}");
                }
                format!("g{gantry}-t{}-c{}", padded(angles.couch_deg), padded(angles.collimator_deg))
            }
        }
    }

    /// A convex region that holds every ray of a tile of pixels, for skipping what no ray of it can touch. Ranges
    /// are taken to hold at least their first pixel.
    pub fn frustum(&self, columns: Range<u32>, rows: Range<u32>) -> Frustum {
        let last = |range: &Range<u32>| range.end.saturating_sub(1).max(range.start);
        let ray_to = |column, row| {
            let target = self.rays.point(column, row);
            (self.rays.start_of(target), target)
        };
        let corners = [
            ray_to(columns.start, rows.start),
            ray_to(last(&columns), rows.start),
            ray_to(columns.start, last(&rows)),
            ray_to(last(&columns), last(&rows)),
        ];
        Frustum::around(corners, self.panel.column_step_mm, self.panel.row_step_mm)
    }
}

/// Degrees with three digits before the point, so that names sort: 090, 007.5, -030.
fn padded(angle_deg: f64) -> String {
    let text = angle_deg.abs().to_string();
    let digits = text.split('.').next().map_or(0, str::len);
    format!("{}{}{text}", if angle_deg < 0.0 { "-" } else { "" }, "0".repeat(3_usize.saturating_sub(digits)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn panel() -> Panel {
        Panel::centred(DVec3::new(0.0, 500.0, 0.0), DVec3::X, -DVec3::Z, [3, 5])
    }

    #[test]
    fn the_middle_pixel_of_an_odd_panel_is_its_centre() {
        let view = View::cone(DVec3::new(0.0, -1000.0, 0.0), panel(), Pose::Free).expect("a view");
        assert_eq!(view.pixel_centre(1, 2), DVec3::new(0.0, 500.0, 0.0));
        assert_eq!(view.panel().centre_mm(), DVec3::new(0.0, 500.0, 0.0));
        assert_eq!(view.origin_mm(), DVec3::new(-1.0, 500.0, 2.0));
        assert_eq!((view.size(), view.spacing_mm()), ((3, 5), (1.0, 1.0)));
        assert_eq!(view.source_to_detector_mm(), 1500.0);
    }

    #[test]
    fn magnification_is_sdd_over_depth() {
        let view = View::cone(DVec3::new(0.0, -1000.0, 0.0), panel(), Pose::Free).expect("a view");
        assert_eq!(view.magnification_at(DVec3::ZERO), Some(1.5));
        assert_eq!(view.magnification_at(DVec3::new(77.0, 0.0, -9.0)), Some(1.5));
        assert_eq!(view.magnification_at(DVec3::new(0.0, -1000.0, 0.0)), None, "at the source");
        assert_eq!(view.magnification_at(DVec3::new(0.0, -1001.0, 0.0)), None, "behind the source");
    }

    #[test]
    fn parallel_rays_start_on_a_plane_through_the_source() {
        let source = DVec3::new(0.0, -1000.0, 0.0);
        let downstream = UnitDir::new(DVec3::Y).expect("a direction");
        let view = View::parallel(source, downstream, 1500.0, panel(), Pose::Free).expect("a view");
        for (column, row) in [(0, 0), (2, 4), (1, 2)] {
            let segment = view.segment(column, row);
            assert_eq!(segment.line().dir(), DVec3::Y);
            assert_eq!(segment.line().origin().y, -1000.0);
            assert_eq!(segment.length_mm(), 1500.0);
        }
        assert_eq!(view.magnification_at(DVec3::ZERO), Some(1.0));
        assert_eq!(view.pixel_area_mm2(), 1.0);
    }

    #[test]
    fn a_source_in_the_detector_plane_is_refused() {
        for source in
            [DVec3::new(0.0, 500.0, 0.0), DVec3::new(9e3, 500.0, 3.0), DVec3::new(0.0, 500.0 + 1e-10, 0.0)]
        {
            assert_eq!(View::cone(source, panel(), Pose::Free).expect_err("in plane").key, "sdd_mm");
        }
        let along = UnitDir::new(DVec3::X).expect("a direction");
        assert!(View::parallel(DVec3::ZERO, along, 1500.0, panel(), Pose::Free).is_err());
    }

    #[test]
    fn panels_that_make_no_image_are_refused() {
        let refused = |change: &dyn Fn(&mut Panel)| {
            let mut panel = panel();
            change(&mut panel);
            View::cone(DVec3::new(0.0, -1000.0, 0.0), panel, Pose::Free).expect_err("refused").key
        };
        assert_eq!(refused(&|p| p.columns = 0), "detector.pixels");
        assert_eq!(refused(&|p| (p.columns, p.rows) = (8192, 8193)), "detector.pixels");
        assert_eq!(refused(&|p| (p.columns, p.rows) = (u32::MAX, u32::MAX)), "detector.pixels");
        assert_eq!(refused(&|p| p.column_step_mm = DVec3::ZERO), "detector.size_mm");
        assert_eq!(refused(&|p| p.column_step_mm = DVec3::splat(1e-200)), "detector.size_mm");
        assert_eq!(refused(&|p| p.row_step_mm = DVec3::NAN), "detector.size_mm");
        assert_eq!(refused(&|p| p.origin_mm = DVec3::splat(2e9)), "detector.size_mm");
        assert_eq!(refused(&|p| p.row_step_mm = DVec3::X), "row_direction");
        assert_eq!(refused(&|p| p.row_step_mm = DVec3::new(0.02, 0.0, -1.0)), "row_direction");
        assert_eq!(refused(&|p| (p.columns, p.column_step_mm) = (1, 1e300 * DVec3::X)), "detector.size_mm");
        assert!(View::cone(DVec3::splat(f64::NAN), panel(), Pose::Free).is_err());
    }

    #[test]
    fn a_pose_is_recorded_with_its_units() {
        let angles = IecAngles {
            gantry_deg: 30.0,
            couch_deg: 0.0,
            collimator_deg: 5.0,
            patient_position: Default::default(),
        };
        let pose = Pose::Iec { angles, sad_mm: 1000.0, sdd_mm: 1500.0, isocentre_mm: [1.0, 2.0, 3.0] };
        let expected = serde_json::json!({
            "from": "iec", "gantry_deg": 30.0, "couch_deg": 0.0, "collimator_deg": 5.0, "patient_position": "HFS",
            "sad_mm": 1000.0, "sdd_mm": 1500.0, "isocentre_mm": [1.0, 2.0, 3.0],
        });
        assert_eq!(serde_json::to_value(pose).expect("a record"), expected);
    }

    #[test]
    fn labels_sort_and_tell_angles_apart() {
        let label = |gantry_deg, couch_deg| {
            let angles = IecAngles {
                gantry_deg,
                couch_deg,
                collimator_deg: 0.0,
                patient_position: Default::default(),
            };
            let pose = Pose::Iec { angles, sad_mm: 1000.0, sdd_mm: 1500.0, isocentre_mm: [0.0; 3] };
            View::cone(DVec3::new(0.0, -1000.0, 0.0), panel(), pose).expect("a view").label()
        };
        assert_eq!(label(0.0, 0.0), "g000");
        assert_eq!(label(7.5, 0.0), "g007.5");
        assert_eq!(label(-30.0, 10.0), "g-030-t010-c000");
    }
}
