//! How far writing its coordinates down may have moved a surface.

use glam::DVec3;

use super::Bounds;
use super::numeric::gamma;

/// How far rounding of its vertices can make a convex surface's vertex stand out of a face's plane, mm.
///
/// Two terms: the grid on which the coordinates were written (decimals of a text file, f32 of an STL file) moves
/// vertex and plane by up to half a grid diagonal each; and f64 arithmetic errs by γ₁₀ of the extent (three
/// differences, a dot product, a unit normal of three roundings). The grid is taken from the coordinates where none is
/// given.
pub(super) fn rounding_tolerance_mm(vertices: &[DVec3], grid_mm: Option<f64>) -> f64 {
    let arithmetic = arithmetic_mm(Bounds::of(vertices.iter().copied()));
    let grid = grid_mm.unwrap_or_else(|| written_grid(vertices));
    let half_diagonal = 0.5 * 3f64.sqrt() * grid;
    arithmetic + 2.0 * half_diagonal
}

/// How far out of a face's plane arithmetic in f64 may put a vertex that is not, mm: γ₁₀ of the extent.
pub(super) fn arithmetic_mm(bounds: Bounds) -> f64 {
    gamma(10) * bounds.diagonal()
}

/// The coarsest grid all coordinates lie on, in their own unit: a decimal one of six to nine places, else the spacing of
/// f32, else of f64, at the largest coordinate.
///
/// To be asked of coordinates as a file has them: scaled to millimetres or turned, they lie on no such grid any more.
/// Bodies whose coordinates are short decimals by nature (a 10 mm cube) would seem written on a coarse grid, so
/// no grid coarser than six decimals, the coarsest that mesh writers use, is assumed.
pub fn written_grid(vertices: &[DVec3]) -> f64 {
    let coordinates = || vertices.iter().flat_map(|v| v.to_array());
    let on_decimal_grid = |places: i32| {
        let scale = 10f64.powi(places);
        // A decimal is off its nearest f64 by half a unit in the last place, and so is the product.
        coordinates()
            .all(|x| ((x * scale).round() - x * scale).abs() <= 4.0 * f64::EPSILON * (x * scale).abs())
    };
    let largest = coordinates().map(f64::abs).fold(0.0, f64::max);
    let f64_spacing = largest * f64::EPSILON;
    if let Some(places) = (6..=9).find(|&p| on_decimal_grid(p)) {
        return 10f64.powi(-places).max(f64_spacing);
    }
    if coordinates().all(|x| f64::from(x as f32) == x) {
        return largest * f64::from(f32::EPSILON);
    }
    f64_spacing
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_f32_and_f64_are_told_apart() {
        let third = DVec3::new(1.0 / 3.0, -200.0 / 7.0, 0.0);
        assert_eq!(written_grid(&[(third * 1e6).round() / 1e6]), 1e-6);
        assert_eq!(written_grid(&[(third * 1e8).round() / 1e8]), 1e-8);
        assert_eq!(written_grid(&[DVec3::new(10.0, 2.5, 0.0)]), 1e-6);
        let single = third.as_vec3().as_dvec3();
        assert_eq!(written_grid(&[single]), -single.y * f64::from(f32::EPSILON));
        assert_eq!(written_grid(&[third]), -third.y * f64::EPSILON);
    }
}
