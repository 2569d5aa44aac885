//! Rendered pictures as files.

use std::path::Path;

use super::image::{RgbImage, image_of};
use super::png::{Labels, write_rgb};
use crate::error::Result;
use crate::modes::raytrace::Picture;
use crate::physics::composite::encode_srgb8;

/// Writes a picture as 8-bit sRGB PNG. Returns the number of bytes.
///
/// # Errors
/// If the file cannot be written.
pub fn write(path: &Path, picture: &Picture) -> Result<u64> {
    write_rgb(path, &image(picture, |_, colour| encode_srgb8(colour))?, Labels::default())
}

/// Writes the map of traced pixels: white where an object with a tree was traced, the picture at half its brightness
/// elsewhere. Returns the number of bytes.
///
/// # Errors
/// If the file cannot be written.
pub fn write_map(path: &Path, picture: &Picture) -> Result<u64> {
    let pixel = |traced: bool, colour: [f32; 3]| {
        if traced { [255; 3] } else { encode_srgb8(colour).map(|channel| channel / 2) }
    };
    write_rgb(path, &image(picture, pixel)?, Labels::default())
}

fn image(picture: &Picture, pixel: impl Fn(bool, [f32; 3]) -> [u8; 3]) -> Result<RgbImage> {
    let (columns, rows) = picture.size();
    let pixels = picture.traced().iter().zip(picture.colours());
    let samples = pixels.flat_map(|(&traced, &colour)| pixel(traced, colour)).collect();
    image_of(columns as usize, rows as usize, samples)
}
