//! The volume of every organ of the adult from parallel projections: ∫ L dA = V.

use chordfield::geometry::UnitDir;
use chordfield::modes::Control;
use chordfield::modes::project::{Method, Projector, Wanted};
use chordfield::scene::{Organ, Panel, Pose, Scene, View};
use glam::DVec3;

const PIXELS: u32 = 360;

/// A parallel view along `along` that just holds the organ. Oblique on purpose: a flat face along the rays or along a
/// row of pixels would be counted by whole rows.
fn view_of(organ: &Organ, along: DVec3) -> View {
    let bounds = organ.body.bounds();
    let downstream = UnitDir::new(along).expect("a direction");
    let column = downstream.get().any_orthonormal_vector();
    let row = downstream.get().cross(column);
    let half = |axis: DVec3| 0.501 * bounds.size().dot(axis.abs());
    let panel = Panel::centred(
        bounds.centre() + bounds.diagonal() * downstream.get(),
        2.0 * half(column) / f64::from(PIXELS) * column,
        2.0 * half(row) / f64::from(PIXELS) * row,
        [PIXELS, PIXELS],
    );
    let reach = 2.0 * bounds.diagonal();
    let source = panel.centre_mm() - reach * downstream.get();
    View::parallel(source, downstream, reach, panel, Pose::Free).expect("a view")
}

/// The scene without what cannot touch the organ's own length; the organ comes first.
fn with_its_children_only(scene: &Scene, organ: usize) -> Scene {
    let mut alone = scene.clone();
    let children = &scene.organs[organ].children;
    alone.organs = std::iter::once(&organ).chain(children).map(|&i| scene.organs[i].clone()).collect();
    for (i, organ) in alone.organs.iter_mut().enumerate() {
        organ.parent = (i > 0).then_some(0);
        organ.children = if i == 0 { (1..=children.len()).collect() } else { Vec::new() };
    }
    alone
}

#[test]
fn every_organ_of_the_adult_has_its_meshs_volume_in_its_projection() {
    let scene = Scene::phantom("adult").expect("the phantom");
    let lengths = Wanted { lengths: true, attenuation: false, colour: false };
    for (i, organ) in scene.organs.iter().enumerate() {
        let alone = with_its_children_only(&scene, i);
        let projector = Projector::new(&alone, lengths, None, Method::Exact(None)).expect("a projector");
        let view = view_of(organ, DVec3::new(0.37, 0.81, 0.29));
        let projection = projector.project(&view, 0, &Control::none()).expect("a projection");
        let sum: f64 = projection.own_length_mm(0).iter().map(|&l| f64::from(l)).sum();
        let (measured, expected) = (sum * view.pixel_area_mm2(), organ.own_volume_mm3(&scene.organs));
        let error = measured / expected - 1.0;
        assert!(error.abs() < 1e-4, "{}: {measured} mm³, not {expected}: {error:.1e}", organ.name);
    }
}
