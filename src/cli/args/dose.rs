//! What can be said of a dose-path study.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

use super::{KeepArgs, MethodArg, MethodArgs, TreeArgs};
use crate::modes::dose::Shard;
use crate::output::dose::{Format, Table};

/// `dose`.
#[derive(Debug, Args)]
pub struct DoseArgs {
    /// The study file (TOML).
    pub study: PathBuf,

    /// The folder to write to; made if missing.
    #[arg(long, short, default_value = "out", value_name = "DIR")]
    pub output: PathBuf,

    /// A parameter in place of the study's: one value, a list or a range; several are swept, each with each. Units may be left
    /// out: `beam.gantry=0..360:2`, `spectrum.kvp=80,120`, `organ.liver.density=1.06`.
    #[arg(long = "set", value_name = "KEY=VALUES", allow_hyphen_values = true)]
    pub settings: Vec<String>,

    /// Let the values of all `--set` go together in place of each with each.
    #[arg(long, requires = "settings")]
    pub zip: bool,

    /// Say what would be followed, and stop.
    #[arg(long)]
    pub dry_run: bool,

    /// Follow only one part of the study's paths, as `3/16`; it is written to a folder of its own in the output's.
    #[arg(long, value_name = "K/N")]
    pub shard: Option<Shard>,

    /// Pass over a part that is already there, made by the same study, settings, method and version.
    #[arg(long, requires = "shard")]
    pub resume: bool,

    /// Join all parts in the output's folder; give the arguments that the parts were made with.
    #[arg(long, conflicts_with_all = ["shard", "dry_run"])]
    pub join: bool,

    /// Which tables of paths are written; `none` for those of fields and cases only.
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "LIST",
        default_value = "paths,organs,segments"
    )]
    pub write: Vec<TableArg>,

    /// How tables are written.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "LIST", default_value = "csv")]
    pub format: Vec<FormatArg>,

    /// Print the report, or the plan, as JSON on standard output in place of a summary.
    #[arg(long)]
    pub json: bool,

    /// How lengths are found.
    #[command(flatten)]
    pub method: DoseMethodArgs,

    /// Trees of other runs.
    #[command(flatten)]
    pub keep: KeepArgs,
}

/// How lengths are found: exactly, unless trees are asked for.
#[derive(Debug, Args)]
#[command(next_help_heading = "Method")]
pub struct DoseMethodArgs {
    /// Every length exactly, or by RI-trees (Atalay & Mount) that interpolate exact samples, with their error.
    #[arg(long, value_enum, default_value_t = MethodArg::Exact)]
    pub method: MethodArg,
    /// How trees are grown.
    #[command(flatten)]
    pub trees: TreeArgs,
}

/// A table of paths as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum TableArg {
    /// A row for each path.
    Paths,
    /// A row for each path and organ.
    Organs,
    /// A row for each stretch of a path in one organ.
    Segments,
    /// No table of paths.
    None,
}

impl TableArg {
    /// The table, if it is one.
    pub fn table(self) -> Option<Table> {
        match self {
            Self::Paths => Some(Table::Paths),
            Self::Organs => Some(Table::Organs),
            Self::Segments => Some(Table::Segments),
            Self::None => None,
        }
    }
}

/// [`Format`] as an argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum FormatArg {
    /// Comma-separated values.
    Csv,
    /// JSON lines.
    Json,
}

impl From<FormatArg> for Format {
    fn from(arg: FormatArg) -> Self {
        match arg {
            FormatArg::Csv => Self::Csv,
            FormatArg::Json => Self::JsonLines,
        }
    }
}

impl From<&DoseMethodArgs> for MethodArgs {
    fn from(args: &DoseMethodArgs) -> Self {
        Self { method: args.method, trees: args.trees.clone() }
    }
}
