//! Lines, intervals and surfaces. Knows nothing of scenes, trees or files. All lengths are millimetres.

mod bounds;
mod hull;
mod interval;
mod line;
mod mesh;

pub use bounds::Bounds;
pub use hull::{HULL_TOLERANCE, HullError, convex_hull};
pub use interval::Interval;
pub use line::{Line, Segment, UnitDir};
pub use mesh::TriMesh;
