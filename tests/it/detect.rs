//! Features in images: corners of rendered tags and boards, whose places are known, found to a fraction of a pixel and called by their names.
use crate::cli::Folder;
use handeye::detect::{Gray, Pattern};
use handeye::recording::{Bag, BagOptions, Recording};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use nalgebra::{Matrix3, Rotation3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::io::Cursor;

/// Tags as OpenCV prints them (`generateImageMarker`): `#` is dark.
const TAG36H11: [(u32, [&str; 8]); 3] = [
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

const SIZE: [usize; 2] = [320, 240];
const FOCAL: f64 = 400.0;
const CENTRE: [f64; 2] = [159.5, 119.5];

/// A dark cell of rows of text.
fn is_dark(rows: &[&str], x: f64, y: f64) -> bool {
    let cell = |place: f64, count: usize| (place * count as f64) as usize;
    let (row, column) = (cell(y, rows.len()), cell(x, rows.len()));
    (0.0..1.0).contains(&x) && (0.0..1.0).contains(&y) && rows[row].as_bytes()[column] == b'#'
}

/// Where the plane of a print is before the camera: `camera_from_print`.
#[derive(Clone, Copy)]
struct View {
    rotation: Rotation3<f64>,
    origin: Vector3<f64>,
}

impl View {
    /// With the middle of a print of this size before the camera, tilted by up to 45°, turned anyhow.
    fn random(rng: &mut ChaCha8Rng, size: [f64; 2], depth: f64) -> View {
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
    fn render(&self, print: impl Fn(f64, f64) -> bool, blur: f64, noise: f64, rng: &mut ChaCha8Rng) -> Gray {
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

fn png(image: &Gray) -> Vec<u8> {
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
fn is_dark_charuco(x: f64, y: f64) -> bool {
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

const CHARUCO: f64 = 0.045;

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

/// A camera on a hand that sees a board on a table: files in a folder, poses of the hand beside, and where the camera is on the hand.
fn hand_eye(folder: &Folder, count: u64) -> View {
    let hand_from_camera =
        View { rotation: Rotation3::from_euler_angles(0.02, -0.03, 0.5), origin: Vector3::new(0.03, -0.05, 0.08) };
    let world_from_board =
        View { rotation: Rotation3::from_euler_angles(3.1, 0.05, 0.3), origin: Vector3::new(0.5, 0.1, 0.02) };
    std::fs::create_dir_all(folder.path().join("shots/hand")).unwrap();
    let mut poses = "image,time,pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw".to_owned();
    for seed in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
        let view = View::random(&mut rng, [4.0 * CHARUCO, 3.0 * CHARUCO], 0.45 + 0.02 * seed as f64);
        let image = view.render(is_dark_charuco, 0.8, 2.0, &mut rng);
        let name = format!("shot-{seed}.png");
        std::fs::write(folder.path().join("shots/hand").join(&name), png(&image)).unwrap();
        // world_from_hand = world_from_board · board_from_camera · camera_from_hand, the board's frame at its first inner corner.
        let first = view.rotation * Vector3::new(CHARUCO, CHARUCO, 0.0) + view.origin;
        let (board_from_camera, at) = (view.rotation.inverse(), -(view.rotation.inverse() * first));
        let camera_from_hand = hand_from_camera.rotation.inverse();
        let camera_to_hand = -(camera_from_hand * hand_from_camera.origin);
        let rotation = world_from_board.rotation * board_from_camera * camera_from_hand;
        let origin = world_from_board.rotation * (board_from_camera * camera_to_hand + at) + world_from_board.origin;
        let quaternion = nalgebra::UnitQuaternion::from_rotation_matrix(&rotation);
        let q = quaternion.coords;
        poses += &format!(
            "\n{name},{seed},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
            origin.x, origin.y, origin.z, q.x, q.y, q.z, q.w
        );
    }
    folder.write("poses.csv", &poses);
    folder.write(
        "hand.yaml",
        &format!(
            "image_width: {}\nimage_height: {}\ncamera_name: hand\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [{FOCAL}, 0, {}, 0, {FOCAL}, {}, 0, 0, 1]\n\
            distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n",
            SIZE[0], SIZE[1], CENTRE[0], CENTRE[1]
        ),
    );
    hand_from_camera
}

#[test]
fn images_of_a_board_and_poses_of_the_hand_calibrate_the_hand_to_the_eye() {
    let folder = Folder::new("detect-hand-eye");
    let truth = hand_eye(&folder, 10);
    let (said, _) = folder.expect(
        0,
        "detect shots --pattern charuco=4x3:DICT_5X5_50:0.75 --states poses.csv --pair name --camera hand=hand.yaml --side 0.045 -o motions.jsonl",
    );
    assert!(said.contains("10 samples, 1 camera with 6 features") && said.contains("target pose"), "{said}");
    let recording = Recording::read(&folder.path().join("motions.jsonl")).unwrap();
    let targets = recording.samples.iter().filter(|sample| !sample.targets.is_empty()).count();
    assert!(targets >= 8, "{targets} of 10 targets");
    // Without the pixels it is hand-eye calibration as it stands in books.
    let mut of_targets = recording.clone();
    of_targets.samples.iter_mut().for_each(|sample| sample.pixels.clear());
    of_targets.write(&folder.path().join("targets.jsonl")).unwrap();
    folder.write("rig.toml", "[[cameras]]\nname = \"hand\"\nparent = \"tip\"\n");
    folder.expect(0, "calibrate targets.jsonl --rig rig.toml -o learned.toml");
    let learned = handeye::rig::Rig::read(&folder.path().join("learned.toml")).unwrap();
    let pose = learned.cameras[0].pose.unwrap();
    let off = (pose.translation - truth.origin).norm();
    let turned = Rotation3::from_matrix_unchecked(pose.rotation).angle_to(&truth.rotation);
    assert!(off < 2e-3 && turned < 5e-3, "{off} m and {turned} rad from the truth");
}

#[test]
fn compressed_images_in_a_bag_show_what_the_same_files_show() {
    let folder = Folder::new("detect-bag");
    hand_eye(&folder, 3);
    let pattern = "charuco=4x3:DICT_5X5_50:0.75";
    folder.expect(0, &format!("detect hand=shots/hand --pattern {pattern} -o files.jsonl"));
    let files = Recording::read(&folder.path().join("files.jsonl")).unwrap();
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    let text = "std_msgs/Header header\nstring format\nuint8[] data\n\
        ================================================================================\n\
        MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
        ================================================================================\n\
        MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let schema = writer.add_schema("sensor_msgs/msg/CompressedImage", "ros2msg", text.as_bytes()).unwrap();
    let channel_id = writer.add_channel(schema, "/hand/image_raw/compressed", "cdr", &BTreeMap::new()).unwrap();
    for index in 0..4_u32 {
        // The last one is no image.
        let path = folder.path().join(format!("shots/hand/shot-{index}.png"));
        let data = std::fs::read(path).unwrap_or_else(|_| b"no image".to_vec());
        let mut bytes = vec![0, 1, 0, 0];
        [1 + index, 0, 1].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        // An empty frame, its end and padding; then "png" and its end.
        bytes.extend([0; 4]);
        bytes.extend(4_u32.to_le_bytes());
        bytes.extend(b"png\0");
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(&data);
        let header = MessageHeader { channel_id, sequence: index, log_time: u64::from(index), publish_time: 0 };
        writer.write_to_known_channel(&header, &bytes).unwrap();
    }
    writer.finish().unwrap();
    std::fs::write(folder.path().join("bag.mcap"), writer.into_inner().into_inner()).unwrap();
    let (said, _) = folder.expect(0, &format!("detect bag.mcap --pattern {pattern} -o bag.jsonl"));
    assert!(said.contains("1 images are left out, the first of which is neither PNG nor JPEG"), "{said}");
    let bag = Recording::read(&folder.path().join("bag.jsonl")).unwrap();
    assert_eq!((&bag.features, bag.cameras[0].name.as_str()), (&files.features, "hand"));
    assert_eq!(bag.cameras[0].size, Some([SIZE[0] as u32, SIZE[1] as u32]));
    let pixels =
        |recording: &Recording| -> Vec<_> { recording.samples.iter().map(|sample| sample.pixels.clone()).collect() };
    assert_eq!(pixels(&bag), pixels(&files));
    let times: Vec<_> = bag.samples.iter().map(|sample| sample.time).collect();
    assert_eq!(times, [Some(1.0), Some(2.0), Some(3.0)]);
    let seen: Vec<usize> = bag.samples.iter().map(|sample| sample.pixels.len()).collect();
    assert!(seen.iter().all(|seen| *seen >= 4), "{seen:?} of 6 corners");
    // Without a pattern there is nothing in it.
    let error = Bag::read(&folder.path().join("bag.mcap"), &BagOptions::default()).unwrap_err().to_string();
    assert!(error.contains("has no image with features") && error.contains("/hand/image_raw/compressed"), "{error}");
}

#[test]
fn images_pair_with_rows_by_order_or_time_and_mistakes_are_named() {
    let folder = Folder::new("detect-pairs");
    let blank = Gray { width: SIZE[0], height: SIZE[1], pixels: vec![128; SIZE[0] * SIZE[1]] };
    let rows = TAG36H11[0].1;
    for camera in ["left", "right"] {
        std::fs::create_dir_all(folder.path().join("shots").join(camera)).unwrap();
        for (index, name) in ["10.0", "10.5", "11.0"].into_iter().enumerate() {
            let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
            let view = View::random(&mut rng, [0.1; 2], 0.5);
            let image = view.render(|x, y| is_dark(&rows, 10.0 * x, 10.0 * y), 0.8, 2.0, &mut rng);
            // The left camera is blind in the middle.
            let image = if camera == "left" && index == 1 { &blank } else { &image };
            std::fs::write(folder.path().join(format!("shots/{camera}/{name}.png")), png(image)).unwrap();
        }
    }
    folder.write("rows.csv", "time,joints.a,joint_action.a\n9.75,1,0.5\n10.25,2,0.5\n11.25,4,0.5\n");
    folder.expect(0, "detect shots --pattern tag36h11 --states rows.csv -o order.jsonl");
    let order = Recording::read(&folder.path().join("order.jsonl")).unwrap();
    let joints = |recording: &Recording| -> Vec<f64> {
        recording.samples.iter().map(|sample| sample.joints.as_ref().unwrap()[0]).collect()
    };
    assert_eq!((joints(&order), order.joints.clone()), (vec![1.0, 2.0, 4.0], vec!["a".to_owned()]));
    assert_eq!(order.samples.iter().map(|sample| sample.pixels.len()).collect::<Vec<_>>(), [8, 4, 8]);
    assert!(order.samples[0].joint_action.is_some() && order.samples[2].joint_action.is_none());
    assert_eq!(order.cameras.iter().map(|camera| camera.size).collect::<Vec<_>>(), [Some([320, 240]); 2]);
    folder.expect(0, "detect shots --pattern tag36h11 --states rows.csv --pair time -o time.jsonl");
    let time = Recording::read(&folder.path().join("time.jsonl")).unwrap();
    assert!(joints(&time).iter().zip([1.5, 2.5, 3.5]).all(|(a, b)| (a - b).abs() < 1e-6), "{:?}", joints(&time));

    let fails = |arguments: &str, reasons: &[&str]| {
        let (_, error) = folder.expect(2, &format!("detect {arguments} -o out.jsonl"));
        assert!(reasons.iter().all(|reason| error.contains(reason)), "{arguments}: {error}");
    };
    fails("shots --pattern tag36h12", &["unknown family of tags `tag36h12`", "did you mean `tag36h1"]);
    fails("shots --pattern checkerboard=9", &["checkerboard=COLUMNSxROWS"]);
    fails("shots --pattern charuco=20x20:DICT_4X4_50:0.7", &["needs 200 tags, and DICT_4X4_50 has 50"]);
    fails("nowhere --pattern tag36h11", &["nowhere"]);
    fails("left=shots --pattern tag36h11", &["shots: has no images"]);
    fails("shots --pattern tag36h11 --states rows.csv --pair name", &["rows.csv", "a column `image`"]);
    fails("shots --pattern tag36h11 --camera top=1x1", &["--camera: there are no images of a camera `top`"]);
    folder.write("two.csv", "time,joints.a\n1,1\n2,2\n");
    fails("shots --pattern tag36h11 --states two.csv", &["two.csv: there are 3 images of each camera and 2 rows"]);
    fails(
        "shots --pattern tag36h11 --states two.csv --pair time",
        &[
            "two.csv: no image was taken while the robot was recorded, from 1 s to 2 s",
            "the nearest, `10.0` of 10 s, is 8 s off",
        ],
    );
    folder.write("ends.csv", "time,joints.a\n9,1\n10.25,2\n");
    let (said, _) = folder.expect(0, "detect shots --pattern tag36h11 --states ends.csv --pair time -o ends.jsonl");
    assert!(
        said.contains("2 of 3 samples are outside of the time that the robot was recorded, image `11.0` by 0.75 s"),
        "{said}"
    );
    assert!(said.contains("up to 1.250000 s apart (image `10.0`)"), "{said}");
    folder.write("back.csv", "time,joints.a\n9,1\n12,2\n11,2\n");
    fails(
        "shots --pattern tag36h11 --states back.csv --pair time",
        &["back.csv:4:1: time goes back, from 12 s to 11 s"],
    );
    let (_, error) = folder.expect(1, "detect shots --pattern tag25h9 -o out.jsonl");
    assert!(error.contains("no image shows tag25h9"), "{error}");
    std::fs::copy(folder.path().join("shots/left/10.0.png"), folder.path().join("shots/left/10.0.jpg")).unwrap();
    fails(
        "shots --pattern tag36h11",
        &["10.0.jpg and shots/left/10.0.png: camera `left` has two images called `10.0`"],
    );
    std::fs::remove_file(folder.path().join("shots/left/10.0.jpg")).unwrap();
    folder.write("shots/left/12.0.png", "no image");
    fails("shots --pattern tag36h11", &["12.0.png: is neither PNG nor JPEG"]);
}

#[test]
fn images_that_are_numbers_are_in_the_order_of_the_numbers() {
    let folder = Folder::new("detect-numbers");
    let rows = TAG36H11[0].1;
    std::fs::create_dir_all(folder.path().join("left")).unwrap();
    // As text 100 comes before 99, and as people count names 9.5 before 9.25.
    for (index, name) in ["9.25", "9.5", "99", "100"].into_iter().enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
        let image =
            View::random(&mut rng, [0.1; 2], 0.5).render(|x, y| is_dark(&rows, 10.0 * x, 10.0 * y), 0.8, 2.0, &mut rng);
        std::fs::write(folder.path().join(format!("left/{name}.png")), png(&image)).unwrap();
    }
    folder.write("rows.csv", "time,image,joints.a\n9.25,9.25.png,1\n9.5,9.5.png,2\n99,99.png,3\n100,100.png,4\n");
    let joints = |how: &str| -> Vec<(f64, [f64; 2])> {
        folder.expect(0, &format!("detect left --pattern tag36h11 --states rows.csv --pair {how} -o out.jsonl"));
        let recording = Recording::read(&folder.path().join("out.jsonl")).unwrap();
        recording.samples.iter().map(|sample| (sample.joints.as_ref().unwrap()[0], sample.pixels[0].pixel)).collect()
    };
    let order = joints("order");
    assert_eq!(order.iter().map(|(joint, _)| *joint).collect::<Vec<_>>(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!((&order, &order), (&joints("name"), &joints("time")));
}

#[test]
fn a_size_for_a_camera_leaves_what_is_known_of_its_images() {
    let folder = Folder::new("detect-camera");
    hand_eye(&folder, 1);
    let pattern = "charuco=4x3:DICT_5X5_50:0.75";
    let size = format!("hand={}x{}", SIZE[0], SIZE[1]);
    folder.expect(0, &format!("detect shots --pattern {pattern} --camera hand=hand.yaml --camera {size} -o out.jsonl"));
    let camera = &Recording::read(&folder.path().join("out.jsonl")).unwrap().cameras[0];
    assert_eq!((camera.size, camera.fx), (Some([SIZE[0] as u32, SIZE[1] as u32]), Some(FOCAL)));
    let (_, error) = folder.expect(2, &format!("detect shots --pattern {pattern} --camera hand=8x6 -o out.jsonl"));
    assert!(error.contains("said to be of 8 x 6 px, and its images are of 320 x 240 px"), "{error}");
}
