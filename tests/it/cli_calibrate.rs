//! Learning from the command line: a rig file that every other command reads, the same bytes every time, and its report.
use crate::cli::Folder;
use crate::learning::variants;
use handeye::rig::{Model, Parent, Rig, catalog};
use handeye::simulate::{SimulateOptions, simulate};
use serde_json::Value;

fn json(folder: &Folder, arguments: &str) -> Value {
    let (out, err) = folder.expect(0, &format!("{arguments} --json"));
    assert_eq!(err, "", "handeye {arguments}");
    serde_json::from_str(&out).unwrap()
}

/// A UR5's motions before two cameras, with 0.3 px noise per axis: 0.424 px rms.
fn motions(name: &str) -> Folder {
    let folder = Folder::new(name);
    folder.expect(0, "simulate ur5 --samples 50 --seed 1 -o motions.jsonl");
    folder.expect(0, "simulate ur5 --samples 50 --seed 2 -o fresh.jsonl");
    folder
}

const FLOOR: f64 = 0.3 * std::f64::consts::SQRT_2;

#[test]
fn what_is_learned_from_nothing_predicts_what_it_has_not_seen() {
    let folder = motions("nothing");
    let report = json(&folder, "calibrate motions.jsonl -o learned.toml");
    assert_eq!((&report["samples"], &report["converged"], &report["rejected"]), (&50.into(), &true.into(), &0.into()));
    for key in ["observations", "rms_px", "mean_px", "median_px"] {
        assert!(report[key].is_number() && report["cameras"]["left"][key].is_number(), "{key}: {report}");
    }
    for stage in report["stages"].as_array().unwrap() {
        let numbers = ["iterations", "loss_after", "seconds"];
        assert!(stage["name"].is_string() && numbers.iter().all(|key| stage[*key].is_number()), "{stage}");
        assert!(!stage["loss_before"].is_string(), "a number, or null where there was nothing before: {stage}");
    }
    assert!(report["gauge"].as_array().unwrap().iter().all(Value::is_string));

    let learned = Rig::parse(&folder.read("learned.toml"), "learned.toml").unwrap();
    assert!(Model::new(&learned).is_ok(), "every value is filled in");
    let fit = learned.fit.unwrap();
    assert_eq!((Some(fit.rms_px), fit.samples), (report["rms_px"].as_f64(), 50));
    let judged = json(&folder, "evaluate learned.toml fresh.jsonl");
    assert!(judged["rms_px"].as_f64().unwrap() < 1.1 * FLOOR, "{} px", judged["rms_px"]);
    assert_eq!(json(&folder, "check learned.toml fresh.jsonl")["complete"], true);
}

/// What a wrist camera needs besides the robot's name: without it the misfit says so, and `check` does.
#[test]
fn a_camera_on_the_hand_needs_one_word() {
    let folder = Folder::new("eye-in-hand");
    let rig = variants::on_hand(1, 4);
    let options = SimulateOptions { samples: 40, ..SimulateOptions::default() };
    simulate(&rig, &options).unwrap().recording.write(&folder.path().join("rec.jsonl")).unwrap();
    let arm = Rig { cameras: Vec::new(), features: Vec::new(), ..rig };
    arm.write(&folder.path().join("arm.toml"), None).unwrap();

    let report = json(&folder, "calibrate rec.jsonl --rig arm.toml --eye-in-hand -o learned.toml");
    assert!(report["rms_px"].as_f64().unwrap() < 1.1 * FLOOR, "{} px", report["rms_px"]);
    let learned = Rig::parse(&folder.read("learned.toml"), "learned.toml").unwrap();
    assert!(learned.cameras.iter().all(|camera| camera.parent == Parent::Tip));
    assert!(learned.features.len() == 12 && learned.features.iter().all(|f| f.parent == Parent::World));

    let output = folder.run("calibrate rec.jsonl --rig arm.toml -o wrong.toml");
    let told = String::from_utf8([output.stdout, output.stderr].concat()).unwrap();
    assert!(told.contains("on the hand, say --eye-in-hand"), "{told}");
    let (out, _) = folder.expect(0, "check arm.toml rec.jsonl");
    assert!(out.contains("move as if they were not") && out.contains("or say --eye-in-hand"), "{out}");
    let (out, _) = folder.expect(0, "check arm.toml rec.jsonl --eye-in-hand");
    assert!(out.contains("no mistake"), "{out}");
    folder.expect(0, "suggest learned.toml --count 1 --with rec.jsonl --rig arm.toml");
    let (_, err) = folder.expect(2, "calibrate rec.jsonl --rig learned.toml --eye-in-hand -o x.toml");
    assert!(err.contains("--eye-in-hand has no effect"), "{err}");
}

/// Lenses that a recording gives, and a row of the arm, stay to the bit; the rest is learned as well.
#[test]
fn what_is_known_exactly_is_held_without_a_rig_file() {
    let folder = motions("hold");
    let known = catalog::rig("ur5").unwrap();
    Rig { cameras: Vec::new(), features: Vec::new(), ..known.clone() }
        .write(&folder.path().join("arm.toml"), None)
        .unwrap();
    let held = "--hold cameras.*.intrinsics,robot.joints.shoulder_pan --hold robot.joints.elbow.d";
    let report = json(&folder, &format!("calibrate motions.jsonl --rig arm.toml {held} -o learned.toml"));
    assert!(report["rms_px"].as_f64().unwrap() < 1.1 * FLOOR, "{} px", report["rms_px"]);
    let learned = Rig::parse(&folder.read("learned.toml"), "learned.toml").unwrap();
    for camera in &learned.cameras {
        let before = known.cameras.iter().find(|known| known.name == camera.name).unwrap();
        assert_eq!((camera.fx, camera.fy, camera.cx, camera.cy), (before.fx, before.fy, before.cx, before.cy));
    }
    let [free, before] = [&learned, &known].map(|rig| &rig.robot.joints);
    assert_eq!((&free[0], free[2].d), (&before[0], before[2].d));
    assert_ne!(free[2].a, before[2].a);

    let error = |args: &str| folder.expect(2, &format!("calibrate motions.jsonl --rig arm.toml {args} -o x.toml")).1;
    let unknown = error("--hold cameras.lefd.fx");
    assert!(unknown.contains("--hold `cameras.lefd.fx` matches nothing") && unknown.contains("`left`"), "{unknown}");
    let open = error("--hold features");
    assert!(open.contains("--hold `features` holds `features.") && open.contains("which has no value"), "{open}");
}

#[test]
fn one_thread_and_two_write_the_same_bytes() {
    let folder = motions("threads");
    for (threads, output) in [(1, "one.toml"), (2, "two.toml"), (2, "again.toml")] {
        folder.expect(0, &format!("calibrate motions.jsonl -o {output} --threads {threads}"));
    }
    assert_eq!(folder.read("one.toml"), folder.read("two.toml"));
    assert_eq!(folder.read("two.toml"), folder.read("again.toml"));
}

#[test]
fn a_rig_may_be_refined_in_its_place_and_keeps_its_comments() {
    let folder = motions("place");
    let (_, text) = catalog::ALL[0];
    let own = "# my own words\n\n".to_owned() + text;
    folder.write("arm.toml", &own);
    let (out, _) = folder.expect(0, "calibrate motions.jsonl --rig arm.toml -o arm.toml");
    assert!(out.contains("refined"), "{out}");
    let after = folder.read("arm.toml");
    assert!(own.lines().filter(|line| line.starts_with('#')).all(|comment| after.contains(comment)), "{after}");
    assert_ne!(own, after);
    let judged = json(&folder, "evaluate arm.toml fresh.jsonl");
    assert!(judged["rms_px"].as_f64().unwrap() < 1.1 * FLOOR, "{} px", judged["rms_px"]);
}

#[test]
fn folds_are_judged_by_rigs_that_have_not_seen_them() {
    let folder = motions("folds");
    let report = json(&folder, "calibrate motions.jsonl --rig ur5 -o learned.toml --folds 5");
    let held_out = &report["held_out"];
    let folds = held_out["folds"].as_array().unwrap();
    assert_eq!(folds.len(), 5);
    let sum: u64 = folds.iter().map(|fold| fold["observations"].as_u64().unwrap()).sum();
    assert_eq!((Some(sum), &held_out["observations"]), (report["observations"].as_u64(), &report["observations"]));
    let [held_out, fitted] = [held_out, &report].map(|errors| errors["rms_px"].as_f64().unwrap());
    assert!(fitted < held_out && held_out < 1.2 * FLOOR, "{fitted} px fitted, {held_out} px held out");
}

#[test]
fn the_demonstration_comes_near_the_noise_and_leaves_no_file() {
    let folder = Folder::new("demo");
    let story = json(&folder, "demo");
    assert!((story["floor"]["rms_px"].as_f64().unwrap() - FLOOR).abs() < 1e-12);
    assert!(story["rms_over_floor"].as_f64().unwrap() < 1.1, "{story}");
    assert_eq!(story["evaluation"]["samples"], 50);
    let (text, _) = folder.expect(0, "demo");
    assert!(text.contains("0.424") && text.contains("fresh samples"), "{text}");
    assert!(folder.names().is_empty());
}
