//! MetaImage (`.mha`): a single-file volume format that ITK, SimpleITK, 3D Slicer and ParaView read.

use std::io::{self, Write};
use std::path::Path;

use super::atomic::write_atomically;
use super::image::{FloatImage, Geometry, write_little_endian};
use crate::Result;

/// MetaIO keeps a comment in 255 characters; a longer one would be cut by readers.
const LONGEST_COMMENT: usize = 200;

/// Writes an image as a MetaImage of one slice: `columns` × `rows` × 1 little-endian 32-bit floats, with
/// spacing, direction and the first pixel's centre in LPS mm. `comment` says what the values are and in which
/// unit; it is kept to 200 printable ASCII characters. Returns the number of bytes.
///
/// The nine numbers of `TransformMatrix` are the column axis, the row axis and the normal, one after the other:
/// ITK's direction matrix, whose *columns* are the axes, written column by column. Numbers are written so that
/// reading them returns the same f64. Values that are not finite are written as they are.
///
/// # Errors
/// If the file cannot be written. Source: MetaIO documentation, *MetaObject tags* and *MetaImage tags*.
pub fn write(path: &Path, image: &FloatImage, geometry: &Geometry, comment: &str) -> Result<u64> {
    write_atomically(path, |out| {
        write_header(out, image, geometry, comment)?;
        write_little_endian(image, out)
    })
}

fn write_header(
    out: &mut dyn Write,
    image: &FloatImage,
    geometry: &Geometry,
    comment: &str,
) -> io::Result<()> {
    writeln!(out, "ObjectType = Image")?;
    let comment = printable(comment);
    if !comment.is_empty() {
        writeln!(out, "Comment = {comment}")?;
    }
    writeln!(out, "NDims = 3")?;
    writeln!(out, "BinaryData = True")?;
    writeln!(out, "BinaryDataByteOrderMSB = False")?;
    writeln!(out, "CompressedData = False")?;
    writeln!(out, "TransformMatrix = {}", listed(geometry.axes().into_iter().flat_map(|a| a.to_array())))?;
    writeln!(out, "Offset = {}", listed(geometry.origin_mm().to_array()))?;
    writeln!(out, "CenterOfRotation = 0 0 0")?;
    writeln!(out, "ElementSpacing = {}", listed(geometry.spacing_mm()))?;
    writeln!(out, "DimSize = {} {} 1", image.width(), image.height())?;
    writeln!(out, "ElementType = MET_FLOAT")?;
    // The pixels begin right after this line.
    writeln!(out, "ElementDataFile = LOCAL")
}

/// Numbers in their shortest form that reads back the same; −0 as 0.
fn listed(numbers: impl IntoIterator<Item = f64>) -> String {
    numbers.into_iter().map(|x| (x + 0.0).to_string()).collect::<Vec<_>>().join(" ")
}

fn printable(comment: &str) -> String {
    let line = comment.chars().map(|c| if c.is_ascii_graphic() || c == ' ' { c } else { '?' });
    line.take(LONGEST_COMMENT).collect::<String>().trim().to_owned()
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use glam::DVec3;

    use super::super::image::image_of;
    use super::*;

    /// A reader of the header's `Key = value` lines and of the floats after the last, from the format's definition.
    fn read(bytes: &[u8]) -> (HashMap<String, String>, Vec<f32>) {
        let mut tags = HashMap::new();
        let mut rest = bytes;
        loop {
            let end = rest.iter().position(|&b| b == b'\n').expect("a line");
            let line = std::str::from_utf8(&rest[..end]).expect("text");
            let (key, value) = line.split_once(" = ").expect("a tag");
            assert!(tags.insert(key.to_owned(), value.to_owned()).is_none(), "{key} twice");
            rest = &rest[end + 1..];
            if key == "ElementDataFile" {
                break;
            }
        }
        assert_eq!(rest.len() % 4, 0);
        let floats = rest.chunks(4).map(|b| f32::from_le_bytes([b[0], b[1], b[2], b[3]])).collect();
        (tags, floats)
    }

    fn numbers(text: &str) -> Vec<f64> {
        text.split(' ').map(|word| word.parse().expect("a number")).collect()
    }

    #[test]
    fn an_oblique_image_reads_back_with_the_same_bits() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("oblique.mha");
        let column_axis = DVec3::new(2.0, 3.0, 6.0) / 7.0;
        // With these axes the matrix is not symmetric: rows in place of columns would be noticed.
        let row_axis = DVec3::new(6.0, 2.0, -3.0) / 7.0;
        let origin = DVec3::new(0.1, -1e-7, 1133.59);
        let geometry =
            Geometry::new(origin, column_axis, row_axis, [0.388, 1.0 / 3.0, 1.0]).expect("a geometry");
        let pixels = vec![0.0, 0.1, f32::MIN_POSITIVE, -2.5, f32::INFINITY, 6.0];
        let image = image_of(3, 2, pixels.clone()).expect("an image");

        let bytes = write(&path, &image, &geometry, "own length of «liver», mm\n").expect("written");

        let file = std::fs::read(&path).expect("read");
        assert_eq!(bytes, file.len() as u64);
        let (tags, floats) = read(&file);
        assert_eq!(floats, pixels);
        assert_eq!(tags["DimSize"], "3 2 1");
        assert_eq!(tags["ElementType"], "MET_FLOAT");
        assert_eq!(tags["BinaryDataByteOrderMSB"], "False");
        assert_eq!(tags["Comment"], "own length of ?liver?, mm?");
        assert_eq!(numbers(&tags["Offset"]), origin.to_array());
        assert_eq!(numbers(&tags["ElementSpacing"]), [0.388, 1.0 / 3.0, 1.0]);
        let matrix = numbers(&tags["TransformMatrix"]);
        assert_eq!(matrix[..3], column_axis.to_array());
        assert_eq!(matrix[3..6], row_axis.to_array());
        assert_eq!(matrix[6..], column_axis.cross(row_axis).normalize().to_array());
        assert!(file.starts_with(b"ObjectType = Image\n"), "readers expect this tag first");
    }
}
