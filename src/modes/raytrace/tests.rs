use super::*;
use crate::geometry::Counted;
use crate::ritree::Parameters;
use crate::scene::trace::{Recipe, bezier_surface, open, random_volumes};

const SIZE: (u32, u32) = (24, 18);

fn samples() -> Samples {
    Samples::new(1, None).expect("a count")
}

fn trees(distance_threshold: f64) -> Tracing {
    let parameters = Parameters { distance_threshold, max_depth: 26, ..Parameters::default() };
    Tracing::RiTree(Trees { parameters, ..Trees::default() })
}

fn picture(world: &World, tracing: Tracing) -> Picture {
    Renderer::<f64>::new(world, tracing)
        .render(&world.cameras[0], SIZE, &samples(), &Control::none())
        .expect("done")
}

fn worlds() -> [World; 3] {
    let recipe = Recipe { seed: 2, count: 4 };
    [bezier_surface(1), random_volumes(recipe).expect("a world"), open("tomatoes", recipe).expect("a world")]
}

#[test]
fn pictures_by_trees_are_near_the_traced_ones() {
    for world in worlds() {
        let (exact, near) = (picture(&world, Tracing::Exact), picture(&world, trees(0.02)));
        let distance = exact.mean_distance(&near).expect("one size");
        assert!(distance < 0.03, "{}: {distance}", world.name);
        assert!(near.work().interpolated > 0, "{}", world.name);
        // Pixels are not all of one colour: something is seen.
        assert!(exact.colours().iter().any(|c| *c != exact.colours()[0]));
    }
}

#[test]
fn pictures_are_the_same_bits_for_any_cache_and_number_of_threads() {
    let world = &worlds()[1];
    let with = |threads: usize, cache_bytes: usize| {
        let Tracing::RiTree(settings) = trees(0.05) else { unreachable!() };
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let tracing = Tracing::RiTree(Trees { cache_bytes, ..settings });
        pool.install(|| picture(world, tracing))
    };
    let one = with(1, 100_000_000);
    for other in [with(2, 100_000_000), with(2, 400_000)] {
        assert!(one.colours() == other.colours() && one.traced() == other.traced());
    }
}

#[test]
fn rays_that_planes_alone_have_turned_ask_trees() {
    let recipe = Recipe { seed: 1, count: 4 };
    let asked = |table_mirrors| {
        let mut world = open("tomatoes", recipe).expect("a world");
        world.objects[0].material.mirror *= f64::from(table_mirrors);
        let (exact, near) = (picture(&world, Tracing::Exact), picture(&world, trees(0.02)));
        assert!(exact.mean_distance(&near).expect("one size") < 0.01);
        near.work().queries
    };
    let (with, without) = (asked(1), asked(0));
    assert!(with > without + 50, "{with}, without a mirror {without}");
}

#[test]
fn what_trees_tell_has_directions_of_unit_length() {
    let mut turned = 0;
    for world in worlds() {
        let Tracing::RiTree(settings) = trees(0.05) else { unreachable!() };
        let cache = Cache::new(settings.cache_bytes);
        for object in world.objects.iter().filter(|object| object.grows) {
            let seer = Seer::<f64>::new(object, &world, Some(settings.parameters));
            let camera = &world.cameras[0];
            let (mut asker, mut rays) = (seer.asker(camera.eye()), camera.rays(SIZE));
            for (column, row) in (0..SIZE.0).flat_map(|x| (0..SIZE.1).map(move |y| (x, y))) {
                let ray = rays.through([f64::from(column), f64::from(row)]);
                let Ok(Some(sight)) = asker.ask(&ray, true, &cache) else { continue };
                assert!((sight.normal.length() - 1.0).abs() < 1e-14, "{:?}", sight.normal);
                if let Some((on, _)) = seer.turned(&ray, &sight) {
                    assert!((on.dir.length() - 1.0).abs() < 1e-14, "{:?}", on.dir);
                    turned += 1;
                }
            }
        }
    }
    assert!(turned > 100, "{turned}");
}

#[test]
fn counting_operations_changes_no_colour() {
    let world = &worlds()[0];
    for tracing in [Tracing::Exact, trees(0.05)] {
        let counted = Renderer::<Counted>::new(world, tracing)
            .render(&world.cameras[0], SIZE, &samples(), &Control::none())
            .expect("done");
        let plain = picture(world, tracing);
        assert_eq!(counted.colours(), plain.colours());
        assert!(counted.work().operations > 100 * counted.work().rays && plain.work().operations == 0);
    }
}

#[test]
fn rays_of_a_pixel_cover_it_and_depend_on_the_seed_alone() {
    assert!(Samples::new(8, None).is_none() && Samples::new(0, None).is_none());
    assert_eq!(samples().of_pixel(3, 4).collect::<Vec<_>>(), [[0.5, 0.5]]);
    let seeded = Samples::new(9, Some(7)).expect("a count");
    let of_pixel = |column| seeded.of_pixel(column, 20).collect::<Vec<_>>();
    let places = of_pixel(10);
    assert_eq!(places, of_pixel(10));
    assert_ne!(places, of_pixel(11));
    for (i, [x, y]) in places.iter().enumerate() {
        assert_eq!(((x * 3.0) as usize, (y * 3.0) as usize), (i % 3, i / 3));
    }
}
