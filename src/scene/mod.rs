//! Scenes: shapes written as equations, and the phantoms made of them.

pub mod phantoms;
pub mod shape;
