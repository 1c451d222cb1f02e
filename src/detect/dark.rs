//! Dark regions of an image, by thresholds that follow the light.
use super::gray::Gray;

/// Side of the tiles in which the darkest and the brightest pixel are found [px].
const TILE: usize = 4;

/// Least contrast around a pixel for it to be called dark or bright, as in the AprilTag detector.
const CONTRAST: u8 = 20;

/// Least pixels of a region that is worth looking at.
const LEAST: usize = 24;

/// A connected dark region: for each of its rows the first and the last pixel.
#[derive(Debug)]
pub(super) struct Region {
    /// (row, first, last), rows in order.
    pub rows: Vec<(usize, usize, usize)>,
}

/// All dark regions, connected over sides of pixels, in the order of their first pixel.
///
/// A pixel is dark where it is darker than the middle between the darkest and the brightest pixel near it: 4 to 8 px away.
pub(super) fn regions(image: &Gray) -> Vec<Region> {
    if image.width == 0 || image.height == 0 {
        return Vec::new();
    }
    let runs = runs(image);
    let mut parents: Vec<u32> = (0..runs.len() as u32).collect();
    // Runs of two rows after one another, both in order of their columns.
    let mut above = 0;
    for index in 0..runs.len() {
        let (row, first, last) = runs[index];
        while above < index && (runs[above].0 + 1 < row || (runs[above].0 + 1 == row && runs[above].2 < first)) {
            above += 1;
        }
        let mut other = above;
        while other < index && runs[other].0 + 1 == row && runs[other].1 <= last {
            join(&mut parents, other as u32, index as u32);
            other += 1;
        }
    }
    let mut place = vec![u32::MAX; runs.len()];
    let mut regions: Vec<(usize, Region)> = Vec::new();
    for (index, &(row, first, last)) in runs.iter().enumerate() {
        let root = root(&mut parents, index as u32) as usize;
        if place[root] == u32::MAX {
            place[root] = regions.len() as u32;
            regions.push((0, Region { rows: Vec::new() }));
        }
        let (pixels, region) = &mut regions[place[root] as usize];
        *pixels += last + 1 - first;
        match region.rows.last_mut() {
            Some((known, from, to)) if *known == row => (*from, *to) = ((*from).min(first), (*to).max(last)),
            _ => region.rows.push((row, first, last)),
        }
    }
    regions.into_iter().filter(|(pixels, _)| *pixels >= LEAST).map(|(_, region)| region).collect()
}

fn root(parents: &mut [u32], mut index: u32) -> u32 {
    while parents[index as usize] != index {
        parents[index as usize] = parents[parents[index as usize] as usize];
        index = parents[index as usize];
    }
    index
}

/// The earlier run is the root, so that regions are in the order of their first pixel.
fn join(parents: &mut [u32], a: u32, b: u32) {
    let (a, b) = (root(parents, a), root(parents, b));
    let (first, later) = (a.min(b), a.max(b));
    parents[later as usize] = first;
}

/// Runs of dark pixels: (row, first, last).
fn runs(image: &Gray) -> Vec<(usize, usize, usize)> {
    let (columns, limits) = limits(image);
    let mut runs = Vec::new();
    for y in 0..image.height {
        let limits = &limits[y / TILE * columns..][..columns];
        let mut start = None;
        for x in 0..=image.width {
            let is_dark = x < image.width && image.at(x, y) < limits[x / TILE];
            match (is_dark, start) {
                (true, None) => start = Some(x),
                (false, Some(first)) => {
                    runs.push((y, first, x - 1));
                    start = None;
                }
                _ => {}
            }
        }
    }
    runs
}

/// Below which brightness a pixel of each tile is dark, 0 where there is no contrast; with the number of tiles in a row.
fn limits(image: &Gray) -> (usize, Vec<u8>) {
    let (columns, rows) = (image.width.div_ceil(TILE), image.height.div_ceil(TILE));
    let mut ends = vec![(u8::MAX, 0_u8); columns * rows];
    for (y, line) in image.pixels.chunks_exact(image.width).enumerate() {
        for (tile, pixels) in ends[y / TILE * columns..].iter_mut().zip(line.chunks(TILE)) {
            for pixel in pixels {
                *tile = (tile.0.min(*pixel), tile.1.max(*pixel));
            }
        }
    }
    let limit = |index: usize| {
        let (x, y) = (index % columns, index / columns);
        let (mut darkest, mut brightest) = (u8::MAX, 0);
        for near_y in y.saturating_sub(1)..(y + 2).min(rows) {
            for near_x in x.saturating_sub(1)..(x + 2).min(columns) {
                let (low, high) = ends[near_y * columns + near_x];
                (darkest, brightest) = (darkest.min(low), brightest.max(high));
            }
        }
        let contrast = brightest.saturating_sub(darkest);
        if contrast < CONTRAST { 0 } else { darkest + contrast.div_ceil(2) }
    };
    (columns, (0..columns * rows).map(limit).collect())
}
