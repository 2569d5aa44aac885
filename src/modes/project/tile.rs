//! One tile of a projection, from rays to values.

use super::forest::{Forest, Grove, QueryCounts, holds_box};
use super::sweep::own_stretches;
use super::{Found, Projector, RayCounts, Tile};
use crate::attributes::chord::ChordLength;
use crate::geometry::{Interval, Region, Segment};
use crate::physics::composite::composite;
use crate::physics::{Appearance, RowMass};
use crate::ritree::RiTree;
use crate::scene::{Frustum, View};

/// Traces tiles of one view.
pub struct TileTracer<'a, 's> {
    projector: &'a Projector<'s>,
    view: &'a View,
    view_index: u64,
    appearances: Vec<Appearance>,
}

/// The chords of one organ along the rays of a tile.
struct OrganChords {
    organ: usize,
    /// Total length per ray, mm.
    lengths: Vec<f64>,
    /// Length left after the children's are taken off, mm.
    own: Vec<f64>,
}

/// What is noted on the way about how rays were answered.
struct TileWork {
    found: Vec<Found>,
    queries: QueryCounts,
}

impl TileWork {
    /// The tree's answer. `None` if the ray is to be traced.
    fn ask(&mut self, grove: &Grove, tree: &RiTree<ChordLength>, ray: &Segment) -> Option<Option<Interval>> {
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
        let appearances = projector.scene.organs.iter().map(|o| o.appearance).collect();
        Self { projector, view, view_index, appearances }
    }

    pub fn trace(&self, region: Region) -> Tile {
        let frustum = self.view.frustum(region.columns.clone(), region.rows.clone());
        let touched = self.touched(&frustum);
        let rays: Vec<Segment> = region.places().map(|(c, r)| self.view.segment(c, r)).collect();

        let wanted = self.projector.wanted;
        let mut per_ray: Vec<Vec<(usize, Interval)>> =
            vec![Vec::new(); if wanted.colour { rays.len() } else { 0 }];
        let mut work = TileWork { found: Vec::new(), queries: QueryCounts::default() };
        let grove = self.projector.forest.as_ref().map(Forest::enter);
        if grove.is_some() && !touched.is_empty() {
            work.found = vec![Found::Nothing; rays.len()];
        }
        let mut organs: Vec<OrganChords> = touched
            .iter()
            .map(|&organ| self.chords(organ, &frustum, &rays, grove.as_ref(), &mut per_ray, &mut work))
            .collect();
        drop(grove);
        self.projector.forest.iter().for_each(Forest::prune_if_full);
        self.take_children_off(&mut organs);
        let counts = self.count(&region, touched.len(), work.queries.interpolated);

        let (line_integral, transmission) =
            if wanted.attenuation { self.attenuate(&region, &organs) } else { Default::default() };
        let colour = if wanted.colour && !organs.is_empty() { self.colour(&per_ray) } else { Vec::new() };
        let lengths = if wanted.lengths { seen(&organs) } else { Vec::new() };
        let TileWork { found, queries } = work;
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

    fn chords(
        &self,
        organ: usize,
        frustum: &Frustum,
        rays: &[Segment],
        grove: Option<&Grove>,
        per_ray: &mut [Vec<(usize, Interval)>],
        work: &mut TileWork,
    ) -> OrganChords {
        let body = &self.projector.scene.organs[organ].body;
        let tree = grove.and_then(|grove| grove.tree(organ).map(|tree| (grove, tree)));
        let bounds = body.bounds();
        // Where a tree answers the whole tile, nothing is narrowed.
        let mut narrowed = None;
        let mut parts = Vec::new();
        let mut lengths = Vec::with_capacity(rays.len());
        for (i, ray) in rays.iter().enumerate() {
            let asked = match tree {
                None => {
                    work.queries.traced_without_tree += u64::from(grove.is_some());
                    None
                }
                Some(_) if !holds_box(ray, &bounds) => {
                    work.queries.traced_source_or_target_inside += 1;
                    None
                }
                Some((grove, tree)) => work.ask(grove, tree, ray),
            };
            let found = match asked {
                Some(chord) => {
                    parts.clear();
                    parts.extend(chord);
                    Found::Interpolated
                }
                None => {
                    let narrow = || body.narrowed(|bounds| !frustum.misses(bounds));
                    narrowed.get_or_insert_with(narrow).chords_of_segment(ray, &mut parts);
                    Found::Traced
                }
            };
            // A ray that a cell proves to miss says nothing on the map; one that was traced to find so does.
            if let Some(pixel) = work.found.get_mut(i).filter(|_| tree.is_some())
                && (found == Found::Traced || !parts.is_empty())
            {
                *pixel = found.max(*pixel);
            }
            if let Some(all) = per_ray.get_mut(i) {
                all.extend(parts.iter().map(|part| (organ, *part)));
            }
            lengths.push(parts.iter().map(Interval::length).sum::<f64>());
        }
        OrganChords { organ, own: lengths.clone(), lengths }
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
