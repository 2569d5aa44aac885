//! Exact and interpolated intersection lengths of rays with organs.

pub mod error;
pub mod geometry;
pub mod scene;

pub use error::{Error, Result};
