//! What can be done with a scene. Modes return values; they print nothing and write no files.

pub mod audit;
pub mod bench;
mod control;
pub mod figures;
pub mod oracles;
pub mod project;
pub mod reference;

pub use control::Control;
