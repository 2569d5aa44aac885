//! From one case's words to its scene, photons, fields and paths.

mod machines;
mod targets;

use std::sync::Arc;

use toml::Value;

use super::paths::{ListedPath, Machine, PathSet, Shot};
use super::schema::{OrganChange, StudySpec};
use super::sweep::Sweep;
use super::{Blame, Input, MAX_FIELDS};
use crate::error::{Error, Result};
use crate::physics::{DetectorResponse, Material, Spectrum};
use crate::scene::build::{MAX_DENSITY_G_CM3, SCENE_FILE, SPECTRUM_FILE};
use crate::scene::panel::MAX_COORDINATE_MM;
use crate::scene::text::Step;
use crate::scene::{Folder, Organ, Scene, SceneText, phantoms, regular_file};

/// Bins of length histograms where none are given, mm.
const DEFAULT_BIN_MM: f64 = 5.0;

/// One combination of the swept parameters' values.
#[derive(Clone, Debug)]
pub struct Case {
    values: Vec<Value>,
    scene: usize,
    /// The photons before the patient, behind all filters.
    pub spectrum: Spectrum,
    /// What weighs photons in the signal's transmission.
    pub response: DetectorResponse,
    /// The energy of quantities of a single energy, keV.
    pub reference_energy_kev: f64,
    /// Each organ's material, and its density in g/cm³.
    pub organs: Vec<(Material, f64)>,
    /// The width of the bins of length histograms, mm.
    pub histogram_bin_mm: f64,
    /// The distance from the source at which the fluence in air is 1, mm; `None` of parallel beams, where it is 1 anywhere.
    pub reference_distance_mm: Option<f64>,
    point_names: Vec<String>,
    pub(super) paths: PathSet,
}

impl Case {
    /// The values of the study's parameters.
    pub fn values(&self) -> &[Value] {
        &self.values
    }

    /// The index of its scene.
    pub fn scene(&self) -> usize {
        self.scene
    }

    /// The name of the point of interest that a path leads to, by the path's number in its field.
    pub fn point_name(&self, index: u64) -> Option<&str> {
        self.point_names.get(usize::try_from(index).ok()?).map(String::as_str)
    }

    /// Whether each path has a source of its own.
    pub fn is_list(&self) -> bool {
        matches!(self.paths, PathSet::List(_))
    }

    /// Whether paths stand for parts of the isocentre plane.
    pub fn has_pencils(&self) -> bool {
        matches!(&self.paths, PathSet::Plane { points, .. } if points.cell_mm2().is_some())
    }

    /// Whether paths lead to targets of interest, so that one outside the scene is worth a remark.
    pub fn has_targets(&self) -> bool {
        !matches!(self.paths, PathSet::Plane { .. })
    }
}

/// One control point of a case: a source, and the paths that lead from it.
#[derive(Clone, Debug)]
pub struct Field {
    case: usize,
    control_point: usize,
    machine: Machine,
    weight: f64,
    share: f64,
    first_path: u64,
    paths: u64,
}

impl Field {
    /// The index of its case.
    pub fn case(&self) -> usize {
        self.case
    }

    /// Its place among the case's control points.
    pub fn control_point(&self) -> usize {
        self.control_point
    }

    /// Where the source stands. Paths of lists have sources of their own.
    pub fn machine(&self) -> &Machine {
        &self.machine
    }

    /// Its weight as given.
    pub fn weight(&self) -> f64 {
        self.weight
    }

    /// Its weight as a share of the sum over the case's control points.
    pub fn share(&self) -> f64 {
        self.share
    }

    /// The number of its first path in the study.
    pub fn first_path(&self) -> u64 {
        self.first_path
    }

    /// How many paths it has.
    pub fn paths(&self) -> u64 {
        self.paths
    }
}

/// Builds cases one by one; scenes and lists are read once.
pub(super) struct Builder<'a> {
    blame: Blame<'a>,
    folder: &'a Folder,
    pub scenes: Vec<(String, Scene)>,
    lists: Vec<(String, Arc<Vec<ListedPath>>)>,
    pub cases: Vec<Case>,
    pub fields: Vec<Field>,
    pub inputs: Vec<Input>,
}

impl<'a> Builder<'a> {
    pub fn new(text: &'a SceneText, folder: &'a Folder, sweep: &'a Sweep) -> Self {
        Self {
            blame: Blame { text, sweep },
            folder,
            scenes: Vec::new(),
            lists: Vec::new(),
            cases: Vec::new(),
            fields: Vec::new(),
            inputs: Vec::new(),
        }
    }

    pub fn add(&mut self, spec: &StudySpec, values: Vec<Value>) -> Result<()> {
        let scene = self.scene(&spec.scene)?;
        let (spectrum, response) = self.photons(spec, scene)?;
        let organs = self.organs(spec, scene)?;
        let reference_energy_kev = spec.reference_energy_kev.unwrap_or_else(|| spectrum.mean_energy_kev());
        Spectrum::mono(reference_energy_kev).map_err(|e| self.reworded(&["reference_energy_keV"], e))?;
        let histogram_bin_mm = spec.histogram_bin_mm.unwrap_or(DEFAULT_BIN_MM);
        if !(1e-3..=1e6).contains(&histogram_bin_mm) {
            let problem = format!("{histogram_bin_mm} mm is no width of a bin");
            return Err(self.at(&["histogram_bin_mm"], &problem, "give millimetres, from 0.001 to 1e6"));
        }
        let machines = self.machines(spec, scene)?;
        let (paths, point_names) = self.paths(spec, scene)?;
        let reference_distance_mm = self.reference_distance(spec)?;

        let case = Case {
            values,
            scene,
            spectrum,
            response,
            reference_energy_kev,
            organs,
            histogram_bin_mm,
            reference_distance_mm,
            point_names,
            paths,
        };
        self.check_paths(&case, &machines)?;
        self.enter(case, machines)
    }

    /// Numbers the case's fields and paths.
    fn enter(&mut self, case: Case, machines: Vec<(Machine, f64)>) -> Result<()> {
        let total: f64 = machines.iter().map(|(_, weight)| weight).sum();
        let paths = case.paths.count();
        for (control_point, (machine, weight)) in machines.into_iter().enumerate() {
            let first_path = self.fields.last().map_or(0, |field| field.first_path + field.paths);
            let too_many = self.fields.len() >= MAX_FIELDS || first_path.checked_add(paths).is_none();
            if too_many {
                let problem =
                    format!("there are more than {MAX_FIELDS} fields, or more paths than can be counted");
                return Err(self.at(&["sweep"], &problem, "use coarser steps, or fewer control points"));
            }
            let (case, share) = (self.cases.len(), weight / total);
            self.fields.push(Field { case, control_point, machine, weight, share, first_path, paths });
        }
        self.cases.push(case);
        Ok(())
    }

    fn at(&self, keys: &[&str], problem: &str, remedy: &str) -> Error {
        let path: Vec<Step> = keys.iter().map(|key| Step::Key(key)).collect();
        self.blame.at(&path, problem, remedy)
    }

    /// The error `e`, at a place of the study.
    fn reworded(&self, keys: &[&str], e: Error) -> Error {
        let (problem, remedy) = e.into_words();
        self.at(keys, &problem, &remedy)
    }

    fn finite(&self, keys: &[&str], values: &[f64]) -> Result<()> {
        match values.iter().find(|value| !value.is_finite() || value.abs() > MAX_COORDINATE_MM) {
            None => Ok(()),
            Some(value) => Err(self.at(
                keys,
                &format!("{value} does not serve"),
                "give a finite number of mm or degrees",
            )),
        }
    }

    fn distance(&self, keys: &[&str], value: f64) -> Result<f64> {
        self.finite(keys, &[value])?;
        if value > 0.0 {
            return Ok(value);
        }
        Err(self.at(keys, &format!("{value} mm is not positive"), "give a number greater than zero"))
    }

    fn scene(&mut self, name: &str) -> Result<usize> {
        if let Some(known) = self.scenes.iter().position(|(known, _)| known == name) {
            return Ok(known);
        }
        let scene = if let Ok(phantom) = phantoms::find(name) {
            self.inputs.push(Input::new("scene", name, phantom.toml.as_bytes()));
            Scene::phantom(name)?
        } else {
            let path = self.folder.resolve(name).map_err(|e| {
                let names: Vec<_> = phantoms::list().iter().map(|p| p.name).collect();
                let (problem, remedy) = e.into_words();
                let remedy =
                    format!("name one of the phantoms {}, or a scene file: {remedy}", names.join(", "));
                self.at(&["scene"], &problem, &remedy)
            })?;
            let text = regular_file::read_text(&path, SCENE_FILE)?;
            self.inputs.push(Input::new("scene", name, text.as_bytes()));
            Scene::build(&SceneText::new(path.display().to_string(), text), &Folder::of(&path))?
        };
        self.scenes.push((name.into(), scene));
        Ok(self.scenes.len() - 1)
    }

    fn photons(&mut self, spec: &StudySpec, scene: usize) -> Result<(Spectrum, DetectorResponse)> {
        let scene = &self.scenes[scene].1;
        let Some(given) = &spec.spectrum else { return Ok((scene.spectrum.clone(), scene.response)) };
        if given.energy_kev.is_none() && given.kvp.is_none() && given.file.is_none() {
            let problem = "it names no photons";
            return Err(self.at(&["spectrum"], problem, "give one of `energy_keV`, `kvp` or `file`"));
        }
        let mut given = given.clone();
        if given.filters.is_empty() {
            given.filters.clone_from(&scene.filters);
        }
        let spectrum =
            given.spectrum(self.folder).map_err(|(key, error)| self.reworded(&["spectrum", key], error))?;
        if let Some(file) = given.file.filter(|file| !self.inputs.iter().any(|input| input.file == *file)) {
            let bytes = regular_file::read(&self.folder.resolve(&file)?, SPECTRUM_FILE)?;
            self.inputs.push(Input::new("spectrum", &file, &bytes));
        }
        Ok((spectrum, given.response))
    }

    fn organs(&self, spec: &StudySpec, scene: usize) -> Result<Vec<(Material, f64)>> {
        let organs = &self.scenes[scene].1.organs;
        let mut made: Vec<_> = organs.iter().map(|organ| (organ.material, organ.density_g_cm3)).collect();
        for (name, OrganChange { material, density_g_cm3 }) in &spec.organ {
            let index = self.organ(&["organ", name], name, organs)?;
            if let Some(material) = material {
                let known = Material::named(material);
                made[index].0 = known.map_err(|e| self.reworded(&["organ", name, "material"], e))?;
            }
            if let Some(density) = *density_g_cm3 {
                if !(0.0..=MAX_DENSITY_G_CM3).contains(&density) {
                    let remedy = format!("give a density in g/cm³, from 0 to {MAX_DENSITY_G_CM3}");
                    let keys = ["organ", name, "density_g_cm3"];
                    return Err(self.at(&keys, &format!("{density} is no density"), &remedy));
                }
                made[index].1 = density;
            }
        }
        Ok(made)
    }

    /// The organ of a name.
    fn organ(&self, keys: &[&str], name: &str, organs: &[Organ]) -> Result<usize> {
        organs.iter().position(|organ| organ.name == name).ok_or_else(|| {
            let names: Vec<_> = organs.iter().map(|organ| organ.name.as_str()).collect();
            let problem = format!("the scene has no organ `{name}`");
            self.at(keys, &problem, &format!("name one of {}", names.join(", ")))
        })
    }

    /// Refuses paths without a direction.
    fn check_paths(&self, case: &Case, machines: &[(Machine, f64)]) -> Result<()> {
        for (machine, _) in machines {
            let fails = |index: &u64| case.paths.shot(machine, *index).segment().is_none();
            match &case.paths {
                PathSet::Points { .. } => {
                    if let Some(index) = (0..case.paths.count()).find(fails) {
                        let path = [Step::Key("paths"), Step::Key("points"), Step::Index(index as usize)];
                        let problem = "the point is the source, so that the path has no direction";
                        return Err(self.blame.at(&path, problem, "move the point or the source"));
                    }
                }
                PathSet::Plane { .. } => {
                    let photons = |shot: Shot| shot.photons > 0.0 && shot.photons.is_finite();
                    let ends = [0, case.paths.count() - 1];
                    if ends.iter().any(|i| fails(i) || !photons(case.paths.shot(machine, *i))) {
                        let problem = "the source is so near, or so far, that paths cannot be told apart";
                        return Err(self.at(
                            &["beam", "sad_mm"],
                            problem,
                            "give the distance in millimetres",
                        ));
                    }
                }
                PathSet::List(_) => {}
            }
        }
        Ok(())
    }
}
