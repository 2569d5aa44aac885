//! `chordfield project`.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::Path;
use std::time::Instant;

use super::args::{BeamArgs, BeamKindArg, Product, ProjectArgs, SourceArgs};
use super::method::method;
use super::{Session, keep, print};
use crate::error::{Error, Result};
use crate::exact::Engine;
use crate::modes::Control;
use crate::modes::project::{Method, Projector, QueryCounts, RayCounts, Wanted};
use crate::output::page::short;
use crate::output::projection::{self, Products};
use crate::output::sidecar::{ChoiceRecord, Sidecar, Summary, TreeSummary, ViewRecord};
use crate::output::{create_folder, json, remove_stale};
use crate::physics::{PhotonNoise, Spectrum};
use crate::scene::beam::{BeamKind, BeamSpec, DetectorSpec};
use crate::scene::ranges::Angles;
use crate::scene::{Given, Organ, Scene, View, phantoms};

/// Rays whose interpolated lengths are held against exact ones in each run.
const SPOT_CHECK_RAYS: usize = 20_000;

/// Projects a scene and writes what was asked for; the summary goes to `out` as JSON if asked for.
///
/// The record is written last, and one of an earlier run goes first: a folder with a record holds a whole run, one
/// without holds what an error or an interruption left, whole files of some views.
pub fn run(args: &ProjectArgs, session: &Session, out: &mut dyn Write) -> Result<()> {
    let mut stages = Stages::start();
    let mut scene = open(&args.scene)?;
    change(&mut scene, &args.beam, &args.photons.source)?;
    let views = scene.beam.views()?;
    let labels = labels(&scene.name, &views);
    let noise = args.photons.photons.map(|n| PhotonNoise::new(n, args.photons.seed)).transpose()?;
    let products = products(args);
    let method = keep::method(&args.keep, method(&args.method)?)?.for_views(&views);
    let mut projector = Projector::new(&scene, wanted(&products), noise, method)?;
    keep::load(&args.keep, &mut projector, session)?;
    session.begin_writing();
    create_folder(&args.output)?;
    let record = args.output.join(format!("{}.json", projection::safe_name(&scene.name)));
    remove_stale(&record)?;
    stages.end("load");

    let rays: u64 = views.iter().map(View::pixels).sum();
    let bar = session.progress(rays, "rays");
    bar.set_message(scene.name.clone());
    let advance = |rays| bar.inc(rays);
    let control = Control::new(session.cancel(), &advance);
    let (mut counts, mut queries) = (RayCounts::default(), QueryCounts::default());
    let mut engines = BTreeMap::new();
    let mut records = Vec::new();
    for (index, (view, label)) in views.iter().zip(&labels).enumerate() {
        let projection = projector.project(view, index as u64, &control)?;
        counts += projection.counts();
        note_engines(&mut engines, projection.engines());
        queries += projection.queries();
        stages.end("project");
        let files = projection::write(&args.output, label, &scene, view, &projection, &products)?;
        control.check()?;
        stages.end("write");
        records.push((view, label.clone(), files));
    }
    bar.finish_and_clear();
    // Before the check below asks for leaves of its own.
    keep::save(&args.keep, &projector, session)?;
    stages.end("write");
    let ritree = tree_summary(&projector, method, queries, &views);
    stages.end("check");

    let choices = choices(&scene, &projector);
    let files = records.iter().flat_map(|(_, _, files)| files);
    let summary = Summary {
        method: method.name(),
        choice: choice(method, &choices, &engines),
        choices,
        ritree,
        engines,
        views: views.len(),
        organs: scene.organs.len(),
        counts,
        threads: rayon::current_num_threads(),
        peak_bytes: peak_bytes(),
        files: files.clone().count() + 1,
        bytes_written: files.map(|f| f.bytes).sum(),
        seconds: stages.seconds,
    };
    let views = records.into_iter().map(|(view, label, files)| ViewRecord::of(view, label, files)).collect();
    let sidecar = Sidecar::new(&scene, noise, views, summary);
    json::write(&record, &sidecar)?;
    let summary = sidecar.summary();
    session.remark(&format!(
        "{} files in {}; what they are is said in {}",
        summary.files,
        args.output.display(),
        record.display()
    ));
    if args.json {
        print(out, &json::text(summary)?)?;
    }
    Ok(())
}

/// The scene of a file, or the phantom of that name.
pub fn open(scene: &str) -> Result<Scene> {
    let path = Path::new(scene);
    // A folder of that name, such as one projected into, does not hide the phantom.
    let is_free = path.is_dir() || !path.exists();
    if is_free && phantoms::find(scene).is_ok() {
        return Scene::phantom(scene);
    }
    if is_free && path.extension().is_none() {
        let names: Vec<_> = phantoms::list().iter().map(|p| p.name).collect();
        return Err(Error::input(
            scene,
            "there is no such file and no phantom of that name",
            format!("give a scene file, or one of the phantoms {}", names.join(", ")),
        ));
    }
    Scene::load(path)
}

/// Puts what the command line says in place of what the scene says.
pub fn change(scene: &mut Scene, beam: &BeamArgs, photons: &SourceArgs) -> Result<()> {
    scene.beam = scene.beam.clone().overridden_by(beam_spec(beam)?);
    if let Some(energy) = photons.energy_kev {
        scene.replace_source(Spectrum::mono(energy)?)?;
    }
    if let Some(kvp) = photons.kvp {
        scene.replace_source(Spectrum::tungsten(kvp)?)?;
    }
    if let Some(response) = photons.response {
        scene.response = response.into();
    }
    Ok(())
}

fn beam_spec(args: &BeamArgs) -> Result<BeamSpec> {
    let angles = |name: &str, text: &Option<String>| -> Result<Option<Given<Angles>>> {
        let parse = |t: &String| {
            t.parse::<Angles>().map_err(|problem| {
                Error::input(format!("--{name} {t}"), problem, "give angles as `30`, `0,90` or `0..360:30`")
            })
        };
        Ok(text.as_ref().map(parse).transpose()?.map(Given::from))
    };
    Ok(BeamSpec {
        kind: args.beam.map(|kind| {
            Given::from(match kind {
                BeamKindArg::Cone => BeamKind::Cone,
                BeamKindArg::Parallel => BeamKind::Parallel,
            })
        }),
        sad_mm: args.sad_mm.map(Given::from),
        sdd_mm: args.sdd_mm.map(Given::from),
        isocentre_mm: args.isocentre_mm.map(Given::from),
        gantry_deg: angles("gantry", &args.gantry)?,
        couch_deg: angles("couch", &args.couch)?,
        collimator_deg: angles("collimator", &args.collimator)?,
        detector: DetectorSpec {
            size_mm: args.detector_mm.map(Given::from),
            pixels: args.size.map(Given::from),
            offset_mm: args.offset_mm.map(Given::from),
        },
        ..BeamSpec::default()
    })
}

fn products(args: &ProjectArgs) -> Products {
    let has = |product| args.write.contains(&product);
    Products {
        radiograph: has(Product::Radiograph),
        colour: has(Product::Colour),
        transmission: has(Product::Transmission),
        line_integral: has(Product::P),
        lengths: has(Product::Lengths),
        map: args.map,
        npy: args.npy,
        window: args.window,
        polarity: args.polarity.into(),
    }
}

/// What the trees did, with their error on a sample of the run's rays.
fn tree_summary(
    projector: &Projector,
    method: Method,
    queries: QueryCounts,
    views: &[View],
) -> Option<TreeSummary> {
    let (Method::RiTree(settings) | Method::Auto(settings)) = method else { return None };
    let trees = projector.forest()?;
    Some(TreeSummary {
        settings,
        queries,
        trees,
        sampled_error_mm: projector.spot_check(views, SPOT_CHECK_RAYS, 1),
    })
}

/// What `auto` chose for each organ that is needed, and why.
fn choices(scene: &Scene, projector: &Projector) -> Vec<ChoiceRecord> {
    let record = |(i, organ): (usize, &Organ)| {
        let (estimate, is_in_tree) = projector.estimate(i)?;
        let chosen = if is_in_tree { "ritree" } else { estimate.engine.name() };
        Some(ChoiceRecord { organ: organ.name.clone(), chosen, estimate })
    };
    scene.organs.iter().enumerate().filter_map(record).collect()
}

/// The same in words.
fn choice(method: Method, choices: &[ChoiceRecord], engines: &BTreeMap<Engine, u64>) -> Option<String> {
    let Method::Auto(settings) = method else { return None };
    let of_engines: Vec<String> =
        engines.iter().map(|(engine, n)| format!("{} {n}", engine.name())).collect();
    let exact = format!(
        "others exactly, by the engine of least estimated cost for their faces and pixels, organs counted per view: {}",
        if of_engines.is_empty() { "none".into() } else { of_engines.join(", ") }
    );
    let Some(demand) = settings.demand else {
        let planes = settings.least_planes;
        return Some(format!(
            "RI-trees for convex organs of {planes} face planes or more, as asked for; {exact}"
        ));
    };
    let in_trees: Vec<String> = choices
        .iter()
        .filter(|record| record.chosen == "ritree")
        .map(|ChoiceRecord { organ, estimate, .. }| {
            let (tree_s, exact_s) = (short(estimate.tree_s), short(estimate.exact_s));
            format!("{organ} ({tree_s} s in place of {exact_s} s by {})", estimate.engine.name())
        })
        .collect();
    let of_trees = match in_trees.len() {
        0 => "no organ in an RI-tree, as growing it and asking it are estimated to take longer than tracing"
            .into(),
        _ => format!("in RI-trees, by estimates: {}", in_trees.join(", ")),
    };
    Some(format!("for {} views of {} pixels in all: {of_trees}; {exact}", demand.views, demand.pixels))
}

/// Counts the organs of a view by the engine that traced them.
fn note_engines(counts: &mut BTreeMap<Engine, u64>, of_organs: &[Option<Engine>]) {
    for engine in of_organs.iter().flatten() {
        *counts.entry(*engine).or_default() += 1;
    }
}

fn wanted(products: &Products) -> Wanted {
    Wanted {
        lengths: products.lengths,
        attenuation: products.radiograph || products.transmission || products.line_integral,
        colour: products.colour,
    }
}

/// A name for each view's files: the scene's and the pose's; numbered where poses are alike.
fn labels(scene: &str, views: &[View]) -> Vec<String> {
    let plain: Vec<String> =
        views.iter().map(|view| format!("{}-{}", projection::safe_name(scene), view.label())).collect();
    let mut counts: BTreeMap<&str, usize> = BTreeMap::new();
    plain.iter().for_each(|label| *counts.entry(label).or_default() += 1);
    let is_repeated = |label: &String| counts[label.as_str()] > 1;
    plain
        .iter()
        .enumerate()
        .map(|(i, label)| if is_repeated(label) { format!("{label}-{i:03}") } else { label.clone() })
        .collect()
}

/// Wall-clock time by stage.
struct Stages {
    last: Instant,
    seconds: BTreeMap<&'static str, f64>,
}

impl Stages {
    fn start() -> Self {
        Self { last: Instant::now(), seconds: BTreeMap::new() }
    }

    /// Adds the time since the last stage ended to `stage`.
    fn end(&mut self, stage: &'static str) {
        *self.seconds.entry(stage).or_default() += self.last.elapsed().as_secs_f64();
        self.last = Instant::now();
    }
}

/// The most memory this process has held, where the system tells (Linux's `VmHWM`).
fn peak_bytes() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok().map(|kib| kib * 1024)
}
