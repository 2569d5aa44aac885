//! Curves over a measured quantity: both axes linear or logarithmic.

use std::fmt::Write as _;

use super::{escape, short};

const WIDTH: f64 = 680.0;
const HEIGHT: f64 = 340.0;
const LEFT: f64 = 68.0;
const RIGHT: f64 = 16.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 48.0;

/// Names on an axis at most, about.
const MOST_TICKS: f64 = 7.0;

/// Points of a curve that are marked at most.
const MOST_MARKS: usize = 60;

/// What a picture that stands alone needs of the page's style.
const STYLE: &str = "svg{background:#fff;font:11px sans-serif}.grid{stroke:#e3e3e3}text{fill:#444}.up{text-anchor:end}\
                     .at{text-anchor:middle}";

/// Colours told apart by most readers, for curves in order (Okabe & Ito 2008, with black for yellow).
pub const COLOURS: [&str; 8] =
    ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#222222", "#7a7a7a"];

/// One curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// What it is called in the legend; not in it if empty.
    pub name: String,
    /// Its colour, as CSS.
    pub colour: &'static str,
    /// Its points, in the order in which they are joined; those that an axis cannot show are left out.
    pub points: Vec<Point>,
    /// Whether its line is dashed.
    pub dashed: bool,
}

/// One point of a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Point {
    /// Across.
    pub x: f64,
    /// Up.
    pub y: f64,
    /// What it is, shown where a pointer rests on it.
    pub name: String,
}

/// How values are laid out on an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Spacing {
    /// Equal steps for equal differences, from zero or the least value.
    Linear,
    /// Equal steps for equal differences, from the least value to the greatest.
    Between,
    /// Equal steps for equal ratios; only positive values show.
    Logarithmic,
}

/// An axis: what it shows, with its unit, and how.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Axis<'a> {
    /// What it shows, with its unit.
    pub name: &'a str,
    /// How.
    pub spacing: Spacing,
}

/// A plot of curves.
#[derive(Clone, Debug, PartialEq)]
pub struct Curves<'a> {
    /// The axis across.
    pub across: Axis<'a>,
    /// The axis up.
    pub up: Axis<'a>,
    /// The curves.
    pub curves: Vec<Curve>,
}

impl Curves<'_> {
    /// The plot as an SVG element with a legend, to stand in a page. Empty if no point can be shown.
    pub fn html(&self) -> String {
        let svg = self.svg("");
        if svg.is_empty() {
            return svg;
        }
        let entry =
            |c: &Curve| format!("<span><i style=\"background:{}\"></i>{}</span>", c.colour, escape(&c.name));
        let legend: String = self.named().map(entry).collect();
        format!("<figure>{svg}<p class=\"legend\">{legend}</p></figure>")
    }

    /// The plot as an SVG file. Empty if no point can be shown.
    pub fn file(&self) -> String {
        let legend: String = self
            .named()
            .enumerate()
            .map(|(i, curve)| {
                let y = TOP + 14.0 + 14.0 * i as f64;
                format!(
                    "<rect x=\"{}\" y=\"{}\" width=\"9\" height=\"9\" fill=\"{}\"/><text class=\"up\" x=\"{}\" y=\"{y}\">{}</text>",
                    WIDTH - RIGHT - 14.0,
                    y - 8.0,
                    curve.colour,
                    WIDTH - RIGHT - 18.0,
                    escape(&curve.name)
                )
            })
            .collect();
        let svg = self.svg(&legend);
        let head =
            format!("<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{WIDTH}\" height=\"{HEIGHT}\" ");
        svg.replacen("<svg ", &head, 1).replacen('>', &format!("><style>{STYLE}</style>"), 1)
    }

    /// The curves of the legend: all that have a name.
    fn named(&self) -> impl Iterator<Item = &Curve> {
        self.curves.iter().filter(|curve| !curve.name.is_empty())
    }

    fn svg(&self, extra: &str) -> String {
        let can_show =
            |axis: &Axis, v: f64| v.is_finite() && (axis.spacing != Spacing::Logarithmic || v > 0.0);
        let shown = |c: &Curve| -> Vec<Point> {
            c.points
                .iter()
                .filter(|p| can_show(&self.across, p.x) && can_show(&self.up, p.y))
                .cloned()
                .collect()
        };
        let curves: Vec<(&Curve, Vec<Point>)> = self.curves.iter().map(|c| (c, shown(c))).collect();
        let points = || curves.iter().flat_map(|(_, points)| points);
        let (Some(x), Some(y)) = (
            Scale::new(self.across.spacing, points().map(|p| p.x), [LEFT, WIDTH - RIGHT]),
            Scale::new(self.up.spacing, points().map(|p| p.y), [HEIGHT - BOTTOM, TOP]),
        ) else {
            return String::new();
        };
        let mut svg = format!(
            "<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{} over {}\">",
            escape(self.up.name),
            escape(self.across.name)
        );
        self.axes(&x, &y, &mut svg);
        svg.push_str(extra);
        for (curve, points) in &curves {
            draw(curve, points, &x, &y, &mut svg);
        }
        svg + "</svg>"
    }

    fn axes(&self, x: &Scale, y: &Scale, svg: &mut String) {
        for tick in y.ticks() {
            let at = y.at(tick);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{LEFT}\" x2=\"{}\" y1=\"{at:.1}\" y2=\"{at:.1}\"/>\
                 <text class=\"up\" x=\"{}\" y=\"{:.1}\">{}</text>",
                WIDTH - RIGHT,
                LEFT - 6.0,
                at + 4.0,
                tick_name(tick)
            );
        }
        for tick in x.ticks() {
            let at = x.at(tick);
            let _ = write!(
                svg,
                "<line class=\"grid\" x1=\"{at:.1}\" x2=\"{at:.1}\" y1=\"{TOP}\" y2=\"{}\"/>\
                 <text class=\"at\" x=\"{at:.1}\" y=\"{}\">{}</text>",
                HEIGHT - BOTTOM,
                HEIGHT - BOTTOM + 16.0,
                tick_name(tick)
            );
        }
        let _ = write!(
            svg,
            "<text class=\"at\" x=\"{}\" y=\"{}\">{}</text>\
             <text class=\"at\" transform=\"translate(14 {}) rotate(-90)\">{}</text>",
            0.5 * (LEFT + WIDTH - RIGHT),
            HEIGHT - 8.0,
            escape(self.across.name),
            0.5 * (TOP + HEIGHT - BOTTOM),
            escape(self.up.name)
        );
    }
}

fn draw(curve: &Curve, points: &[Point], x: &Scale, y: &Scale, svg: &mut String) {
    let path: Vec<String> = points.iter().map(|p| format!("{:.1},{:.1}", x.at(p.x), y.at(p.y))).collect();
    let dash = if curve.dashed { " stroke-dasharray=\"5 4\"" } else { "" };
    let _ = write!(
        svg,
        "<polyline fill=\"none\" stroke=\"{}\" stroke-width=\"1.6\"{dash} points=\"{}\"/>",
        curve.colour,
        path.join(" ")
    );
    // Where points are dense, the line shows them.
    let marked = if points.len() > MOST_MARKS { &[] } else { points };
    for point in marked {
        let _ = write!(
            svg,
            "<circle cx=\"{:.1}\" cy=\"{:.1}\" r=\"3.2\" fill=\"{}\"><title>{}: {}, {}</title></circle>",
            x.at(point.x),
            y.at(point.y),
            curve.colour,
            escape(&point.name),
            short(point.x),
            short(point.y)
        );
    }
}

/// From values to places on the plot.
struct Scale {
    spacing: Spacing,
    /// The least and greatest value shown, as logarithms where the spacing is.
    range: [f64; 2],
    /// Where those are.
    place: [f64; 2],
}

impl Scale {
    /// `None` if there is no value.
    fn new(spacing: Spacing, values: impl Iterator<Item = f64> + Clone, place: [f64; 2]) -> Option<Self> {
        let (least, most) = (values.clone().reduce(f64::min)?, values.reduce(f64::max)?);
        let range = match spacing {
            Spacing::Linear => {
                let low = least.min(0.0);
                [low, if most > low { low + 1.05 * (most - low) } else { low + 1.0 }]
            }
            Spacing::Between => {
                // A single value has room around it, too.
                let room = if most > least { 0.03 * (most - least) } else { 1.0 };
                [least - room, most + room]
            }
            Spacing::Logarithmic => {
                let [low, high] = [least.log10() - 0.08, most.log10() + 0.08];
                // A single value still has room around it.
                if high - low < 0.5 { [low - 0.2, high + 0.2] } else { [low, high] }
            }
        };
        Some(Self { spacing, range, place })
    }

    fn at(&self, value: f64) -> f64 {
        let value = if self.spacing == Spacing::Logarithmic { value.log10() } else { value };
        let share = (value - self.range[0]) / (self.range[1] - self.range[0]);
        self.place[0] + share * (self.place[1] - self.place[0])
    }

    /// Round values on the axis.
    fn ticks(&self) -> Vec<f64> {
        let [low, high] = self.range;
        if self.spacing != Spacing::Logarithmic {
            let step = round_step((high - low) / MOST_TICKS);
            let first = (low / step).ceil() as i64;
            return (first..).map(|i| i as f64 * step).take_while(|&t| t <= high).collect();
        }
        // Decades; where they are few, also their halves and fifths.
        let every = ((high - low) / MOST_TICKS).ceil().max(1.0) as i32;
        let between: &[f64] = if high - low > 2.5 { &[1.0] } else { &[1.0, 2.0, 5.0] };
        let decades = low.floor() as i32..=high.floor() as i32;
        decades
            .filter(|decade| decade.rem_euclid(every) == 0)
            .flat_map(|decade| between.iter().map(move |b| b * 10f64.powi(decade)))
            .filter(|tick| (low..=high).contains(&tick.log10()))
            .collect()
    }
}

/// 1, 2 or 5 times a power of ten, `step` or the next above it.
fn round_step(step: f64) -> f64 {
    let decade = 10f64.powf(step.log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|m| m * decade).find(|&s| s >= 0.999 * step).unwrap_or(step)
}

/// A round number as people read it.
fn tick_name(tick: f64) -> String {
    let magnitude = tick.abs();
    if tick != 0.0 && !(1e-3..1e5).contains(&magnitude) {
        return format!("{tick:.0e}");
    }
    // Rounding of multiples of a step does not show.
    format!("{}", (tick * 1e9).round() / 1e9)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curves(points: &[[f64; 2]], spacing: Spacing) -> Curves<'static> {
        let points = points.iter().map(|&[x, y]| Point { x, y, name: "<p>".into() }).collect();
        let curve = Curve { name: "a & b".into(), colour: COLOURS[0], points, dashed: false };
        Curves {
            across: Axis { name: "seconds", spacing },
            up: Axis { name: "error, mm", spacing },
            curves: vec![curve],
        }
    }

    #[test]
    fn points_an_axis_cannot_show_are_left_out_and_nothing_makes_no_plot() {
        let plot = curves(&[[1.0, 0.0], [2.0, 3.0], [f64::NAN, 1.0]], Spacing::Logarithmic).html();
        assert_eq!(plot.matches("<circle").count(), 1);
        assert!(!plot.contains("NaN") && plot.contains("a &amp; b") && plot.contains("&lt;p&gt;"), "{plot}");
        assert_eq!(curves(&[[-1.0, 0.0]], Spacing::Logarithmic).html(), "");
        assert_eq!(curves(&[], Spacing::Linear).file(), "");
    }

    #[test]
    fn greater_is_further_right_and_further_up() {
        for spacing in [Spacing::Linear, Spacing::Between, Spacing::Logarithmic] {
            let x = Scale::new(spacing, [0.5, 80.0].into_iter(), [10.0, 20.0]).expect("values");
            assert!(x.at(0.5) < x.at(3.0) && x.at(3.0) < x.at(80.0), "{spacing:?}");
            assert!(x.at(80.0) <= 20.0 && x.at(0.5) >= 10.0);
            let ticks = x.ticks();
            assert!((2..=12).contains(&ticks.len()) && ticks.is_sorted(), "{spacing:?}: {ticks:?}");
        }
    }

    #[test]
    fn ticks_are_round_numbers() {
        let ticks = |spacing, values: [f64; 2]| -> Vec<String> {
            let scale = Scale::new(spacing, values.into_iter(), [0.0, 1.0]).expect("values");
            scale.ticks().into_iter().map(tick_name).collect()
        };
        assert_eq!(ticks(Spacing::Linear, [0.0, 0.9]), ["0", "0.2", "0.4", "0.6", "0.8"]);
        assert_eq!(ticks(Spacing::Between, [22.0, 30.0]), ["22", "24", "26", "28", "30"]);
        assert_eq!(ticks(Spacing::Logarithmic, [0.9, 11.0]), ["1", "2", "5", "10"]);
        assert_eq!(ticks(Spacing::Logarithmic, [1e-6, 20.0]).first().map(String::as_str), Some("1e-6"));
    }

    #[test]
    fn a_file_stands_alone() {
        let svg = curves(&[[1.0, 2.0], [2.0, 3.0]], Spacing::Linear).file();
        assert!(svg.starts_with("<svg xmlns=") && svg.contains("<style>") && svg.ends_with("</svg>"));
        assert!(svg.contains(">a &amp; b</text>"), "the legend is in the picture");
    }
}
