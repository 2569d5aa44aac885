//! Twenty organs in one picture: an ellipsoid in each cell of a 5 × 4 lattice, side by side across the beam.

use chordfield::geometry::{ClosedMesh, RayGrid, Region, TriMesh};
use glam::{DQuat, DVec2};

use crate::body::{Ellipsoid, HALF_AXES_MM, closed};
use crate::view::{Frame, SOURCE_AWAY};

/// Columns and rows of the lattice.
const CELLS: [u32; 2] = [5, 4];

/// 20 480 faces each.
const SUBDIVISIONS: u32 = 5;

/// From the source to the lattice.
const SOURCE_DISTANCE_MM: f64 = 1000.0;

/// A cell is this much wider than its organ: neighbours do not touch.
const ROOM: f64 = 1.02;

/// The organs and the view of them.
pub struct Organs {
    /// Their surfaces.
    pub surfaces: Vec<ClosedMesh>,
    /// The view, which the organs fill.
    pub grid: RayGrid,
    frame: Frame,
}

impl Organs {
    /// The lattice seen by `size`² rays.
    pub fn new(size: u32) -> Self {
        let organ = Ellipsoid { half_axes_mm: 0.5 * HALF_AXES_MM };
        let source = SOURCE_DISTANCE_MM * SOURCE_AWAY;
        let (right, down) = SOURCE_AWAY.any_orthonormal_pair();
        let cell = 2.0 * ROOM * DVec2::new(organ.reach_mm(right), organ.reach_mm(down));
        let from_middle = |i: u32, of: u32| f64::from(i) - 0.5 * f64::from(of - 1);
        let meshes: Vec<TriMesh> = (0..CELLS[0] * CELLS[1])
            .map(|i| {
                let (column, row) = (i % CELLS[0], i / CELLS[0]);
                let centre = from_middle(column, CELLS[0]) * cell.x * right
                    + from_middle(row, CELLS[1]) * cell.y * down;
                organ.mesh(SUBDIVISIONS).map_vertices(|v| v + centre)
            })
            .collect();
        let frame = Frame::along(source, right);
        let grid = frame.window(&meshes, size);
        Self { surfaces: meshes.into_iter().map(closed).collect(), grid, frame }
    }

    /// Views of the lattice from all around it, of as many rays.
    pub fn orbit(&self, views: u32) -> impl Iterator<Item = RayGrid> + '_ {
        let (axis, _) = SOURCE_AWAY.any_orthonormal_pair();
        (0..views).map(move |i| {
            let turn = DQuat::from_axis_angle(axis, std::f64::consts::TAU * f64::from(i) / f64::from(views));
            let frame = Frame::along(turn * (SOURCE_DISTANCE_MM * SOURCE_AWAY), axis);
            frame.window(self.surfaces.iter().map(ClosedMesh::mesh), self.grid.size().0)
        })
    }

    /// The rectangle of pixels outside which no ray meets an organ: that of its box's corners.
    pub fn pixels_of(&self, surface: &ClosedMesh) -> Region {
        let first = self.frame.project(self.grid.origin());
        let (columns, rows) = self.grid.size();
        let next = self.frame.project(self.grid.point(1, 1)) - first;
        let places = surface.bounds().corners().map(|corner| (self.frame.project(corner) - first) / next);
        let span = |of: fn(&DVec2) -> f64, count: u32| {
            let low = places.iter().map(of).fold(f64::INFINITY, f64::min).floor();
            let high = places.iter().map(of).fold(f64::NEG_INFINITY, f64::max).ceil();
            low.clamp(0.0, f64::from(count)) as u32..(high + 1.0).clamp(0.0, f64::from(count)) as u32
        };
        Region { columns: span(|p| p.x, columns), rows: span(|p| p.y, rows) }
    }
}
