//! What can be said of a benchmark.

use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{BeamArgs, parse_mm, parse_pixels};
use crate::modes::bench::paper::{Input, input_named};
use crate::modes::bench::scale::study_names;

/// `bench`.
#[derive(Debug, Subcommand)]
pub enum BenchCommand {
    /// Error against time for every method and setting on a scene: which to use.
    Curve(Box<CurveArgs>),
    /// How time grows with faces, pixels, views, organs, threads and the cache.
    Scale(ScaleArgs),
    /// How far what `--method auto` chooses is from the best of all methods, over faces, pixels, views and tolerances.
    Choice(ChoiceArgs),
    /// The tables and figures of Atalay & Mount on this machine, beside their own: what the paper's trees gain and lose as
    /// their settings change.
    Paper(PaperArgs),
}

/// `bench choice`.
#[derive(Debug, Args)]
pub struct ChoiceArgs {
    /// The bodies: icosahedra whose faces are quartered so often; they have 20 · 4ⁿ faces.
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = clap::value_parser!(u32).range(0..=7), default_value = "1,2,3,4,5,6,7")]
    pub subdivisions: Vec<u32>,

    /// Columns, and rows, of the views.
    #[arg(long, value_delimiter = ',', value_name = "N,…", value_parser = clap::value_parser!(u32).range(1..=8192), default_value = "300,600,2048")]
    pub sizes: Vec<u32>,

    /// Tolerances of the trees, mm.
    #[arg(long, value_delimiter = ',', value_name = "MM,…", value_parser = parse_tolerance, default_value = "0.02,0.5")]
    pub tolerances: Vec<f64>,

    /// What all benchmarks share.
    #[command(flatten)]
    pub run: RunArgs,
}

fn parse_tolerance(text: &str) -> Result<f64, String> {
    match parse_mm(text) {
        Ok(mm) if (1e-9..=1e9).contains(&mm) => Ok(mm),
        Ok(_) => Err("give millimetres, more than 0".into()),
        Err(problem) => Err(problem),
    }
}

/// `bench curve`.
#[derive(Debug, Args)]
pub struct CurveArgs {
    /// A scene file, or the name of a phantom that comes with the program.
    #[arg(default_value = "adult")]
    pub scene: String,

    /// Detector pixels of the runs.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "COLUMNSxROWS,…",
        value_parser = parse_pixels,
        default_value = "300x300,600x600,1200x1200"
    )]
    pub sizes: Vec<[u32; 2]>,

    /// Leave a method out of a size for which it would take longer than this, seconds.
    #[arg(long = "limit-s", value_name = "S", default_value_t = 120.0)]
    pub limit_s: f64,

    /// What all benchmarks share.
    #[command(flatten)]
    pub run: RunArgs,

    /// Where rays come from, in place of what the scene says.
    #[command(flatten)]
    pub beam: BeamArgs,
}

/// `bench scale`.
#[derive(Debug, Args)]
pub struct ScaleArgs {
    /// The studies to run; all if left out.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "LIST",
        value_parser = clap::builder::PossibleValuesParser::new(study_names())
    )]
    pub studies: Vec<String>,

    /// What all benchmarks share.
    #[command(flatten)]
    pub run: RunArgs,
}

/// `bench paper`.
#[derive(Debug, Args)]
pub struct PaperArgs {
    /// What is rendered: the paper's scenes, and the adult phantom.
    #[arg(
        long,
        value_delimiter = ',',
        value_name = "NAME,…",
        value_parser = parse_input,
        default_value = "bezier-surface,random-volumes,random-volumes-absorption,tomatoes,adult"
    )]
    pub scenes: Vec<Input>,

    /// The pictures' sides as a share of the paper's; 1 if left out, a tenth with --quick.
    #[arg(long, value_name = "SHARE")]
    pub scale: Option<f64>,

    /// What all benchmarks share.
    #[command(flatten)]
    pub run: RunArgs,
}

fn parse_input(text: &str) -> Result<Input, String> {
    let names = Input::ALL.map(Input::name).join(", ");
    input_named(text).ok_or_else(|| format!("give some of {names}"))
}

/// What all benchmarks share.
#[derive(Debug, Args)]
#[command(next_help_heading = "Runs")]
pub struct RunArgs {
    /// The folder for the report: a page, plots, JSON and CSV; made if missing. Nothing is written if left out.
    #[arg(long, short, value_name = "DIR")]
    pub output: Option<PathBuf>,

    /// Print the report as JSON on standard output, in place of a table.
    #[arg(long)]
    pub json: bool,

    /// Rounds in which all take turns; medians are over these.
    #[arg(long, value_name = "N", default_value_t = 7, value_parser = clap::value_parser!(u16).range(1..=1000))]
    pub rounds: u16,

    /// Done in about a minute: fewer sizes and rounds.
    #[arg(long)]
    pub quick: bool,
}
