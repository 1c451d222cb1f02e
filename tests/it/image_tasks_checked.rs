//! What a task in images fixes and leaves open is found before anything moves.
use crate::cli::Folder;
use handeye::geometry::poses_from_rays;
use handeye::rig::{Model, catalog};
use handeye::servo::image_tasks::{CheckSettings, Geometry, ImageTask, Motion, Place, TaskCheck, check};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::{DMatrix, DVector, Vector3, Vector6};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// A task in TOML: its cameras, features of the hand and of the target by name, and parts.
pub fn task(cameras: &str, hand: &[&str], target: &[&str], parts: &[&str]) -> ImageTask {
    let feature = |place: &str, name: &str| format!("{{ name = '{name}', on = '{place}' }},\n");
    let features: String = hand.iter().map(|name| feature("hand", name)).collect();
    let features = features + &target.iter().map(|name| feature("target", name)).collect::<String>();
    let parts: String = parts.iter().map(|part| format!("[[tasks]]\n{}\n", part.replace("; ", "\n"))).collect();
    ImageTask::parse(&format!("cameras = [{cameras}]\nfeatures = [{features}]\n{parts}"), "task").unwrap()
}

const TWO: &str = "'left', 'right'";
const POINT: &str = "kind = 'point-to-point'; point = 'a'; to = 'A'";
const POINT_B: &str = "kind = 'point-to-point'; point = 'b'; to = 'B'";
const POINT_C: &str = "kind = 'point-to-point'; point = 'c'; to = 'C'";
const LINE: &str = "kind = 'line-to-line'; line = ['a', 'b']; to = ['A', 'B']";
const PARALLEL: &str = "kind = 'parallel-lines'; line = ['a', 'b']; to = ['A', 'B']";
const CONIC: &str = "kind = 'point-to-conic'; point = 'a'; conic = ['A', 'B', 'C', 'D', 'E', 'F']";
const WRENCH: [&str; 4] = [
    "kind = 'point-to-point'; point = 'b'; to = 'B'",
    "kind = 'point-to-point'; point = 'd'; to = 'D'",
    "kind = 'point-to-line'; point = 'a'; line = ['A', 'B']",
    "kind = 'point-to-line'; point = 'c'; line = ['C', 'D']",
];

/// A free motion that is known.
#[derive(Clone, Copy)]
enum Known {
    /// Any rotation about a feature.
    About(&'static str),
    /// Rotation about the line through two features.
    Around(&'static str, &'static str),
    /// Translation along it.
    Along(&'static str, &'static str),
    /// Rotation about the axis of the circle that the features of the target are on.
    Spin,
}

/// A composed task and what is known of it.
struct Case {
    name: &'static str,
    task: ImageTask,
    fixed: usize,
    /// All free motions, or some of them where they are fewer than are free.
    free: &'static [Known],
    /// Angles of all alternatives; `None` where they are not known.
    alternatives: Option<&'static [f64]>,
}

fn cases() -> Vec<Case> {
    use Known::{About, Along, Around, Spin};
    let (ends, target) = (["a", "b"].as_slice(), ["A", "B"].as_slice());
    let rim = ["A", "B", "C", "D", "E", "F"].as_slice();
    let directed = format!("{PARALLEL}; directed = true");
    let ring: Vec<String> =
        ["a", "b", "c", "d", "e"].iter().map(|point| CONIC.replace("'a'", &format!("'{point}'"))).collect();
    let ring: Vec<&str> = ring.iter().map(String::as_str).collect();
    let wrench =
        |more: &[&str]| task(TWO, &["a", "b", "c", "d"], &["A", "B", "C", "D"], &[WRENCH.as_slice(), more].concat());
    let case = |name, task, fixed, free, alternatives| Case { name, task, fixed, free, alternatives };
    let on_line = "kind = 'point-to-line'; point = 'a'; line = ['A', 'B']";
    let in_space = "kind = 'point-to-point-3d'; point = 'a'; to = 'A'; px_per_metre = 1000";
    let upright = "kind = 'line-angle'; line = ['a', 'b']; angle_deg = 90";
    vec![
        case("point to point", task(TWO, &["a"], &["A"], &[POINT]), 3, &[About("a")], Some(&[])),
        case("two points", task(TWO, ends, target, &[POINT, POINT_B]), 5, &[Around("a", "b")], Some(&[])),
        case(
            "three points",
            task(TWO, &["a", "b", "c"], &["A", "B", "C"], &[POINT, POINT_B, POINT_C]),
            6,
            &[],
            Some(&[]),
        ),
        case("point to line", task(TWO, &["a"], target, &[on_line]), 2, &[About("a"), Along("A", "B")], Some(&[])),
        case("line to line", task(TWO, ends, target, &[LINE]), 4, &[Around("A", "B"), Along("A", "B")], Some(&[PI])),
        case("peg in hole", task(TWO, ends, target, &[POINT, LINE]), 5, &[Around("A", "B")], Some(&[PI])),
        case("parallel lines", task(TWO, ends, target, &[PARALLEL]), 2, &[Around("a", "b"), Along("a", "b")], None),
        case("point and parallel", task(TWO, ends, target, &[POINT, PARALLEL]), 5, &[Around("a", "b")], Some(&[PI])),
        case("point and directed", task(TWO, ends, target, &[POINT, &directed]), 5, &[Around("a", "b")], Some(&[])),
        case("angle of a line", task("'left'", ends, &[], &[upright]), 1, &[Around("a", "b"), Along("a", "b")], None),
        case("point to conic", task(TWO, &["a"], rim, &[CONIC]), 2, &[About("a")], None),
        case("ring on a rim", task(TWO, &["a", "b", "c", "d", "e"], rim, &ring), 5, &[Spin], Some(&[PI])),
        case("3D point", task("'left'", &["a"], &["A"], &[in_space]), 3, &[About("a")], Some(&[])),
        case("wrench", wrench(&[]), 6, &[], Some(&[PI])),
        case("wrench, directed", wrench(&[&directed]), 6, &[], Some(&[])),
    ]
}

/// In general position; but a ring is as large as its rim, and bolts and wrenches have right angles.
fn geometry(case: &Case, seed: u64) -> Geometry {
    let mut geometry = Geometry::drawn(&case.task, seed);
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut place = |name: &str, point: Vector3<f64>| geometry.points[case.task.feature(name).unwrap()] = point;
    if case.name.starts_with("wrench") {
        let turn = so3::exp(&Vector3::from_fn(|_, _| random.random_range(-1.0..1.0)));
        let [wide, long, jaw] = [0.02..0.05, 0.05..0.1, 0.01..0.04].map(|range| random.random_range(range));
        for (name, x, y) in [("A", 0.0, wide), ("B", long, wide), ("C", 0.0, -wide), ("D", long, -wide)] {
            place(name, turn * Vector3::new(x, y, 0.0));
        }
        for (name, x, y) in [("a", long - jaw, wide), ("b", long, wide), ("c", long - jaw, -wide), ("d", long, -wide)] {
            place(name, turn * Vector3::new(x, y, 0.0));
        }
    }
    if case.name.starts_with("ring") {
        let turn = so3::exp(&Vector3::from_fn(|_, _| random.random_range(-1.0..1.0)));
        let on_circle = |angle: f64| turn * Vector3::new(0.05 * angle.cos(), 0.05 * angle.sin(), 0.0);
        for (index, name) in ["A", "B", "C", "D", "E", "F"].iter().enumerate() {
            place(name, on_circle(TAU / 6.0 * index as f64));
        }
        for (index, name) in ["a", "b", "c", "d", "e"].iter().enumerate() {
            place(name, on_circle(TAU / 5.0 * (index as f64 + random.random_range(-0.3..0.3))));
        }
    }
    geometry
}

/// Angular velocity, and the velocity of the world's origin in units of 0.1 m.
fn coordinates(motion: &Motion) -> Vector6<f64> {
    let (turn, velocity) = (motion.turn(), motion.velocity(&Vector3::zeros()) / 0.1);
    let all = Vector6::new(turn.x, turn.y, turn.z, velocity.x, velocity.y, velocity.z);
    if turn == Vector3::zeros() { all * 0.1 } else { all }
}

fn expected(case: &Case, geometry: &Geometry, placement: &Pose) -> Vec<Motion> {
    let at = |name: &str| {
        let index = case.task.feature(name).unwrap();
        let is_on_hand = matches!(case.task.features()[index].place, Place::Hand(_));
        if is_on_hand { placement.transform(&geometry.points[index]) } else { geometry.points[index] }
    };
    let axis = |from: &str, to: &str| (at(to) - at(from)).normalize();
    let motions = case.free.iter().flat_map(|known| match *known {
        Known::About(name) => {
            (0..3).map(|i| Motion::Rotation { point: at(name), direction: Vector3::ith(i, 1.0) }).collect()
        }
        Known::Around(from, to) => vec![Motion::Rotation { point: at(from), direction: axis(from, to) }],
        Known::Along(from, to) => vec![Motion::Translation { direction: axis(from, to) }],
        Known::Spin => {
            let direction = (at("B") - at("A")).cross(&(at("C") - at("A"))).normalize();
            vec![Motion::Rotation { point: 0.5 * (at("A") + at("D")), direction }]
        }
    });
    motions.collect()
}

/// What is left of the first motions, of unit length, that is no sum of the others.
fn outside(motions: &[Motion], span: &[Motion]) -> f64 {
    // Gram and Schmidt, twice.
    let mut basis: Vec<Vector6<f64>> = Vec::new();
    let across = |basis: &[Vector6<f64>], motion: Vector6<f64>| {
        (0..2).fold(motion, |rest, _| basis.iter().fold(rest, |rest, known| rest - known * known.dot(&rest)))
    };
    for motion in span {
        let rest = across(&basis, coordinates(motion).normalize());
        assert!(rest.norm() > 1e-6, "{span:?} are not independent");
        basis.push(rest.normalize());
    }
    let rest = |motion: &Motion| across(&basis, coordinates(motion).normalize()).norm();
    motions.iter().map(rest).fold(0.0, f64::max)
}

/// Errors after a motion of the hand by a small amount, in the world.
fn errors_after(task: &ImageTask, geometry: &Geometry, found: &TaskCheck, motion: &Motion, by: f64) -> DVector<f64> {
    let origin = found.placement.translation;
    let pose = Pose {
        rotation: so3::exp(&(motion.turn() * by)) * found.placement.rotation,
        translation: origin + by * motion.velocity(&origin),
    };
    DVector::from_iterator(task.rows(), task.errors(&geometry.see(task, &pose)).iter().map(|row| row.error))
}

/// Their slopes by that motion, from differences of what is seen.
fn slopes(task: &ImageTask, geometry: &Geometry, found: &TaskCheck, motion: &Motion) -> DVector<f64> {
    let at = |by: f64| errors_after(task, geometry, found, motion, by);
    (at(1e-5) - at(-1e-5)) / 2e-5
}

#[test]
fn rank_free_motions_and_ambiguities_of_composed_tasks_are_those_known_of_them() {
    for case in cases() {
        let mut wrong = Vec::new();
        for seed in 0..20 {
            let geometry = geometry(&case, seed);
            let found = check(&case.task, &geometry, &CheckSettings { seed, ..CheckSettings::default() }).unwrap();
            let expected = expected(&case, &geometry, &found.placement);
            let free = &found.free.motions;
            let is_all = expected.len() == 6 - case.fixed;
            let mut is_right = found.fixed == case.fixed && free.len() == 6 - case.fixed;
            is_right &= outside(&expected, free) < 1e-3 && (!is_all || outside(free, &expected) < 1e-3);
            let angles: Vec<f64> = found.alternatives.iter().map(|other| other.displacement.angle).collect();
            is_right &= case.alternatives.is_none_or(|known| {
                known.len() == angles.len() && known.iter().zip(&angles).all(|(a, b)| (a - b).abs() < 0.02)
            });
            for other in &found.alternatives {
                let rows = case.task.errors(&geometry.see(&case.task, &other.placement));
                is_right &= rows.iter().all(|row| row.error.abs() < 1e-3);
            }
            if !is_right {
                let outside = [outside(&expected, free), outside(free, &expected)];
                wrong.push(format!(
                    "seed {seed}: fixed {}, {:?} off by {outside:?}, {angles:?}",
                    found.fixed, found.free.words
                ));
            }
        }
        assert!(wrong.is_empty(), "{}: {} of 20\n{}", case.name, wrong.len(), wrong.join("\n"));
    }
}

#[test]
fn ranks_and_slopes_agree_with_differences_of_what_is_seen() {
    for case in cases() {
        for seed in 20..25 {
            let geometry = geometry(&case, seed);
            let found = check(&case.task, &geometry, &CheckSettings::default()).unwrap();
            let by = |motion: &Motion| slopes(&case.task, &geometry, &found, motion);
            let axis = |i: usize| Vector3::ith(i % 3, 1.0);
            let all = (0..6).map(|i| match i {
                0..3 => by(&Motion::Translation { direction: axis(i) }) * 0.1,
                _ => by(&Motion::Rotation { point: found.placement.translation, direction: axis(i) }),
            });
            let values = DMatrix::from_columns(&all.collect::<Vec<_>>()).singular_values();
            let rank = values.iter().filter(|value| **value > 1e-4 * values.max()).count();
            assert_eq!(rank, found.fixed, "{}, seed {seed}: {values}", case.name);
            for motion in &found.free.motions {
                let scale = if motion.turn() == Vector3::zeros() { 0.1 } else { 1.0 };
                assert!(by(motion).norm() * scale < 1e-3 * values.max(), "{}: {motion:?}", case.name);
            }
            let weakest = found.weakest.as_ref().unwrap();
            let px = by(&weakest.motion).norm();
            assert!((px / weakest.px - 1.0).abs() < 1e-3, "{}: {px} and {}", case.name, weakest.px);
        }
    }
}

#[test]
fn three_points_in_one_image_end_in_every_pose_that_a_closed_form_finds() {
    let three = task("'left'", &["a", "b", "c"], &["A", "B", "C"], &[POINT, POINT_B, POINT_C]);
    let mut several = 0;
    for seed in 0..20 {
        let mut geometry = Geometry::drawn(&three, seed);
        // The target's points are where the hand's are at the identity.
        let points: Vec<Vector3<f64>> =
            ["a", "b", "c"].map(|name| geometry.points[three.feature(name).unwrap()]).into();
        for (name, point) in ["A", "B", "C"].iter().zip(&points) {
            geometry.points[three.feature(name).unwrap()] = *point;
        }
        let settings = CheckSettings { starts: 300, ..CheckSettings::default() };
        let found = check(&three, &geometry, &settings).unwrap();
        assert_eq!(found.fixed, 6, "seed {seed}");
        let camera = geometry.cameras[0].pose;
        let rays: Vec<Vector3<f64>> = points.iter().map(|point| (point - camera.translation).normalize()).collect();
        for pose in poses_from_rays(&points, &[camera.translation; 3], &rays) {
            let rows = three.errors(&geometry.see(&three, &pose));
            if rows.iter().any(|row| row.error.is_nan() || row.error.abs() > 1e-3) {
                continue;
            }
            let all = std::iter::once(&found.placement).chain(found.alternatives.iter().map(|other| &other.placement));
            let nearest = all.map(|known| known.angle_to(&pose)).fold(PI, f64::min);
            assert!(nearest < 1e-3, "seed {seed}: {nearest} rad from the nearest of {}", found.alternatives.len());
            several += usize::from(found.placement.angle_to(&pose) > 0.01);
        }
    }
    assert!(several > 5, "{several} others");
}

// What figure 3.2 of the thesis shows: a marker that seems to be over its cap in both images.
#[test]
fn a_line_in_one_plane_with_both_cameras_is_found_to_fix_less() {
    let on_line = task(TWO, &["a"], &["A", "B"], &["kind = 'point-to-line'; point = 'a'; line = ['A', 'B']"]);
    for seed in 0..10 {
        let mut geometry = Geometry::drawn(&on_line, seed);
        let [a, from, to] = ["a", "A", "B"].map(|name| on_line.feature(name).unwrap());
        let [left, right] = [0, 1].map(|camera| geometry.cameras[camera].pose.translation);
        let normal = (left - geometry.points[from]).cross(&(right - geometry.points[from])).normalize();
        let beside = normal.dot(&(geometry.points[to] - geometry.points[from]));
        geometry.points[to] -= beside * normal;
        geometry.points[a] = 0.5 * (geometry.points[from] + geometry.points[to]);
        let found = check(&on_line, &geometry, &CheckSettings::default()).unwrap();
        assert_eq!((found.fixed, found.free.motions.len()), (1, 5), "seed {seed}");
        // The point may leave the line and stay in the plane.
        let shifts = found.free.motions.iter().filter(|motion| matches!(motion, Motion::Translation { .. }));
        assert!(shifts.clone().count() == 2 && shifts.clone().all(|m| m.velocity(&normal).dot(&normal).abs() < 1e-4));
    }
}

#[test]
fn with_a_rig_its_cameras_and_features_are_checked() {
    let rig = catalog::rig("ur5").unwrap();
    let model = Model::new(&rig).unwrap();
    let links = model.links(&[0.5, -1.3, 1.2, -1.6, -1.7, 0.6]);
    let feature = (0..rig.features.len()).find(|index| model.features[*index].parent == handeye::rig::Parent::Tip);
    let (index, name) = feature.map(|index| (index, rig.features[index].name.clone())).unwrap();
    let xyz = links[links.len() - 1].transform(&model.features[index].xyz);
    let text = format!(
        "cameras = ['{}', '{}']\nfeatures = [{{ name = '{name}', on = 'hand' }}, {{ name = 'hole', on = 'target', xyz = [{}, {}, {}] }}]\n\
         [[tasks]]\nkind = 'point-to-point'\npoint = '{name}'\nto = 'hole'\n",
        rig.cameras[0].name, rig.cameras[1].name, xyz.x, xyz.y, xyz.z
    );
    let folder = Folder::new("tasks");
    folder.write("task.toml", &text);
    let (json, _) = folder.expect(0, "task task.toml --rig ur5 --json");
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["fixed"], 3);
    assert_eq!(json["free_words"][0], format!("any rotation about `{name}`"));
    let (_, complaint) = folder.expect(2, "task wrench --rig puma560");
    assert!(complaint.contains("the rig has no camera `left`"), "{complaint}");
    let (text, _) = folder.expect(0, "task wrench");
    assert!(text.contains("turned by 180.0° about the line through `wrench-"), "{text}");
    assert!(text.contains("fixes    6 of 6"), "{text}");
    let (text, _) = folder.expect(0, "task ring");
    assert!(text.contains("fixes    5 of 6") && text.contains("rotation about the axis"), "{text}");
    // The distance of two points cannot change.
    let far = "cameras = ['l', 'r']\nfeatures = [{ name = 'a', on = 'hand', xyz = [0, 0, 0] }, { name = 'b', on = 'hand', xyz = [0.2, 0, 0] },\
               { name = 'A', on = 'target', xyz = [0, 0, 0] }, { name = 'B', on = 'target', xyz = [0.1, 0, 0] }]\n\
               tasks = [{ kind = 'point-to-point', point = 'a', to = 'A' }, { kind = 'point-to-point', point = 'b', to = 'B' }]\n";
    folder.write("far.toml", far);
    let (_, complaint) = folder.expect(1, "task far.toml");
    assert!(complaint.contains("no placement of the hand solves the task"), "{complaint}");
    // Measured to a tenth of a millimetre, it is within the noise.
    folder.write("near.toml", &far.replace("0.2, 0", "0.1001, 0"));
    let (text, _) = folder.expect(0, "task near.toml");
    assert!(text.contains("fixes    5 of 6"), "{text}");
}
