//! Plots as SVG, to stand in a page: bars and lines over a logarithmic scale.
//!
//! ```text
//!   10³ ┤   ▂▄█▆▂          value axis: decades, each with its line and name
//!   10² ┤ ▁▃█████▅▁        places: named, evenly spaced; names thinned where they are many
//!       └┬──┬──┬──┬
//! ```

use std::fmt::Write as _;

use super::short;

const WIDTH: f64 = 680.0;
const HEIGHT: f64 = 260.0;
const LEFT: f64 = 64.0;
const RIGHT: f64 = 12.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 46.0;

/// Names of places at most: as many as stand side by side.
const MOST_NAMES: usize = 13;

/// Decades shown at most, from the largest value down: what is below is rounding beside the rest, and left out.
const MOST_DECADES: i32 = 8;

/// One set of values, one for each place; those that are not positive are left out.
pub struct Series {
    /// What it is called.
    pub name: &'static str,
    /// Its colour, as CSS.
    pub colour: &'static str,
    /// The values.
    pub values: Vec<f64>,
}

/// How values are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// Bars, those of one place overlapping.
    Bars,
    /// Points joined by lines.
    Lines,
}

/// A plot of positive values over named places.
pub struct Plot<'a> {
    /// What the places are, with unit.
    pub across: &'a str,
    /// What the values are, with unit.
    pub up: &'a str,
    /// The places' names.
    pub places: Vec<String>,
    /// The values.
    pub series: Vec<Series>,
    /// How they are drawn.
    pub form: Form,
}

impl Plot<'_> {
    /// The plot as an SVG element. Empty if there is no positive value.
    pub fn svg(&self) -> String {
        let positive =
            || self.series.iter().flat_map(|s| &s.values).copied().filter(|v| *v > 0.0 && v.is_finite());
        let (Some(least), Some(most)) = (positive().reduce(f64::min), positive().reduce(f64::max)) else {
            return String::new();
        };
        let high = (most.log10().ceil() as i32).max(least.log10().floor() as i32 + 1);
        let low = (least.log10().floor() as i32).max(high - MOST_DECADES);
        let scale = Scale { low, high, places: self.places.len().max(1) };
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{} over {}\">",
            self.up, self.across
        );
        self.axes(&scale, &mut svg);
        match self.form {
            Form::Bars => self.bars(&scale, &mut svg),
            Form::Lines => self.lines(&scale, &mut svg),
        }
        svg.push_str("</svg>");
        svg + &self.legend()
    }

    fn axes(&self, scale: &Scale, svg: &mut String) {
        let step = ((scale.high - scale.low) / 9 + 1) as usize;
        for decade in (scale.low..=scale.high).step_by(step) {
            let y = scale.y(10f64.powi(decade));
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{y:.1}\" y2=\"{y:.1}\"/>\
                 <text class=\"up\" x=\"{}\" y=\"{:.1}\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 6.0,
                y + 4.0,
                decade_name(decade)
            );
        }
        let every = self.places.len().div_ceil(MOST_NAMES).max(1);
        for (i, place) in self.places.iter().enumerate().step_by(every) {
            let x = scale.x(i as f64 + 0.5);
            let _ = write!(
                svg,
                "<text class=\"at\" x=\"{x:.1}\" y=\"{}\">{place}</text>",
                HEIGHT - BOTTOM + 16.0
            );
        }
        let middle = 0.5 * (LEFT + WIDTH - RIGHT);
        let up = 0.5 * (TOP + HEIGHT - BOTTOM);
        let _ = write!(
            svg,
            "<text class=\"at\" x=\"{middle}\" y=\"{}\">{}</text>\
             <text class=\"at\" transform=\"translate(14 {up}) rotate(-90)\">{}</text>",
            HEIGHT - 8.0,
            self.across,
            self.up
        );
    }

    fn bars(&self, scale: &Scale, svg: &mut String) {
        // They overlap, so that one on its own is wide.
        let step = 0.3 / self.series.len().max(2) as f64;
        let width = 0.9 - step * (self.series.len().max(1) - 1) as f64;
        for (nth, series) in self.series.iter().enumerate() {
            for (i, &value) in series.values.iter().enumerate().filter(|(_, v)| **v > 0.0) {
                let from = i as f64 + 0.05 + nth as f64 * step;
                let (x, next, y) = (scale.x(from), scale.x(from + width), scale.y(value));
                // A bar of one still shows.
                let y = y.min(HEIGHT - BOTTOM - 2.0);
                let _ = write!(
                    svg,
                    "<rect x=\"{x:.1}\" y=\"{y:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"{}\" fill-opacity=\"0.85\"><title>{}: {value}</title></rect>",
                    next - x,
                    HEIGHT - BOTTOM - y,
                    series.colour,
                    series.name
                );
            }
        }
    }

    fn lines(&self, scale: &Scale, svg: &mut String) {
        for series in &self.series {
            let lowest = 10f64.powi(scale.low);
            let shown = series.values.iter().enumerate().filter(|(_, v)| **v >= lowest && v.is_finite());
            let points: Vec<(f64, f64, f64)> =
                shown.map(|(i, &v)| (scale.x(i as f64 + 0.5), scale.y(v), v)).collect();
            let path: Vec<String> = points.iter().map(|(x, y, _)| format!("{x:.1},{y:.1}")).collect();
            let _ = write!(
                svg,
                "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"2\" points=\"{}\"/>",
                series.colour,
                path.join(" ")
            );
            for (x, y, value) in points {
                let _ = write!(
                    svg,
                    "<circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{}\"><title>{}: {}</title></circle>",
                    series.colour,
                    series.name,
                    short(value)
                );
            }
        }
    }

    fn legend(&self) -> String {
        let entry = |s: &Series| format!("<span><i style=\"background:{}\"></i>{}</span>", s.colour, s.name);
        format!("<p class=\"legend\">{}</p>", self.series.iter().map(entry).collect::<String>())
    }
}

/// From places and values to the plot's coordinates.
struct Scale {
    low: i32,
    high: i32,
    places: usize,
}

impl Scale {
    fn x(&self, place: f64) -> f64 {
        LEFT + (WIDTH - RIGHT - LEFT) * place / self.places as f64
    }

    fn y(&self, value: f64) -> f64 {
        let share = (value.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        HEIGHT - BOTTOM - (HEIGHT - BOTTOM - TOP) * share.clamp(0.0, 1.0)
    }
}

/// A power of ten as people read it.
pub fn decade_name(decade: i32) -> String {
    match decade {
        -3..=0 => format!("{:.*}", -decade as usize, 10f64.powi(decade)),
        1..=3 => format!("{}", 10i64.pow(decade as u32)),
        _ => format!("1e{decade}"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(values: Vec<f64>, form: Form) -> String {
        let places = (0..values.len()).map(|i| i.to_string()).collect();
        let series = vec![Series { name: "max", colour: "#000", values }];
        Plot { across: "place", up: "error, mm", places, series, form }.svg()
    }

    #[test]
    fn nothing_positive_makes_no_plot_and_no_number_is_lost_or_invented() {
        assert_eq!(plot(vec![0.0, f64::NAN, f64::INFINITY], Form::Lines), "");
        let lines = plot(vec![1e-3, 0.0, 2.0, f64::NAN], Form::Lines);
        assert_eq!(lines.matches("<circle").count(), 2);
        assert!(!lines.contains("NaN") && !lines.contains("inf"), "{lines}");
        assert_eq!(plot(vec![1.0, 5.0, 0.0], Form::Bars).matches("<rect").count(), 2);
    }

    #[test]
    fn decades_are_named_as_people_read_them() {
        assert_eq!([-13, -2, 0, 2, 6].map(decade_name), ["1e-13", "0.01", "1", "100", "1e6"]);
    }
}
