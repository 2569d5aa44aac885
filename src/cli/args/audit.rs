//! What can be said of an audit.

use std::path::PathBuf;

use clap::Args;

use super::parse::numbers;
use super::{BeamArgs, KeepArgs, MethodArg, MethodArgs, SourceArgs};
use crate::modes::audit::DEFAULT_TOLERANCE_MM;

/// `audit`.
#[derive(Debug, Args)]
pub struct AuditArgs {
    /// A scene file, or the name of a phantom that comes with the program.
    #[arg(default_value = "adult")]
    pub scene: String,

    /// The folder for the report: a page to look at, JSON and CSV; made if missing. Nothing is written if left out.
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Print the report as JSON on standard output, in place of a summary.
    #[arg(long)]
    pub json: bool,

    /// What the method is held against; by default clipping for convex organs and the hierarchy of boxes for others.
    #[arg(long, value_enum, value_name = "METHOD")]
    pub against: Option<MethodArg>,

    /// Errors beyond this are counted, mm.
    #[arg(long = "tolerance-mm", value_name = "MM", default_value_t = DEFAULT_TOLERANCE_MM)]
    pub tolerance_mm: f64,

    /// Exit with 1 and name the worst ray if an error is larger than this, mm.
    #[arg(long = "limit-mm", value_name = "MM", value_parser = parse_limit)]
    pub limit_mm: Option<f64>,

    /// In place of a comparison: hold the method to identities and integrals that need no second engine. Exit with 1 if one
    /// fails.
    #[arg(long, conflicts_with_all = ["against", "output", "limit_mm", "load_trees", "save_trees"])]
    pub oracles: bool,

    /// In place of a comparison: hold every exact engine to rationals, in each organ along so many rays of each kind that is
    /// hard: through vertices, along edges, tangent, from far away … Exit with 1 if rounding does not explain a length.
    #[arg(
        long,
        value_name = "N",
        value_parser = parse_count,
        num_args = 0..=1,
        default_missing_value = "500",
        conflicts_with_all = [
            "against", "output", "limit_mm", "oracles", "rays", "adversarial", "ray", "pixel", "load_trees", "save_trees"
        ]
    )]
    pub stress: Option<u64>,

    /// Which rays are looked along.
    #[command(flatten)]
    pub rays: RayArgs,

    /// How lengths are found that are judged.
    #[command(flatten)]
    pub method: MethodArgs,

    /// Trees of other runs.
    #[command(flatten)]
    pub keep: KeepArgs,

    /// Where the views' rays come from, in place of what the scene says.
    #[command(flatten)]
    pub beam: BeamArgs,

    /// The photons by which transmissions are told.
    #[command(flatten)]
    pub source: SourceArgs,
}

/// The rays of an audit: every pixel of the beam's views, if nothing else is said.
#[derive(Debug, Args)]
#[command(next_help_heading = "Rays (every pixel of the views, if none of these is given)")]
pub struct RayArgs {
    /// So many uniform, isotropic random lines through the scene, as `1e6`.
    #[arg(long, value_name = "N", value_parser = parse_count)]
    pub rays: Option<u64>,

    /// So many lines for each organ at each of vertices, edges, outlines, borders of cells, ties of the dominant axis, and
    /// almost parallel to a plane pair.
    #[arg(long, value_name = "N", value_parser = parse_count, conflicts_with = "rays")]
    pub adversarial: Option<u64>,

    /// The seed of lines.
    #[arg(long, default_value_t = 1)]
    pub seed: u64,

    /// Only this ray, from a point as far as a vector reaches, mm: prints what both methods say of it.
    #[arg(
        long,
        value_name = "X,Y,Z,DX,DY,DZ",
        value_parser = parse_ray,
        allow_hyphen_values = true,
        requires = "organ",
        conflicts_with_all = ["rays", "adversarial"]
    )]
    pub ray: Option<[f64; 6]>,

    /// Only the ray of this pixel, counted from 0, likewise.
    #[arg(
        long,
        value_name = "VIEW,COLUMN,ROW",
        value_parser = parse_pixel,
        requires = "organ",
        conflicts_with_all = ["rays", "adversarial", "ray"]
    )]
    pub pixel: Option<[u32; 3]>,

    /// The organ that the ray is looked at in.
    #[arg(long, value_name = "NAME")]
    pub organ: Option<String>,
}

fn parse_ray(text: &str) -> Result<[f64; 6], String> {
    numbers(text, ',')
}

fn parse_pixel(text: &str) -> Result<[u32; 3], String> {
    numbers(text, ',')
}

/// A whole number, also as `1e7`.
fn parse_count(text: &str) -> Result<u64, String> {
    /// Beyond it, f64 does not know every whole number.
    const MOST: f64 = 9e15;
    match text.trim().parse::<f64>() {
        Ok(n) if (1.0..=MOST).contains(&n) && n.fract() == 0.0 => Ok(n as u64),
        _ => Err("give a whole number of 1 or more, as `20000` or `1e7`".into()),
    }
}

fn parse_limit(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(limit) if limit >= 0.0 && limit.is_finite() => Ok(limit),
        _ => Err("give millimetres, 0 or more".into()),
    }
}
