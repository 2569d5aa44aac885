//! Values over an angle that goes round: gantry angles, from the top and clockwise, as the machine is looked at.

use std::fmt::Write as _;

use super::curves::Curve;
use super::{escape, short};

const SIZE: f64 = 420.0;
const MIDDLE: f64 = 0.5 * SIZE;
const RADIUS: f64 = 170.0;

/// Circles, beside the middle.
const RINGS: usize = 4;

/// Where circles are named: at 15°, between spokes.
const NAMES_AT: (f64, f64) = (0.258_819, 0.965_926);

/// A polar plot: of each point, `x` is the angle, degrees, and `y` the value, from zero in the middle.
#[derive(Clone, Debug, PartialEq)]
pub struct Polar<'a> {
    /// What the values are, with unit.
    pub name: &'a str,
    /// The curves.
    pub curves: Vec<Curve>,
}

impl Polar<'_> {
    /// The plot with its legend, to stand in a page. Empty if no value is positive.
    pub fn html(&self) -> String {
        let values = self.curves.iter().flat_map(|c| &c.points).map(|p| p.y).filter(|v| v.is_finite());
        let most = values.fold(0.0, f64::max);
        if most <= 0.0 {
            return String::new();
        }
        let mut svg = format!(
            "<svg viewBox=\"0 0 {SIZE} {SIZE}\" style=\"max-width:520px\" role=\"img\" aria-label=\"{} over the gantry angle\">",
            escape(self.name)
        );
        rings(most, &mut svg);
        for curve in &self.curves {
            draw(curve, most, &mut svg);
        }
        let entry =
            |c: &Curve| format!("<span><i style=\"background:{}\"></i>{}</span>", c.colour, escape(&c.name));
        let legend: String = self.curves.iter().map(entry).collect();
        format!(
            "<figure>{svg}</svg><p class=\"legend\">{legend}</p><figcaption>{}; 0 in the middle, {} at the rim. 0° is above \
             the patient lying on the back, 90° on the patient's left.</figcaption></figure>",
            escape(self.name),
            short(most)
        )
    }
}

fn place(angle_deg: f64, share: f64) -> [f64; 2] {
    let (sin, cos) = angle_deg.to_radians().sin_cos();
    [MIDDLE + RADIUS * share * sin, MIDDLE - RADIUS * share * cos]
}

fn rings(most: f64, svg: &mut String) {
    for ring in 1..=RINGS {
        let share = ring as f64 / RINGS as f64;
        let _ = write!(
            svg,
            "<circle class=\"grid\" cx=\"{MIDDLE}\" cy=\"{MIDDLE}\" r=\"{:.1}\" fill=\"none\"/>\
             <text x=\"{:.1}\" y=\"{:.1}\">{}</text>",
            RADIUS * share,
            MIDDLE + (RADIUS * share) * NAMES_AT.0 + 2.0,
            MIDDLE - (RADIUS * share) * NAMES_AT.1 - 2.0,
            short(most * share)
        );
    }
    for angle in (0..360).step_by(30) {
        let [x, y] = place(f64::from(angle), 1.0);
        let [tx, ty] = place(f64::from(angle), 1.11);
        let _ = write!(
            svg,
            "<line class=\"grid\" x1=\"{MIDDLE}\" y1=\"{MIDDLE}\" x2=\"{x:.1}\" y2=\"{y:.1}\"/>\
             <text class=\"at\" x=\"{tx:.1}\" y=\"{:.1}\">{angle}°</text>",
            ty + 4.0
        );
    }
}

fn draw(curve: &Curve, most: f64, svg: &mut String) {
    let mut points: Vec<_> = curve.points.iter().filter(|p| p.y.is_finite() && p.x.is_finite()).collect();
    points.sort_by(|a, b| a.x.rem_euclid(360.0).total_cmp(&b.x.rem_euclid(360.0)));
    // Neighbours are joined, also over 0°, if nothing seems to be missing between them.
    let gap = |a: f64, b: f64| (b - a).rem_euclid(360.0);
    let usual = points.windows(2).map(|w| gap(w[0].x, w[1].x)).fold(f64::INFINITY, f64::min);
    for (i, from) in points.iter().enumerate() {
        let to = points[(i + 1) % points.len()];
        let step = gap(from.x, to.x);
        if points.len() > 2 && step > 0.0 && step <= (2.5 * usual).max(31.0) {
            let ([x1, y1], [x2, y2]) = (place(from.x, from.y / most), place(to.x, to.y / most));
            let _ = write!(
                svg,
                "<line x1=\"{x1:.1}\" y1=\"{y1:.1}\" x2=\"{x2:.1}\" y2=\"{y2:.1}\" stroke=\"{}\" stroke-width=\"1.6\"/>",
                curve.colour
            );
        }
        let [x, y] = place(from.x, from.y / most);
        let _ = write!(
            svg,
            "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"2.6\" fill=\"{}\"><title>{}: {}°, {}</title></circle>",
            curve.colour,
            escape(&from.name),
            short(from.x),
            short(from.y)
        );
    }
}

#[cfg(test)]
mod tests {
    use super::super::curves::{COLOURS, Point};
    use super::*;

    fn curve(angles: &[f64]) -> Curve {
        let points = angles.iter().map(|&x| Point { x, y: 1.0, name: "liver".into() }).collect();
        Curve { name: "liver".into(), colour: COLOURS[0], points, dashed: false }
    }

    #[test]
    fn zero_is_on_top_and_ninety_degrees_on_the_right() {
        assert_eq!(place(0.0, 1.0), [MIDDLE, MIDDLE - RADIUS]);
        let [x, y] = place(90.0, 0.5);
        assert!((x - MIDDLE - 0.5 * RADIUS).abs() < 1e-9 && (y - MIDDLE).abs() < 1e-9);
    }

    #[test]
    fn a_full_turn_is_closed_and_a_part_of_one_is_not() {
        let lines = |angles: &[f64]| {
            let html = Polar { name: "share", curves: vec![curve(angles)] }.html();
            html.matches("stroke-width=\"1.6\"").count()
        };
        let round: Vec<f64> = (0..12).map(|i| 30.0 * f64::from(i)).collect();
        assert_eq!(lines(&round), 12);
        assert_eq!(lines(&round[..7]), 6, "from 180° to 0° nothing was measured");
        assert_eq!(lines(&[-30.0, 0.0, 30.0]), 2, "over 0°");
        assert_eq!(lines(&[0.0, 90.0]), 0);
        assert_eq!(Polar { name: "share", curves: Vec::new() }.html(), "");
    }
}
