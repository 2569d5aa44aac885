//! Attributes of lines that RI-trees hold.

pub mod chord;
pub mod exit_ray;
pub mod lines;
pub mod memo;
pub mod smooth_chord;
pub mod squared_chord;
pub mod surface;
