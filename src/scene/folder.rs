//! The files a scene may read: those in its own folder.

use std::path::{Component, Path, PathBuf};

use crate::error::{Error, Result};

/// The folder of a scene file. Scenes embedded in the program have none and read no files.
#[derive(Clone, Debug)]
pub struct Folder(Option<PathBuf>);

impl Folder {
    /// The folder in which the scene file `scene` lies.
    pub fn of(scene: &Path) -> Self {
        let parent = scene.parent().filter(|p| !p.as_os_str().is_empty());
        Self(Some(parent.unwrap_or(Path::new(".")).to_owned()))
    }

    /// No folder.
    pub fn none() -> Self {
        Self(None)
    }

    /// Where the file `name` lies.
    ///
    /// # Errors
    /// A name that is absolute, climbs out by `..`, or leads out through a link; a file that is not there.
    pub fn resolve(&self, name: &str) -> Result<PathBuf> {
        let outside = || {
            Error::input(
                name,
                "the path leaves the scene's folder",
                "put the file beside the scene and name it by a relative path without `..`",
            )
        };
        let Some(folder) = &self.0 else {
            return Err(Error::input(
                name,
                "a scene inside the program reads no files",
                "export it with `chordfield phantom export` and edit the copy",
            ));
        };
        let relative = Path::new(name);
        if name.is_empty()
            || !relative.components().all(|c| matches!(c, Component::Normal(_) | Component::CurDir))
        {
            return Err(outside());
        }
        let path = folder.join(relative);
        let real = |p: &Path| p.canonicalize().map_err(|e| Error::io("read", p, e));
        if real(&path)?.starts_with(real(folder)?) { Ok(path) } else { Err(outside()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_beside_and_below_the_scene_are_found_and_others_refused() {
        let root = tempfile::tempdir().expect("a folder");
        let scenes = root.path().join("scenes");
        std::fs::create_dir_all(scenes.join("meshes")).expect("a folder");
        std::fs::write(scenes.join("meshes/ä b.obj"), "").expect("a file");
        std::fs::write(root.path().join("secret.obj"), "").expect("a file");
        let folder = Folder::of(&scenes.join("scene.toml"));

        assert!(folder.resolve("meshes/ä b.obj").is_ok());
        let secret = root.path().join("secret.obj");
        for name in ["../secret.obj", "meshes/../../secret.obj", &secret.to_string_lossy(), ""] {
            let error = folder.resolve(name).expect_err(name);
            assert!(error.to_string().contains("leaves the scene's folder"), "{error}");
        }
        assert!(folder.resolve("missing.obj").expect_err("missing").to_string().contains("cannot read"));
        #[cfg(unix)]
        {
            std::os::unix::fs::symlink(&secret, scenes.join("link.obj")).expect("a link");
            assert!(folder.resolve("link.obj").is_err());
        }
    }
}
