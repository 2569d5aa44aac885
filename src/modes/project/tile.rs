//! One tile of a projection, from rays to values.

use rayon::prelude::*;

use super::forest::{Forest, Grove, OrganDescent, OrganTree, QueryCounts, holds_box};
use super::sweep::own_stretches;
use super::{Found, Projector, RayCounts, Tile};
use crate::attributes::squared_chord::{ImageChords, ImageLengths, places_of};
use crate::exact::{BodyView, Engine, Lengths, Spans};
use crate::geometry::{Interval, Region, Segment};
use crate::physics::composite::composite;
use crate::physics::{Appearance, RowMass};
use crate::scene::{Frustum, Organ, View};

/// Traces tiles of one view.
pub struct TileTracer<'a, 's> {
    projector: &'a Projector<'s>,
    view: &'a View,
    view_index: u64,
    appearances: Vec<Appearance>,
    /// The organs ready for the view's rays, by index; those that are needed and not put in a tree.
    bodies: Vec<Option<BodyView<'a>>>,
    /// The organs in trees that find a view's rays in runs.
    images: Vec<Option<ImageChords<'s>>>,
}

/// The chords of one organ along the rays of a tile.
struct OrganChords {
    organ: usize,
    /// Total length per ray, mm.
    lengths: Vec<f64>,
    /// Length left after the children's are taken off, mm.
    own: Vec<f64>,
}

/// What is noted on the way.
struct TileWork {
    /// How rays were answered.
    found: Vec<Found>,
    queries: QueryCounts,
    /// Each ray's organs and chords, if colour is wanted.
    per_ray: Vec<Vec<(usize, Interval)>>,
    spans: Spans,
}

impl TileWork {
    /// A part of a ray in an organ.
    fn note(&mut self, organ: usize, ray: usize, part: Interval, lengths: &mut [f64]) {
        lengths[ray] += part.length();
        if let Some(all) = self.per_ray.get_mut(ray) {
            all.push((organ, part));
        }
    }

    /// The tree's answer. `None` if the ray is to be traced.
    fn ask(&mut self, grove: &Grove, tree: &mut OrganDescent, ray: &Segment) -> Option<Option<Interval>> {
        self.queries.queries += 1;
        match grove.chord(tree, ray) {
            Ok(chord) => {
                self.queries.interpolated += 1;
                Some(chord)
            }
            Err(reason) => {
                self.queries.trace(reason);
                None
            }
        }
    }
}

impl<'a, 's> TileTracer<'a, 's> {
    pub fn new(projector: &'a Projector<'s>, view: &'a View, view_index: u64) -> Self {
        let organs = &projector.scene.organs;
        let grows = |organ: usize| projector.forest.as_ref().is_some_and(|forest| forest.grows(organ));
        let ready = |(organ, it): (usize, &'a Organ)| {
            let is_needed = projector.traced.binary_search(&organ).is_ok() && !grows(organ);
            let estimated = || projector.forest.as_ref()?.engine_for_views(organ);
            is_needed.then(|| it.body.view(view.rays(), projector.engine.or_else(estimated)))
        };
        let bodies = organs.par_iter().enumerate().map(ready).collect();
        let in_runs = |organ: usize| {
            let forest =
                projector.forest.as_ref().filter(|_| projector.traced.binary_search(&organ).is_ok())?;
            forest.image(organ, view.rays())
        };
        let images = (0..organs.len()).into_par_iter().map(in_runs).collect();
        let appearances = organs.iter().map(|o| o.appearance).collect();
        Self { projector, view, view_index, appearances, bodies, images }
    }

    /// The engine of each organ that is ready.
    pub fn engines(&self) -> Vec<Option<Engine>> {
        self.bodies.iter().map(|body| body.as_ref().map(BodyView::engine)).collect()
    }

    pub fn trace(&self, region: Region) -> Tile {
        let frustum = self.view.frustum(region.columns.clone(), region.rows.clone());
        let touched = self.touched(&frustum);
        let wanted = self.projector.wanted;
        let mut work = TileWork {
            found: Vec::new(),
            queries: QueryCounts::default(),
            per_ray: vec![Vec::new(); if wanted.colour { region.pixels() } else { 0 }],
            spans: Spans::default(),
        };
        let grove = self.projector.forest.as_ref().map(Forest::enter);
        let mut rays = Vec::new();
        if grove.is_some() && !touched.is_empty() {
            work.found = vec![Found::Nothing; region.pixels()];
            if touched.iter().any(|&organ| self.images[organ].is_none()) {
                rays = region.places().map(|(c, r)| self.view.segment(c, r)).collect();
            }
        }
        let mut organs: Vec<OrganChords> = touched
            .iter()
            .map(|&organ| {
                let tree = grove.as_ref().and_then(|grove| Some((grove, grove.tree(organ)?)));
                let lengths = match (tree, &self.images[organ]) {
                    (Some((grove, _)), Some(image)) => {
                        self.find_in_runs(organ, grove, image, &region, &mut work)
                    }
                    (Some((grove, tree)), None) => self.interpolate(organ, grove, tree, &rays, &mut work),
                    (None, _) => self.trace_exactly(organ, &region, &mut work),
                };
                OrganChords { organ, own: lengths.clone(), lengths }
            })
            .collect();
        drop(grove);
        self.projector.forest.iter().for_each(Forest::prune_if_full);
        self.take_children_off(&mut organs);
        let counts = self.count(&region, touched.len(), work.queries.interpolated);

        let (line_integral, transmission) =
            if wanted.attenuation { self.attenuate(&region, &organs) } else { Default::default() };
        let colour =
            if wanted.colour && !organs.is_empty() { self.colour(&work.per_ray) } else { Vec::new() };
        let lengths = if wanted.lengths { seen(&organs) } else { Vec::new() };
        let TileWork { found, queries, .. } = work;
        Tile { region, lengths, line_integral, transmission, colour, found, counts, queries }
    }

    /// The organs to trace whose boxes the tile's rays may touch.
    fn touched(&self, frustum: &Frustum) -> Vec<usize> {
        let bounds = |organ: usize| self.projector.scene.organs[organ].body.bounds();
        self.projector.traced.iter().copied().filter(|&organ| !frustum.misses(&bounds(organ))).collect()
    }

    fn count(&self, region: &Region, touched: usize, interpolated: u64) -> RayCounts {
        let rays = region.pixels() as u64;
        let (all, traced) = (self.projector.scene.organs.len() as u64, self.projector.traced.len() as u64);
        RayCounts {
            rays,
            rays_skipped_by_bounds: if touched == 0 { rays } else { 0 },
            organ_rays: rays * all,
            organ_rays_exact: rays * touched as u64 - interpolated,
            organ_rays_interpolated: interpolated,
            organ_rays_skipped_by_bounds: rays * (traced - touched as u64),
            organ_rays_skipped_unneeded: rays * (all - traced),
        }
    }

    /// The lengths of a tile's rays in one organ by its engine, mm.
    fn trace_exactly(&self, organ: usize, region: &Region, work: &mut TileWork) -> Vec<f64> {
        let mut lengths = vec![0.0; region.pixels()];
        let Some(body) = &self.bodies[organ] else { return lengths };
        if self.projector.forest.is_some() {
            work.queries.traced_without_tree += region.pixels() as u64;
        }
        // The sums are the same with and without colour.
        let sums = Lengths(&mut lengths);
        if work.per_ray.is_empty() {
            body.trace(region, &mut { sums });
        } else {
            body.trace(region, &mut (sums, &mut work.spans));
            let per_ray = &mut work.per_ray;
            work.spans.drain(|ray, part| per_ray[ray].push((organ, part)));
        }
        lengths
    }

    /// The lengths of a tile's rays in one organ by its tree, run by run, mm; what the tree does not know is traced.
    fn find_in_runs(
        &self,
        organ: usize,
        grove: &Grove<'_, 's>,
        image: &ImageChords<'s>,
        region: &Region,
        work: &mut TileWork,
    ) -> Vec<f64> {
        let mut lengths = vec![0.0; region.pixels()];
        let mut middles = vec![0.0; if work.per_ray.is_empty() { 0 } else { region.pixels() }];
        let mut open = Vec::new();
        let wanted = (!middles.is_empty()).then_some(&mut middles[..]);
        let mut found = ImageLengths { lengths: &mut lengths, middles: wanted, open: &mut open };
        grove.find(organ, image, region, &mut found);
        for (found, _) in work.found.iter_mut().zip(&lengths).filter(|(_, length)| **length > 0.0) {
            *found = (*found).max(Found::Interpolated);
        }
        let parts = work.per_ray.iter_mut().zip(&middles).zip(&lengths);
        for ((all, middle), length) in parts {
            let part = Interval::new(middle - 0.5 * length, middle + 0.5 * length);
            all.extend(part.filter(|part| part.length() > 0.0).map(|part| (organ, part)));
        }
        let mut traced = 0;
        for run in &open {
            let (run, at) = places_of(region, run);
            traced += at.len() as u64;
            work.found[at.clone()].fill(Found::Traced);
            let sums = Lengths(&mut lengths[at.clone()]);
            if work.per_ray.is_empty() {
                image.exact().trace(&run, &mut { sums });
                continue;
            }
            image.exact().trace(&run, &mut (sums, &mut work.spans));
            let per_ray = &mut work.per_ray[at];
            work.spans.drain(|ray, part| per_ray[ray].push((organ, part)));
        }
        work.queries.queries += region.pixels() as u64;
        work.queries.interpolated += region.pixels() as u64 - traced;
        work.queries.traced_tolerance += traced;
        lengths
    }

    /// The lengths of a tile's rays in one organ by its tree, mm; what the tree does not know is traced.
    fn interpolate(
        &self,
        organ: usize,
        grove: &Grove,
        tree: &OrganTree,
        rays: &[Segment],
        work: &mut TileWork,
    ) -> Vec<f64> {
        let body = &self.projector.scene.organs[organ].body;
        let bounds = body.bounds();
        let mut lengths = vec![0.0; rays.len()];
        let mut descent = tree.descent();
        let (mut open, mut open_rays) = (Vec::new(), Vec::new());
        for (i, ray) in rays.iter().enumerate() {
            let answer = if holds_box(ray, &bounds) {
                work.ask(grove, &mut descent, ray)
            } else {
                work.queries.traced_source_or_target_inside += 1;
                None
            };
            match answer {
                None => {
                    open.push(i);
                    open_rays.push(*ray);
                    // A ray that is traced to find that it misses is on the map, one whose cell proves it is not.
                    work.found[i] = Found::Traced;
                }
                Some(None) => {}
                Some(Some(chord)) => {
                    work.found[i] = work.found[i].max(Found::Interpolated);
                    work.note(organ, i, chord, &mut lengths);
                }
            }
        }
        body.trace(body.engine_for_rays(), 0, &open_rays, &mut work.spans);
        let mut spans = std::mem::take(&mut work.spans);
        spans.drain(|at, part| work.note(organ, open[at], part, &mut lengths));
        work.spans = spans;
        lengths
    }

    /// Own length = chord − chords of the direct children.
    fn take_children_off(&self, organs: &mut [OrganChords]) {
        for child in 0..organs.len() {
            let parent = self.projector.scene.organs[organs[child].organ].parent;
            let Some(parent) = parent.and_then(|p| organs.iter().position(|o| o.organ == p)) else {
                continue;
            };
            for ray in 0..organs[child].lengths.len() {
                organs[parent].own[ray] -= organs[child].lengths[ray];
            }
        }
        for organ in organs {
            // Where parent and child share a surface, rounding may leave −1e-13 mm.
            organ.own.iter_mut().for_each(|length| *length = length.max(0.0) + 0.0);
        }
    }

    fn attenuate(&self, region: &Region, organs: &[OrganChords]) -> (Vec<f32>, Vec<f32>) {
        let attenuator = &self.projector.attenuator;
        let noise = self.projector.noise;
        if organs.is_empty() && noise.is_none() {
            return Default::default();
        }
        let mut masses = RowMass::new(attenuator, region.pixels());
        for organ in organs {
            attenuator.accumulate(organ.organ, &organ.own, &mut masses);
        }
        let mut p = vec![0.0; region.pixels()];
        attenuator.line_integrals(&masses, &mut p);
        let mut transmission: Vec<f64> = p.iter().map(|p| (-p).exp()).collect();
        if let Some(noise) = noise {
            let (columns, _) = self.view.size();
            for (ray, (column, row)) in region.places().enumerate() {
                let pixel = u64::from(row) * u64::from(columns) + u64::from(column);
                transmission[ray] = noise.transmission(attenuator, &masses, ray, self.view_index, pixel);
                p[ray] = noise.line_integral(transmission[ray]);
            }
        }
        let narrow = |values: Vec<f64>| values.into_iter().map(|v| v as f32).collect();
        (narrow(p), narrow(transmission))
    }

    fn colour(&self, per_ray: &[Vec<(usize, Interval)>]) -> Vec<[f32; 4]> {
        let depth = |organ: usize| self.projector.scene.organs[organ].depth;
        let (mut stops, mut own) = (Vec::new(), Vec::new());
        per_ray
            .iter()
            .map(|chords| {
                own_stretches(chords, depth, &mut stops, &mut own);
                composite(&own, &self.appearances)
            })
            .collect()
    }
}

/// The own lengths of those organs that at least one ray meets.
fn seen(organs: &[OrganChords]) -> Vec<(usize, Vec<f32>)> {
    let met = |o: &&OrganChords| o.own.iter().any(|&length| length > 0.0);
    organs.iter().filter(met).map(|o| (o.organ, o.own.iter().map(|&l| l as f32).collect())).collect()
}
