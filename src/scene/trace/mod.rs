//! Scenes for ray tracing: smooth objects with materials, lights, a sky and cameras.
//!
//! ```text
//! scene.toml ─► schema ─► build ─┐
//! a name and a seed ─► generate ─┴─► World
//! ```

mod build;
mod generate;
mod noise;
mod schema;
mod world;

use std::path::Path;

pub use generate::{bezier_surface, random_volumes};
pub use noise::Noise;
pub use world::{Camera, CameraRays, Footprint, Glass, Light, Material, Object, Sky, SkyFrom, World};

use super::folder::Folder;
use super::regular_file;
use super::text::SceneText;
use crate::error::{Error, Result};

/// What generated scenes can be told.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Recipe {
    /// Seeds what is random.
    pub seed: u64,
    /// How many volumes.
    pub count: usize,
}

/// The names of the scenes that come with the program.
pub const NAMES: [&str; 3] = ["bezier-surface", "random-volumes", "tomatoes"];

const TOMATOES: &str = include_str!("../../../examples/scenes/tomatoes.toml");

/// A scene file longer than 16 MiB is no scene file.
const SCENE_FILE: regular_file::Kind = regular_file::Kind {
    name: "scene file",
    max_bytes: 16 << 20,
    if_too_large: "give a scene file in TOML; surfaces belong in mesh files beside it",
};

/// The scene of a file, or the one of that name made by `recipe`.
///
/// # Errors
/// All that is wrong with the file, with its place in it; a name that is neither a scene's nor a file's.
pub fn open(scene: &str, recipe: Recipe) -> Result<World> {
    let path = Path::new(scene);
    if path.is_file() || path.extension().is_some() {
        let text = regular_file::read_text(path, SCENE_FILE)?;
        return build::world(&SceneText::new(path.display().to_string(), text), &Folder::of(path));
    }
    match scene {
        "bezier-surface" => Ok(bezier_surface(recipe.seed)),
        "random-volumes" => random_volumes(recipe),
        "tomatoes" => build::world(&SceneText::new("tomatoes.toml", TOMATOES), &Folder::none()),
        _ => Err(Error::input(
            scene,
            "there is no such file and no scene of that name",
            format!("give a scene file, or one of {}", NAMES.join(", ")),
        )),
    }
}
