//! What each study of scale consists of.

use crate::exact::Engine;
use crate::modes::bench::{Contender, Dial};
use crate::modes::project::{Method, TreeSettings};

/// What a study consists of.
pub struct Plan {
    pub name: &'static str,
    pub setup: &'static str,
    pub sizes: &'static [u32],
    /// How many of the sizes a quick run measures.
    pub quick_sizes: usize,
    pub scene: fn(u32) -> String,
    pub contenders: fn(u32) -> Vec<Contender>,
    /// What grows, in its own unit.
    pub measure: fn(u32) -> f64,
    /// The threads at a size, if they are what grows.
    pub threads: Option<fn(u32) -> usize>,
    pub is_fitted: bool,
}

impl Plan {
    /// The name without its unit.
    pub fn short_name(&self) -> &'static str {
        self.name.split(',').next().unwrap_or(self.name)
    }
}

/// The studies, as the table of the parent module has them.
pub const PLANS: [Plan; 6] = [
    Plan {
        name: "faces",
        setup: "one ellipsoid, one view of 600×600",
        sizes: &[1_280, 5_120, 20_480, 81_920, 200_000],
        quick_sizes: 3,
        scene: |faces| scene_text(1, faces, 600, "0"),
        contenders: |_| all(),
        measure: f64::from,
        threads: None,
        is_fitted: true,
    },
    Plan {
        name: "pixels",
        setup: "one ellipsoid of 20 000 faces, one view",
        sizes: &[150, 300, 600, 1_200, 2_400],
        quick_sizes: 3,
        scene: |side| scene_text(1, 20_000, side, "0"),
        contenders: |_| all(),
        measure: |side| f64::from(side) * f64::from(side),
        threads: None,
        is_fitted: true,
    },
    Plan {
        name: "views",
        setup: "one ellipsoid of 5 000 faces, an orbit of 256×256",
        sizes: &[1, 4, 16, 64],
        quick_sizes: 3,
        scene: |views| scene_text(1, 5_000, 256, &format!("0..360:{}", 360.0 / f64::from(views))),
        contenders: |_| all(),
        measure: f64::from,
        threads: None,
        is_fitted: true,
    },
    Plan {
        name: "organs",
        setup: "ellipsoids of 2 000 faces on a grid, one view of 600×600",
        sizes: &[1, 8, 27, 64],
        quick_sizes: 3,
        scene: |organs| scene_text(organs, 2_000, 600, "0"),
        contenders: |_| all(),
        measure: f64::from,
        threads: None,
        is_fitted: true,
    },
    Plan {
        name: "threads",
        setup: "27 ellipsoids of 5 000 faces, one view of 1024×1024",
        sizes: &[1, 2, 4, 8, 16, 32, 64],
        quick_sizes: 2,
        scene: |_| scene_text(27, 5_000, 1_024, "0"),
        contenders: |_| all(),
        measure: f64::from,
        threads: Some(|threads| threads as usize),
        is_fitted: true,
    },
    Plan {
        name: "cache, kB",
        setup: "one ellipsoid of 2 000 faces in a tree, one view of 256×256",
        sizes: &[125, 250, 500, 1_000, 2_000, 4_000, 8_000],
        quick_sizes: 7,
        scene: |_| scene_text(1, 2_000, 256, "0"),
        contenders: |kilobytes| vec![with_cache(Contender::paper(0.05), kilobytes)],
        measure: f64::from,
        threads: None,
        is_fitted: false,
    },
];

fn all() -> Vec<Contender> {
    let engines = [None, Some(Engine::Raster), Some(Engine::Walk), Some(Engine::Bvh)];
    let trees = [Contender::tolerance(0.5), Contender::paper(0.05)];
    engines.into_iter().map(Contender::exact).chain(trees).collect()
}

fn with_cache(contender: Contender, kilobytes: u32) -> Contender {
    let Method::RiTree(settings) = contender.method else { return contender };
    let cache_bytes = 1_000 * kilobytes as usize;
    let dial = Dial { option: "cache-mb", value: f64::from(kilobytes) / 1e3 };
    Contender { method: Method::RiTree(TreeSettings { cache_bytes, ..settings }), dial: Some(dial) }
}

/// So many ellipsoids on a cubic grid that fills the view, which looks at it from `gantry` angles.
fn scene_text(organs: u32, faces: u32, side: u32, gantry: &str) -> String {
    let mut text = format!(
        "name = \"scale\"\n[beam]\ngantry_deg = \"{gantry}\"\nsad_mm = 1000\nsdd_mm = 1500\n\
         detector = {{ size_mm = [360, 360], pixels = [{side}, {side}] }}\n[spectrum]\nenergy_keV = 60\n"
    );
    let per_side = f64::from(organs).cbrt().round().max(1.0) as u32;
    let pitch = 200.0 / f64::from(per_side);
    for i in 0..organs {
        let place = [i % per_side, i / per_side % per_side, i / (per_side * per_side)];
        let [x, y, z] = place.map(|p| pitch * (f64::from(p) + 0.5) - 100.0);
        let [a, b, c] = [0.49, 0.39, 0.29].map(|share| share * pitch);
        text += &format!(
            "[[organ]]\nname = \"organ {i}\"\nmaterial = \"water\"\ndensity_g_cm3 = 1\n\
             shape = {{ kind = \"ellipsoid\", half_axes_mm = [{a}, {b}, {c}], centre_mm = [{x}, {y}, {z}], faces = {faces} }}\n"
        );
    }
    text
}
