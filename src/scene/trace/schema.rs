//! A scene to be rendered as users write it.
//!
//! ```toml
//! name = "a ball on a table"
//! ambient = "#404040"
//! lights = [{ position = [0, -300, 500], colour = "#ffffff", strength = 1.0 }]
//! sky = { radius = 2000, colours = ["#87b5e6", "#ffffff"], waves = 4, seed = 1 }
//! cameras = [{ eye = [0, -400, 200], target = [0, 0, 40], width_deg = 40 }]
//!
//! [[object]]
//! name = "ball"
//! shape = { kind = "sphere", centre = [0, 0, 40], radius = 40 }
//! material = { colour = "#c02020", diffuse = 0.8, specular = 0.4, mirror = 0.1 }
//! tree = false                        # trace it as ever; true if left out
//! ```

use serde::Deserialize;

/// A whole scene file.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WorldSpec {
    pub name: Option<String>,
    #[serde(default)]
    pub ambient: Option<String>,
    #[serde(default)]
    pub lights: Vec<LightSpec>,
    pub sky: SkySpec,
    pub cameras: Vec<CameraSpec>,
    #[serde(default = "most_turns")]
    pub most_turns: u32,
    #[serde(default = "most_inner_turns")]
    pub most_inner_turns: u32,
    pub object: Vec<ObjectSpec>,
}

pub(super) fn most_turns() -> u32 {
    6
}

pub(super) fn most_inner_turns() -> u32 {
    8
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightSpec {
    pub position: [f64; 3],
    pub colour: Option<String>,
    #[serde(default = "one")]
    pub strength: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SkySpec {
    #[serde(default)]
    pub centre: [f64; 3],
    pub radius: f64,
    pub colours: [String; 2],
    #[serde(default = "four")]
    pub waves: f64,
    #[serde(default)]
    pub seed: u64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraSpec {
    pub eye: [f64; 3],
    pub target: [f64; 3],
    #[serde(default = "upwards")]
    pub up: [f64; 3],
    #[serde(default = "forty")]
    pub width_deg: f64,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectSpec {
    pub name: String,
    pub shape: ShapeSpec,
    #[serde(default)]
    pub material: MaterialSpec,
    #[serde(default = "yes")]
    pub tree: bool,
}

#[derive(Debug, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ShapeSpec {
    Sphere {
        centre: [f64; 3],
        radius: f64,
    },
    Disc {
        centre: [f64; 3],
        normal: [f64; 3],
        radius: f64,
    },
    Block {
        low: [f64; 3],
        high: [f64; 3],
    },
    /// A body of revolution about an upright axis: the uniform cubic B-spline of (radius, height), from the axis to the axis.
    Revolution {
        at: [f64; 3],
        profile: Vec<[f64; 2]>,
    },
    /// A C² sheet of Bezier patches over a rectangle, with seeded waves, falling off from the middle like a dome.
    Sheet {
        centre: [f64; 3],
        size: [f64; 2],
        patches: [usize; 2],
        height: f64,
        #[serde(default)]
        dome: f64,
        #[serde(default)]
        seed: u64,
    },
    /// Bezier patches by their 16 control points, row by row.
    Patches {
        nets: Vec<[[f64; 3]; 16]>,
    },
    /// A surface from an OBJ, STL or PLY file, with smooth normals.
    Mesh {
        file: String,
        #[serde(default)]
        at: [f64; 3],
        #[serde(default = "one")]
        scale: f64,
    },
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct MaterialSpec {
    pub colour: String,
    pub ambient: f64,
    pub diffuse: f64,
    pub specular: f64,
    pub shininess: f64,
    pub mirror: f64,
    pub clear: f64,
    pub glass: Option<GlassSpec>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GlassSpec {
    pub index: f64,
    #[serde(default = "one")]
    pub share: f64,
}

impl Default for MaterialSpec {
    fn default() -> Self {
        Self {
            colour: "#808080".into(),
            ambient: 1.0,
            diffuse: 0.7,
            specular: 0.0,
            shininess: 40.0,
            mirror: 0.0,
            clear: 0.0,
            glass: None,
        }
    }
}

fn one() -> f64 {
    1.0
}

fn four() -> f64 {
    4.0
}

fn forty() -> f64 {
    40.0
}

fn upwards() -> [f64; 3] {
    [0.0, 0.0, 1.0]
}

fn yes() -> bool {
    true
}
