//! Exact chords: the judge of every approximation and the fall-back of every query.
//!
//! | engine | bodies | rays | cost per ray |
//! |---|---|---|---|
//! | [`clip`] | convex | any | every face plane: the reference |
//! | [`walk`] | convex | any | a few faces near entry and exit |
//! | [`raster`] | any closed surface | of an image | a share of each face seen |
//! | [`bvh`] | any closed surface | any | the faces near the line |
//!
//! What rounding does to all of them, [`rational`] says: the same chords without any.
//!
//! All find the chord of a surface whose vertices, or planes, have moved by rounding: by some γ₈ of their distance from the
//! ray's source. Which one serves when nobody says is [`Body::engine_for_image`] and [`Body::engine_for_rays`]; what of a
//! crossing is kept is the caller's [`Record`].

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
mod shear;
pub mod walk;

pub use body::Body;
pub use engine::{BodyView, Engine};
pub use record::{Lengths, Passes, Pierce, Pierced, Record, Spans, Way};

#[cfg(test)]
mod tests;
