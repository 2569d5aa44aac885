mod optics;

use rand::{RngExt, SeedableRng};

use super::revolution::ARC_EXCESS;
use super::*;
use crate::geometry::UnitDir;
use glam::{DVec2, DVec3};

type Random = rand_pcg::Pcg64;

fn random(seed: u64) -> Random {
    Random::seed_from_u64(seed)
}

fn point(rng: &mut Random) -> DVec3 {
    DVec3::from([0; 3].map(|_| rng.random_range(-1.0..1.0)))
}

fn ray(from: DVec3, to: DVec3) -> Ray<f64> {
    Ray { origin: Vec3::of(from), dir: Vec3::of(UnitDir::new(to - from).expect("a direction").get()) }
}

/// A sheet over a 4 × 4 lattice of patches with waves, C², one class.
fn sheet(seed: u64) -> Vec<BezierPatch> {
    let mut rng = random(seed);
    let lattice: Vec<Vec<DVec3>> = (0..7)
        .map(|i| {
            let row = |j| DVec3::new(f64::from(i) - 3.0, f64::from(j) - 3.0, rng.random_range(-0.6..0.6));
            (0..7).map(row).collect()
        })
        .collect();
    lattice_patches(&lattice)
}

fn shell(patches: &[BezierPatch]) -> Shell {
    Shell::new(patches.iter().map(|p| (p.clone(), 1)).collect()).expect("patches")
}

/// A unit sphere's profile by two quarter arcs.
fn sphere() -> Shell {
    let (a, k) = (DVec2::new, ARC);
    let profile = [
        [a(0.0, -1.0), a(k, -1.0), a(1.0, -k), a(1.0, 0.0)],
        [a(1.0, 0.0), a(1.0, k), a(k, 1.0), a(0.0, 1.0)],
    ];
    shell(&revolve(&profile))
}

fn ts(shell: &Shell, ray: &Ray<f64>) -> Vec<f64> {
    shell.hits(ray).iter().map(|hit| hit.t).collect()
}

fn assert_same_hits(a: &[f64], b: &[f64], what: &str) {
    assert_eq!(a.len(), b.len(), "{what}: {a:?} {b:?}");
    a.iter().zip(b).for_each(|(x, y)| assert!((x - y).abs() < 1e-9, "{what}: {a:?} {b:?}"));
}

#[test]
fn a_sphere_by_patches_is_the_sphere_within_the_arcs_excess() {
    let (patches, exact) = (sphere(), Sphere::new(DVec3::ZERO, 1.0).expect("a sphere"));
    let mut rng = random(1);
    let mut hits = 0;
    for _ in 0..20_000 {
        let ray = ray(3.0 * point(&mut rng), point(&mut rng));
        let (near, true_hit) = (patches.hit(&ray, Reach::whole()), exact.hit(&ray, Reach::whole()));
        if let (Some(near), Some(true_hit)) = (near, true_hit) {
            let place = near.place(&ray).get();
            // Both arcs of a product may exceed.
            assert!((-1e-9..2.1 * ARC_EXCESS).contains(&(place.length() - 1.0)), "{place}");
            assert!(near.normal.get().dot(place) > 1.0 - 2e-5, "normals are those of the sphere");
            let cosine = ray.dir.dot(true_hit.normal).abs();
            if near.enters == true_hit.enters && cosine > 0.2 {
                assert!((near.t - true_hit.t).abs() < 2.1 * ARC_EXCESS / cosine * 1.5);
            }
            hits += 1;
        }
    }
    assert!(hits > 8_000, "{hits}");
}

#[test]
fn closed_surfaces_are_left_as_often_as_entered_in_turn() {
    let (patches, mut rng) = (sphere(), random(2));
    for i in 0..5_000 {
        let target = match i % 4 {
            // Through the poles, along the seams, through the middle, anywhere.
            0 => DVec3::new(0.0, 0.0, if i % 8 == 0 { 1.0 } else { -1.0 }),
            1 => DVec3::new(0.0, rng.random_range(-1.0..1.0), 0.3),
            2 => DVec3::ZERO,
            _ => point(&mut rng),
        };
        let from = 4.0 * point(&mut rng).normalize();
        let ray = ray(from, target);
        let hits = patches.hits(&ray);
        assert_eq!(hits.len() % 2, 0, "{i}: {ray:?} {hits:?}");
        assert!(hits.iter().enumerate().all(|(k, hit)| hit.enters == (k % 2 == 0)), "{i}: {hits:?}");
    }
}

#[test]
fn no_ray_slips_through_a_shared_edge_or_corner() {
    let patches = sheet(3);
    let (surface, mut rng) = (shell(&patches), random(3));
    for i in 0..20_000 {
        let patch = &patches[rng.random_range(0..patches.len())];
        let along = rng.random_range(0.0..1.0);
        let (u, v) = match i % 5 {
            0 => (0.0, along),
            1 => (1.0, along),
            2 => (along, 0.0),
            3 => (along, 1.0),
            _ => (0.0, 1.0),
        };
        let target = patch.jet(u, v).point.get();
        // Edges of the whole sheet are no shared ones.
        if target.x.abs() > 1.999 || target.y.abs() > 1.999 {
            continue;
        }
        let from = target + DVec3::new(rng.random_range(-3.0..3.0), rng.random_range(-3.0..3.0), 5.0);
        let ray = ray(from, target);
        let far = (target - from).length();
        let hits = ts(&surface, &ray);
        assert!(hits.iter().any(|t| (t - far).abs() < 1e-9), "lost at {target}: {hits:?}, not {far}");
    }
}

#[test]
fn oblique_rays_hit_all_roots_that_brute_subdivision_finds() {
    let patches = sheet(4);
    let (surface, mut rng) = (shell(&patches), random(4));
    let mut several = 0;
    for _ in 0..200 {
        // Nearly level: through several waves.
        let from = DVec3::new(-4.0, rng.random_range(-1.5..1.5), rng.random_range(-0.3..0.3));
        let to = DVec3::new(4.0, rng.random_range(-1.5..1.5), rng.random_range(-0.3..0.3));
        let ray = ray(from, to);
        // Brute force steps over the border of the sheet.
        let is_within = |t: &f64| ray.at(*t).get().truncate().abs().max_element() < 1.99;
        let found: Vec<f64> = ts(&surface, &ray).into_iter().filter(is_within).collect();
        let expected: Vec<f64> = brute_roots(&patches, &ray).into_iter().filter(is_within).collect();
        several += u32::from(found.len() > 1);
        assert_same_hits(&found, &expected, "brute force");
    }
    assert!(several > 50, "{several}");
}

/// Roots by sign changes of the height over a graph z(x, y): the sheets of these tests are graphs over their lattice.
fn brute_roots(patches: &[BezierPatch], ray: &Ray<f64>) -> Vec<f64> {
    // On a lattice of equal steps, x is linear in u and y in v.
    let above = |t: f64| {
        let p = ray.at(t);
        patches.iter().find_map(|patch| {
            let (low, high) = (patch.net()[0][0], patch.net()[3][3]);
            let (u, v) = ((p.x - low.x) / (high.x - low.x), (p.y - low.y) / (high.y - low.y));
            ((0.0..=1.0).contains(&u) && (0.0..=1.0).contains(&v)).then(|| p.z - patch.jet(u, v).point.z)
        })
    };
    let mut roots = Vec::new();
    const STEPS: u32 = 4_000;
    let at = |i: u32| 10.0 * f64::from(i) / f64::from(STEPS);
    for i in 0..STEPS {
        let (mut a, mut b) = (at(i), at(i + 1));
        let (Some(fa), Some(fb)) = (above(a), above(b)) else { continue };
        if (fa < 0.0) == (fb < 0.0) {
            continue;
        }
        for _ in 0..60 {
            let middle = 0.5 * (a + b);
            match above(middle) {
                Some(f) if (f < 0.0) == (fa < 0.0) => a = middle,
                _ => b = middle,
            }
        }
        roots.push(0.5 * (a + b));
    }
    roots
}

#[test]
fn split_patches_have_the_hits_of_the_whole() {
    let patches = sheet(5);
    let (whole, mut rng) = (shell(&patches), random(5));
    let mut parts = patches;
    for across_u in [true, false, true] {
        parts = parts.iter().flat_map(|p| p.split(across_u, rng.random_range(0.2..0.8))).collect();
    }
    let parts = shell(&parts);
    for _ in 0..5_000 {
        let ray = ray(3.0 * point(&mut rng), 2.0 * point(&mut rng));
        assert_same_hits(&ts(&parts, &ray), &ts(&whole, &ray), "split");
    }
}

#[test]
fn affine_maps_of_surface_and_ray_keep_the_hits() {
    let patches = sheet(6);
    let (before, mut rng) = (shell(&patches), random(6));
    let turn = glam::DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -1.0).normalize(), 1.1);
    let map = |p: DVec3| 40.0 * (turn * p) + DVec3::new(300.0, -80.0, 1e3);
    let after = shell(&patches.iter().map(|p| p.map(map)).collect::<Vec<_>>());
    for _ in 0..5_000 {
        let (from, to) = (3.0 * point(&mut rng), 2.0 * point(&mut rng));
        let there: Vec<f64> = ts(&after, &ray(map(from), map(to))).iter().map(|t| t / 40.0).collect();
        assert_same_hits(&there, &ts(&before, &ray(from, to)), "mapped");
    }
}

#[test]
fn degree_elevation_keeps_the_surface() {
    let mut rng = random(7);
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let flat = vec![
        vec![corner(-1.0, -1.0, 0.2), corner(-1.0, 1.0, 0.2)],
        vec![corner(1.0, -1.0, -0.4), corner(1.0, 1.0, -0.4)],
    ];
    let plane = shell(&[BezierPatch::elevated(&flat).expect("a net")]);
    let normal = DVec3::new(0.3, 0.0, 1.0).normalize();
    for _ in 0..2_000 {
        let ray = ray(point(&mut rng) + 2.0 * DVec3::Z, 0.9 * point(&mut rng) - DVec3::Z);
        let t = (DVec3::new(0.0, 0.0, -0.1) - ray.origin.get()).dot(normal) / ray.dir.get().dot(normal);
        let is_inside = ray.at(t).get().truncate().abs().max_element() < 1.0;
        assert_same_hits(&ts(&plane, &ray), &if is_inside { vec![t] } else { vec![] }, "plane");
    }
    let curved: Vec<Vec<DVec3>> = (0..3)
        .map(|i| (0..2).map(|j| corner(f64::from(i), f64::from(j), f64::from(i * i % 3))).collect())
        .collect();
    let patch = BezierPatch::elevated(&curved).expect("a net");
    for _ in 0..100 {
        let (u, v) = (rng.random_range(0.0..1.0), rng.random_range(0.0..1.0));
        let row = |j: usize| {
            let (a, b) = (curved[0][j].lerp(curved[1][j], u), curved[1][j].lerp(curved[2][j], u));
            a.lerp(b, u)
        };
        assert!((patch.jet(u, v).point.get() - row(0).lerp(row(1), v)).length() < 1e-14);
    }
    assert!(BezierPatch::elevated(&[vec![DVec3::ZERO; 5], vec![DVec3::ZERO; 5]]).is_none());
}

#[test]
fn patches_of_a_lattice_join_with_equal_second_derivatives() {
    // Rows of 4 patches: neighbours along v share their borders.
    let patches = sheet(8);
    let second = |p: &BezierPatch, at_end: bool, i: usize| {
        let row = p.net()[i];
        if at_end { row[3] - 2.0 * row[2] + row[1] } else { row[0] - 2.0 * row[1] + row[2] }
    };
    for pair in patches.chunks(4).flat_map(|row| row.windows(2)) {
        for i in 0..4 {
            assert!((pair[0].net()[i][3] - pair[1].net()[i][0]).length() < 1e-14);
            assert!((second(&pair[0], true, i) - second(&pair[1], false, i)).length() < 1e-14);
        }
    }
}

#[test]
fn rays_that_graze_a_sphere_hit_twice_or_not_at_all() {
    let (patches, mut rng) = (sphere(), random(9));
    for i in 0..2_000 {
        // Tangents at the equator's height, where the surface is as far out as its arc; within 1e-3 … 1e-15 of it.
        let angle = rng.random_range(0.0..std::f64::consts::TAU);
        let outward = ray(DVec3::ZERO, DVec2::from_angle(angle).extend(0.0));
        let hit = patches.hit(&outward, Reach::whole()).expect("a hit");
        let (place, normal) = (hit.place(&outward).get().truncate(), hit.normal.get().truncate());
        let off = 10f64.powi(-(3 + i % 13)) * if i % 2 == 0 { 1.0 } else { -1.0 };
        let along = normal.perp();
        let start = place + off * normal - 3.0 * along;
        let grazing = ray(start.extend(0.0), (start + along).extend(0.0));
        let hits = patches.hits(&grazing);
        // Nearer than this, rounding decides for each of the two.
        assert!(hits.len() % 2 == 0 || off.abs() < 1e-11, "{off}: {hits:?}");
        assert!(hits.len() == 2 || off > -1e-11, "{off}: {hits:?}");
        assert!(hits.is_empty() || off < 1e-11, "{off}: {hits:?}");
    }
}

#[test]
fn rays_that_leave_a_place_do_not_hit_it_again() {
    let (ball, mut rng) = (sphere(), random(13));
    let (mut outward, mut inward, mut again) = (0, 0, 0);
    for _ in 0..20_000 {
        let first = ray(3.0 * point(&mut rng), point(&mut rng));
        let Some(hit) = ball.hit(&first, Reach::whole()) else { continue };
        let origin = hit.place(&first);
        // Towards a pole pieces are not as flat as elsewhere, and oblique rays leave them by the gap alone.
        if origin.z.abs() > 0.8 {
            continue;
        }
        let on = ray(origin.get(), origin.get() + point(&mut rng));
        let cosine = on.dir.dot(hit.normal);
        // No gap is kept: rounding puts half of the places beneath the surface.
        let left = Reach { left: hit.part, ..Reach::whole() };
        if cosine > 0.5 {
            assert_eq!(ball.hit(&on, left).map(|h| h.t), None, "{on:?}");
            again += usize::from(ball.hit(&on, Reach::whole()).is_some());
            outward += 1;
        } else if cosine < -0.5 {
            let far = ball.hit(&on, left).expect("the other side").t;
            assert!((far + 2.0 * cosine).abs() < 30.0 * ARC_EXCESS, "{far} against {}", -2.0 * cosine);
            inward += 1;
        }
    }
    assert!(outward.min(inward) > 1_000 && again > 100, "{outward}, {inward}, {again}");
}

#[test]
fn boxes_discs_and_meshes_agree_where_they_are_the_same_surface() {
    let block = Block::new(DVec3::splat(-0.5), DVec3::splat(0.5)).expect("a box");
    let mesh = SmoothMesh::new(crate::geometry::primitives::cube(1.0)).expect("a mesh");
    let top = Disc::new(DVec3::new(0.0, 0.0, 0.5), DVec3::Z, 0.5).expect("a disc");
    let mut rng = random(10);
    let mut hits = 0;
    for i in 0..5_000 {
        let from = 2.0 * point(&mut rng);
        // Every other ray at an edge or a corner.
        let to = if i % 2 == 0 {
            point(&mut rng)
        } else {
            (0.8 * point(&mut rng)).clamp(DVec3::splat(-0.5), DVec3::splat(0.5))
        };
        let ray = ray(from, to);
        for crossing in [Crossing::Entering, Crossing::Leaving] {
            let reach = Reach::whole().only(crossing);
            let (a, b) = (block.hit(&ray, reach), mesh.hit(&ray, reach));
            // At an edge, rounding decides for each alone.
            let is_grazing = |h: &Hit<f64>| {
                let p = h.place(&ray).get().abs();
                p.x + p.y + p.z - p.max_element() > 0.0
                    && (p.max_element() - 0.5).abs() < 1e-9
                    && p.to_array().iter().filter(|x| (**x - 0.5).abs() < 1e-9).count() > 1
            };
            match (a, b) {
                (Some(a), Some(b)) => {
                    assert!((a.t - b.t).abs() < 1e-12);
                    hits += 1;
                }
                (None, None) => {}
                (a, b) => assert!(a.or(b).is_some_and(|h| is_grazing(&h)), "{a:?} {b:?}"),
            }
        }
        if let Some(hit) = top.hit(&ray, Reach::whole()) {
            let on_block =
                block.hit(&ray, Reach { from: hit.t - 1e-9, ..Reach::whole() }).expect("the box's top");
            assert!((on_block.t - hit.t).abs() < 1e-12 && on_block.class == 5);
        }
    }
    assert!(hits > 2_000, "{hits}");
}
