//! What can be said on the command line.

mod audit;
mod bench;
mod dose;
mod parse;
mod trace;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};

use crate::output::png::Polarity;
use crate::physics::DetectorResponse;
pub use audit::{AuditArgs, RayArgs};
pub use bench::{BenchCommand, ChoiceArgs, CurveArgs, PaperArgs, RunArgs, ScaleArgs};
pub use dose::{DoseArgs, FormatArg, TableArg};
use parse::{parse_extent, parse_mm, parse_pair, parse_pixels, parse_point, parse_window};
pub use trace::{Application, TraceArgs};

/// Exact intersection lengths of rays with organs: projection images of phantoms, with their numbers.
///
/// Lengths are millimetres, angles degrees, energies keV; images are in the patient's LPS frame. Nothing is scattered:
/// primary radiation only, for research and teaching, not for clinical use.
#[derive(Debug, Parser)]
#[command(name = "chordfield", version, max_term_width = 100)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,

    /// Threads to use; all cores if left out. The answer does not depend on it.
    #[arg(long, global = true, value_name = "N", value_parser = clap::value_parser!(u16).range(1..=1024))]
    pub threads: Option<u16>,

    /// No progress bar and no remarks, errors only.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// The commands.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Project a scene: radiographs to look at, lengths and attenuation to compute with.
    Project(Box<ProjectArgs>),
    /// Say how wrong lengths are: each ray against exact clipping, by organ, kind of error and place.
    Audit(Box<AuditArgs>),
    /// Run time against error on your scene and machine: which method and setting to use.
    #[command(subcommand)]
    Bench(BenchCommand),
    /// Follow the paths of a dose study: lengths, attenuation and absorption in each organ, by path, field and case.
    ///
    /// Primary radiation only: no scatter, not for clinical use.
    Dose(Box<DoseArgs>),
    /// Render a scene of smooth, mirroring and refracting objects, exactly or by RI-trees.
    Trace(Box<TraceArgs>),
    /// Say whether scenes or mesh files can be projected, and if not, what to do about it.
    Check(CheckArgs),
    /// The phantoms that come with the program.
    #[command(subcommand)]
    Phantom(PhantomCommand),
    /// Print a completion script for a shell.
    Completions {
        /// The shell.
        shell: clap_complete::Shell,
    },
}

/// `project`.
#[derive(Debug, Args)]
pub struct ProjectArgs {
    /// A scene file, or the name of a phantom that comes with the program.
    #[arg(default_value = "adult")]
    pub scene: String,

    /// The folder to write to; made if missing.
    #[arg(long, short, default_value = "out", value_name = "DIR")]
    pub output: PathBuf,

    /// What to write.
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "LIST",
        default_value = "radiograph,colour,transmission,p,lengths"
    )]
    pub write: Vec<Product>,

    /// Also write each float image as NPY.
    #[arg(long)]
    pub npy: bool,

    /// Print the run's summary as JSON on standard output.
    #[arg(long)]
    pub json: bool,

    /// Where rays come from, in place of what the scene says.
    #[command(flatten)]
    pub beam: BeamArgs,

    /// What they are made of, in place of what the scene says.
    #[command(flatten)]
    pub photons: PhotonArgs,

    /// How lengths are found.
    #[command(flatten)]
    pub method: MethodArgs,

    /// Trees of other runs.
    #[command(flatten)]
    pub keep: KeepArgs,

    /// RI-tree: also write the map of traced pixels: white where any organ with a tree was traced, grey where all were
    /// interpolated.
    #[arg(long)]
    pub map: bool,

    /// The values of p shown as darkest and lightest; found from the image if left out.
    #[arg(long, value_name = "LOW..HIGH", value_parser = parse_window, allow_hyphen_values = true)]
    pub window: Option<[f64; 2]>,

    /// Whether much attenuation is shown white, as on a film, or black.
    #[arg(long, value_enum, default_value_t = PolarityArg::BoneWhite)]
    pub polarity: PolarityArg,
}

/// How lengths are found.
#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub struct MethodArgs {
    /// By RI-trees (Atalay & Mount) that interpolate exact samples, or every length exactly, or as is quicker for each organ;
    /// a threshold of the paper's asks for its trees.
    #[arg(long, value_enum, default_value_t = MethodArg::Auto)]
    pub method: MethodArg,
    /// How trees are grown.
    #[command(flatten)]
    pub trees: TreeArgs,
}

/// How RI-trees are grown.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Method")]
pub struct TreeArgs {
    /// RI-tree: how far an interpolated length may be off, such as `0.1mm`: of 1000, 999 are within this of the exact one, and
    /// none is meant to be farther off than five times it [default: 0.5mm]
    #[arg(long, value_name = "MM", value_parser = parse_mm, allow_hyphen_values = true)]
    pub tolerance: Option<f64>,
    /// RI-tree: what is interpolated between samples; the paper's if one of its thresholds is given.
    #[arg(long, value_enum)]
    pub interpolation: Option<InterpolationArg>,
    /// Quadrilinear: a cell splits if its middle is interpolated worse than this, in half the longest side of the organ's
    /// box [default: 0.05]
    #[arg(long, value_name = "D", allow_negative_numbers = true)]
    pub distance_threshold: Option<f64>,
    /// Quadrilinear: output directions farther apart than this are not interpolated (chords have none) [default: 30]
    #[arg(long = "angular-threshold-deg", value_name = "DEG", allow_negative_numbers = true)]
    pub angular_threshold_deg: Option<f64>,
    /// Quadrilinear: cells of this depth are final, whatever their middle says: a low depth gives an error without bound
    /// [default: 28]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(0..=60))]
    pub max_depth: Option<u32>,
    /// RI-tree: the most that nodes and samples of all trees may hold, megabytes.
    #[arg(long, value_name = "MB", default_value_t = 100.0, allow_negative_numbers = true)]
    pub cache_mb: f64,
    /// RI-tree: the share of the cache that is kept when it is pruned.
    #[arg(long, value_name = "SHARE", default_value_t = 0.3, allow_negative_numbers = true)]
    pub prune_keep: f64,
    /// RI-tree: bodies with fewer face planes are found exactly instead [default: 48]; tells `auto` to put all others in trees
    #[arg(long, value_name = "N")]
    pub tree_planes: Option<usize>,
}

/// Trees that are kept from run to run.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Method")]
pub struct KeepArgs {
    /// RI-tree: start with the trees of this file, as many as `--cache-mb` has room for: lengths are the same bits, found sooner. A
    /// file of other bodies, settings or versions is refused.
    #[arg(long, value_name = "FILE")]
    pub load_trees: Option<PathBuf>,
    /// RI-tree: write all trees to this file at the end, for `--load-trees`. Either asks for trees in place of `auto`.
    #[arg(long, value_name = "FILE")]
    pub save_trees: Option<PathBuf>,
}

/// What is interpolated, as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum InterpolationArg {
    /// Cubics of the squared chord, to within a tolerance.
    SquaredChord,
    /// Lengths at the 16 corners of a cell, by the paper's thresholds.
    Quadrilinear,
}

/// A method as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum MethodArg {
    /// By RI-trees for organs for which they are estimated to be quicker in this study, exactly for all others.
    Auto,
    /// By RI-trees.
    Ritree,
    /// Every length exactly, by the quickest engine for each organ and view.
    Exact,
    /// Exactly, by clipping convex organs against all their planes: the reference.
    Clip,
    /// Exactly, by walking over convex organs from face to face.
    Walk,
    /// Exactly, by casting faces on pixels.
    Raster,
    /// Exactly, by a hierarchy of boxes.
    Bvh,
}

impl MethodArg {
    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Ritree => "ritree",
            Self::Exact => "exact",
            Self::Clip => "clip",
            Self::Walk => "walk",
            Self::Raster => "raster",
            Self::Bvh => "bvh",
        }
    }
}

/// Changes to the scene's `[beam]`.
#[derive(Debug, Args)]
#[command(next_help_heading = "Beam (in place of the scene's)")]
pub struct BeamArgs {
    /// Gantry angles, degrees: `30`, `0,90`, or `0..360:30`.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub gantry: Option<String>,
    /// Couch angles, degrees, as for the gantry.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub couch: Option<String>,
    /// Collimator angles, degrees, as for the gantry.
    #[arg(long, value_name = "DEG", allow_hyphen_values = true)]
    pub collimator: Option<String>,
    /// Cone or parallel rays.
    #[arg(long, value_enum)]
    pub beam: Option<BeamKindArg>,
    /// Source to isocentre, mm.
    #[arg(long = "sad-mm", value_name = "MM", allow_negative_numbers = true)]
    pub sad_mm: Option<f64>,
    /// Source to detector, mm.
    #[arg(long = "sdd-mm", value_name = "MM", allow_negative_numbers = true)]
    pub sdd_mm: Option<f64>,
    /// The isocentre, patient LPS, mm.
    #[arg(long = "isocentre-mm", value_name = "X,Y,Z", value_parser = parse_point, allow_hyphen_values = true)]
    pub isocentre_mm: Option<[f64; 3]>,
    /// Detector pixels, at most 8192 × 8192 in all (some 48 bytes of memory each).
    #[arg(long, value_name = "COLUMNSxROWS", value_parser = parse_pixels)]
    pub size: Option<[u32; 2]>,
    /// Detector width and height, mm.
    #[arg(long = "detector-mm", value_name = "WIDTHxHEIGHT", value_parser = parse_extent)]
    pub detector_mm: Option<[f64; 2]>,
    /// Shift of the detector along its columns' and rows' axes (X and Y of the collimator), mm.
    #[arg(long = "offset-mm", value_name = "X,Y", value_parser = parse_pair, allow_hyphen_values = true)]
    pub offset_mm: Option<[f64; 2]>,
}

/// Changes to the scene's `[spectrum]`, and noise.
#[derive(Debug, Args)]
#[command(next_help_heading = "Photons (in place of the scene's)")]
pub struct PhotonArgs {
    /// Their energies and the detector.
    #[command(flatten)]
    pub source: SourceArgs,
    /// Photons that would reach each pixel through air; turns Poisson noise on.
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    pub photons: Option<f64>,
    /// The seed of the noise.
    #[arg(long, default_value_t = 0, requires = "photons")]
    pub seed: u64,
}

/// Changes to the scene's `[spectrum]`.
#[derive(Debug, Args)]
#[command(next_help_heading = "Photons (in place of the scene's)")]
pub struct SourceArgs {
    /// One energy, keV.
    #[arg(long = "energy-kev", value_name = "KEV", allow_negative_numbers = true, conflicts_with = "kvp")]
    pub energy_kev: Option<f64>,
    /// A tungsten tube at 60, 80, 100, 120 or 140 kV.
    #[arg(long, value_name = "KV")]
    pub kvp: Option<u32>,
    /// What the detector makes of a photon.
    #[arg(long, value_enum)]
    pub response: Option<ResponseArg>,
}

/// `check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// Scene files (`.toml`), mesh files (OBJ, STL, PLY) or names of phantoms.
    #[arg(required = true)]
    pub files: Vec<PathBuf>,
    /// Print the findings as JSON.
    #[arg(long)]
    pub json: bool,
}

/// `phantom`.
#[derive(Debug, Subcommand)]
pub enum PhantomCommand {
    /// One line each.
    List,
    /// The scene file of one.
    Show {
        /// Its name.
        name: String,
    },
    /// Write one as OBJ meshes and a scene that uses them.
    Export {
        /// Its name.
        name: String,
        /// The folder to write to; made if missing.
        folder: PathBuf,
    },
}

/// An output of `project`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum Product {
    /// 16-bit PNG of p, windowed.
    Radiograph,
    /// 8-bit colour PNG of the organs, see-through.
    Colour,
    /// Float image of I/I₀.
    Transmission,
    /// Float image of −ln(I/I₀).
    P,
    /// Float image of each organ's own length, mm.
    Lengths,
}

/// [`Polarity`] as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum PolarityArg {
    /// Much attenuation is white.
    BoneWhite,
    /// Much attenuation is black.
    BoneBlack,
}

impl From<PolarityArg> for Polarity {
    fn from(arg: PolarityArg) -> Self {
        match arg {
            PolarityArg::BoneWhite => Self::BoneWhite,
            PolarityArg::BoneBlack => Self::BoneBlack,
        }
    }
}

/// [`DetectorResponse`] as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum ResponseArg {
    /// Its energy, as in flat panels.
    EnergyIntegrating,
    /// One count.
    Counting,
}

impl From<ResponseArg> for DetectorResponse {
    fn from(arg: ResponseArg) -> Self {
        match arg {
            ResponseArg::EnergyIntegrating => Self::EnergyIntegrating,
            ResponseArg::Counting => Self::Counting,
        }
    }
}

/// A beam's kind as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum BeamKindArg {
    /// From one point.
    Cone,
    /// All along one direction.
    Parallel,
}
