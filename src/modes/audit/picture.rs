//! Pictures of one view's errors.

use rayon::prelude::*;

use super::finder::{Answer, Batch, Ready};
use super::{Audit, RaySet};
use crate::error::Result;
use crate::geometry::{Region, Segment};
use crate::modes::Control;
use crate::modes::project::{Found, tiles};

/// Images of one view, row by row.
#[derive(Clone, Debug)]
pub struct Pictures {
    /// Columns and rows.
    pub size: (u32, u32),
    /// p = Σ μL at the audit's energy, from the reference's lengths.
    pub reference: Vec<f32>,
    /// The same from the method's.
    pub method: Vec<f32>,
    /// The largest error of any organ's length, mm.
    pub error_mm: Vec<f32>,
    /// How each pixel was found by the method, the organ that took most telling.
    pub found: Vec<Found>,
}

/// One pixel of all pictures.
#[derive(Clone, Copy, Default)]
struct Pixel {
    reference: f64,
    method: f64,
    error_mm: f64,
    found: Found,
}

impl Audit<'_> {
    /// The pictures of one of the views. `None` if there is no such view.
    ///
    /// # Errors
    /// [`Error::Interrupted`](crate::Error::Interrupted).
    pub fn pictures(&self, view: usize, control: &Control) -> Result<Option<Pictures>> {
        let RaySet::Views(views) = &self.settings.rays else { return Ok(None) };
        let Some(view) = views.get(view) else { return Ok(None) };
        let (method, against) = (self.method.ready(Some(view)), self.against.ready(Some(view)));
        let comparison = self.comparison();
        let tiles = tiles(view.size()).into_par_iter().map(|region| {
            control.check()?;
            let rays: Vec<Segment> = region.places().map(|(c, r)| view.segment(c, r)).collect();
            let organs = comparison.touched(view, &region);
            let pixels =
                self.pixels(&*method, &*against, Batch { rays: &rays, region: Some(&region) }, &organs);
            Ok((region, pixels))
        });
        let tiles: Vec<(Region, Vec<Pixel>)> = tiles.collect::<Result<_>>()?;
        let columns = view.size().0 as usize;
        let mut image = vec![Pixel::default(); view.pixels() as usize];
        for (region, pixels) in &tiles {
            for ((column, row), pixel) in region.places().zip(pixels) {
                image[row as usize * columns + column as usize] = *pixel;
            }
        }
        Ok(Some(Pictures {
            size: view.size(),
            reference: image.iter().map(|pixel| pixel.reference as f32).collect(),
            method: image.iter().map(|pixel| pixel.method as f32).collect(),
            error_mm: image.iter().map(|pixel| pixel.error_mm as f32).collect(),
            found: image.iter().map(|pixel| pixel.found).collect(),
        }))
    }

    fn pixels(&self, method: &dyn Ready, against: &dyn Ready, batch: Batch, organs: &[usize]) -> Vec<Pixel> {
        let mut pixels = vec![Pixel::default(); batch.rays.len()];
        let (mut near, mut exact): (Vec<Answer>, Vec<Answer>) = Default::default();
        for &organ in organs {
            method.find(organ, batch, &mut near);
            against.find(organ, batch, &mut exact);
            let is_in_tree = self.method.is_in_tree(organ);
            for ((pixel, near), exact) in pixels.iter_mut().zip(&near).zip(&exact) {
                pixel.reference += self.optics.exponent(organ, exact.length_mm);
                pixel.method += self.optics.exponent(organ, near.length_mm);
                pixel.error_mm = pixel.error_mm.max((near.length_mm - exact.length_mm).abs());
                // As on a projection's map: organs without a tree do not count, nor do cells proved empty.
                let counts = is_in_tree && (near.found == Found::Traced || near.length_mm > 0.0);
                if counts {
                    pixel.found = pixel.found.max(near.found);
                }
            }
        }
        pixels
    }
}
