//! How far what `auto` chooses is from the best: bodies of few to many faces, images small and large, one view to many, loose
//! and tight tolerances.
//!
//! Each exact engine and each tolerance's tree projects the same orbit, in turns; its time is noted after the first view and
//! after more of them. The angles are such that the first few views are spread as evenly as all of them. What `auto` would
//! choose for the study up to there is one of those that were measured, and its time over the shortest is the ratio.

use serde::Serialize;

use super::race::race;
use super::{Contender, LENGTHS, Machine, Patience, Program};
use crate::error::Result;
use crate::exact::{Body, Engine};
use crate::geometry::ClosedMesh;
use crate::geometry::primitives::icosphere;
use crate::modes::Control;
use crate::modes::project::{Demand, Estimate, Interpolation, Projector, TreeSettings};
use crate::scene::{Folder, Scene, SceneText, View};

/// Views after which times are noted.
pub const VIEWS: [u64; 3] = [1, 8, 64];

/// Whoever took so many times the shortest time up to a number of views does not go on to more.
const HOPELESS: f64 = 6.0;

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct ChoiceSettings {
    /// How often each icosahedron's face is quartered: the bodies have 20 · 4ⁿ faces.
    pub subdivisions: Vec<u32>,
    /// Columns, and rows, of images.
    pub sizes: Vec<u32>,
    /// Of trees, mm.
    pub tolerances_mm: Vec<f64>,
    /// How long it may take.
    pub patience: Patience,
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct ChoiceReport {
    /// The program.
    #[serde(flatten)]
    pub program: Program,
    /// The command line; set by whoever knows it.
    pub command: String,
    /// Where it was measured.
    pub machine: Machine,
    /// By faces, size, views and tolerance.
    pub cells: Vec<ChoiceCell>,
    /// The largest ratio.
    pub worst_ratio: f64,
    /// Whether all that was to be measured was; not so after an interruption.
    pub complete: bool,
}

/// One study: a body, an image size, a number of views, a tolerance.
#[derive(Clone, Debug, Serialize)]
pub struct ChoiceCell {
    /// Of the body.
    pub faces: usize,
    /// Columns, and rows, of each view.
    pub side: u32,
    /// How many.
    pub views: u64,
    /// Of the tree, mm.
    pub tolerance_mm: f64,
    /// What the model says.
    pub estimate: Estimate,
    /// What `auto` chooses by it.
    pub chosen: &'static str,
    /// Seconds of all that were measured, from cold.
    pub seconds: Vec<(&'static str, f64)>,
    /// Leaves of the tree.
    pub leaves: u64,
    /// The chosen one's time over the shortest.
    pub ratio: f64,
}

/// How many turns [`choice`] takes at most, for its progress.
pub fn turns(settings: &ChoiceSettings) -> u64 {
    let contenders = ENGINES.len() + settings.tolerances_mm.len();
    let races = settings.subdivisions.len() * settings.sizes.len();
    (races * contenders * (settings.patience.rounds + 1)) as u64
}

const ENGINES: [Engine; 3] = [Engine::Raster, Engine::Walk, Engine::Bvh];

/// Measures. An interruption ends it with what there is.
///
/// # Errors
/// A size that does not serve.
pub fn choice(settings: &ChoiceSettings, control: &Control) -> Result<ChoiceReport> {
    let mut report = ChoiceReport {
        program: Program::THIS,
        command: String::new(),
        machine: Machine::this(),
        cells: Vec::new(),
        worst_ratio: 0.0,
        complete: true,
    };
    for &subdivisions in &settings.subdivisions {
        for &side in &settings.sizes {
            if report.complete {
                report.complete = measure(subdivisions, side, settings, control, &mut report.cells)?;
            }
        }
    }
    report.worst_ratio = report.cells.iter().map(|cell| cell.ratio).fold(0.0, f64::max);
    Ok(report)
}

/// An ellipsoid that fills half of the view, seen from all around.
fn scene(subdivisions: u32, side: u32) -> Result<Scene> {
    let most = VIEWS[VIEWS.len() - 1];
    // Reversed bits: any first power of two of them lie evenly.
    let bits = most.trailing_zeros();
    let angle = |i: u64| 360.0 * (i.reverse_bits() >> (64 - bits)) as f64 / most as f64;
    let angles: Vec<String> = (0..most).map(|i| angle(i).to_string()).collect();
    let text = format!(
        "[beam]\ngantry_deg = [{}]\nsad_mm = 1000\nsdd_mm = 1500\n\
         detector = {{ size_mm = [360, 360], pixels = [{side}, {side}] }}\n[spectrum]\nenergy_keV = 60\n\
         [[organ]]\nname = \"body\"\nmaterial = \"water\"\ndensity_g_cm3 = 1\n\
         shape = {{ kind = \"ellipsoid\", half_axes_mm = [98, 78, 58], faces = 64 }}\n",
        angles.join(", ")
    );
    let mut scene = Scene::build(&SceneText::new("choice.toml", text), &Folder::none())?;
    let mesh = icosphere(subdivisions).map_vertices(|v| v * glam::DVec3::new(98.0, 78.0, 58.0));
    if let (Some(organ), Ok((surface, _))) = (scene.organs.first_mut(), ClosedMesh::new(mesh)) {
        organ.body = Body::new(surface);
    }
    Ok(scene)
}

/// Measures one body at one size; whether it came to its end.
fn measure(
    subdivisions: u32,
    side: u32,
    settings: &ChoiceSettings,
    control: &Control,
    cells: &mut Vec<ChoiceCell>,
) -> Result<bool> {
    let mut scene = scene(subdivisions, side)?;
    let orbit_views = scene.beam.views()?;
    let exact = ENGINES.iter().map(|&engine| Contender::exact(Some(engine)));
    let contenders: Vec<Contender> =
        exact.chain(settings.tolerances_mm.iter().copied().map(Contender::tolerance)).collect();
    let mut orbits = vec![Orbit::default(); contenders.len()];
    let mut shortest = [f64::INFINITY; VIEWS.len()];
    let results = race(contenders.len(), settings.patience, control, |i| {
        let times =
            project(&mut scene, &contenders[i], &orbit_views, &mut orbits[i], &mut shortest, control)?;
        Ok(times)
    })?;
    let body = &scene.organs[0].body;
    for (lap, &views) in VIEWS.iter().enumerate() {
        let seconds = |i: usize| results.times[i][lap].median();
        for (t, &tolerance_mm) in settings.tolerances_mm.iter().enumerate() {
            let tree = ENGINES.len() + t;
            let demand = Demand::of(&orbit_views[..views as usize]);
            let interpolation = Interpolation::SquaredChord { tolerance_mm };
            let trees = TreeSettings { interpolation, ..TreeSettings::default() };
            let estimate = Estimate::of(body, &trees, demand);
            let chosen = if estimate.prefers_tree() { "ritree" } else { estimate.engine.name() };
            let measured = (0..ENGINES.len()).chain([tree]);
            let seconds: Vec<(&str, f64)> = measured
                .map(|i| (contenders[i].method.name(), seconds(i)))
                .filter(|(_, seconds)| seconds.is_finite())
                .collect();
            let best = seconds.iter().map(|(_, seconds)| *seconds).fold(f64::INFINITY, f64::min);
            let of_chosen = seconds.iter().find(|(name, _)| *name == chosen).map(|(_, seconds)| *seconds);
            let Some(best) = Some(best).filter(|best| best.is_finite()) else { continue };
            cells.push(ChoiceCell {
                faces: body.surface().mesh().faces.len(),
                side,
                views,
                tolerance_mm,
                estimate,
                chosen,
                seconds,
                leaves: orbits[tree].leaves[lap],
                // Who left the race took longer than that.
                ratio: of_chosen.map_or(HOPELESS, |seconds| seconds / best),
            });
        }
    }
    Ok(!results.interrupted)
}

/// What is known of a contender besides its times.
#[derive(Clone, Copy, Debug, Default)]
struct Orbit {
    /// Leaves of its trees after the numbers of views.
    leaves: [u64; VIEWS.len()],
    /// From which number of views on it takes no part, once it has run.
    end: Option<usize>,
}

/// Projects the orbit from cold; seconds up to each number of views, NaN for those that it does not go on to.
fn project(
    scene: &mut Scene,
    contender: &Contender,
    views: &[View],
    orbit: &mut Orbit,
    shortest: &mut [f64; VIEWS.len()],
    control: &Control,
) -> Result<[f64; VIEWS.len()]> {
    scene.organs.iter_mut().for_each(|organ| organ.body.forget_engines());
    let quiet = control.without_progress();
    let mut times = [f64::NAN; VIEWS.len()];
    let start = std::time::Instant::now();
    let projector = Projector::new(scene, LENGTHS, None, contender.method)?;
    let mut done = 0;
    for (lap, &count) in VIEWS.iter().enumerate() {
        if orbit.end.is_some_and(|end| lap >= end) {
            break;
        }
        for view in &views[done..count as usize] {
            projector.project(view, 0, &quiet)?;
        }
        done = count as usize;
        let seconds = start.elapsed().as_secs_f64();
        times[lap] = seconds;
        shortest[lap] = shortest[lap].min(seconds);
        orbit.leaves[lap] = projector.forest().map_or(0, |forest| {
            let shape = forest.shape;
            shape.smooth_leaves + shape.empty_leaves + shape.traced_leaves
        });
        // A tree is grown for later views: it is not given up after the first.
        if orbit.end.is_none() && seconds > HOPELESS * shortest[lap] && (lap > 0 || orbit.leaves[lap] == 0) {
            orbit.end = Some(lap + 1);
        }
    }
    orbit.end = orbit.end.or(Some(VIEWS.len()));
    Ok(times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_study_has_its_choice_which_is_one_of_those_measured_or_one_that_left() {
        let settings = ChoiceSettings {
            subdivisions: vec![1, 3],
            sizes: vec![16],
            tolerances_mm: vec![0.5, 5.0],
            patience: Patience { rounds: 2, seconds: 5.0 },
        };
        let report = choice(&settings, &Control::none()).expect("a report");
        assert!(report.complete && report.cells.len() == 2 * VIEWS.len() * 2);
        for cell in &report.cells {
            // Whatever is measured, the best among it is; others may have left.
            assert!(!cell.seconds.is_empty() && cell.ratio >= 1.0 && cell.ratio.is_finite(), "{cell:?}");
            let best = cell.seconds.iter().map(|s| s.1).fold(f64::INFINITY, f64::min);
            match cell.seconds.iter().find(|(name, _)| *name == cell.chosen) {
                Some((_, seconds)) => assert_eq!(cell.ratio, seconds / best),
                None => assert_eq!(cell.ratio, HOPELESS),
            }
            assert!(cell.leaves > 0 || cell.views > VIEWS[0], "a first view grows some: {cell:?}");
        }
        assert!(report.worst_ratio >= report.cells[0].ratio);
    }

    #[test]
    fn the_first_views_of_the_orbit_lie_evenly() {
        let scene = scene(1, 8).expect("a scene");
        let views = scene.beam.views().expect("views");
        assert_eq!(views.len() as u64, VIEWS[2]);
        let directions: Vec<_> = views[..8].iter().map(|view| view.direction()[2]).collect();
        let sum: glam::DVec3 = directions.iter().sum();
        assert!(sum.length() < 1e-9, "{sum}");
        assert_eq!(scene.organs[0].body.surface().mesh().faces.len(), 80);
    }
}
