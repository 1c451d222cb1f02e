//! The drawings: each a function from numbers to SVG whose colours are the page's.
use super::residuals::Residual;
use crate::recording::Detection;
use crate::scene::Moment;
use crate::svg::{escaped, points};
use std::fmt::Write;

/// Points that a drawing shows at most: more is a blot, and a heavy page.
const POINTS: usize = 3000;

/// Arrows that a map has at most: more cover the dots, and each other.
const ARROWS: usize = 250;

/// Residuals around nothing, as far as four standard deviations `sd` [px] to each side; those beyond lie on the edge. Circles at one, two and
/// three are drawn over them, so that the densest cloud hides none.
pub(super) fn scatter(residuals: &[&Residual], sd: f64) -> String {
    let reach = 4.0 * sd;
    let place = |error: f64| 150.0 + 130.0 * (error / reach).clamp(-1.0, 1.0);
    let mut svg = open(300.0, 310.0);
    for residual in residuals.iter().step_by(residuals.len().div_ceil(POINTS).max(1)) {
        let [x, y] = residual.error.map(place);
        let class = if residual.distance() > reach { "bad" } else { "mark" };
        let _ = write!(svg, "<circle class=\"{class}\" fill-opacity=\"0.5\" cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"1.8\"/>");
    }
    svg += "<path class=\"axis\" d=\"M20 150H280M150 20V280\"/>";
    for radius in [1.0, 2.0, 3.0] {
        let r = 130.0 * radius / 4.0;
        let _ = write!(svg, "<circle class=\"ring\" cx=\"150\" cy=\"150\" r=\"{r:.1}\"/>");
    }
    // Below everything that can be drawn.
    let _ = write!(svg, "<text x=\"280\" y=\"304\" text-anchor=\"end\">to ±{reach:.2} px</text></svg>");
    svg
}

/// Every how many of so many residuals a map has an arrow for.
pub(super) fn arrows_of(count: usize) -> usize {
    count.div_ceil(ARROWS).max(1)
}

/// Where features were seen, and over a few of them ([`arrows_of`]) their residuals, `scale` times as long as they are; dots lie over arrows.
pub(super) fn map(residuals: &[&Residual], [width, height]: [f64; 2], scale: f64) -> String {
    let mut svg = image(width, height);
    let (dot, line) = (width / 240.0, width / 500.0);
    for residual in residuals.iter().step_by(arrows_of(residuals.len())) {
        let [u, v] = residual.seen;
        let end = [u + scale * residual.error[0], v + scale * residual.error[1]];
        let _ = write!(
            svg,
            "<path class=\"arrow\" stroke-width=\"{line:.1}\" d=\"M{u:.1} {v:.1}L{:.1} {:.1}\"/>",
            end[0], end[1]
        );
    }
    for residual in residuals.iter().step_by(residuals.len().div_ceil(POINTS).max(1)) {
        let [u, v] = residual.seen;
        let _ = write!(svg, "<circle class=\"mark\" cx=\"{u:.1}\" cy=\"{v:.1}\" r=\"{dot:.1}\"/>");
    }
    svg + "</svg>"
}

/// How often each value occurs, as shares per unit, with a density that is expected.
pub(super) fn histogram(
    values: &[f64],
    [low, high]: [f64; 2],
    bins: usize,
    expected: Option<&dyn Fn(f64) -> f64>,
) -> String {
    let [left, top, width, height] = [40.0, 10.0, 540.0, 200.0];
    let step = (high - low) / bins as f64;
    let mut counts = vec![0.0; bins];
    for value in values {
        let bin = ((value - low) / step).floor().clamp(0.0, (bins - 1) as f64);
        counts[bin as usize] += 1.0 / (values.len() as f64 * step);
    }
    let curve: Vec<(f64, f64)> = expected.map_or_else(Vec::new, |density| {
        (0..=120).map(|k| low + (high - low) * f64::from(k) / 120.0).map(|x| (x, density(x))).collect()
    });
    let most = counts.iter().copied().chain(curve.iter().map(|(_, y)| *y)).fold(1e-300, f64::max);
    let x = |value: f64| left + width * (value - low) / (high - low);
    let y = |density: f64| top + height * (1.0 - density / most);
    let mut svg = open(600.0, 240.0);
    for (bin, density) in counts.iter().enumerate() {
        let from = x(low + bin as f64 * step);
        let _ = write!(
            svg,
            "<rect class=\"mark\" fill-opacity=\"0.7\" x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\"/>",
            from + 0.5,
            y(*density),
            (width / bins as f64 - 1.0).max(0.5),
            top + height - y(*density)
        );
    }
    if !curve.is_empty() {
        let line = points(curve.iter().map(|(at, density)| [x(*at), y(*density)]));
        let _ = write!(svg, "<polyline class=\"expected\" points=\"{line}\"/>");
    }
    let _ = write!(svg, "<path class=\"axis\" d=\"M{left} {0}H{1}\"/>", top + height, left + width);
    for tick in 0..=4 {
        let at = low + (high - low) * f64::from(tick) / 4.0;
        let _ = write!(svg, "<text x=\"{:.1}\" y=\"228\" text-anchor=\"middle\">{at:.2}</text>", x(at));
    }
    svg + "</svg>"
}

/// Where every joint has been: a strip each, between its limits where they are known.
pub(super) fn strips(strips: &[Strip]) -> String {
    // A name may be long, and stands above its strip.
    let height = 46.0 * strips.len() as f64;
    let mut svg = open(600.0, height);
    for (row, strip) in strips.iter().enumerate() {
        let y = 46.0 * row as f64 + 32.0;
        let [low, high] = strip.range;
        let x = |value: f64| 60.0 + 480.0 * (value - low) / (high - low).max(1e-12);
        let _ = write!(svg, "<text x=\"0\" y=\"{:.0}\">{}</text>", y - 14.0, escaped(&strip.name));
        let _ = write!(svg, "<path class=\"axis\" d=\"M60 {y}H540\"/>");
        for value in strip.values.iter().step_by(strip.values.len().div_ceil(400).max(1)) {
            let _ = write!(
                svg,
                "<path class=\"line\" stroke-opacity=\"0.5\" d=\"M{0:.1} {1}V{2}\"/>",
                x(*value),
                y - 7.0,
                y + 7.0
            );
        }
        let _ = write!(svg, "<text x=\"54\" y=\"{0:.0}\" text-anchor=\"end\">{low:.2}</text>", y + 4.0);
        let _ = write!(svg, "<text x=\"546\" y=\"{0:.0}\">{high:.2}</text>", y + 4.0);
    }
    svg + "</svg>"
}

/// A joint's readings, and the range that they are drawn in.
pub(super) struct Strip {
    pub name: String,
    pub range: [f64; 2],
    pub values: Vec<f64>,
}

/// A quantity against time.
pub(super) struct Curve<'a> {
    /// What it is, with its unit.
    pub words: &'a str,
    /// Time [s] and value; NaN where it is not known.
    pub values: &'a [(f64, f64)],
    /// On a logarithmic ordinate; what is not above 0 then lies at its foot.
    pub is_logarithmic: bool,
    /// Values that are marked by lines, such as limits.
    pub bounds: &'a [f64],
}

/// The curve, from the first time to the last.
pub(super) fn curve(curve: &Curve<'_>) -> String {
    let [left, top, width, height] = [56.0, 24.0, 524.0, 180.0];
    let scaled = |value: f64| if curve.is_logarithmic { value.max(1e-12).log10() } else { value };
    let finite = || curve.values.iter().map(|(_, value)| *value).chain(curve.bounds.iter().copied());
    let known = || finite().filter(|value| value.is_finite() && (!curve.is_logarithmic || *value > 0.0)).map(scaled);
    let (low, high) = known().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), value| (a.min(value), b.max(value)));
    let (low, high) = match (curve.is_logarithmic, low < high) {
        (true, _) if low.is_finite() => (low.floor(), high.ceil().max(low.floor() + 1.0)),
        (false, true) => (low - 0.05 * (high - low), high + 0.05 * (high - low)),
        (false, false) if low.is_finite() => (low - 1.0, low + 1.0),
        _ => (0.0, 1.0),
    };
    let first = curve.values.first().map_or(0.0, |(time, _)| *time);
    let span = curve.values.last().map_or(0.0, |(time, _)| time - first).max(1e-9);
    let x = |time: f64| left + width * (time - first) / span;
    let y = |value: f64| top + height * (1.0 - ((scaled(value) - low) / (high - low)).clamp(0.0, 1.0));
    let mut svg = open(600.0, 240.0);
    let _ = write!(svg, "<text x=\"{left}\" y=\"14\">{}</text>", escaped(curve.words));
    let _ = write!(svg, "<path class=\"axis\" d=\"M{left} {top}V{0}H{1}\"/>", top + height, left + width);
    let ticks: Vec<f64> = if curve.is_logarithmic {
        let every = ((high - low) / 6.0).ceil().max(1.0);
        (0..)
            .map(|k| low + every * f64::from(k))
            .take_while(|tick| *tick <= high)
            .map(|tick| 10.0_f64.powf(tick))
            .collect()
    } else {
        (0..=4).map(|k| low + (high - low) * f64::from(k) / 4.0).collect()
    };
    for tick in ticks {
        let words = if curve.is_logarithmic { format!("{tick}") } else { format!("{tick:.2}") };
        let _ =
            write!(svg, "<text x=\"{:.0}\" y=\"{:.1}\" text-anchor=\"end\">{words}</text>", left - 6.0, y(tick) + 4.0);
    }
    for tick in 0..=4 {
        let time = first + span * f64::from(tick) / 4.0;
        let _ = write!(svg, "<text x=\"{:.1}\" y=\"222\" text-anchor=\"middle\">{time:.1} s</text>", x(time));
    }
    for bound in curve.bounds {
        let _ = write!(svg, "<path class=\"expected\" d=\"M{left} {0:.1}H{1}\"/>", y(*bound), left + width);
    }
    let thinned: Vec<(f64, f64)> =
        curve.values.iter().copied().step_by(curve.values.len().div_ceil(POINTS).max(1)).collect();
    for known in thinned.split(|(_, value)| !value.is_finite()).filter(|known| !known.is_empty()) {
        let line = points(known.iter().map(|(time, value)| [x(*time), y(*value)]));
        let _ = write!(svg, "<polyline class=\"line\" stroke-width=\"1.5\" points=\"{line}\"/>");
    }
    svg + "</svg>"
}

/// The ways of the features in an image, where they shall be at the end, and a dot each that the page moves.
pub(super) fn ways(moments: &[Moment], camera: u32, n_features: u32, [width, height]: [f64; 2]) -> String {
    let mut svg = image(width, height);
    let (dot, line) = (width / 130.0, width / 600.0);
    for feature in 0..n_features {
        let is_it = |detection: &&Detection| (detection.camera, detection.feature) == (camera, feature);
        let every = moments.len().div_ceil(POINTS).max(1);
        let seen: Vec<Option<[f64; 2]>> =
            moments.iter().step_by(every).map(|moment| Some(moment.pixels.iter().find(is_it)?.pixel)).collect();
        // A way has gaps where its tracker was lost.
        for way in seen.split(Option::is_none).filter(|way| way.len() > 1) {
            let way = points(way.iter().flatten().copied());
            let _ = write!(svg, "<polyline class=\"way\" stroke-width=\"{line:.2}\" points=\"{way}\"/>");
        }
        if let Some(goal) = moments.last().and_then(|moment| moment.goal.iter().find(is_it)) {
            let [u, v] = goal.pixel;
            let _ = write!(
                svg,
                "<path class=\"goal\" stroke-width=\"{:.2}\" d=\"M{1:.1} {v:.1}H{2:.1}M{u:.1} {3:.1}V{4:.1}\"/>",
                1.5 * line,
                u - dot,
                u + dot,
                v - dot,
                v + dot
            );
        }
        let _ = write!(
            svg,
            "<circle class=\"now\" data-camera=\"{camera}\" data-feature=\"{feature}\" r=\"{:.1}\" visibility=\"hidden\"/>",
            0.7 * dot
        );
    }
    svg + "</svg>"
}

fn open(width: f64, height: f64) -> String {
    format!("<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width:.0} {height:.0}\" role=\"img\">")
}

/// A drawing of an image's size [px] with its border.
fn image(width: f64, height: f64) -> String {
    let [right, bottom] = [width - 1.0, height - 1.0];
    open(width, height)
        + &format!("<rect class=\"axis\" x=\"0.5\" y=\"0.5\" width=\"{right:.0}\" height=\"{bottom:.0}\"/>")
}
