//! The files of one projected view.

use std::collections::HashSet;
use std::path::{Path, PathBuf};

use rayon::prelude::*;
use serde::Serialize;

use super::png::{self, Labels, Window};
use super::{FloatImage, Geometry, RgbImage, create_folder, image_of, metaimage, npy};
use crate::error::Result;
use crate::modes::project::{Found, Projection};
use crate::physics::composite::{encode_srgb8, over};
use crate::scene::{Scene, View};

/// What colour images have behind the organs: black, as a radiograph's air.
const BACKGROUND: [f32; 3] = [0.0; 3];

/// Which files to write, and how.
#[derive(Clone, Debug)]
pub struct Products {
    /// 16-bit PNG of p.
    pub radiograph: bool,
    /// 8-bit PNG of the organs in colour.
    pub colour: bool,
    /// Float image of T.
    pub transmission: bool,
    /// Float image of p.
    pub line_integral: bool,
    /// Float image of each organ's own length.
    pub lengths: bool,
    /// 8-bit PNG of which pixels were traced and which interpolated.
    pub map: bool,
    /// Each float image also as NPY.
    pub npy: bool,
    /// The radiograph's window; found from the image if `None`.
    pub window: Option<[f64; 2]>,
    /// Which end of the window is white.
    pub polarity: png::Polarity,
}

/// One written file, for the sidecar.
#[derive(Clone, Debug, Serialize)]
pub struct WrittenFile {
    /// Its path within the output folder.
    pub file: String,
    /// What its pixels are.
    pub quantity: String,
    /// Their unit; `1` for a ratio.
    pub unit: &'static str,
    /// The organ, where the file is about one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub organ: Option<String>,
    /// The values of p at the grey scale's ends, where it is a windowed picture.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub window: Option<[f64; 2]>,
    /// Which end of the window is white.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub polarity: Option<&'static str>,
    /// Its size.
    pub bytes: u64,
}

/// Writes the products of a view into `folder`, under names that start with `stem`; returns them in order.
///
/// # Errors
/// The first file that cannot be written. Files are whole or absent.
pub fn write(
    folder: &Path,
    stem: &str,
    scene: &Scene,
    view: &View,
    projection: &Projection,
    products: &Products,
) -> Result<Vec<WrittenFile>> {
    let writer = ViewWriter { folder, stem, view, projection, products, geometry: geometry(view)? };
    let mut files = Vec::new();
    if products.radiograph || products.line_integral {
        let p = writer.float_image(projection.line_integral())?;
        if products.radiograph {
            files.push(writer.radiograph(&p)?);
        }
        if products.line_integral {
            files.extend(writer.floats("p", &p, "p = -ln(I/I0)", "1", None)?);
        }
    }
    if products.colour {
        files.push(writer.colour()?);
    }
    if products.map {
        files.push(writer.map()?);
    }
    if products.transmission {
        let t = writer.float_image(projection.transmission())?;
        files.extend(writer.floats("transmission", &t, "transmission I/I0", "1", None)?);
    }
    if products.lengths {
        create_folder(&folder.join(writer.lengths_folder()))?;
        let lengths: Vec<Vec<WrittenFile>> = file_stems(scene)
            .par_iter()
            .enumerate()
            .map(|(organ, stem)| {
                let image = writer.float_image(projection.own_length_mm(organ))?;
                let name = &scene.organs[organ].name;
                writer.floats(stem, &image, &format!("own length in {name}"), "mm", Some(name))
            })
            .collect::<Result<_>>()?;
        files.extend(lengths.into_iter().flatten());
    }
    Ok(files)
}

/// A file name for each organ: its own name where that is safe everywhere, numbered where two would be alike.
pub fn file_stems(scene: &Scene) -> Vec<String> {
    distinct(scene.organs.iter().map(|organ| safe_name(&organ.name)))
}

/// Names of which no two are alike, also where upper and lower case are the same.
fn distinct(names: impl Iterator<Item = String>) -> Vec<String> {
    let mut taken = HashSet::new();
    let mut take = |name: &String| taken.insert(name.to_lowercase());
    names
        .enumerate()
        .map(|(i, name)| match take(&name) {
            true => name,
            // A numbered name may itself be taken, by an organ that is called so.
            false => (i + 1..).map(|n| format!("{name}-{n}")).find(&mut take).unwrap_or(name),
        })
        .collect()
}

/// The longest name, bytes: file systems take 255, of which pose, product and a temporary file's ending need some 70.
const MAX_NAME_BYTES: usize = 180;

/// `name` as one file name on every system: everything but letters, digits, `-` and `_` replaced; what Windows keeps for
/// its devices gets an underscore; what is too long is cut, and ends in a number made from the whole name.
pub fn safe_name(name: &str) -> String {
    let plain: String =
        name.chars().map(|c| if c.is_alphanumeric() || "-_".contains(c) { c } else { '_' }).collect();
    if is_device(&plain) || plain.is_empty() {
        return plain + "_";
    }
    if plain.len() <= MAX_NAME_BYTES {
        return plain;
    }
    let suffix = format!("-{:016x}", fnv1a(name));
    let cut = (0..=MAX_NAME_BYTES - suffix.len()).rev().find(|&i| plain.is_char_boundary(i)).unwrap_or(0);
    format!("{}{suffix}", &plain[..cut])
}

/// Whether Windows takes the name for a device, whatever ending follows
/// (<https://learn.microsoft.com/windows/win32/fileio/naming-a-file>).
fn is_device(name: &str) -> bool {
    let name = name.to_lowercase();
    let is_numbered = |digit: &str| {
        matches!(digit.chars().next(), Some('0'..='9' | '¹' | '²' | '³')) && digit.chars().count() == 1
    };
    matches!(name.as_str(), "con" | "prn" | "aux" | "nul")
        || ["com", "lpt"].iter().any(|port| name.strip_prefix(port).is_some_and(is_numbered))
}

/// The 64-bit FNV-1a hash: the same on every system and in every version, as the names of files should be
/// (Fowler, Noll & Vo).
fn fnv1a(text: &str) -> u64 {
    text.bytes().fold(0xcbf2_9ce4_8422_2325, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0000_0100_0000_01b3)
    })
}

/// Where the view's pixels are. The slice is as thick as a pixel is wide, for readers that draw volumes.
fn geometry(view: &View) -> Result<Geometry> {
    let [column_axis, row_axis, _] = view.direction();
    let (width, height) = view.spacing_mm();
    Geometry::new(view.origin_mm(), column_axis, row_axis, [width, height, width])
}

struct ViewWriter<'a> {
    folder: &'a Path,
    stem: &'a str,
    view: &'a View,
    projection: &'a Projection,
    products: &'a Products,
    geometry: Geometry,
}

impl ViewWriter<'_> {
    fn float_image(&self, pixels: Vec<f32>) -> Result<FloatImage> {
        let (columns, rows) = self.projection.size();
        image_of(columns as usize, rows as usize, pixels)
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.join(name)
    }

    fn lengths_folder(&self) -> String {
        format!("{}-lengths", self.stem)
    }

    fn labels(&self) -> Labels<'static> {
        let (width, height) = self.view.spacing_mm();
        const TEXTS: &[(&str, &str)] = &[("Software", concat!("chordfield ", env!("CARGO_PKG_VERSION")))];
        Labels { pixel_mm: Some([width, height]), texts: TEXTS }
    }

    fn radiograph(&self, p: &FloatImage) -> Result<WrittenFile> {
        let polarity = self.products.polarity;
        // From 0, so that air is the end of the scale in every view.
        let [low, high] = self.products.window.unwrap_or_else(|| [0.0, png::auto_window(p).high()]);
        let window = Window::new(low, high, polarity).unwrap_or_else(|| png::auto_window(p));
        let file = format!("{}-radiograph.png", self.stem);
        let bytes = png::write_grey(&self.path(&file), p, &window, "p = -ln(I/I0), no unit", self.labels())?;
        Ok(WrittenFile {
            file,
            quantity: "p = -ln(I/I0), windowed to 16-bit grey".into(),
            unit: "1",
            organ: None,
            window: Some([window.low(), window.high()]),
            polarity: Some(window.polarity().name()),
            bytes,
        })
    }

    fn colour(&self) -> Result<WrittenFile> {
        let colours = self.projection.colour().into_iter();
        let samples = colours.flat_map(|c| encode_srgb8(over(c, BACKGROUND))).collect();
        let (columns, rows) = self.projection.size();
        let image: RgbImage = image_of(columns as usize, rows as usize, samples)?;
        let file = format!("{}-colour.png", self.stem);
        let bytes = png::write_rgb(&self.path(&file), &image, self.labels())?;
        let quantity = "organs composited front to back, sRGB".into();
        Ok(WrittenFile { file, quantity, unit: "1", organ: None, window: None, polarity: None, bytes })
    }

    /// The paper's colour-coded picture: traced pixels white.
    fn map(&self) -> Result<WrittenFile> {
        let grey = |found: Found| match found {
            Found::Nothing => 0,
            Found::Interpolated => 96,
            Found::Traced => 255,
        };
        let samples = self.projection.found().into_iter().flat_map(|found| [grey(found); 3]).collect();
        let (columns, rows) = self.projection.size();
        let image: RgbImage = image_of(columns as usize, rows as usize, samples)?;
        let file = format!("{}-map.png", self.stem);
        let bytes = png::write_rgb(&self.path(&file), &image, self.labels())?;
        let quantity = "white: traced; grey: interpolated; black: no organ asked or met".into();
        Ok(WrittenFile { file, quantity, unit: "1", organ: None, window: None, polarity: None, bytes })
    }

    /// A float image as MetaImage, and as NPY if asked for.
    fn floats(
        &self,
        name: &str,
        image: &FloatImage,
        quantity: &str,
        unit: &'static str,
        organ: Option<&str>,
    ) -> Result<Vec<WrittenFile>> {
        let base = match organ {
            Some(_) => format!("{}/{name}", self.lengths_folder()),
            None => format!("{}-{name}", self.stem),
        };
        let record = |file: String, bytes: u64| WrittenFile {
            file,
            quantity: quantity.to_owned(),
            unit,
            organ: organ.map(str::to_owned),
            window: None,
            polarity: None,
            bytes,
        };
        let mha = format!("{base}.mha");
        let comment = format!("{quantity}, unit {unit}, patient LPS mm");
        let bytes = metaimage::write(&self.path(&mha), image, &self.geometry, &comment)?;
        let mut files = vec![record(mha, bytes)];
        if self.products.npy {
            let file = format!("{base}.npy");
            let bytes = npy::write(&self.path(&file), image)?;
            files.push(record(file, bytes));
        }
        Ok(files)
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::scene::{Panel, Pose};

    #[test]
    fn names_that_would_be_one_file_are_numbered_and_stay_apart() {
        let names = ["a b", "a_b-3", "a?b", "A_B", "kidney"].map(safe_name);
        assert_eq!(
            distinct(names.into_iter()),
            ["a_b", "a_b-3", "a_b-4", "A_B-5", "kidney"].map(String::from)
        );
    }

    #[test]
    fn long_names_are_cut_to_one_length_and_stay_apart() {
        let (a, b) = (safe_name(&("ä".repeat(300) + "a")), safe_name(&("ä".repeat(300) + "b")));
        assert!(a.len() <= MAX_NAME_BYTES && a.len() > MAX_NAME_BYTES - 4, "{}", a.len());
        assert!(a != b && a[..150] == b[..150]);
        let longest = "x".repeat(MAX_NAME_BYTES);
        assert_eq!(safe_name(&longest), longest);
        // Published with the algorithm: what files are called must never change.
        assert_eq!(fnv1a("foobar"), 0x8594_4171_f739_67e8);
    }

    #[test]
    fn names_of_windows_devices_get_an_underscore() {
        assert_eq!(
            ["con", "NUL", "Lpt1", "com³", ""].map(safe_name),
            ["con_", "NUL_", "Lpt1_", "com³_", "_"]
        );
        assert_eq!(["cone", "com", "com10", "aux-1"].map(safe_name), ["cone", "com", "com10", "aux-1"]);
    }

    #[test]
    fn a_calibrated_view_with_skewed_pixels_has_a_geometry() {
        let row_step = DVec3::new(0.005, 0.0, -1.0).normalize();
        let panel = Panel::centred(DVec3::new(0.0, 500.0, 0.0), DVec3::X, row_step, [4, 3]);
        let view =
            View::cone(DVec3::new(0.0, -1000.0, 0.0), panel, Pose::Matrix { index: 0 }).expect("a view");
        let geometry = geometry(&view).expect("a geometry");
        assert_eq!(geometry.axes()[..2], [DVec3::X, row_step]);
        assert!((geometry.axes()[2] - DVec3::Y).length() < 1e-15);
    }
}
