//! From arguments to the method of a run.

use super::args::{InterpolationArg, MethodArg, MethodArgs, TreeArgs};
use crate::error::{Error, Result};
use crate::exact::Engine;
use crate::modes::project::{DEFAULT_TOLERANCE_MM, Demand, Interpolation, Method, TreeSettings};
use crate::ritree::Parameters;

/// The method that the arguments name.
///
/// # Errors
/// A number that does not serve.
pub fn method(args: &MethodArgs) -> Result<Method> {
    method_named(args.method, args)
}

/// What is interpolated: the paper's if it, or one of its thresholds, is named.
fn interpolation(args: &TreeArgs) -> Result<Interpolation> {
    let thresholds = [
        ("--distance-threshold", args.distance_threshold.is_some()),
        ("--angular-threshold-deg", args.angular_threshold_deg.is_some()),
        ("--max-depth", args.max_depth.is_some()),
    ];
    let threshold = thresholds.iter().find_map(|&(name, is_given)| is_given.then_some(name));
    let is_quadrilinear = match args.interpolation {
        Some(named) => named == InterpolationArg::Quadrilinear,
        None => threshold.is_some(),
    };
    match (threshold, args.tolerance, is_quadrilinear) {
        (Some(name), Some(_), _) => {
            let why = "a threshold of quadrilinear interpolation and a tolerance of squared chords exclude each other";
            Err(Error::input(name, why, "give the one or the other"))
        }
        (Some(name), None, false) => {
            let why = "squared chords have no such threshold";
            Err(Error::input(name, why, "give --tolerance instead, or --interpolation quadrilinear"))
        }
        (None, Some(_), true) => {
            let why = "quadrilinear interpolation keeps to no tolerance";
            Err(Error::input(
                "--tolerance",
                why,
                "give --distance-threshold instead, or --interpolation squared-chord",
            ))
        }
        (None, tolerance, false) => {
            let tolerance_mm = tolerance.unwrap_or(DEFAULT_TOLERANCE_MM);
            if !(1e-9..=1e9).contains(&tolerance_mm) {
                return refuse("--tolerance", tolerance_mm, "give millimetres, more than 0");
            }
            Ok(Interpolation::SquaredChord { tolerance_mm })
        }
        (_, None, true) => Ok(Interpolation::Quadrilinear { parameters: parameters(args)? }),
    }
}

/// The paper's parameters.
pub fn parameters(args: &TreeArgs) -> Result<Parameters> {
    let default = Parameters::default();
    let parameters = Parameters {
        distance_threshold: args.distance_threshold.unwrap_or(default.distance_threshold),
        angular_threshold_deg: args.angular_threshold_deg.unwrap_or(default.angular_threshold_deg),
        max_depth: args.max_depth.unwrap_or(default.max_depth),
    };
    if !parameters.distance_threshold.is_finite() {
        return refuse("--distance-threshold", parameters.distance_threshold, "give a finite number");
    }
    if !(0.0..=180.0).contains(&parameters.angular_threshold_deg) {
        return refuse("--angular-threshold-deg", parameters.angular_threshold_deg, "give 0 to 180 degrees");
    }
    Ok(parameters)
}

/// The cache's bytes, and the share of it that pruning keeps.
pub fn cache(args: &TreeArgs) -> Result<(usize, f64)> {
    if !(0.0..=1e9).contains(&args.cache_mb) {
        return refuse("--cache-mb", args.cache_mb, "give megabytes, 0 or more");
    }
    if !(0.0..=1.0).contains(&args.prune_keep) {
        return refuse("--prune-keep", args.prune_keep, "give a share from 0 to 1");
    }
    Ok(((args.cache_mb * 1e6) as usize, args.prune_keep))
}

fn refuse<T>(name: &str, value: f64, remedy: &str) -> Result<T> {
    Err(Error::input(name, format!("{value} does not serve"), remedy))
}

/// As [`method`], for another name with the same settings.
pub fn method_named(name: MethodArg, args: &MethodArgs) -> Result<Method> {
    let args = &args.trees;
    let (cache_bytes, kept_share) = cache(args)?;
    let interpolation = interpolation(args)?;
    let trees = |demand| TreeSettings {
        interpolation,
        cache_bytes,
        kept_share,
        least_planes: args.tree_planes.unwrap_or(TreeSettings::default().least_planes),
        general_bodies: name == MethodArg::Ritree,
        demand,
    };
    Ok(match name {
        MethodArg::Exact => Method::Exact(None),
        MethodArg::Clip => Method::Exact(Some(Engine::Clip)),
        MethodArg::Walk => Method::Exact(Some(Engine::Walk)),
        MethodArg::Raster => Method::Exact(Some(Engine::Raster)),
        MethodArg::Bvh => Method::Exact(Some(Engine::Bvh)),
        // The paper's trees are never the quicker: who names one of its thresholds wants to see them.
        MethodArg::Ritree => Method::RiTree(trees(None)),
        MethodArg::Auto => match interpolation {
            Interpolation::Quadrilinear { .. } => Method::RiTree(trees(None)),
            // Who says from how many planes on has chosen.
            Interpolation::SquaredChord { .. } => {
                Method::Auto(trees(args.tree_planes.is_none().then(Demand::default)))
            }
        },
    })
}
