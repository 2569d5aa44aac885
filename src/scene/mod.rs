//! From what a user writes to what the engines need: beams as poses that hand out rays.

pub mod beam;
mod frustum;
pub mod iec;
#[cfg(test)]
mod known_poses;
mod matrix;
pub mod mesh_file;
pub mod panel;
mod problem;
pub mod ranges;
mod view;

pub use frustum::Frustum;
pub use panel::Panel;
pub use problem::{BeamProblem, Given};
pub use view::{Pose, View};

pub mod phantoms;
pub mod shape;
