//! Tasks in images are rows of errors in pixels with their noise, and lead a hand there whose rig nobody knows.
use crate::image_tasks_checked::task;
use crate::malformed_input::place;
use handeye::Error;
use handeye::servo::LimitRows;
use handeye::servo::image_tasks::{CheckSettings, Geometry, ImageTask, Motion, Seen, catalog, check};
use handeye::servo::uncalibrated::{Phase, Quantity, Settings, Uncalibrated};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::{DMatrix, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// One part of every kind.
const KINDS: [(&str, &str); 8] = [
    ("point to point", "kind = 'point-to-point'; point = 'a'; to = 'A'"),
    ("point to line", "kind = 'point-to-line'; point = 'a'; line = ['A', 'B']"),
    ("line to line", "kind = 'line-to-line'; line = ['a', 'b']; to = ['A', 'B']"),
    ("parallel lines", "kind = 'parallel-lines'; line = ['a', 'b']; to = ['A', 'B']"),
    ("directed lines", "kind = 'parallel-lines'; line = ['a', 'b']; to = ['A', 'B']; directed = true"),
    ("angle of a line", "kind = 'line-angle'; line = ['a', 'b']; angle_deg = 30"),
    ("point to conic", "kind = 'point-to-conic'; point = 'a'; conic = ['C', 'D', 'E', 'F', 'G', 'H']"),
    ("point in space", "kind = 'point-to-point-3d'; point = 'a'; to = 'A'; px_per_metre = 1000"),
];
const HAND: [&str; 2] = ["a", "b"];
const TARGET: [&str; 8] = ["A", "B", "C", "D", "E", "F", "G", "H"];

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// What trackers with noise see.
fn noisy(seen: &Seen, pixels: f64, points: f64, random: &mut ChaCha8Rng) -> Seen {
    let mut seen = seen.clone();
    seen.pixels.iter_mut().flatten().flatten().for_each(|value| *value += pixels * normal(random));
    seen.points.iter_mut().flatten().flatten().for_each(|value| *value += points * normal(random));
    seen
}

#[test]
fn errors_are_the_distances_in_pixels_that_a_ruler_would_measure() {
    let see = |part: &str, pixels: &[(&str, [f64; 2])]| {
        let task = task("'left'", &HAND, &TARGET, &[part]);
        let mut seen = Seen::new(&task);
        pixels.iter().for_each(|(name, pixel)| seen.pixels[0][task.feature(name).unwrap()] = *pixel);
        task.errors(&seen).iter().map(|row| row.error).collect::<Vec<f64>>()
    };
    let close = |found: Vec<f64>, known: &[f64]| {
        assert!(found.len() == known.len() && found.iter().zip(known).all(|(a, b)| (a - b).abs() < 1e-9), "{found:?}");
    };
    let line = [("A", [100.0, 50.0]), ("B", [180.0, 110.0])];
    let pixels = |hand: &[(&'static str, [f64; 2])]| [hand, &line].concat();
    close(see(KINDS[0].1, &pixels(&[("a", [103.0, 46.0])])), &[3.0, -4.0]);
    // Five to the left and to the right of a line of slope 3 / 4.
    close(see(KINDS[1].1, &pixels(&[("a", [137.0, 84.0])])), &[5.0]);
    close(see(KINDS[2].1, &pixels(&[("a", [143.0, 76.0]), ("b", [137.0, 84.0])])), &[-5.0, 5.0]);
    // A segment of 50 px that is turned by 30 degrees, or by 210.
    for (turned, known, directed) in [(30.0_f64, 25.0, 100.0 * 15_f64.to_radians().sin()), (180.0, 0.0, 100.0)] {
        let (sine, cosine) = (0.6_f64.atan2(0.8) + turned.to_radians()).sin_cos();
        let hand = [("a", [0.0, 0.0]), ("b", [50.0 * cosine, 50.0 * sine])];
        close(see(KINDS[3].1, &pixels(&hand)), &[known]);
        let found = see(KINDS[4].1, &pixels(&hand))[0].abs();
        assert!((found - directed).abs() < 1e-6, "{turned}: {found}");
    }
    close(see(KINDS[5].1, &[("a", [0.0, 0.0]), ("b", [0.0, 40.0])]), &[40.0 * 60_f64.to_radians().sin()]);
    // A circle of 60 px: distances are exact inside and outside.
    let circle: Vec<(&str, [f64; 2])> =
        (0..6).map(|k| (TARGET[2 + k], [300.0 + 60.0 * (k as f64).cos(), 200.0 + 60.0 * (k as f64).sin()])).collect();
    for (point, known) in [([400.0, 200.0], 40.0), ([300.0, 190.0], -50.0), ([300.0, 261.0], 1.0)] {
        close(see(KINDS[6].1, &[circle.as_slice(), &[("a", point)]].concat()), &[known]);
    }
    // What is not seen, or no line, is not a number.
    assert!(see(KINDS[1].1, &line)[0].is_nan());
    assert!(see(KINDS[1].1, &[("a", [0.0, 0.0]), ("A", [1.0, 1.0]), ("B", [1.0, 1.0])])[0].is_nan());
}

// The standard deviation of 4000 normal numbers is known to 1.1 %; three times that, and as much again for what is of second order.
#[test]
fn standard_deviations_of_rows_are_those_of_many_noisy_measurements() {
    for (name, part) in KINDS {
        for seed in 0..3 {
            let task = task("'left', 'right'", &HAND, &TARGET, &[part]);
            let geometry = Geometry::drawn(&task, seed);
            let away = Pose::new(Vector3::new(0.2, -0.1, 0.15), Vector3::new(0.01, 0.02, -0.01));
            let seen = geometry.see(&task, &away);
            let rows = task.errors(&seen);
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            let trackers = task.trackers();
            let mut squares = vec![0.0; rows.len()];
            for _ in 0..4000 {
                let found = task.errors(&noisy(&seen, 0.2 * trackers.pixels, 0.2 * trackers.points, &mut random));
                let pairs = found.iter().zip(&rows);
                squares.iter_mut().zip(pairs).for_each(|(sum, (a, b))| *sum += (a.error - b.error).powi(2) / 4000.0);
            }
            for (square, row) in squares.iter().zip(&rows) {
                let ratio = square.sqrt() / (0.2 * row.sd);
                assert!((ratio - 1.0).abs() < 0.066, "{name}, seed {seed}: {ratio}");
            }
        }
    }
}

/// Coordinates that a task fixes: an orthonormal basis of motions that are across the free ones, in radians and in 0.1 m.
fn fixed_motions(free: &[Motion], centre: &Vector3<f64>) -> DMatrix<f64> {
    let column = |motion: &Motion| {
        let (turn, velocity) = (motion.turn(), motion.velocity(centre) / 0.1);
        Vector6::new(turn.x, turn.y, turn.z, velocity.x, velocity.y, velocity.z).normalize()
    };
    let columns: Vec<Vector6<f64>> = free.iter().map(column).collect();
    let gram = DMatrix::from_fn(6, 6, |i, k| columns.iter().map(|column| column[i] * column[k]).sum::<f64>());
    let eigen = gram.symmetric_eigen();
    let across: Vec<usize> = (0..6).filter(|k| eigen.eigenvalues[*k] < 1e-6).collect();
    DMatrix::from_fn(6, across.len(), |i, k| eigen.eigenvectors[(i, across[k])])
}

#[test]
fn servoing_without_a_rig_reaches_tasks_of_every_kind_through_the_motions_that_they_fix() {
    let composed = [
        ("two points", vec![KINDS[0].1, "kind = 'point-to-point'; point = 'b'; to = 'B'"]),
        ("peg in a hole", vec![KINDS[0].1, KINDS[2].1]),
    ];
    let single = KINDS.iter().map(|(name, part)| (*name, vec![*part]));
    let wrench = catalog::ALL.iter().map(|(name, text)| (*name, ImageTask::parse(text, name).unwrap()));
    let all = single.chain(composed).map(|(name, parts)| (name, task("'left', 'right'", &HAND, &TARGET, &parts)));
    for (name, task) in all.chain(wrench) {
        for seed in 0..5 {
            let geometry = Geometry::drawn(&task, seed);
            let found = check(&task, &geometry, &CheckSettings { starts: 10, ..CheckSettings::default() }).unwrap();
            let hand = |index: &usize| task.features()[*index].place.name() == "hand";
            let points: Vec<Vector3<f64>> =
                (0..task.features().len()).filter(hand).map(|index| geometry.points[index]).collect();
            let middle = points.iter().sum::<Vector3<f64>>() / points.len() as f64;
            let centre = found.placement.transform(&middle);
            let basis = fixed_motions(&found.free.motions, &centre);
            assert_eq!(basis.ncols(), found.fixed, "{name}");
            let pose = |quantities: &[f64]| {
                let motion = &basis * DMatrix::from_column_slice(quantities.len(), 1, quantities);
                let turn = so3::exp(&Vector3::new(motion[0], motion[1], motion[2]));
                let shift = 0.1 * Vector3::new(motion[3], motion[4], motion[5]);
                let rotation = turn * found.placement.rotation;
                Pose { rotation, translation: centre + shift - rotation * middle }
            };
            let mut random = ChaCha8Rng::seed_from_u64(seed);
            // Points of a ring meet the rim in many ways that leave errors: it is brought near.
            let far = if name == "ring" { 0.08 } else { 0.25 };
            let mut at: Vec<f64> = (0..found.fixed).map(|_| random.random_range(-far..far)).collect();
            let quantities = (0..at.len()).map(|i| Quantity { name: format!("q{i}"), ..Quantity::default() }).collect();
            let rows = task.signals(&geometry.see(&task, &pose(&at))).unwrap();
            let mut servo = Uncalibrated::new(quantities, rows, Settings::default()).unwrap();
            let mut limits = LimitRows::default();
            limits.clear(at.len());
            let trackers = task.trackers();
            for _ in 0..80 {
                let seen = noisy(&geometry.see(&task, &pose(&at)), trackers.pixels, trackers.points, &mut random);
                let errors: Vec<f64> = task.errors(&seen).iter().map(|row| row.error).collect();
                let motion = servo.step(&at, &errors, &limits, 1.0).unwrap().motion.to_vec();
                at.iter_mut().zip(&motion).for_each(|(at, motion)| *at += motion);
            }
            assert!(!matches!(servo.phase(), Phase::Stopped(_)), "{name}, seed {seed}: {:?}", servo.phase());
            // Within what the trackers' noise leaves.
            let left = task.errors(&geometry.see(&task, &pose(&at)));
            let worst = left.iter().map(|row| row.error.abs() / row.sd).fold(0.0, f64::max);
            assert!(worst < 4.0, "{name}, seed {seed}: {worst} standard deviations are left, {:?}", servo.phase());
        }
    }
}

#[test]
fn a_feature_on_the_image_has_no_noise_and_needs_no_tracker() {
    let text = "cameras = ['hand']\nnoise = { pixels = 0.5 }\n[[features]]\nname = 'straw'\non = 'target'\n[[features]]\n\
                name = 'gripper'\non = 'image'\npixels = { hand = [320, 240] }\n[[tasks]]\nkind = 'point-to-point'\n\
                point = 'straw'\nto = 'gripper'\n";
    let task = ImageTask::parse(text, "task").unwrap();
    let mut seen = Seen::new(&task);
    assert!(task.signals(&seen).unwrap_err().to_string().contains("camera `hand`"));
    seen.pixels[0][0] = [330.0, 235.0];
    let rows = task.errors(&seen);
    assert_eq!(rows.iter().map(|row| (row.error, row.sd)).collect::<Vec<_>>(), [(10.0, 0.5), (-5.0, 0.5)]);
}

#[test]
fn every_mistake_in_a_task_file_is_told_with_its_place_and_what_would_do() {
    let features = "[[features]]\nname = 'a'\non = 'hand'\n[[features]]\nname = 'b'\non = 'target'\n[[features]]\nname = 'c'\non = 'target'\n";
    let of = |part: &str| format!("cameras = ['left']\n{features}[[tasks]]\n{part}\n");
    for (marked, words) in [
        ("@name = 'x'\n".to_owned(), "has no `cameras`"),
        ("@cameras = ['left']\n".to_owned(), "has no [[tasks]]"),
        ("cameras = @[]\ntasks = []\n".to_owned(), "a task needs a camera"),
        ("cameras = ['left', @'left']\ntasks = []\n".to_owned(), "another camera is called `left`"),
        ("cameras = ['left']\ntasks = @[]\n".to_owned(), "something that shall meet something"),
        ("cameras = ['l']\nfeatures = [{ name = 'a', on = @'gripper' }]\n".to_owned(), "known: hand, target, image"),
        ("cameras = ['l']\nfeatures = [{ name = 'a', on = 'image', xyz = @[0, 0, 0] }]\n".to_owned(), "hand or target"),
        (
            "cameras = ['l']\nfeatures = [{ name = 'a', on = 'image', pixels = { r = @[1, 2] } }]\n".to_owned(),
            "no camera is called `r`",
        ),
        (of("kind = @'point-to-pint'"), "unknown kind `point-to-pint`"),
        (of("kind = 'point-to-point'\npoint = 'a'\nto = @'bb'"), "no feature is called `bb`"),
        (of("kind = 'point-to-point'\npoint = 'a'\nto = 'b'\nline = @['b', 'c']"), "a point-to-point takes point, to"),
        (of("kind = 'point-to-line'\npoint = 'a'\nline = @['b']"), "a line goes through 2 features, found 1"),
        (
            of("kind = 'point-to-line'\npoint = 'a'\nline = ['b', 'c']\ncameras = [@'right']"),
            "no camera is called `right`",
        ),
        (format!("cameras = ['left']\n{features}@[[tasks]]\nkind = 'point-to-point'\npoint = 'a'\n"), "needs `to`"),
        (
            format!(
                "cameras = ['left']\n{features}@[[tasks]]\nkind = 'point-to-conic'\npoint = 'a'\nconic = ['b', 'c']\n"
            ),
            "a conic of 2 points; 5 or more determine one",
        ),
        (
            format!("cameras = ['left']\n{features}@[[tasks]]\nkind = 'point-to-point'\npoint = 'a'\nto = 'a'\n"),
            "`a` is named twice",
        ),
        (
            "cameras = ['l', 'r']\nfeatures = [{ name = 'a', on = 'hand' }, { name = 'c', on = 'image', pixels = { l = [1, 2] } }]\n\
             tasks = [@{ kind = 'point-to-point', point = 'a', to = 'c' }]\n"
                .to_owned(),
            "`c` is on the image and has no pixel in that of `r`",
        ),
        (of("kind = 'point-to-point-3d'\npoint = 'a'\nto = 'b'\npx_per_metre = @0"), "must be above 0"),
        (of("kind = 'line-angle'\nline = ['a', 'b']\nangle_deg = @'up'"), "expected a number"),
    ] {
        let (text, line, column) = place(&marked);
        match ImageTask::parse(&text, "file") {
            Err(Error::Malformed { line: found_line, column: found_column, problem, .. }) => {
                assert_eq!((found_line, found_column), (line, column), "{marked}\n{problem}");
                assert!(problem.contains(words), "{marked}\n found: {problem}\nwanted: {words}");
            }
            other => panic!("{marked}\n{other:?}"),
        }
    }
}
