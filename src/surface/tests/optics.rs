//! Light at surfaces, against the laws it obeys.

use super::super::optics::{Optics, follow, reflectance, reflected, refracted};
use super::*;

const LIMIT: u32 = 8;

/// The way of a ray through a surface that it hits.
fn way(surface: &Surface, ray: &Ray<f64>, optics: Optics) -> super::super::optics::Path<f64> {
    let hit = surface.hit(ray, Reach::whole()).expect("a hit");
    follow(surface, ray, hit, optics, LIMIT)
}

fn unit(rng: &mut Random) -> Vec3<f64> {
    Vec3::of(point(rng).normalize())
}

#[test]
fn refracted_rays_obey_snell_in_the_plane_of_incidence_and_are_reversible() {
    let mut rng = random(20);
    for _ in 0..2_000 {
        let (normal, dir) = (unit(&mut rng), unit(&mut rng));
        let normal = if normal.dot(dir) > 0.0 { -normal } else { normal };
        let ratio = rng.random_range(0.4..2.5);
        let sine = dir.cross(normal).length();
        let Some(behind) = refracted(dir, normal, ratio) else {
            assert!(ratio * sine > 1.0 - 1e-12, "{ratio} {sine}");
            continue;
        };
        assert!((behind.cross(normal).length() - ratio * sine).abs() < 1e-12, "Snell");
        assert!(dir.cross(normal).dot(behind).abs() < 1e-12, "coplanar");
        let back = refracted(-behind, -normal, 1.0 / ratio).expect("the way back");
        // Near the critical angle the way back is as steep as the root's slope there.
        let steep = (1.0 - (ratio * sine).powi(2)).sqrt().max(1e-6);
        assert!((back + dir).length() < 1e-12 / steep, "reversed");
        let mirrored = reflected(dir, normal);
        assert!((mirrored.dot(normal) + dir.dot(normal)).abs() < 1e-14);
        assert!((reflected(-mirrored, normal) + dir).length() < 1e-14);
    }
}

#[test]
fn what_is_reflected_and_what_is_transmitted_are_all() {
    // Transmittance by amplitudes (Born & Wolf, §1.5.2): T = (n₂ cos θ₂ / n₁ cos θ₁) |t|².
    for ratio in [1.0 / 1.5, 0.9, 1.0, 1.2, 1.5] {
        for i in 1..100 {
            let cosine = f64::from(i) / 100.0;
            let squared: f64 = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
            let share = reflectance(cosine, ratio);
            if squared <= 0.0 {
                assert_eq!(share, 1.0);
                continue;
            }
            let behind = squared.sqrt();
            let across = 2.0 * ratio * cosine / (ratio * cosine + behind);
            let along = 2.0 * ratio * cosine / (cosine + ratio * behind);
            let transmitted = behind / (ratio * cosine) * 0.5 * (across * across + along * along);
            assert!((share + transmitted - 1.0).abs() < 1e-12, "{ratio} {cosine}: {share} {transmitted}");
        }
    }
    assert!((reflectance(1.0, 1.0 / 1.5) - 0.04_f64).abs() < 1e-12, "glass, straight on: 4 %");
}

#[test]
fn beyond_the_critical_angle_all_is_reflected() {
    let (ratio, normal) = (1.5, Vec3::new(0.0, 0.0, 1.0));
    let critical = (1.0_f64 / 1.5).asin();
    let at = |angle: f64| refracted(Vec3::new(angle.sin(), 0.0, -angle.cos()), normal, ratio);
    assert!(at(critical - 1e-9).is_some() && at(critical + 1e-9).is_none());
}

#[test]
fn a_slab_shifts_rays_by_the_closed_form_and_turns_none() {
    let (thickness, index) = (10.0, 1.5);
    let slab = Block::new(DVec3::new(-1e3, -1e3, 0.0), DVec3::new(1e3, 1e3, thickness)).expect("a box");
    let slab = Surface::Block(slab);
    for degrees in [0.0, 10.0, 35.0, 60.0, 80.0_f64] {
        let angle = degrees.to_radians();
        let dir = DVec3::new(angle.sin(), 0.0, -angle.cos());
        let ray = ray(DVec3::new(0.0, 3.0, thickness) - 50.0 * dir, DVec3::new(0.0, 3.0, thickness));
        let path = way(&slab, &ray, Optics::Glass { index });
        let exit = path.exit.expect("an exit");
        assert_eq!(path.turns, 2);
        assert!((exit.dir - ray.dir).length() < 1e-14, "parallel");
        let shift = (exit.origin - ray.origin).cross(ray.dir).length();
        // d·sin θ·(1 − cos θ / √(n² − sin² θ)).
        let sine = angle.sin();
        let expected = thickness * sine * (1.0 - angle.cos() / (index * index - sine * sine).sqrt());
        assert!((shift - expected).abs() < 1e-12, "{degrees}: {shift}, not {expected}");
    }
}

/// A glass prism of this apex angle, its refracting edge along y at the top.
fn prism(apex: f64) -> Surface {
    let (half, height) = (0.5 * apex, 10.0);
    let x = height * half.tan();
    let corner = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let ring = |y: f64| [corner(-x, y, -height), corner(x, y, -height), corner(0.0, y, 0.0)];
    let [a, b, c] = ring(-50.0);
    let [d, e, f] = ring(50.0);
    let flat = |p: DVec3, q: DVec3, r: DVec3, s: DVec3| BezierPatch::elevated(&[vec![p, q], vec![r, s]]);
    // Normals S_u × S_v point outwards.
    let faces = [flat(a, d, c, f), flat(c, f, b, e), flat(b, e, a, d), flat(a, c, b, c), flat(d, e, f, e)];
    let patches = faces.into_iter().flatten().zip(1..).collect();
    Surface::Shell(Shell::new(patches).expect("patches"))
}

#[test]
fn a_prism_turns_rays_least_when_they_pass_it_symmetrically() {
    let (apex, index) = (60f64.to_radians(), 1.5);
    let surface = prism(apex);
    let deviation = |incidence: f64| {
        // Onto the left face, whose outward normal points left and up.
        let normal = DVec3::new(-(0.5 * apex).cos(), 0.0, (0.5 * apex).sin());
        let tangent = DVec3::new((0.5 * apex).sin(), 0.0, (0.5 * apex).cos());
        let place = DVec3::new(-5.0 * (0.5 * apex).tan(), 0.0, -5.0);
        // From below the normal, so that it is bent towards the base.
        let dir = -normal * incidence.cos() + tangent * incidence.sin();
        let ray = ray(place - 20.0 * dir, place);
        let path = way(&surface, &ray, Optics::Glass { index });
        (path.turns == 2).then(|| path.exit.expect("an exit").dir.dot(ray.dir).clamp(-1.0, 1.0).acos())
    };
    let symmetric = (index * (0.5 * apex).sin()).asin();
    let least = 2.0 * symmetric - apex;
    let at_least = deviation(symmetric).expect("through two faces");
    assert!((at_least - least).abs() < 1e-7, "{at_least}, not {least}");
    for off in [-0.15, -0.05, 0.05, 0.15] {
        let other = deviation(symmetric + off).expect("through two faces");
        assert!(other > least + 1e-5, "{off}: {other}");
    }
}

#[test]
fn a_corner_of_three_mirrors_sends_rays_back_where_they_came_from() {
    let o = DVec3::ZERO;
    let face = |a: DVec3, b: DVec3| {
        BezierPatch::elevated(&[vec![o, 10.0 * a], vec![10.0 * b, 10.0 * (a + b)]]).expect("a net")
    };
    let faces = [face(DVec3::X, DVec3::Y), face(DVec3::Y, DVec3::Z), face(DVec3::Z, DVec3::X)];
    let corner = Surface::Shell(Shell::new(faces.into_iter().zip(1..).collect()).expect("patches"));
    let mut rng = random(21);
    let mut thrice = 0;
    for _ in 0..500 {
        let from = 8.0 + point(&mut rng);
        let to = 2.0 + point(&mut rng) * 1.5;
        let ray = ray(from, to - 0.3 * from);
        if corner.hit(&ray, Reach::whole()).is_none() {
            continue;
        }
        let path = way(&corner, &ray, Optics::Mirror);
        if path.turns == 3 {
            thrice += 1;
            assert!((path.exit.expect("an exit").dir + ray.dir).length() < 1e-13);
        }
    }
    assert!(thrice > 100, "{thrice}");
}

#[test]
fn ways_through_a_glass_body_are_the_same_from_either_end() {
    let (surface, mut rng) = (Surface::Shell(sphere()), random(22));
    let optics = Optics::Glass { index: 1.4 };
    let mut compared = 0;
    for _ in 0..2_000 {
        let ray = ray(3.0 * point(&mut rng).normalize(), 0.5 * point(&mut rng));
        let path = way(&surface, &ray, optics);
        let Some(exit) = path.exit else { continue };
        if path.turns != 2 {
            continue;
        }
        let back = Ray { origin: exit.at(5.0), dir: -exit.dir };
        let returned = way(&surface, &back, optics).exit.expect("an exit");
        assert!((returned.dir + ray.dir).length() < 1e-7, "{:?}", returned.dir + ray.dir);
        assert!((returned.origin - path.hit.place(&ray)).length() < 1e-7);
        compared += 1;
    }
    assert!(compared > 1_500, "{compared}");
}
