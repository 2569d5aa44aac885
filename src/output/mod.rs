//! Outputs: images, volumes, meshes and tables on disk, each written whole or not at all.
//!
//! ```text
//! FloatImage ─► png (to look at) │ metaimage, npy (to compute with)
//! TriMesh    ─► obj
//! any record ─► json
//!                  └─► atomic: temporary file beside the target ─► flush ─► sync ─► rename
//! ```

pub mod atomic;
pub mod image;
pub mod json;
pub mod metaimage;
pub mod npy;
pub mod obj;
pub mod png;

pub use atomic::{create_folder, write_atomically};
pub use image::{FloatImage, Geometry, Image};
