//! Arithmetic without rounding: every f64 is a whole number times a power of two, and so are sums and products; what is
//! divided stays a quotient of two such. Nothing is ever reduced, for that would take most of the time.

use std::cmp::Ordering;
use std::ops::{Add, Mul, Sub};

use glam::DVec3;
use num_bigint::{BigInt, Sign};
use num_rational::BigRational;
use num_traits::{Signed, ToPrimitive};

/// A whole number times a power of two.
#[derive(Clone, Debug)]
pub(super) struct Dyadic {
    mantissa: BigInt,
    exponent: i32,
}

impl Dyadic {
    pub fn zero() -> Self {
        Self { mantissa: BigInt::ZERO, exponent: 0 }
    }

    /// A finite f64 as it is.
    pub fn of(x: f64) -> Self {
        let bits = x.abs().to_bits();
        let (field, fraction) = ((bits >> 52) as i32, bits & ((1 << 52) - 1));
        // Below the least exponent there is no hidden bit.
        let (exponent, mantissa) =
            if field == 0 { (-1074, fraction) } else { (field - 1075, fraction | 1 << 52) };
        if mantissa == 0 {
            return Self::zero();
        }
        let zeros = mantissa.trailing_zeros();
        let size = BigInt::from(mantissa >> zeros);
        Self { mantissa: if x < 0.0 { -size } else { size }, exponent: exponent + zeros as i32 }
    }

    /// −1, 0 or 1.
    pub fn sign(&self) -> i32 {
        match self.mantissa.sign() {
            Sign::Minus => -1,
            Sign::NoSign => 0,
            Sign::Plus => 1,
        }
    }

    pub fn abs(&self) -> Self {
        Self { mantissa: self.mantissa.abs(), exponent: self.exponent }
    }

    pub fn negated(&self) -> Self {
        Self { mantissa: -&self.mantissa, exponent: self.exponent }
    }

    /// Both as whole numbers of one unit, and its exponent.
    fn aligned(&self, other: &Self) -> (BigInt, BigInt, i32) {
        let unit = self.exponent.min(other.exponent);
        let whole = |x: &Self| &x.mantissa << (x.exponent - unit);
        (whole(self), whole(other), unit)
    }
}

impl Add for &Dyadic {
    type Output = Dyadic;

    fn add(self, other: Self) -> Dyadic {
        let (a, b, exponent) = self.aligned(other);
        Dyadic { mantissa: a + b, exponent }
    }
}

impl Sub for &Dyadic {
    type Output = Dyadic;

    fn sub(self, other: Self) -> Dyadic {
        let (a, b, exponent) = self.aligned(other);
        Dyadic { mantissa: a - b, exponent }
    }
}

impl Mul for &Dyadic {
    type Output = Dyadic;

    fn mul(self, other: Self) -> Dyadic {
        Dyadic { mantissa: &self.mantissa * &other.mantissa, exponent: self.exponent + other.exponent }
    }
}

impl PartialEq for Dyadic {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Dyadic {}

impl PartialOrd for Dyadic {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Dyadic {
    fn cmp(&self, other: &Self) -> Ordering {
        let (a, b, _) = self.aligned(other);
        a.cmp(&b)
    }
}

/// A vector without rounding.
#[derive(Clone, Debug)]
pub(super) struct Vector(pub [Dyadic; 3]);

impl Vector {
    /// A finite vector as it is.
    pub fn of(v: DVec3) -> Self {
        Self(v.to_array().map(Dyadic::of))
    }

    pub fn minus(&self, other: &Self) -> Self {
        Self([0, 1, 2].map(|i| &self.0[i] - &other.0[i]))
    }

    pub fn dot(&self, other: &Self) -> Dyadic {
        let [x, y, z] = [0, 1, 2].map(|i| &self.0[i] * &other.0[i]);
        &(&x + &y) + &z
    }
}

/// A quotient of two, neither reduced nor rounded: a rational number.
#[derive(Clone, Debug)]
pub(super) struct Quotient {
    over: Dyadic,
    /// Above 0.
    under: Dyadic,
}

impl Quotient {
    /// `over / under`, which must not be 0.
    pub fn new(over: Dyadic, under: &Dyadic) -> Self {
        let over = if under.sign() < 0 { over.negated() } else { over };
        Self { over, under: under.abs() }
    }

    /// A finite f64 as it is.
    pub fn of(x: f64) -> Self {
        Self { over: Dyadic::of(x), under: Dyadic::of(1.0) }
    }

    pub fn plus(&self, other: &Self) -> Self {
        let over = &(&self.over * &other.under) + &(&other.over * &self.under);
        Self { over, under: &self.under * &other.under }
    }

    pub fn minus(&self, other: &Self) -> Self {
        self.plus(&Self { over: other.over.negated(), under: other.under.clone() })
    }

    /// The nearest f64; 0 if it is beyond them, which lengths of finite numbers are not.
    pub fn nearest(&self) -> f64 {
        let (over, under, _) = self.over.aligned(&self.under);
        BigRational::new_raw(over, under).to_f64().unwrap_or(0.0)
    }
}

impl PartialEq for Quotient {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}

impl Eq for Quotient {}

impl PartialOrd for Quotient {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Quotient {
    fn cmp(&self, other: &Self) -> Ordering {
        (&self.over * &other.under).cmp(&(&other.over * &self.under))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_come_back_as_they_went_in() {
        let numbers =
            [0.0, 1.0, -1.0, 0.1, 1e300, -5e-324, f64::MIN_POSITIVE, f64::MAX, 3.0e-310, -1234.5678];
        for x in numbers {
            assert_eq!(Quotient::of(x).nearest(), x);
            assert_eq!(Dyadic::of(x).sign(), if x == 0.0 { 0 } else { x.signum() as i32 });
            for y in numbers {
                assert_eq!(Dyadic::of(x).cmp(&Dyadic::of(y)), x.partial_cmp(&y).expect("numbers"), "{x} {y}");
            }
        }
    }

    #[test]
    fn sums_products_and_quotients_are_exact() {
        let [tenth, third] = [Dyadic::of(0.1), Dyadic::of(3.0)];
        // 0.1 is not a tenth: three of them are not 0.3, exactly.
        let three = &(&tenth + &tenth) + &tenth;
        assert_eq!(three, &tenth * &third);
        assert!(three > Dyadic::of(0.3));
        let quotient = |over: f64, under: f64| Quotient::new(Dyadic::of(over), &Dyadic::of(under));
        assert_eq!(quotient(1.0, 3.0).plus(&quotient(1.0, 6.0)), quotient(-1.0, -2.0));
        assert_eq!(quotient(1.0, -3.0).minus(&quotient(1.0, 6.0)).nearest(), -0.5);
        assert_eq!(quotient(1.0, 3.0).nearest(), 1.0 / 3.0);
        assert!(quotient(1e300, 1e-300) > quotient(f64::MAX, 1.0));
    }
}
