//! What can be done with a scene. Modes return values; they print nothing and write no files.

mod control;
pub mod project;

pub use control::Control;
