//! The paper's scenes (§3.1), made from seeds: the same on every machine.

use glam::{DVec2, DVec3};
use rand_pcg::Pcg64;
use rand_pcg::rand_core::{Rng, SeedableRng};

use super::{Camera, Glass, Light, Material, Noise, Object, Recipe, Sky, World, schema};
use crate::error::{Error, Result};
use crate::geometry::Bounds;
use crate::surface::{BezierPatch, Shell, Surface, lattice_patches, revolve, spline_curves};

/// Uniform numbers of one seed.
struct Dice(Pcg64);

impl Dice {
    fn new(seed: u64) -> Self {
        Self(Pcg64::seed_from_u64(seed))
    }

    /// Uniform in [low, high).
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * ((self.0.next_u64() >> 11) as f64 / (1u64 << 53) as f64)
    }

    /// One of 0 … n − 1.
    fn below(&mut self, n: usize) -> usize {
        (self.between(0.0, n as f64) as usize).min(n - 1)
    }
}

/// *Bezier surface*: a reflective C² sheet of 100 patches within a textured sphere, from three viewpoints.
pub fn bezier_surface(seed: u64) -> World {
    let patches = sheet(DVec3::ZERO, [200.0, 200.0], [10, 10], 9.0, 0.0, seed);
    let shell = Shell::new(patches.into_iter().map(|p| (p, 1)).collect());
    let material = Material {
        colour: DVec3::splat(0.5),
        ambient: 0.1,
        diffuse: 0.1,
        specular: 0.4,
        shininess: 60.0,
        mirror: 0.85,
        clear: 0.0,
        glass: None,
    };
    let objects = shell
        .map(|shell| Object {
            name: "surface".into(),
            surface: Surface::Shell(shell),
            is_convex: false,
            grows: true,
            material,
        })
        .into_iter()
        .collect();
    let eyes =
        [DVec3::new(0.0, -260.0, 240.0), DVec3::new(-250.0, -90.0, 200.0), DVec3::new(210.0, 150.0, 260.0)];
    World { objects, ..surroundings("bezier-surface", seed, &eyes, DVec3::ZERO, 42.0) }
}

/// *Random volumes*: a region cut at random into cells, in each a convex refracting body of revolution.
///
/// # Errors
/// No volumes, or more than 200.
pub fn random_volumes(recipe: Recipe) -> Result<World> {
    if !(1..=200).contains(&recipe.count) {
        return Err(Error::input(
            "--count",
            format!("{} volumes do not serve", recipe.count),
            "give 1 to 200",
        ));
    }
    let mut dice = Dice::new(recipe.seed);
    let region = Bounds { min: DVec3::splat(-100.0), max: DVec3::splat(100.0) };
    let mut objects = Vec::with_capacity(recipe.count);
    for (index, cell) in cells(region, recipe.count, &mut dice).into_iter().enumerate() {
        let surface = volume(cell, &mut dice).ok_or_else(|| {
            Error::input(
                "random-volumes",
                "a generated volume has no surface",
                "give another --seed, and report this one",
            )
        })?;
        let tint = DVec3::new(dice.between(0.3, 1.0), dice.between(0.3, 1.0), dice.between(0.3, 1.0));
        let material = Material {
            colour: tint,
            ambient: 0.1,
            diffuse: 0.15,
            specular: 0.5,
            shininess: 80.0,
            mirror: 0.0,
            clear: 0.0,
            glass: Some(Glass { index: dice.between(1.1, 1.5), share: 0.85 }),
        };
        objects.push(Object {
            name: format!("volume {}", index + 1),
            surface: Surface::Shell(surface),
            is_convex: true,
            grows: true,
            material,
        });
    }
    let eyes = [DVec3::new(120.0, -420.0, 160.0)];
    Ok(World { objects, ..surroundings("random-volumes", recipe.seed, &eyes, DVec3::ZERO, 40.0) })
}

/// Lights, a sky and cameras around a scene of some 200 mm.
fn surroundings(name: &str, seed: u64, eyes: &[DVec3], target: DVec3, width_deg: f64) -> World {
    World {
        name: name.into(),
        objects: Vec::new(),
        lights: vec![
            Light { position: DVec3::new(-300.0, -400.0, 700.0), colour: DVec3::splat(0.8) },
            Light { position: DVec3::new(500.0, -100.0, 500.0), colour: DVec3::new(0.5, 0.45, 0.4) },
        ],
        ambient: DVec3::splat(0.5),
        sky: Sky {
            centre: DVec3::ZERO,
            radius: 2000.0,
            colours: [DVec3::new(0.05, 0.12, 0.35), DVec3::new(0.9, 0.85, 0.7)],
            frequency: 3.0,
            noise: Noise::new(seed),
        },
        cameras: eyes.iter().filter_map(|&eye| Camera::new(eye, target, DVec3::Z, width_deg)).collect(),
        most_turns: schema::most_turns(),
        most_inner_turns: schema::most_inner_turns(),
    }
}

/// A C² sheet of Bezier patches over a rectangle about `centre`, with seeded waves up to `height` either way and, if `dome` is
/// not 0, falling by that much from the middle to the corners.
pub fn sheet(
    centre: DVec3,
    size: [f64; 2],
    patches: [usize; 2],
    height: f64,
    dome: f64,
    seed: u64,
) -> Vec<BezierPatch> {
    let mut dice = Dice::new(seed);
    let share = |i: usize, n: usize| (i as f64 - 1.0) / n as f64 - 0.5;
    let lattice: Vec<Vec<DVec3>> = (0..patches[0] + 3)
        .map(|i| {
            let row = |j: usize| {
                let (x, y) = (share(i, patches[0]), share(j, patches[1]));
                let z = dice.between(-height, height) - 2.0 * dome * (x * x + y * y);
                centre + DVec3::new(x * size[0], y * size[1], z)
            };
            (0..patches[1] + 3).map(row).collect()
        })
        .collect();
    lattice_patches(&lattice)
}

/// Cuts a box into `count` by planes across random axes at random places.
fn cells(region: Bounds, count: usize, dice: &mut Dice) -> Vec<Bounds> {
    if count == 1 {
        return vec![region];
    }
    // Long cells are cut across, so that bodies in them are no needles.
    let size = region.size();
    let longest = size.max_element();
    let axes: Vec<usize> = (0..3).filter(|&a| size[a] > 0.6 * longest).collect();
    let axis = axes[dice.below(axes.len())];
    let below = (count / 2 + dice.below(count % 2 + 1)).clamp(1, count - 1);
    let share = (below as f64 / count as f64 + dice.between(-0.1, 0.1)).clamp(0.2, 0.8);
    let (mut lower, mut upper) = (region, region);
    lower.max[axis] = region.min[axis] + share * size[axis];
    upper.min[axis] = lower.max[axis];
    let mut all = cells(lower, below, dice);
    all.extend(cells(upper, count - below, dice));
    all
}

/// A convex body of revolution about a random axis, in the cell with some room to spare.
fn volume(cell: Bounds, dice: &mut Dice) -> Option<Shell> {
    const FILL: f64 = 0.92;
    let axis = dice.below(3);
    let half = 0.5 * FILL * cell.size();
    let radius = half[(axis + 1) % 3].min(half[(axis + 2) % 3]);
    let curves = 5 + dice.below(12);
    let (patches, _) =
        body_of_revolution(&convex_polyline(curves, radius, half[axis].min(1.6 * radius), dice))?;
    // z becomes the axis; a cyclic change of coordinates keeps normals outward.
    let place = |v: DVec3| {
        let mut p = DVec3::ZERO;
        p[axis] = v.z;
        p[(axis + 1) % 3] = v.x;
        p[(axis + 2) % 3] = v.y;
        cell.centre() + p
    };
    Shell::new(patches.iter().map(|p| (p.map(place), 1)).collect())
}

/// A random convex polyline from axis to axis within a radius and a height either way: places on a superellipse.
fn convex_polyline(curves: usize, radius: f64, height: f64, dice: &mut Dice) -> Vec<DVec2> {
    let exponent = 2.0 / dice.between(1.7, 3.5);
    let step = std::f64::consts::PI / curves as f64;
    let angle = |i: usize, shift: f64| -std::f64::consts::FRAC_PI_2 + step * (i as f64 + shift);
    let place = |angle: f64| {
        let (sin, cos) = angle.sin_cos();
        let power = |x: f64| x.signum() * x.abs().powf(exponent);
        DVec2::new(radius * power(cos).max(0.0), height * power(sin))
    };
    let mut points = vec![DVec2::new(0.0, -height)];
    points.extend((1..curves).map(|i| place(angle(i, dice.between(-0.35, 0.35)))));
    points.push(DVec2::new(0.0, height));
    points
}

/// The patches of the body whose profile is the uniform cubic B-spline over points (radius, height) from axis to axis,
/// 4 for each of its curves; C² across them all, the axis included. Also whether it is convex. `None` unless there are 3
/// points or more, finite, the first and the last on the axis and the others beside it.
pub fn body_of_revolution(points: &[DVec2]) -> Option<(Vec<BezierPatch>, bool)> {
    let (first, last) = (points.first()?, points.last()?);
    let inner = points.get(1..points.len() - 1)?;
    let is_beside = |p: &DVec2| p.is_finite() && p.x > 0.0;
    if first.x != 0.0 || last.x != 0.0 || inner.is_empty() || !inner.iter().all(is_beside) {
        return None;
    }
    let mirrored = |p: &DVec2| DVec2::new(-p.x, p.y);
    let mut polygon = vec![mirrored(&inner[0])];
    polygon.extend(points);
    polygon.push(mirrored(&inner[inner.len() - 1]));
    let turns: Vec<f64> = polygon.windows(3).map(|w| (w[1] - w[0]).perp_dot(w[2] - w[1])).collect();
    let is_convex = turns.iter().all(|t| *t >= 0.0);
    let flat = |p: &DVec2| DVec3::new(p.x, p.y, 0.0);
    let curves = spline_curves(&polygon.iter().map(flat).collect::<Vec<_>>());
    let mut profile: Vec<[DVec2; 4]> = curves.iter().map(|curve| curve.map(DVec3::truncate)).collect();
    // On the axis exactly, whatever rounding says.
    if let Some(start) = profile.first_mut() {
        start[0].x = 0.0;
    }
    if let Some(end) = profile.last_mut() {
        end[3].x = 0.0;
    }
    Some((revolve(&profile), is_convex))
}
