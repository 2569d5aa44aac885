//! The engines alone and the yardstick, by criterion: what a change did to one of them. For comparisons between them see
//! the table, which runs them in turns.

use std::hint::black_box;

use common::body::{Ellipsoid, SUBDIVISIONS};
use common::rays::RaySet;
use common::samples::few_samples;
use common::{field, random, view};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// Rays in a random batch: enough to leave the caches, few enough for samples.
const BATCH: usize = 100_000;

/// Side of the image.
const SIZE: u32 = 600;

fn tracing(criterion: &mut Criterion) {
    for subdivisions in SUBDIVISIONS {
        let surface = Ellipsoid::BENCH.surface(subdivisions);
        let faces = surface.mesh().faces.len();
        let sets = [
            ("image", RaySet::Grid(view::window(surface.mesh(), SIZE))),
            ("random", RaySet::Batch(random::rays(BATCH))),
        ];
        for (name, rays) in &sets {
            let mut group = criterion.benchmark_group(format!("{faces} faces, {name}"));
            group.throughput(Throughput::Elements(rays.count() as u64));
            for entrant in field(faces) {
                let contestant = (entrant.build)(&surface);
                if contestant.tracer(rays).is_none() {
                    continue;
                }
                let mut lengths = vec![0.0; rays.count()];
                group.bench_function(entrant.name, |bencher| {
                    bencher.iter(|| {
                        lengths.fill(0.0);
                        let tracer = contestant.tracer(rays).expect("it took them before");
                        tracer(&rays.whole(), black_box(&mut lengths));
                    });
                });
            }
            group.finish();
        }
    }
}

fn building(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("build");
    for subdivisions in SUBDIVISIONS {
        let surface = Ellipsoid::BENCH.surface(subdivisions);
        let faces = surface.mesh().faces.len();
        group.throughput(Throughput::Elements(faces as u64));
        for entrant in field(faces) {
            group.bench_function(BenchmarkId::new(entrant.name, faces), |bencher| {
                bencher.iter_with_large_drop(|| (entrant.build)(&surface));
            });
        }
    }
    group.finish();
}

criterion_group! {
    name = exact;
    config = few_samples();
    targets = tracing, building
}
criterion_main!(exact);
