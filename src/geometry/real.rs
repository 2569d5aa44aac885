//! Numbers that kernels are generic over: f64 to compute, [`Counted`] to count what computing takes.

use std::cell::Cell;
use std::fmt::Debug;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// A real number. Kernels written for it run as they are on f64, and count their operations on [`Counted`].
///
/// Counted are sums, differences, products, quotients, roots, powers and sines, one each. Signs, comparisons,
/// rounding to whole numbers and conversions are not.
pub trait Real:
    Copy
    + Debug
    + Default
    + PartialOrd
    + Send
    + Sync
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + 'static
{
    /// The number of a value.
    fn of(value: f64) -> Self;

    /// The value.
    fn get(self) -> f64;

    /// √x.
    fn sqrt(self) -> Self;

    /// xʸ.
    fn powf(self, exponent: f64) -> Self;

    /// The sine of radians.
    fn sin(self) -> Self;

    /// Does `work`; how many operations it took on this thread, 0 on numbers that do not count.
    fn count<T>(work: impl FnOnce() -> T) -> (T, u64);

    /// |x|.
    fn abs(self) -> Self {
        if self.get() < 0.0 { -self } else { self }
    }

    /// The smaller; the other if one is not a number.
    fn min(self, other: Self) -> Self {
        if self < other || other.get().is_nan() { self } else { other }
    }

    /// The larger; the other if one is not a number.
    fn max(self, other: Self) -> Self {
        if self > other || other.get().is_nan() { self } else { other }
    }
}

impl Real for f64 {
    fn of(value: f64) -> Self {
        value
    }

    fn get(self) -> f64 {
        self
    }

    fn sqrt(self) -> Self {
        f64::sqrt(self)
    }

    fn powf(self, exponent: f64) -> Self {
        f64::powf(self, exponent)
    }

    fn sin(self) -> Self {
        f64::sin(self)
    }

    fn count<T>(work: impl FnOnce() -> T) -> (T, u64) {
        (work(), 0)
    }

    fn abs(self) -> Self {
        f64::abs(self)
    }

    fn min(self, other: Self) -> Self {
        f64::min(self, other)
    }

    fn max(self, other: Self) -> Self {
        f64::max(self, other)
    }
}

thread_local! {
    static OPERATIONS: Cell<u64> = const { Cell::new(0) };
}

/// An f64 whose operations are counted, by thread.
#[derive(Clone, Copy, Debug, Default, PartialEq, PartialOrd)]
pub struct Counted(f64);

impl Counted {
    fn noted(value: f64) -> Self {
        OPERATIONS.set(OPERATIONS.get() + 1);
        Self(value)
    }
}

impl Add for Counted {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::noted(self.0 + other.0)
    }
}

impl Sub for Counted {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::noted(self.0 - other.0)
    }
}

impl Mul for Counted {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        Self::noted(self.0 * other.0)
    }
}

impl Div for Counted {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        Self::noted(self.0 / other.0)
    }
}

impl Neg for Counted {
    type Output = Self;

    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Real for Counted {
    fn of(value: f64) -> Self {
        Self(value)
    }

    fn get(self) -> f64 {
        self.0
    }

    fn sqrt(self) -> Self {
        Self::noted(self.0.sqrt())
    }

    fn powf(self, exponent: f64) -> Self {
        Self::noted(self.0.powf(exponent))
    }

    fn sin(self) -> Self {
        Self::noted(self.0.sin())
    }

    fn count<T>(work: impl FnOnce() -> T) -> (T, u64) {
        let before = OPERATIONS.get();
        let result = work();
        (result, OPERATIONS.get() - before)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hypotenuse<R: Real>(a: R, b: R) -> R {
        (a * a + b * b).sqrt().max(-a.abs())
    }

    #[test]
    fn kernels_give_the_same_numbers_counted_or_not() {
        let (plain, none) = f64::count(|| hypotenuse(3.0, 4.0));
        let (counted, four) = Counted::count(|| hypotenuse(Counted::of(3.0), Counted::of(4.0)));
        assert_eq!((plain, none), (5.0, 0));
        assert_eq!((counted.get(), four), (5.0, 4));
    }
}
