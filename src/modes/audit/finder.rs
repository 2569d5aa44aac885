//! One side of a comparison: whatever finds lengths of rays in organs.
//!
//! ```text
//!   Finder ──ready(view)──▶ Ready ──find(organ, batch)──▶ a length per ray, and whether it was interpolated
//!   (for the run)           (for one view, or for rays in no order)
//! ```

use std::io::{self, Write};

use rayon::prelude::*;

use crate::attributes::squared_chord::{ImageChords, ImageLengths, places_of};
use crate::exact::{Body, BodyView, Engine, Lengths, Spans};
use crate::geometry::{Region, Segment};
use crate::modes::project::forest::{Forest, holds_box, kept};
use crate::modes::project::{Found, Method, Source, TreeSettings};
use crate::ritree::{Loaded, Unreadable};
use crate::scene::View;

/// Rays to be asked for together.
#[derive(Clone, Copy)]
pub(super) struct Batch<'a> {
    pub rays: &'a [Segment],
    /// The pixels of the view that they go to, if they do.
    pub region: Option<&'a Region>,
}

/// What was found of one ray in one organ.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Answer {
    /// The total length, mm.
    pub length_mm: f64,
    /// By interpolation or by tracing.
    pub found: Found,
}

/// Finds lengths. What a ray gets must depend on the ray, or the pixel, and the organ alone.
pub(super) trait Finder: Sync {
    /// Made ready for the rays of a view, or for rays in no order.
    fn ready<'f>(&'f self, view: Option<&View>) -> Box<dyn Ready + 'f>;

    /// The depth of the tree's cell that answers a ray. `None` if no tree does.
    fn depth(&self, _organ: usize, _ray: &Segment) -> Option<u32> {
        None
    }

    /// Whether what a pixel gets takes its image's other rays to be found again, to the last bit.
    fn needs_image(&self, _organ: usize) -> bool {
        false
    }

    /// See [`KeepsTrees`](crate::modes::project::KeepsTrees).
    fn save_trees(&self, out: &mut dyn Write) -> io::Result<()> {
        kept::save(&[], out)
    }

    /// See [`KeepsTrees`](crate::modes::project::KeepsTrees).
    fn load_trees(&mut self, source: &mut dyn Source) -> Result<Loaded, Unreadable> {
        kept::load(&mut [], source)
    }

    /// Whether an organ's rays may be interpolated.
    fn is_in_tree(&self, organ: usize) -> bool {
        !self.needs_image(organ)
    }
}

/// A [`Finder`] at work.
pub(super) trait Ready: Sync {
    /// Writes one answer per ray.
    fn find(&self, organ: usize, batch: Batch, answers: &mut Vec<Answer>);
}

/// Finds lengths as a projection by a method would.
pub(super) struct ByMethod<'a> {
    bodies: Vec<&'a Body>,
    engine: Option<Engine>,
    forest: Option<Forest<'a>>,
}

impl<'a> ByMethod<'a> {
    pub fn new(bodies: Vec<&'a Body>, method: Method) -> Self {
        let (engine, settings): (_, Option<TreeSettings>) = match method {
            Method::Exact(engine) => (engine, None),
            Method::RiTree(settings) | Method::Auto(settings) => (None, Some(settings)),
        };
        let forest = settings.map(|settings| Forest::new(bodies.clone(), settings, false));
        Self { bodies, engine, forest }
    }

    fn grows(&self, organ: usize) -> bool {
        self.forest.as_ref().is_some_and(|forest| forest.grows(organ))
    }
}

impl Finder for ByMethod<'_> {
    fn ready<'f>(&'f self, view: Option<&View>) -> Box<dyn Ready + 'f> {
        let ready = |(organ, &body): (usize, &&'f Body)| {
            view.filter(|_| !self.grows(organ)).map(|view| body.view(view.rays(), self.engine))
        };
        let views = self.bodies.par_iter().enumerate().map(ready).collect();
        let in_runs = |organ: usize| self.forest.as_ref()?.image(organ, view?.rays());
        let images = (0..self.bodies.len()).into_par_iter().map(in_runs).collect();
        Box::new(MethodReady { finder: self, views, images })
    }

    fn depth(&self, organ: usize, ray: &Segment) -> Option<u32> {
        let grove = self.forest.as_ref()?.enter();
        let tree = grove.tree(organ).filter(|_| holds_box(ray, &self.bodies[organ].bounds()))?;
        grove.depth(tree, ray)
    }

    fn needs_image(&self, organ: usize) -> bool {
        !self.grows(organ) || self.forest.as_ref().is_some_and(Forest::finds_runs)
    }

    fn save_trees(&self, out: &mut dyn Write) -> io::Result<()> {
        kept::save(&self.forest.iter().collect::<Vec<_>>(), out)
    }

    fn load_trees(&mut self, source: &mut dyn Source) -> Result<Loaded, Unreadable> {
        kept::load(&mut self.forest.iter_mut().collect::<Vec<_>>(), source)
    }

    fn is_in_tree(&self, organ: usize) -> bool {
        self.grows(organ)
    }
}

struct MethodReady<'f, 'a> {
    finder: &'f ByMethod<'a>,
    /// The organs that are not in trees, ready for the view.
    views: Vec<Option<BodyView<'f>>>,
    /// The organs in trees that find the view's rays in runs.
    images: Vec<Option<ImageChords<'a>>>,
}

impl Ready for MethodReady<'_, '_> {
    fn find(&self, organ: usize, batch: Batch, answers: &mut Vec<Answer>) {
        let forest = self.finder.forest.as_ref().filter(|forest| forest.grows(organ));
        match (forest, &self.views[organ], batch.region) {
            (Some(forest), _, Some(region)) if self.images[organ].is_some() => {
                if let Some(image) = &self.images[organ] {
                    find_in_runs(forest, organ, image, region, answers);
                }
                forest.prune_if_full();
            }
            (Some(forest), ..) => {
                ask_tree(forest, organ, self.finder.bodies[organ], batch.rays, answers);
                forest.prune_if_full();
            }
            (None, Some(view), Some(region)) => {
                let mut lengths = vec![0.0; batch.rays.len()];
                view.trace(region, &mut Lengths(&mut lengths));
                keep(&lengths, answers);
            }
            _ => {
                let body = self.finder.bodies[organ];
                let engine = self.finder.engine.filter(|engine| engine.serves(body));
                let mut lengths = vec![0.0; batch.rays.len()];
                let engine = engine.unwrap_or_else(|| body.engine_for_rays());
                body.trace(engine, 0, batch.rays, &mut Lengths(&mut lengths));
                keep(&lengths, answers);
            }
        }
    }
}

/// Traced lengths as answers.
fn keep(lengths: &[f64], answers: &mut Vec<Answer>) {
    answers.clear();
    answers.extend(lengths.iter().map(|&length_mm| Answer { length_mm, found: Found::Traced }));
}

/// The lengths of a region's rays in a tree's organ, as a projection finds them: in runs.
fn find_in_runs<'a>(
    forest: &Forest<'a>,
    organ: usize,
    image: &ImageChords<'a>,
    region: &Region,
    answers: &mut Vec<Answer>,
) {
    let (mut lengths, mut open) = (vec![0.0; region.pixels()], Vec::new());
    let mut found = ImageLengths { lengths: &mut lengths, middles: None, open: &mut open };
    forest.enter().find(organ, image, region, &mut found);
    answers.clear();
    answers.resize(lengths.len(), Answer { length_mm: 0.0, found: Found::Interpolated });
    for run in &open {
        let (run, at) = places_of(region, run);
        image.exact().trace(&run, &mut Lengths(&mut lengths[at.clone()]));
        answers[at].iter_mut().for_each(|answer| answer.found = Found::Traced);
    }
    answers.iter_mut().zip(&lengths).for_each(|(answer, length)| answer.length_mm = *length);
}

/// The lengths of rays in a tree's organ, as a projection finds them: what the tree does not know is traced.
fn ask_tree(forest: &Forest, organ: usize, body: &Body, rays: &[Segment], answers: &mut Vec<Answer>) {
    answers.clear();
    answers.resize(rays.len(), Answer::default());
    let grove = forest.enter();
    let Some(tree) = grove.tree(organ) else { return };
    let mut descent = tree.descent();
    let bounds = body.bounds();
    let (mut open, mut open_rays) = (Vec::new(), Vec::new());
    for (i, ray) in rays.iter().enumerate() {
        let known = if holds_box(ray, &bounds) { grove.length_mm(&mut descent, ray).ok() } else { None };
        match known {
            Some(length_mm) => {
                answers[i] = Answer { length_mm, found: Found::Interpolated };
            }
            None => {
                open.push(i);
                open_rays.push(*ray);
                answers[i].found = Found::Traced;
            }
        }
    }
    let mut spans = Spans::default();
    body.trace(body.engine_for_rays(), 0, &open_rays, &mut spans);
    spans.drain(|at, part| answers[open[at]].length_mm += part.length());
}

/// The reference: clipping for convex bodies, the hierarchy of boxes for all others; each ray by itself.
pub(super) struct Reference<'a> {
    bodies: Vec<&'a Body>,
}

impl<'a> Reference<'a> {
    pub fn new(bodies: Vec<&'a Body>) -> Self {
        Self { bodies }
    }

    /// The engine that judges an organ.
    pub fn engine(body: &Body) -> Engine {
        if Engine::Clip.serves(body) { Engine::Clip } else { Engine::Bvh }
    }
}

impl Finder for Reference<'_> {
    fn ready<'f>(&'f self, _: Option<&View>) -> Box<dyn Ready + 'f> {
        Box::new(ReferenceReady(&self.bodies))
    }
}

struct ReferenceReady<'a>(&'a [&'a Body]);

impl Ready for ReferenceReady<'_> {
    fn find(&self, organ: usize, batch: Batch, answers: &mut Vec<Answer>) {
        let body = self.0[organ];
        let mut spans = Spans::default();
        body.trace(Reference::engine(body), 0, batch.rays, &mut spans);
        answers.clear();
        answers.resize(batch.rays.len(), Answer { length_mm: 0.0, found: Found::Traced });
        spans.drain(|ray, part| answers[ray].length_mm += part.length());
    }
}
