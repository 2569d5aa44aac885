//! A scene as meshes: OBJ files, and a scene file that uses them in place of its shapes.

use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::obj::{self, NamedMesh};
use super::projection::{file_stems, safe_name};
use super::{create_folder, write_atomically};
use crate::error::{Error, Result};
use crate::modes::Control;
use crate::scene::Scene;

/// Writes each organ's mesh to `folder/meshes` and the scene, which was built from `toml`, to `folder`; returns the
/// scene file's path.
///
/// Coordinates are written in full, so the exported scene has the same lengths to the last bit.
///
/// # Errors
/// A file that cannot be written; a request to stop. The scene file is written last, so it never names a mesh that is missing.
pub fn export(scene: &Scene, toml: &str, folder: &Path, control: &Control) -> Result<PathBuf> {
    let unreadable =
        |e: &dyn std::fmt::Display| Error::input(&scene.source, e.to_string(), "export a scene that loads");
    let mut document: Table = toml.parse().map_err(|e: toml::de::Error| unreadable(&e))?;
    let organs =
        document.get_mut("organ").and_then(Value::as_array_mut).ok_or_else(|| unreadable(&"no organs"))?;
    create_folder(&folder.join("meshes"))?;
    for ((organ, entry), stem) in scene.organs.iter().zip(organs).zip(file_stems(scene)) {
        control.check()?;
        let file = format!("meshes/{stem}.obj");
        let title = format!("{} of the phantom {}, patient LPS, mm", organ.name, scene.name);
        let mesh = NamedMesh { name: &organ.name, mesh: organ.body.surface().mesh() };
        obj::write(&folder.join(&file), &[&title], &[mesh])?;
        if let Some(entry) = entry.as_table_mut() {
            entry.remove("shape");
            entry.remove("shapes");
            entry.insert(
                "mesh".into(),
                Value::Table(Table::from_iter([("file".to_owned(), Value::from(file))])),
            );
        }
    }
    let text = toml::to_string_pretty(&document).map_err(|e| unreadable(&e))?;
    let path = folder.join(format!("{}.toml", safe_name(&scene.name)));
    write_atomically(&path, |out| out.write_all(text.as_bytes()))?;
    Ok(path)
}
