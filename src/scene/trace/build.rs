//! From a scene file to a world, or all that is wrong with it.

use glam::{DVec2, DVec3};

use super::generate::{body_of_revolution, sheet};
use super::schema::{CameraSpec, LightSpec, MaterialSpec, ObjectSpec, ShapeSpec, WorldSpec};
use super::{Camera, Glass, Light, Material, Noise, Object, Sky, World};
use crate::error::{Error, Result};
use crate::physics::composite::parse_colour;
use crate::scene::folder::Folder;
use crate::scene::mesh_file::{self, ReadOptions};
use crate::scene::text::{SceneText, Step};
use crate::surface::{BezierPatch, Block, Disc, Shell, SmoothMesh, Sphere, Surface};

/// Each object keeps what each light sees of it.
const MOST_LIGHTS: usize = 8;
/// All objects are held against each ray that curved ones have turned.
const MOST_OBJECTS: usize = 1_000;

/// The world that `text` describes, with mesh files from `folder`.
pub fn world(text: &SceneText, folder: &Folder) -> Result<World> {
    let spec: WorldSpec = text.parse()?;
    let mut errors = Vec::new();
    let mut note =
        |path: &[Step], problem: &str, remedy: &str| errors.push(text.error(path, problem, "here", remedy));
    if spec.lights.len() > MOST_LIGHTS {
        note(&[Step::Key("lights")], "there are too many lights", "give at most 8");
    }
    if !(1..=MOST_OBJECTS).contains(&spec.object.len()) {
        note(
            &[Step::Key("object")],
            "there are no objects, or too many",
            "give 1 to 1000 tables `[[object]]`",
        );
    }
    if spec.cameras.is_empty() {
        note(&[Step::Key("cameras")], "there is no camera", "give one: cameras = [{ eye = …, target = … }]");
    }
    let cameras: Vec<Camera> = spec.cameras.iter().filter_map(camera).collect();
    if let Some(i) = spec.cameras.iter().position(|c| camera(c).is_none()) {
        note(
            &[Step::Key("cameras"), Step::Index(i)],
            "the camera defines no picture",
            "give an eye apart from its target, an `up` that does not point there, and a width between 0° and 180°",
        );
    }
    let mut lights = Vec::new();
    for (i, spec) in spec.lights.iter().enumerate() {
        match light(spec) {
            Ok(light) => lights.push(light),
            Err((problem, remedy)) => note(&[Step::Key("lights"), Step::Index(i)], &problem, &remedy),
        }
    }
    let mut colour_at = |path: &[Step], value: &str| {
        colour(value).unwrap_or_else(|(problem, remedy)| {
            note(path, &problem, &remedy);
            DVec3::ZERO
        })
    };
    let ambient = colour_at(&[Step::Key("ambient")], spec.ambient.as_deref().unwrap_or("#404040"));
    let sky_path = [Step::Key("sky"), Step::Key("colours")];
    let colours = [0, 1].map(|i| colour_at(&sky_path, &spec.sky.colours[i]));
    let sky = Sky {
        centre: DVec3::from(spec.sky.centre),
        radius: spec.sky.radius,
        colours,
        frequency: spec.sky.waves,
        noise: Noise::new(spec.sky.seed),
    };
    if !(sky.centre.is_finite() && sky.radius.is_finite() && sky.radius > 0.0 && sky.frequency.is_finite()) {
        note(&[Step::Key("sky")], "the sky is no sphere", "give a finite centre and a positive radius");
    }
    let mut objects: Vec<Object> = Vec::new();
    for (i, spec) in spec.object.iter().enumerate() {
        match object(spec, folder) {
            Ok(object) => objects.push(object),
            Err((key, problem, remedy)) => {
                let path = [Step::Key("object"), Step::Index(i), Step::Key(key)];
                note(&path, &format!("object `{}`: {problem}", spec.name), &remedy);
            }
        }
    }
    let outside = |p: DVec3| (p - sky.centre).length() > sky.radius;
    for (i, object) in objects.iter().enumerate() {
        if errors.is_empty() && object.surface.bounds().corners().into_iter().all(outside) {
            let path = [Step::Key("object"), Step::Index(i)];
            errors.push(text.error(
                &path,
                "the object lies outside the sky",
                "here",
                "give the sky a larger radius",
            ));
        }
    }
    if !errors.is_empty() {
        return Err(Error::several(errors));
    }
    Ok(World {
        name: spec.name.unwrap_or_else(|| "scene".into()),
        objects,
        lights,
        ambient,
        sky,
        cameras,
        most_turns: spec.most_turns,
        most_inner_turns: spec.most_inner_turns.clamp(1, 255),
    })
}

type Words = (String, String);

fn colour(text: &str) -> Result<DVec3, Words> {
    parse_colour(text).map(|[r, g, b]| DVec3::new(r.into(), g.into(), b.into())).map_err(Error::into_words)
}

fn camera(spec: &CameraSpec) -> Option<Camera> {
    Camera::new(DVec3::from(spec.eye), DVec3::from(spec.target), DVec3::from(spec.up), spec.width_deg)
}

fn light(spec: &LightSpec) -> Result<Light, Words> {
    let position = DVec3::from(spec.position);
    if !(position.is_finite() && spec.strength.is_finite() && spec.strength >= 0.0) {
        return Err((
            "the light is nowhere".into(),
            "give a finite position and a strength of 0 or more".into(),
        ));
    }
    Ok(Light { position, colour: colour(spec.colour.as_deref().unwrap_or("#ffffff"))? * spec.strength })
}

type Located = (&'static str, String, String);

fn object(spec: &ObjectSpec, folder: &Folder) -> Result<Object, Located> {
    let material = material(&spec.material).map_err(|(problem, remedy)| ("material", problem, remedy))?;
    let (surface, is_convex) =
        shape(&spec.shape, folder).map_err(|(problem, remedy)| ("shape", problem, remedy))?;
    let is_closed = !matches!(
        spec.shape,
        ShapeSpec::Disc { .. } | ShapeSpec::Sheet { .. } | ShapeSpec::Patches { .. } | ShapeSpec::Mesh { .. }
    );
    if material.glass.is_some() && !is_closed {
        return Err((
            "material",
            "only closed smooth bodies refract".into(),
            "give it `clear` instead of `glass`, or another shape".into(),
        ));
    }
    Ok(Object { name: spec.name.clone(), surface, is_convex, grows: spec.tree, material })
}

fn material(spec: &MaterialSpec) -> Result<Material, Words> {
    let shares = [spec.ambient, spec.diffuse, spec.specular, spec.mirror, spec.clear];
    let glass = spec.glass.as_ref().map(|g| Glass { index: g.index, share: g.share });
    let is_share = |x: &f64| (0.0..=1.0).contains(x);
    if !shares.iter().chain(glass.as_ref().map(|g| &g.share)).all(is_share) {
        return Err(("a share is not one".into(), "give shares from 0 to 1".into()));
    }
    if glass.is_some_and(|g| !(0.1..=10.0).contains(&g.index)) || !(0.0..=1e6).contains(&spec.shininess) {
        return Err((
            "an index or an exponent does not serve".into(),
            "give a refractive index from 0.1 to 10 and a shininess from 0 to 1e6".into(),
        ));
    }
    Ok(Material {
        colour: colour(&spec.colour)?,
        ambient: spec.ambient,
        diffuse: spec.diffuse,
        specular: spec.specular,
        shininess: spec.shininess,
        mirror: spec.mirror,
        clear: spec.clear,
        glass,
    })
}

/// The surface, and whether it is convex.
fn shape(spec: &ShapeSpec, folder: &Folder) -> Result<(Surface, bool), Words> {
    let refused = |problem: &str, remedy: &str| (problem.to_owned(), remedy.to_owned());
    let no_surface = || refused("the numbers make no surface", "give finite places and positive sizes");
    match spec {
        ShapeSpec::Sphere { centre, radius } => {
            let sphere = Sphere::new(DVec3::from(*centre), *radius).ok_or_else(no_surface)?;
            Ok((Surface::Sphere(sphere), true))
        }
        ShapeSpec::Disc { centre, normal, radius } => {
            let disc =
                Disc::new(DVec3::from(*centre), DVec3::from(*normal), *radius).ok_or_else(no_surface)?;
            Ok((Surface::Disc(disc), true))
        }
        ShapeSpec::Block { low, high } => {
            let block = Block::new(DVec3::from(*low), DVec3::from(*high)).ok_or_else(no_surface)?;
            Ok((Surface::Block(block), true))
        }
        ShapeSpec::Revolution { at, profile } => {
            let profile: Vec<DVec2> = profile.iter().copied().map(DVec2::from).collect();
            let (patches, is_convex) = body_of_revolution(&profile).ok_or_else(|| {
                refused(
                    "the profile makes no body",
                    "give 3 or more points (radius, height), the first and the last on the axis, the others beside it",
                )
            })?;
            let moved = patches.iter().map(|p| (p.map(|v| v + DVec3::from(*at)), 1)).collect();
            Ok((Surface::Shell(Shell::new(moved).ok_or_else(no_surface)?), is_convex))
        }
        ShapeSpec::Sheet { centre, size, patches, height, dome, seed } => {
            if !patches.iter().all(|n| (1..=100).contains(n)) {
                return Err(refused(
                    "so many patches make no sheet",
                    "give 1 to 100 patches along each side",
                ));
            }
            let patches = sheet(DVec3::from(*centre), *size, *patches, *height, *dome, *seed);
            let shell = Shell::new(patches.into_iter().map(|p| (p, 1)).collect()).ok_or_else(no_surface)?;
            Ok((Surface::Shell(shell), false))
        }
        ShapeSpec::Patches { nets } => {
            let patch = |net: &[[f64; 3]; 16]| {
                BezierPatch::new(std::array::from_fn(|i| {
                    std::array::from_fn(|j| DVec3::from(net[4 * i + j]))
                }))
            };
            // Nothing is known of how they join: each is a class of its own.
            let patches = nets.iter().zip(1..).map(|(net, class)| (patch(net), class)).collect();
            Ok((Surface::Shell(Shell::new(patches).ok_or_else(no_surface)?), false))
        }
        ShapeSpec::Mesh { file, at, scale } => {
            let path = folder.resolve(file).map_err(Error::into_words)?;
            let read = mesh_file::read(&path, &ReadOptions::default()).map_err(Error::into_words)?;
            let mesh = read.mesh.map_vertices(|v| *scale * v + DVec3::from(*at));
            Ok((Surface::Mesh(SmoothMesh::new(mesh).ok_or_else(no_surface)?), false))
        }
    }
}
