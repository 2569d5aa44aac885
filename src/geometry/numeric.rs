//! Arithmetic with known error: double-double for set-up, γₙ for bounds.

use std::ops::{Add, Mul, Sub};

use glam::DVec3;

/// Half a unit in the last place of 1: the relative error of one correctly rounded f64 operation.
pub const UNIT_ROUNDOFF: f64 = f64::EPSILON / 2.0;

/// γₙ = n·u / (1 − n·u): the relative error bound of `n` rounded f64 operations in a row
/// (Higham, *Accuracy and Stability of Numerical Algorithms*, 2002, §3.1).
pub const fn gamma(n: u32) -> f64 {
    let nu = n as f64 * UNIT_ROUNDOFF;
    nu / (1.0 - nu)
}

/// `x` as a multiple of 2⁻²⁵²: itself from 2⁻¹⁴⁶ on, and less than 2⁻²⁵² off below, where no length in mm comes. Products of
/// four such numbers do not underflow, as exact signs demand.
#[inline(always)]
pub fn settled(x: f64) -> f64 {
    /// 2⁻²⁰⁰: its last place is 2⁻²⁵², to which the sum is rounded.
    const LEAST: f64 = f64::from_bits((1023 - 200) << 52);
    (x + LEAST) - LEAST
}

/// The lesser of two, the second if the first is not a number; one instruction, which `f64::min` is not.
#[inline(always)]
pub fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two, the second if the first is not a number.
#[inline(always)]
pub fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// The sum of two f64 that do not overlap, about 32 decimal digits (Dekker, 1971, doi:10.1007/BF01397083).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleDouble {
    high: f64,
    low: f64,
}

impl DoubleDouble {
    /// `a − b` without error.
    pub fn difference(a: f64, b: f64) -> Self {
        Self::exact_sum(a, -b)
    }

    /// `a · b` without error, unless it underflows.
    pub fn product(a: f64, b: f64) -> Self {
        Self::exact_product(a, b)
    }

    /// The nearest f64.
    pub fn to_f64(self) -> f64 {
        self.high
    }

    fn exact_sum(a: f64, b: f64) -> Self {
        let high = a + b;
        let b_rounded = high - a;
        let low = (a - (high - b_rounded)) + (b - b_rounded);
        Self { high, low }
    }

    fn exact_product(a: f64, b: f64) -> Self {
        let high = a * b;
        Self { high, low: a.mul_add(b, -high) }
    }
}

impl Add for DoubleDouble {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        let s = Self::exact_sum(self.high, other.high);
        let t = Self::exact_sum(self.low, other.low);
        let s = Self::exact_sum(s.high, s.low + t.high);
        Self::exact_sum(s.high, s.low + t.low)
    }
}

impl Sub for DoubleDouble {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        self + Self { high: -other.high, low: -other.low }
    }
}

impl Mul for DoubleDouble {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        let p = Self::exact_product(self.high, other.high);
        Self::exact_sum(p.high, p.low + (self.high * other.low + self.low * other.high))
    }
}

/// Below this share of |e₁||e₂| a cross product in double-double is rounding noise: six operations at 2⁻¹⁰⁴ each
/// stay under 2⁻¹⁰⁰.
const DEGENERATE_SINE: f64 = 7.888609052210118e-31; // 2⁻¹⁰⁰

/// The outward unit normal of a counter-clockwise triangle. `None` if its corners are on one line.
///
/// Taken in double-double, so that a needle's normal is as good as a fat triangle's: in f64 the normal of a triangle
/// a million times longer than wide is off by 1e-10, and a plane tilted so cuts away what is not its own.
pub fn unit_normal([a, b, c]: [DVec3; 3]) -> Option<DVec3> {
    let edge = |to: DVec3| [0, 1, 2].map(|i| DoubleDouble::difference(to[i], a[i]));
    let (e1, e2) = (edge(b), edge(c));
    let component = |i: usize, j: usize| (e1[i] * e2[j] - e1[j] * e2[i]).to_f64();
    let cross = DVec3::new(component(1, 2), component(2, 0), component(0, 1));
    let noise = DEGENERATE_SINE * (b - a).length() * (c - a).length();
    if cross.abs().max_element() <= noise {
        return None;
    }
    // Scaled first: the square of a small triangle's cross product may underflow.
    let scaled = cross / cross.abs().max_element();
    Some(scaled / scaled.length())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_numbers_too_small_for_any_length_are_settled() {
        for x in [1.0, -std::f64::consts::PI, 1e-40, -1e-43, 1e15, f64::MAX] {
            assert_eq!(settled(x), x);
        }
        for x in [f64::MIN_POSITIVE, -5e-324, 0.0, -0.0, 1e-80] {
            assert_eq!(settled(x).to_bits(), 0.0_f64.to_bits());
        }
        let least = 2f64.powi(-252);
        assert_eq!(settled(1e-61) % least, 0.0);
        assert!((settled(1e-61) - 1e-61).abs() < least);
    }

    #[test]
    fn a_needle_a_hundred_million_times_longer_than_wide_keeps_its_normal() {
        // In the plane x + y + z = 0 up to the rounding of the corners, which are exact in binary.
        let tiny = 2f64.powi(-27);
        let corners = [DVec3::ZERO, DVec3::new(1.0, -1.0, 0.0), DVec3::new(0.5 + tiny, -0.5, -tiny)];
        let n = unit_normal(corners).expect("not degenerate");
        let expected = DVec3::ONE / 3f64.sqrt();
        assert!((n.abs() - expected).length() < 1e-15, "{n}");
    }

    #[test]
    fn corners_on_one_line_have_no_normal() {
        let (a, d) = (DVec3::new(0.1, 0.2, 0.3), DVec3::new(0.7, -0.3, 0.9));
        assert_eq!(unit_normal([a, a + d, a]), None);
        assert_eq!(unit_normal([DVec3::ZERO, d, 2.0 * d]), None);
        assert_eq!(unit_normal([a, a, a]), None);
    }

    #[test]
    fn normals_do_not_depend_on_size() {
        for scale in [1e-100, 1e-6, 1.0, 1e6, 1e100] {
            let n = unit_normal([DVec3::ZERO, DVec3::X * scale, DVec3::Y * scale]);
            assert_eq!(n, Some(DVec3::Z), "{scale}");
        }
    }
}
