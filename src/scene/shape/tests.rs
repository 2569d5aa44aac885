use std::collections::HashMap;
use std::f64::consts::PI;

use rand::{Rng, RngExt, SeedableRng};
use rand_pcg::Pcg64;
use robust::{Coord3D, orient3d};

use super::*;
use crate::geometry::UnitDir;

fn shape(text: &str) -> Shape {
    toml::from_str(text).unwrap_or_else(|e| panic!("{text}: {e}"))
}

fn problem(text: &str) -> ShapeProblem {
    let spec: ShapeSpec = toml::from_str(text).unwrap_or_else(|e| panic!("{text}: {e}"));
    Shape::try_from(spec).and_then(|s| s.tessellate().map(|_| s)).expect_err(text)
}

/// Convex shapes of every smooth kind, turned, moved, uncut and cut once, twice and in a corner.
fn smooth_shapes() -> Vec<Shape> {
    let kinds = [
        "kind = 'ellipsoid'\nhalf_axes_mm = [45, 15, 55]",
        "kind = 'piecewise-ellipsoid'\nnegative_half_axes_mm = [54, 50, 70]\npositive_half_axes_mm = [86, 50, 31]",
        "kind = 'half-ellipsoid'\nhalf_axes_mm = [50, 75, 120]",
        "kind = 'elliptic-cylinder'\nhalf_axes_mm = [60, 40]\nbottom_centre_mm = [10, 0, -50]\ntop_centre_mm = [-20, 15, 60]",
        "kind = 'elliptic-frustum'\nbottom_half_axes_mm = [20, 30]\ntop_half_axes_mm = [40, 60]\nbottom_centre_mm = [0, 0, -50]\ntop_centre_mm = [20, 0, 60]",
        "kind = 'elliptic-frustum'\nbottom_half_axes_mm = [60, 50]\ntop_half_axes_mm = [0, 0]\nbottom_centre_mm = [0, 0, -50]\ntop_centre_mm = [0, 30, 60]",
        "kind = 'capped-cylinder'\nhalf_axes_mm = [80, 100]\ncap_height_mm = 71.5\nbottom_centre_mm = [0, 0, -60]\ntop_centre_mm = [0, 0, 30]",
        "kind = 'rounded-frustum'\nradius_mm = 42\ntop_radius_mm = 12\nheight_mm = 80",
    ];
    let places = [
        "",
        "rotate_deg = [0, 90, 0]\nmove_mm = [5, 6, 7]",
        "rotate_deg = [20, -35, 110]\nmove_mm = [500, -300, 1000]",
    ];
    let cuts = |m: DVec3| {
        let at = |n: DVec3, depth: f64| {
            let (n, d) = (n.normalize(), n.normalize().dot(m) + depth);
            format!("{{ normal = [{}, {}, {}], offset_mm = {d} }}", n.x, n.y, n.z)
        };
        let (a, b, c) =
            (at(DVec3::X, 14.0), at(DVec3::new(0.3, -1.0, 0.4), 17.0), at(DVec3::new(0.1, 0.2, -1.0), 19.0));
        let sliver = at(DVec3::new(1.0, 1.0, 1.0), 21.0);
        [
            String::new(),
            format!("cuts = [{a}]"),
            format!("cuts = [{b}, {c}]"),
            format!("cuts = [{a}, {b}, {c}, {sliver}]"),
        ]
    };
    let mut shapes = Vec::new();
    for kind in kinds {
        for place in places {
            let whole = shape(&format!(
                "{kind}
{place}
faces = 64"
            ))
            .tessellate()
            .expect("a mesh");
            for cut in cuts(whole.bounds().centre()) {
                shapes.push(shape(&format!("{kind}\n{place}\n{cut}\nfaces = 1500")));
            }
        }
    }
    shapes
}

fn assert_closed(mesh: &TriMesh) {
    let mut edges: HashMap<(u32, u32), usize> = HashMap::new();
    for f in &mesh.faces {
        for i in 0..3 {
            *edges.entry((f[i], f[(i + 1) % 3])).or_default() += 1;
        }
    }
    assert!(
        edges.iter().all(|(&(a, b), &n)| n == 1 && edges.contains_key(&(b, a))),
        "not closed or not manifold"
    );
}

fn assert_exactly_convex(mesh: &TriMesh) {
    let exact = |p: DVec3| Coord3D { x: p.x, y: p.y, z: p.z };
    for [a, b, c] in mesh.triangles() {
        let beyond = mesh.vertices.iter().find(|&&v| orient3d(exact(a), exact(b), exact(c), exact(v)) < 0.0);
        assert_eq!(beyond, None, "beyond the face at {a}");
    }
}

fn random_lines(bounds: Bounds, count: usize, seed: u64) -> Vec<Line> {
    let mut rng = Pcg64::seed_from_u64(seed);
    let point = |rng: &mut Pcg64| bounds.min + bounds.size() * DVec3::new(unit(rng), unit(rng), unit(rng));
    (0..count)
        .filter_map(|_| {
            let (a, b) = (point(&mut rng), point(&mut rng));
            Line::new(a, UnitDir::new(b - a)?)
        })
        .collect()
}

fn unit(rng: &mut impl Rng) -> f64 {
    rng.random_range(0.0..1.0)
}

#[test]
fn smooth_meshes_are_closed_convex_and_have_the_faces_asked_for() {
    for shape in smooth_shapes() {
        let mesh = shape.tessellate().expect("a mesh");
        assert_closed(&mesh);
        assert_exactly_convex(&mesh);
        let faces = mesh.faces.len() as f64;
        // Four cuts leave some bodies hardly any curved surface, and fewer faces.
        let least = if shape.cuts.len() < 4 { 0.9 } else { 0.0 };
        assert!((least..=1.1).contains(&(faces / 1500.0)), "{faces} faces: {shape:?}");
    }
}

#[test]
fn vertices_lie_on_the_true_surface() {
    for shape in smooth_shapes() {
        let mesh = shape.tessellate().expect("a mesh");
        let middle = mesh.vertices.iter().sum::<DVec3>() / mesh.vertices.len() as f64;
        for &v in &mesh.vertices {
            assert!(shape.contains(v + 1e-9 * (middle - v)), "{v} is outside {shape:?}");
            assert!(!shape.contains(v - 1e-9 * (middle - v)), "{v} is inside {shape:?}");
        }
    }
}

#[test]
fn volumes_agree_with_their_meshes_within_the_depth() {
    for shape in smooth_shapes() {
        let (mesh, depth) =
            (shape.tessellate().expect("a mesh"), shape.tessellation_depth_mm().expect("a depth"));
        let lost = shape.volume_mm3() - mesh.signed_volume();
        // Inscribed: never more than the body; at most a layer of the depth less (its outer side is larger).
        let layer = 1.05 * depth * mesh.area();
        assert!(lost > -1e-9 * shape.volume_mm3(), "{lost} mm³ too much: {shape:?}");
        assert!(lost <= layer, "{lost} mm³ lost, the layer is {layer}: {shape:?}");
        assert!(depth < 2.0, "{depth} mm deep: {shape:?}");
    }
}

#[test]
fn chords_agree_with_membership_along_the_line() {
    for (i, shape) in smooth_shapes().into_iter().enumerate() {
        let bounds = shape.tessellate().expect("a mesh").bounds().grown(5.0);
        for line in random_lines(bounds, 40, i as u64) {
            let steps = 400;
            let inside: Vec<f64> = (0..=steps)
                .map(|k| (f64::from(k) / f64::from(steps) - 0.5) * 2.0 * bounds.diagonal())
                .filter(|&t| shape.contains(line.at(t)))
                .collect();
            match shape.chord(&line) {
                Some(chord) => {
                    assert!(inside.iter().all(|&t| chord.start() - 1e-9 <= t && t <= chord.end() + 1e-9));
                    for (end, sign) in [(chord.start(), 1.0), (chord.end(), -1.0)] {
                        if chord.length() > 1e-3 {
                            assert!(shape.contains(line.at(end + sign * 1e-6)), "{shape:?}");
                        }
                        assert!(!shape.contains(line.at(end - sign * 1e-6)), "{shape:?}");
                    }
                }
                None => assert!(inside.is_empty(), "{inside:?} {shape:?}"),
            }
        }
    }
}

#[test]
fn chords_of_sphere_box_and_tetrahedron_have_their_closed_forms() {
    let along = |origin: [f64; 3], dir: DVec3| {
        Line::new(origin.into(), UnitDir::new(dir).expect("a direction")).expect("a line")
    };
    let sphere = shape("kind = 'ellipsoid'\ncentre_mm = [10, 20, 30]\nhalf_axes_mm = [50, 50, 50]");
    let chord = sphere.chord(&along([1010.0, 20.0, 60.0], DVec3::NEG_X)).expect("a chord");
    assert!((chord.length() - 80.0).abs() < 1e-12 && (chord.start() - 960.0).abs() < 1e-12, "{chord:?}");
    let cube = shape("kind = 'box'\nmin_mm = [0, 0, 0]\nmax_mm = [10, 20, 30]");
    let chord = cube.chord(&along([-1.0, 10.0, 14.0], DVec3::new(1.0, 0.0, 1.0))).expect("a chord");
    assert!((chord.length() - 10.0 * 2f64.sqrt()).abs() < 1e-12, "{chord:?}");
    let tetrahedron = shape("kind = 'tetrahedron'\npoints_mm = [[0,0,0],[30,0,0],[0,30,0],[0,0,30]]");
    let chord = tetrahedron.chord(&along([-5.0, -5.0, -5.0], DVec3::ONE)).expect("a chord");
    assert!((chord.length() - 10.0 * 3f64.sqrt()).abs() < 1e-12, "{chord:?}");
    assert_eq!(tetrahedron.chord(&along([20.0, 20.0, 0.0], DVec3::Z)), None);
}

#[test]
fn caps_are_flat_and_symmetry_planes_hold_vertices_bit_for_bit() {
    let trunk = shape(
        "kind = 'elliptic-cylinder'\nhalf_axes_mm = [200, 100]\nbottom_centre_mm = [0, 0, 0]\ntop_centre_mm = [0, 0, 700]\nmove_mm = [0, 0, 0.3]",
    );
    let mesh = trunk.tessellate().expect("a mesh");
    assert!(mesh.vertices.iter().all(|v| v.z == 0.3 || v.z == 700.0 + 0.3));
    let leg = |side: f64| {
        shape(&format!(
            "kind = 'elliptic-frustum'\nbottom_half_axes_mm = [20, 20]\ntop_half_axes_mm = [100, 100]\nbottom_centre_mm = [{}, 0, -800]\ntop_centre_mm = [{}, 0, 0]",
            20.0 * side,
            100.0 * side
        ))
        .tessellate()
        .expect("a mesh")
    };
    let (left, right) = (leg(1.0), leg(-1.0));
    assert!(left.vertices.iter().all(|v| v.x >= 0.0) && right.vertices.iter().all(|v| v.x <= 0.0));
    for ankle_or_hip in [DVec3::new(0.0, 0.0, -800.0), DVec3::ZERO] {
        assert!(left.vertices.contains(&ankle_or_hip) && right.vertices.contains(&ankle_or_hip));
    }
    let kidney = shape(
        "kind = 'ellipsoid'\ncentre_mm = [60, 60, 325]\nhalf_axes_mm = [45, 15, 55]\ncuts = [{ normal = [-1, 0, 0], offset_mm = -30 }]",
    );
    assert!(kidney.tessellate().expect("a mesh").vertices.iter().filter(|v| v.x == 30.0).count() > 20);
}

#[test]
fn cut_polyhedra_are_exact() {
    let corner = shape(
        "kind = 'box'\nmin_mm = [0, 0, 0]\nmax_mm = [10, 10, 10]\ncuts = [{ normal = [1, 1, 1], offset_mm = 5.773502691896258 }]",
    );
    // The plane x + y + z = 10 leaves a tetrahedron.
    assert!((corner.volume_mm3() - 1000.0 / 6.0).abs() < 1e-10);
    assert_eq!(corner.tessellate().expect("a mesh").faces.len(), 4);
    assert_eq!(corner.tessellation_depth_mm(), Ok(0.0));
}

#[test]
fn tubes_and_rods_are_closed_inscribed_and_have_their_volume() {
    let texts = [
        "kind = 'elliptic-tube'\nouter_half_axes_mm = [170, 98]\ninner_half_axes_mm = [165, 93]\nz_mm = [351, 365]",
        "kind = 'elliptic-tube'\nouter_centre_mm = [0, -30]\nouter_half_axes_mm = [120, 120]\ninner_centre_mm = [0, -38]\ninner_half_axes_mm = [113, 113]\nz_mm = [140, 220]\nsector_deg = [0, 180]",
        "kind = 'elliptic-tube'\nouter_centre_mm = [0, -30]\nouter_half_axes_mm = [120, 120]\ninner_centre_mm = [0, -38]\ninner_half_axes_mm = [113, 113]\nz_mm = [0, 140]\nsector_deg = [90, 180]\ncuts = [{ normal = [0, 1, 0], offset_mm = 50 }]",
        "kind = 'elliptic-tube'\nouter_half_axes_mm = [60, 40]\ninner_half_axes_mm = [50, 30]\nz_mm = [0, 20]\nrotate_deg = [30, 40, 50]\nmove_mm = [1, 2, 3]",
        "kind = 'torus-sector'\ncentre_mm = [0, 111, 682.5]\nring_radius_mm = 200\ntube_radius_mm = 7.883\nsector_deg = [-81.9, -41.8]",
    ];
    for text in texts {
        let tube = shape(&format!("{text}\nfaces = 1600"));
        assert!(!tube.is_convex_by_construction());
        let (mesh, depth) =
            (tube.tessellate().expect("a mesh"), tube.tessellation_depth_mm().expect("a depth"));
        assert_closed(&mesh);
        let faces = mesh.faces.len() as f64;
        assert!((faces / 1600.0 - 1.0).abs() <= 0.1, "{faces} faces: {text}");
        let lost = tube.volume_mm3() - mesh.signed_volume();
        assert!(
            (0.0..=1.05 * depth * mesh.area()).contains(&lost),
            "{lost} mm³ of {}: {text}",
            tube.volume_mm3()
        );
        let middle = |[a, b, c]: [DVec3; 3]| (a + b + c) / 3.0;
        for (i, triangle) in mesh.triangles().enumerate() {
            let normal = (triangle[1] - triangle[0]).cross(triangle[2] - triangle[0]).normalize();
            let within = middle(triangle) - 1e-6 * normal;
            assert!(tube.contains(within), "face {i} leaves the body: {text}");
        }
    }
}

#[test]
fn tube_volumes_agree_with_sampling() {
    let tube = shape(
        "kind = 'elliptic-tube'\nouter_centre_mm = [3, -30]\nouter_half_axes_mm = [120, 110]\ninner_centre_mm = [0, -38]\ninner_half_axes_mm = [90, 80]\nz_mm = [0, 140]\nsector_deg = [20, 190]\ncuts = [{ normal = [-1, 0.2, 0], offset_mm = 60 }, { normal = [0, 0, 1], offset_mm = 100 }]",
    );
    let mut rng = Pcg64::seed_from_u64(7);
    let samples = 400_000;
    let size = DVec3::new(260.0, 260.0, 100.0);
    let hits = (0..samples)
        .filter(|_| {
            let p = DVec3::new(-130.0, -160.0, 0.0)
                + size * DVec3::new(unit(&mut rng), unit(&mut rng), unit(&mut rng));
            tube.contains(p)
        })
        .count();
    let sampled = size.element_product() * hits as f64 / f64::from(samples);
    // Five standard deviations of the count.
    let allowed = 5.0 * size.element_product() * (hits as f64).sqrt() / f64::from(samples);
    assert!((tube.volume_mm3() - sampled).abs() < allowed, "{} {sampled}", tube.volume_mm3());
}

#[test]
fn closed_forms_of_whole_bodies() {
    let head = shape(
        "kind = 'capped-cylinder'\nhalf_axes_mm = [80, 100]\ncap_height_mm = 71.5\nbottom_centre_mm = [0, 0, 784]\ntop_centre_mm = [0, 0, 914.5]",
    );
    assert!((head.volume_mm3() - PI * 8000.0 * (130.5 + 2.0 / 3.0 * 71.5)).abs() < 1e-6);
    // A cut that takes nothing turns closed forms into quadrature.
    for whole in smooth_shapes().into_iter().filter(|s| s.cuts.is_empty()) {
        let mut cut = whole.clone();
        cut.cuts.push(Cut { normal: DVec3::new(0.6, 0.0, 0.8), offset: 1e4 });
        let (a, b) = (whole.volume_mm3(), cut.volume_mm3());
        assert!((a - b).abs() < 1e-9 * a, "{a} {b} {whole:?}");
    }
}

#[test]
fn wrong_shapes_are_refused_by_key() {
    let wrong = [
        ("kind = 'sphere'", "kind"),
        ("kind = 'ellipsoid'", "half_axes_mm"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2]", "half_axes_mm"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 0]", "half_axes_mm"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, nan]", "half_axes_mm"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, inf]", "half_axes_mm"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 3]\nradius_mm = 4", "radius_mm"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 3]\nfaces = 3", "faces"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 3]\nfaces = 1000000000", "faces"),
        ("kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 3]\naxes = [[1,0,0],[0,1,0],[0,0,2]]", "axes"),
        (
            "kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 3]\naxes = [[1,0,0],[0,1,0],[0,0,1]]\nrotate_deg = [0,0,1]",
            "axes",
        ),
        (
            "kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 3]\ncuts = [{ normal = [0,0,0], offset_mm = 1 }]",
            "cuts[0]",
        ),
        (
            "kind = 'ellipsoid'\nhalf_axes_mm = [1, 2, 3]\ncuts = [{ normal = [1,0,0], offset_mm = -9 }]",
            "cuts",
        ),
        ("kind = 'box'\nmin_mm = [0,0,0]\nmax_mm = [1,1,0]", "max_mm"),
        ("kind = 'box'\nmin_mm = [0,0,0]\nmax_mm = [1,1,1]\nfaces = 100", "faces"),
        ("kind = 'tetrahedron'\npoints_mm = [[0,0,0],[1,0,0],[0,1,0]]", "points_mm"),
        ("kind = 'hull'\npoints_mm = [[0,0,0],[1,0,0],[0,1,0],[1,1,0]]", "points_mm"),
        (
            "kind = 'elliptic-frustum'\nbottom_half_axes_mm = [1, 2]\ntop_half_axes_mm = [1, 1]\nbottom_centre_mm = [0,0,0]\ntop_centre_mm = [0,0,1]",
            "top_half_axes_mm",
        ),
        (
            "kind = 'elliptic-cylinder'\nhalf_axes_mm = [1, 2]\nbottom_centre_mm = [0,0,1]\ntop_centre_mm = [0,0,1]",
            "top_centre_mm",
        ),
        ("kind = 'rounded-frustum'\nradius_mm = 1\ntop_radius_mm = 2\nheight_mm = 3", "top_radius_mm"),
        (
            "kind = 'elliptic-tube'\nouter_half_axes_mm = [9, 9]\ninner_half_axes_mm = [10, 10]\nz_mm = [0, 1]",
            "inner_half_axes_mm",
        ),
        (
            "kind = 'elliptic-tube'\nouter_half_axes_mm = [9, 9]\ninner_half_axes_mm = [8, 8]\nz_mm = [0, 1]\nsector_deg = [0, 180]\ncuts = [{ normal = [0,1,0], offset_mm = 3 }]",
            "cuts",
        ),
        (
            "kind = 'elliptic-tube'\nouter_half_axes_mm = [9, 9]\ninner_half_axes_mm = [8, 8]\nz_mm = [0, 1]\ncuts = [{ normal = [0,1,1], offset_mm = 3 }]",
            "cuts",
        ),
        (
            "kind = 'torus-sector'\nring_radius_mm = 2\ntube_radius_mm = 3\nsector_deg = [0, 90]",
            "tube_radius_mm",
        ),
        (
            "kind = 'torus-sector'\nring_radius_mm = 20\ntube_radius_mm = 3\nsector_deg = [90, 0]",
            "sector_deg",
        ),
    ];
    for (text, key) in wrong {
        assert_eq!(problem(text).key, key, "{text}");
    }
    assert!(
        toml::from_str::<Shape>("kind = 'box'\nmin_mm = [0,0,0]\nmax_mm = [1,1,1]\ncolour = 'red'").is_err()
    );
}
