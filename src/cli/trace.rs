//! `chordfield trace`.

use std::io::Write;
use std::time::Instant;

use serde::Serialize;

use super::args::{InterpolationArg, MethodArg, TraceArgs};
use super::{Session, method, print};
use crate::error::{Error, Result};
use crate::geometry::{Counted, Real};
use crate::modes::Control;
use crate::modes::raytrace::{Picture, Renderer, Samples, Tracing, Trees, Work};
use crate::output::projection::safe_name;
use crate::output::{create_folder, json, picture, remove_stale};
use crate::ritree::BuildCounts;
use crate::scene::panel::MAX_PIXELS;
use crate::scene::trace::{self, Recipe, World};

/// A run's record: what was rendered, how, and what it took.
#[derive(Debug, Serialize)]
struct Record {
    scene: String,
    objects: usize,
    size: [u32; 2],
    samples: u32,
    method: &'static str,
    #[serde(skip_serializing_if = "Option::is_none")]
    settings: Option<Trees>,
    views: usize,
    threads: usize,
    run: Run,
    #[serde(skip_serializing_if = "Option::is_none")]
    exact: Option<Comparison>,
}

/// One rendering of all views.
#[derive(Debug, Default, Serialize)]
struct Run {
    seconds: f64,
    #[serde(flatten)]
    work: Work,
    /// The share of pixels with a ray traced through an object that has a tree.
    traced_pixels: f64,
    tree_bytes: usize,
    #[serde(flatten)]
    build: BuildCounts,
}

/// The same views traced exactly.
#[derive(Debug, Serialize)]
struct Comparison {
    seconds: f64,
    #[serde(flatten)]
    work: Work,
    /// The mean distance of colours, sRGB from 0 to 1 per channel.
    mean_rgb_error: f64,
    /// Seconds exact over seconds by trees.
    speed_up: f64,
    /// Operations exact over operations by trees, if they were counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    operations_speed_up: Option<f64>,
}

/// Renders a scene and writes its pictures; the record is written last.
pub fn run(args: &TraceArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    if args.count_operations {
        run_in::<Counted>(args, session, out)
    } else {
        run_in::<f64>(args, session, out)
    }
}

fn run_in<R: Real>(args: &TraceArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    let world = trace::open(&args.scene, Recipe { seed: args.seed, count: args.count })?;
    let tracing = tracing(args)?;
    let samples = Samples::new(args.samples, args.jitter).ok_or_else(|| {
        Error::input("--samples", format!("{} does not serve", args.samples), "give a square from 1 to 256")
    })?;
    let pixels = u64::from(args.size[0]) * u64::from(args.size[1]);
    if !(1..=MAX_PIXELS).contains(&pixels) {
        return Err(Error::input("--size", "so many pixels do not serve", "give 1x1 to 8192x8192"));
    }
    session.begin_writing();
    create_folder(&args.output)?;
    let name = safe_name(&world.name);
    let record_path = args.output.join(format!("{name}.json"));
    remove_stale(&record_path)?;

    let (pictures, run) = render::<R>(&world, tracing, args, &samples, session)?;
    for (index, of_view) in pictures.iter().enumerate() {
        let label = if pictures.len() == 1 { name.clone() } else { format!("{name}-{index}") };
        picture::write(&args.output.join(format!("{label}.png")), of_view)?;
        if args.map {
            picture::write_map(&args.output.join(format!("{label}-map.png")), of_view)?;
        }
    }
    let exact =
        args.compare.then(|| compare::<R>(&world, args, &samples, session, &pictures, &run)).transpose()?;
    let (method, settings) = match tracing {
        Tracing::RiTree(settings) => (MethodArg::Ritree, Some(settings)),
        Tracing::Exact => (MethodArg::Exact, None),
    };
    let record = Record {
        scene: world.name.clone(),
        objects: world.objects.len(),
        size: args.size,
        samples: args.samples,
        method: method.name(),
        settings,
        views: pictures.len(),
        threads: rayon::current_num_threads(),
        run,
        exact,
    };
    json::write(&record_path, &record)?;
    session.remark(&format!("{} pictures in {}", pictures.len(), args.output.display()));
    if args.json {
        print(out, &json::text(&record)?)?;
    }
    Ok(())
}

fn tracing(args: &TraceArgs) -> Result<Tracing> {
    let trees = &args.method.trees;
    if trees.tolerance.is_some() || trees.interpolation == Some(InterpolationArg::SquaredChord) {
        return Err(Error::input(
            "--tolerance, --interpolation squared-chord",
            "only lengths are interpolated so, not what pictures show",
            "give --distance-threshold, --angular-threshold-deg and --max-depth",
        ));
    }
    match args.method.method {
        MethodArg::Exact => Ok(Tracing::Exact),
        MethodArg::Ritree | MethodArg::Auto => {
            let (cache_bytes, kept_share) = method::cache(trees)?;
            Ok(Tracing::RiTree(Trees { parameters: method::parameters(trees)?, cache_bytes, kept_share }))
        }
        other => Err(Error::input(
            format!("--method {}", other.name()),
            "pictures are not traced by that engine",
            "give `ritree` or `exact`",
        )),
    }
}

/// All views, and what they took together; trees live from the first to the last.
fn render<R: Real>(
    world: &World,
    tracing: Tracing,
    args: &TraceArgs,
    samples: &Samples,
    session: &Session,
) -> Result<(Vec<Picture>, Run)> {
    let size = (args.size[0], args.size[1]);
    let pixels = u64::from(size.0) * u64::from(size.1) * world.cameras.len() as u64;
    let bar = session.progress(pixels, "pixels");
    let advance = |done| bar.inc(done);
    let control = Control::new(session.cancel(), &advance);
    let start = Instant::now();
    let renderer = Renderer::<R>::new(world, tracing);
    let pictures: Vec<Picture> = world
        .cameras
        .iter()
        .map(|camera| renderer.render(camera, size, samples, &control))
        .collect::<Result<_>>()?;
    let mut run = Run {
        seconds: start.elapsed().as_secs_f64(),
        tree_bytes: renderer.tree_bytes(),
        build: renderer.build_counts(),
        ..Run::default()
    };
    pictures.iter().for_each(|picture| run.work += picture.work());
    let traced = pictures.iter().flat_map(Picture::traced).filter(|traced| **traced).count();
    run.traced_pixels = traced as f64 / pixels as f64;
    Ok((pictures, run))
}

fn compare<R: Real>(
    world: &World,
    args: &TraceArgs,
    samples: &Samples,
    session: &Session,
    pictures: &[Picture],
    run: &Run,
) -> Result<Comparison> {
    let (exact, took) = render::<R>(world, Tracing::Exact, args, samples, session)?;
    let errors: Vec<f64> = pictures.iter().zip(&exact).filter_map(|(a, b)| a.mean_distance(b)).collect();
    let counted = took.work.operations > 0;
    Ok(Comparison {
        seconds: took.seconds,
        work: took.work,
        mean_rgb_error: errors.iter().sum::<f64>() / errors.len() as f64,
        speed_up: took.seconds / run.seconds,
        operations_speed_up: counted.then(|| took.work.operations as f64 / run.work.operations.max(1) as f64),
    })
}
