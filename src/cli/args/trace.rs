//! What can be said of pictures by ray tracing.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{MethodArgs, parse_pixels};

/// `trace`.
#[derive(Debug, Args)]
pub struct TraceArgs {
    /// A scene file, or the name of a scene that comes with the program: bezier-surface, random-volumes, tomatoes.
    pub scene: String,

    /// What is made of the rays: pictures, or, of closed convex bodies that are looked through, greys by the lengths in them.
    #[arg(long, value_enum, default_value = "pictures")]
    pub application: Application,

    /// The folder to write to; made if missing.
    #[arg(long, short, default_value = "out", value_name = "DIR")]
    pub output: PathBuf,

    /// The picture's pixels.
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = parse_pixels, default_value = "600x600")]
    pub size: [u32; 2],

    /// Rays per pixel: 1, 4, 9, … 256.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub samples: u32,

    /// Put each ray at random in its part of the pixel, from this seed; on a regular lattice if left out.
    #[arg(long, value_name = "SEED")]
    pub jitter: Option<u64>,

    /// Seeds what is random in a generated scene.
    #[arg(long, value_name = "SEED", default_value_t = 1)]
    pub seed: u64,

    /// Volumes of random-volumes.
    #[arg(long, value_name = "N", default_value_t = 8)]
    pub count: usize,

    /// RI-tree: also write the map of traced pixels, white where an object with a tree was traced.
    #[arg(long)]
    pub map: bool,

    /// RI-tree: also trace every ray exactly, and tell the colours' mean distance and the speed-ups: of all views, of the
    /// first alone, of the others, and of all once more by trees that have seen them.
    #[arg(long)]
    pub compare: bool,

    /// With --compare: do both ways so many times, in turn, and tell the median and the range of the speed-ups.
    #[arg(long, value_name = "N", default_value_t = 1, requires = "compare", value_parser = clap::value_parser!(u16).range(1..=999))]
    pub rounds: u16,

    /// Count floating-point operations instead of being quick. Seconds then mean nothing.
    #[arg(long)]
    pub count_operations: bool,

    /// Print the run's summary as JSON on standard output.
    #[arg(long)]
    pub json: bool,

    /// How rays find objects: ritree or exact.
    #[command(flatten)]
    pub method: MethodArgs,
}

/// What `trace` makes of rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Application {
    /// Shaded pictures.
    Pictures,
    /// Lengths in bodies, each half opaque over half its longest side.
    Absorption,
}
