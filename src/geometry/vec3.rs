//! Vectors of any real number, and rays of them.

use std::ops::{Add, Mul, Neg, Sub};

use glam::DVec3;

use super::Real;

/// A vector of three numbers. What is not counted uses glam's.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Vec3<R> {
    /// Along the first axis.
    pub x: R,
    /// Along the second.
    pub y: R,
    /// Along the third.
    pub z: R,
}

impl<R: Real> Vec3<R> {
    /// From its components.
    pub fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }

    /// From a vector of f64.
    pub fn of(v: DVec3) -> Self {
        Self::new(R::of(v.x), R::of(v.y), R::of(v.z))
    }

    /// As a vector of f64.
    pub fn get(self) -> DVec3 {
        DVec3::new(self.x.get(), self.y.get(), self.z.get())
    }

    /// One component, 0 to 2.
    pub fn axis(self, axis: usize) -> R {
        [self.x, self.y, self.z][axis]
    }

    /// The scalar product.
    pub fn dot(self, other: Self) -> R {
        self.x * other.x + self.y * other.y + self.z * other.z
    }

    /// The vector product.
    pub fn cross(self, other: Self) -> Self {
        Self::new(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )
    }

    /// The product component by component.
    pub fn scaled(self, other: Self) -> Self {
        Self::new(self.x * other.x, self.y * other.y, self.z * other.z)
    }

    /// The length.
    pub fn length(self) -> R {
        self.dot(self).sqrt()
    }

    /// At length 1; not finite if the vector is zero.
    pub fn normalized(self) -> Self {
        self * (R::of(1.0) / self.length())
    }
}

impl<R: Real> Add for Vec3<R> {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        Self::new(self.x + other.x, self.y + other.y, self.z + other.z)
    }
}

impl<R: Real> Sub for Vec3<R> {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        Self::new(self.x - other.x, self.y - other.y, self.z - other.z)
    }
}

impl<R: Real> Mul<R> for Vec3<R> {
    type Output = Self;

    fn mul(self, factor: R) -> Self {
        Self::new(self.x * factor, self.y * factor, self.z * factor)
    }
}

impl<R: Real> Neg for Vec3<R> {
    type Output = Self;

    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

/// A ray: from its origin on, along a direction of length 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray<R> {
    /// Where it starts.
    pub origin: Vec3<R>,
    /// Where it goes, length 1.
    pub dir: Vec3<R>,
}

impl<R: Real> Ray<R> {
    /// The point `t` along the ray.
    pub fn at(&self, t: R) -> Vec3<R> {
        self.origin + self.dir * t
    }
}
