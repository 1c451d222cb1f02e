//! A run as a drawing: errors against time, and the paths of the features in every image.
use super::{Moment, Run};
use crate::recording::Detection;
use crate::svg::Svg;

const WIDTH: f64 = 1000.0;
/// Height of the graph and of each image's panel [px of the drawing].
const GRAPH: f64 = 300.0;
const IMAGE: f64 = 360.0;
const LEFT: f64 = 70.0;
const TOP: f64 = 40.0;
const PIXELS: &str = "#1f77b4";
const SPACE: &str = "#d62728";

/// The drawing of a run, with a title.
pub fn svg(title: &str, run: &Run) -> String {
    let cameras = &run.header.cameras;
    let rows = cameras.len().div_ceil(2);
    let mut svg = Svg::new(WIDTH, TOP + GRAPH + 80.0 + rows as f64 * (IMAGE + 40.0));
    svg.text([WIDTH / 2.0, 22.0], "middle", title);
    let [px, m] = [
        run.moments.iter().map(|moment| moment.error_px.map(|error| (moment.time, error))).collect::<Vec<_>>(),
        run.moments.iter().map(|moment| Some((moment.time, moment.error_m))).collect(),
    ];
    let end = run.moments.last().map_or(1.0, |moment| moment.time).max(1e-9);
    let half = 0.5 * WIDTH;
    graph(&mut svg, [LEFT, TOP], [half - LEFT - 20.0, GRAPH], end, &px, "pixel error [px]", PIXELS);
    graph(&mut svg, [half + LEFT, TOP], [half - LEFT - 20.0, GRAPH], end, &m, "error in space [m]", SPACE);
    for (index, camera) in cameras.iter().enumerate() {
        let corner = [20.0 + (index % 2) as f64 * half, TOP + GRAPH + 90.0 + (index / 2) as f64 * (IMAGE + 40.0)];
        let [width, height] = camera.size.unwrap_or([640, 480]).map(f64::from);
        let scale = ((half - 40.0) / width).min(IMAGE / height);
        svg.text([corner[0], corner[1] - 8.0], "start", &format!("camera {}: from ○ to +", camera.name));
        svg.element(format_args!(
            "rect x=\"{:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{:.1}\" fill=\"#fafafa\" stroke=\"#999\"",
            corner[0],
            corner[1],
            width * scale,
            height * scale
        ));
        let place = |[u, v]: [f64; 2]| [corner[0] + (u + 0.5) * scale, corner[1] + (v + 0.5) * scale];
        for feature in 0..run.header.features.len() {
            path(&mut svg, &run.moments, index as u32, feature as u32, &place);
        }
    }
    svg.finish()
}

/// Where a feature went in an image, and where it should go.
fn path(svg: &mut Svg, moments: &[Moment], camera: u32, feature: u32, place: &dyn Fn([f64; 2]) -> [f64; 2]) {
    let is_it = |detection: &&Detection| (detection.camera, detection.feature) == (camera, feature);
    let seen = moments.iter().filter_map(|moment| moment.pixels.iter().find(is_it));
    let places: Vec<[f64; 2]> = seen.map(|detection| place(detection.pixel)).collect();
    let colour = format!("hsl({}, 65%, 45%)", (u64::from(feature) * 137) % 360);
    if let Some([x, y]) = places.first() {
        svg.element(format_args!("circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"4\" fill=\"none\" stroke=\"{colour}\""));
    }
    svg.line(places, &format!("stroke=\"{colour}\" stroke-width=\"1.2\""));
    let goal = moments.last().and_then(|moment| moment.goal.iter().find(is_it));
    if let Some([x, y]) = goal.map(|goal| place(goal.pixel)) {
        svg.line([[x - 5.0, y], [x + 5.0, y]], &format!("stroke=\"{colour}\""));
        svg.line([[x, y - 5.0], [x, y + 5.0]], &format!("stroke=\"{colour}\""));
    }
}

/// Errors on a logarithmic ordinate.
fn graph(
    svg: &mut Svg,
    [left, top]: [f64; 2],
    [width, height]: [f64; 2],
    end: f64,
    values: &[Option<(f64, f64)>],
    words: &str,
    colour: &str,
) {
    let known = || values.iter().flatten().map(|(_, value)| *value).filter(|value| *value > 0.0);
    let low = known().fold(f64::INFINITY, f64::min).max(1e-6).log10().floor();
    let high = known().fold(0.0, f64::max).max(1e-6).log10().ceil();
    let (low, high) = if low < high { (low, high) } else { (high - 1.0, high) };
    let place = |time: f64, value: f64| {
        let up = (value.max(1e-300).log10() - low) / (high - low);
        [left + width * time / end, top + height * (1.0 - up.clamp(0.0, 1.0))]
    };
    for power in low as i32..=high as i32 {
        let [x, y] = place(0.0, 10.0_f64.powi(power));
        svg.line([[x, y], [x + width, y]], "stroke=\"#ddd\"");
        svg.text([x - 6.0, y + 4.0], "end", &format!("{}", 10.0_f64.powi(power)));
    }
    for tick in 0..5 {
        let time = end * f64::from(tick) / 4.0;
        svg.text([place(time, 1.0)[0], top + height + 18.0], "middle", &format!("{:.*}", digits(end), time));
    }
    svg.text([left + 0.5 * width, top + height + 38.0], "middle", "time [s]");
    svg.upwards([left - 52.0, top + 0.5 * height], words);
    svg.line(
        values.iter().flatten().map(|(time, value)| place(*time, *value)),
        &format!("stroke=\"{colour}\" stroke-width=\"2\""),
    );
    if values.len() <= 60 {
        for [x, y] in values.iter().flatten().map(|(time, value)| place(*time, *value)) {
            svg.element(format_args!("circle cx=\"{x:.1}\" cy=\"{y:.1}\" r=\"3\" fill=\"{colour}\""));
        }
    }
}

/// Decimals of ticks along an axis of this length.
fn digits(length: f64) -> usize {
    (2.0 - length.log10().floor()).clamp(0.0, 6.0) as usize
}
