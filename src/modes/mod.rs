//! What can be done with a scene. Modes return values; they print nothing and write no files.

mod control;
pub mod oracles;
pub mod project;
pub mod reference;

pub use control::Control;
