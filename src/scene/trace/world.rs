//! What is rendered: objects with materials, lights, a sky and cameras.

use std::ops::Range;

use glam::{DVec2, DVec3};

use super::noise::Noise;
use crate::geometry::{Bounds, Ray, Real, Region, Vec3};
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
    /// As it is seen from a place.
    pub fn from<R: Real>(&self, origin: Vec3<R>) -> SkyFrom<R> {
        let off = origin - Vec3::of(self.centre);
        SkyFrom { off, power: R::of(self.radius * self.radius) - off.dot(off) }
    }

    /// How far its noise is from the first colour to the second at a place on it, 0 to 1.
    pub fn share<R: Real>(&self, place: Vec3<R>) -> R {
        Noise::share_of(self.octaves(place, 0..Noise::OCTAVES))
    }

    /// What octaves of its noise add up to at a place on it.
    pub fn octaves<R: Real>(&self, place: Vec3<R>, octaves: Range<i32>) -> R {
        self.noise.octaves(place * R::of(self.frequency / self.radius), octaves)
    }

    /// The colour of a share.
    pub fn colour<R: Real>(&self, share: R) -> Vec3<R> {
        Vec3::of(self.colours[0]) + Vec3::of(self.colours[1] - self.colours[0]) * share
    }
}

/// A sky as it is seen from one place.
#[derive(Clone, Copy, Debug)]
pub struct SkyFrom<R> {
    /// The place, from the sky's centre.
    off: Vec3<R>,
    /// The squared radius less the squared distance to the centre.
    power: R,
}

impl<R: Real> SkyFrom<R> {
    /// Where it is met in a unit direction, from its centre.
    pub fn place(&self, dir: Vec3<R>) -> Vec3<R> {
        let middle = self.off.dot(dir);
        let under = middle * middle + self.power;
        self.off + dir * (under.max(R::of(0.0)).sqrt() - middle)
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

    /// It as maps of places and of ways make it: a mirror's.
    pub fn mirrored(&self, place: impl Fn(DVec3) -> DVec3, way: impl Fn(DVec3) -> DVec3) -> Self {
        let [forward, right, up] = [self.forward, self.right, self.up].map(way);
        Self { eye: place(self.eye), forward, right, up, ..*self }
    }

    /// Where a box may be seen in a picture of `columns` × `rows` pixels. `None` if it lies behind the camera.
    pub fn footprint(&self, (columns, rows): (u32, u32), bounds: &Bounds) -> Option<Footprint> {
        let ways = bounds.corners().map(|corner| corner - self.eye);
        let is_before = |way: &DVec3| way.dot(self.forward) > f64::EPSILON * way.length();
        if !ways.iter().any(is_before) {
            return None;
        }
        // A box that reaches beside the eye or behind it may be seen anywhere.
        if !ways.iter().all(is_before) {
            return Some(Footprint::ANYWHERE);
        }
        let middle = 0.5 * DVec2::new(columns.into(), rows.into());
        let pixels = 0.5 * f64::from(columns) / self.slope;
        let places = ways.map(|way| {
            middle + DVec2::new(way.dot(self.right), -way.dot(self.up)) * (pixels / way.dot(self.forward))
        });
        let [low, high] = [DVec2::min, DVec2::max].map(|of| places.into_iter().reduce(of).unwrap_or(middle));
        Some(Footprint { low: low - PIXEL_ROUNDING, high: high + PIXEL_ROUNDING })
    }

    /// The rays of a picture of `columns` × `rows` pixels.
    pub fn rays<R: Real>(&self, (columns, rows): (u32, u32)) -> CameraRays<R> {
        let across = 2.0 * self.slope / f64::from(columns);
        let (right, down) = (across * self.right, -across * self.up);
        let corner = self.forward - 0.5 * (f64::from(columns) * right + f64::from(rows) * down);
        CameraRays {
            eye: Vec3::of(self.eye),
            corner: Vec3::of(corner),
            right: Vec3::of(right),
            down: Vec3::of(down),
            row: (0.0, Vec3::of(corner)),
        }
    }
}

/// What rounding moves a place in a picture by, at most, pixels.
const PIXEL_ROUNDING: f64 = 1e-3;

/// The part of a picture where something may be seen, pixels from the upper left corner.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    low: DVec2,
    high: DVec2,
}

impl Footprint {
    /// Without bounds.
    pub const ANYWHERE: Self = Self { low: DVec2::NEG_INFINITY, high: DVec2::INFINITY };

    /// Whether something may be seen at a place.
    pub fn holds(&self, place: [f64; 2]) -> bool {
        (0..2).all(|axis| (self.low[axis]..=self.high[axis]).contains(&place[axis]))
    }

    /// The cells of so many pixels along each side that it reaches in a picture of `columns` × `rows`. `None` if it lies beside the
    /// picture.
    pub fn cells(&self, (columns, rows): (u32, u32), side: usize) -> Option<[Range<usize>; 2]> {
        let along = |axis: usize, size: u32| {
            let (low, high) = (self.low[axis].max(0.0), self.high[axis].min(f64::from(size)));
            (low <= high).then(|| low as usize / side..high as usize / side + 1)
        };
        Some([along(0, columns)?, along(1, rows)?])
    }

    /// Whether it has something of a region's pixels.
    pub fn reaches(&self, region: &Region) -> bool {
        let is_beside = |axis: usize, pixels: &Range<u32>| {
            self.high[axis] < f64::from(pixels.start) || self.low[axis] > f64::from(pixels.end)
        };
        !is_beside(0, &region.columns) && !is_beside(1, &region.rows)
    }
}

/// The rays of a camera's picture, one after another: those of one row have much in common.
#[derive(Clone, Copy, Debug)]
pub struct CameraRays<R> {
    eye: Vec3<R>,
    /// The way from the eye to the upper left corner of the picture, and on by a pixel.
    corner: Vec3<R>,
    right: Vec3<R>,
    down: Vec3<R>,
    /// The last ray's row, and the way to where it begins.
    row: (f64, Vec3<R>),
}

impl<R: Real> CameraRays<R> {
    /// The ray through (x, y), pixels from the upper left corner.
    pub fn through(&mut self, [x, y]: [f64; 2]) -> Ray<R> {
        if self.row.0 != y {
            self.row = (y, self.corner + self.down * R::of(y));
        }
        let way = self.row.1 + self.right * R::of(x);
        Ray { origin: self.eye, dir: way.normalized() }
    }
}
