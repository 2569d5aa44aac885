//! Error against time, for every method and setting, on one scene.

mod front;

use serde::Serialize;

use super::race::{LEAST_ROUNDS, race};
use super::{Contender, Dial, EXACT_BELOW_MM, Machine, Patience, Program, Run, Times, run};
use crate::error::{Error, Result};
use crate::exact::Engine;
use crate::modes::Control;
use crate::modes::audit::{Audit, AuditSettings, DEFAULT_TOLERANCE_MM, RaySet};
use crate::modes::figures::Figures;
use crate::scene::beam::{BeamSpec, DetectorSpec};
use crate::scene::{Given, Scene, View};
use front::{mark_fronts, recommendation};

/// Errors are found on the views' rays through so many pixels a side at most. A length depends on its ray alone, so the
/// rays of a finer image have errors like theirs.
const ERROR_PIXELS: u32 = 256;

/// What is measured.
#[derive(Clone, Debug, PartialEq)]
pub struct CurveSettings {
    /// Who takes part.
    pub contenders: Vec<Contender>,
    /// Columns and rows of the detector, the smallest first.
    pub sizes: Vec<[u32; 2]>,
    /// How long it may take.
    pub patience: Patience,
    /// A contender that would take longer than this for one size is left out of it, seconds.
    pub limit_s: f64,
}

const TOLERANCES_MM: &[f64] = &[5.0, 2.0, 0.5, 0.1, 0.02];

/// The range of the paper's Figure 5.
const DISTANCE_THRESHOLDS: &[f64] = &[0.25, 0.1, 0.05, 0.025, 0.01];

impl CurveSettings {
    /// All methods: trees of squared chords at a range of tolerances, the paper's at its range of thresholds; of both only
    /// some if it is to be quick.
    pub fn contenders(quick: bool) -> Vec<Contender> {
        let engines = [None, Some(Engine::Raster), Some(Engine::Walk), Some(Engine::Bvh), Some(Engine::Clip)];
        let exact = engines.into_iter().map(Contender::exact);
        let (tolerances, thresholds): (&[f64], &[f64]) = if quick {
            (&[2.0, 0.5, 0.1], &[0.25, 0.05, 0.01])
        } else {
            (TOLERANCES_MM, DISTANCE_THRESHOLDS)
        };
        let tolerances = tolerances.iter().copied().map(Contender::tolerance);
        let thresholds = thresholds.iter().copied().map(Contender::paper);
        exact.chain(tolerances).chain(thresholds).collect()
    }
}

impl CurveSettings {
    /// Whether they serve for `scene`.
    ///
    /// # Errors
    /// No sizes, a size that does not serve, a beam without views.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        if self.sizes.is_empty() {
            return Err(Error::input("the curve", "has no sizes", "give one or more"));
        }
        self.sizes.iter().try_for_each(|&pixels| views(scene, pixels).map(drop))
    }
}

/// What was found.
#[derive(Clone, Debug, Serialize)]
pub struct CurveReport {
    /// The program.
    #[serde(flatten)]
    pub program: Program,
    /// The command line; set by whoever knows it.
    pub command: String,
    /// Where it was measured.
    pub machine: Machine,
    /// The scene's name.
    pub scene: String,
    /// Its organs.
    pub organs: usize,
    /// Faces of all organs.
    pub faces: usize,
    /// Views that each run projects.
    pub views: usize,
    /// Rays on which errors were found.
    pub error_rays: u64,
    /// Each method, setting and size.
    pub rows: Vec<CurveRow>,
    /// What was left out, and why.
    pub left_out: Vec<String>,
    /// What to use, in a sentence. None if too little was measured to say.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub recommendation: Option<String>,
    /// Whether all that was to be measured was; not so after an interruption.
    pub complete: bool,
}

/// One method at one setting and size.
#[derive(Clone, Debug, Serialize)]
pub struct CurveRow {
    /// Columns and rows.
    pub pixels: [u32; 2],
    /// The method.
    pub method: &'static str,
    /// Its setting.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub setting: Option<Dial>,
    /// The options that choose both.
    pub options: String,
    /// From the scene as read to the last length: all views.
    pub cold: Times,
    /// The same views again.
    pub warm: Times,
    /// Its lengths against the reference's, mm.
    pub error_mm: Figures,
    /// Whether no error is more than rounding.
    pub exact: bool,
    /// Bytes of trees after the views.
    pub tree_bytes: usize,
    /// Whether nothing measured at this size is both quicker cold and at most as wrong.
    pub on_cold_front: bool,
    /// Whether nothing measured at this size is both quicker warm and at most as wrong.
    pub on_warm_front: bool,
}

/// Measures the curve. An interruption ends it with what there is.
///
/// # Errors
/// A beam without views, a size that does not serve, an energy off a table.
pub fn curve(scene: &Scene, settings: &CurveSettings, control: &Control) -> Result<CurveReport> {
    settings.check(scene)?;
    let mut report = CurveReport {
        program: Program::THIS,
        command: String::new(),
        machine: Machine::this(),
        scene: scene.name.clone(),
        organs: scene.organs.len(),
        faces: scene.organs.iter().map(|o| o.body.surface().mesh().faces.len()).sum(),
        views: scene.beam.views()?.len(),
        error_rays: 0,
        rows: Vec::new(),
        left_out: Vec::new(),
        recommendation: None,
        complete: true,
    };
    match measure(scene, settings, control, &mut report) {
        Err(Error::Interrupted) => report.complete = false,
        other => other?,
    }
    mark_fronts(&mut report.rows);
    report.recommendation = recommendation(&report);
    Ok(report)
}

/// How many turns [`curve`] takes at most, for its progress.
pub fn turns(settings: &CurveSettings) -> u64 {
    let timed = settings.sizes.len() * (settings.patience.rounds + 1);
    (settings.contenders.len() * (timed + 1)) as u64
}

fn measure(
    scene: &Scene,
    settings: &CurveSettings,
    control: &Control,
    report: &mut CurveReport,
) -> Result<()> {
    let errors = errors(scene, settings, control, report)?;
    let mut working = scene.clone();
    let mut before: Vec<Option<([u32; 2], f64)>> = vec![None; settings.contenders.len()];
    for &pixels in &settings.sizes {
        let views = views(scene, pixels)?;
        let (racers, absent): (Vec<usize>, Vec<usize>) = (0..settings.contenders.len()).partition(|&i| {
            before[i].is_none_or(|(smaller, seconds)| {
                let growth = area(pixels) / area(smaller);
                seconds * growth * (LEAST_ROUNDS + 1) as f64 <= settings.limit_s
            })
        });
        for i in absent {
            let options = settings.contenders[i].options();
            report.left_out.push(format!(
                "`{options}` at {}×{}: it would take more than {} s",
                pixels[0], pixels[1], settings.limit_s
            ));
        }
        let mut bytes = vec![0; racers.len()];
        let results = race(racers.len(), settings.patience, control, |racer| {
            let method = settings.contenders[racers[racer]].method;
            let Run { cold, warm, tree_bytes, .. } = run(&mut working, method, &views, control)?;
            bytes[racer] = tree_bytes;
            Ok([cold, warm])
        })?;
        for ((&i, [cold, warm]), tree_bytes) in racers.iter().zip(&results.times).zip(bytes) {
            if cold.0.is_empty() {
                continue;
            }
            before[i] = Some((pixels, cold.median() + warm.median()));
            let contender = &settings.contenders[i];
            report.rows.push(CurveRow {
                pixels,
                method: contender.method.name(),
                setting: contender.dial,
                options: contender.options(),
                cold: cold.times(),
                warm: warm.times(),
                error_mm: errors[i],
                exact: errors[i].max < EXACT_BELOW_MM,
                tree_bytes,
                on_cold_front: false,
                on_warm_front: false,
            });
        }
        if results.interrupted {
            return Err(Error::Interrupted);
        }
    }
    Ok(())
}

/// Each contender's errors on the views' rays.
fn errors(
    scene: &Scene,
    settings: &CurveSettings,
    control: &Control,
    report: &mut CurveReport,
) -> Result<Vec<Figures>> {
    let largest = settings.sizes.iter().copied().max_by(|a, b| area(*a).total_cmp(&area(*b)));
    let Some(largest) = largest else { return Ok(Vec::new()) };
    let scale = (f64::from(ERROR_PIXELS) / f64::from(largest[0].max(largest[1]))).min(1.0);
    let views = views(scene, largest.map(|n| ((f64::from(n) * scale) as u32).max(1)))?;
    report.error_rays = views.iter().map(View::pixels).sum();
    let quiet = control.without_progress();
    let of = |contender: &Contender| {
        let settings = AuditSettings {
            rays: RaySet::Views(views.clone()),
            method: contender.method,
            against: None,
            tolerance_mm: DEFAULT_TOLERANCE_MM,
        };
        let found = Audit::new(scene, settings)?.run(&quiet)?;
        control.advance(1);
        Ok(found.whole.method.length_mm)
    };
    settings.contenders.iter().map(of).collect()
}

/// The scene's views on a detector of so many pixels.
pub(super) fn views(scene: &Scene, pixels: [u32; 2]) -> Result<Vec<View>> {
    let detector = DetectorSpec { pixels: Some(Given::from(pixels)), ..DetectorSpec::default() };
    let beam = scene.beam.clone().overridden_by(BeamSpec { detector, ..BeamSpec::default() });
    Ok(beam.views()?)
}

fn area([columns, rows]: [u32; 2]) -> f64 {
    f64::from(columns) * f64::from(rows)
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicBool, Ordering};

    use super::*;
    use crate::scene::{Folder, SceneText};

    const BALL: &str = r#"
        beam = { detector = { size_mm = [150, 150], pixels = [8, 8] } }
        spectrum = { energy_keV = 60 }
        organ = [{ name = "ball", material = "water", density_g_cm3 = 1,
                   shape = { kind = "ellipsoid", half_axes_mm = [50, 40, 30], faces = 500 } }]
    "#;

    fn ball() -> Scene {
        Scene::build(&SceneText::new("ball.toml", BALL), &Folder::none()).expect("a scene")
    }

    fn settings() -> CurveSettings {
        CurveSettings {
            contenders: vec![
                Contender::exact(Some(Engine::Raster)),
                Contender::paper(0.25),
                Contender::paper(0.01),
            ],
            sizes: vec![[24, 24], [48, 48]],
            patience: Patience { rounds: 3, seconds: 5.0 },
            limit_s: 60.0,
        }
    }

    #[test]
    fn every_contender_has_a_row_of_each_size_with_times_and_errors_and_the_exact_one_is_on_the_front() {
        let report = curve(&ball(), &settings(), &Control::none()).expect("a curve");
        assert!(report.complete && report.rows.len() == 6 && report.left_out.is_empty());
        assert_eq!((report.views, report.organs, report.error_rays), (1, 1, 48 * 48));
        for row in &report.rows {
            assert!(row.cold.seconds > 0.0 && row.warm.seconds > 0.0 && row.cold.rounds == 3);
            assert_eq!(row.exact, row.method == "raster", "{row:?}");
            assert_eq!(row.tree_bytes > 0, row.method == "ritree");
        }
        let [coarse, fine] = [1, 2].map(|i| report.rows[i].error_mm.mean);
        assert!(0.0 < fine && fine < coarse, "{fine} {coarse}");
        for pixels in [[24, 24], [48, 48]] {
            let of_size = || report.rows.iter().filter(|row| row.pixels == pixels);
            assert!(of_size().any(|row| row.exact && row.on_cold_front));
            assert!(of_size().any(|row| row.on_warm_front));
        }
        let words = report.recommendation.expect("a sentence");
        assert!(words.contains("48×48") && words.contains("--method raster"), "{words}");
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let mut rows = curve(&ball(), &settings(), &Control::none()).expect("a curve").rows;
        rows.truncate(3);
        for (row, (seconds, mean)) in rows.iter_mut().zip([(2.0, 0.0), (1.0, 0.5), (1.5, 0.5)]) {
            (row.cold.seconds, row.warm.seconds, row.error_mm.mean) = (seconds, 1.0, mean);
            row.exact = mean == 0.0;
        }
        mark_fronts(&mut rows);
        assert_eq!(rows.iter().map(|r| r.on_cold_front).collect::<Vec<_>>(), [true, true, false]);
        assert_eq!(rows.iter().map(|r| r.on_warm_front).collect::<Vec<_>>(), [true, false, false]);
    }

    #[test]
    fn an_interruption_leaves_the_sizes_that_were_done() {
        let (cancel, settings) = (AtomicBool::new(false), settings());
        let turns = std::sync::atomic::AtomicU64::new(0);
        // Errors of three contenders, and the first size's four rounds.
        let progress = |n| {
            if turns.fetch_add(n, Ordering::Relaxed) + n == 3 + 12 {
                cancel.store(true, Ordering::Relaxed);
            }
        };
        let report = curve(&ball(), &settings, &Control::new(&cancel, &progress)).expect("what there is");
        assert!(!report.complete);
        assert_eq!(report.rows.iter().map(|r| r.pixels).collect::<Vec<_>>(), [[24, 24]; 3]);
    }

    #[test]
    fn what_would_take_too_long_is_left_out_and_said_to_be() {
        let settings = CurveSettings { limit_s: 0.0, ..settings() };
        let report = curve(&ball(), &settings, &Control::none()).expect("a curve");
        assert_eq!((report.rows.len(), report.left_out.len()), (3, 3));
        assert!(report.left_out[0].contains("`--method raster` at 48×48"), "{:?}", report.left_out);
    }
}
