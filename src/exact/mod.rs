//! Exact chords: the judge of every approximation and the fall-back of every query.
//!
//! | engine | bodies | rays | serves unasked | cost |
//! |---|---|---|---|---|
//! | [`clip`] | convex | any | a line by itself: up to 90 planes; a batch: up to 50 | 20 ns and 2.2 a plane: the reference |
//! | [`walk`] | convex | any | more planes; images of few pixels | 15 to 150 ns a ray of an image, 70 to 300 ns another |
//! | [`raster`] | any closed surface | of an image | images | 11 ns a face, 34 ns a row of its pixels, 2 ns a pixel |
//! | [`bvh`] | any closed surface | any | bodies that are not convex | 200 to 600 ns a ray of an image, up to 2 µs another |
//!
//! Costs are those of one thread, for bodies of up to a third of a million faces (`benches`).
//!
//! What rounding does to all of them, [`rational`] says: the same chords without any.
//!
//! All find the chord of a surface whose vertices, or planes, have moved by rounding: by some γ₈ of their distance from the
//! ray's source. Which one serves when nobody says is [`Body::engine_for_image`], [`Body::engine_for_rays`] and
//! [`Body::engine_for_line`]; what of a crossing is kept is the caller's [`Record`].

mod body;
pub mod bvh;
pub mod clip;
mod crossing;
mod engine;
pub(crate) mod judge;
mod parts;
pub mod raster;
pub mod rational;
mod record;
mod round;
mod shear;
pub mod walk;

pub use body::Body;
pub use engine::{BodyView, Engine, ImageCost};
pub use record::{Lengths, Passes, Pierce, Pierced, Record, Spans, Way};

#[cfg(test)]
mod tests;
