//! Projections against integrals and identities that need no second engine.

mod common;

use std::sync::atomic::AtomicBool;

use chordfield::Error;
use chordfield::geometry::Interval;
use chordfield::modes::Control;
use chordfield::modes::project::{Method, Projection, Projector, Wanted};
use chordfield::physics::PhotonNoise;
use chordfield::scene::Scene;
use common::{nested_balls, scene};

const EVERYTHING: Wanted = Wanted { lengths: true, attenuation: true, colour: true };

fn project(scene: &Scene, wanted: Wanted) -> Projection {
    let view = &scene.beam.views().expect("a beam")[0];
    Projector::new(scene, wanted, None, Method::Exact(None))
        .and_then(|p| p.project(view, 0, &Control::none()))
        .expect("a projection")
}

fn sum(values: &[f32]) -> f64 {
    values.iter().map(|&v| f64::from(v)).sum()
}

#[test]
fn parallel_lengths_times_area_are_volumes_at_every_angle() {
    let scene_text = nested_balls(300).replace("[beam]", "[beam]\ngantry_deg = [0, 37, 90]\ncouch_deg = 20");
    let scene = scene(&scene_text).expect("a scene");
    let projector = Projector::new(&scene, EVERYTHING, None, Method::Exact(None)).expect("a projector");
    for view in scene.beam.views().expect("views") {
        let projection = projector.project(&view, 0, &Control::none()).expect("a projection");
        for (i, organ) in scene.organs.iter().enumerate() {
            let measured = sum(&projection.own_length_mm(i)) * view.pixel_area_mm2();
            let expected = organ.own_volume_mm3(&scene.organs);
            assert!(
                (measured / expected - 1.0).abs() < 1e-4,
                "{}: {measured} mm³, not {expected}",
                organ.name
            );
        }
    }
}

#[test]
fn own_lengths_and_the_outside_make_up_the_path() {
    let scene = scene(&nested_balls(64)).expect("a scene");
    let view = &scene.beam.views().expect("views")[0];
    let projection = project(&scene, EVERYTHING);
    let (outer, inner) = (projection.own_length_mm(0), projection.own_length_mm(1));
    let mut parts = Vec::new();
    for row in 0..64 {
        for column in 0..64 {
            let ray = view.segment(column, row);
            scene.organs[0].body.chords_of_segment(&ray, &mut parts);
            let inside: f64 = parts.iter().map(Interval::length).sum();
            let i = (row * 64 + column) as usize;
            let own = f64::from(outer[i]) + f64::from(inner[i]);
            assert!((own - inside).abs() < 1e-4, "pixel {column}, {row}: {own} mm in organs, not {inside}");
        }
    }
}

#[test]
fn attenuation_is_the_sum_of_mu_times_length() {
    let scene = scene(&nested_balls(64)).expect("a scene");
    let projection = project(&scene, EVERYTHING);
    let (outer, inner) = (projection.own_length_mm(0), projection.own_length_mm(1));
    let (p, t) = (projection.line_integral(), projection.transmission());
    // NIST at 60 keV: water 0.2059 cm²/g at 1 g/cm³, cortical bone 0.3148 cm²/g at 1.92 g/cm³.
    for i in 0..p.len() {
        let expected = (0.2059 * f64::from(outer[i]) + 0.3148 * 1.92 * f64::from(inner[i])) / 10.0;
        assert!((f64::from(p[i]) - expected).abs() < 1e-5 * (1.0 + expected));
        assert!((f64::from(t[i]) - (-expected).exp()).abs() < 1e-5);
    }
    assert!(p.iter().any(|&p| p > 1.5), "the bone must be seen");
}

#[test]
fn images_are_the_same_bits_for_one_two_and_eight_threads() {
    let scene = scene(&nested_balls(100)).expect("a scene");
    let view = &scene.beam.views().expect("views")[0];
    let noise = PhotonNoise::new(1e4, 7).ok();
    let with_threads = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        let projection = pool.install(|| {
            Projector::new(&scene, EVERYTHING, noise, Method::Exact(None))
                .and_then(|p| p.project(view, 0, &Control::none()))
        });
        let projection = projection.expect("a projection");
        let bits = |values: Vec<f32>| values.into_iter().map(f32::to_bits).collect::<Vec<_>>();
        let mut all = bits(projection.line_integral());
        all.extend(bits(projection.own_length_mm(0)));
        all.extend(bits(projection.own_length_mm(1)));
        all.extend(bits(projection.colour().concat()));
        all
    };
    let one = with_threads(1);
    assert_eq!(one, with_threads(2));
    assert_eq!(one, with_threads(8));
}

#[test]
fn what_no_output_asks_for_is_skipped_and_counted() {
    let text = nested_balls(640).replace("bone_cortical", "vacuum");
    let scene = scene(&text).expect("a scene");
    let attenuation = Wanted { lengths: false, attenuation: true, colour: false };
    let counts = project(&scene, attenuation).counts();
    assert_eq!(counts.rays, 640 * 640);
    assert!(counts.rays_skipped_by_bounds > 0 && counts.organ_rays_skipped_by_bounds > 0);
    // The vacuum attenuates nothing, but it carves its chord out of the water around it.
    assert_eq!(counts.organ_rays_skipped_unneeded, 0);
    let total =
        counts.organ_rays_exact + counts.organ_rays_skipped_by_bounds + counts.organ_rays_skipped_unneeded;
    assert_eq!(total, counts.organ_rays);

    let apart = text.replace("inside = \"outer\"\n", "").replace("[10, 5, -8]", "[200, 0, 0]");
    let scene = common::scene(&apart).expect("a scene");
    assert_eq!(project(&scene, attenuation).counts().organ_rays_skipped_unneeded, 640 * 640);
}

#[test]
fn a_source_inside_an_organ_sees_only_what_lies_ahead() {
    let text = nested_balls(9).replace("kind = \"parallel\"", "source_mm = [0, 0, 0]\ndetector_centre_mm = [0, 300, 0]\ncolumn_direction = [1, 0, 0]\nrow_direction = [0, 0, -1]");
    let scene = scene(&text).expect("a scene");
    let projection = project(&scene, EVERYTHING);
    let ahead = projection.own_length_mm(0)[40] + projection.own_length_mm(1)[40];
    assert!((ahead - 40.0).abs() < 1.0, "half of the 80 mm axis lies ahead, not {ahead} mm");
}

#[test]
fn a_cancelled_projection_is_interrupted() {
    let scene = scene(&nested_balls(64)).expect("a scene");
    let view = &scene.beam.views().expect("views")[0];
    let (stop, silent) = (AtomicBool::new(true), |_: u64| {});
    let projector = Projector::new(&scene, EVERYTHING, None, Method::Exact(None)).expect("a projector");
    let stopped = projector.project(view, 0, &Control::new(&stop, &silent));
    assert!(matches!(stopped, Err(Error::Interrupted)));
}
