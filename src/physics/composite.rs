//! Transparent organs in colour: front-to-back compositing along one ray, and the way from colours in files to light and back.
//!
//! ```text
//!   source ──►──[ chest ]──[ lung ]──[ chest ]──►── background      stretches in order of entry
//!            τ: 1      0.7        0.4       0.3                    light still let through
//! ```
//!
//! Colours are given as sRGB `#rrggbb`, mixed as linear light, and encoded to sRGB at the end (IEC 61966-2-1). The operator is
//! *over*, nearest first, with premultiplied colour (Porter & Duff 1984, doi:10.1145/964965.808606). The source is the eye: images look the way
//! the radiograph beside them is projected.

use crate::{Error, Result};

/// The transmittance below which what lies behind is left out: a quarter of the smallest step of 8 bits in the light (1/255 of sRGB's linear
/// toe, 1/12.92), so that no encoded colour changes by more than one step.
pub const OPAQUE_BELOW: f64 = 1.0 / (255.0 * 12.92 * 4.0);

/// How much of what lies behind a stretch of an organ hides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opacity {
    /// A share in 0..=1 per stretch, however long: each passage through the organ, or through the part before and the part behind a nested
    /// organ, hides this much. Grey volumes at 0.5 are the look of Atalay & Mount's Fig. 12.
    PerCrossing(f64),
    /// Extinction per mm, zero or more: a stretch of L mm hides 1 − exp(−k L).
    PerMm(f64),
}

impl Opacity {
    /// The share of the light behind that a stretch of positive length hides.
    fn of(self, length_mm: f64) -> f64 {
        match self {
            Self::PerCrossing(share) => share,
            Self::PerMm(extinction) => -(-extinction * length_mm).exp_m1(),
        }
    }
}

/// How an organ looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Appearance {
    /// Linear RGB, 0..=1, not premultiplied.
    pub colour: [f32; 3],
    /// How much it hides.
    pub opacity: Opacity,
}

impl Appearance {
    /// The look of a checked opacity. Errors, naming `organ`: an opacity outside 0..=1, a negative or infinite extinction, NaN.
    pub fn new(organ: &str, colour: [f32; 3], opacity: Opacity) -> Result<Self> {
        let refuse = |problem: String, remedy: &str| Err(Error::input(organ, problem, remedy));
        match opacity {
            Opacity::PerCrossing(share) if !(0.0..=1.0).contains(&share) => {
                refuse(format!("opacity {share} is not a share"), "give an opacity from 0 to 1")
            }
            Opacity::PerMm(k) if !(k >= 0.0 && k.is_finite()) => {
                refuse(format!("extinction {k} per mm is not an extinction"), "give zero or more per mm")
            }
            _ => Ok(Self { colour, opacity }),
        }
    }

    /// Whether the organ cannot be seen at all, so that its stretches need not be found.
    pub fn is_invisible(&self) -> bool {
        matches!(self.opacity, Opacity::PerCrossing(0.0) | Opacity::PerMm(0.0))
    }
}

/// A part of a ray within an organ and within none of the organs nested in it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stretch {
    /// The organ's index.
    pub organ: usize,
    /// Where the ray enters, mm from the source.
    pub entry_mm: f64,
    /// Where it leaves, mm from the source.
    pub exit_mm: f64,
}

/// What a ray sees of its stretches, which must come in order of entry: premultiplied linear RGBA. `appearances` by organ index;
/// stretches without an appearance or without length are invisible. No stretches: four zeros.
pub fn composite(stretches: &[Stretch], appearances: &[Appearance]) -> [f32; 4] {
    let mut colour = [0.0_f64; 3];
    let mut transmittance = 1.0;
    for stretch in stretches {
        let length_mm = stretch.exit_mm - stretch.entry_mm;
        let Some(appearance) = appearances.get(stretch.organ).filter(|_| length_mm > 0.0) else { continue };
        let hidden = appearance.opacity.of(length_mm);
        for (sum, channel) in colour.iter_mut().zip(appearance.colour) {
            *sum += transmittance * hidden * f64::from(channel);
        }
        transmittance *= 1.0 - hidden;
        if transmittance < OPAQUE_BELOW {
            break;
        }
    }
    let [red, green, blue] = colour.map(|channel| channel as f32);
    [red, green, blue, (1.0 - transmittance) as f32]
}

/// Premultiplied linear RGBA before a linear background.
pub fn over([red, green, blue, alpha]: [f32; 4], background: [f32; 3]) -> [f32; 3] {
    let behind = background.map(|channel| (1.0 - alpha) * channel);
    [red + behind[0], green + behind[1], blue + behind[2]]
}

/// Linear RGB as 8-bit sRGB, rounded to the nearest; values outside 0..=1 are clamped, NaN is 0.
pub fn encode_srgb8(linear: [f32; 3]) -> [u8; 3] {
    // A float to integer cast of NaN gives 0.
    linear.map(|channel| (255.0 * encode_srgb(channel)).round() as u8)
}

/// A channel of linear light as sRGB encodes it (IEC 61966-2-1), 0 to 1; values outside are clamped.
pub fn encode_srgb(linear: f32) -> f64 {
    let light = f64::from(linear).clamp(0.0, 1.0);
    if light <= 0.003_130_8 { 12.92 * light } else { 1.055 * light.powf(1.0 / 2.4) - 0.055 }
}

/// Premultiplied linear RGBA as 8-bit sRGB with straight alpha, as PNG wants it. Fully transparent is four zeros.
pub fn encode_srgba8([red, green, blue, alpha]: [f32; 4]) -> [u8; 4] {
    if alpha.is_nan() || alpha <= 0.0 {
        return [0; 4];
    }
    let [red, green, blue] = encode_srgb8([red / alpha, green / alpha, blue / alpha]);
    [red, green, blue, (255.0 * alpha.clamp(0.0, 1.0)).round() as u8]
}

/// The linear RGB of a colour written `#rrggbb` (sRGB, hexadecimal). An error for anything else.
pub fn parse_colour(text: &str) -> Result<[f32; 3]> {
    let digits = text.strip_prefix('#').filter(|d| d.len() == 6 && d.bytes().all(|b| b.is_ascii_hexdigit()));
    let value = digits.and_then(|digits| u32::from_str_radix(digits, 16).ok()).ok_or_else(|| {
        Error::input(
            format!("colour {text:?}"),
            "is not of the form #rrggbb",
            "write six hexadecimal digits, such as \"#c86432\"",
        )
    })?;
    let [_, red, green, blue] = value.to_be_bytes();
    Ok([red, green, blue].map(|byte| {
        let encoded = f64::from(byte) / 255.0;
        let light = if encoded <= 0.040_45 { encoded / 12.92 } else { ((encoded + 0.055) / 1.055).powf(2.4) };
        light as f32
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [f32; 3] = [1.0; 3];
    const BLACK: [f32; 3] = [0.0; 3];
    const RED: [f32; 3] = [1.0, 0.0, 0.0];
    const BLUE: [f32; 3] = [0.0, 0.0, 1.0];

    fn look(colour: [f32; 3], opacity: Opacity) -> Appearance {
        Appearance::new("organ", colour, opacity).expect("an appearance")
    }

    fn stretch(organ: usize, entry_mm: f64, exit_mm: f64) -> Stretch {
        Stretch { organ, entry_mm, exit_mm }
    }

    fn assert_near(found: [f32; 4], expected: [f32; 4]) {
        let apart = found.iter().zip(expected).map(|(f, e)| (f - e).abs()).fold(0.0, f32::max);
        assert!(apart <= 2.0 * f32::EPSILON, "{found:?} is not {expected:?}");
    }

    #[test]
    fn the_nearer_organ_shows_more() {
        let looks = [look(RED, Opacity::PerCrossing(0.5)), look(BLUE, Opacity::PerCrossing(0.5))];
        let red_first = composite(&[stretch(0, 0.0, 1.0), stretch(1, 1.0, 2.0)], &looks);
        let blue_first = composite(&[stretch(1, 0.0, 1.0), stretch(0, 1.0, 2.0)], &looks);
        assert_eq!(red_first, [0.5, 0.0, 0.25, 0.75]);
        assert_eq!(blue_first, [0.25, 0.0, 0.5, 0.75]);
    }

    #[test]
    fn an_opaque_front_hides_all_behind() {
        let looks = [look(RED, Opacity::PerCrossing(1.0)), look(BLUE, Opacity::PerCrossing(0.5))];
        let seen = composite(&[stretch(0, 0.0, 1.0), stretch(1, 1.0, 2.0)], &looks);
        assert_eq!(seen, [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(over(seen, BLUE), RED);
    }

    #[test]
    fn two_slabs_of_extinction_are_one_of_both_lengths() {
        let looks = [look([0.2, 0.5, 0.9], Opacity::PerMm(0.03))];
        let halves = composite(&[stretch(0, 10.0, 25.0), stretch(0, 25.0, 40.0)], &looks);
        let whole = composite(&[stretch(0, 10.0, 40.0)], &looks);
        assert_near(halves, whole);
        let hidden = 1.0 - (-0.9_f64).exp();
        assert_near(whole, [0.2 * hidden, 0.5 * hidden, 0.9 * hidden, hidden].map(|c| c as f32));
    }

    #[test]
    fn white_over_black_has_its_closed_forms() {
        for crossings in 1..8 {
            let stretches: Vec<_> =
                (0..crossings).map(|i| stretch(0, f64::from(i), f64::from(i) + 0.5)).collect();
            let seen = composite(&stretches, &[look(WHITE, Opacity::PerCrossing(0.5))]);
            let grey = 1.0 - 0.5_f32.powi(crossings);
            assert_near(seen, [grey; 4]);
            assert_eq!(over(seen, BLACK), [grey; 3]);
            assert_eq!(over(seen, WHITE), WHITE);
        }
    }

    #[test]
    fn what_is_left_out_behind_a_nearly_opaque_front_cannot_be_seen() {
        let looks = [
            look(BLACK, Opacity::PerCrossing(1.0 - 0.99 * OPAQUE_BELOW)),
            look(WHITE, Opacity::PerCrossing(1.0)),
        ];
        let seen = composite(&[stretch(0, 0.0, 1.0), stretch(1, 1.0, 2.0)], &looks);
        assert_eq!(seen[..3], [0.0; 3], "left out");
        assert_eq!(encode_srgb8(over(seen, WHITE)), encode_srgb8(BLACK), "invisible at 8 bits");
    }

    #[test]
    fn nothing_and_lengths_of_nothing_are_transparent() {
        let looks = [look(WHITE, Opacity::PerCrossing(1.0))];
        assert_eq!(composite(&[], &looks), [0.0; 4]);
        for length in [0.0, -1e-13, f64::NAN] {
            assert_eq!(composite(&[stretch(0, 5.0, 5.0 + length)], &looks), [0.0; 4]);
        }
        assert_eq!(composite(&[stretch(7, 0.0, 1.0)], &looks), [0.0; 4], "no such organ");
        assert!(look(WHITE, Opacity::PerMm(0.0)).is_invisible());
        assert_eq!(over([0.0; 4], RED), RED);
    }

    #[test]
    fn every_byte_survives_decoding_and_encoding() {
        for byte in 0..=255_u8 {
            let text = format!("#{byte:02x}00{byte:02X}");
            assert_eq!(encode_srgb8(parse_colour(&text).expect("a colour")), [byte, 0, byte]);
        }
    }

    #[test]
    fn mid_grey_light_is_188_in_srgb() {
        // The classic check that mixing happened in light: half of white is #bcbcbc, not #808080.
        assert_eq!(encode_srgb8([0.5; 3]), [188; 3]);
        assert!((parse_colour("#808080").expect("a colour")[0] - 0.215_860_5).abs() < 1e-6);
        assert_eq!(encode_srgb8([-1.0, 2.0, f32::NAN]), [0, 255, 0]);
    }

    #[test]
    fn straight_alpha_undoes_the_premultiplication() {
        assert_eq!(encode_srgba8([0.25, 0.0, 0.0, 0.5]), [188, 0, 0, 128]);
        assert_eq!(encode_srgba8([0.0; 4]), [0; 4]);
    }

    #[test]
    fn bad_colours_and_opacities_are_refused() {
        for text in ["", "red", "#fff", "c86432", "#c8643", "#c864321", "#c8643g", "#+12345", "#ééé"] {
            assert!(parse_colour(text).is_err(), "{text}");
        }
        for share in [-0.1, 1.1, f64::NAN] {
            assert!(Appearance::new("liver", WHITE, Opacity::PerCrossing(share)).is_err());
        }
        for extinction in [-0.1, f64::INFINITY, f64::NAN] {
            let error = Appearance::new("liver", WHITE, Opacity::PerMm(extinction)).expect_err("refused");
            assert!(error.to_string().contains("liver"));
        }
    }
}
