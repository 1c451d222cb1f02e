//! `--report` writes a page that holds everything, stands alone, and says what was found.
use crate::cli::Folder;
use handeye::calibrate::{Options, calibrate};
use handeye::report::{Subject, html, residuals, servo_html};
use handeye::rig::{Model, Parent, Rig, catalog};
use handeye::scene::{Moment, Scene};
use handeye::servo::image_tasks::Place;
use handeye::simulate::{SimulateOptions, simulate};
use serde_json::Value;
use std::ops::ControlFlow;
use std::path::Path;

/// Headings of a page from nothing but a recording.
const SECTIONS: &[&str] = &[
    "In short",
    "How good it is",
    "Cameras",
    "Are the errors noise?",
    "The samples that fit worst",
    "Where the joints have been",
    "Where everything is",
    "What was learned",
    "What the recording cannot tell",
    "How it was found",
    "Where to move next",
    "What to do next",
];

#[test]
fn a_page_has_every_section_stands_alone_and_holds_the_figures_of_the_command() {
    let folder = Folder::new("report");
    folder.expect(0, "simulate ur5 --samples 40 --seed 3 --outliers 0.01 -o motions.jsonl");
    let (json, _) =
        folder.expect(0, "calibrate motions.jsonl -o learned.toml --report page.html --influence --folds 4 --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    let page = folder.read("page.html");
    for heading in SECTIONS.iter().chain(&["The samples that matter most", "predicted without having been seen"]) {
        assert!(page.contains(&format!("<h2>{heading}</h2>")), "{heading} is missing");
    }
    // Nothing is fetched: no address but the name of SVG.
    let addresses = page.matches("://").count();
    assert_eq!(addresses, page.matches("http://www.w3.org/2000/svg").count());
    assert!(!page.contains("NaN") && !page.contains("src=") && !page.contains("<link"));
    let figure = format!("{:.3} px", json["rms_px"].as_f64().unwrap());
    assert!(page.contains(&figure), "{figure}");
    assert!(page.contains(" do not fit and were left out"));
    for path in ["robot.joints.elbow.alpha", "cameras.left.pose", "features.f11.xyz"] {
        assert!(page.contains(&format!("<td>{path}</td>")), "{path}");
    }
    let data = page.split("type=\"application/json\">").nth(1).unwrap().split("</script>").next().unwrap();
    let scene: Value = serde_json::from_str(data).unwrap();
    let count = |what: &str| scene[what][0].as_array().unwrap().len();
    assert_eq!((count("cameras"), count("features")), (2, 12));
    assert_eq!(scene["tips"].as_array().unwrap().len(), 40);
}

#[test]
fn residuals_are_the_errors_of_the_calibration_whatever_is_known_of_the_state() {
    let truth = catalog::rig("ur5").unwrap();
    for (joints, action) in [(0.0, 0.0), (0.01, 0.0), (0.0, 0.01)] {
        let mut rig = truth.clone();
        (rig.noise.joints, rig.noise.joint_action) = (joints, action);
        let mut recording =
            simulate(&rig, &SimulateOptions { seed: 5, ..SimulateOptions::default() }).unwrap().recording;
        if action > 0.0 {
            recording.samples.iter_mut().for_each(|sample| sample.joints = None);
        }
        let known = Rig { noise: rig.noise, ..Rig::default() };
        let learned = calibrate(&known, &recording, &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap();
        let all = residuals(&learned.rig, &recording).unwrap();
        assert_eq!(all.len(), learned.report.observations);
        let rms = (all.iter().map(|residual| residual.distance().powi(2)).sum::<f64>() / all.len() as f64).sqrt();
        // States are inferred sample by sample, without the actions between them.
        assert!((rms / learned.report.rms_px - 1.0).abs() < 0.1, "{joints} {action}: {rms} {}", learned.report.rms_px);
    }
}

#[test]
fn names_that_mean_something_to_html_are_text() {
    let truth = catalog::rig("ur5").unwrap();
    let recording = simulate(&truth, &SimulateOptions { samples: 20, ..SimulateOptions::default() }).unwrap().recording;
    let learned = calibrate(&truth, &recording, &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap();
    let subject = Subject {
        about: "<script>alert(1)</script> & co.toml".into(),
        before: &truth,
        calibration: &learned,
        recording: &recording,
        suggestion: None,
        tables: &[],
    };
    let page = html(&subject).unwrap();
    assert!(
        page.contains("<h1>&lt;script&gt;alert(1)&lt;/script&gt; &amp; co.toml</h1>")
            && !page.contains("<script>alert")
    );
    assert_eq!(page, html(&subject).unwrap(), "the same calibration gives the same bytes");
}

#[test]
fn a_page_is_not_written_over_an_input_or_the_rig() {
    let folder = Folder::new("report-output");
    folder.expect(0, "simulate ur5 --samples 20 -o motions.jsonl");
    for (page, message) in [
        ("motions.jsonl", "it is an input too"),
        ("out.toml", "given for two outputs"),
        ("no/page.html", "no/page.html"),
    ] {
        let (_, complaint) = folder.expect(2, &format!("calibrate motions.jsonl -o out.toml --report {page}"));
        assert!(complaint.contains(message), "{complaint}");
    }
    assert_eq!(folder.names(), ["motions.jsonl"]);
    folder.write("arm.toml", "name = \"precious\"\n");
    for arguments in [
        "calibrate motions.jsonl --rig arm.toml -o out.toml --report arm.toml",
        "calibrate motions.jsonl --rig arm.toml -o arm.toml --report ./arm.toml",
        "calibrate motions.jsonl -o out.toml --report ./out.toml",
    ] {
        let (_, complaint) = folder.expect(2, arguments);
        assert!(complaint.contains("is an input too") || complaint.contains("two outputs"), "{arguments}\n{complaint}");
    }
    assert_eq!(folder.read("arm.toml"), "name = \"precious\"\n");
}

/// Of samples with nothing but a tip pose, features on inner links are nowhere.
#[test]
fn a_page_of_samples_without_joints_leaves_out_what_hangs_on_inner_links() {
    let mut truth = catalog::rig("ur5").unwrap();
    truth.features[0].parent = Parent::Link(2);
    let simulated = simulate(&truth, &SimulateOptions { samples: 20, ..SimulateOptions::default() }).unwrap();
    let learned =
        calibrate(&truth, &simulated.recording, &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap();
    let mut recording = simulated.recording.clone();
    for (sample, exact) in recording.samples.iter_mut().zip(&simulated.truth.samples) {
        (sample.joints, sample.pose) = (None, exact.pose);
    }
    let all = residuals(&learned.rig, &recording).unwrap();
    assert!(!all.is_empty() && all.iter().all(|residual| residual.feature != 0 && residual.distance() < 3.0));
    let subject = Subject {
        about: "tips".into(),
        before: &truth,
        calibration: &learned,
        recording: &recording,
        suggestion: None,
        tables: &[],
    };
    assert!(html(&subject).unwrap().contains("<h2>Where everything is</h2>"));
}

/// The data of a page's n-th script.
fn data(page: &str, n: usize) -> Value {
    let text = page.split("type=\"application/json\">").nth(n).unwrap().split("</script>").next().unwrap();
    serde_json::from_str(text).unwrap()
}

#[test]
fn an_evaluation_has_a_page_that_names_the_camera_that_was_moved() {
    let folder = Folder::new("report-evaluation");
    folder.expect(0, "simulate ur5 --samples 40 --seed 1 -o motions.jsonl");
    folder.expect(0, "calibrate motions.jsonl -o learned.toml");
    folder.expect(0, "simulate ur5 --samples 30 --seed 2 -o fresh.jsonl");
    let (json, _) = folder.expect(0, "evaluate learned.toml fresh.jsonl --report page.html --json");
    let page = folder.read("page.html");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert!(page.contains(&format!("{:.3} px", json["rms_px"].as_f64().unwrap())));
    assert!(page.contains("about as well as those that it was learned from") && !page.contains("NaN"));
    for heading in ["How well it predicts", "Cameras", "Are the errors noise?", "Where everything is"] {
        assert!(page.contains(&format!("<h2>{heading}</h2>")), "{heading} is missing");
    }
    let moved: String = folder
        .read("fresh.jsonl")
        .lines()
        .enumerate()
        .map(|(line, text)| {
            let mut sample: Value = serde_json::from_str(text).unwrap();
            let seen = if line > 0 { sample["pixels"]["left"].as_object_mut() } else { None };
            if let Some(left) = seen {
                left.values_mut().for_each(|pixel| pixel[0] = (pixel[0].as_f64().unwrap() + 5.0).into());
            }
            format!("{sample}\n")
        })
        .collect();
    folder.write("moved.jsonl", &moved);
    folder.expect(0, "evaluate learned.toml moved.jsonl --report page.html");
    let page = folder.read("page.html");
    assert!(page.contains("--relearn cameras.left") && !page.contains("--relearn cameras.right"));
    let (_, complaint) = folder.expect(2, "evaluate learned.toml moved.jsonl --report moved.jsonl");
    assert!(complaint.contains("it is an input too"), "{complaint}");
}

#[test]
fn an_evaluation_page_shows_predictions_from_the_readings_however_noisy_they_are() {
    let folder = Folder::new("report-noisy-evaluation");
    let (_, ur5) = catalog::ALL.iter().find(|(name, _)| *name == "ur5").unwrap();
    let noisy = ur5.replace("[noise]", "[noise]\njoints = 0.01");
    assert_ne!(noisy, *ur5);
    folder.write("noisy.toml", &noisy);
    folder.expect(0, "simulate noisy.toml --samples 30 --seed 2 -o fresh.jsonl");
    let (json, _) = folder.expect(0, "evaluate noisy.toml fresh.jsonl --report page.html --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    let medians = json["sample_median_px"].as_array().unwrap().iter().filter_map(Value::as_f64);
    let worst = medians.fold(0.0, f64::max);
    // Noise of 0.01 rad is many pixels, of which refined readings would leave nothing.
    assert!(worst > 3.0, "{worst}");
    assert!(folder.read("page.html").contains(&format!("<td>{worst:.3}</td>")), "{worst}");
}

#[test]
fn a_servo_run_has_a_page_that_plays_what_the_cameras_saw() {
    let folder = Folder::new("report-servo");
    let (json, _) = folder.expect(0, "servo ur5 ur5-reach --report page.html --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    let page = folder.read("page.html");
    let headings =
        ["How it ended", "What the cameras saw", "How the error fell", "How the joints moved", "What held it back"];
    for heading in headings {
        assert!(page.contains(&format!("<h2>{heading}</h2>")), "{heading} is missing");
    }
    assert!(page.contains(json["reason"].as_str().unwrap()) && !page.contains("NaN"));
    let addresses = page.matches("://").count();
    assert_eq!(addresses, page.matches("http://www.w3.org/2000/svg").count());
    // Every step of the run is a moment of the page, with the arm where its joints are.
    let (moments, scene) = (data(&page, 1), data(&page, 2));
    let steps = json["steps"].as_array().unwrap();
    assert_eq!(moments.as_array().unwrap().len(), steps.len());
    assert_eq!(scene["arms"].as_array().unwrap().len(), steps.len());
    let model = Model::new(&catalog::rig("ur5").unwrap()).unwrap();
    for (index, step) in steps.iter().enumerate() {
        let joints: Vec<f64> = step["joints"].as_array().unwrap().iter().map(|joint| joint.as_f64().unwrap()).collect();
        let tip = model.links(&joints)[6].translation;
        let drawn = &scene["arms"][index][6];
        for axis in 0..3 {
            assert!((drawn[axis].as_f64().unwrap() - tip[axis]).abs() < 1e-4, "step {index}: {drawn} {tip}");
        }
    }
    assert!(moments[0]["words"].as_str().unwrap().starts_with("step 0, 0.00 s: "));
    let (_, complaint) = folder.expect(2, "servo ur5 ur5-reach --report page.html --plot ./page.html");
    assert!(complaint.contains("two outputs"), "{complaint}");
    folder.expect(0, "servo ur5-uncalibrated --report page.html");
    assert!(folder.read("page.html").contains("<h2>How it ended</h2>"));
}

#[test]
fn the_page_of_a_task_shows_what_its_hand_and_its_target_carry() {
    let known = catalog::rig("ur5").unwrap();
    let (_, text) = handeye::scene::ALL.iter().find(|(name, _)| *name == "ur5-wrench").unwrap();
    let scene = Scene::parse(text, "ur5-wrench", Path::new(".")).unwrap();
    let run = handeye::scene::run(Some(&known), &scene, &mut |_| ControlFlow::Continue(())).unwrap();
    let world = scene.rig.as_ref().unwrap_or(&known);
    let page = servo_html(&"wrench".into(), world, true, &run).unwrap();
    let drawn = data(&page, 2);
    let names = &run.header.features;
    assert!(names.iter().all(|name| known.features.iter().all(|feature| feature.name != *name)), "{names:?}");
    let tip = |moment: &Moment| Model::new(world).unwrap().tip(&moment.joints);
    let [first, last] = [run.moments.first().unwrap(), run.moments.last().unwrap()];
    for (index, name) in names.iter().enumerate() {
        for (step, moment) in run.moments.iter().enumerate() {
            for axis in 0..3 {
                let there = drawn["features"][step][index][axis].as_f64().unwrap();
                assert!((there - moment.features[index][axis]).abs() < 1e-4, "{name}, step {step}");
            }
        }
        // What the hand carries moves with it, what the target carries stands.
        let place = &scene.task.as_ref().unwrap().features()[index].place;
        let in_tip = |moment: &Moment| tip(moment).inverse().transform(&moment.features[index]);
        let moved = match place {
            Place::Hand(_) => in_tip(first) - in_tip(last),
            _ => first.features[index] - last.features[index],
        };
        assert!(moved.norm() < 1e-9, "{name} moved by {} m", moved.norm());
    }
}
