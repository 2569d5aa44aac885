//! What can be done with a scene. Modes return values; they print nothing and write no files.

pub mod absorption;
pub mod audit;
pub mod bench;
mod control;
pub mod dose;
pub mod figures;
pub mod oracles;
pub mod project;
pub mod raytrace;
pub mod reference;
pub mod stability;

pub use control::Control;
