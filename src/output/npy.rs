//! NPY: one array as NumPy reads and writes it.

use std::path::Path;

use super::atomic::write_atomically;
use super::image::{FloatImage, write_little_endian};
use crate::Result;

/// Writes an image as an NPY 1.0 array of shape (rows, columns), little-endian 32-bit floats in C order. Returns
/// the number of bytes. Spacing and frame have no place in the format.
///
/// # Errors
/// If the file cannot be written. Source: NumPy Enhancement Proposal 1, *A simple file format for NumPy arrays*.
pub fn write(path: &Path, image: &FloatImage) -> Result<u64> {
    write_atomically(path, |out| {
        out.write_all(&header(image))?;
        write_little_endian(image, out)
    })
}

/// Magic word, version 1.0, the dictionary's length, and the dictionary padded so that the data are aligned.
fn header(image: &FloatImage) -> Vec<u8> {
    const ALIGNMENT: usize = 64;
    const FIXED_BYTES: usize = 10;
    let mut dictionary = format!(
        "{{'descr': '<f4', 'fortran_order': False, 'shape': ({}, {}), }}",
        image.height(),
        image.width()
    );
    let total = (FIXED_BYTES + dictionary.len() + 1).next_multiple_of(ALIGNMENT);
    let padding = total - FIXED_BYTES - dictionary.len() - 1;
    dictionary.push_str(&" ".repeat(padding));
    dictionary.push('\n');

    // Below 65 536 by far: two side lengths of ten digits at most.
    let length = (dictionary.len() as u16).to_le_bytes();
    let mut bytes = Vec::with_capacity(total);
    bytes.extend(b"\x93NUMPY\x01\x00");
    bytes.extend(length);
    bytes.extend(dictionary.into_bytes());
    bytes
}

#[cfg(test)]
mod tests {
    use super::super::image::image_of;
    use super::*;

    #[test]
    fn the_header_is_aligned_and_says_shape_and_type() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("a.npy");
        for (columns, rows) in [(3, 2), (1, 1000), (123, 45)] {
            let pixels: Vec<f32> = (0..columns * rows).map(|i| i as f32 - 0.5).collect();
            let image = image_of(columns, rows, pixels.clone()).expect("an image");
            write(&path, &image).expect("written");

            let bytes = std::fs::read(&path).expect("read");
            assert_eq!(&bytes[..8], b"\x93NUMPY\x01\x00");
            let data = 10 + usize::from(u16::from_le_bytes([bytes[8], bytes[9]]));
            assert_eq!(data % 64, 0);
            let dictionary = std::str::from_utf8(&bytes[10..data]).expect("text");
            assert!(dictionary.ends_with('\n'));
            let expected = format!("'descr': '<f4', 'fortran_order': False, 'shape': ({rows}, {columns}), ");
            assert_eq!(dictionary.trim().trim_matches(['{', '}']), expected);
            let floats: Vec<f32> =
                bytes[data..].chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
            assert_eq!(floats, pixels);
        }
    }
}
