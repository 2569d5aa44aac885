//! PNG: images to look at.
//!
//! Encoded by the crate `png`, not by the encoder of `image`, which writes no texts, no pixel size and no rows one at a
//! time.

use std::io::{self, Write};
use std::path::Path;

use ::image::{ImageBuffer, Pixel};
use ::png::{BitDepth, ColorType, Compression, Encoder, PixelDimensions, SrgbRenderingIntent, Unit};

use super::atomic::write_atomically;
use super::image::{FloatImage, RgbImage, RgbaImage, sample_rows};
use crate::{Error, Result};

/// Which end of a window is white, for values that grow with attenuation (p or a length).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Polarity {
    /// High values are white, as on a radiograph on film.
    BoneWhite,
    /// High values are black, as on a fluoroscopy screen.
    BoneBlack,
}

impl Polarity {
    /// The polarity's name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::BoneWhite => "bone white",
            Self::BoneBlack => "bone black",
        }
    }
}

/// The values that span a grey scale: linear from `low` to `high`, clamped beyond.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Window {
    low: f64,
    high: f64,
    polarity: Polarity,
}

impl Window {
    /// The window from `low` to `high`, in the image's unit. `None` if an end is not finite or `low ≥ high`.
    pub fn new(low: f64, high: f64, polarity: Polarity) -> Option<Self> {
        (low.is_finite() && high.is_finite() && (high - low).is_finite() && low < high).then_some(Self {
            low,
            high,
            polarity,
        })
    }

    /// The value at the scale's lower end.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// The value at the scale's upper end.
    pub fn high(&self) -> f64 {
        self.high
    }

    /// Which end is white.
    pub fn polarity(&self) -> Polarity {
        self.polarity
    }

    /// The 16-bit grey of a value: the nearest of 65 536 steps. A value that is not a number is shown as `low`.
    pub fn grey(&self, value: f32) -> u16 {
        let share = (f64::from(value) - self.low) / (self.high - self.low);
        let rising = match self.polarity {
            Polarity::BoneWhite => share,
            Polarity::BoneBlack => 1.0 - share,
        };
        let no_number = f64::from(u8::from(self.polarity == Polarity::BoneBlack));
        let rising = if rising.is_nan() { no_number } else { rising.clamp(0.0, 1.0) };
        (rising * f64::from(u16::MAX)).round() as u16
    }
}

/// The window that shows what attenuates: from the 1st to the 99.5th percentile of all positive, finite values
/// of `image`, high values white.
///
/// Meant for p (or lengths), where 0 is air: background does not count, nor do a few pixels behind metal. If
/// all positive values are equal, the window reaches from 0 to them; if there are none, from 0 to 1.
pub fn auto_window(image: &FloatImage) -> Window {
    const LOW_SHARE: f64 = 0.01;
    const HIGH_SHARE: f64 = 0.995;
    let mut values: Vec<f32> = image.as_raw().iter().copied().filter(|v| *v > 0.0 && v.is_finite()).collect();
    let mut percentile = |share: f64| {
        let rank = (share * values.len().saturating_sub(1) as f64).round() as usize;
        if values.is_empty() {
            0.0
        } else {
            f64::from(*values.select_nth_unstable_by(rank, f32::total_cmp).1)
        }
    };
    let (low, high) = (percentile(LOW_SHARE), percentile(HIGH_SHARE));
    let polarity = Polarity::BoneWhite;
    Window::new(low, high, polarity).or_else(|| Window::new(0.0, high, polarity)).unwrap_or(Window {
        low: 0.0,
        high: 1.0,
        polarity,
    })
}

/// What a PNG says of itself besides its pixels.
#[derive(Clone, Copy, Debug, Default)]
pub struct Labels<'a> {
    /// The size of a pixel along a row and along a column, mm.
    pub pixel_mm: Option<[f64; 2]>,
    /// Further texts: a keyword of 1–79 Latin characters, and what it says.
    pub texts: &'a [(&'a str, &'a str)],
}

/// Writes an image as 16-bit grey PNG through a window. The file's texts state `quantity` (with its unit), the
/// window's ends and the polarity; its pixel size is that of `labels`, rounded to whole pixels per metre.
/// Returns the number of bytes.
///
/// # Errors
/// If a pixel is NaN (its column and row are named), a label is not valid, or the file cannot be written.
/// Infinite values are clamped. Source: W3C, *Portable Network Graphics (PNG) Specification*, third edition.
pub fn write_grey(
    path: &Path,
    image: &FloatImage,
    window: &Window,
    quantity: &str,
    labels: Labels,
) -> Result<u64> {
    if let Some(i) = image.as_raw().iter().position(|v| v.is_nan()) {
        let columns = image.width() as usize;
        let (column, row) = (i % columns, i / columns);
        return Err(Error::input(
            path.display().to_string(),
            format!("the {quantity} in column {column}, row {row} is not a number"),
            "please report this with the scene and the command",
        ));
    }
    let (low, high) = (window.low.to_string(), window.high.to_string());
    let own = [
        ("Quantity", quantity),
        ("Window low", &low),
        ("Window high", &high),
        ("Polarity", window.polarity.name()),
    ];
    write_atomically(path, |out| {
        let mut encoder = labelled_encoder(out, image.dimensions(), &own, labels)?;
        encoder.set_color(ColorType::Grayscale);
        encoder.set_depth(BitDepth::Sixteen);
        write_rows(encoder, image, |row, bytes| {
            bytes.extend(row.iter().flat_map(|&value| window.grey(value).to_be_bytes()));
        })
    })
}

/// Writes an image of 8-bit sRGB colours as PNG. Returns the number of bytes.
///
/// # Errors
/// If a label is not valid or the file cannot be written.
pub fn write_rgb(path: &Path, image: &RgbImage, labels: Labels) -> Result<u64> {
    write_colour(path, image, ColorType::Rgb, labels)
}

/// Writes an image of 8-bit sRGB colours with straight (not premultiplied) opacity as PNG. Returns the number
/// of bytes.
///
/// # Errors
/// If a label is not valid or the file cannot be written.
pub fn write_rgba(path: &Path, image: &RgbaImage, labels: Labels) -> Result<u64> {
    write_colour(path, image, ColorType::Rgba, labels)
}

fn write_colour<P: Pixel<Subpixel = u8>>(
    path: &Path,
    image: &ImageBuffer<P, Vec<u8>>,
    colour: ColorType,
    labels: Labels,
) -> Result<u64> {
    write_atomically(path, |out| encode_colour(out, image, colour, labels))
}

/// Encodes an image of 8-bit sRGB colours as the bytes of a PNG without labels, for a page that holds it.
///
/// # Errors
/// If the image has no pixels.
pub fn rgb_bytes(image: &RgbImage) -> Result<Vec<u8>> {
    let mut bytes = Vec::new();
    encode_colour(&mut bytes, image, ColorType::Rgb, Labels::default())
        .map_err(|e| Error::io("write", Path::new("an image as PNG"), e))?;
    Ok(bytes)
}

fn encode_colour<P: Pixel<Subpixel = u8>>(
    out: &mut dyn Write,
    image: &ImageBuffer<P, Vec<u8>>,
    colour: ColorType,
    labels: Labels,
) -> io::Result<()> {
    let mut encoder = labelled_encoder(out, image.dimensions(), &[], labels)?;
    encoder.set_color(colour);
    encoder.set_depth(BitDepth::Eight);
    encoder.set_source_srgb(SrgbRenderingIntent::RelativeColorimetric);
    write_rows(encoder, image, |row, bytes| bytes.extend(row))
}

fn labelled_encoder<'a>(
    out: &'a mut dyn Write,
    (columns, rows): (u32, u32),
    own: &[(&str, &str)],
    labels: Labels,
) -> io::Result<Encoder<'static, &'a mut dyn Write>> {
    let mut encoder = Encoder::new(out, columns, rows);
    // Twenty times as fast as the default, for files that are a fifth to a half larger: a view takes less time than its picture did.
    encoder.set_compression(Compression::Fast);
    encoder.set_pixel_dims(labels.pixel_mm.and_then(pixels_per_metre));
    for (keyword, text) in own.iter().chain(labels.texts) {
        if text.is_ascii() {
            encoder.add_text_chunk((*keyword).to_owned(), (*text).to_owned())?;
        } else {
            encoder.add_itxt_chunk((*keyword).to_owned(), (*text).to_owned())?;
        }
    }
    Ok(encoder)
}

/// The pixel size as PNG says it. `None` if it is not positive or rounds to nothing that PNG can say.
fn pixels_per_metre(pixel_mm: [f64; 2]) -> Option<PixelDimensions> {
    let [xppu, yppu] = pixel_mm.map(|mm| (1e3 / mm).round());
    let can_be_said = |density: f64| (1.0..=f64::from(i32::MAX)).contains(&density);
    (can_be_said(xppu) && can_be_said(yppu)).then_some(PixelDimensions {
        xppu: xppu as u32,
        yppu: yppu as u32,
        unit: Unit::Meter,
    })
}

/// Encodes row after row; one row at a time is held as bytes.
fn write_rows<P: Pixel>(
    encoder: Encoder<'static, &mut dyn Write>,
    image: &ImageBuffer<P, Vec<P::Subpixel>>,
    append: impl Fn(&[P::Subpixel], &mut Vec<u8>),
) -> io::Result<()> {
    let mut writer = encoder.write_header()?;
    let mut stream = writer.stream_writer()?;
    let mut bytes = Vec::new();
    for row in sample_rows(image) {
        bytes.clear();
        append(row, &mut bytes);
        stream.write_all(&bytes)?;
    }
    stream.finish()?;
    Ok(writer.finish()?)
}

#[cfg(test)]
mod tests {
    use ::image::{DynamicImage, ImageReader};

    use super::super::image::image_of;
    use super::*;

    fn open(path: &Path) -> DynamicImage {
        ImageReader::open(path).expect("a file").decode().expect("an image")
    }

    fn info(path: &Path) -> ::png::Info<'static> {
        let file = io::BufReader::new(std::fs::File::open(path).expect("a file"));
        ::png::Decoder::new(file).read_info().expect("a PNG").info().clone()
    }

    #[test]
    fn a_grey_image_has_16_bits_its_window_and_its_pixel_size() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("p.png");
        let pixels = vec![-1.0, 0.5, 1.5, 2.5, f32::INFINITY, f32::NEG_INFINITY];
        let image = image_of(3, 2, pixels).expect("an image");
        let window = Window::new(0.5, 2.5, Polarity::BoneWhite).expect("a window");
        let labels =
            Labels { pixel_mm: Some([0.388, 0.5]), texts: &[("View", "gantry 30°"), ("Software", "x")] };
        let bytes = write_grey(&path, &image, &window, "p = -ln(I/I0)", labels).expect("written");
        assert_eq!(bytes, path.metadata().expect("a file").len());

        let DynamicImage::ImageLuma16(grey) = open(&path) else { panic!("not 16-bit grey") };
        assert_eq!(grey.dimensions(), (3, 2));
        assert_eq!(grey.into_raw(), [0, 0, 32768, 65535, 65535, 0]);

        let info = info(&path);
        let texts: Vec<(&str, &str)> =
            info.uncompressed_latin1_text.iter().map(|t| (t.keyword.as_str(), t.text.as_str())).collect();
        let expected = [
            ("Quantity", "p = -ln(I/I0)"),
            ("Window low", "0.5"),
            ("Window high", "2.5"),
            ("Polarity", "bone white"),
            ("Software", "x"),
        ];
        assert_eq!(texts, expected);
        assert_eq!(info.utf8_text[0].get_text().expect("text"), "gantry 30°");
        let size = info.pixel_dims.expect("a pixel size");
        assert_eq!((size.xppu, size.yppu, size.unit), (2577, 2000, Unit::Meter));
    }

    #[test]
    fn bone_black_is_the_negative_of_bone_white() {
        let white = Window::new(-1.0, 3.0, Polarity::BoneWhite).expect("a window");
        let black = Window::new(-1.0, 3.0, Polarity::BoneBlack).expect("a window");
        for value in [-2.0, -1.0, 0.0, 0.7, 3.0, 9.0, f32::INFINITY] {
            assert_eq!(u32::from(white.grey(value)) + u32::from(black.grey(value)), 65535, "{value}");
        }
        assert_eq!(white.grey(f32::NAN), white.grey(-1.0));
        assert_eq!(black.grey(f32::NAN), black.grey(-1.0));
    }

    #[test]
    fn colours_come_back_with_8_bits() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("c.png");
        let rgba = image_of(2, 1, vec![1, 2, 3, 4, 255, 0, 128, 255]).expect("an image");
        write_rgba(&path, &rgba, Labels::default()).expect("written");
        let DynamicImage::ImageRgba8(back) = open(&path) else { panic!("not 8-bit RGBA") };
        assert_eq!(back.into_raw(), [1, 2, 3, 4, 255, 0, 128, 255]);
        assert!(info(&path).srgb.is_some() && info(&path).pixel_dims.is_none());

        let rgb = image_of(1, 2, vec![1, 2, 3, 4, 5, 6]).expect("an image");
        write_rgb(&path, &rgb, Labels::default()).expect("written");
        let DynamicImage::ImageRgb8(back) = open(&path) else { panic!("not 8-bit RGB") };
        assert_eq!((back.dimensions(), back.into_raw()), ((1, 2), vec![1, 2, 3, 4, 5, 6]));
    }

    #[test]
    fn nan_and_invalid_labels_leave_no_file() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("p.png");
        let window = Window::new(0.0, 1.0, Polarity::BoneWhite).expect("a window");
        let image = image_of(2, 2, vec![0.0, 0.0, 0.0, f32::NAN]).expect("an image");
        let error = write_grey(&path, &image, &window, "p", Labels::default()).expect_err("NaN");
        assert!(error.to_string().contains("column 1, row 1"), "{error}");
        let image = image_of(1, 1, vec![0.0]).expect("an image");
        let labels = Labels { texts: &[("", "no keyword")], ..Labels::default() };
        assert!(write_grey(&path, &image, &window, "p", labels).is_err());
        assert!(!path.exists());
    }

    #[test]
    fn windows_without_width_do_not_exist() {
        for (low, high) in [(1.0, 1.0), (2.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY), (-1e308, 1.7e308)]
        {
            assert_eq!(Window::new(low, high, Polarity::BoneWhite), None, "{low} {high}");
        }
    }

    #[test]
    fn the_automatic_window_ignores_air_and_a_few_extreme_pixels() {
        // 600 pixels of air; 400 from 1 to 2 in equal steps; 1 of metal.
        let mut pixels = vec![0.0; 600];
        pixels.extend((0..400).map(|i| 1.0 + i as f32 / 399.0));
        pixels.push(1000.0);
        let window = auto_window(&image_of(1001, 1, pixels).expect("an image"));
        assert!((window.low() - 1.01).abs() < 0.003, "{window:?}");
        assert!((window.high() - 1.995).abs() < 0.003, "{window:?}");

        let ends = |pixels: Vec<f32>| {
            let window = auto_window(&image_of(pixels.len(), 1, pixels).expect("an image"));
            (window.low(), window.high())
        };
        assert_eq!(ends(vec![0.0, f32::NAN, f32::INFINITY, -1.0]), (0.0, 1.0));
        assert_eq!(ends(vec![0.0, 2.0, 2.0]), (0.0, 2.0));
    }
}
