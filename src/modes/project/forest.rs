//! The RI-trees of a run: one per organ, made when the first ray reaches it, under one cache.

pub mod choice;
pub mod kept;
mod queries;
mod settings;

use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{OnceLock, PoisonError, RwLock, RwLockReadGuard};

use serde::Serialize;

use crate::attributes::chord::ChordLength;
use crate::attributes::squared_chord::{Asked, ImageChords, ImageLengths, Known, SquaredChord};
use crate::exact::{Body, Engine, Spans};
use crate::geometry::{Interval, RayGrid, Region, Segment};
use crate::linespace::LineSpace;
use crate::modes::project::Found;
use crate::ritree::{
    Answer, BuildCounts, Cache, Descent, FittedTree, Loaded, Parameters, Reason, RiTree, TreeShape,
};
pub use choice::{Demand, Estimate};
pub use queries::QueryCounts;
pub use settings::{DEFAULT_TOLERANCE_MM, Interpolation, TreeSettings};

/// The trees' state after a run.
#[derive(Clone, Debug, Default, Serialize)]
pub struct ForestReport {
    /// Trees made; organs no ray reaches have none.
    pub trees: usize,
    /// What building took.
    #[serde(flatten)]
    pub build: BuildCounts,
    /// What the trees are made of.
    #[serde(flatten)]
    pub shape: TreeShape,
    /// Bytes of nodes and samples.
    pub tree_bytes: usize,
    /// The most they may be.
    pub cache_bytes: usize,
    /// What was read of trees of an earlier run, if any were.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub loaded: Option<Loaded>,
}

/// The tree of one organ.
pub enum OrganTree<'a> {
    /// The paper's.
    Quadrilinear(RiTree<ChordLength<'a>>),
    /// Of squared chords.
    SquaredChord(FittedTree<SquaredChord<'a>>),
}

/// Calls a method that both kinds of trees have.
macro_rules! either {
    ($tree:expr, $name:ident => $call:expr) => {
        match $tree {
            OrganTree::Quadrilinear($name) => $call,
            OrganTree::SquaredChord($name) => $call,
        }
    };
}
use either;

/// One tree per organ, under one cache.
pub struct Forest<'a> {
    trees: RwLock<Vec<OnceLock<OrganTree<'a>>>>,
    bodies: Vec<&'a Body>,
    /// What each is estimated to take, if that decides.
    estimates: Vec<Option<Estimate>>,
    settings: TreeSettings,
    /// Whether it is asked where chords lie, besides their lengths.
    wants_places: bool,
    cache: Cache,
    /// Tiles so far: the time of all trees.
    clock: AtomicU32,
    /// What was read of trees of an earlier run.
    loaded: Option<Loaded>,
}

/// The tree of one organ, asked for one ray after another.
pub enum OrganDescent<'t, 'a> {
    Quadrilinear(Descent<'t, ChordLength<'a>>),
    SquaredChord(&'t FittedTree<SquaredChord<'a>>),
}

impl<'a> OrganTree<'a> {
    pub fn descent(&self) -> OrganDescent<'_, 'a> {
        match self {
            Self::Quadrilinear(tree) => OrganDescent::Quadrilinear(tree.descent()),
            Self::SquaredChord(tree) => OrganDescent::SquaredChord(tree),
        }
    }
}

/// Many trees to ask, none of them pruned meanwhile.
pub struct Grove<'f, 'a> {
    trees: RwLockReadGuard<'f, Vec<OnceLock<OrganTree<'a>>>>,
    forest: &'f Forest<'a>,
    now: u32,
}

impl<'a> Forest<'a> {
    pub fn new(bodies: Vec<&'a Body>, settings: TreeSettings, wants_places: bool) -> Self {
        let trees = RwLock::new(bodies.iter().map(|_| OnceLock::new()).collect());
        let cache = Cache::new(settings.cache_bytes);
        let estimate = |body: &&Body| settings.demand.map(|demand| Estimate::of(body, &settings, demand));
        let estimates = bodies.iter().map(estimate).collect();
        Self {
            trees,
            bodies,
            estimates,
            settings,
            wants_places,
            cache,
            clock: AtomicU32::new(1),
            loaded: None,
        }
    }

    /// Whether an organ's body is put in a tree.
    pub fn grows(&self, organ: usize) -> bool {
        let body = self.bodies[organ];
        let planes = match body.convexity() {
            Ok(convex) => convex.planes().len(),
            // The paper's trees know one chord of a line.
            Err(_) if self.settings.general_bodies && self.finds_runs() => body.surface().mesh().faces.len(),
            Err(_) => return false,
        };
        planes >= self.settings.least_planes
            && self.estimates[organ].is_none_or(|estimate| estimate.prefers_tree())
            && LineSpace::new(body.bounds()).is_some()
    }

    /// What an organ is estimated to take, if that decides how it is found.
    pub fn estimate(&self, organ: usize) -> Option<Estimate> {
        self.estimates[organ]
    }

    /// The exact engine that is estimated to be the quickest for all views of an organ, if it is known what they are.
    pub fn engine_for_views(&self, organ: usize) -> Option<Engine> {
        self.settings.demand?.grid?;
        self.estimates[organ].map(|estimate| estimate.engine)
    }

    fn new_tree(&self, organ: usize) -> Option<OrganTree<'a>> {
        let body = self.bodies[organ];
        let quadrilinear = |parameters| {
            ChordLength::new(body).map(|chords| OrganTree::Quadrilinear(RiTree::new(chords, parameters)))
        };
        match self.settings.interpolation {
            Interpolation::Quadrilinear { parameters } => quadrilinear(parameters),
            Interpolation::SquaredChord { tolerance_mm } => {
                SquaredChord::new(body, tolerance_mm, self.wants_places)
                    .map(|chords| OrganTree::SquaredChord(FittedTree::new(chords)))
                    // A body too flat for a frame is still not lost: nothing of it is interpolated.
                    .or_else(|| quadrilinear(Parameters { max_depth: 0, ..Parameters::default() }))
            }
        }
    }

    /// Whether trees find the rays of an image in runs, so that what a pixel gets takes its image to be found again.
    pub fn finds_runs(&self) -> bool {
        matches!(self.settings.interpolation, Interpolation::SquaredChord { .. })
    }

    /// The organ's body made ready for the rays of a grid. `None` if there is no tree to find them in runs.
    pub fn image(&self, organ: usize, grid: &RayGrid) -> Option<ImageChords<'a>> {
        match self.enter().tree(organ)? {
            OrganTree::SquaredChord(tree) => ImageChords::new(tree.fit(), grid),
            OrganTree::Quadrilinear(_) => None,
        }
    }

    /// The trees, to be asked by one thread for the rays of one tile: the only lock, and not per ray.
    pub fn enter(&self) -> Grove<'_, 'a> {
        // Wrapping, after four thousand million tiles, would cost pruning its judgement for a while, never an answer.
        let now = self.clock.fetch_add(1, Ordering::Relaxed);
        Grove { trees: self.trees.read().unwrap_or_else(PoisonError::into_inner), forest: self, now }
    }

    /// Forgets the least recently used leaves if the cache was full.
    pub fn prune_if_full(&self) {
        let share = self.settings.kept_share;
        let collect = |trees: &Vec<OnceLock<OrganTree>>, stamps: &mut Vec<_>| {
            let all = trees.iter().filter_map(OnceLock::get);
            all.for_each(|tree| either!(tree, tree => tree.collect_stamps(stamps)));
        };
        self.cache.prune_if_full(&self.trees, share, collect, |trees, oldest| {
            let all = trees.iter_mut().filter_map(OnceLock::get_mut);
            all.for_each(|tree| either!(tree, tree => tree.prune(oldest, &self.cache)));
        });
    }

    pub fn report(&self) -> ForestReport {
        let grove = self.enter();
        let mut report = ForestReport {
            tree_bytes: self.cache.used_bytes(),
            cache_bytes: self.cache.limit_bytes(),
            loaded: self.loaded,
            ..ForestReport::default()
        };
        for tree in grove.trees.iter().filter_map(OnceLock::get) {
            report.trees += 1;
            report.build += either!(tree, tree => tree.build_counts());
            report.shape.add(&either!(tree, tree => tree.shape()));
        }
        report
    }

    /// Checks every tree from its root to its leaves, and that their bytes are the cache's. For tests.
    ///
    /// # Panics
    /// If something stored is not what its cell says.
    pub fn check_invariants(&self) {
        let grove = self.enter();
        let trees = grove.trees.iter().filter_map(OnceLock::get);
        let bytes: usize = trees.map(|tree| either!(tree, tree => tree.check_invariants())).sum();
        assert_eq!(bytes, self.cache.used_bytes(), "the cache counts what the trees hold");
        assert!(bytes <= self.cache.limit_bytes(), "the cache keeps its promise");
    }
}

impl<'a> Grove<'_, 'a> {
    /// The tree of an organ. `None` if its body is not put in a tree.
    pub fn tree(&self, organ: usize) -> Option<&OrganTree<'a>> {
        if self.trees[organ].get().is_none() {
            if !self.forest.grows(organ) {
                return None;
            }
            let tree = self.forest.new_tree(organ)?;
            // Another thread may have been first.
            let _ = self.trees[organ].set(tree);
        }
        let tree = self.trees[organ].get()?;
        either!(tree, tree => tree.tick_to(self.now));
        Some(tree)
    }

    /// The chord of a segment that holds the body's box whole, as the tree of that body knows it. `Err` says why it is
    /// to be traced; `Ok(None)` that it misses. Where a chord lies is known only in a forest that wants places.
    pub fn chord(&self, tree: &mut OrganDescent, segment: &Segment) -> Result<Option<Interval>, Reason> {
        let line = segment.line();
        match tree {
            OrganDescent::Quadrilinear(descent) => {
                let attribute = descent.tree().attribute();
                let point = attribute.space().point_of(line);
                match descent.query(point, &self.forest.cache) {
                    None | Some(Answer::Interpolated(None)) => Ok(None),
                    Some(Answer::Interpolated(Some(chord))) => Ok(attribute.stretch(chord, line, point)),
                    Some(Answer::Trace(reason)) => Err(reason),
                }
            }
            OrganDescent::SquaredChord(tree) => {
                let chords = tree.fit();
                let Some((pair, stuv)) = chords.place_of(line) else { return Ok(None) };
                let chord = |leaf: &_, _| chords.chord(leaf, line, pair, &stuv);
                tree.ask(pair, &stuv, &self.forest.cache, chord).ok_or(Reason::Tolerance)
            }
        }
    }

    /// As [`chord`](Self::chord), its length alone, mm.
    pub fn length_mm(&self, tree: &mut OrganDescent, segment: &Segment) -> Result<f64, Reason> {
        let OrganDescent::SquaredChord(tree) = tree else {
            return self.chord(tree, segment).map(|chord| chord.map_or(0.0, |chord| chord.length()));
        };
        let (line, chords) = (segment.line(), tree.fit());
        let Some((pair, stuv)) = chords.place_of(line) else { return Ok(0.0) };
        match tree.ask(pair, &stuv, &self.forest.cache, |leaf, _| chords.known(leaf, line, pair, &stuv)) {
            Known::Miss => Ok(0.0),
            Known::Length(length) => Ok(length),
            Known::Nothing => Err(Reason::Tolerance),
        }
    }

    /// Finds the lengths of a region of an image that the organ was made ready for.
    pub fn find(&self, organ: usize, image: &ImageChords<'a>, region: &Region, found: &mut ImageLengths) {
        match self.tree(organ) {
            Some(OrganTree::SquaredChord(tree)) => image.find(tree, region, &self.forest.cache, found),
            _ => found.open.extend(region.rows.clone().map(|row| (row, region.columns.clone()))),
        }
    }

    /// The parts of rays in a body that is in `tree`: as the tree knows them, or traced. `answer` is told each ray's place and
    /// how it is answered, with its part if the tree knows one; parts that are traced follow. `spans` comes and goes empty.
    pub fn chords(
        &self,
        tree: &OrganTree,
        body: &Body,
        rays: &[Segment],
        spans: &mut Spans,
        mut answer: impl FnMut(usize, Found, Option<Interval>),
    ) {
        let (mut open, mut open_rays) = (Vec::new(), Vec::new());
        let mut answer_or_keep = |i: usize, chord: Option<Option<Interval>>| match chord {
            Some(chord) => answer(i, Found::Interpolated, chord),
            None => {
                answer(i, Found::Traced, None);
                open.push(i);
                open_rays.push(rays[i]);
            }
        };
        let bounds = body.bounds();
        match tree {
            OrganTree::Quadrilinear(_) => {
                let mut descent = tree.descent();
                for (i, ray) in rays.iter().enumerate() {
                    let chord =
                        if holds_box(ray, &bounds) { self.chord(&mut descent, ray).ok() } else { None };
                    answer_or_keep(i, chord);
                }
            }
            OrganTree::SquaredChord(tree) => {
                for (i, _) in rays.iter().enumerate().filter(|(_, ray)| !holds_box(ray, &bounds)) {
                    answer_or_keep(i, None);
                }
                let whole = rays.iter().enumerate().filter(|(_, ray)| holds_box(ray, &bounds));
                let lines = whole.map(|(i, ray)| (i, ray.line()));
                SquaredChord::ask_all(tree, lines, &self.forest.cache, |i, line, asked| {
                    let chord = |(leaf, pair, stuv): Asked| tree.fit().chord(leaf, line, pair, stuv);
                    answer_or_keep(i, asked.map_or(Some(None), chord));
                });
            }
        }
        body.trace(body.engine_for_rays(), 0, &open_rays, spans);
        spans.drain(|at, part| answer(open[at], Found::Traced, Some(part)));
    }

    /// The depth of the cell that answers a line. `None` if the line passes the body's box by.
    pub fn depth(&self, tree: &OrganTree, segment: &Segment) -> Option<u32> {
        let line = segment.line();
        match tree {
            OrganTree::Quadrilinear(tree) => {
                let point = tree.attribute().space().point_of(line);
                tree.query_with_depth(point, &self.forest.cache).map(|(_, depth)| depth)
            }
            OrganTree::SquaredChord(tree) => {
                let (pair, stuv) = tree.fit().place_of(line)?;
                Some(tree.ask(pair, &stuv, &self.forest.cache, |_, depth| depth))
            }
        }
    }
}

/// Whether the whole box lies between the segment's ends, so that its line's chord is its own.
pub fn holds_box(segment: &Segment, bounds: &crate::geometry::Bounds) -> bool {
    let (o, d) = (segment.line().origin(), segment.line().dir());
    let (middle, half) = ((bounds.centre() - o).dot(d), 0.5 * bounds.size().dot(d.abs()));
    middle - half >= 0.0 && middle + half <= segment.length_mm()
}

#[cfg(test)]
mod tests;
