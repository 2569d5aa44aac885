//! What a report shows of a study: fields over the phantom, and what is left along paths.

use glam::DVec3;

use super::{DepthPoint, Dose};
use crate::error::{Error, Result};
use crate::geometry::UnitDir;
use crate::modes::Control;
use crate::modes::project::{Method, Projector, Wanted};
use crate::scene::beam::BeamKind;
use crate::scene::{Panel, Pose, Scene, View};
use crate::study::{Case, Field, Machine};

/// Columns and rows of a picture.
const PIXELS: u32 = 320;

/// Fields shown at most.
const FIELDS: usize = 4;

/// Paths marked in a picture at most.
const MARKS: u64 = 4_000;

/// How far around the paths a picture reaches, and how far at least from the isocentre, mm.
const MARGIN: f64 = 1.6;
const LEAST_HALF_MM: f64 = 150.0;

/// The step of curves along paths, mm.
const STEP_MM: f64 = 2.0;

/// A field as seen from its source.
#[derive(Clone, Debug, PartialEq)]
pub struct FieldPicture {
    /// The field's number.
    pub field: usize,
    /// Columns and rows.
    pub pixels: [u32; 2],
    /// The side of the square that it shows of the isocentre plane, mm.
    pub side_mm: f64,
    /// p = −ln T of each pixel, row by row; columns run along X_b, rows against Y_b.
    pub line_integral: Vec<f32>,
    /// Where paths cross the isocentre plane: column and row.
    pub marks: Vec<[f64; 2]>,
}

/// What is left along one path.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthCurve {
    /// The path's number.
    pub path: u64,
    /// Its field's number.
    pub field: usize,
    /// From the source to the path's end.
    pub points: Vec<DepthPoint>,
    /// The names of the scene's organs, by index.
    pub organs: Vec<String>,
}

/// What a report shows beside figures.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Illustrations {
    /// Some of the fields.
    pub pictures: Vec<FieldPicture>,
    /// A path through the middle of each of these.
    pub depths: Vec<DepthCurve>,
}

impl Dose<'_> {
    /// Pictures of some fields, evenly spread, and what is left along the middle path of each.
    ///
    /// # Errors
    /// [`Error::Interrupted`] soon after a request to stop.
    pub fn illustrations(&self, control: &Control) -> Result<Illustrations> {
        let fields = self.study.fields();
        let count = fields.len().min(FIELDS);
        let mut all = Illustrations::default();
        for index in (0..count).map(|i| i * fields.len() / count) {
            control.check()?;
            let field = &fields[index];
            if field.paths() == 0 {
                continue;
            }
            all.pictures.extend(self.picture(index, field, control)?);
            let path = field.first_path() + self.middle_path(field);
            let scene = self.study.scene_of(self.study.case_of(field));
            all.depths.push(DepthCurve {
                path,
                field: index,
                points: self.depths(path, STEP_MM)?,
                organs: scene.organs.iter().map(|organ| organ.name.clone()).collect(),
            });
        }
        Ok(all)
    }

    /// The field's path that passes nearest to the isocentre, of those that are marked.
    fn middle_path(&self, field: &Field) -> u64 {
        let machine = field.machine();
        let off_axis = |path: &u64| {
            let [x, y] = crossing(machine, &self.study.shot(field, *path));
            x.hypot(y)
        };
        let paths = marked(field.paths());
        paths.min_by(|a, b| off_axis(a).total_cmp(&off_axis(b))).unwrap_or(0)
    }

    /// `None` if there is no isocentre plane, or the source lies where nothing can be seen from.
    fn picture(&self, index: usize, field: &Field, control: &Control) -> Result<Option<FieldPicture>> {
        let (machine, case) = (field.machine(), self.study.case_of(field));
        if machine.angles.is_none() || case.is_list() {
            return Ok(None);
        }
        let crossings: Vec<[f64; 2]> =
            marked(field.paths()).map(|path| crossing(machine, &self.study.shot(field, path))).collect();
        let reach = crossings.iter().flatten().fold(0.0, |most: f64, x| most.max(x.abs()));
        let half = (MARGIN * reach).max(LEAST_HALF_MM);
        let Some(view) = view(machine, half, self.bounds[case.scene()].size().length()) else {
            return Ok(None);
        };
        let scene = scene_of(self.study.scene_of(case), case);
        let wanted = Wanted { lengths: false, attenuation: true, colour: false };
        let projector = Projector::new(&scene, wanted, None, Method::Exact(None))?;
        let projection = match projector.project(&view, 0, &control.without_progress()) {
            Err(Error::Interrupted) => return Err(Error::Interrupted),
            other => other?,
        };
        let to_pixels = |x: f64| 0.5 * (f64::from(PIXELS) - 1.0) + x * 0.5 * f64::from(PIXELS) / half;
        Ok(Some(FieldPicture {
            field: index,
            pixels: [PIXELS; 2],
            side_mm: 2.0 * half,
            line_integral: projection.line_integral(),
            marks: crossings.into_iter().map(|[x, y]| [to_pixels(x), to_pixels(-y)]).collect(),
        }))
    }
}

/// Numbers of paths of a field, evenly spread.
fn marked(paths: u64) -> impl Iterator<Item = u64> {
    let count = paths.min(MARKS);
    (0..count).map(move |i| (u128::from(i) * u128::from(paths) / u128::from(count)) as u64)
}

/// Where a path crosses the isocentre plane: along X_b and Y_b, mm. Paths along the plane are taken where they end.
fn crossing(machine: &Machine, shot: &crate::study::Shot) -> [f64; 2] {
    let Machine { axes, isocentre_mm, .. } = *machine;
    let (start, way) = (shot.source_mm - isocentre_mm, shot.path_mm);
    let share = -start.dot(axes.z) / way.dot(axes.z);
    let point = start + if share.is_finite() { share } else { 1.0 } * way;
    [point.dot(axes.x), point.dot(axes.y)]
}

/// The view from the machine's source of a square of the isocentre plane, on a detector behind all organs, which lie within
/// `depth` mm of each other. `None` if there is no such view.
fn view(machine: &Machine, half: f64, depth: f64) -> Option<View> {
    let Machine { kind, source_mm, isocentre_mm, sad_mm, axes, .. } = *machine;
    let sdd_mm = sad_mm + depth.max(half);
    let magnification = if kind == BeamKind::Cone { sdd_mm / sad_mm } else { 1.0 };
    let step = 2.0 * half * magnification / f64::from(PIXELS);
    let centre: DVec3 = isocentre_mm - (sdd_mm - sad_mm) * axes.z;
    let panel = Panel::centred(centre, step * axes.x, -step * axes.y, [PIXELS; 2]);
    match kind {
        BeamKind::Cone => View::cone(source_mm, panel, Pose::Free).ok(),
        BeamKind::Parallel => {
            View::parallel(source_mm, UnitDir::new(-axes.z)?, sdd_mm, panel, Pose::Free).ok()
        }
    }
}

/// The scene with a case's materials and photons.
fn scene_of(scene: &Scene, case: &Case) -> Scene {
    let mut scene = scene.clone();
    scene.spectrum = case.spectrum.clone();
    scene.response = case.response;
    for (organ, &(material, density)) in scene.organs.iter_mut().zip(&case.organs) {
        (organ.material, organ.density_g_cm3) = (material, density);
    }
    scene
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{Folder, SceneText};
    use crate::study::Study;

    const STUDY: &str = r#"
        scene = "calibration"
        [beam]
        sad_mm = 800
        isocentre = "sphere"
        control_points = [{ gantry_deg = "0..360:60" }]
        [paths]
        field = { rectangle_mm = [80, 40], spacing_mm = 8 }
        [spectrum]
        energy_keV = 60
    "#;

    #[test]
    fn the_isocentres_organ_is_in_the_middle_of_each_picture_and_marks_are_where_paths_cross() {
        let study = Study::build(&SceneText::new("study.toml", STUDY), &Folder::none(), &[], false);
        let study = study.expect("a study");
        let dose = Dose::new(&study, Method::Exact(None)).expect("ready");
        let shown = dose.illustrations(&Control::none()).expect("illustrations");
        assert_eq!((shown.pictures.len(), shown.depths.len()), (4, 4));
        for picture in &shown.pictures {
            let middle = (PIXELS * PIXELS / 2 + PIXELS / 2) as usize;
            assert!(picture.line_integral[middle] > 0.5, "{}", picture.line_integral[middle]);
            assert_eq!(picture.marks.len(), 50);
            // The first path crosses at (−36, −16) mm: left of the middle, and below.
            let scale = f64::from(PIXELS) / picture.side_mm;
            let [column, row] = picture.marks[0];
            assert!((column - 159.5 + 36.0 * scale).abs() < 1e-6, "{column}");
            assert!((row - 159.5 - 16.0 * scale).abs() < 1e-6, "{row}");
        }
        for curve in &shown.depths {
            let left: Vec<f64> = curve.points.iter().map(|p| p.transmission_reference).collect();
            assert!(left.windows(2).all(|w| w[1] <= w[0]) && left[0] == 1.0 && left[left.len() - 1] < 0.7);
        }
    }
}
