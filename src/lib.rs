//! Exact and interpolated intersection lengths of rays with organs.

pub mod cli;
pub mod error;
pub mod exact;
pub mod geometry;
pub mod modes;
pub mod output;
pub mod physics;
pub mod scene;

pub use error::{Error, Result};
