//! Plots of curves on logarithmic axes, as SVG that takes its colours from the surrounding page.

use std::fmt::Write;

/// One curve. Its colours are those of the page: `var(--c0)` and so on.
#[derive(Clone, Debug)]
pub struct Series {
    pub label: String,
    /// Index into the page's colours, from 0.
    pub color: usize,
    pub style: Style,
    pub points: Vec<(f64, f64)>,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Measured values: a line with a dot at each step.
    Measured,
    /// Estimated or expected values: dashes.
    Dashed,
    /// Values for comparison: a thin line without dots.
    Thin,
}

/// A region between two curves with the same x.
#[derive(Clone, Debug)]
pub struct Band {
    pub color: usize,
    /// x, lower y, upper y.
    pub points: Vec<(f64, f64, f64)>,
}

/// A plot with two logarithmic axes; points that are not positive are omitted.
#[derive(Clone, Debug)]
pub struct Plot {
    pub title: String,
    pub x_label: String,
    pub y_label: String,
    pub series: Vec<Series>,
    pub band: Option<Band>,
    /// Horizontal lines: height and label.
    pub levels: Vec<(f64, String)>,
}

const WIDTH: f64 = 620.0;
const HEIGHT: f64 = 400.0;
const LEFT: f64 = 66.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 14.0;
const BOTTOM: f64 = 46.0;

impl Plot {
    pub fn svg(&self) -> String {
        let x = Axis::over(self.points().map(|p| p.0), LEFT, WIDTH - RIGHT);
        let heights = self.points().map(|p| p.1).chain(self.levels.iter().map(|level| level.0));
        let y = Axis::over(heights, HEIGHT - BOTTOM, TOP);
        let mut svg =
            format!("<svg viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"img\" aria-label=\"{}\">\n", escape(&self.title));
        self.write_axes(&mut svg, &x, &y);
        if let Some(band) = &self.band {
            let upper = band.points.iter().map(|p| (p.0, p.2));
            let lower = band.points.iter().rev().map(|p| (p.0, p.1));
            let outline = path(upper.chain(lower), &x, &y);
            let _ = writeln!(svg, "<path d=\"{outline} Z\" fill=\"var(--c{})\" fill-opacity=\"0.15\"/>", band.color);
        }
        for (height, name) in self.levels.iter().filter(|level| level.0 > 0.0) {
            let at = y.at(*height);
            let _ = writeln!(
                svg,
                "<path d=\"M{LEFT} {at:.1} H{:.1}\" class=\"level\"/>\
                 <text x=\"{:.1}\" y=\"{:.1}\" class=\"tick\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                WIDTH - RIGHT - 4.0,
                at - 4.0,
                escape(name)
            );
        }
        for series in &self.series {
            series.write(&mut svg, &x, &y);
        }
        svg.push_str("</svg>\n");
        svg
    }

    /// Labels and colours of the curves, to be placed beside the plot.
    pub fn legend(&self) -> String {
        let entry = |series: &Series| {
            let class = match series.style {
                Style::Measured => "measured",
                Style::Dashed => "dashed",
                Style::Thin => "thin",
            };
            let label = escape(&series.label);
            format!("<li class=\"{class}\" style=\"--c: var(--c{})\">{label}</li>", series.color)
        };
        format!("<ul class=\"legend\">{}</ul>\n", self.series.iter().map(entry).collect::<String>())
    }

    fn points(&self) -> impl Iterator<Item = (f64, f64)> {
        let of_band = self.band.iter().flat_map(|band| &band.points).flat_map(|p| [(p.0, p.1), (p.0, p.2)]);
        self.series.iter().flat_map(|series| series.points.iter().copied()).chain(of_band).filter(|p| is_shown(*p))
    }

    fn write_axes(&self, svg: &mut String, x: &Axis, y: &Axis) {
        for (value, label) in x.ticks() {
            let at = x.at(value);
            let class = if label { "grid" } else { "grid minor" };
            let _ = writeln!(svg, "<path d=\"M{at:.1} {TOP} V{:.1}\" class=\"{class}\"/>", HEIGHT - BOTTOM);
            if label {
                let text = number(value);
                let y = HEIGHT - BOTTOM + 16.0;
                let _ =
                    writeln!(svg, "<text x=\"{at:.1}\" y=\"{y}\" class=\"tick\" text-anchor=\"middle\">{text}</text>");
            }
        }
        for (value, label) in y.ticks() {
            let at = y.at(value);
            let class = if label { "grid" } else { "grid minor" };
            let _ = writeln!(svg, "<path d=\"M{LEFT} {at:.1} H{:.1}\" class=\"{class}\"/>", WIDTH - RIGHT);
            if label {
                let text = number(value);
                let (x, y) = (LEFT - 6.0, at + 4.0);
                let _ = writeln!(svg, "<text x=\"{x}\" y=\"{y:.1}\" class=\"tick\" text-anchor=\"end\">{text}</text>");
            }
        }
        let (middle_x, middle_y) = (0.5 * (LEFT + WIDTH - RIGHT), 0.5 * (TOP + HEIGHT - BOTTOM));
        let _ = writeln!(
            svg,
            "<text x=\"{middle_x}\" y=\"{}\" class=\"label\" text-anchor=\"middle\">{}</text>\
             <text transform=\"translate(14 {middle_y}) rotate(-90)\" class=\"label\" text-anchor=\"middle\">{}</text>",
            HEIGHT - 8.0,
            escape(&self.x_label),
            escape(&self.y_label)
        );
    }
}

impl Series {
    fn write(&self, svg: &mut String, x: &Axis, y: &Axis) {
        let shown = || self.points.iter().copied().filter(|p| is_shown(*p));
        let (line, color) = (path(shown(), x, y), self.color);
        let (width, dashes) = match self.style {
            Style::Measured => (2.0, ""),
            Style::Dashed => (1.5, " stroke-dasharray=\"5 4\""),
            Style::Thin => (1.3, ""),
        };
        let _ = writeln!(
            svg,
            "<path d=\"{line}\" fill=\"none\" stroke=\"var(--c{color})\" stroke-width=\"{width}\"{dashes}/>"
        );
        if self.style != Style::Measured {
            return;
        }
        for point in shown() {
            let (cx, cy) = (x.at(point.0), y.at(point.1));
            let _ = writeln!(
                svg,
                "<circle cx=\"{cx:.1}\" cy=\"{cy:.1}\" r=\"3.2\" fill=\"var(--c{color})\"><title>{}: {} → {}</title></circle>",
                escape(&self.label),
                number(point.0),
                number(point.1)
            );
        }
    }
}

/// A logarithmic axis between two positions of the plot.
struct Axis {
    low: f64,
    high: f64,
    start: f64,
    end: f64,
}

impl Axis {
    fn over(values: impl Iterator<Item = f64>, start: f64, end: f64) -> Self {
        let (low, high) = values
            .filter(|value| *value > 0.0 && value.is_finite())
            .fold((f64::INFINITY, 0.0_f64), |(low, high), value| (low.min(value), high.max(value)));
        // An axis needs a length, and curves must not touch its ends.
        let (low, high) = if low <= high { (low, high.max(low * 1.5)) } else { (1.0, 10.0) };
        let margin = (high / low).powf(0.04);
        Self { low: (low / margin).log10(), high: (high * margin).log10(), start, end }
    }

    fn at(&self, value: f64) -> f64 {
        self.start + (value.log10() - self.low) / (self.high - self.low) * (self.end - self.start)
    }

    /// Grid lines, and whether each is labelled: at least three are.
    fn ticks(&self) -> Vec<(f64, bool)> {
        let decades = self.high - self.low;
        let all = (self.low.floor() as i32..=self.high.ceil() as i32)
            .flat_map(|decade| (1..10).map(move |digit| (digit, f64::from(digit) * 10f64.powi(decade))));
        let shown: Vec<(u32, f64)> = all.filter(|(_, value)| (self.low..=self.high).contains(&value.log10())).collect();
        let wanted: [&[u32]; 3] = [&[1], &[1, 2, 5], &[1, 2, 3, 4, 5, 6, 7, 8, 9]];
        let n_named = |digits: &&&[u32]| shown.iter().filter(|(digit, _)| digits.contains(digit)).count() >= 3;
        match wanted[usize::from(decades < 2.5)..].iter().find(n_named) {
            Some(digits) => shown.iter().map(|(digit, value)| (*value, digits.contains(digit))).collect(),
            None => self.even_ticks().into_iter().map(|value| (value, true)).collect(),
        }
    }

    /// Ticks of a very short axis, which is nearly linear: at least three lines, at 1, 2 or 5 times a power of ten.
    fn even_ticks(&self) -> Vec<f64> {
        let (low, high) = (10f64.powf(self.low), 10f64.powf(self.high));
        let power = 10f64.powf((high - low).log10().ceil());
        let lines =
            |step: f64| ((low / step).ceil() as i64..=(high / step).floor() as i64).map(move |k| k as f64 * step);
        let steps = [0.5, 0.2, 0.1, 0.05].map(|share| share * power);
        let step = steps.into_iter().find(|&step| lines(step).count() >= 3).unwrap_or(0.02 * power);
        lines(step).collect()
    }
}

fn is_shown((x, y): (f64, f64)) -> bool {
    x > 0.0 && y > 0.0 && x.is_finite() && y.is_finite()
}

fn path(points: impl Iterator<Item = (f64, f64)>, x: &Axis, y: &Axis) -> String {
    let step = |(i, point): (usize, (f64, f64))| {
        format!("{}{:.1} {:.1}", if i == 0 { "M" } else { " L" }, x.at(point.0), y.at(point.1))
    };
    points.enumerate().map(step).collect()
}

/// Formats a number with about three digits, as short as possible.
pub fn number(value: f64) -> String {
    if value == 0.0 {
        return "0".to_owned();
    }
    let digits = value.abs().log10().floor() as i32;
    if !(-4..7).contains(&digits) {
        let mantissa = format!("{:.1}", value / 10f64.powi(digits));
        return format!("{}e{digits}", mantissa.trim_end_matches(".0"));
    }
    let decimals = (2 - digits).max(0) as usize;
    let text = format!("{value:.decimals$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

/// Escapes text for HTML and SVG.
pub fn escape(text: &str) -> String {
    text.chars().fold(String::new(), |mut out, c| {
        match c {
            '&' => out.push_str("&amp;"),
            '<' => out.push_str("&lt;"),
            '>' => out.push_str("&gt;"),
            '"' => out.push_str("&quot;"),
            _ => out.push(c),
        }
        out
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_short_and_true() {
        for (value, text) in [
            (0.0, "0"),
            (1.0, "1"),
            (0.012_34, "0.0123"),
            (0.05, "0.05"),
            (1234.6, "1235"),
            (99.96, "100"),
            (2e-7, "2e-7"),
            (3.26e9, "3.3e9"),
        ] {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn curves_run_from_corner_to_corner_and_bad_points_are_left_out() {
        let points = vec![(0.01, 1.0), (0.1, 0.1), (f64::NAN, 1.0), (1.0, 0.0), (1.0, 0.01)];
        let plot = Plot {
            title: "a < b".to_owned(),
            x_label: "seconds".to_owned(),
            y_label: "error".to_owned(),
            series: vec![Series { label: "all".to_owned(), color: 0, style: Style::Measured, points }],
            band: None,
            levels: vec![],
        };
        let svg = plot.svg();
        assert!(svg.contains("a &lt; b") && !svg.contains("NaN") && !svg.contains("inf"), "{svg}");
        assert_eq!(svg.matches("<circle").count(), 3);
        let x = Axis::over([0.01, 1.0].into_iter(), LEFT, WIDTH - RIGHT);
        assert!((x.at(0.1) - 0.5 * (LEFT + WIDTH - RIGHT)).abs() < 1e-9);
        let named: Vec<f64> = x.ticks().into_iter().filter(|t| t.1).map(|t| t.0).collect();
        assert!(named.iter().any(|t| (t - 0.1).abs() < 1e-12) && named.iter().any(|t| (t - 0.5).abs() < 1e-12));
    }

    #[test]
    fn short_axes_have_names_too() {
        for (low, high) in
            [(0.21, 0.48), (0.11, 0.12), (0.9, 1.1), (3.0, 70.0), (0.06, 0.16), (9.0, 14.0), (1e-9, 8e-9)]
        {
            let axis = Axis::over([low, high].into_iter(), LEFT, WIDTH - RIGHT);
            let ticks = axis.ticks();
            let named: Vec<f64> = ticks.iter().filter(|tick| tick.1).map(|tick| tick.0).collect();
            assert!((3..12).contains(&named.len()), "{low}..{high}: {named:?}");
            assert!(
                ticks.iter().all(|tick| (LEFT..=WIDTH - RIGHT).contains(&axis.at(tick.0))),
                "{low}..{high}: {ticks:?}"
            );
            // Labels must be distinct.
            let texts: std::collections::HashSet<String> = named.iter().map(|value| number(*value)).collect();
            assert_eq!(texts.len(), named.len(), "{low}..{high}: {texts:?}");
        }
    }

    #[test]
    fn nothing_to_show_is_still_a_picture() {
        let plot = Plot {
            title: String::new(),
            x_label: String::new(),
            y_label: String::new(),
            series: vec![],
            band: None,
            levels: vec![],
        };
        assert!(plot.svg().contains("</svg>") && !plot.svg().contains("NaN"));
    }
}
