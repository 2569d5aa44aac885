//! Attributes of lines that RI-trees hold.

pub mod chord;
pub mod squared_chord;
