//! Which settings are measured: those of the paper's tables and figures.

use serde::Serialize;

use super::Input;
use crate::modes::raytrace::Trees;
use crate::ritree::Parameters;

/// The setting that a sweep varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Dial {
    /// The distance threshold.
    DistanceThreshold,
    /// The angular threshold, degrees.
    AngularThreshold,
    /// The greatest depth.
    MaxDepth,
    /// The cache, MB.
    CacheSize,
}

impl Dial {
    /// Its name in a heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::DistanceThreshold => "distance threshold",
            Self::AngularThreshold => "angular threshold, degrees",
            Self::MaxDepth => "maximum depth",
            Self::CacheSize => "cache, MB",
        }
    }

    /// A word for file names.
    pub fn word(self) -> &'static str {
        match self {
            Self::DistanceThreshold => "distance",
            Self::AngularThreshold => "angle",
            Self::MaxDepth => "depth",
            Self::CacheSize => "cache",
        }
    }
}

/// One sweep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// What is rendered.
    pub input: Input,
    /// What is varied.
    pub dial: Dial,
    /// Where the paper shows it.
    pub place: &'static str,
    /// The distance threshold where it is not varied.
    distance: f64,
    /// The values.
    values: &'static [f64],
    /// Those of a quick run, which leaves the sweep out if there are none.
    quick: &'static [f64],
}

/// The angular threshold that goes with the distance threshold 0.05 in Table 1, degrees.
const STRICT_ANGLE_DEG: f64 = 10.0;

/// Holds whatever a sweep makes; the paper's usual size.
const AMPLE_MB: f64 = 100.0;

impl Plan {
    /// The values of the dial with the settings that they stand for.
    pub fn settings(&self, is_quick: bool) -> Vec<(f64, Trees)> {
        let values = if is_quick { self.quick } else { self.values };
        values.iter().map(|&value| (value, self.trees(value))).collect()
    }

    fn trees(&self, value: f64) -> Trees {
        let usual = Parameters { distance_threshold: self.distance, ..Parameters::default() };
        let trees = |parameters| Trees { parameters, ..Trees::default() };
        match self.dial {
            Dial::DistanceThreshold if self.input == Input::Tomatoes && value < 0.1 => trees(Parameters {
                distance_threshold: value,
                angular_threshold_deg: STRICT_ANGLE_DEG,
                ..usual
            }),
            Dial::DistanceThreshold => trees(Parameters { distance_threshold: value, ..usual }),
            Dial::AngularThreshold => trees(Parameters { angular_threshold_deg: value, ..usual }),
            Dial::MaxDepth => trees(Parameters { max_depth: value as u32, ..usual }),
            Dial::CacheSize => Trees { cache_bytes: (1e6 * value) as usize, ..trees(usual) },
        }
    }
}

const DISTANCES: &[f64] = &[0.01, 0.025, 0.05, 0.1, 0.15, 0.2, 0.25];
const FEW_DISTANCES: &[f64] = &[0.01, 0.05, 0.15, 0.25];
const ANGLES: &[f64] = &[5.0, 10.0, 15.0, 20.0, 30.0];
const DEPTHS: &[f64] = &[22.0, 23.0, 24.0, 25.0, 26.0, 27.0, 28.0, 29.0, 30.0];
const FEW_DEPTHS: &[f64] = &[22.0, 24.0, 26.0, 28.0, 30.0];
/// Of three refracting scenes, each of which takes as long as all of a sheet's.
const VOLUME_ANGLES: &[f64] = &[5.0, 10.0, 20.0, 30.0];
const VOLUME_DISTANCES: &[f64] = &[0.01, 0.05, 0.25];
const VOLUME_DEPTHS: &[f64] = &[22.0, 24.0, 26.0, 28.0];
const ENDS: &[f64] = &[0.05, 0.25];

const fn plan(
    input: Input,
    dial: Dial,
    place: &'static str,
    distance: f64,
    values: &'static [f64],
    quick: &'static [f64],
) -> Plan {
    Plan { input, dial, place, distance, values, quick }
}

/// All sweeps, in the order of the paper's figures and tables. A quick run has those of Figures 5 to 7 and
/// one of each other input.
pub const PLANS: [Plan; 12] = [
    plan(Input::BezierSurface, Dial::DistanceThreshold, "Figure 5, Table 2", 0.05, DISTANCES, ENDS),
    plan(
        Input::RandomVolumes,
        Dial::AngularThreshold,
        "Figure 6, Table 2",
        0.25,
        VOLUME_ANGLES,
        &[5.0, 30.0],
    ),
    plan(Input::BezierSurface, Dial::MaxDepth, "Figure 7, Table 2", 0.05, DEPTHS, &[22.0, 24.0, 28.0]),
    plan(
        Input::BezierSurface,
        Dial::CacheSize,
        "Figure 8",
        0.05,
        &[0.128, 0.512, 2.048, 4.096, 8.192, 16.384, AMPLE_MB],
        &[],
    ),
    plan(Input::Tomatoes, Dial::DistanceThreshold, "Table 1", 0.25, ENDS, &[0.25]),
    plan(Input::RandomVolumes, Dial::DistanceThreshold, "Table 2", 0.25, VOLUME_DISTANCES, &[]),
    plan(Input::RandomVolumes, Dial::MaxDepth, "Table 2", 0.25, VOLUME_DEPTHS, &[]),
    plan(Input::BezierSurface, Dial::AngularThreshold, "Table 2", 0.05, ANGLES, &[]),
    plan(Input::RandomVolumesAbsorption, Dial::DistanceThreshold, "Table 2", 0.25, FEW_DISTANCES, ENDS),
    plan(Input::RandomVolumesAbsorption, Dial::AngularThreshold, "Table 2", 0.25, ANGLES, &[]),
    plan(Input::Adult, Dial::DistanceThreshold, "not in the paper", 0.25, FEW_DISTANCES, ENDS),
    // At a threshold of 0.25 nearly all cells are final before any of these depths.
    plan(Input::Adult, Dial::MaxDepth, "not in the paper", 0.01, FEW_DEPTHS, &[]),
];

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modes::bench::paper::Published;

    #[test]
    fn most_settings_have_figures_of_the_paper_beside_them_and_quick_ones_are_among_all() {
        for plan in &PLANS {
            let all = plan.settings(false);
            assert!(
                plan.settings(true)
                    .iter()
                    .all(|(value, trees)| all.iter().any(|a| a.0 == *value && a.1 == *trees))
            );
            assert!(all.is_sorted_by(|a, b| a.0 < b.0), "{plan:?}");
            let known = all.iter().filter(|a| Published::find(plan.input, &a.1.parameters).is_some()).count();
            if plan.input != Input::Adult {
                assert!(known >= 2, "{plan:?}: {known}");
            }
        }
    }

    #[test]
    fn the_strict_setting_of_table_1_turns_both_thresholds() {
        let tomatoes = PLANS.iter().find(|p| p.input == Input::Tomatoes).expect("a plan");
        let angles: Vec<f64> =
            tomatoes.settings(false).iter().map(|(_, t)| t.parameters.angular_threshold_deg).collect();
        assert_eq!(angles, [10.0, 30.0]);
    }
}
