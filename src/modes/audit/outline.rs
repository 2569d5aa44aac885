//! How far the pixels of an image lie within an organ's outline.
//!
//! ```text
//!   · · ● ● · ·        Of each pixel that meets the organ: the distance to the nearest that does not, in mm where
//!   · ● ● ● ● ·        the organ is, binned by octaves.
//!   · ● ● ● ● ·        What lies off the image is not known, and is no outline.
//! ```
//!
//! Exact Euclidean distances, by columns and then by the lower envelope of parabolas along rows (Felzenszwalb &
//! Huttenlocher 2012, doi:10.4086/toc.2012.v008a019).

use crate::exact::{Body, Engine, Lengths};
use crate::geometry::Region;
use crate::scene::View;

/// Upper edges of the bins of distance, mm, but for the last, which has none.
pub(super) const EDGES_MM: [f64; 8] = [0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];

/// Bins of distance: rays that miss the organ, then those of [`EDGES_MM`], then all beyond.
pub(super) const BINS: usize = EDGES_MM.len() + 2;

/// Rows that are traced at a time.
const BAND: u32 = 32;

/// The bin of each pixel of a region; 0 outside.
pub(super) struct OutlineMap {
    region: Region,
    bins: Vec<u8>,
}

impl OutlineMap {
    /// The map of a body in `view`, of which no ray outside of `region` meets it.
    pub fn new(body: &Body, view: &View, region: Region) -> Self {
        let hit = silhouette(body, view, &region);
        let zoom = view.magnification_at(body.bounds().centre()).unwrap_or(1.0);
        let (across, down) = view.spacing_mm();
        let squared = squared_distances(&hit, region.columns.len(), [across / zoom, down / zoom]);
        let bin = |(squared, hit): (&f64, &bool)| {
            let beyond = EDGES_MM.iter().filter(|edge| *squared >= **edge * **edge).count();
            if *hit { 1 + beyond as u8 } else { 0 }
        };
        let bins = squared.iter().zip(&hit).map(bin).collect();
        Self { region, bins }
    }

    /// The bin of a pixel.
    pub fn bin(&self, column: u32, row: u32) -> usize {
        let Region { columns, rows } = &self.region;
        if !columns.contains(&column) || !rows.contains(&row) {
            return 0;
        }
        let at = (row - rows.start) as usize * columns.len() + (column - columns.start) as usize;
        self.bins[at].into()
    }
}

/// Which pixels of the region meet the body. By the raster: distances are whole pixels, whichever engine is asked.
fn silhouette(body: &Body, view: &View, region: &Region) -> Vec<bool> {
    let ready = body.view(view.rays(), Some(Engine::Raster));
    let mut hit = Vec::with_capacity(region.pixels());
    for start in region.rows.clone().step_by(BAND as usize) {
        let rows = start..(start + BAND).min(region.rows.end);
        let band = Region { columns: region.columns.clone(), rows };
        let mut lengths = vec![0.0; band.pixels()];
        ready.trace(&band, &mut Lengths(&mut lengths));
        hit.extend(lengths.iter().map(|&length| length > 0.0));
    }
    hit
}

/// The squared distance of each pixel from the nearest that is not hit, mm²; infinite if there is none.
fn squared_distances(hit: &[bool], columns: usize, [across, down]: [f64; 2]) -> Vec<f64> {
    let mut squared: Vec<f64> = hit.iter().map(|&hit| if hit { f64::INFINITY } else { 0.0 }).collect();
    let rows = hit.len() / columns.max(1);
    let mut sweep = |order: &mut dyn Iterator<Item = usize>| {
        // Steps to the last miss of each column.
        let mut steps = vec![f64::INFINITY; columns];
        for row in order {
            for (steps, squared) in steps.iter_mut().zip(&mut squared[row * columns..(row + 1) * columns]) {
                *steps = if *squared == 0.0 { 0.0 } else { *steps + 1.0 };
                *squared = squared.min((*steps * down).powi(2));
            }
        }
    };
    sweep(&mut (0..rows));
    sweep(&mut (0..rows).rev());
    let mut envelope = Envelope::default();
    for row in squared.chunks_exact_mut(columns.max(1)) {
        envelope.lower(row, across);
    }
    squared
}

/// The lower envelope of parabolas, one at each pixel of a row.
#[derive(Default)]
struct Envelope {
    heights: Vec<f64>,
    /// Places of the parabolas on the envelope, and from where on each is the lowest.
    parabolas: Vec<(usize, f64)>,
}

impl Envelope {
    /// Replaces each height by the least of all heights plus the squared distance from their place.
    fn lower(&mut self, row: &mut [f64], spacing: f64) {
        self.heights.clear();
        self.heights.extend_from_slice(row);
        self.parabolas.clear();
        let place = |i: usize| i as f64 * spacing;
        let heights = &self.heights;
        // Where the parabola at `b`, right of the one at `a`, becomes the lower one.
        let meet = |a: usize, b: usize| {
            let (x, y) = (place(a), place(b));
            0.5 * ((heights[b] - heights[a]) / (y - x) + x + y)
        };
        for i in (0..row.len()).filter(|&i| heights[i].is_finite()) {
            let mut from = f64::NEG_INFINITY;
            while let Some(&(last, last_from)) = self.parabolas.last() {
                from = meet(last, i);
                if from > last_from {
                    break;
                }
                self.parabolas.pop();
                from = f64::NEG_INFINITY;
            }
            self.parabolas.push((i, from));
        }
        if self.parabolas.is_empty() {
            return;
        }
        let mut at = 0;
        for (i, value) in row.iter_mut().enumerate() {
            while self.parabolas.get(at + 1).is_some_and(|&(_, from)| from <= place(i)) {
                at += 1;
            }
            let lowest = self.parabolas[at].0;
            *value = heights[lowest] + (place(i) - place(lowest)).powi(2);
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::{RngExt, SeedableRng};

    use super::*;

    #[test]
    fn distances_are_those_of_trying_every_pixel() {
        let mut rng = rand_pcg::Pcg64::seed_from_u64(4);
        for (columns, rows, misses) in [(17, 11, 5), (1, 9, 1), (13, 1, 2), (8, 8, 0)] {
            let mut hit = vec![true; columns * rows];
            (0..misses).for_each(|_| hit[rng.random_range(0..columns * rows)] = false);
            let found = squared_distances(&hit, columns, [0.7, 1.3]);
            for (at, found) in found.iter().enumerate() {
                let [x, y] = [at % columns, at / columns].map(|i| i as f64);
                let to = |other: usize| {
                    let [u, v] = [other % columns, other / columns].map(|i| i as f64);
                    (0.7 * (u - x)).powi(2) + (1.3 * (v - y)).powi(2)
                };
                let nearest = (0..hit.len()).filter(|&i| !hit[i]).map(to).fold(f64::INFINITY, f64::min);
                let is_same = *found == nearest || (found - nearest).abs() < 1e-9;
                assert!(is_same, "{columns} × {rows}, pixel {at}: {found}, not {nearest}");
            }
        }
    }
}
