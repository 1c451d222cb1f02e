//! Dark quadrilaterals with corners to a fraction of a pixel.
use super::dark::{Region, regions};
use super::gray::Gray;

/// Corners clockwise as the image shows them [px].
pub(super) type Quad = [[f64; 2]; 4];

/// Shortest side of a quadrilateral [px].
const SHORTEST: f64 = 8.0;

/// Most of a hull's corners that are looked at.
const MOST: usize = 64;

/// Least part of the quadrilateral's area that the hull of a region fills, and most beyond it.
const FILL: [f64; 2] = [0.85, 1.15];

/// All dark regions that are quadrilaterals, their sides fitted to the edges between dark and bright.
pub(super) fn quads(image: &Gray) -> Vec<Quad> {
    regions(image).iter().filter_map(outline).filter_map(|quad| refine_edges(image, &quad)).collect()
}

/// The quadrilateral around a region, to a pixel.
fn outline(region: &Region) -> Option<Quad> {
    let mut hull = hull(region);
    let filled = area(&hull);
    while hull.len() > MOST {
        let corner = |index: usize| {
            let (before, after) = ((index + hull.len() - 1) % hull.len(), (index + 1) % hull.len());
            cross(hull[before], hull[index], hull[after]).abs()
        };
        let least = (0..hull.len()).min_by(|&a, &b| corner(a).total_cmp(&corner(b)))?;
        hull.remove(least);
    }
    let quad = largest(&hull)?;
    let area = area(&quad);
    let is_filled = filled >= FILL[0] * area && filled <= FILL[1] * area;
    let side = |k: usize| distance(quad[k], quad[(k + 1) % 4]);
    let is_large = (0..4).all(|k| side(k) >= SHORTEST);
    // The sine of each angle: none is nearly straight or nearly none.
    let sine = |k: usize| cross(quad[(k + 3) % 4], quad[k], quad[(k + 1) % 4]) / (side((k + 3) % 4) * side(k));
    (is_filled && is_large && (0..4).all(|k| sine(k) > 0.25)).then_some(quad)
}

/// The convex hull, clockwise as the image shows it (y down).
fn hull(region: &Region) -> Vec<[f64; 2]> {
    let ends = |&(row, first, last): &(usize, usize, usize)| [[first as f64, row as f64], [last as f64, row as f64]];
    let points: Vec<[f64; 2]> = region.rows.iter().flat_map(ends).collect();
    // By rows from the top, first pixels before last ones, and back.
    let mut hull = half(points.iter().copied());
    hull.extend(half(points.iter().rev().copied()));
    hull
}

/// One side of the hull, without its last point.
fn half(points: impl Iterator<Item = [f64; 2]>) -> Vec<[f64; 2]> {
    let mut hull: Vec<[f64; 2]> = Vec::new();
    for point in points {
        while hull.len() >= 2 && cross(hull[hull.len() - 2], hull[hull.len() - 1], point) <= 0.0 {
            hull.pop();
        }
        hull.push(point);
    }
    hull.pop();
    hull
}

/// Twice the area of a triangle, positive where it is clockwise in the image (y down).
fn cross(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> f64 {
    (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0])
}

fn area(corners: &[[f64; 2]]) -> f64 {
    let pair = |index: usize| {
        let (a, b) = (corners[index], corners[(index + 1) % corners.len()]);
        a[0] * b[1] - a[1] * b[0]
    };
    0.5 * (0..corners.len()).map(pair).sum::<f64>()
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// The largest quadrilateral of four corners of a hull: for every diagonal the farthest corners on both its sides.
fn largest(hull: &[[f64; 2]]) -> Option<Quad> {
    let n = hull.len();
    let mut best: Option<(f64, [usize; 4])> = None;
    for a in 0..n {
        for c in a + 2..n {
            let farthest = |range: &mut dyn Iterator<Item = usize>, sign: f64| {
                range.map(|b| (sign * cross(hull[a], hull[b], hull[c]), b)).max_by(|a, b| a.0.total_cmp(&b.0))
            };
            let one = farthest(&mut (a + 1..c), 1.0);
            let other = farthest(&mut (c + 1..n).chain(0..a), -1.0);
            if let (Some((near, b)), Some((far, d))) = (one, other)
                && best.is_none_or(|(size, _)| near + far > size)
            {
                best = Some((near + far, [a, b, c, d]));
            }
        }
    }
    best.map(|(_, corners)| corners.map(|corner| hull[corner]))
}

/// The quadrilateral with its sides where the brightness changes most; `None` where there are no such edges.
fn refine_edges(image: &Gray, rough: &Quad) -> Option<Quad> {
    let mut quad = *rough;
    // A region is half a pixel smaller to each side than what it is of, and its outline a pixel off here and there.
    let shortest = (0..4).map(|k| distance(quad[k], quad[(k + 1) % 4])).fold(f64::INFINITY, f64::min);
    for reach in [2.5_f64.min(0.12 * shortest + 1.0), 2.0_f64.min(0.1 * shortest + 0.5)] {
        let sides: Vec<Line> = (0..4).map(|k| edge(image, quad[k], quad[(k + 1) % 4], reach)).collect::<Option<_>>()?;
        let corner = |k: usize| meeting(&sides[(k + 3) % 4], &sides[k]);
        quad = [corner(0)?, corner(1)?, corner(2)?, corner(3)?];
    }
    let moved = (0..4).map(|k| distance(quad[k], rough[k])).fold(0.0, f64::max);
    (moved < 0.25 * shortest + 2.0).then_some(quad)
}

/// A line: a point on it, and its direction of length 1.
struct Line {
    point: [f64; 2],
    along: [f64; 2],
}

/// The line along which dark turns to bright near a side, from the dark inside out.
fn edge(image: &Gray, from: [f64; 2], to: [f64; 2], reach: f64) -> Option<Line> {
    const STEP: f64 = 0.25;
    let length = distance(from, to);
    let along = [(to[0] - from[0]) / length, (to[1] - from[1]) / length];
    // Clockwise with y down: the outside is to the left of the way.
    let outward = [along[1], -along[0]];
    // Near its ends a side is rounded by blur.
    let margin = (0.08 * length).max(1.5).min(0.25 * length);
    let count = (length.ceil() as usize).clamp(8, 128);
    let mut points: Vec<([f64; 2], f64)> = Vec::with_capacity(count);
    for index in 0..count {
        let way = margin + (length - 2.0 * margin) * index as f64 / (count - 1) as f64;
        let at = |n: f64| [0, 1].map(|axis| from[axis] + way * along[axis] + n * outward[axis]);
        let (mut sum, mut weights) = (0.0, 0.0);
        let steps = (reach / STEP) as i32;
        for step in -steps..=steps {
            let n = f64::from(step) * STEP;
            let (Some(outside), Some(inside)) = (image.sample(at(n + 0.5)), image.sample(at(n - 0.5))) else {
                continue;
            };
            let slope = outside - inside;
            if slope > 0.0 {
                sum += n * slope * slope;
                weights += slope * slope;
            }
        }
        if weights > 0.0 {
            points.push((at(sum / weights), weights));
        }
    }
    if points.len() < count / 2 {
        return None;
    }
    let mut line = fit(&points)?;
    // Where something else touches the side, points lie off the line.
    for _ in 0..2 {
        let off = |point: &([f64; 2], f64)| {
            let [x, y] = [0, 1].map(|axis| point.0[axis] - line.point[axis]);
            (x * line.along[1] - y * line.along[0]).abs()
        };
        let mut sorted: Vec<f64> = points.iter().map(off).collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let limit = (3.0 * sorted[sorted.len() / 2]).max(0.1);
        let near: Vec<_> = points.iter().filter(|point| off(point) <= limit).copied().collect();
        line = fit(&near)?;
    }
    Some(line)
}

/// The line of least weighted squares of distances.
fn fit(points: &[([f64; 2], f64)]) -> Option<Line> {
    let total: f64 = points.iter().map(|(_, weight)| weight).sum();
    let mean = [0, 1].map(|axis| points.iter().map(|(point, weight)| weight * point[axis]).sum::<f64>() / total);
    let moment = |a: usize, b: usize| {
        points.iter().map(|(point, weight)| weight * (point[a] - mean[a]) * (point[b] - mean[b])).sum::<f64>()
    };
    let angle = 0.5 * (2.0 * moment(0, 1)).atan2(moment(0, 0) - moment(1, 1));
    (points.len() >= 4 && total > 0.0).then(|| Line { point: mean, along: [angle.cos(), angle.sin()] })
}

fn meeting(a: &Line, b: &Line) -> Option<[f64; 2]> {
    let sine = a.along[0] * b.along[1] - a.along[1] * b.along[0];
    let way = ((b.point[0] - a.point[0]) * b.along[1] - (b.point[1] - a.point[1]) * b.along[0]) / sine;
    (sine.abs() > 0.1).then(|| [0, 1].map(|axis| a.point[axis] + way * a.along[axis]))
}
