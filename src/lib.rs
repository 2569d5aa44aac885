//! Exact and interpolated intersection lengths of rays with organs.

pub mod error;
pub mod exact;
pub mod geometry;

pub use error::{Error, Result};
