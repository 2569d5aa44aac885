//! From a scene file to a scene: every organ proved, nested and given its material, or all that is wrong at once.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::body::{self, Proved};
use super::folder::Folder;
use super::nesting;
use super::organ::{Organ, Origin};
use super::schema::{OrganSpec, SceneSpec, SpectrumSpec};
use super::text::{SceneText, Step};
use super::{Scene, phantoms, regular_file};
use crate::error::{Error, Result};
use crate::physics::composite::parse_colour;
use crate::physics::{Appearance, Material, Opacity, Spectrum};

/// The energy of scenes that name none, keV: near the mean of a 120 kVp beam.
const DEFAULT_ENERGY_KEV: f64 = 60.0;
/// How organs look that do not say: the greys and the opacity of Atalay & Mount's Fig. 12.
const DEFAULT_COLOUR: &str = "#808080";
/// See [`DEFAULT_COLOUR`].
const DEFAULT_OPACITY: f64 = 0.5;
/// Forty times the densest matter on Earth. Beyond some 1e300, attenuation would overflow.
pub(crate) const MAX_DENSITY_G_CM3: f64 = 1000.0;
/// A scene file longer than 16 MiB is no scene file.
pub(crate) const SCENE_FILE: regular_file::Kind = regular_file::Kind {
    name: "scene file",
    max_bytes: 16 << 20,
    if_too_large: "give a scene file in TOML; surfaces belong in mesh files beside it",
};
/// A megabyte holds some fifty thousand bins: one for each eV that tables resolve.
pub(crate) const SPECTRUM_FILE: regular_file::Kind = regular_file::Kind {
    name: "spectrum file",
    max_bytes: 1 << 20,
    if_too_large: "give a table of energy_keV,weight with fewer bins",
};
/// More organs than any phantom has; their pairs are all compared.
const MAX_ORGANS: usize = 5_000;

impl Scene {
    /// The scene of a file.
    ///
    /// # Errors
    /// All that is wrong with it, each with its place in the file.
    pub fn load(path: &Path) -> Result<Self> {
        let text = regular_file::read_text(path, SCENE_FILE)?;
        let name = path.display().to_string();
        Self::build(&SceneText::new(name, text), &Folder::of(path))
    }

    /// A phantom that comes with the program.
    ///
    /// # Errors
    /// A name that is none of [`phantoms::list`]'s.
    pub fn phantom(name: &str) -> Result<Self> {
        let phantom = phantoms::find(name)?;
        Self::build(&SceneText::new(format!("{}.toml", phantom.name), phantom.toml), &Folder::none())
    }

    /// The scene that `text` describes, with mesh files from `folder`.
    pub fn build(text: &SceneText, folder: &Folder) -> Result<Self> {
        let spec: SceneSpec = text.parse()?;
        let mut errors = Vec::new();
        if spec.organ.is_empty() || spec.organ.len() > MAX_ORGANS {
            errors.push(text.error(
                &[Step::Key("organ")],
                format!("the scene has {} organs", spec.organ.len()),
                "here",
                format!("give 1 to {MAX_ORGANS} tables `[[organ]]`"),
            ));
            return Err(Error::several(errors));
        }
        errors.extend(name_errors(&spec.organ, text));
        errors.extend(spec.beam.views().err().map(|problem| {
            let path: Vec<Step> =
                std::iter::once("beam").chain(problem.key.split('.')).map(Step::Key).collect();
            text.error(&path, format!("beam: {}", problem.problem), "here", problem.remedy)
        }));
        let spectrum = keep(spectrum(&spec.spectrum, text, folder), &mut errors);
        let organs: Vec<Result<Organ>> =
            spec.organ.par_iter().enumerate().map(|(i, o)| organ(o, i, text, folder)).collect();
        let mut organs: Vec<Organ> = organs.into_iter().filter_map(|o| keep(o, &mut errors)).collect();
        if errors.is_empty() {
            let said: Vec<_> = spec.organ.iter().map(|o| o.inside.clone()).collect();
            errors.extend(nesting::arrange(&mut organs, &said, text).err().into_iter().flatten());
        }
        match spectrum {
            Some(spectrum) if errors.is_empty() => Ok(Self {
                name: spec.name.unwrap_or_else(|| stem(text.name())),
                description: spec.description,
                source: text.name().to_owned(),
                organs,
                beam: spec.beam,
                spectrum,
                filters: spec.spectrum.filters,
                response: spec.spectrum.response,
            }),
            _ => Err(Error::several(errors)),
        }
    }
}

/// The value, or its error put with the others.
fn keep<T>(result: Result<T>, errors: &mut Vec<Error>) -> Option<T> {
    result.map_err(|e| errors.push(e)).ok()
}

fn stem(file: &str) -> String {
    PathBuf::from(file).file_stem().map_or_else(|| "scene".into(), |s| s.to_string_lossy().into_owned())
}

/// Names that are empty, unprintable or given twice.
fn name_errors(organs: &[OrganSpec], text: &SceneText) -> Vec<Error> {
    let mut seen: HashMap<&str, usize> = HashMap::new();
    let mut errors = Vec::new();
    for (i, organ) in organs.iter().enumerate() {
        let path = [Step::Key("organ"), Step::Index(i), Step::Key("name")];
        if organ.name.trim().is_empty() || organ.name.chars().any(char::is_control) {
            errors.push(text.error(
                &path,
                "an organ's name is empty or has control characters",
                "this name",
                "name it",
            ));
        } else if seen.insert(&organ.name, i).is_some() {
            errors.push(text.error(
                &path,
                format!("two organs are called `{}`", organ.name),
                "the second",
                "give each organ a name of its own",
            ));
        }
    }
    errors
}

fn organ(spec: &OrganSpec, index: usize, text: &SceneText, folder: &Folder) -> Result<Organ> {
    let at = |key: &str, error: Error| {
        let (message, remedy) = error.into_words();
        let path = [Step::Key("organ"), Step::Index(index), Step::Key(key)];
        text.error(&path, format!("organ `{}`: {message}", spec.name), "here", remedy)
    };
    let material = Material::named(&spec.material).map_err(|e| at("material", e))?;
    let density_g_cm3 = match spec.density_g_cm3 {
        Some(d) if (0.0..=MAX_DENSITY_G_CM3).contains(&d) => d,
        Some(d) => {
            let error = Error::input(
                "density_g_cm3",
                format!("{d} is no density"),
                format!("give a density in g/cm³, from 0 to {MAX_DENSITY_G_CM3}"),
            );
            return Err(at("density_g_cm3", error));
        }
        None => material.density_g_cm3(),
    };
    let appearance = appearance(spec).map_err(|(key, e)| at(key, e))?;
    let (Proved { body, notices }, origin) = match (&spec.shape, &spec.shapes[..], &spec.mesh) {
        (Some(shape), [], None) => {
            let shapes = vec![shape.clone()];
            (body::of_shapes(&spec.name, &shapes).map_err(|e| at("shape", e))?, Origin::Shapes(shapes))
        }
        (None, shapes @ [_, ..], None) => (
            body::of_shapes(&spec.name, shapes).map_err(|e| at("shapes", e))?,
            Origin::Shapes(shapes.to_vec()),
        ),
        (None, [], Some(mesh)) => {
            let groups = mesh.chosen_groups().map_err(|e| at("mesh", e))?.unwrap_or_default();
            let proved = body::of_mesh(mesh, folder).map_err(|e| at("mesh", e))?;
            (proved, Origin::Mesh { file: mesh.file.clone(), groups })
        }
        _ => {
            let error = Error::input("organ", "it needs one body", "give one of `shape`, `shapes` or `mesh`");
            return Err(at("name", error));
        }
    };
    Ok(Organ {
        name: spec.name.clone(),
        body,
        material,
        density_g_cm3,
        appearance,
        origin,
        parent: None,
        children: Vec::new(),
        depth: 0,
        notices,
    })
}

/// How an organ looks.
fn appearance(spec: &OrganSpec) -> Result<Appearance, (&'static str, Error)> {
    let (key, opacity) = match (spec.opacity, spec.extinction_per_mm) {
        (Some(_), Some(_)) => {
            let error =
                Error::input("opacity", "both opacities are given", "give `opacity` or `extinction_per_mm`");
            return Err(("opacity", error));
        }
        (None, Some(k)) => ("extinction_per_mm", Opacity::PerMm(k)),
        (share, None) => ("opacity", Opacity::PerCrossing(share.unwrap_or(DEFAULT_OPACITY))),
    };
    let colour = parse_colour(spec.colour.as_deref().unwrap_or(DEFAULT_COLOUR)).map_err(|e| ("colour", e))?;
    Appearance::new(&spec.name, colour, opacity).map_err(|e| (key, e))
}

fn spectrum(spec: &SpectrumSpec, text: &SceneText, folder: &Folder) -> Result<Spectrum> {
    spec.spectrum(folder).map_err(|(key, error)| {
        let (message, remedy) = error.into_words();
        text.error(&[Step::Key("spectrum"), Step::Key(key)], format!("spectrum: {message}"), "here", remedy)
    })
}

impl SpectrumSpec {
    /// The photons behind the filters, with files from `folder`; or what is wrong, and with which key.
    pub(crate) fn spectrum(&self, folder: &Folder) -> Result<Spectrum, (&'static str, Error)> {
        let source = match (self.energy_kev, self.kvp, &self.file) {
            (Some(energy), None, None) => Spectrum::mono(energy).map_err(|e| ("energy_keV", e))?,
            (None, Some(kvp), None) => Spectrum::tungsten(kvp).map_err(|e| ("kvp", e))?,
            (None, None, Some(file)) => read_spectrum(file, folder).map_err(|e| ("file", e))?,
            (None, None, None) => Spectrum::mono(DEFAULT_ENERGY_KEV).map_err(|e| ("energy_keV", e))?,
            _ => {
                let error = Error::input(
                    "spectrum",
                    "it has several sources",
                    "give one of `energy_keV`, `kvp` or `file`",
                );
                return Err(("kvp", error));
            }
        };
        source.filtered(&self.filters).map_err(|e| ("filters", e))
    }
}

fn read_spectrum(file: &str, folder: &Folder) -> Result<Spectrum> {
    let path = folder.resolve(file)?;
    Spectrum::from_csv(file, &regular_file::read_text(&path, SPECTRUM_FILE)?)
}
