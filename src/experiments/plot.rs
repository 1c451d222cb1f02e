//! The curves of an experiment as an SVG drawing: ours in the median with what lies between 10 and 90 %, published ones dashed.
use super::{Outcome, Row};
use crate::svg::{Svg, points};

const WIDTH: f64 = 860.0;
const HEIGHT: f64 = 416.0;
/// Height of the title.
const HEAD: f64 = 24.0;
/// Margins: left, right with the names of the series, top, bottom.
const MARGIN: [f64; 4] = [70.0, 190.0, 20.0, 56.0];

/// Powers of ten that are drawn at most; what is smaller is at the bottom.
const DECADES: f64 = 8.0;

const COLOURS: [&str; 6] = ["#1f77b4", "#d62728", "#2ca02c", "#9467bd", "#ff7f0e", "#17becf"];

/// The rows that have a place along the abscissa, on a logarithmic ordinate, two drawings beside each other where there are several;
/// `None` where there are none.
pub fn svg(title: &str, outcome: &Outcome) -> Option<String> {
    let rows: Vec<&Row> = outcome.rows.iter().filter(|row| row.x.is_some() && !row.values.is_empty()).collect();
    let mut panels: Vec<&str> = Vec::new();
    for row in &rows {
        if !panels.contains(&row.panel) {
            panels.push(row.panel);
        }
    }
    let columns = panels.len().min(2);
    let lines = panels.len().div_ceil(2);
    let mut svg = Svg::new(WIDTH * columns.max(1) as f64, HEAD + HEIGHT * lines as f64);
    svg.text([0.5 * WIDTH * columns as f64, 20.0], "middle", title);
    for (index, panel) in panels.iter().enumerate() {
        let own: Vec<&Row> = rows.iter().copied().filter(|row| row.panel == *panel).collect();
        let corner = [WIDTH * (index % 2) as f64, HEAD + HEIGHT * (index / 2) as f64];
        let measure = if panel.is_empty() { outcome.measure } else { panel };
        draw(&mut svg, corner, &own, measure, outcome.abscissa.unwrap_or_default())?;
    }
    (!panels.is_empty()).then(|| svg.finish())
}

/// One drawing, from its upper left corner.
fn draw(svg: &mut Svg, corner: [f64; 2], rows: &[&Row], measure: &str, abscissa: &str) -> Option<()> {
    let axes = Axes::new(corner, rows)?;
    svg.text([corner[0] + 0.5 * (WIDTH - MARGIN[1] + MARGIN[0]), corner[1] + HEIGHT - 12.0], "middle", abscissa);
    svg.upwards([corner[0] + 16.0, corner[1] + 0.5 * (HEIGHT - MARGIN[3] + MARGIN[2])], measure);
    axes.draw(svg);
    let mut series: Vec<&str> = Vec::new();
    for row in rows {
        if !series.contains(&row.series) {
            series.push(row.series);
        }
    }
    let right = corner[0] + WIDTH - MARGIN[1] + 16.0;
    for (index, name) in series.iter().enumerate() {
        let colour = COLOURS[index % COLOURS.len()];
        let own: Vec<&Row> = rows.iter().copied().filter(|row| row.series == *name).collect();
        curve(svg, &axes, &own, colour);
        let y = corner[1] + MARGIN[2] + 16.0 * (index as f64 + 1.0);
        let label = if name.is_empty() { "ours" } else { name };
        svg.element(format_args!("circle cx=\"{right}\" cy=\"{}\" r=\"4\" fill=\"{colour}\"", y - 4.0));
        svg.text([right + 10.0, y], "start", label);
    }
    if rows.iter().any(|row| row.published.is_some()) {
        let y = corner[1] + MARGIN[2] + 16.0 * (series.len() as f64 + 1.0);
        svg.text([right - 4.0, y], "start", "- - published");
    }
    Some(())
}

/// Ours: the band, the line where every point is of several trials, and the points. Published: a dashed line.
fn curve(svg: &mut Svg, axes: &Axes, rows: &[&Row], colour: &str) {
    let at = |row: &Row, y: f64| axes.place(row.x.unwrap_or_default(), y);
    let share = |row: &Row, share: f64| {
        let mut sorted = row.values.clone();
        sorted.sort_by(f64::total_cmp);
        sorted[((sorted.len() - 1) as f64 * share).round() as usize]
    };
    let medians: Vec<[f64; 2]> = rows.iter().map(|row| at(row, row.median().unwrap_or_default())).collect();
    if rows.iter().any(|row| row.values.len() > 1) {
        let upper = rows.iter().map(|row| at(row, share(row, 0.9)));
        let lower = rows.iter().rev().map(|row| at(row, share(row, 0.1)));
        let band = points(upper.chain(lower));
        svg.element(format_args!("polygon points=\"{band}\" fill=\"{colour}\" fill-opacity=\"0.15\""));
        svg.line(medians.iter().copied(), &format!("stroke=\"{colour}\" stroke-width=\"2\""));
    }
    for [x, y] in medians {
        svg.element(format_args!("circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3.5\" fill=\"{colour}\""));
    }
    let published: Vec<[f64; 2]> = rows.iter().filter_map(|row| Some(at(row, row.published?.mean))).collect();
    if !published.is_empty() {
        svg.line(published, &format!("stroke=\"{colour}\" stroke-dasharray=\"6 5\""));
    }
}

/// From values to places in the drawing.
struct Axes {
    /// Upper left corner of the drawing.
    corner: [f64; 2],
    x: [f64; 2],
    /// Powers of ten.
    y: [f64; 2],
}

impl Axes {
    fn new(corner: [f64; 2], rows: &[&Row]) -> Option<Axes> {
        let range = |values: &mut dyn Iterator<Item = f64>| {
            values.fold(None, |range: Option<[f64; 2]>, value| {
                Some(range.map_or([value; 2], |[least, most]| [least.min(value), most.max(value)]))
            })
        };
        let [x0, x1] = range(&mut rows.iter().filter_map(|row| row.x))?;
        let figures = rows.iter().flat_map(|row| row.values.iter().copied().chain(row.published.map(|p| p.mean)));
        let [y0, y1] = range(&mut figures.filter(|value| *value > 0.0 && value.is_finite())).unwrap_or([1.0; 2]);
        let pad = 0.03 * (x1 - x0).max(1e-6 * x1.abs()).max(1e-12);
        let (low, high) = (y0.log10().floor(), y1.log10().ceil());
        Some(Axes { corner, x: [x0 - pad, x1 + pad], y: [low.max(high - DECADES), high.max(low + 1.0)] })
    }

    /// Where a value stands [px of the drawing].
    fn place(&self, x: f64, y: f64) -> [f64; 2] {
        let along = (x - self.x[0]) / (self.x[1] - self.x[0]);
        let up = (y.max(f64::MIN_POSITIVE).log10() - self.y[0]) / (self.y[1] - self.y[0]);
        [
            self.corner[0] + MARGIN[0] + along * (WIDTH - MARGIN[0] - MARGIN[1]),
            self.corner[1] + HEIGHT - MARGIN[3] - up.clamp(0.0, 1.0) * (HEIGHT - MARGIN[2] - MARGIN[3]),
        ]
    }

    /// A line per power of ten, five numbers along the abscissa.
    fn draw(&self, svg: &mut Svg) {
        for power in self.y[0] as i32..=self.y[1] as i32 {
            let value = 10.0_f64.powi(power);
            let [left, y] = self.place(self.x[0], value);
            svg.line([[left, y], [self.corner[0] + WIDTH - MARGIN[1], y]], "stroke=\"#ddd\"");
            svg.text([left - 6.0, y + 4.0], "end", &format!("{value}"));
        }
        for tick in 0..5 {
            let value = self.x[0] + (self.x[1] - self.x[0]) * (0.03 / 1.06 + f64::from(tick) / 4.0 / 1.06);
            let [x, _] = self.place(value, 1.0);
            let span = self.x[1] - self.x[0];
            let value = if value.abs() < 1e-9 * span { 0.0 } else { value };
            let digits = if span > 5.0 { 0 } else { (1.0 - span.log10()).ceil().max(0.0) as usize };
            svg.text([x, self.corner[1] + HEIGHT - MARGIN[3] + 18.0], "middle", &format!("{value:.digits$}"));
        }
    }
}
