//! The pictures of a page: the exact image, the method's, their errors in colour, and what was traced.
//!
//! Large images are pooled: of the pixels that share one of the page's, the largest error is shown, so that a single
//! wrong pixel is seen; of the others, the first.

use crate::error::Result;
use crate::modes::audit::Pictures;
use crate::modes::project::Found;
use crate::output::image::{RgbImage, image_of};
use crate::output::page::{base64, short};
use crate::output::png;

/// The longest side of a picture on the page, pixels.
const LONGEST_SIDE: u32 = 512;

/// Colours of errors from none to the largest, sRGB: black, purple, red, orange, pale yellow, as in ColorBrewer-like maps
/// whose lightness rises evenly.
const HEAT: [[u8; 3]; 6] =
    [[0, 0, 4], [66, 10, 104], [147, 38, 103], [221, 81, 58], [252, 165, 10], [252, 255, 164]];

/// Places of the pixels that become one.
type Pixels<'a> = dyn Iterator<Item = usize> + 'a;

/// The colour that pixels make together.
type Colour<'a> = dyn Fn(&mut Pixels) -> [u8; 3] + 'a;

/// A picture, ready for the page.
pub struct Panel {
    /// What it shows.
    pub title: &'static str,
    /// How it is to be read.
    pub note: String,
    /// The image's data as an address.
    pub data: String,
}

/// The panels of a view.
///
/// # Errors
/// If an image cannot be encoded.
pub fn panels(pictures: &Pictures, tolerance_mm: f64) -> Result<Vec<Panel>> {
    let pool = Pool::of(pictures.size);
    let most = pictures.reference.iter().copied().fold(0.0, f32::max).max(f32::MIN_POSITIVE);
    let worst = pictures.error_mm.iter().copied().filter(|e| e.is_finite()).fold(0.0, f32::max);
    let grey = |p: &f32| [encode_grey(p / most); 3];
    let first = |pixels: &mut Pixels| pixels.next().unwrap_or(0);
    let shown = |title, note: String, colour: &Colour| -> Result<Panel> {
        let samples = pool.map(colour);
        let image: RgbImage = image_of(pool.columns as usize, pool.rows as usize, samples)?;
        let data = format!("data:image/png;base64,{}", base64::encode(&png::rgb_bytes(&image)?));
        Ok(Panel { title, note, data })
    };
    let scale = format!("p from 0 (black) to {} (white), the same in both", short(most.into()));
    let heat_note = format!(
        "largest error of any organ's length: black none, pale yellow {} mm, on a square-root scale; \
         the tolerance is {tolerance_mm} mm",
        short(worst.into())
    );
    Ok(vec![
        shown("Exact", scale.clone(), &|pixels| grey(&pictures.reference[first(pixels)]))?,
        shown("Method", scale, &|pixels| grey(&pictures.method[first(pixels)]))?,
        shown("Error", heat_note, &|pixels| {
            let error = pixels.map(|i| pictures.error_mm[i]).fold(0.0, f32::max);
            heat((error / worst.max(f32::MIN_POSITIVE)).sqrt())
        })?,
        shown(
            "Traced pixels",
            "white: an organ's tree had to trace; grey: all were interpolated; black: no tree met".into(),
            &|pixels| match pixels.map(|i| pictures.found[i]).max().unwrap_or_default() {
                Found::Nothing => [0; 3],
                Found::Interpolated => [96; 3],
                Found::Traced => [255; 3],
            },
        )?,
    ])
}

/// A share of the greatest value as an 8-bit grey; linear, as a radiograph's.
fn encode_grey(share: f32) -> u8 {
    (255.0 * share.clamp(0.0, 1.0)).round() as u8
}

/// The colour of a share from 0 to 1.
fn heat(share: f32) -> [u8; 3] {
    let at = share.clamp(0.0, 1.0) * (HEAT.len() - 1) as f32;
    let below = (at as usize).min(HEAT.len() - 2);
    let part = at - below as f32;
    std::array::from_fn(|c| {
        let [a, b] = [HEAT[below][c], HEAT[below + 1][c]].map(f32::from);
        (a + part * (b - a)).round() as u8
    })
}

/// Squares of pixels that become one.
struct Pool {
    size: (u32, u32),
    side: u32,
    columns: u32,
    rows: u32,
}

impl Pool {
    fn of(size: (u32, u32)) -> Self {
        let side = size.0.max(size.1).div_ceil(LONGEST_SIDE).max(1);
        Self { size, side, columns: size.0.div_ceil(side), rows: size.1.div_ceil(side) }
    }

    /// The colours of the pooled image, row by row.
    fn map(&self, colour: &Colour) -> Vec<u8> {
        let mut samples = Vec::with_capacity(3 * (self.columns * self.rows) as usize);
        for row in 0..self.rows {
            for column in 0..self.columns {
                let part = |at: u32, end: u32| at * self.side..((at + 1) * self.side).min(end);
                let mut pixels = part(row, self.size.1).flat_map(|r| {
                    part(column, self.size.0).map(move |c| r as usize * self.size.0 as usize + c as usize)
                });
                samples.extend(colour(&mut pixels));
            }
        }
        samples
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_wrong_pixel_of_a_large_image_is_seen() {
        let (columns, rows) = (1500, 40);
        let mut error_mm = vec![0.0; (columns * rows) as usize];
        error_mm[20_003] = 3.0;
        let pool = Pool::of((columns, rows));
        assert_eq!((pool.side, pool.columns, pool.rows), (3, 500, 14));
        let seen = pool.map(&|pixels| [u8::from(pixels.map(|i| error_mm[i]).fold(0.0, f64::max) > 0.0); 3]);
        assert_eq!(seen.iter().filter(|&&c| c == 1).count(), 3);
        assert_eq!(seen.len(), 3 * 500 * 14);
        assert_eq!((heat(0.0), heat(1.0)), (HEAT[0], HEAT[5]));
    }
}
