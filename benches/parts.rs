//! The parts of a tree by criterion: what sampling, fitting, descending, answering runs of pixels and forgetting cost, each
//! by itself; of trees of smooth objects, what a hit costs, and a way through glass. The engines that sample chords are in
//! `exact`, whole trees in `trees`.

use std::hint::black_box;

use chordfield::attributes::chord::ChordLength;
use chordfield::attributes::squared_chord::{ImageChords, SquaredChord};
use chordfield::exact::{Body, Engine};
use chordfield::geometry::{Ray, RayGrid};
use chordfield::linespace::{LinePoint, PlanePair};
use chordfield::ritree::{Attribute, Cache, Fit, FittedTree, Parameters, Place, RiTree};
use chordfield::scene::trace::{Camera, Recipe, World, bezier_surface, random_volumes};
use chordfield::surface::optics::follow;
use chordfield::surface::{Reach, Slabs, Surface};
use common::body::Ellipsoid;
use common::samples::few_samples;
use common::{random, view};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

/// 20 480 faces.
const SUBDIVISIONS: u32 = 5;

/// Random lines: enough that neither their cells nor their faces stay in the first caches.
const LINES: usize = 20_000;

/// Side of the image whose runs are answered, and of the one whose tree is pruned.
const SIZES: [u32; 2] = [600, 200];

const TOLERANCE_MM: f64 = 0.5;

/// Cells are of this depth: those about which most trees end.
const FIT_DEPTH: u32 = 20;

/// Columns and rows of the picture whose rays are held against smooth surfaces.
const PICTURE: (u32, u32) = (600, 600);

/// Glass bodies, of which the first is looked at.
const VOLUMES: Recipe = Recipe { seed: 1, count: 8 };

fn body() -> Body {
    let body = Body::new(Ellipsoid::BENCH.surface(SUBDIVISIONS));
    // The walker's tables are made once for a body; they belong to no part.
    body.walker();
    body
}

fn lines(chords: &ChordLength) -> Vec<LinePoint> {
    random::rays(LINES).iter().map(|ray| chords.space().point_of(ray.line())).collect()
}

/// The exact chord of a corner's line: what each of 16 corners of a cell costs.
fn sample(criterion: &mut Criterion) {
    let body = body();
    let chords = ChordLength::new(&body).expect("convex");
    let lines = lines(&chords);
    let mut group = criterion.benchmark_group("sample");
    group.throughput(Throughput::Elements(LINES as u64));
    group.bench_function("chord", |bencher| {
        bencher.iter(|| lines.iter().filter(|line| chords.sample(**line).is_some()).count());
    });
    group.finish();
}

/// The place of a given depth that holds a line.
fn place_of(line: &LinePoint, depth: u32) -> Place {
    (0..depth).fold(Place::root(line.pair), |place, _| place.half(place.side_of::<f64>(&line.stuv)))
}

/// The cubic of a cell, with its bound or the finding that there is none.
fn fit(criterion: &mut Criterion) {
    const CELLS: usize = 200;
    let body = body();
    let chords = SquaredChord::new(&body, TOLERANCE_MM, false).expect("convex");
    let places: Vec<Place> = random::rays(CELLS)
        .iter()
        .filter_map(|ray| chords.place_of(ray.line()))
        .map(|(pair, stuv)| place_of(&LinePoint { pair, stuv }, FIT_DEPTH))
        .collect();
    let mut group = criterion.benchmark_group("fit");
    group.throughput(Throughput::Elements(places.len() as u64));
    group.bench_function("cubic", |bencher| {
        bencher.iter(|| places.iter().filter(|place| chords.fit(place).leaf.is_some()).count());
    });
    group.finish();
}

/// From the root to the leaf of lines in no order, in trees that know them all, with the answer.
fn descent(criterion: &mut Criterion) {
    let body = body();
    let chords = ChordLength::new(&body).expect("convex");
    let lines = lines(&chords);
    let cache = Cache::new(1 << 30);
    let mut group = criterion.benchmark_group("descent");
    group.throughput(Throughput::Elements(LINES as u64));
    let tree = RiTree::new(chords, Parameters::default());
    let answered = || lines.iter().filter(|line| tree.query(**line, &cache).is_some()).count();
    answered();
    group.bench_function("quadrilinear", |bencher| bencher.iter(answered));

    let tree = FittedTree::new(SquaredChord::new(&body, TOLERANCE_MM, false).expect("convex"));
    let rays = random::rays(LINES);
    let places: Vec<(PlanePair, [f64; 4])> =
        rays.iter().filter_map(|ray| tree.fit().place_of(ray.line())).collect();
    let deepest = || places.iter().map(|(pair, stuv)| tree.ask(*pair, stuv, &cache, |_, depth| depth)).max();
    deepest();
    group.bench_function("squared chord", |bencher| bencher.iter(deepest));
    group.finish();
}

/// All pixels of an image whose leaves are there, by runs: a leaf answers those that it covers along a row.
fn leaf_run(criterion: &mut Criterion) {
    let body = body();
    let grid = view::window(body.surface().mesh(), SIZES[0]);
    let whole = grid.whole();
    let tree = FittedTree::new(SquaredChord::new(&body, TOLERANCE_MM, false).expect("convex"));
    let cache = Cache::new(1 << 30);
    let image = ImageChords::new(tree.fit(), &grid).expect("the source is outside");
    let (mut lengths, mut runs) = (vec![0.0; whole.pixels()], Vec::new());
    image.trace(&tree, &whole, &cache, &mut lengths, &mut runs);
    let mut group = criterion.benchmark_group("leaf run");
    group.throughput(Throughput::Elements(whole.pixels() as u64));
    group.bench_function("squared chord", |bencher| {
        bencher.iter(|| {
            runs.clear();
            image.trace(&tree, &whole, &cache, black_box(&mut lengths), &mut runs);
        });
    });
    group.finish();
}

/// A tree that has seen an image.
fn grown<'a>(body: &'a Body, grid: &RayGrid, cache: &Cache) -> RiTree<ChordLength<'a>> {
    let tree = RiTree::new(ChordLength::new(body).expect("convex"), Parameters::default());
    for (column, row) in grid.whole().places() {
        let point = tree.attribute().space().point_of(grid.segment(column, row).line());
        let _ = tree.query(point, cache);
        if column == 0 {
            tree.tick();
        }
    }
    tree
}

/// The stamps of all leaves, and half of these forgotten.
fn prune(criterion: &mut Criterion) {
    let body = body();
    let grid = view::window(body.surface().mesh(), SIZES[1]);
    let middle = grid.size().1 / 2;
    let mut group = criterion.benchmark_group("prune");
    let count = grown(&body, &grid, &Cache::new(1 << 30)).shape().nodes;
    group.throughput(Throughput::Elements(count));
    group.bench_function("half of the leaves", |bencher| {
        bencher.iter_batched(
            || {
                let cache = Cache::new(1 << 30);
                (grown(&body, &grid, &cache), cache)
            },
            |(mut tree, cache)| {
                let mut stamps = Vec::new();
                tree.collect_stamps(&mut stamps);
                tree.prune(black_box(middle), &cache);
                // Dropped outside of the time.
                (tree, stamps)
            },
            BatchSize::PerIteration,
        );
    });
    group.finish();
}

/// The engines on the same lines, for comparison: what a tree spares.
fn traced(criterion: &mut Criterion) {
    let body = body();
    let rays = random::rays(LINES);
    let mut lengths = vec![0.0; LINES];
    let mut group = criterion.benchmark_group("traced");
    group.throughput(Throughput::Elements(LINES as u64));
    group.bench_function("walk", |bencher| {
        bencher.iter(|| {
            let into = &mut chordfield::exact::Lengths(black_box(&mut lengths));
            body.trace(Engine::Walk, 0, &rays, into);
        });
    });
    group.finish();
}

/// The rays of a camera that meet a surface's box, in the picture's order: those that hit the surface, and those that miss it.
/// Others are told by the box alone.
fn rays_to(surface: &Surface, camera: &Camera) -> [Vec<Ray<f64>>; 2] {
    let (columns, rows) = PICTURE;
    let (bounds, mut rays) = (surface.bounds(), camera.rays(PICTURE));
    let (hits, misses) = (0..rows)
        .flat_map(|row| (0..columns).map(move |column| [column, row].map(|pixel| f64::from(pixel) + 0.5)))
        .map(move |place| rays.through(place))
        .filter(|ray| Slabs::new(ray).stretch(&bounds).is_some())
        .partition(|ray| surface.hit(ray, Reach::whole()).is_some());
    [hits, misses]
}

/// The first hits of smooth surfaces, without any shading: a mirroring sheet of 100 patches, and a body of glass.
fn hit(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("hit");
    let volumes = random_volumes(VOLUMES).expect("a few volumes");
    for (name, World { objects, cameras, .. }) in [("sheet", bezier_surface(1)), ("glass body", volumes)] {
        let surface = &objects[0].surface;
        for (what, rays) in ["met", "missed"].into_iter().zip(rays_to(surface, &cameras[0])) {
            group.throughput(Throughput::Elements(rays.len() as u64));
            group.bench_function(format!("{name} {what}"), |bencher| {
                bencher.iter(|| {
                    rays.iter().filter(|ray| black_box(surface.hit(ray, Reach::whole())).is_some()).count()
                });
            });
        }
    }
    group.finish();
}

/// From a hit of a glass body to where the light leaves it: what a sample of its tree costs beside the hit.
fn way(criterion: &mut Criterion) {
    let World { objects, cameras, most_inner_turns, .. } = random_volumes(VOLUMES).expect("a few volumes");
    let surface = &objects[0].surface;
    let optics = objects[0].material.optics().expect("glass");
    let [rays, _] = rays_to(surface, &cameras[0]);
    let hits: Vec<_> = rays.iter().filter_map(|ray| Some((ray, surface.hit(ray, Reach::whole())?))).collect();
    let mut group = criterion.benchmark_group("follow");
    group.throughput(Throughput::Elements(hits.len() as u64));
    group.bench_function("glass body", |bencher| {
        bencher.iter(|| {
            for (ray, hit) in &hits {
                black_box(follow(surface, ray, *hit, optics, most_inner_turns));
            }
        });
    });
    group.finish();
}

criterion_group! {
    name = parts;
    config = few_samples();
    targets = sample, fit, descent, leaf_run, prune, traced, hit, way
}
criterion_main!(parts);
