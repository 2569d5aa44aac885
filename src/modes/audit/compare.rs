//! One method against another, ray by ray and organ by organ.
//!
//! ```text
//!   view ─► tiles ─┐                              ┌─ method ──┐
//!                  ├─► batches of rays ─► organ ─►├─ reference┤─► errors ─► ledger of the strip or block ─► merged in order
//!   random ► blocks┘   (whose box they may touch) ├─ sums ────┤
//!                                                 └─ closed form
//! ```

use std::ops::Range;

use rayon::prelude::*;

use super::finder::{Answer, Batch, Finder, Ready};
use super::ledger::{Ledger, Tolerances, Zone};
use super::optics::Optics;
use super::outline::OutlineMap;
use super::rays::{BLOCK, Lines};
use super::worst::{Origin, Suspect};
use crate::error::Result;
use crate::exact::Body;
use crate::exact::judge::length_in_parallel_body;
use crate::geometry::numeric::gamma;
use crate::geometry::{Bounds, Region, Segment};
use crate::modes::Control;
use crate::modes::project::{Found, tiles};
use crate::scene::organ::Origin as OrganOrigin;
use crate::scene::shape::Shape;
use crate::scene::{Organ, Scene, View};

/// A ray passes an organ at its silhouette if its reference chord is shorter than this share of the longest that the
/// ellipsoid which fills the organ's box has along the ray. On an ellipsoid these are the outer 4.6 % of the radius:
/// there the chord grows more than three times as fast with the distance from the outline as it is long per radius.
pub const SILHOUETTE_SHARE: f64 = 0.3;

/// Differences between exact engines above this, mm, are looked into: where a line is not all but within a face's plane, they
/// differ by less.
const SURELY_NO_ROUNDING_MM: f64 = 1e-6;

/// Blocks of lines whose ledgers are held at a time.
const WAVE: u64 = 32;

/// What is compared, and how.
pub(super) struct Comparison<'a> {
    pub scene: &'a Scene,
    pub method: &'a dyn Finder,
    pub against: &'a dyn Finder,
    /// Who sums along an image's rays: the accumulation that is looked at.
    pub sums: &'a dyn Finder,
    pub optics: &'a Optics,
    pub tolerances: Tolerances,
}

impl Comparison<'_> {
    /// Compares along every pixel's ray of a view.
    pub fn view(&self, index: usize, view: &View, control: &Control) -> Result<Ledger> {
        let tiles: Vec<(Region, Vec<usize>)> = tiles(view.size())
            .into_par_iter()
            .map(|region| (region.clone(), self.touched(view, &region)))
            .collect();
        let outlines = self.outlines(view, &tiles, control)?;
        let at_work = self.at_work(Some(view), outlines);
        let strips: Vec<&[(Region, Vec<usize>)]> = tiles.chunk_by(|a, b| a.0.rows == b.0.rows).collect();
        let ledgers = strips.into_par_iter().map(|strip| {
            let mut ledger = self.ledger();
            for (region, touched) in strip {
                control.check()?;
                let rays: Vec<Segment> = region.places().map(|(c, r)| view.segment(c, r)).collect();
                let places: Vec<_> = region.places().collect();
                let origin = |i: usize| Origin::Pixel { view: index, column: places[i].0, row: places[i].1 };
                let batch = Batch { rays: &rays, region: Some(region) };
                at_work.compare(batch, touched, &origin, &mut ledger);
                control.advance(region.pixels() as u64);
            }
            Ok(ledger)
        });
        Ok(self.merge(&ledgers.collect::<Result<Vec<_>>>()?))
    }

    /// Compares along the lines of some blocks.
    pub fn lines(&self, lines: &Lines, blocks: Range<u64>, control: &Control) -> Result<Ledger> {
        let at_work = self.at_work(None, Vec::new());
        let all: Vec<usize> = (0..self.scene.organs.len()).collect();
        let mut total = self.ledger();
        for start in blocks.clone().step_by(WAVE as usize) {
            let wave = (start..(start + WAVE).min(blocks.end)).into_par_iter().map(|block| {
                control.check()?;
                let mut ledger = self.ledger();
                let shots = lines.block(block).into_iter();
                let rays: Vec<Segment> =
                    shots.filter_map(|(source, path)| Segment::along(source, path)).collect();
                let origin = |i: usize| Origin::Line(block * BLOCK + i as u64);
                at_work.compare(Batch { rays: &rays, region: None }, &all, &origin, &mut ledger);
                control.advance(rays.len() as u64);
                Ok(ledger)
            });
            total += &self.merge(&wave.collect::<Result<Vec<_>>>()?);
        }
        Ok(total)
    }

    pub fn ledger(&self) -> Ledger {
        Ledger::new(self.scene.organs.len(), self.tolerances)
    }

    fn merge(&self, ledgers: &[Ledger]) -> Ledger {
        let mut total = self.ledger();
        ledgers.iter().for_each(|ledger| total += ledger);
        total
    }

    pub fn touched(&self, view: &View, region: &Region) -> Vec<usize> {
        let frustum = view.frustum(region.columns.clone(), region.rows.clone());
        let organs = self.scene.organs.iter().enumerate();
        organs.filter(|(_, organ)| !frustum.misses(&organ.body.bounds())).map(|(i, _)| i).collect()
    }

    fn outlines(
        &self,
        view: &View,
        tiles: &[(Region, Vec<usize>)],
        control: &Control,
    ) -> Result<Vec<Option<OutlineMap>>> {
        let mut regions: Vec<Option<Region>> = vec![None; self.scene.organs.len()];
        for (tile, touched) in tiles {
            for &organ in touched {
                let around = regions[organ].get_or_insert_with(|| tile.clone());
                *around = Region {
                    columns: around.columns.start.min(tile.columns.start)
                        ..around.columns.end.max(tile.columns.end),
                    rows: around.rows.start.min(tile.rows.start)..around.rows.end.max(tile.rows.end),
                };
            }
        }
        let map = |(region, organ): (Option<Region>, &Organ)| {
            control.check()?;
            Ok(region.map(|region| OutlineMap::new(&organ.body, view, region)))
        };
        regions.into_par_iter().zip(&self.scene.organs).map(map).collect()
    }

    fn at_work(&self, view: Option<&View>, outlines: Vec<Option<OutlineMap>>) -> AtWork<'_> {
        AtWork {
            comparison: self,
            method: self.method.ready(view),
            against: self.against.ready(view),
            sums: view.map(|view| self.sums.ready(Some(view))),
            true_shapes: self.scene.organs.iter().map(closed_form).collect(),
            outlines,
        }
    }
}

/// The shape whose chords are the organ's in closed form. `None` for meshes, for organs of several shapes, and for tubes and
/// torus sectors, whose lines have several chords.
pub(super) fn closed_form(organ: &Organ) -> Option<&Shape> {
    match &organ.origin {
        OrganOrigin::Shapes(shapes) => match &shapes[..] {
            [shape] if shape.is_convex_by_construction() => Some(shape),
            _ => None,
        },
        OrganOrigin::Mesh { .. } => None,
    }
}

/// A comparison ready for the rays of a view, or for lines.
struct AtWork<'a> {
    comparison: &'a Comparison<'a>,
    method: Box<dyn Ready + 'a>,
    against: Box<dyn Ready + 'a>,
    /// For views only.
    sums: Option<Box<dyn Ready + 'a>>,
    true_shapes: Vec<Option<&'a Shape>>,
    outlines: Vec<Option<OutlineMap>>,
}

/// One organ's answers along the rays of a batch that may meet it.
struct OrganAnswers {
    organ: usize,
    /// The rays' places in the batch.
    places: Vec<usize>,
    method: Vec<Answer>,
    against: Vec<Answer>,
    sums: Vec<Answer>,
    /// Lengths in closed form; empty if there is none.
    closed_form: Vec<f64>,
}

impl AtWork<'_> {
    /// Enters what the batch's rays show of each of the organs.
    fn compare(&self, batch: Batch, organs: &[usize], origin: &dyn Fn(usize) -> Origin, ledger: &mut Ledger) {
        ledger.rays += batch.rays.len() as u64;
        let mut answers: Vec<OrganAnswers> =
            organs.iter().filter_map(|&organ| self.ask(organ, batch)).collect();
        for of_organ in &mut answers {
            ledger.decided_by_rounding += self.settle(of_organ, batch);
        }
        let optics = self.comparison.optics;
        let mut exponents = vec![[0.0; 2]; batch.rays.len()];
        for of_organ in &answers {
            for (i, &at) in of_organ.places.iter().enumerate() {
                exponents[at][0] += optics.exponent(of_organ.organ, of_organ.against[i].length_mm);
                let error = of_organ.method[i].length_mm - of_organ.against[i].length_mm;
                exponents[at][1] += optics.exponent(of_organ.organ, error);
            }
        }
        let transmissions: Vec<f64> = exponents.iter().map(|[p, _]| (-p).exp()).collect();
        for (&[p, change], &transmission) in exponents.iter().zip(&transmissions) {
            if p != 0.0 || change != 0.0 {
                ledger.transmission.add(Optics::change(transmission, change), transmission);
            }
        }
        for of_organ in &answers {
            self.enter(of_organ, batch, &transmissions, origin, ledger);
        }
    }

    /// All answers about one organ. `None` if no ray comes near.
    fn ask(&self, organ: usize, batch: Batch) -> Option<OrganAnswers> {
        let body = &self.comparison.scene.organs[organ].body;
        let (places, rays): (Vec<usize>, Vec<Segment>) = match batch.region {
            // A tile's rays stay together: engines follow the image.
            Some(_) => ((0..batch.rays.len()).collect(), batch.rays.to_vec()),
            None => {
                let bounds = body.bounds();
                let rays = batch.rays.iter().enumerate();
                // Takes in what a shape has beyond its inscribed mesh only in part: such rays miss mesh and organ.
                rays.filter(|(_, ray)| bounds.ball_meets(ray.line())).map(|(i, ray)| (i, *ray)).unzip()
            }
        };
        if rays.is_empty() {
            return None;
        }
        let batch = Batch { rays: &rays, region: batch.region };
        let find = |ready: &dyn Ready| {
            let mut answers = Vec::new();
            ready.find(organ, batch, &mut answers);
            answers
        };
        let closed_form = match self.true_shapes[organ] {
            Some(shape) => rays.iter().map(|ray| true_length(shape, ray)).collect(),
            None => Vec::new(),
        };
        Some(OrganAnswers {
            organ,
            places,
            method: find(&*self.method),
            against: find(&*self.against),
            sums: self.sums.as_ref().map_or(Vec::new(), |sums| find(&**sums)),
            closed_form,
        })
    }

    /// Takes traced lengths that only rounding parts from the reference's for equal; returns how many there were.
    fn settle(&self, answers: &mut OrganAnswers, batch: Batch) -> u64 {
        let body = &self.comparison.scene.organs[answers.organ].body;
        let mut settled = 0;
        for (i, &at) in answers.places.iter().enumerate() {
            let (method, reference_mm) = (&mut answers.method[i], answers.against[i].length_mm);
            let differs = (method.length_mm - reference_mm).abs() > SURELY_NO_ROUNDING_MM;
            if differs && method.found != Found::Interpolated {
                let lengths = [method.length_mm, reference_mm];
                if are_equal_but_for_rounding(body, &batch.rays[at], lengths) {
                    method.length_mm = reference_mm;
                    settled += 1;
                }
            }
        }
        settled
    }

    /// Enters the errors of one organ; rays that miss it whoever is asked are no errors and are not counted.
    fn enter(
        &self,
        answers: &OrganAnswers,
        batch: Batch,
        transmissions: &[f64],
        origin: &dyn Fn(usize) -> Origin,
        ledger: &mut Ledger,
    ) {
        let organ = answers.organ;
        let bounds = self.comparison.scene.organs[organ].body.bounds();
        let optics = self.comparison.optics;
        for (i, &at) in answers.places.iter().enumerate() {
            let Answer { length_mm: method_mm, found } = answers.method[i];
            let reference_mm = answers.against[i].length_mm;
            let ray = &batch.rays[at];
            let transmission = transmissions[at];
            let change = |error_mm: f64| {
                [Optics::change(transmission, optics.exponent(organ, error_mm)), transmission]
            };
            // Also what is not a number is compared.
            if !(method_mm == 0.0 && reference_mm == 0.0) {
                let error = method_mm - reference_mm;
                let zone = zone(reference_mm, ray, &bounds);
                let of_organ = ledger.organ(organ);
                of_organ.method.add(error, reference_mm, change(error));
                of_organ.part(found, zone).add(error, reference_mm);
                if let Origin::Pixel { column, row, .. } = origin(at)
                    && let Some(map) = &self.outlines[organ]
                {
                    ledger.by_distance[map.bin(column, row)].add(error, reference_mm);
                }
                let suspect =
                    Suspect { organ, origin: origin(at), ray: *ray, method_mm, reference_mm, found };
                ledger.worst.add(suspect);
            }
            if let Some(sum) = answers.sums.get(i).filter(|sum| sum.length_mm != 0.0 || reference_mm != 0.0) {
                let error = sum.length_mm - reference_mm;
                ledger.organ(organ).accumulation.add(error, reference_mm, change(error));
            }
            if let Some(&true_mm) = answers.closed_form.get(i) {
                let of_organ = ledger.organ(organ);
                for (kind, length_mm) in
                    [(&mut of_organ.mesh, reference_mm), (&mut of_organ.total, method_mm)]
                {
                    if !(length_mm == 0.0 && true_mm == 0.0) {
                        let error = length_mm - true_mm;
                        kind.add(error, true_mm, change(error));
                    }
                }
            }
        }
    }
}

/// By how much rounding may move a convex body's planes, seen from where a ray starts, mm: engines are exact for planes, or
/// vertices, moved by γ₈ of their distance, and two of them may move them apart.
pub(super) fn rounding_shift_mm(body: &Body, ray: &Segment) -> f64 {
    let distances = body.bounds().corners().into_iter().map(|c| (c - ray.line().origin()).length());
    gamma(16) * distances.fold(0.0, f64::max)
}

/// Whether lengths are all exact for convex bodies whose planes are moved by rounding: a line in the plane of a flat side is
/// in or out by chance, whole or not at all.
fn are_equal_but_for_rounding(body: &Body, ray: &Segment, lengths: [f64; 2]) -> bool {
    let Ok(mesh) = body.convexity() else { return false };
    let shift_mm = rounding_shift_mm(body, ray);
    let [least, most] = [-shift_mm, shift_mm].map(|shift| length_in_parallel_body(mesh, ray, shift));
    lengths.iter().all(|length| (least - shift_mm..=most + shift_mm).contains(length))
}

/// Where a ray whose reference chord is `length_mm` passes the body of a box.
fn zone(length_mm: f64, ray: &Segment, bounds: &Bounds) -> Zone {
    let longest = 1.0 / (ray.line().dir() / bounds.size()).length();
    if length_mm < SILHOUETTE_SHARE * longest { Zone::Silhouette } else { Zone::Interior }
}

/// The length of a ray in the true body, mm.
fn true_length(shape: &Shape, ray: &Segment) -> f64 {
    let chord = shape.chord(ray.line()).and_then(|chord| chord.intersection(&ray.reach()));
    chord.map_or(0.0, |chord| chord.length())
}
