//! `handeye servo`: scenes run, say why they stop, and what is wrong with one is said with its place.
use crate::cli::Folder;
use handeye::rig::{Model, catalog};
use handeye::scene;
use serde_json::Value;

/// A scene without anything that has a default.
const SCENE: &str = "\
rig = \"ur5\"
[robot]
start = [-0.6, -1.7, 1.7, -1.2, -1.2, -0.5]
[target]
joints = [0.5, -1.3, 1.2, -1.6, -1.7, 0.6]
";

/// Its joints.
const START: [f64; 6] = [-0.6, -1.7, 1.7, -1.2, -1.2, -0.5];
const TARGET: [f64; 6] = [0.5, -1.3, 1.2, -1.6, -1.7, 0.6];

#[test]
fn every_shipped_scene_ends_where_its_noise_allows_and_is_drawn() {
    let folder = Folder::new("scenes");
    for (name, _) in scene::ALL {
        let (text, _) = folder.expect(0, &format!("servo ur5 {name} --plot {name}.svg"));
        let last = text.lines().last().unwrap();
        assert!(last.contains("converged") || last.contains("cannot do better"), "{name}: {last}");
        let drawing = folder.read(&format!("{name}.svg"));
        assert!(drawing.starts_with("<svg") && drawing.ends_with("</svg>\n") && !drawing.contains("NaN"), "{name}");
        assert!(drawing.contains("pixel error [px]") && drawing.contains("camera right"), "{name}");
        let (json, _) = folder.expect(0, &format!("servo ur5 {name} --json"));
        let json: Value = serde_json::from_str(&json).unwrap();
        let steps = json["steps"].as_array().unwrap();
        let error = |step: &Value| step["error_px"].as_f64().unwrap();
        assert!(error(&steps[steps.len() - 1]) < 0.2 * error(&steps[0]), "{name}");
    }
}

#[test]
fn a_rig_learned_from_the_recording_alone_reaches_the_target_in_two_commands() {
    let folder = Folder::new("servo-learned");
    folder.expect(0, "simulate ur5 --samples 50 --seed 1 -o motions.jsonl");
    folder.expect(0, "calibrate motions.jsonl -o learned.toml");
    folder.write("scene.toml", SCENE);
    let (json, _) = folder.expect(0, "servo learned.toml scene.toml --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["stop"], "converged");
    let steps = json["steps"].as_array().unwrap();
    assert!(
        steps[0]["error_px"].as_f64().unwrap() > 100.0 && steps[2]["error_px"].as_f64().unwrap() < 0.5,
        "{steps:?}"
    );
}

#[test]
fn image_based_and_pose_based_controllers_run_with_their_settings_and_without_joint_readings() {
    let folder = Folder::new("servo-visual");
    let run = |scene: String| {
        folder.write("scene.toml", &scene);
        let (json, _) = folder.expect(0, "servo ur5 scene.toml --json");
        let json: Value = serde_json::from_str(&json).unwrap();
        assert_eq!(json["stop"], "converged", "{scene}");
        let steps = json["steps"].as_array().unwrap();
        steps.iter().map(|step| step["error_px"].as_f64().unwrap()).collect::<Vec<f64>>()
    };
    for (kind, slope) in [("image-based", 0.01), ("pose-based", 3.0)] {
        let control = |more: &str| format!("[controller]\nkind = \"{kind}\"\n{more}\n");
        let errors = run(format!("{SCENE}{}", control("")));
        assert!(errors.len() <= 8, "{kind}: {errors:?}");
        // Half of the error a command is left near the end.
        let errors = run(format!("{SCENE}{}", control("gain = 0.5\nmatrix = \"mean\"")));
        let left = errors[errors.len() - 1] / errors[errors.len() - 2];
        assert!((left - 0.5).abs() < 0.05, "{kind}: {errors:?}");
        let errors =
            run(format!("{SCENE}{}", control(&format!("gain = {{ near = 1.0, far = 0.1, slope = {slope} }}"))));
        assert!(errors[3] > 1.0, "{kind}: {errors:?}");
        run(SCENE.replace("[target]", "readings = false\n[target]") + &control(""));
        run(SCENE.replace("[target]", "readings = 0.05\n[target]") + &control("infer_joints = true"));
    }
}

#[test]
fn every_limit_of_scenes_leaves_the_way_to_a_target_inside_of_it() {
    let folder = Folder::new("servo-limits");
    let limits = "[limits]\nin_image = 2.0\npixel_speed = 50\ntip_speed = 1.0\ntip_box = { low = [-2, -2, -1], high = [2, 2, 2] }\n\
                  follow_plane = { point = [0, 0, 0], normal = [0, 0, 1], tolerance = 2.0 }\n\
                  follow_line = { point = [0, 0, 0], direction = [0, 0, 1], tolerance = 3.0 }\n[loop]\nwindow = 30\n";
    folder.write("scene.toml", &format!("{SCENE}{limits}"));
    let (json, _) = folder.expect(0, "servo ur5 scene.toml --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["stop"], "converged");
    let steps = json["steps"].as_array().unwrap();
    let held = |name: &str| steps.iter().any(|step| step["active"].as_array().unwrap().iter().any(|what| what == name));
    assert!(held("limit `pixel_speed`"), "{json}");
    let model = Model::new(&catalog::rig("ur5").unwrap()).unwrap();
    let tip = |step: &Value| {
        let joints: Vec<f64> = step["joints"].as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect();
        model.tip(&joints).translation
    };
    // Steps of a second at 1 m/s; a row is the tangent of the way.
    let fastest = steps.windows(2).map(|pair| (tip(&pair[1]) - tip(&pair[0])).norm()).fold(0.0, f64::max);
    assert!(fastest < 1.1, "{fastest} m in a second");
    // Slower than the way needs, the tip is held back.
    folder.write("scene.toml", &format!("{SCENE}[limits]\ntip_speed = 0.1\n"));
    let (json, _) = folder.expect(0, "servo ur5 scene.toml --json");
    assert!(json.contains("limit `tip_speed`"), "{json}");
    // Each of them blocks where the target is outside.
    for (name, limit) in [
        ("tip_box", "tip_box = { low = [-2, -2, -1], high = [-1.5, 2, 2] }"),
        ("follow_plane", "follow_plane = { point = [0, 0, 2], normal = [0, 0, 1], tolerance = 0.01 }"),
        ("follow_line", "follow_line = { point = [0, 2, 0], direction = [1, 0, 0], tolerance = 0.01 }"),
    ] {
        folder.write("scene.toml", &format!("{SCENE}[limits]\n{limit}\n[loop]\nwindow = 30\ndiverged = 100\n"));
        let (_, complaint) = folder.expect(1, "servo ur5 scene.toml");
        assert!(complaint.contains("blocked at") && complaint.contains(&format!("limit `{name}`")), "{complaint}");
    }
}

#[test]
fn the_same_seed_gives_the_same_run_and_another_seed_another() {
    let folder = Folder::new("servo-seeds");
    let run = |seed: u64| folder.expect(0, &format!("servo ur5 ur5-noisy --json --seed {seed}")).0;
    assert_eq!(run(3), run(3));
    assert_ne!(run(3), run(4));
}

#[test]
fn a_loop_that_ends_badly_has_status_1_and_its_reason() {
    let folder = Folder::new("servo-bad-end");
    folder.write("lost.toml", &format!("{SCENE}[tracker]\nmissed = 1.0\n"));
    let (text, complaint) = folder.expect(1, "servo ur5 lost.toml");
    assert!(complaint.contains("lost for 5.000 s: nothing is seen of what is aimed at"), "{complaint}");
    assert!(text.contains("waits: nothing is seen of what is aimed at"), "{text}");
    let slow = SCENE.replace("[target]", "latency = 0.8\n[target]");
    folder.write("stale.toml", &slow);
    let (_, complaint) = folder.expect(1, "servo ur5 stale.toml");
    assert!(complaint.contains("what was measured is 0.800 s old"), "{complaint}");
    // Halfway between start and target.
    let model = Model::new(&catalog::rig("ur5").unwrap()).unwrap();
    let [from, to] = [START, TARGET].map(|joints| model.tip(&joints).translation);
    let (normal, middle) = (to - from, 0.5 * (from + to));
    let wall = format!(
        "[limits]\nhalf_spaces = [{{ name = \"wall\", normal = {:?}, offset = {} }}]\n[loop]\nwindow = 30\n",
        normal.as_slice(),
        normal.dot(&middle)
    );
    folder.write("wall.toml", &format!("{SCENE}{wall}"));
    let (_, complaint) = folder.expect(1, "servo ur5 wall.toml");
    assert!(complaint.contains("blocked at") && complaint.contains("limit `wall`"), "{complaint}");
}

#[test]
fn a_target_that_moves_is_followed_to_the_end_of_the_time() {
    let folder = Folder::new("servo-follow");
    let moving = SCENE.to_owned()
        + "velocity = [-0.02, 0.0, 0.0, 0.01, 0.0, 0.0]\nuntil = 20.0\n[loop]\nfollow = true\ntimeout = 40.0\n";
    folder.write("moving.toml", &moving);
    let (json, _) = folder.expect(0, "servo ur5 moving.toml --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["stop"], "timed-out");
    // While the target moves the arm is one step behind, of 4 px; once it stands, not at all.
    let error = |step: &Value| step["error_px"].as_f64().unwrap();
    let steps = json["steps"].as_array().unwrap();
    assert!(steps[5..20].iter().all(|step| (0.5..15.0).contains(&error(step))), "{steps:?}");
    assert!(steps[22..].iter().all(|step| error(step) < 1e-6), "{steps:?}");
}

#[test]
fn what_is_wrong_with_a_scene_is_said_with_its_place_and_what_would_do() {
    let folder = Folder::new("servo-scenes");
    let cases = [
        ("", "scene.toml:1:1: has no table `robot`, which says where the arm starts"),
        ("rig = \"ur55\"\n", "scene.toml:1:7: `rig`: `ur55` is no rig file beside the scene"),
        ("[robots]\n", "scene.toml:1:2: unknown key `robots` (did you mean `robot`?)"),
        ("[robot]\nstart = [1, 2]\n", "scene.toml:1:1: has no table `target`"),
        (
            "rig = \"ur5\"\n[robot]\nstart = [1, 2]\n[target]\n",
            "scene.toml:3:9: robot: `start`: has 2 numbers, the rig has 6 joints",
        ),
        (
            "[robot]\ntakes = \"steps\"\n[target]\n",
            "scene.toml:2:9: robot: `takes`: unknown kind of command `steps` (known: joints,",
        ),
        (
            "[robot]\n[target]\n[tracker]\nkind = \"gaussian\"\n",
            "scene.toml:3:2: tracker: is gaussian and has no `sd` (px)",
        ),
        (
            "[robot]\n[target]\n[tracker]\nmissed = 2\n",
            "scene.toml:4:10: tracker: `missed`: must be from 0 to 1, found 2",
        ),
        (
            "[robot]\nstart=[0]\n[target]\njoints=[0]\n[controller]\nkind = \"image\"\n",
            "scene.toml:6:8: controller: `kind`: unknown controller `image` (",
        ),
        (
            "[robot]\nstart=[0]\n[target]\njoints=[0]\n[controller]\ngain = 0.5\n",
            "scene.toml:5:2: controller: `gain` is for image-based and pose-based, this is model-based",
        ),
        (
            "[robot]\nstart=[0]\n[target]\njoints=[0]\n[controller]\nkind = \"pose-based\"\ngain = { near = 1.0, far = 2.0, slope = 1.0 }\n",
            "scene.toml:7:28: controller: `gain`: `far`: must be at most 1, found 2",
        ),
        ("[robot]\nstart=[0]\n[target]\njoints=[0]\n[limits]\ntip_box={ low=[0,0,0] }\n", "`tip_box`: has no `high`"),
        (
            "[robot]\nstart=[0]\n[target]\njoints=[0]\n[limits]\nfollow_line={ point=[0,0,0], direction=[0,0,0], tolerance=1 }\n",
            "`direction`: is of length 0",
        ),
        ("dt = 0\n[robot]\nstart=[0]\n[target]\njoints=[0]\n", "scene.toml:1:6: `dt`: must be above 0, found 0"),
    ];
    for (text, message) in cases {
        folder.write("scene.toml", text);
        let (_, complaint) = folder.expect(2, "servo ur5 scene.toml");
        assert!(complaint.contains(message), "{text}\n{complaint}\n{message}");
    }
    for (text, message) in [
        ("[controller]\nkind = \"model-based-tip\"\nspeed = [0.1, -1]\n", "must be two numbers above 0: m/s and rad/s"),
        ("[controller]\nkind = \"image-based\"\ngain = 2\n", "`gain`: must be at most 1, found 2"),
    ] {
        folder.write("scene.toml", &format!("{SCENE}{text}"));
        let (_, complaint) = folder.expect(2, "servo ur5 scene.toml");
        assert!(complaint.contains(message), "{text}\n{complaint}");
    }
    let idle =
        SCENE.replace("[target]", "takes = \"pose-deltas\"\nexecution = { gain = [1, 1, 1, 1, 1, 1] }\n[target]");
    folder.write("scene.toml", &idle);
    let (_, complaint) = folder.expect(2, "servo ur5 scene.toml");
    assert!(complaint.contains("`gain` of the scene's `execution` has no effect"), "{complaint}");
    folder.write("scene.toml", "[robot]\nstart = [1, 2]\n[target]\njoints = [1, 2]\n");
    let (_, complaint) = folder.expect(2, "servo ur5 scene.toml");
    assert!(complaint.contains("`start` of the scene has 2 numbers, the rig has 6 joints"), "{complaint}");
    folder.write("scene.toml", &format!("dt = 1e-9\n{SCENE}"));
    let (_, complaint) = folder.expect(2, "servo ur5 scene.toml");
    assert!(complaint.contains("at most 1000000 are run"), "{complaint}");
    let (_, complaint) = folder.expect(2, "servo ur5 nowhere");
    assert!(
        complaint
            .contains("nowhere: neither a scene file nor a shipped scene (known: ur5-reach, ur5-visual, ur5-noisy, ur5-uncalibrated, ur5-wrench, ur5-moving)"),
        "{complaint}"
    );
    assert_eq!(folder.names(), ["scene.toml"], "a failed run writes nothing");
}

#[test]
fn a_scene_without_a_rig_runs_uncalibrated_and_an_outdated_rig_is_followed_as_far_as_it_is_right() {
    let folder = Folder::new("servo-uncalibrated");
    let (text, _) = folder.expect(0, "servo ur5-uncalibrated");
    assert!(text.contains("converged"), "{text}");
    // Nothing said of a controller: uncalibrated where there is no rig.
    let scene = SCENE.replace("[target]", "[tracker]\nsd = 0.3\n[target]") + "[loop]\nwindow = 60\ntolerance_px = 3\n";
    folder.write("scene.toml", &scene);
    let (json, _) = folder.expect(0, "servo scene.toml --json");
    let explored: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(explored["stop"], "converged");
    let catalogue = catalog::rig("ur5").unwrap();
    let mut moved = catalogue.clone();
    moved.cameras[0].pose.as_mut().unwrap().translation.x += 0.1;
    folder.write("moved.toml", &moved.to_toml());
    let hybrid = format!("{scene}[controller]\nkind = \"hybrid\"\npixels = 0.3\n");
    folder.write("hybrid.toml", &hybrid);
    let (json, _) = folder.expect(0, "servo moved.toml hybrid.toml --json");
    let followed: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(followed["stop"], "converged");
    let commands = |run: &Value| run["commands"].as_u64().unwrap();
    assert!(2 * commands(&followed) <= commands(&explored), "{} and {}", commands(&followed), commands(&explored));
}

#[test]
fn what_an_uncalibrated_scene_cannot_do_is_said_with_its_place() {
    let folder = Folder::new("servo-uncalibrated-mistakes");
    let refuse = |scene: &str, arguments: &str, what: &str| {
        folder.write("scene.toml", scene);
        let (_, error) = folder.expect(2, arguments);
        assert!(error.contains(what), "{error}");
    };
    let with = |more: &str| format!("{SCENE}{more}");
    let own = "servo scene.toml";
    refuse(&with("[controller]\nkind = \"image-based\""), own, "kind image-based needs a rig");
    refuse(&with("[controller]\nkind = \"hybrid\""), own, "kind hybrid needs a rig");
    refuse(&with("[limits]\ntip_speed = 1.0"), own, "limit `tip_speed` needs a rig");
    refuse(
        &with("[controller]\nkind = \"uncalibrated\"\nmatrix = \"mean\""),
        own,
        "scene.toml:6:2: controller: `matrix`",
    );
    refuse(&with("[controller]\npixels = 1"), own, "`pixels` (noise of the trackers)");
    refuse(&SCENE.replace("[target]", "takes = \"pose-deltas\"\n[target]"), own, "moves joints");
    refuse(&SCENE.replace("rig = \"ur5\"\n", ""), own, "names no `rig`");
    let fault = |text: &str| with(&format!("[tracker]\nfaults = [{{ {text} }}]\n"));
    refuse(&fault("camera = \"left\", kind = \"lost\""), own, "faults: has no `feature`");
    refuse(&fault("camera = \"left\", feature = \"f1\", kind = \"drift\""), own, "has no `by`");
    refuse(
        &fault("camera = \"left\", feature = \"f1\", kind = \"lost\", by = [1, 0]"),
        own,
        "`by` is for jump and drift",
    );
    refuse(
        &fault("camera = \"left\", feature = \"f1\", kind = \"lost\", from = 3, until = 2"),
        own,
        "before it begins",
    );
    refuse(&fault("camera = \"top\", feature = \"f1\", kind = \"lost\""), own, "camera `top`, which its rig has not");
}
