//! From one case's words to its scene, photons, fields and paths.

use std::sync::Arc;

use glam::DVec3;
use toml::Value;

use super::list;
use super::paths::{ListedPath, Machine, PathSet, Shot};
use super::plane::{PlanePoints, Problem};
use super::schema::{ControlPointSpec, OrganChange, PathsSpec, PointSpec, StudySpec, Weights};
use super::sweep::Sweep;
use super::{Blame, Input, MAX_FIELDS};
use crate::error::{Error, Result};
use crate::geometry::Side;
use crate::physics::{DetectorResponse, Material, Spectrum};
use crate::scene::beam::{BeamKind, DEFAULT_SAD_MM};
use crate::scene::build::{MAX_DENSITY_G_CM3, SCENE_FILE, SPECTRUM_FILE};
use crate::scene::iec::IecAngles;
use crate::scene::panel::MAX_COORDINATE_MM;
use crate::scene::ranges::Angles;
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

    /// The machine at each control point, with its weight.
    fn machines(&self, spec: &StudySpec, scene: usize) -> Result<Vec<(Machine, f64)>> {
        let beam = &spec.beam;
        let sad_mm = self.distance(&["beam", "sad_mm"], beam.sad_mm.unwrap_or(DEFAULT_SAD_MM))?;
        let scene = &self.scenes[scene].1;
        let isocentre_mm = match (&beam.isocentre, beam.isocentre_mm) {
            (Some(_), Some(_)) => {
                let problem = "the isocentre is given twice";
                return Err(self.at(&["beam", "isocentre"], problem, "drop `isocentre` or `isocentre_mm`"));
            }
            (Some(name), None) => {
                let organ = self.organ(&["beam", "isocentre"], name, &scene.organs)?;
                scene.organs[organ].body.surface().centroid_mm()
            }
            (None, given) => DVec3::from(given.unwrap_or_default()),
        };
        self.finite(&["beam", "isocentre_mm"], &isocentre_mm.to_array())?;
        let own = [beam.gantry_deg, beam.couch_deg, beam.collimator_deg];
        for (key, angle) in ["gantry_deg", "couch_deg", "collimator_deg"].into_iter().zip(own) {
            self.finite(&["beam", key], &[angle])?;
        }
        let machine = |[gantry_deg, couch_deg, collimator_deg]: [f64; 3]| {
            let patient_position = beam.patient_position;
            let angles = IecAngles { gantry_deg, couch_deg, collimator_deg, patient_position };
            let axes = angles.beam_axes();
            let source_mm = isocentre_mm + sad_mm * axes.z;
            Machine { kind: beam.kind, source_mm, isocentre_mm, sad_mm, angles: Some(angles), axes }
        };
        if let Some(source) = beam.source_mm {
            self.finite(&["beam", "source_mm"], &source)?;
            if beam.kind == BeamKind::Parallel
                || !beam.control_points.is_empty()
                || spec.paths.points.is_none()
            {
                let problem = "a source placed by hand has no angles";
                let remedy = "use it with `points` only, in a cone; or give angles in its place";
                return Err(self.at(&["beam", "source_mm"], problem, remedy));
            }
            let by_hand = Machine { source_mm: source.into(), angles: None, ..machine([0.0; 3]) };
            return Ok(vec![(by_hand, 1.0)]);
        }
        if beam.control_points.is_empty() {
            return Ok(vec![(machine(own), 1.0)]);
        }
        let mut machines = Vec::new();
        for (index, point) in beam.control_points.iter().enumerate() {
            machines
                .extend(self.control_points(index, point, own)?.into_iter().map(|(a, w)| (machine(a), w)));
        }
        Ok(machines)
    }

    /// The angles and weights of an entry of control points.
    fn control_points(
        &self,
        index: usize,
        spec: &ControlPointSpec,
        own: [f64; 3],
    ) -> Result<Vec<([f64; 3], f64)>> {
        let at = |key, problem: &str, remedy| {
            let path = [Step::Key("beam"), Step::Key("control_points"), Step::Index(index), Step::Key(key)];
            self.blame.at(&path, problem, remedy)
        };
        let angles = [&spec.gantry_deg, &spec.couch_deg, &spec.collimator_deg];
        let weights = match &spec.weight {
            None => vec![1.0],
            Some(Weights::One(weight)) => vec![*weight],
            Some(Weights::Each(weights)) => weights.clone(),
        };
        let length = |given: &Option<Angles>| given.as_ref().map_or(1, |angles| angles.degrees().len());
        let count = angles.into_iter().map(length).chain([weights.len()]).max().unwrap_or(1);
        let keys = ["gantry_deg", "couch_deg", "collimator_deg", "weight"];
        for (key, length) in keys.into_iter().zip(angles.into_iter().map(length).chain([weights.len()])) {
            if length != 1 && length != count {
                let problem = format!("{length} values cannot go with {count} of another key");
                return Err(at(key, &problem, "give one value, or as many of each"));
            }
        }
        if let Some(weight) = weights.iter().find(|weight| !(**weight > 0.0 && weight.is_finite())) {
            return Err(at("weight", &format!("{weight} is no weight"), "give weights above zero"));
        }
        let pick = |values: &[f64], i: usize| if values.len() == 1 { values[0] } else { values[i] };
        Ok((0..count)
            .map(|i| {
                let angle =
                    |axis: usize| angles[axis].as_ref().map_or(own[axis], |angles| pick(angles.degrees(), i));
                ([angle(0), angle(1), angle(2)], pick(&weights, i))
            })
            .collect())
    }

    /// The paths, and the names of their targets.
    fn paths(&mut self, spec: &StudySpec, scene: usize) -> Result<(PathSet, Vec<String>)> {
        let PathsSpec { points, segments_mm, csv, fan, grid, field, beyond_mm, .. } = &spec.paths;
        let shapes = [
            points.is_some(),
            segments_mm.is_some(),
            csv.is_some(),
            fan.is_some(),
            grid.is_some(),
            field.is_some(),
        ];
        if shapes.iter().filter(|is_given| **is_given).count() != 1 {
            let remedy = "give one of `points`, `segments_mm`, `csv`, `fan`, `grid` or `field`";
            return Err(self.at(&["paths"], "a study has paths of one kind", remedy));
        }
        let beyond = beyond_mm.unwrap_or(0.0);
        self.finite(&["paths", "beyond_mm"], &[beyond])?;
        if beyond < 0.0 {
            let problem = format!("{beyond} mm is not behind the target");
            return Err(self.at(&["paths", "beyond_mm"], &problem, "give 0 or more"));
        }
        let is_list = segments_mm.is_some() || csv.is_some();
        if is_list && (beyond_mm.is_some() || !spec.beam.control_points.is_empty()) {
            let key: &[&str] =
                if beyond_mm.is_some() { &["paths", "beyond_mm"] } else { &["beam", "control_points"] };
            return Err(self.at(
                key,
                "has no meaning for paths with sources and targets of their own",
                "drop it",
            ));
        }
        if let Some(points) = points {
            let organs = &self.scenes[scene].1.organs;
            let named = points.iter().enumerate().map(|(i, point)| self.point(i, point, organs));
            let (names, points): (Vec<_>, Vec<_>) = named.collect::<Result<Vec<_>>>()?.into_iter().unzip();
            if points.is_empty() {
                return Err(self.at(&["paths", "points"], "the list is empty", "give at least one point"));
            }
            return Ok((PathSet::Points { points, beyond_mm: beyond }, names));
        }
        if let Some(segments) = segments_mm {
            return Ok((self.segments(segments)?, Vec::new()));
        }
        if let Some(file) = csv {
            return Ok((PathSet::List(self.list(file)?), Vec::new()));
        }
        // Far enough that a patient between source and isocentre, and as far behind, is passed.
        let beyond_mm = beyond_mm.unwrap_or_else(|| spec.beam.sad_mm.unwrap_or(DEFAULT_SAD_MM));
        let (kind, points) = if let Some(fan) = fan {
            ("fan", PlanePoints::fan(fan))
        } else if let Some(grid) = grid {
            ("grid", PlanePoints::grid(grid))
        } else if let Some(field) = field {
            ("field", PlanePoints::field(field))
        } else {
            ("", Err(("", "it is missing".into(), "give paths")))
        };
        let points = points.map_err(|(key, problem, remedy): Problem| {
            let keys: Vec<&str> = ["paths", kind, key].into_iter().filter(|key| !key.is_empty()).collect();
            self.at(&keys, &problem, remedy)
        })?;
        Ok((PathSet::Plane { points, beyond_mm }, Vec::new()))
    }

    fn segments(&self, segments: &[[f64; 6]]) -> Result<PathSet> {
        let path = |(i, &ends): (usize, &[f64; 6])| {
            let at = [Step::Key("paths"), Step::Key("segments_mm"), Step::Index(i)];
            let is_fit = ends.iter().all(|x| x.abs() <= MAX_COORDINATE_MM);
            let listed = if is_fit {
                list::listed(ends, 1.0)
            } else {
                Err(("a coordinate is not finite, or beyond 1e9 mm".into(), "give points in millimetres"))
            };
            listed.map_err(|(problem, remedy)| self.blame.at(&at, &problem, remedy))
        };
        let paths: Vec<ListedPath> = segments.iter().enumerate().map(path).collect::<Result<_>>()?;
        if paths.is_empty() {
            return Err(self.at(&["paths", "segments_mm"], "the list is empty", "give at least one segment"));
        }
        Ok(PathSet::List(Arc::new(paths)))
    }

    fn list(&mut self, file: &str) -> Result<Arc<Vec<ListedPath>>> {
        if let Some((_, list)) = self.lists.iter().find(|(known, _)| known == file) {
            return Ok(Arc::clone(list));
        }
        let path = self.folder.resolve(file).map_err(|e| self.reworded(&["paths", "csv"], e))?;
        let text = regular_file::read_text(&path, list::PATH_FILE)?;
        let paths = Arc::new(list::read(file, &text)?);
        self.inputs.push(Input::new("paths", file, text.as_bytes()));
        self.lists.push((file.into(), Arc::clone(&paths)));
        Ok(paths)
    }

    /// A point of interest, with its name.
    fn point(&self, index: usize, spec: &PointSpec, organs: &[Organ]) -> Result<(String, DVec3)> {
        let at = |key, problem: &str, remedy: &str| {
            let path = [Step::Key("paths"), Step::Key("points"), Step::Index(index), Step::Key(key)];
            self.blame.at(&path, problem, remedy)
        };
        let known = |name: &String| {
            organs.iter().position(|organ| organ.name == *name).ok_or_else(|| {
                let names: Vec<_> = organs.iter().map(|organ| organ.name.as_str()).collect();
                let remedy = format!("name one of {}", names.join(", "));
                at("organ", &format!("the scene has no organ `{name}`"), &remedy)
            })
        };
        let organ = spec.organ.as_ref().map(known).transpose()?;
        let point = match (spec.at_mm, organ) {
            (Some(given), _) if given.iter().any(|x| !x.is_finite() || x.abs() > MAX_COORDINATE_MM) => {
                return Err(at("at_mm", "a coordinate is not finite, or beyond 1e9 mm", "give millimetres"));
            }
            (Some(given), organ) => {
                let point = DVec3::from(given);
                if let Some(organ) = organ.map(|organ| &organs[organ])
                    && organ.body.surface().side_of(point) == Side::Outside
                {
                    let problem = format!("the point is not inside `{}`", organ.name);
                    return Err(at("at_mm", &problem, "move the point, or drop `organ`"));
                }
                point
            }
            (None, Some(organ)) => organs[organ].body.surface().centroid_mm(),
            (None, None) => {
                return Err(at(
                    "name",
                    "the point has no place",
                    "give `at_mm`, or `organ` for its centroid",
                ));
            }
        };
        let name = spec
            .name
            .clone()
            .or_else(|| spec.organ.clone())
            .unwrap_or_else(|| format!("point {}", index + 1));
        Ok((name, point))
    }

    fn reference_distance(&self, spec: &StudySpec) -> Result<Option<f64>> {
        let is_list = spec.paths.segments_mm.is_some() || spec.paths.csv.is_some();
        let keys = ["paths", "reference_distance_mm"];
        if spec.beam.kind == BeamKind::Parallel && !is_list {
            return match spec.paths.reference_distance_mm {
                None => Ok(None),
                Some(_) => {
                    let problem = "parallel rays have the same fluence at any distance";
                    Err(self.at(&keys, problem, "drop it, or let the beam be a cone"))
                }
            };
        }
        let given = spec.paths.reference_distance_mm.or(spec.beam.sad_mm);
        self.distance(&keys, given.unwrap_or(DEFAULT_SAD_MM)).map(Some)
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
