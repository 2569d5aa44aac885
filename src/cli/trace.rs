//! `chordfield trace`.

mod record;

use std::io::Write;
use std::time::Instant;

use super::args::{Application, InterpolationArg, MethodArg, TraceArgs};
use super::{Session, method, print};
use crate::error::{Error, Result};
use crate::geometry::{Counted, Real};
use crate::modes::Control;
use crate::modes::absorption::{Bodies, Lengths};
use crate::modes::raytrace::{Picture, Renderer, Samples, Tracing, Trees};
use crate::output::projection::safe_name;
use crate::output::{create_folder, json, picture, remove_stale};
use crate::ritree::BuildCounts;
use crate::scene::panel::MAX_PIXELS;
use crate::scene::trace::{self, Camera, Recipe, World};
use record::{Comparison, Record, Round, Run, SpeedUps, Took};

/// A world made ready for what is made of its rays, and how long that took.
struct Stage<'a, R: Real> {
    matter: Matter<'a, R>,
    seconds: f64,
}

enum Matter<'a, R: Real> {
    Pictures(Renderer<'a, R>),
    Absorption(Bodies<'a, R>),
}

/// What was made of one view.
struct Made {
    picture: Picture,
    lengths: Option<Lengths>,
}

impl<'a, R: Real> Stage<'a, R> {
    fn new(world: &'a World, tracing: Tracing, application: Application) -> Result<Self> {
        let start = Instant::now();
        let matter = match application {
            Application::Pictures => Matter::Pictures(Renderer::new(world, tracing)),
            Application::Absorption => Matter::Absorption(Bodies::new(world, tracing)?),
        };
        Ok(Self { matter, seconds: start.elapsed().as_secs_f64() })
    }

    fn view(&self, camera: &Camera, size: (u32, u32), samples: &Samples, control: &Control) -> Result<Made> {
        Ok(match &self.matter {
            Matter::Pictures(renderer) => {
                Made { picture: renderer.render(camera, size, samples, control)?, lengths: None }
            }
            Matter::Absorption(bodies) => {
                let lengths = bodies.lengths(camera, size, control)?;
                Made { picture: lengths.picture(size), lengths: Some(lengths) }
            }
        })
    }

    fn tree_bytes(&self) -> usize {
        match &self.matter {
            Matter::Pictures(renderer) => renderer.tree_bytes(),
            Matter::Absorption(bodies) => bodies.tree_bytes(),
        }
    }

    fn build_counts(&self) -> BuildCounts {
        match &self.matter {
            Matter::Pictures(renderer) => renderer.build_counts(),
            Matter::Absorption(bodies) => bodies.build_counts(),
        }
    }
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
    if args.application == Application::Absorption && args.samples != 1 {
        return Err(Error::input(
            "--samples",
            "lengths are those of a pixel's middle",
            "give 1, or a larger --size",
        ));
    }
    let stage = Stage::<R>::new(&world, tracing, args.application)?;
    session.begin_writing();
    create_folder(&args.output)?;
    let name = match args.application {
        Application::Pictures => safe_name(&world.name),
        Application::Absorption => format!("{}-absorption", safe_name(&world.name)),
    };
    let record_path = args.output.join(format!("{name}.json"));
    remove_stale(&record_path)?;

    let (made, mut run) = render(&stage, &world, args, &samples, session)?;
    run.count_in(stage.seconds);
    for (index, of_view) in made.iter().enumerate() {
        let label = if made.len() == 1 { name.clone() } else { format!("{name}-{index}") };
        picture::write(&args.output.join(format!("{label}.png")), &of_view.picture)?;
        if args.map {
            picture::write_map(&args.output.join(format!("{label}-map.png")), &of_view.picture)?;
        }
    }
    let exact = args
        .compare
        .then(|| compare(&stage, &world, tracing, args, &samples, session, (&made, &run)))
        .transpose()?;
    let (method, settings) = match tracing {
        Tracing::RiTree(settings) => (MethodArg::Ritree, Some(settings)),
        Tracing::Exact => (MethodArg::Exact, None),
    };
    let record = Record {
        scene: world.name.clone(),
        application: args.application,
        objects: world.objects.len(),
        size: args.size,
        samples: args.samples,
        method: method.name(),
        settings,
        views: made.len(),
        threads: rayon::current_num_threads(),
        run,
        exact,
    };
    json::write(&record_path, &record)?;
    session.remark(&format!("{} pictures in {}", made.len(), args.output.display()));
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

/// All views, and what they took; trees live from the first to the last.
fn render<R: Real>(
    stage: &Stage<R>,
    world: &World,
    args: &TraceArgs,
    samples: &Samples,
    session: &Session,
) -> Result<(Vec<Made>, Run)> {
    let size = (args.size[0], args.size[1]);
    let pixels = u64::from(size.0) * u64::from(size.1) * world.cameras.len() as u64;
    let bar = session.progress(pixels, "pixels");
    let advance = |done| bar.inc(done);
    let control = Control::new(session.cancel(), &advance);
    let (mut made, mut run) = (Vec::with_capacity(world.cameras.len()), Run::default());
    for camera in &world.cameras {
        let start = Instant::now();
        let of_view = stage.view(camera, size, samples, &control)?;
        let work = of_view.picture.work();
        run.of_views.push(Took { seconds: start.elapsed().as_secs_f64(), operations: work.operations });
        run.work += work;
        made.push(of_view);
    }
    run.count_in(0.0);
    run.tree_bytes = stage.tree_bytes();
    run.build = stage.build_counts();
    let traced = made.iter().flat_map(|m| m.picture.traced()).filter(|traced| **traced).count();
    run.traced_pixels = traced as f64 / pixels as f64;
    Ok((made, run))
}

/// The views of a stage that has made them once, traced exactly and made once more; and all of that again, to time it.
fn compare<R: Real>(
    stage: &Stage<R>,
    world: &World,
    tracing: Tracing,
    args: &TraceArgs,
    samples: &Samples,
    session: &Session,
    (made, run): (&[Made], &Run),
) -> Result<Comparison> {
    let make = |stage: &Stage<R>| render(stage, world, args, samples, session);
    let make_anew = |tracing| -> Result<_> {
        let stage = Stage::<R>::new(world, tracing, args.application)?;
        let (made, mut run) = make(&stage)?;
        run.count_in(stage.seconds);
        Ok((stage, made, run))
    };
    let (_, exact, took) = make_anew(Tracing::Exact)?;
    let (_, again) = make(stage)?;
    let views = |run: &Run| run.of_views.clone();
    let mut rounds = vec![Round { own: views(run), exact: views(&took), warm: views(&again) }];
    for _ in 1..args.rounds {
        let (stage, _, own) = make_anew(tracing)?;
        let (_, _, exact) = make_anew(Tracing::Exact)?;
        let (_, warm) = make(&stage)?;
        rounds.push(Round { own: own.of_views, exact: exact.of_views, warm: warm.of_views });
    }
    let mean = |errors: Vec<f64>| errors.iter().sum::<f64>() / errors.len() as f64;
    let pairs = || made.iter().zip(&exact);
    let lengths: Vec<f64> = pairs()
        .filter_map(|(own, exact)| Some(own.lengths.as_ref()?.mean_difference(exact.lengths.as_ref()?)))
        .collect();
    Ok(Comparison {
        seconds: took.seconds,
        nanoseconds_per_ray: took.nanoseconds_per_ray,
        work: took.work,
        mean_rgb_error: mean(pairs().filter_map(|(a, b)| a.picture.mean_distance(&b.picture)).collect()),
        mean_length_error: (!lengths.is_empty()).then(|| mean(lengths)),
        rounds: rounds.len(),
        speed_ups: SpeedUps::of(&rounds),
    })
}
