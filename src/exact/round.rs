//! Rounding to whole pixels without a call: the baseline of x86-64 has no instruction for it.

/// 1.5 · 2⁵²: a double of this size has no bits left for fractions, so adding it rounds to the nearest integer, which then
/// stands in the lowest bits.
pub const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Coordinates beyond this are not rounded right.
pub const LARGEST: f64 = (1 << 30) as f64;

/// The nearest integer, and how far `x` lies above it.
#[inline(always)]
pub fn nearest(x: f64) -> (i32, f64) {
    let shifted = x + WHOLE;
    (whole(shifted), x - (shifted - WHOLE))
}

/// The integer to which [`WHOLE`] was added.
#[inline(always)]
pub fn whole(shifted: f64) -> i32 {
    shifted.to_bits() as i32
}

/// The least integer that is not less than `x`.
#[inline(always)]
pub fn ceil(x: f64) -> i32 {
    let (integer, above) = nearest(x);
    integer + i32::from(above > 0.0)
}

/// As [`ceil`], as a double.
#[inline(always)]
pub fn ceiling(x: f64) -> f64 {
    let nearest = (x + WHOLE) - WHOLE;
    nearest + if x > nearest { 1.0 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ceilings_are_those_of_the_library() {
        let tiny = f64::MIN_POSITIVE;
        for x in [0.0, -0.0, tiny, -tiny, 0.5, -0.5, 1.5, 2.5, -2.5, 7.0, -7.0, LARGEST - 0.5, 0.5 - LARGEST]
        {
            for near in [x, x.next_up(), x.next_down()] {
                assert_eq!(ceil(near), near.ceil() as i32, "{near}");
                assert_eq!(ceiling(near), near.ceil(), "{near}");
            }
        }
    }
}
