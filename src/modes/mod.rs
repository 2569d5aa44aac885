//! What can be done with a scene. Modes return values; they print nothing and write no files.

pub mod audit;
mod control;
pub mod figures;
pub mod project;

pub use control::Control;
