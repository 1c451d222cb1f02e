//! Scene files of tasks: what is wrong with them is said with its place, and what they read is left as it is.
use crate::cli::Folder;
use handeye::rig::{Parent, catalog};
use handeye::scene::{Scene, Waypoint, run};
use handeye::servo::image_tasks::{self, Geometry};
use handeye::solvers::Pose;
use std::ops::ControlFlow;
use std::path::Path;

const TARGET: [f64; 6] = [0.0, -1.3, 1.2, -1.5, -1.6, 0.3];

#[test]
fn what_is_wrong_with_a_scene_of_a_task_is_said_with_its_place() {
    let folder = Folder::new("task-scene-mistakes");
    let head = "rig = \"ur5\"\n";
    let rest = format!("[robot]\nstart = {TARGET:?}\n[target]\njoints = {TARGET:?}\n");
    // A point of the hand onto a pixel: nothing is on the target.
    let fixed = "[task]\ncameras = [\"left\", \"right\"]\nfeatures = [{ name = \"f0\", on = \"hand\" }, { name = \"p\", on = \"image\", pixels = { left = [320, 240], right = [320, 240] } }]\ntasks = [{ kind = \"point-to-point\", point = \"f0\", to = \"p\" }]\n";
    let cases = [
        (
            format!("{head}task = \"wrenches\"\n{rest}"),
            "scene.toml:2:8: `task`: `wrenches` is no task file beside the scene",
        ),
        (
            format!("{head}{rest}path = [[0, 0, 0, 0]]\n"),
            "scene.toml:6:8: target: `path`: moves the target of a `task`, and the scene has none",
        ),
        (
            format!("{head}task = \"wrench\"\n{rest}path = [[1, 0, 0, 0], [1, 0, 0, 0]]\n"),
            "target: `path`: has times that do not ascend",
        ),
        (format!("{head}task = \"wrench\"\n{rest}path = [[1, 0, 0]]\n"), "expected 4 numbers, found 3"),
        (format!("{head}task = \"wrench\"\n{rest}path = \"nowhere.jsonl\"\n"), "target: `path`: "),
        (
            format!("{head}task = \"wrench\"\n{rest}[controller]\nkind = \"model-based\"\n"),
            "scene.toml:7:2: controller: a task is carried out by `kind = \"uncalibrated\"`, this is model-based",
        ),
        (
            format!("{head}task = \"wrench\"\n{rest}[controller]\npixels = 1\n"),
            "scene.toml:8:10: controller: `pixels`: is `noise = { pixels = ... }` of the task",
        ),
        (
            format!("{head}{rest}velocity = []\n"),
            "scene.toml:6:12: target: `velocity`: has 0 numbers, the rig has 6 joints",
        ),
        (
            format!("{rest}velocity = []\n"),
            "scene.toml:5:12: target: `velocity`: has no number, and every joint needs one",
        ),
        (
            format!("{head}{rest}[tracker]\npoints = 0.01\n"),
            "scene.toml:7:10: tracker: `points`: is noise of depth cameras, and the rig has none",
        ),
        (
            format!("{head}{rest}[controller]\nkind = \"uncalibrated\"\n[limits]\ntip_speed = 1\n"),
            "limit `tip_speed` needs a rig, and servoing of kind uncalibrated is carried out without one",
        ),
        (
            format!(
                "{head}{rest}path = [[0, 0, 0, 0]]\n{}",
                fixed.replace("features = [", "features = [{ name = \"idle\", on = \"target\", xyz = [0, 0, 0] }, ")
            ),
            "`path`: moves nothing: what a target takes along",
        ),
        (
            format!("{head}task = \"wrench\"\n{rest}[limits]\ntip_speed = 1\n"),
            "limit `tip_speed` needs a rig, and a task is carried out without one",
        ),
        (format!("{head}{rest}[task]\ncameras = [\"left\"]\n"), "`task`: has no [[tasks]]"),
        (
            format!(
                "{head}{rest}[task]\ncameras = [\"top\"]\nfeatures = [{{ name = \"f0\", on = \"hand\" }}, {{ name = \"p\", on = \"target\", xyz = [0,0,0] }}]\ntasks = [{{ kind = \"point-to-point\", point = \"f0\", to = \"p\" }}]\n"
            ),
            "the rig has no camera `top` (known: left, right)",
        ),
        (
            format!(
                "{head}{rest}[task]\ncameras = [\"left\"]\nfeatures = [{{ name = \"q\", on = \"hand\" }}, {{ name = \"p\", on = \"target\", xyz = [0,0,0] }}]\ntasks = [{{ kind = \"point-to-point\", point = \"q\", to = \"p\" }}]\n"
            ),
            "feature `q` on hand is not in the rig: give its `xyz` in the task",
        ),
        (
            format!(
                "{head}{rest}[task]\ncameras = [\"left\"]\nfeatures = [{{ name = \"f0\", on = \"target\" }}, {{ name = \"p\", on = \"hand\", xyz = [0,0,0] }}]\ntasks = [{{ kind = \"point-to-point\", point = \"p\", to = \"f0\" }}]\n"
            ),
            "feature `f0` is on target in the task, and not so in the rig",
        ),
        (
            format!("{head}task = \"wrench\"\n{rest}path = []\n"),
            "scene.toml:7:8: target: `path`: has no place: expected at least one [s, m, m, m]",
        ),
        (
            format!("{head}{rest}until = 3\n"),
            "scene.toml:6:9: target: `until`: says for how long `velocity` moves the target, and there is none",
        ),
        (
            format!("{head}{rest}path = [[0, 0, 0, 0]]\n{fixed}"),
            "scene.toml:6:8: target: `path`: moves nothing: what a target takes along are features on the target",
        ),
        (
            format!("{head}{rest}velocity = [0.1, 0, 0, 0, 0, 0]\n{fixed}"),
            "scene.toml:6:12: target: `velocity`: moves nothing",
        ),
        (
            format!("{head}[tracker]\nat = 1\n{rest}"),
            "scene.toml:2:2: tracker: has `at` (m), the distance of its `sd`, and no `sd` (px)",
        ),
        (format!("{head}[tracker]\nkind = \"rounded\"\nat = 1\n{rest}"), "is rounded, and `at` is for gaussian ones"),
        (
            rest.replace("[target]", "slips = [{ joint = \"knee\", by = 0.1 }]\n[target]"),
            "names joint `knee`, which its rig has not",
        ),
        (rest.replace("[target]", "slips = [{ joint = \"elbow\" }]\n[target]"), "slips: has no `by`"),
        (
            format!("{rest}[controller]\ndead_band = 0.1\n"),
            "`dead_band` (of the robot's joints) is for uncalibrated and hybrid, this is model-based",
        ),
    ];
    for (text, message) in cases {
        folder.write("scene.toml", &text);
        let (_, complaint) = folder.expect(2, "servo ur5 scene.toml");
        assert!(complaint.contains(message), "{text}\n{complaint}\n{message}");
    }
    // A scene that was made otherwise is told so when it is run.
    let mut made = Scene::parse(&format!("{head}{rest}{fixed}"), "scene.toml", Path::new("")).unwrap();
    made.target.path = vec![Waypoint { time: 0.0, motion: Pose::identity() }];
    let refused = run(None, &made, &mut |_| ControlFlow::Continue(())).unwrap_err().to_string();
    assert!(refused.contains("`target.path` of the scene moves nothing"), "{refused}");
    // Three rows for six joints: said before anything moves.
    folder.write("scene.toml", &format!("{head}{rest}[task]\ncameras = [\"left\"]\nfeatures = [{{ name = \"f0\", on = \"hand\" }}, {{ name = \"p\", on = \"target\", xyz = [0,0,0] }}]\ntasks = [{{ kind = \"point-to-point\", point = \"f0\", to = \"p\" }}]\n"));
    let (_, complaint) = folder.expect(2, "servo scene.toml");
    assert!(complaint.contains("6 quantities") && complaint.contains("2 rows"), "{complaint}");
}

#[test]
fn features_and_cameras_on_a_link_before_the_tip_are_refused_by_scenes_as_by_the_checker() {
    let shipped = catalog::rig("ur5").unwrap();
    let last = shipped.robot.joints.len() - 1;
    let text = format!(
        "rig = \"ur5\"\n[robot]\nstart = {TARGET:?}\n[target]\njoints = {TARGET:?}\n[loop]\ntimeout = 3\n[task]\ncameras = [\"left\", \"right\"]\n\
         features = [{{ name = \"f0\", on = \"hand\" }}, {{ name = \"f1\", on = \"hand\" }}, {{ name = \"p\", on = \"target\", xyz = [0,0,0] }}, {{ name = \"q\", on = \"target\", xyz = [0,0,0.1] }}]\n\
         tasks = [{{ kind = \"point-to-point\", point = \"f0\", to = \"p\" }}, {{ kind = \"point-to-point\", point = \"f1\", to = \"q\" }}]\n"
    );
    for (link, is_tip) in [(last, true), (last - 1, false), (2, false)] {
        for is_camera in [false, true] {
            let mut scene = Scene::parse(&text, "scene.toml", Path::new("")).unwrap();
            let rig = scene.rig.as_mut().unwrap();
            let what = if is_camera {
                rig.cameras[1].parent = Parent::Link(link);
                "camera `right`"
            } else {
                rig.features[0].parent = Parent::Link(link);
                "feature `f0`"
            };
            let by_checker = Geometry::of_rig(scene.task.as_ref().unwrap(), rig).map(|_| ());
            let by_scene = run(None, &scene, &mut |_| ControlFlow::Continue(())).map(|_| ());
            for answer in [by_checker, by_scene] {
                match answer {
                    Ok(()) => assert!(is_tip, "{what} on link {link} is taken for one on the tip"),
                    Err(error) => {
                        let error = error.to_string();
                        let is_said = error.contains(&format!("{what} is on a link before the tip"));
                        assert!(!is_tip && is_said, "{what} on link {link}: {error}");
                    }
                }
            }
        }
    }
}

#[test]
fn what_a_scene_reads_is_not_written_over() {
    let folder = Folder::new("scene-files");
    let read = ["rig.toml", "left.yaml", "task.toml", "hand.jsonl", "scene.toml"];
    let mut rig = catalog::rig("ur5").unwrap();
    let left = &mut rig.cameras[0];
    (left.model, left.fx, left.fy, left.cx, left.cy) = (None, None, None, None, None);
    let named = "name = \"left\"\n";
    folder.write("rig.toml", &rig.to_toml().replace(named, &format!("{named}intrinsics = \"left.yaml\"\n")));
    folder.write(
        "left.yaml",
        "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\ncamera_matrix: { rows: 3, cols: 3, data: [600, 0, 320, 0, 600, 240, 0, 0, 1] }\n\
         distortion_coefficients: { rows: 1, cols: 5, data: [0, 0, 0, 0, 0] }\n",
    );
    let (_, wrench) = image_tasks::catalog::ALL.iter().find(|(name, _)| *name == "wrench").unwrap();
    folder.write("task.toml", wrench);
    let header = "{\"format\":\"handeye-recording\",\"version\":1}\n";
    let line = |time: f64| format!("{{\"time\":{time},\"pose\":{{\"xyz\":[0,0,0],\"quat\":[0,0,0,1]}}}}\n");
    folder.write("hand.jsonl", &format!("{header}{}{}", line(0.0), line(1.0)));
    let scene = |rig: &str, task: &str, path: &str| {
        format!(
            "rig = \"{rig}\"\ntask = \"{task}\"\n[robot]\nstart = {TARGET:?}\n[target]\njoints = {TARGET:?}\npath = {path}\n[loop]\ntimeout = 3\nfollow = true\n"
        )
    };
    folder.write("scene.toml", &scene("rig.toml", "task.toml", "\"hand.jsonl\""));
    let before = read.map(|name| folder.read(name));
    for option in ["--plot", "--report"] {
        for name in read {
            let (_, complaint) = folder.expect(2, &format!("servo scene.toml {option} {name}"));
            assert!(complaint.contains("this would be written over, and it is an input too"), "{complaint}");
        }
    }
    assert_eq!(read.map(|name| folder.read(name)), before);
    folder.expect(0, "servo scene.toml --plot drawn.svg");
    let shipped = Scene::parse(&scene("ur5", "wrench", "[[0, 0, 0, 0]]"), "scene.toml", Path::new("")).unwrap();
    assert!(shipped.files.is_empty(), "{:?}", shipped.files);
}
