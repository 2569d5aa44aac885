//! The phantoms that come with the program: scene files a person can read and edit, embedded in the binary.
//!
//! The scene on mesh files, `phantoms/organs-obj.toml`, is not among them: it needs its OBJ files beside it.

use crate::error::{Error, Result};

/// An embedded scene file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Phantom {
    /// The name users call it by; also the file's stem and the scene's own `name`.
    pub name: &'static str,
    /// What it is, in one line.
    pub summary: &'static str,
    /// The scene file's text.
    pub toml: &'static str,
}

const PHANTOMS: [Phantom; 4] = [
    Phantom {
        name: "adult",
        summary: "stylized adult after Cristy and Eckerman 1987: every organ that is convex",
        toml: include_str!("../../phantoms/adult.toml"),
    },
    Phantom {
        name: "adult-skeleton",
        summary: "the adult with ribs, pelvis, scapulae and clavicles, which are not convex",
        toml: include_str!("../../phantoms/adult-skeleton.toml"),
    },
    Phantom {
        name: "head",
        summary: "head and neck of the adult: skull, brain, upper spine, jaw",
        toml: include_str!("../../phantoms/head.toml"),
    },
    Phantom {
        name: "calibration",
        summary: "sphere, box, tetrahedron and cylinder, whose chords have closed forms",
        toml: include_str!("../../phantoms/calibration.toml"),
    },
];

/// All embedded phantoms; the first is the default.
pub fn list() -> &'static [Phantom] {
    &PHANTOMS
}

/// The phantom of that name.
///
/// # Errors
/// A name that is none of theirs; the message lists them.
pub fn find(name: &str) -> Result<&'static Phantom> {
    PHANTOMS.iter().find(|phantom| phantom.name == name).ok_or_else(|| {
        let names: Vec<&str> = PHANTOMS.iter().map(|p| p.name).collect();
        Error::input(name, "there is no phantom of that name", format!("give one of {}", names.join(", ")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn phantoms_are_found_by_the_name_in_their_file() {
        for phantom in list() {
            let scene: toml::Table = phantom.toml.parse().expect("a scene file");
            assert_eq!(scene["name"].as_str(), Some(phantom.name));
            assert_eq!(find(phantom.name).ok(), Some(phantom));
        }
        assert!(find("giraffe").is_err());
        assert_eq!(list()[0].name, "adult");
    }
}
