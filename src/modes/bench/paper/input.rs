//! The paper's test inputs (§3.1) and ours, and one run over one of them.

use std::time::Instant;

use serde::Serialize;

use crate::error::Result;
use crate::geometry::Real;
use crate::modes::Control;
use crate::modes::absorption::{Bodies, Lengths};
use crate::modes::bench::LENGTHS;
use crate::modes::bench::curve::views;
use crate::modes::project::{Interpolation, Method, Projector, QueryCounts, TreeSettings};
use crate::modes::raytrace::{Picture, Renderer, Samples, Tracing, Work};
use crate::ritree::BuildCounts;
use crate::scene::trace::{self, Recipe, World};
use crate::scene::{Scene, View};

/// The random scenes hold so many volumes (§3.1).
const VOLUMES: [usize; 3] = [8, 6, 5];

/// A scene, or a few over which figures are averaged, with what is done to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Input {
    /// A mirroring sheet of 100 patches from three viewpoints: ray tracing.
    BezierSurface,
    /// Refracting volumes, three scenes: ray tracing.
    RandomVolumes,
    /// The same volumes looked through: absorption.
    RandomVolumesAbsorption,
    /// A bowl of tomatoes under a wrap: ray tracing.
    Tomatoes,
    /// Our adult phantom: absorption in organs with faces.
    Adult,
}

impl Input {
    /// All, in the order of their tables.
    pub const ALL: [Self; 5] = [
        Self::BezierSurface,
        Self::RandomVolumes,
        Self::RandomVolumesAbsorption,
        Self::Tomatoes,
        Self::Adult,
    ];

    /// Its name, as on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::BezierSurface => "bezier-surface",
            Self::RandomVolumes => "random-volumes",
            Self::RandomVolumesAbsorption => "random-volumes-absorption",
            Self::Tomatoes => "tomatoes",
            Self::Adult => "adult",
        }
    }

    /// Its name in a heading.
    pub fn title(self) -> &'static str {
        match self {
            Self::BezierSurface => "Bezier surface",
            Self::RandomVolumes => "Random volumes",
            Self::RandomVolumesAbsorption => "Random volumes, absorption",
            Self::Tomatoes => "Tomatoes",
            Self::Adult => "Adult phantom, absorption",
        }
    }

    /// What is rendered, and against what.
    pub fn setup(self) -> &'static str {
        match self {
            Self::BezierSurface => "three viewpoints, each by trees of its own; figures are their means",
            Self::RandomVolumes => "three scenes of 8, 6 and 5 volumes; figures are their means",
            Self::RandomVolumesAbsorption => {
                "the same three scenes, their smooth volumes looked through, each half opaque; figures are their means"
            }
            Self::Tomatoes => "one view",
            Self::Adult => {
                "one view of organs made of faces, against the quickest exact engines; these work on images and are not \
                 written in numbers that count, so there is no FLOP figure"
            }
        }
    }

    /// What its error is a mean of.
    pub fn error_unit(self) -> &'static str {
        match self {
            Self::BezierSurface | Self::RandomVolumes | Self::Tomatoes => "distance of RGB colours",
            Self::RandomVolumesAbsorption => "length / half the body's longest side",
            Self::Adult => "length, mm",
        }
    }

    /// Whether its errors are in the paper's unit.
    pub fn errors_compare(self) -> bool {
        matches!(self, Self::BezierSurface | Self::RandomVolumes | Self::Tomatoes)
    }

    /// Whether its operations can be counted.
    pub fn counts_operations(self) -> bool {
        self != Self::Adult
    }

    /// The paper's picture: columns, rows, and rays per pixel.
    pub fn picture(self) -> ([u32; 2], u32) {
        match self {
            Self::BezierSurface | Self::RandomVolumesAbsorption | Self::Adult => ([600, 600], 1),
            Self::RandomVolumes => ([300, 300], 9),
            Self::Tomatoes => ([1200, 900], 1),
        }
    }

    /// Makes the scenes.
    ///
    /// # Errors
    /// A scene that cannot be made.
    pub fn subject(self, size: [u32; 2]) -> Result<Subject> {
        let volumes = || -> Result<Vec<World>> {
            VOLUMES
                .iter()
                .zip(1..)
                .map(|(&count, seed)| trace::random_volumes(Recipe { seed, count }))
                .collect()
        };
        let (size, rays) = ((size[0], size[1]), self.picture().1);
        let samples = Samples::new(rays, None).unwrap_or_default();
        Ok(match self {
            Self::BezierSurface => Subject::Pictures(vec![trace::bezier_surface(1)], size, samples),
            Self::RandomVolumes => Subject::Pictures(volumes()?, size, samples),
            Self::RandomVolumesAbsorption => Subject::Absorption(volumes()?, size),
            Self::Tomatoes => {
                let world = trace::open("tomatoes", Recipe { seed: 1, count: 1 })?;
                Subject::Pictures(vec![world], size, samples)
            }
            Self::Adult => {
                let scene = Scene::phantom("adult")?;
                let views = views(&scene, size.into())?;
                Subject::Phantom(Box::new(scene), views)
            }
        })
    }
}

/// An input made ready.
pub enum Subject {
    /// Worlds of which each view is rendered.
    Pictures(Vec<World>, (u32, u32), Samples),
    /// Worlds that are looked through in each view.
    Absorption(Vec<World>, (u32, u32)),
    /// Organs that are projected.
    Phantom(Box<Scene>, Vec<View>),
}

/// What a run took and found. Counts are sums over all views.
#[derive(Debug, Default)]
pub struct Outcome {
    /// Seconds, from trees without a leaf to the last pixel.
    pub seconds: f64,
    /// Floating-point operations, if they were counted.
    pub operations: u64,
    /// Questions to trees.
    pub queries: u64,
    /// Questions that they answered; all others were traced.
    pub interpolated: u64,
    /// Bytes of nodes and samples.
    pub tree_bytes: usize,
    /// What building took.
    pub build: BuildCounts,
    /// How many views.
    pub views: usize,
    found: Found,
}

/// What a run found, view by view.
#[derive(Debug)]
enum Found {
    Pictures(Vec<Picture>),
    Lengths(Vec<Lengths>),
}

impl Default for Found {
    fn default() -> Self {
        Self::Lengths(Vec::new())
    }
}

impl Outcome {
    /// The mean error against the exact outcome, in the input's own unit.
    pub fn error(&self, exact: &Self) -> f64 {
        let errors: Vec<f64> = match (&self.found, &exact.found) {
            (Found::Pictures(own), Found::Pictures(exact)) => {
                own.iter().zip(exact).filter_map(|(a, b)| a.mean_distance(b)).collect()
            }
            (Found::Lengths(own), Found::Lengths(exact)) => {
                own.iter().zip(exact).map(|(a, b)| a.mean_difference(b)).collect()
            }
            _ => Vec::new(),
        };
        errors.iter().sum::<f64>() / errors.len() as f64
    }

    fn add(&mut self, work: Work, tree_bytes: usize, build: BuildCounts) {
        self.operations += work.operations;
        self.queries += work.queries;
        self.interpolated += work.interpolated;
        self.tree_bytes += tree_bytes;
        self.build += build;
        self.views += 1;
    }
}

impl Subject {
    /// Renders or looks through all views. Trees live for one view: in the paper, too, figures are averaged over views.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::Error::Interrupted) within a tile's time of a request to stop.
    pub fn run<R: Real>(&mut self, tracing: Tracing, control: &Control) -> Result<Outcome> {
        let quiet = control.without_progress();
        let mut outcome = Outcome::default();
        match self {
            Self::Pictures(worlds, size, samples) => {
                let mut pictures = Vec::new();
                for (world, camera) in worlds.iter().flat_map(|w| w.cameras.iter().map(move |c| (w, c))) {
                    let start = Instant::now();
                    let renderer = Renderer::<R>::new(world, tracing);
                    let picture = renderer.render(camera, *size, samples, &quiet)?;
                    outcome.seconds += start.elapsed().as_secs_f64();
                    outcome.add(picture.work(), renderer.tree_bytes(), renderer.build_counts());
                    pictures.push(picture);
                }
                outcome.found = Found::Pictures(pictures);
            }
            Self::Absorption(worlds, size) => {
                let mut found = Vec::new();
                for (world, camera) in worlds.iter().flat_map(|w| w.cameras.iter().map(move |c| (w, c))) {
                    let start = Instant::now();
                    let bodies = Bodies::<R>::new(world, tracing)?;
                    let lengths = bodies.lengths(camera, *size, &quiet)?;
                    outcome.seconds += start.elapsed().as_secs_f64();
                    outcome.add(lengths.work, bodies.tree_bytes(), bodies.build_counts());
                    found.push(lengths);
                }
                outcome.found = Found::Lengths(found);
            }
            Self::Phantom(scene, views) => {
                scene.organs.iter_mut().for_each(|organ| organ.body.forget_engines());
                let mut found = Vec::new();
                for view in views.iter() {
                    let start = Instant::now();
                    let projector = Projector::new(scene, LENGTHS, None, method(tracing))?;
                    let projection = projector.project(view, 0, &quiet)?;
                    outcome.seconds += start.elapsed().as_secs_f64();
                    let forest = projector.forest().unwrap_or_default();
                    let QueryCounts { queries, interpolated, .. } = projection.queries();
                    outcome.add(
                        Work { queries, interpolated, ..Work::default() },
                        forest.tree_bytes,
                        forest.build,
                    );
                    let lengths =
                        (0..scene.organs.len()).flat_map(|organ| projection.own_length_mm(organ)).collect();
                    found.push(Lengths { lengths, ..Lengths::default() });
                }
                outcome.found = Found::Lengths(found);
            }
        }
        Ok(outcome)
    }
}

/// The method of projecting organs that corresponds to one of tracing.
fn method(tracing: Tracing) -> Method {
    match tracing {
        Tracing::Exact => Method::Exact(None),
        Tracing::RiTree(trees) => Method::RiTree(TreeSettings {
            interpolation: Interpolation::Quadrilinear { parameters: trees.parameters },
            cache_bytes: trees.cache_bytes,
            kept_share: trees.kept_share,
            ..TreeSettings::default()
        }),
    }
}
