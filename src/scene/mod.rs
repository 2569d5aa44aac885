//! From what a user writes to what the engines need: organs as proved bodies, beams as poses that hand out rays.
//!
//! ```text
//! scene.toml ─► schema ─┬─► shapes, mesh files ─► body (closed? convex?) ─► nesting ─► Scene
//!                       └─► [beam] ─► views    [spectrum] ─► photons
//! ```

pub mod beam;
pub mod body;
pub(crate) mod build;
mod folder;
mod frustum;
pub mod iec;
#[cfg(test)]
mod known_poses;
mod matrix;
pub mod mesh_file;
mod nesting;
pub mod organ;
pub mod panel;
pub mod phantoms;
pub(crate) mod problem;
pub mod ranges;
pub(crate) mod regular_file;
pub(crate) mod schema;
pub mod shape;
pub(crate) mod text;
pub mod trace;
mod view;

use crate::error::Result;
use crate::physics::{DetectorResponse, Filter, Spectrum};

pub use folder::Folder;
pub use frustum::Frustum;
pub use organ::Organ;
pub use panel::Panel;
pub use problem::{BeamProblem, Given};
pub use text::SceneText;
pub use view::{Pose, View};

/// Organs that do not cross, a beam and its photons: all that a study needs.
#[derive(Clone, Debug)]
pub struct Scene {
    /// What it is called.
    pub name: String,
    /// What it shows.
    pub description: String,
    /// The file it came from, or the phantom's name.
    pub source: String,
    /// The organs, in the file's order; nested or apart, never crossing.
    pub organs: Vec<Organ>,
    /// Where rays come from.
    pub beam: beam::BeamSpec,
    /// The photons before the patient, behind all filters.
    pub spectrum: Spectrum,
    /// The sheets that `spectrum` has passed, for whoever puts another source in its place.
    pub filters: Vec<Filter>,
    /// What the detector makes of a photon.
    pub response: DetectorResponse,
}

impl Scene {
    /// Puts the photons of `source`, as they leave the tube, in place of the scene's; they pass the scene's filters.
    ///
    /// # Errors
    /// If the filters let none of them through.
    pub fn replace_source(&mut self, source: Spectrum) -> Result<()> {
        self.spectrum = source.filtered(&self.filters)?;
        Ok(())
    }
}
