//! Square tags: AprilTags and the dictionaries of ArUco.
use super::Seen;
use super::gray::Gray;
use super::homography::Homography;
use super::quads::{Quad, quads};
use calib_targets_aruco::{Matcher, builtins};
use nalgebra::{Matrix3, Vector3};

/// Families of tags: what they are called here and in OpenCV, and `max_hamming`, how many wrong bits are put right.
///
/// Names of AprilTags are those of their detector's messages, and so is the order of their corners. Few bits are put right where codes
/// are near to one another: of ArUco's only as many as a quarter of what tells two of its codes apart.
const FAMILIES: &[(&str, &str, u8)] = &[
    ("tag36h11", "DICT_APRILTAG_36h11", 2),
    ("tag36h10", "DICT_APRILTAG_36h10", 1),
    ("tag25h9", "DICT_APRILTAG_25h9", 1),
    ("tag16h5", "DICT_APRILTAG_16h5", 0),
    ("DICT_4X4_50", "DICT_4X4_50", 0),
    ("DICT_4X4_100", "DICT_4X4_100", 0),
    ("DICT_4X4_250", "DICT_4X4_250", 0),
    ("DICT_4X4_1000", "DICT_4X4_1000", 0),
    ("DICT_5X5_50", "DICT_5X5_50", 1),
    ("DICT_5X5_100", "DICT_5X5_100", 1),
    ("DICT_5X5_250", "DICT_5X5_250", 1),
    ("DICT_5X5_1000", "DICT_5X5_1000", 1),
    ("DICT_6X6_50", "DICT_6X6_50", 2),
    ("DICT_6X6_100", "DICT_6X6_100", 2),
    ("DICT_6X6_250", "DICT_6X6_250", 2),
    ("DICT_6X6_1000", "DICT_6X6_1000", 2),
    ("DICT_7X7_50", "DICT_7X7_50", 2),
    ("DICT_7X7_100", "DICT_7X7_100", 2),
    ("DICT_7X7_250", "DICT_7X7_250", 2),
    ("DICT_7X7_1000", "DICT_7X7_1000", 2),
    ("DICT_ARUCO_ORIGINAL", "DICT_ARUCO_ORIGINAL", 0),
];

/// Most of a tag's border that may be bright.
const WRONG_BORDER: f64 = 0.1;

/// Least that what is around a tag is brighter than its border.
const CONTRAST: f64 = 15.0;

/// How much of what a cell differs from its neighbours is added to it, as in the AprilTag detector.
const SHARPENING: f64 = 0.25;

/// A family of tags.
#[derive(Clone, Debug)]
pub struct Family {
    name: &'static str,
    matcher: Matcher,
}

impl Family {
    /// Names of all families.
    pub fn names() -> impl Iterator<Item = &'static str> {
        FAMILIES.iter().map(|(name, _, _)| *name)
    }

    /// The family of a name, its own or OpenCV's, in any case.
    pub fn of(name: &str) -> Option<Family> {
        let (name, dictionary, max_hamming) = FAMILIES
            .iter()
            .find(|(own, theirs, _)| own.eq_ignore_ascii_case(name) || theirs.eq_ignore_ascii_case(name))?;
        Some(Family { name, matcher: Matcher::new(builtins::builtin_dictionary(dictionary)?, *max_hamming) })
    }

    /// Its name.
    pub fn name(&self) -> &'static str {
        self.name
    }

    /// How many tags it has.
    pub(super) fn len(&self) -> usize {
        self.matcher.dictionary().codes().len()
    }

    /// The corners of all tags of the family, called `FAMILY:ID/CORNER`: of AprilTags from the one at the lower left against the clock, as
    /// their detector counts, of others from the one at the upper left with the clock, as OpenCV does.
    pub(super) fn detect(&self, image: &Gray) -> Vec<Seen> {
        let corners = self
            .tags(image)
            .into_iter()
            .flat_map(|(id, quad)| [0, 1, 2, 3].map(|k| (format!("{}:{id}/{k}", self.name), quad[self.clockwise(k)])));
        corners.collect()
    }

    /// The place of a corner, below 4, where all are counted from the upper left one with the clock as OpenCV prints the tag: an AprilTag, which
    /// its own detector counts from the lower left against the clock, upside down.
    fn clockwise(&self, corner: usize) -> usize {
        if self.is_april() { [1, 0, 3, 2][corner] } else { corner }
    }

    /// Where a corner, below 4, is from the tag's centre [sides], x right and y down as the tag is printed: of an AprilTag by its own library.
    pub(super) fn place(&self, corner: usize) -> [f64; 2] {
        let places = [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]];
        places[if self.is_april() { 3 - corner } else { corner }]
    }

    fn is_april(&self) -> bool {
        self.name.starts_with("tag")
    }

    /// All tags by their numbers, with their corners clockwise from the upper left one as OpenCV prints them. A tag that is seen twice is left
    /// out: which is meant is not known.
    pub(super) fn tags(&self, image: &Gray) -> Vec<(u32, Quad)> {
        let mut tags: Vec<(u32, Quad)> = quads(image).iter().filter_map(|quad| self.read(image, quad)).collect();
        tags.sort_by_key(|(id, _)| *id);
        tags.chunk_by(|a, b| a.0 == b.0).filter(|same| same.len() == 1).flatten().copied().collect()
    }

    /// The number of the tag in a quadrilateral, and its corners in their order.
    fn read(&self, image: &Gray, quad: &Quad) -> Option<(u32, Quad)> {
        let bits = self.matcher.dictionary().marker_size();
        let found = self.matcher.match_code(code(image, quad, bits)?)?;
        // How often the tag is turned, as the image shows it.
        let turned = usize::from(found.rotation);
        Some((found.id, [0, 1, 2, 3].map(|k| quad[(turned + k) % 4])))
    }
}

/// The bits inside of a dark border, row by row from the lowest bit on, dark ones 1; `None` where there is no dark border, or nothing bright
/// around it.
fn code(image: &Gray, quad: &Quad, bits: usize) -> Option<u64> {
    let homography = Homography::new(quad)?;
    let cells = bits + 2;
    let at = |column: f64, row: f64| {
        let part = |place: f64| place / cells as f64;
        let near = [[-0.15, -0.15], [0.15, -0.15], [-0.15, 0.15], [0.15, 0.15]];
        let samples = near.map(|[x, y]| image.sample(homography.at([part(column + x), part(row + y)])));
        samples.into_iter().sum::<Option<f64>>().map(|sum| sum / 4.0)
    };
    // The light on dark and on bright, which may change over the tag: planes through the border and through what is around it.
    let last = cells as f64 - 0.5;
    let ring = |from: f64, to: f64| {
        let way = (0..=cells).map(move |k| from + (to - from) * k as f64 / cells as f64);
        way.flat_map(move |k| [[k, from], [k, to], [from, k], [to, k]])
    };
    let light = |places: &mut dyn Iterator<Item = [f64; 2]>| {
        Plane::through(places.filter_map(|[column, row]| Some(([column, row], at(column, row)?))))
    };
    let dark = light(&mut ring(0.5, last))?;
    let bright = light(&mut ring(-0.5, last + 1.0))?;
    let middle = |column: f64, row: f64| 0.5 * (dark.at([column, row]) + bright.at([column, row]));
    let centre = 0.5 * cells as f64;
    if bright.at([centre; 2]) - dark.at([centre; 2]) < CONTRAST {
        return None;
    }
    let place = |k: usize| k as f64 + 0.5;
    let mut off = vec![0.0; cells * cells];
    for row in 0..cells {
        for column in 0..cells {
            let (x, y) = (place(column), place(row));
            off[row * cells + column] = at(x, y)? - middle(x, y);
        }
    }
    let is_border = |index: usize| [index / cells, index % cells].iter().any(|&k| k == 0 || k + 1 == cells);
    let borders = (0..cells * cells).filter(|index| is_border(*index));
    let wrong = borders.clone().filter(|index| off[*index] > 0.0).count();
    if wrong as f64 > WRONG_BORDER * borders.count() as f64 {
        return None;
    }
    let mut code = 0;
    for (index, place) in (0..cells * cells).filter(|index| !is_border(*index)).enumerate() {
        // Blur takes from a cell what it gives to its neighbours.
        let beside = off[place - 1] + off[place + 1] + off[place - cells] + off[place + cells];
        if off[place] + SHARPENING * (4.0 * off[place] - beside) < 0.0 {
            code |= 1 << index;
        }
    }
    Some(code)
}

/// A plane over cells: brightness = a + b column + c row.
struct Plane(Vector3<f64>);

impl Plane {
    fn through(points: impl Iterator<Item = ([f64; 2], f64)>) -> Option<Plane> {
        let (mut matrix, mut side) = (Matrix3::zeros(), Vector3::zeros());
        for ([column, row], brightness) in points {
            let terms = Vector3::new(1.0, column, row);
            matrix += terms * terms.transpose();
            side += terms * brightness;
        }
        Some(Plane(matrix.try_inverse()? * side))
    }

    fn at(&self, [column, row]: [f64; 2]) -> f64 {
        self.0.dot(&Vector3::new(1.0, column, row))
    }
}
