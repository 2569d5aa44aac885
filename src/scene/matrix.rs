//! Projection matrices: 3×4, from homogeneous patient millimetres to homogeneous pixels.
//!
//! A matrix P maps a point (x, y, z, 1) of the patient (LPS, mm) to w · (column, row, 1), with pixel centres at whole numbers. It
//! fixes the source and the direction of every pixel's ray, up to a factor; it fixes neither where along the rays the
//! detector stands nor, since −P maps alike, on which side of the source. The source-to-detector distance gives
//! the first, the isocentre (a point that the beam looks at) the second. Hartley & Zisserman, *Multiple View Geometry*, 2nd
//! ed., §6.2.

use glam::DVec3;
use nalgebra::{Matrix3, Vector3};

use super::panel::Panel;
use super::problem::BeamProblem;
use super::view::{Pose, View};

/// The least volume that the matrix's first three columns, rows scaled to unit length, may span: a cosine-like
/// measure in 0..1, about f / √(f² + c²) for a camera of focal length f pixels whose centre is c pixels off. Inverting a matrix at
/// this bound still leaves six digits.
const LEAST_REGULARITY: f64 = 1e-9;

/// The least depth of the isocentre below the source, over the source-to-detector distance, that says on which side the detector is.
const LEAST_RELATIVE_DEPTH: f64 = 1e-9;

/// The cone view of the 3×4 matrix `rows_of_p` (see the module). `index` is its place in the beam's list.
///
/// Errors, under the key `matrices` or `isocentre_mm`: a number that is not finite, a singular matrix (parallel rays are no cone),
/// pixels that are not square-cut, an isocentre beside the source.
pub(super) fn view_of(
    rows_of_p: &[[f64; 4]; 3],
    index: usize,
    sdd_mm: f64,
    isocentre: DVec3,
    [columns, rows]: [u32; 2],
) -> Result<View, BeamProblem> {
    let name = format!("matrix {} of the list", index + 1);
    let blame =
        |problem: String, remedy: &str| BeamProblem::new("matrices", format!("{name} {problem}"), remedy);
    if rows_of_p.as_flattened().iter().any(|entry| !entry.is_finite()) {
        return Err(blame("has an entry that is not finite".into(), "give twelve finite numbers"));
    }
    let scaled = unit_third_row(rows_of_p).ok_or_else(|| {
        blame("is singular: it has no point source".into(), "give the matrix of a cone beam")
    })?;
    let m = Matrix3::from_fn(|i, j| scaled[i][j]);
    let last = Vector3::from_fn(|i, _| scaled[i][3]);
    let regularity = m.determinant().abs() / (m.row(0).norm() * m.row(1).norm());
    let inverse = m
        .try_inverse()
        // Written so that NaN, from a zero row, is refused as well.
        .filter(|_| regularity > LEAST_REGULARITY)
        .ok_or_else(|| {
            blame("is singular: it has no point source".into(), "give the matrix of a cone beam")
        })?;
    let source = to_glam(-(inverse * last));

    let isocentre_depth = m.row(2).dot(&Vector3::from(isocentre.to_array()).transpose()) + last[2];
    // Coordinates are bounded and the inverse exists, so the depth is a number.
    if isocentre_depth.abs() <= LEAST_RELATIVE_DEPTH * sdd_mm {
        return Err(BeamProblem::new(
            "isocentre_mm",
            format!("lies beside the source of {name}, so it does not say on which side the detector is"),
            "give a point that the beam looks at",
        ));
    }
    // Multiplied with a third row of unit length, a point's depth below the source is in mm, and each column of the
    // inverse moves one mm deep; so the columns times the (signed) distance are steps on the detector's plane.
    let reach = sdd_mm * isocentre_depth.signum();
    let [column_step_mm, row_step_mm, to_origin] =
        [0, 1, 2].map(|j| to_glam(inverse.column(j).into_owned()) * reach);
    let panel = Panel { origin_mm: source + to_origin, column_step_mm, row_step_mm, columns, rows };
    View::cone(source, panel, Pose::Matrix { index }).map_err(|problem| {
        let at_fault = if problem.key == "detector.pixels" { problem.key } else { "matrices" };
        BeamProblem { problem: format!("{name}: {}", problem.problem), ..problem }.blamed_on(at_fault)
    })
}

/// The matrix times the factor that makes (p₃₁, p₃₂, p₃₃) a unit vector. `None` if that row is zero or too far from the
/// others for f64.
fn unit_third_row(rows_of_p: &[[f64; 4]; 3]) -> Option<[[f64; 4]; 3]> {
    // By the largest entry first, so that squares of huge or tiny entries do not overflow or vanish.
    let largest = rows_of_p.as_flattened().iter().fold(0.0, |most: f64, entry| most.max(entry.abs()));
    let tamed = rows_of_p.map(|row| row.map(|entry| entry / largest));
    let norm = DVec3::new(tamed[2][0], tamed[2][1], tamed[2][2]).length();
    let scaled = tamed.map(|row| row.map(|entry| entry / norm));
    scaled.as_flattened().iter().all(|entry| entry.is_finite()).then_some(scaled)
}

fn to_glam(v: Vector3<f64>) -> DVec3 {
    DVec3::new(v.x, v.y, v.z)
}

impl View {
    /// The 3×4 matrix of a cone view, by rows: patient mm (x, y, z, 1) ↦ w · (column, row, 1), where w is the point's depth below the
    /// source in mm, positive downstream. `None` for parallel rays.
    pub fn matrix(&self) -> Option<[[f64; 4]; 3]> {
        if self.is_parallel() {
            return None;
        }
        // A point is source + λ (to_origin + c · column + r · row); solving for λ (c, r, 1) by Cramer's rule.
        let panel = self.panel();
        let to_origin = panel.origin_mm - self.source_mm();
        let (column, row) = (panel.column_step_mm, panel.row_step_mm);
        let determinant = column.cross(row).dot(to_origin);
        let depth_mm = self.source_to_detector_mm();
        let solver = [row.cross(to_origin), to_origin.cross(column), column.cross(row)];
        Some(solver.map(|cross| {
            let row = cross / determinant * depth_mm;
            [row.x, row.y, row.z, -row.dot(self.source_mm())]
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::UnitDir;

    const ISOCENTRE: DVec3 = DVec3::new(10.0, -20.0, 300.0);

    fn oblique_view() -> View {
        let z = DVec3::new(0.3, -0.8, 0.4).normalize();
        let x = DVec3::Z.cross(z).normalize();
        let panel = Panel::centred(ISOCENTRE - 480.0 * z + 31.0 * x, 0.8 * x, -0.4 * z.cross(x), [512, 640]);
        View::cone(ISOCENTRE + 1010.0 * z, panel, Pose::Matrix { index: 0 }).expect("a view")
    }

    fn assert_same_rays(view: &View, other: &View) {
        for (column, row) in [(0, 0), (511, 0), (0, 639), (200, 333)] {
            let apart = view.pixel_centre(column, row) - other.pixel_centre(column, row);
            assert!(apart.length() < 1e-9, "pixel ({column}, {row}) is {} mm off", apart.length());
        }
        let apart = (view.source_mm() - other.source_mm()).length();
        assert!(apart < 1e-9, "source is {apart} mm off");
    }

    #[test]
    fn a_matrix_projects_pixel_rays_to_their_pixels_and_depths() {
        let view = oblique_view();
        let p = view.matrix().expect("a cone");
        for (column, row) in [(0, 0), (511, 639), (100, 7)] {
            let target = view.pixel_centre(column, row);
            for fraction in [0.25, 0.5, 1.0] {
                let x = view.source_mm().lerp(target, fraction);
                let [u, v, w] = p.map(|row| row[0] * x.x + row[1] * x.y + row[2] * x.z + row[3]);
                assert!((u / w - f64::from(column)).abs() < 1e-9);
                assert!((v / w - f64::from(row)).abs() < 1e-9);
                assert!((w - fraction * 1490.0).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn view_to_matrix_to_view_keeps_every_ray_whatever_the_factor() {
        let view = oblique_view();
        let p = view.matrix().expect("a cone");
        for factor in [1.0, -1.0, 1e-200, -3e200, 7.0] {
            let scaled = p.map(|row| row.map(|entry| entry * factor));
            let again = view_of(&scaled, 0, 1490.0, ISOCENTRE, [512, 640]).expect("a view");
            assert_same_rays(&view, &again);
        }
    }

    #[test]
    fn a_mirrored_detector_keeps_its_side_and_its_mirror() {
        let view = oblique_view();
        let mut panel = *view.panel();
        panel.origin_mm += 511.0 * panel.column_step_mm;
        panel.column_step_mm = -panel.column_step_mm;
        let mirrored = View::cone(view.source_mm(), panel, Pose::Free).expect("a view");
        let p = mirrored.matrix().expect("a cone");
        assert_same_rays(&mirrored, &view_of(&p, 0, 1490.0, ISOCENTRE, [512, 640]).expect("a view"));
    }

    #[test]
    fn bad_matrices_are_refused_by_place() {
        let good = oblique_view().matrix().expect("a cone");
        let refused = |change: &dyn Fn(&mut [[f64; 4]; 3])| {
            let mut p = good;
            change(&mut p);
            view_of(&p, 2, 1490.0, ISOCENTRE, [512, 640]).expect_err("refused")
        };
        let nan = refused(&|p| p[1][2] = f64::NAN);
        assert!(nan.key == "matrices" && nan.problem.contains("matrix 3"), "{nan}");
        assert!(refused(&|p| p[2] = [0.0, 0.0, 0.0, 1.0]).problem.contains("singular"), "an affine camera");
        assert!(refused(&|p| p[1] = p[0]).problem.contains("singular"));
        assert!(refused(&|p| *p = [[0.0; 4]; 3]).problem.contains("singular"));
        assert!(refused(&|p| p[1] = [0.0; 4]).problem.contains("singular"));
        let skewed = refused(&|p| p[0] = std::array::from_fn(|j| p[0][j] + 0.1 * p[1][j]));
        assert!(skewed.problem.contains("perpendicular"), "{skewed}");
    }

    #[test]
    fn an_isocentre_beside_the_source_is_refused() {
        let view = oblique_view();
        let p = view.matrix().expect("a cone");
        let problem = view_of(&p, 0, 1490.0, view.source_mm(), [512, 640]).expect_err("refused");
        assert_eq!(problem.key, "isocentre_mm");
    }

    #[test]
    fn parallel_views_have_no_matrix() {
        let panel = Panel::centred(DVec3::ZERO, DVec3::X, DVec3::Y, [2, 2]);
        let down = UnitDir::new(DVec3::Z).expect("a direction");
        let view = View::parallel(DVec3::new(0.0, 0.0, -9.0), down, 9.0, panel, Pose::Free).expect("a view");
        assert_eq!(view.matrix(), None);
    }
}
