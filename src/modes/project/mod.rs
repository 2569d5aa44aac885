//! Projection images: each organ's own length, attenuation and colour for every pixel of a view.
//!
//! ```text
//!             ┌──┬──┬──┐   tiles of 64 × 64 pixels, on all cores
//!   source ──◁├──┼──┼──┤   tile's frustum misses an organ's box ─► organ skipped for 4096 rays
//!             └──┴──┴──┘   otherwise: chords of all its rays ─► own lengths ─► p, T · stretches ─► colour
//! ```
//!
//! What nobody asked for is not computed: entry order without colour, organs without attenuation if only attenuation
//! is wanted. A pixel's values depend on its ray alone, so images are the same bits for any number of threads.

pub(super) mod forest;
mod spot_check;
pub(super) mod sweep;
mod tile;

use std::io;
use std::ops::AddAssign;

use rayon::prelude::*;
use serde::Serialize;

use super::Control;
use crate::error::Result;
use crate::exact::Engine;
use crate::geometry::Region;
use crate::physics::{Attenuator, PhotonNoise};
use crate::scene::{Scene, View};
pub use forest::kept::{KeepsTrees, Source, TREES_BEGIN};
pub use forest::{
    DEFAULT_TOLERANCE_MM, Demand, Estimate, ForestReport, Interpolation, QueryCounts, TreeSettings,
};

use crate::ritree::{Loaded, Unreadable};
use forest::{Forest, kept};
use tile::TileTracer;

/// Side of a tile, pixels: its rays' lengths for a few organs fit the second-level cache, and 1024² pixels make 256 tiles.
const TILE: u32 = 64;

/// The tiles of an image, row by row.
pub(super) fn tiles((columns, rows): (u32, u32)) -> Vec<Region> {
    let part = |start: u32, end: u32| start..(start + TILE).min(end);
    let tops = (0..rows).step_by(TILE as usize);
    tops.flat_map(|top| {
        let lefts = (0..columns).step_by(TILE as usize);
        lefts.map(move |left| Region { columns: part(left, columns), rows: part(top, rows) })
    })
    .collect()
}

/// Which values a projection is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Wanted {
    /// Each organ's own length.
    pub lengths: bool,
    /// p and T.
    pub attenuation: bool,
    /// Composited colour.
    pub colour: bool,
}

/// How lengths are found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Method {
    /// Every chord exactly: by the quickest engine for each organ and view, or by one engine wherever it
    /// [serves](Engine::serves).
    Exact(Option<Engine>),
    /// By one RI-tree per convex organ, whose samples are exact chords; what it does not interpolate is exact.
    RiTree(TreeSettings),
    /// By a tree where that is [estimated](Estimate) to be the quicker for what the study asks, see
    /// [`for_views`](Self::for_views); by the quickest exact engine elsewhere.
    Auto(TreeSettings),
}

impl Method {
    /// The method for a study of these views: of them `Auto` is to know, unless it was told to put all bodies in trees.
    pub fn for_views(self, views: &[View]) -> Self {
        match self {
            Self::Auto(trees) if trees.demand.is_some() => {
                Self::Auto(TreeSettings { demand: Some(Demand::of(views)), ..trees })
            }
            other => other,
        }
    }

    /// Its name, as on the command line.
    pub fn name(&self) -> &'static str {
        match self {
            Self::Exact(engine) => engine.map_or("exact", Engine::name),
            Self::RiTree(_) => "ritree",
            Self::Auto(_) => "auto",
        }
    }
}

/// A scene made ready to be projected: the organs before one spectrum, and what is wanted of them.
pub struct Projector<'a> {
    scene: &'a Scene,
    attenuator: Attenuator,
    noise: Option<PhotonNoise>,
    wanted: Wanted,
    /// Organs whose chords are needed, by index.
    traced: Vec<usize>,
    /// The exact engine asked for.
    engine: Option<Engine>,
    forest: Option<Forest<'a>>,
}

impl<'a> Projector<'a> {
    /// Prepares `scene` with its spectrum and response.
    ///
    /// # Errors
    /// An energy that a material's table does not reach.
    pub fn new(scene: &'a Scene, wanted: Wanted, noise: Option<PhotonNoise>, method: Method) -> Result<Self> {
        let organs: Vec<_> = scene.organs.iter().map(|o| (o.material, o.density_g_cm3)).collect();
        let attenuator = Attenuator::new(&organs, &scene.spectrum, scene.response)?;
        let needs_own: Vec<bool> = scene
            .organs
            .iter()
            .enumerate()
            .map(|(i, organ)| {
                wanted.lengths
                    || (wanted.attenuation && attenuator.needs(i))
                    || (wanted.colour && !organ.appearance.is_invisible())
            })
            .collect();
        // A child carves its chord out of its parent, so it is traced for the parent's sake too.
        let traced = (0..scene.organs.len())
            .filter(|&i| needs_own[i] || scene.organs[i].parent.is_some_and(|p| needs_own[p]))
            .collect();
        let bodies = || scene.organs.iter().map(|organ| &organ.body).collect();
        let (engine, forest) = match method {
            Method::Exact(engine) => (engine, None),
            Method::RiTree(settings) | Method::Auto(settings) => {
                (None, Some(Forest::new(bodies(), settings, wanted.colour)))
            }
        };
        Ok(Self { scene, attenuator, noise, wanted, traced, engine, forest })
    }

    /// The trees' state. `None` without trees.
    pub fn forest(&self) -> Option<ForestReport> {
        self.forest.as_ref().map(Forest::report)
    }

    /// What an organ is estimated to take, and whether it is put in a tree; if the method is to choose.
    pub fn estimate(&self, organ: usize) -> Option<(Estimate, bool)> {
        let forest = self.forest.as_ref()?;
        Some((forest.estimate(organ)?, forest.grows(organ)))
    }

    /// Checks every tree from its root to its leaves. For tests: it samples every corner anew.
    ///
    /// # Panics
    /// If something stored is not what its cell says, or the bytes do not add up.
    pub fn check_invariants(&self) {
        self.forest.iter().for_each(Forest::check_invariants);
    }

    /// The attenuation in use.
    pub fn attenuator(&self) -> &Attenuator {
        &self.attenuator
    }

    /// Projects one view; `view_index` chooses the noise's random numbers.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::Error::Interrupted) within a tile's time of a request to stop.
    pub fn project(&self, view: &View, view_index: u64, control: &Control) -> Result<Projection> {
        let (columns, rows) = view.size();
        let tracer = TileTracer::new(self, view, view_index);
        let tiles: Vec<Tile> = tiles(view.size())
            .into_par_iter()
            .map(|region| {
                control.check()?;
                let tile = tracer.trace(region);
                control.advance(tile.region.pixels() as u64);
                Ok(tile)
            })
            .collect::<Result<_>>()?;
        let (mut counts, mut queries) = (RayCounts::default(), QueryCounts::default());
        for tile in &tiles {
            counts += tile.counts;
            queries += tile.queries;
        }
        let engines = tracer.engines();
        Ok(Projection { columns, rows, tiles, counts, queries, engines })
    }
}

impl KeepsTrees for Projector<'_> {
    fn save_trees(&self, out: &mut dyn io::Write) -> io::Result<()> {
        kept::save(&self.forest.iter().collect::<Vec<_>>(), out)
    }

    fn load_trees(&mut self, source: &mut dyn Source) -> Result<Loaded, Unreadable> {
        kept::load(&mut self.forest.iter_mut().collect::<Vec<_>>(), source)
    }
}

/// How many rays there were and what was skipped. An organ-ray is one ray held against one organ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct RayCounts {
    /// Rays, one per pixel.
    pub rays: u64,
    /// Rays of tiles that no organ's box touches: nothing was traced for them.
    pub rays_skipped_by_bounds: u64,
    /// Rays times organs.
    pub organ_rays: u64,
    /// Organ-rays traced exactly.
    pub organ_rays_exact: u64,
    /// Organ-rays answered by an RI-tree.
    pub organ_rays_interpolated: u64,
    /// Organ-rays skipped because the organ's box misses the tile.
    pub organ_rays_skipped_by_bounds: u64,
    /// Organ-rays skipped because no output asks for the organ.
    pub organ_rays_skipped_unneeded: u64,
}

impl AddAssign for RayCounts {
    fn add_assign(&mut self, other: Self) {
        self.rays += other.rays;
        self.rays_skipped_by_bounds += other.rays_skipped_by_bounds;
        self.organ_rays += other.organ_rays;
        self.organ_rays_exact += other.organ_rays_exact;
        self.organ_rays_interpolated += other.organ_rays_interpolated;
        self.organ_rays_skipped_by_bounds += other.organ_rays_skipped_by_bounds;
        self.organ_rays_skipped_unneeded += other.organ_rays_skipped_unneeded;
    }
}

/// The values of one tile, row by row; an empty list stands for "nothing there" in every pixel.
struct Tile {
    region: Region,
    lengths: Vec<(usize, Vec<f32>)>,
    line_integral: Vec<f32>,
    transmission: Vec<f32>,
    colour: Vec<[f32; 4]>,
    /// How each pixel was found, the organ that took most telling.
    found: Vec<Found>,
    counts: RayCounts,
    queries: QueryCounts,
}

/// How a pixel's lengths were found, of those organs that have a tree.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub enum Found {
    /// No organ with a tree is met, or none was asked.
    #[default]
    Nothing,
    /// All by interpolation.
    Interpolated,
    /// At least one organ's by tracing, be it only to find that it is missed.
    Traced,
}

/// The images of one view. Kept by tile, so that organs cost memory only where they are seen.
pub struct Projection {
    columns: u32,
    rows: u32,
    tiles: Vec<Tile>,
    counts: RayCounts,
    queries: QueryCounts,
    engines: Vec<Option<Engine>>,
}

impl Projection {
    /// By which engine each organ was traced, by its index. `None` if it was not needed, or put in a tree.
    pub fn engines(&self) -> &[Option<Engine>] {
        &self.engines
    }

    /// What became of the rays that asked RI-trees.
    pub fn queries(&self) -> QueryCounts {
        self.queries
    }

    /// How each pixel was found, row by row.
    pub fn found(&self) -> Vec<Found> {
        self.assemble(Found::Nothing, |tile| Some(&tile.found))
    }

    /// Columns and rows.
    pub fn size(&self) -> (u32, u32) {
        (self.columns, self.rows)
    }

    /// How many rays were traced and skipped.
    pub fn counts(&self) -> RayCounts {
        self.counts
    }

    /// p = −ln T of each pixel, row by row; zeros if attenuation was not wanted.
    pub fn line_integral(&self) -> Vec<f32> {
        self.assemble(0.0, |tile| Some(&tile.line_integral))
    }

    /// T = I/I₀ of each pixel, row by row; ones if attenuation was not wanted.
    pub fn transmission(&self) -> Vec<f32> {
        self.assemble(1.0, |tile| Some(&tile.transmission))
    }

    /// The own length of one organ at each pixel, mm, row by row; zeros if lengths were not wanted.
    pub fn own_length_mm(&self, organ: usize) -> Vec<f32> {
        self.assemble(0.0, |tile| tile.lengths.iter().find(|(o, _)| *o == organ).map(|(_, values)| values))
    }

    /// Premultiplied linear RGBA of each pixel, row by row; transparent if colour was not wanted.
    pub fn colour(&self) -> Vec<[f32; 4]> {
        self.assemble([0.0; 4], |tile| Some(&tile.colour))
    }

    fn assemble<T: Copy>(&self, empty: T, values: impl Fn(&Tile) -> Option<&Vec<T>>) -> Vec<T> {
        let mut image = vec![empty; self.columns as usize * self.rows as usize];
        for tile in &self.tiles {
            let Some(values) = values(tile).filter(|v| !v.is_empty()) else { continue };
            let width = tile.region.columns.len();
            for (row, line) in tile.region.rows.clone().zip(values.chunks_exact(width)) {
                let start = row as usize * self.columns as usize + tile.region.columns.start as usize;
                image[start..start + width].copy_from_slice(line);
            }
        }
        image
    }
}
