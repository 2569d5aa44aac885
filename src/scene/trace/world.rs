//! What is rendered: objects with materials, lights, a sky and cameras.

use glam::DVec3;

use super::noise::Noise;
use crate::geometry::{Ray, Real, Vec3};
use crate::surface::Surface;
use crate::surface::optics::Optics;

/// A scene to be rendered. Colours are linear RGB, 1 is white.
#[derive(Clone, Debug)]
pub struct World {
    /// What it is called.
    pub name: String,
    /// The objects; they do not cross.
    pub objects: Vec<Object>,
    /// Point lights, at most eight.
    pub lights: Vec<Light>,
    /// The light that comes from everywhere.
    pub ambient: DVec3,
    /// What rays see that leave all objects behind.
    pub sky: Sky,
    /// The views, in order.
    pub cameras: Vec<Camera>,
    /// Rays that were turned by more objects than this are dark.
    pub most_turns: u32,
    /// Rays turned more often than this within one object are dark.
    pub most_inner_turns: u32,
}

/// An object: one surface of one material.
#[derive(Clone, Debug)]
pub struct Object {
    /// What it is called.
    pub name: String,
    /// Its surface.
    pub surface: Surface,
    /// Whether a line meets it in one stretch only, so that it neither hides itself nor is met again by rays that left.
    pub is_convex: bool,
    /// Whether trees are grown for it; otherwise it is traced as ever.
    pub grows: bool,
    /// How it looks.
    pub material: Material,
}

/// How an object looks. Shares of what is mirrored, let through and refracted are taken as given; what is shaded comes on
/// top.
#[derive(Clone, Debug)]
pub struct Material {
    /// Its colour under white light.
    pub colour: DVec3,
    /// The share of the sky's ambient light that it shows.
    pub ambient: f64,
    /// The share of a light that it scatters (Lambert).
    pub diffuse: f64,
    /// The strength of highlights (Phong).
    pub specular: f64,
    /// Their sharpness: the exponent.
    pub shininess: f64,
    /// The share that is mirrored.
    pub mirror: f64,
    /// The share that passes straight on, not refracted.
    pub clear: f64,
    /// The share that is refracted, and the body's refractive index.
    pub glass: Option<Glass>,
}

/// A refracting body.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Glass {
    /// Its refractive index.
    pub index: f64,
    /// The share of light that comes through.
    pub share: f64,
}

impl Material {
    /// What the object does to rays that it turns. `None` if it turns none.
    pub fn optics(&self) -> Option<Optics> {
        match self.glass {
            Some(glass) => Some(Optics::Glass { index: glass.index }),
            None => (self.mirror > 0.0).then_some(Optics::Mirror),
        }
    }

    /// The share of a turned ray's light after so many turns.
    pub fn share(&self, turns: u32) -> f64 {
        self.glass.map_or_else(|| self.mirror.powi(turns as i32), |glass| glass.share)
    }

    /// Whether no light is scattered by it.
    pub fn is_dark(&self) -> bool {
        self.diffuse == 0.0 && self.specular == 0.0
    }

    /// The share of light that comes through on the way to what lies behind, for shadows. Refraction is left out of
    /// account: a glass body casts a light shadow of its outline.
    pub fn translucence(&self) -> f64 {
        self.clear + self.glass.map_or(0.0, |glass| glass.share)
    }
}

/// A point light. It does not weaken with distance, as in the paper's time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Light {
    /// Where it is.
    pub position: DVec3,
    /// Its colour and strength.
    pub colour: DVec3,
}

/// A sphere around everything, painted with noise between two colours.
#[derive(Clone, Debug)]
pub struct Sky {
    /// Its centre.
    pub centre: DVec3,
    /// Its radius.
    pub radius: f64,
    /// The colours between which the noise runs.
    pub colours: [DVec3; 2],
    /// Waves of the noise across a radius.
    pub frequency: f64,
    /// The noise.
    pub noise: Noise,
}

impl Sky {
    /// Where a ray meets it, from its centre.
    pub fn place<R: Real>(&self, ray: &Ray<R>) -> Vec3<R> {
        let off = ray.origin - Vec3::of(self.centre);
        let middle = off.dot(ray.dir);
        let under = middle * middle - off.dot(off) + R::of(self.radius * self.radius);
        off + ray.dir * (under.max(R::of(0.0)).sqrt() - middle)
    }

    /// How far its noise is from the first colour to the second at a place on it, 0 to 1.
    pub fn share<R: Real>(&self, place: Vec3<R>) -> R {
        self.noise.turbulence(place * R::of(self.frequency / self.radius))
    }

    /// The colour of a share.
    pub fn colour<R: Real>(&self, share: R) -> Vec3<R> {
        Vec3::of(self.colours[0]) + Vec3::of(self.colours[1] - self.colours[0]) * share
    }
}

/// A pinhole camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    eye: DVec3,
    forward: DVec3,
    right: DVec3,
    up: DVec3,
    /// Half the picture's width over its distance.
    slope: f64,
}

impl Camera {
    /// A camera at `eye` that looks at `target`, `up` upwards in the picture, which spans `width_deg` from left to right.
    /// `None` if that defines no picture.
    pub fn new(eye: DVec3, target: DVec3, up: DVec3, width_deg: f64) -> Option<Self> {
        let forward = (target - eye).try_normalize()?;
        let right = forward.cross(up).try_normalize()?;
        let is_width = width_deg > 0.0 && width_deg < 180.0;
        is_width.then(|| Self {
            eye,
            forward,
            right,
            up: right.cross(forward),
            slope: (0.5 * width_deg).to_radians().tan(),
        })
    }

    /// Where it is.
    pub fn eye(&self) -> DVec3 {
        self.eye
    }

    /// The ray through (x, y) of a picture of `columns` × `rows`, pixels from its upper left corner.
    pub fn ray<R: Real>(&self, (columns, rows): (u32, u32), x: f64, y: f64) -> Ray<R> {
        let across = R::of(2.0 * self.slope / f64::from(columns));
        let right = (R::of(x) - R::of(0.5 * f64::from(columns))) * across;
        let down = (R::of(y) - R::of(0.5 * f64::from(rows))) * across;
        let dir = Vec3::of(self.forward) + Vec3::of(self.right) * right - Vec3::of(self.up) * down;
        Ray { origin: Vec3::of(self.eye), dir: dir.normalized() }
    }
}
