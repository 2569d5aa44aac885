//! Lines, intervals and surfaces. Knows nothing of scenes, trees or files. All lengths are millimetres.

mod bounds;
mod boxtree;
mod closed;
mod components;
mod convex;
mod fault;
mod grid;
mod hull;
mod inside;
mod interval;
mod line;
mod mesh;
pub mod numeric;
pub mod predicates;
pub mod primitives;
mod relation;
mod rounding;
mod topology;

pub use bounds::Bounds;
pub use boxtree::BoxTree;
pub(crate) use boxtree::MAX_DEPTH;
pub use closed::ClosedMesh;
pub use components::check_components;
pub use convex::{ConvexMesh, NotConvex, Plane};
pub use fault::{MeshFault, Notice, Place};
pub use grid::{RayGrid, Region, Upstream};
pub use hull::{HULL_TOLERANCE, HullError, convex_hull};
pub use inside::Side;
pub use interval::Interval;
pub use line::{Line, Segment, UnitDir};
pub use mesh::TriMesh;
pub use relation::{Relation, relation, self_crossing};
pub use rounding::written_grid;
