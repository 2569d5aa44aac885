//! Where paths cross the isocentre plane: fans, grids, and fields behind an aperture.
//!
//! ```text
//!        Y_b                      The smallest box around the aperture is tiled by cells no larger than the spacing.
//!    ┌──┬──┬──┬──┐                A path goes through the middle of each cell whose middle lies in the aperture, and stands
//!    │  │╭─┼─╮│  │                for the cell. Cells are counted along X_b, then Y_b: a row is a few runs of them, so that
//!    ├──┼┼─┼─┼┼──┤  → X_b         a field of 10⁸ paths takes no more memory than its rows.
//!    │  │╰─┼─╯│  │
//!    └──┴──┴──┴──┘
//! ```

use super::schema::{Along, FanSpec, FieldSpec, GridSpec};
use crate::scene::panel::MAX_COORDINATE_MM;

/// More rows of cells than any field needs.
const MAX_ROWS: f64 = 1e6;

/// What is wrong with a shape: the key below its table, the problem, the remedy.
pub(super) type Problem = (&'static str, String, &'static str);

/// Points of the isocentre plane, in the beam frame, in order.
#[derive(Clone, Debug)]
pub(super) struct PlanePoints {
    /// The middle of the first cell of the first row, X_b and Y_b, mm.
    first_mm: [f64; 2],
    /// From cell to cell, mm.
    step_mm: [f64; 2],
    runs: Vec<Run>,
    count: u64,
    /// What a point stands for, mm²; `None` of a fan.
    cell_mm2: Option<f64>,
}

/// Neighbouring cells of a row.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Run {
    row: u32,
    column: u32,
    /// How many points come before.
    before: u64,
}

impl PlanePoints {
    pub fn fan(spec: &FanSpec) -> Result<Self, Problem> {
        let width_mm = extent("width_mm", spec.width_mm)?;
        if spec.points < 2 {
            let problem = format!("{} points are no fan", spec.points);
            return Err(("points", problem, "give two or more; for a single path, use `points`"));
        }
        let axis = usize::from(spec.along == Along::Y);
        let (mut first_mm, mut step_mm) = ([0.0; 2], [0.0; 2]);
        first_mm[axis] = -0.5 * width_mm;
        step_mm[axis] = width_mm / f64::from(spec.points - 1);
        let runs = match spec.along {
            Along::X => vec![Run { row: 0, column: 0, before: 0 }],
            Along::Y => (0..spec.points).map(|row| Run { row, column: 0, before: row.into() }).collect(),
        };
        Ok(Self { first_mm, step_mm, runs, count: spec.points.into(), cell_mm2: None })
    }

    pub fn grid(spec: &GridSpec) -> Result<Self, Problem> {
        let [width, height] = spec.size_mm;
        let size = [extent("size_mm", width)?, extent("size_mm", height)?];
        if spec.points.contains(&0) || f64::from(spec.points[1]) > MAX_ROWS {
            let problem = format!("{} × {} points are no grid", spec.points[0], spec.points[1]);
            return Err(("points", problem, "give at least one along each axis, and at most 10⁶ rows"));
        }
        Ok(Self::cells(size.map(|side| -0.5 * side), size, spec.points, |_| {
            vec![[f64::NEG_INFINITY, f64::INFINITY]]
        }))
    }

    pub fn field(spec: &FieldSpec) -> Result<Self, Problem> {
        let spacing_mm = extent("spacing_mm", spec.spacing_mm)?;
        let (key, least, most): (_, [f64; 2], [f64; 2]) =
            match (spec.rectangle_mm, spec.circle_mm, &spec.polygon_mm) {
                (Some(sides), None, None) => {
                    let half =
                        [0.5 * extent("rectangle_mm", sides[0])?, 0.5 * extent("rectangle_mm", sides[1])?];
                    ("rectangle_mm", half.map(|h| -h), half)
                }
                (None, Some(diameter), None) => {
                    let half = 0.5 * extent("circle_mm", diameter)?;
                    ("circle_mm", [-half; 2], [half; 2])
                }
                (None, None, Some(corners)) => {
                    let (least, most) = corners_box(corners)?;
                    ("polygon_mm", least, most)
                }
                _ => {
                    let problem = "the field needs one aperture".into();
                    return Err(("", problem, "give one of `rectangle_mm`, `circle_mm` or `polygon_mm`"));
                }
            };
        let size = [most[0] - least[0], most[1] - least[1]];
        let cells = size.map(|side| (side / spacing_mm * (1.0 - 4.0 * f64::EPSILON)).ceil().max(1.0));
        if cells[1] > MAX_ROWS || cells[0] > f64::from(u32::MAX) {
            let problem = format!("the aperture has {} × {} cells", cells[0], cells[1]);
            return Err(("spacing_mm", problem, "use a coarser spacing: at most 10⁶ rows"));
        }
        let radius = spec.circle_mm.map(|diameter| 0.5 * diameter);
        let open = |v: f64| match (radius, &spec.polygon_mm) {
            (Some(r), _) => {
                let half = (r * r - v * v).max(0.0).sqrt();
                vec![[-half, half]]
            }
            (None, Some(corners)) => open_parts(corners, v),
            (None, None) => vec![[f64::NEG_INFINITY, f64::INFINITY]],
        };
        let field = Self::cells(least, size, cells.map(|n| n as u32), open);
        if field.count == 0 {
            let problem = "no cell's middle lies in the aperture".into();
            return Err((key, problem, "use a finer spacing, or a larger aperture"));
        }
        Ok(field)
    }

    /// The cells of a box whose middles lie, in their row, in one of the `open` stretches of X_b.
    fn cells(
        least_mm: [f64; 2],
        size_mm: [f64; 2],
        cells: [u32; 2],
        open: impl Fn(f64) -> Vec<[f64; 2]>,
    ) -> Self {
        let step_mm: [f64; 2] = std::array::from_fn(|axis| size_mm[axis] / f64::from(cells[axis]));
        let first_mm: [f64; 2] = std::array::from_fn(|axis| least_mm[axis] + 0.5 * step_mm[axis]);
        let (mut runs, mut count) = (Vec::new(), 0);
        for row in 0..cells[1] {
            for [start, end] in open(first_mm[1] + f64::from(row) * step_mm[1]) {
                // The first cell whose middle is not before a place.
                let from = |place: f64| {
                    ((place - first_mm[0]) / step_mm[0]).ceil().clamp(0.0, cells[0].into()) as u32
                };
                let (column, past) = (from(start), from(end));
                if column < past {
                    runs.push(Run { row, column, before: count });
                    count += u64::from(past - column);
                }
            }
        }
        Self { first_mm, step_mm, runs, count, cell_mm2: Some(step_mm[0] * step_mm[1]) }
    }

    pub fn count(&self) -> u64 {
        self.count
    }

    /// The area that each point stands for, mm²; `None` of a fan.
    pub fn cell_mm2(&self) -> Option<f64> {
        self.cell_mm2
    }

    /// A point, X_b and Y_b, mm.
    pub fn point(&self, index: u64) -> [f64; 2] {
        let run = self.runs[self.runs.partition_point(|run| run.before <= index) - 1];
        let cell = [run.column as f64 + (index - run.before) as f64, f64::from(run.row)];
        std::array::from_fn(|axis| self.first_mm[axis] + cell[axis] * self.step_mm[axis])
    }
}

/// A length above zero.
fn extent(key: &'static str, value: f64) -> Result<f64, Problem> {
    if value > 0.0 && value <= MAX_COORDINATE_MM {
        return Ok(value);
    }
    Err((key, format!("{value} mm is no extent"), "give millimetres, more than zero"))
}

fn corners_box(corners: &[[f64; 2]]) -> Result<([f64; 2], [f64; 2]), Problem> {
    let fold = |of: fn(f64, f64) -> f64, from: f64| -> [f64; 2] {
        std::array::from_fn(|axis| corners.iter().map(|c| c[axis]).fold(from, of))
    };
    let (least, most) = (fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY));
    let is_fit = corners.as_flattened().iter().all(|x| x.abs() <= MAX_COORDINATE_MM);
    if corners.len() < 3 || !is_fit || least[0] >= most[0] || least[1] >= most[1] {
        let problem = "the polygon encloses nothing".into();
        return Err(("polygon_mm", problem, "give three or more corners [x, y] in millimetres"));
    }
    Ok((least, most))
}

/// The stretches of X_b within a polygon at the height `v`, even–odd.
fn open_parts(corners: &[[f64; 2]], v: f64) -> Vec<[f64; 2]> {
    let edges = corners.iter().zip(corners.iter().cycle().skip(1));
    let mut places: Vec<f64> = edges
        .filter(|(a, b)| (a[1] <= v) != (b[1] <= v))
        .map(|(a, b)| a[0] + (v - a[1]) / (b[1] - a[1]) * (b[0] - a[0]))
        .collect();
    places.sort_unstable_by(f64::total_cmp);
    places.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn field(text: &str) -> Result<PlanePoints, Problem> {
        PlanePoints::field(&toml::from_str(text).expect("a field"))
    }

    fn points(plane: &PlanePoints) -> Vec<[f64; 2]> {
        (0..plane.count()).map(|i| plane.point(i)).collect()
    }

    #[test]
    fn a_fan_has_both_ends_and_a_grid_the_middles_of_its_cells() {
        let fan = PlanePoints::fan(&FanSpec { width_mm: 4.0, points: 3, along: Along::Y }).expect("a fan");
        assert_eq!(points(&fan), [[0.0, -2.0], [0.0, 0.0], [0.0, 2.0]]);
        let grid = PlanePoints::grid(&GridSpec { size_mm: [4.0, 2.0], points: [2, 2] }).expect("a grid");
        assert_eq!(points(&grid), [[-1.0, -0.5], [1.0, -0.5], [-1.0, 0.5], [1.0, 0.5]]);
        assert_eq!(grid.cell_mm2(), Some(2.0));
    }

    #[test]
    fn apertures_have_their_areas() {
        let area = |text: &str| {
            let field = field(text).expect("a field");
            field.count() as f64 * field.cell_mm2().expect("cells")
        };
        assert_eq!(area("rectangle_mm = [30, 7]\nspacing_mm = 2"), 210.0);
        let circle = area("circle_mm = 100\nspacing_mm = 0.5");
        assert!((circle / (std::f64::consts::PI * 2500.0) - 1.0).abs() < 1e-3, "{circle}");
        // An L: even–odd along rows that it fills in one part and in two.
        let l = area("polygon_mm = [[0, 0], [30, 0], [30, 10], [10, 10], [10, 40], [0, 40]]\nspacing_mm = 1");
        assert_eq!(l, 600.0);
        let u = area(
            "polygon_mm = [[0,0],[30,0],[30,40],[20,40],[20,10],[10,10],[10,40],[0,40]]\nspacing_mm = 1",
        );
        assert_eq!(u, 900.0);
    }

    #[test]
    fn points_lie_in_the_aperture_and_on_both_sides_alike() {
        let circle = field("circle_mm = 20\nspacing_mm = 3").expect("a field");
        let all = points(&circle);
        assert!(all.iter().all(|[x, y]| x.hypot(*y) < 10.0));
        let mirrored =
            |p: &[f64; 2]| all.iter().any(|q| (p[0] + q[0]).abs() < 1e-12 && (p[1] - q[1]).abs() < 1e-12);
        assert!(all.iter().all(mirrored));
    }

    #[test]
    fn shapes_of_nothing_are_refused_by_their_key() {
        for (text, key) in [
            ("rectangle_mm = [0, 7]\nspacing_mm = 2", "rectangle_mm"),
            ("circle_mm = nan\nspacing_mm = 2", "circle_mm"),
            ("circle_mm = 10\nspacing_mm = -1", "spacing_mm"),
            ("circle_mm = 10\nspacing_mm = 1e-9", "spacing_mm"),
            ("polygon_mm = [[0, 0], [1, 1]]\nspacing_mm = 1", "polygon_mm"),
            ("polygon_mm = [[0, 0], [1, 1], [0, 0.01]]\nspacing_mm = 50", "polygon_mm"),
            ("spacing_mm = 1", ""),
        ] {
            assert_eq!(field(text).expect_err(text).0, key, "{text}");
        }
    }
}
