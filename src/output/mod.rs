//! Outputs: images, volumes, meshes and tables on disk, each written whole or not at all.
//!
//! ```text
//! Projection ─► projection ─► png (to look at) │ metaimage, npy (to compute with)
//! Scene      ─► phantom    ─► obj
//! AuditReport ─► audit     ─► page: html · csv
//! CurveReport, ScaleReport ─► bench ─► page: html · svg, csv
//! Study, DoseReport ─► dose ─► csv, json lines
//! Picture    ─► picture    ─► png
//! any record ─► json
//!                  └─► atomic: temporary file beside the target ─► flush ─► sync ─► rename
//! ```

pub mod atomic;
pub mod audit;
pub mod bench;
pub mod dose;
pub mod image;
pub mod json;
pub mod metaimage;
pub mod npy;
pub mod obj;
pub mod page;
pub mod phantom;
pub mod picture;
pub mod png;
pub mod projection;
pub mod sidecar;
pub mod trees;

pub use atomic::{AtomicFile, create_folder, remove_stale, write_atomically};
pub use image::{FloatImage, Geometry, RgbImage, RgbaImage, image_of};
