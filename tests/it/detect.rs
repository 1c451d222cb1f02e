//! Features in images: corners of rendered tags and boards, whose places are known, found to a fraction of a pixel and called by their names.
use handeye::detect::{Gray, Pattern};
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::io::Cursor;

/// Tags as OpenCV prints them (`generateImageMarker`): `#` is dark.
pub const TAG36H11: [(u32, [&str; 8]); 3] = [
    (0, ["########", "###.####", "##..#.##", "####.#.#", "####..##", "#.#...##", "#.#.#..#", "########"]),
    (5, ["########", "###..#.#", "##...###", "#..#.#.#", "##..#..#", "#.###..#", "###....#", "########"]),
    (300, ["########", "#.##.#.#", "#####..#", "#......#", "#..#.#.#", "####.###", "#.##.###", "########"]),
];
const DICT_4X4: [(u32, [&str; 6]); 2] = [
    (3, ["######", "#.##.#", "#.##.#", "##.###", "##..##", "######"]),
    (17, ["######", "##..##", "##..##", "######", "######", "######"]),
];
const DICT_5X5: [[&str; 7]; 6] = [
    ["#######", "#.#.###", "##.#..#", "##..###", "#.#.#.#", "#...###", "#######"],
    ["#######", "#####.#", "#..####", "#####.#", "#.#...#", "###..##", "#######"],
    ["#######", "#..#.##", "#....##", "####..#", "#.#..##", "#...#.#", "#######"],
    ["#######", "#.#####", "###...#", "###.#.#", "##....#", "#.#...#", "#######"],
    ["#######", "#..#.##", "#...#.#", "##..#.#", "##.##.#", "###.###", "#######"],
    ["#######", "#...#.#", "##.####", "####.##", "#####.#", "##..#.#", "#######"],
];

pub const SIZE: [usize; 2] = [320, 240];
pub const FOCAL: f64 = 400.0;
pub const CENTRE: [f64; 2] = [159.5, 119.5];

/// A dark cell of rows of text.
pub fn is_dark(rows: &[&str], x: f64, y: f64) -> bool {
    let cell = |place: f64, count: usize| (place * count as f64) as usize;
    let (row, column) = (cell(y, rows.len()), cell(x, rows.len()));
    (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y) && rows[row].as_bytes()[column] == b'#'
}

/// Where the plane of a print is before the camera: `camera_from_print`.
#[derive(Clone, Copy)]
pub struct View {
    pub rotation: Rotation3<f64>,
    pub origin: Vector3<f64>,
}

impl View {
    /// With the middle of a print of this size before the camera, tilted by up to 45°, turned anyhow.
    pub fn random(rng: &mut ChaCha8Rng, size: [f64; 2], depth: f64) -> View {
        let tilt = rng.random_range(0.0..std::f64::consts::FRAC_PI_4);
        let axis = rng.random_range(0.0..std::f64::consts::TAU);
        let turn = rng.random_range(0.0..std::f64::consts::TAU);
        let rotation =
            Rotation3::new(Vector3::new(axis.cos(), axis.sin(), 0.0) * tilt) * Rotation3::new(Vector3::z() * turn);
        let middle = Vector3::new(rng.random_range(-0.05..0.05), rng.random_range(-0.03..0.03), depth);
        View { rotation, origin: middle - rotation * Vector3::new(0.5 * size[0], 0.5 * size[1], 0.0) }
    }

    fn pixel(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let point = self.rotation * Vector3::new(x, y, 0.0) + self.origin;
        [0, 1].map(|axis| FOCAL * point[axis] / point.z + CENTRE[axis])
    }

    /// Renders a print: dark where `print` says, bright elsewhere, 4 x 4 samples a pixel, then blur and noise.
    pub fn render(&self, print: impl Fn(f64, f64) -> bool, blur: f64, noise: f64, rng: &mut ChaCha8Rng) -> Gray {
        let columns = [self.rotation * Vector3::x(), self.rotation * Vector3::y(), self.origin];
        let print_from_ray = Matrix3::from_columns(&columns).try_inverse().unwrap();
        let [width, height] = SIZE;
        let mut bright = vec![0.0; width * height];
        for (index, pixel) in bright.iter_mut().enumerate() {
            for sample in 0..16 {
                let u = (index % width) as f64 + (f64::from(sample % 4) + 0.5) / 4.0 - 0.5;
                let v = (index / width) as f64 + (f64::from(sample / 4) + 0.5) / 4.0 - 0.5;
                let place = print_from_ray * Vector3::new((u - CENTRE[0]) / FOCAL, (v - CENTRE[1]) / FOCAL, 1.0);
                let is_dark = print(place.x / place.z, place.y / place.z);
                *pixel += if is_dark { 40.0 } else { 200.0 } / 16.0;
            }
        }
        let reach = (3.0 * blur).ceil() as i32;
        let weights: Vec<f64> = (-reach..=reach).map(|k| (-0.5 * (f64::from(k) / blur).powi(2)).exp()).collect();
        let total: f64 = weights.iter().sum();
        for step in [[1, 0], [0, 1]] {
            let smooth = |index: usize| {
                let at = |k: i32| {
                    let x = ((index % width) as i32 + k * step[0]).clamp(0, width as i32 - 1) as usize;
                    let y = ((index / width) as i32 + k * step[1]).clamp(0, height as i32 - 1) as usize;
                    bright[y * width + x]
                };
                (-reach..=reach).zip(&weights).map(|(k, weight)| weight * at(k)).sum::<f64>() / total
            };
            bright = (0..bright.len()).map(smooth).collect();
        }
        // Sums of twelve even numbers are nearly normal.
        let mut normal = || (0..12).map(|_| rng.random_range(0.0..1.0)).sum::<f64>() - 6.0;
        let pixels = bright.iter().map(|value| (value + noise * normal()).round().clamp(0.0, 255.0) as u8).collect();
        Gray { width, height, pixels }
    }
}

pub fn png(image: &Gray) -> Vec<u8> {
    let mut bytes = Cursor::new(Vec::new());
    let buffer = image::GrayImage::from_raw(image.width as u32, image.height as u32, image.pixels.clone()).unwrap();
    buffer.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Where features are in an image, by name.
type Truth = BTreeMap<String, [f64; 2]>;

/// What was found in an image, and the truth.
type Looked = (Vec<(String, [f64; 2])>, Truth);

/// How far found corners are from where they are: sorted distances, and the mean on each axis.
struct Errors {
    sorted: Vec<f64>,
    mean: [f64; 2],
}

/// Compares what was found with the truth, which has to have every name that was found; says how many were.
fn errors(views: &[Looked]) -> Errors {
    let mut off = Vec::new();
    for (found, truth) in views {
        for (name, pixel) in found {
            let there = truth.get(name).unwrap_or_else(|| panic!("{name} was found and is not there"));
            off.push([pixel[0] - there[0], pixel[1] - there[1]]);
        }
    }
    let mut sorted: Vec<f64> = off.iter().map(|[u, v]| u.hypot(*v)).collect();
    sorted.sort_by(f64::total_cmp);
    let mean = [0, 1].map(|axis| off.iter().map(|off| off[axis]).sum::<f64>() / off.len() as f64);
    Errors { sorted, mean }
}

/// Views over blur and noise: 0.6 to 1.2 px, 1 to 5 of 255.
fn rendered<P: Fn(f64, f64) -> bool>(
    pattern: &str,
    count: u64,
    size: [f64; 2],
    depth: f64,
    print: impl Fn(u64) -> (P, Truth),
) -> Vec<Looked> {
    let pattern = Pattern::parse(pattern).unwrap();
    let view = |seed: u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let (print, places) = print(seed);
        let view = View::random(&mut rng, size, depth);
        let image =
            view.render(print, [0.6, 0.9, 1.2][seed as usize % 3], [1.0, 3.0, 5.0][seed as usize / 3 % 3], &mut rng);
        let truth = places.into_iter().map(|(name, place)| (name, view.pixel(place))).collect();
        (pattern.detect(&image), truth)
    };
    (0..count).map(view).collect()
}

/// Corners by the order in which a family counts them, of a tag from (0, 0) to (side, side) as OpenCV prints it.
fn corners(family: &str, id: u32, side: f64) -> Truth {
    let [a, b, c, d] = [[0.0, 0.0], [side, 0.0], [side, side], [0.0, side]];
    // The AprilTag library holds OpenCV's tag upside down, and counts from its lower left corner against the clock.
    let order = if family == "tag36h11" { [b, a, d, c] } else { [a, b, c, d] };
    order.into_iter().enumerate().map(|(corner, place)| (format!("{family}:{id}/{corner}"), place)).collect()
}

#[test]
fn corners_of_tags_are_found_to_a_twentieth_of_a_pixel_and_called_by_their_numbers() {
    const SIDE: f64 = 0.1;
    let april = rendered("tag36h11", 27, [SIDE; 2], 0.5, |seed| {
        let (id, rows) = TAG36H11[seed as usize % 3];
        (move |x: f64, y: f64| is_dark(&rows, x / SIDE, y / SIDE), corners("tag36h11", id, SIDE))
    });
    let aruco = rendered("DICT_4X4_50", 27, [SIDE; 2], 0.5, |seed| {
        let (id, rows) = DICT_4X4[seed as usize % 2];
        (move |x: f64, y: f64| is_dark(&rows, x / SIDE, y / SIDE), corners("DICT_4X4_50", id, SIDE))
    });
    for views in [april, aruco] {
        let missing = views.iter().filter(|(found, _)| found.len() != 4).count();
        assert_eq!(missing, 0, "{missing} of 27 tags are missing");
        let Errors { sorted, mean } = errors(&views);
        assert!(sorted[sorted.len() / 2] < 0.05 && sorted[sorted.len() - 1] < 0.35, "{sorted:?}");
        assert!(mean.iter().all(|mean| mean.abs() < 0.02), "{mean:?}");
    }
}

#[test]
fn nothing_is_found_where_there_is_no_tag() {
    let family = Pattern::parse("DICT_APRILTAG_36h11").unwrap();
    let other = Pattern::parse("tag25h9").unwrap();
    for seed in 0..20 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let view = View::random(&mut rng, [0.1; 2], 0.5);
        let cells: Vec<bool> = (0..64).map(|_| rng.random_bool(0.5)).collect();
        // Dark squares with a dark border and anything inside; tags with the colours exchanged; a tag in a mirror; a checkerboard.
        let inside = |x: f64, y: f64| (0.0..0.1).contains(&x) && (0.0..0.1).contains(&y);
        let cell = |x: f64, y: f64| (x * 80.0) as usize + 8 * (y * 80.0) as usize;
        let is_border = |x: f64, y: f64| [x, y].iter().any(|&place| !(0.0125..0.0875).contains(&place));
        let rows = TAG36H11[seed as usize % 3].1;
        let prints: [&dyn Fn(f64, f64) -> bool; 4] = [
            &|x, y| inside(x, y) && (is_border(x, y) || cells[cell(x, y)]),
            &|x, y| !is_dark(&rows, 10.0 * x, 10.0 * y),
            &|x, y| is_dark(&rows, 1.0 - 10.0 * x, 10.0 * y),
            &|x, y| ((x * 50.0).floor() + (y * 50.0).floor()) as i64 % 2 == 0,
        ];
        for (index, print) in prints.into_iter().enumerate() {
            let image = view.render(print, 0.8, 3.0, &mut rng);
            assert_eq!(family.detect(&image), [], "print {index} of seed {seed}");
        }
        let image = view.render(|x, y| is_dark(&rows, 10.0 * x, 10.0 * y), 0.8, 3.0, &mut rng);
        assert_eq!(other.detect(&image), [], "a tag of another family, seed {seed}");
        let pixels = (0..SIZE[0] * SIZE[1]).map(|_| rng.random()).collect();
        assert_eq!(family.detect(&Gray { width: SIZE[0], height: SIZE[1], pixels }), [], "noise, seed {seed}");
    }
}

#[test]
fn a_tag_that_is_there_twice_and_an_image_without_anything_have_no_corners() {
    let family = Pattern::parse("tag36h11").unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let view = View { rotation: Rotation3::identity(), origin: Vector3::new(-0.11, -0.05, 0.5) };
    let rows = TAG36H11[1].1;
    let twice = view.render(
        |x, y| is_dark(&rows, 10.0 * x, 10.0 * y) || is_dark(&rows, 10.0 * x - 1.2, 10.0 * y),
        0.8,
        1.0,
        &mut rng,
    );
    assert_eq!(family.detect(&twice), []);
    for size in [[0, 0], [1, 1], [3, 200], [200, 3]] {
        let image = Gray { width: size[0], height: size[1], pixels: vec![0; size[0] * size[1]] };
        for pattern in ["tag36h11", "checkerboard=4x3", "charuco=4x3:DICT_5X5_50:0.75"] {
            assert_eq!(Pattern::parse(pattern).unwrap().detect(&image), [], "{pattern} in {size:?}");
        }
    }
}

/// Squares of 2 cm, the one at the upper left dark.
const SQUARE: f64 = 0.02;

fn is_dark_square(x: f64, y: f64, columns: f64, rows: f64) -> bool {
    let (column, row) = ((x / SQUARE).floor(), (y / SQUARE).floor());
    (0.0..columns).contains(&column) && (0.0..rows).contains(&row) && (column + row) % 2.0 == 0.0
}

/// Inner corners of a board of so many squares.
fn inner(columns: usize, rows: usize) -> Truth {
    let places = (0..rows - 1).flat_map(|row| (0..columns - 1).map(move |column| (row, column)));
    let place =
        |(row, column)| (format!("corner:{row}/{column}"), [SQUARE * (column + 1) as f64, SQUARE * (row + 1) as f64]);
    places.map(place).collect()
}

#[test]
fn corners_of_a_checkerboard_keep_their_names_however_it_is_turned() {
    // Six inner corners by five: turned by half, its colours are exchanged.
    let size = [7.0 * SQUARE, 6.0 * SQUARE];
    let views = rendered("checkerboard=6x5", 18, size, 0.5, |_| (|x, y| is_dark_square(x, y, 7.0, 6.0), inner(7, 6)));
    let whole = views.iter().filter(|(found, _)| found.len() == 30).count();
    assert!(whole >= 17 && views.iter().all(|(found, _)| [0, 30].contains(&found.len())), "{whole} of 18");
    let Errors { sorted, mean } = errors(&views);
    assert!(sorted[sorted.len() / 2] < 0.08 && sorted[sorted.len() - 1] < 0.5, "{sorted:?}");
    assert!(mean.iter().all(|mean| mean.abs() < 0.02), "{mean:?}");
    for (pattern, is_ambiguous) in [("checkerboard=6x5", false), ("checkerboard=6x4", true), ("checkerboard=5x5", true)]
    {
        assert_eq!(Pattern::parse(pattern).unwrap().is_ambiguous(), is_ambiguous, "{pattern}");
    }
}

#[test]
fn a_checkerboard_that_looks_the_same_turned_by_half_begins_at_its_higher_end() {
    let pattern = Pattern::parse("checkerboard=6x4").unwrap();
    for seed in 0..6 {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let view = View::random(&mut rng, [7.0 * SQUARE, 5.0 * SQUARE], 0.45);
        let image = view.render(|x, y| is_dark_square(x, y, 7.0, 5.0), 0.8, 2.0, &mut rng);
        let found = pattern.detect(&image);
        assert_eq!(found.len(), 24);
        let [first, last] = [view.pixel([SQUARE; 2]), view.pixel([6.0 * SQUARE, 4.0 * SQUARE])];
        let (higher, lower) = if first[1] < last[1] { (first, last) } else { (last, first) };
        let off = |pixel: [f64; 2], there: [f64; 2]| (pixel[0] - there[0]).hypot(pixel[1] - there[1]);
        assert!(off(found[0].1, higher) < 0.5 && off(found[23].1, lower) < 0.5, "seed {seed}");
    }
}

/// A ChArUco board of 4 x 3 squares: tags 0 to 5 on its bright squares, row by row.
pub fn is_dark_charuco(x: f64, y: f64) -> bool {
    const BRIGHT: [(f64, f64); 6] = [(1.0, 0.0), (3.0, 0.0), (0.0, 1.0), (2.0, 1.0), (1.0, 2.0), (3.0, 2.0)];
    let (big_x, big_y) = (x / CHARUCO, y / CHARUCO);
    let (column, row) = (big_x.floor(), big_y.floor());
    let on_board = (0.0..4.0).contains(&column) && (0.0..3.0).contains(&row);
    let tag = BRIGHT.iter().position(|place| *place == (column, row));
    let within = |place: f64, of: f64| (place - of - 0.125) / 0.75;
    match tag {
        Some(tag) => is_dark(&DICT_5X5[tag], within(big_x, column), within(big_y, row)),
        None => on_board && (column + row) % 2.0 == 0.0,
    }
}

pub const CHARUCO: f64 = 0.045;

#[test]
fn corners_of_a_charuco_board_are_named_even_where_only_a_part_of_it_is_seen() {
    let places = || -> Truth {
        let scale = CHARUCO / SQUARE;
        inner(4, 3).into_iter().map(|(name, place)| (name, place.map(|part| part * scale))).collect()
    };
    let size = [4.0 * CHARUCO, 3.0 * CHARUCO];
    let whole = rendered("charuco=4x3:DICT_5X5_50:0.75", 18, size, 0.5, |_| (is_dark_charuco, places()));
    let found: usize = whole.iter().map(|(found, _)| found.len()).sum();
    assert!(found >= 100, "{found} of 108 corners");
    let Errors { sorted, mean } = errors(&whole);
    assert!(sorted[sorted.len() / 2] < 0.08 && sorted[sorted.len() - 1] < 0.6, "{sorted:?}");
    assert!(mean.iter().all(|mean| mean.abs() < 0.02), "{mean:?}");
    // A hand over its left half.
    let part = rendered("charuco=4x3:DICT_5X5_50:0.75", 9, size, 0.5, |_| {
        (|x, y| x > 2.0 * CHARUCO && is_dark_charuco(x, y), places())
    });
    let found: usize =
        part.iter().map(|(found, _)| found.iter().filter(|(name, _)| name.ends_with("/2")).count()).sum();
    assert!(found >= 16, "{found} of 18 corners");
}
