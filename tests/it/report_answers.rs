//! Pages answer in words: how good a rig is, what hangs on assumptions, what was left out, and what to do next.
use crate::cli::Folder;
use handeye::calibrate::{Calibration, Options, assumptions, calibrate, evaluate};
use handeye::recording::{Detection, RecordedCamera, Recording};
use handeye::report::{Subject, evaluation_steps, html};
use handeye::rig::{Rig, Robot, catalog};
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use handeye::solvers::Pose;
use nalgebra::Vector3;
use serde_json::Value;
use std::ops::ControlFlow;

/// A section of a page, by its id; empty where there is none.
pub fn section<'a>(page: &'a str, id: &str) -> &'a str {
    let from = page.split(&format!("<section id=\"{id}\">")).nth(1).unwrap_or_default();
    from.split("</section>").next().unwrap_or_default()
}

/// Words as a page has them: what stands between backticks is code.
pub fn shown(words: &str) -> String {
    let mut parts = words.split('`');
    let first = parts.next().unwrap().to_owned();
    let tags = ["<code>", "</code>"].into_iter().cycle();
    first + &tags.zip(parts).map(|(tag, part)| format!("{tag}{part}")).collect::<String>()
}

/// A UR5 of which nothing but the joints is known, 0.3 px of noise, readings of two samples exchanged and one image of another moment.
fn spoilt() -> (Rig, Recording) {
    let truth = catalog::rig("ur5").unwrap();
    let mut recording =
        simulate(&truth, &SimulateOptions { samples: 40, seed: 4, ..SimulateOptions::default() }).unwrap().recording;
    let joints = |sample: usize| recording.samples[sample].joints.clone();
    let (fourth, ninth) = (joints(4), joints(9));
    (recording.samples[4].joints, recording.samples[9].joints) = (ninth, fourth);
    let is_left = |seen: &Detection| seen.camera == 0;
    let other: Vec<Detection> = recording.samples[30].pixels.iter().copied().filter(is_left).collect();
    recording.samples[12].pixels.retain(|seen| !is_left(seen));
    recording.samples[12].pixels.extend(other);
    for (recorded, camera) in recording.cameras.iter_mut().zip(&truth.cameras) {
        *recorded = RecordedCamera::from(camera);
    }
    let known = Rig { cameras: Vec::new(), features: Vec::new(), ..truth };
    (known, recording)
}

/// What is learned from a recording, and its page.
fn learned(before: &Rig, recording: &Recording) -> (Calibration, String) {
    let calibration = calibrate(before, recording, &Options::default(), &mut |_| ControlFlow::Continue(())).unwrap();
    let subject =
        Subject { about: "spoilt".into(), before, calibration: &calibration, recording, suggestion: None, tables: &[] };
    let page = html(&subject).unwrap();
    (calibration, page)
}

#[test]
fn a_page_answers_first_whether_the_fit_is_good_how_well_the_tip_is_known_and_what_to_do() {
    let (known, recording) = spoilt();
    let (learned, page) = learned(&known, &recording);
    assert!(page.find("<section id=\"verdict\">") < page.find("<section id=\"summary\">"));
    let verdict = section(&page, "verdict");
    let report = &learned.report;
    let pixels = known.noise.pixels;
    for words in [
        format!(
            "{:.3} px rms, where noise of {pixels} px a coordinate gives {:.3} px",
            report.rms_px,
            pixels * 2f64.sqrt()
        ),
        format!("{} of {} detections", report.rejected, report.rejected + report.observations),
        "among them 2 whole samples and 1 whole image".to_owned(),
        "What to do next: ".to_owned(),
    ] {
        assert!(verdict.contains(&words), "{words}: {verdict}");
    }
    // Scale is known from the joints' lengths alone, 10 mm each.
    let tip = report.tip.unwrap();
    assert!(tip.metric && tip.hangs_on_priors() && tip.median > 0.003 && tip.by_data < 0.001, "{tip:?}");
    for place in [verdict, section(&page, "summary")] {
        let figures = [tip.by_data, tip.median].map(|length| format!("{:.3} mm", 1e3 * length));
        assert!(figures.iter().all(|figure| place.contains(figure)), "{figures:?}: {place}");
    }
    assert!(verdict.contains("±10 mm on each of the ") && verdict.contains("±0.02 rad on each of the "), "{verdict}");
    let summary = section(&page, "summary");
    assert_eq!(summary.matches("left out").count(), 5, "the figure, the heading and three findings: {summary}");
    for camera in ["left", "right"] {
        let against_arm = format!("camera <code>{camera}</code>: ");
        assert!(summary.contains(&against_arm), "{camera}: {summary}");
    }
}

#[test]
fn a_page_shows_where_numbers_started_and_which_are_assumed() {
    let (known, recording) = spoilt();
    let (_, page) = learned(&known, &recording);
    let row =
        |path: &str| page.split(&format!("<td>{path}</td>")).nth(1).unwrap().split("</tr>").next().unwrap().to_owned();
    let start = format!("<td>{:.2}</td>", recording.cameras[0].fx.unwrap());
    assert!(row("cameras.left.fx").starts_with(&start), "{start}: {}", row("cameras.left.fx"));
    // Where the last frame lies on its axis is seen by nothing; how long the upper arm is, is.
    let joints = &known.robot.joints;
    let last = row(&format!("robot.joints.{}.d", joints[5].name));
    assert!(last.contains("1.0e-2 (assumed)"), "{last}");
    assert!(!row(&format!("robot.joints.{}.a", joints[1].name)).contains("assumed"));
}

#[test]
fn a_page_says_in_words_whether_the_errors_are_noise() {
    let (known, mut recording) = spoilt();
    let answer = |recording: &Recording| {
        let (learned, page) = learned(&known, recording);
        let is_said_first = section(&page, "verdict").contains("The errors are not noise alone");
        assert_eq!(is_said_first, section(&page, "histogram").contains("<p>No: "));
        (section(&page, "histogram").to_owned(), learned.report.rejected)
    };
    let (noise, rejected) = answer(&recording);
    assert!(noise.contains("<p>Yes: "), "{noise}");
    assert!(
        noise.contains(&format!("The {rejected} detections that do not fit are not counted.")),
        "{rejected}: {noise}"
    );
    // Every image is shifted by 1 px, this way or that: three standard deviations of its noise.
    for (number, sample) in recording.samples.iter_mut().enumerate() {
        for seen in &mut sample.pixels {
            let angle = 2.4 * (2 * number + seen.camera as usize) as f64;
            (seen.pixel[0], seen.pixel[1]) = (seen.pixel[0] + angle.cos(), seen.pixel[1] + angle.sin());
        }
    }
    let (shifted, _) = answer(&recording);
    assert!(shifted.contains("<p>No: ") && shifted.contains("Whole images are shifted"), "{shifted}");
}

#[test]
fn an_evaluation_tells_the_error_with_and_without_what_does_not_fit_and_names_it() {
    let folder = Folder::new("report-fitting");
    folder.expect(0, "simulate ur5 --samples 40 --seed 1 -o motions.jsonl");
    folder.expect(0, "calibrate motions.jsonl -o learned.toml");
    folder.expect(0, "simulate ur5 --samples 30 --seed 2 -o fresh.jsonl");
    let json = |arguments: &str| -> Value { serde_json::from_str(&folder.expect(0, arguments).0).unwrap() };
    let clean = json("evaluate learned.toml fresh.jsonl --json");
    assert_eq!(clean["findings"], serde_json::json!([]));
    assert_eq!(clean["without_what_does_not_fit"]["rms_px"], clean["rms_px"]);
    // Line 0 is the header.
    let text = folder.read("fresh.jsonl");
    let mut lines: Vec<Value> = text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let (fourth, ninth) = (lines[5]["joints"].clone(), lines[10]["joints"].clone());
    (lines[5]["joints"], lines[10]["joints"]) = (ninth, fourth);
    lines[13]["pixels"]["left"] = lines[21]["pixels"]["left"].clone();
    folder.write("spoilt.jsonl", &lines.iter().map(|line| format!("{line}\n")).collect::<String>());
    let spoilt = json("evaluate learned.toml spoilt.jsonl --report page.html --json");
    let named = |finding: &Value| (finding["kind"].clone(), finding["sample"].clone(), finding["swapped_with"].clone());
    let found: Vec<_> = spoilt["findings"].as_array().unwrap().iter().map(named).collect();
    let expected = [("wrong_joints", 4, Some(9)), ("wrong_joints", 9, Some(4)), ("wrong_image", 12, None)];
    let expected = expected.map(|(kind, sample, other)| (kind.into(), sample.into(), serde_json::json!(other)));
    assert_eq!(found, expected, "{spoilt}");
    let [all, fitting, usual] = [&spoilt["rms_px"], &spoilt["without_what_does_not_fit"]["rms_px"], &clean["rms_px"]]
        .map(|px| px.as_f64().unwrap());
    // Three of thirty samples are gone: the rest has the error that it had, but for the chance of which these are.
    assert!(all > 10.0 * usual && (fitting / usual - 1.0).abs() < 0.1, "{all} {fitting} {usual}");
    let (said, _) = folder.expect(0, "evaluate learned.toml spoilt.jsonl");
    let page = folder.read("page.html");
    for words in [
        "sample 12: the image of camera `left` belongs to another pose",
        "mistakes of the recording rather than of the rig",
        "Without what does not fit, it predicts these samples about as well",
    ] {
        assert!(said.contains(words) && page.contains(&shown(words)), "{words}: {said}");
    }
    assert!(said.contains("without what does not fit, as calibrate leaves it out:"), "{said}");
}

#[test]
fn a_camera_that_was_always_worse_than_the_others_is_not_said_to_be_off() {
    let truth = random_rig(6, 4, 12, 2);
    let record = |seed: u64| {
        let options = SimulateOptions { samples: 40, seed, ..SimulateOptions::default() };
        let mut recording = simulate(&truth, &options).unwrap().recording;
        // Five times the noise of 0.3 px, by turns in four directions: one camera of four then has about twice the error of all together.
        for (number, seen) in recording.samples.iter_mut().flat_map(|sample| &mut sample.pixels).enumerate() {
            if seen.camera == 0 {
                seen.pixel[number % 2] += if number % 4 < 2 { 1.5 } else { -1.5 };
            }
        }
        recording
    };
    let (learned, _) = learned(&truth, &record(2));
    let judged = evaluate(&learned.rig, &record(3)).unwrap();
    let of_camera = judged.fitting.cameras[0].errors.rms_px / judged.fitting.total.rms_px;
    assert!(of_camera > 1.5, "{of_camera}");
    let steps = evaluation_steps(&learned.rig, &judged);
    assert!(steps[0].contains("about as well as those that it was learned from"), "{steps:?}");
}

fn only_size(camera: &RecordedCamera) -> RecordedCamera {
    RecordedCamera { name: camera.name.clone(), size: camera.size, ..RecordedCamera::default() }
}

#[test]
fn a_verdict_says_what_was_assumed_and_what_is_least_known_and_no_more() {
    let truth = catalog::rig("ur5").unwrap();
    let recording =
        simulate(&truth, &SimulateOptions { samples: 40, seed: 4, ..SimulateOptions::default() }).unwrap().recording;
    let (calibration, page) = learned(&truth, &recording);
    let verdict = section(&page, "verdict");
    assert!(calibration.report.tip.unwrap().hangs_on_priors());
    // The world is where its cameras are, which the rig gives to 100 mm each.
    assert!(
        verdict.contains("camera") && !verdict.contains("scale") && !verdict.contains("frames of base"),
        "{verdict}"
    );
    for words in
        ["±3 % on each of the 4 focal lengths", "±2 % of the image on each of the 4 coordinates of image centres"]
    {
        assert!(verdict.contains(words), "{words}: {verdict}");
    }
    let mut stated = Rig { robot: Robot { base: Some(Pose::identity()), ..truth.robot.clone() }, ..truth.clone() };
    let priors = [("robot", 0.01), ("cameras.*.fx", 5.0), ("features", 0.002)];
    stated.estimate.prior = priors.map(|(path, sd)| (path.to_owned(), sd)).into();
    let said = assumptions(&stated, &recording).join(", ");
    for words in
        ["±0.01 m and rad on robot ", "±5 px on cameras.*.fx ", "±0.002 m on features ", "of the 2 focal lengths"]
    {
        assert!(said.contains(words), "{words}: {said}");
    }
    stated.estimate.prior.clear();
    let said = assumptions(&stated, &recording);
    assert!(said[0].starts_with("±10 mm and ±0.02 rad on the pose of the base"), "{said:?}");
    let sizes = Recording { cameras: recording.cameras.iter().map(only_size).collect(), ..recording.clone() };
    let unsaid = assumptions(&Rig::default(), &sizes);
    assert!(unsaid.iter().any(|one| one == "±50 % on each of the 4 focal lengths that are guessed"), "{unsaid:?}");
    // A lens of the recording's header is assumed as one of the rig.
    let no_lens = Rig { cameras: Vec::new(), ..truth };
    let mut headed = recording.clone();
    headed
        .cameras
        .iter_mut()
        .zip(&stated.cameras)
        .for_each(|(recorded, camera)| *recorded = RecordedCamera::from(camera));
    assert!(assumptions(&no_lens, &headed).iter().any(|one| one.contains("4 focal lengths")));
    assert!(
        !assumptions(&no_lens, &Recording { cameras: Vec::new(), ..recording }).iter().any(|one| one.contains("focal"))
    );
}

#[test]
fn where_nothing_is_metric_no_length_has_a_unit() {
    let truth = random_rig(6, 2, 12, 3);
    let recording = simulate(&truth, &SimulateOptions { samples: 40, ..SimulateOptions::default() }).unwrap().recording;
    let unknown = Rig { noise: truth.noise, ..Rig::default() };
    let (calibration, page) = learned(&unknown, &recording);
    let (verdict, summary) = (section(&page, "verdict"), section(&page, "summary"));
    let tip = calibration.report.tip.unwrap();
    assert!(!calibration.report.metric && !tip.metric);
    assert!(verdict.contains(&format!("The tip's position is known to {tip}")), "{verdict}");
    assert!(summary.contains("camera <code>") && summary.contains("in the model's unit"), "{summary}");
    assert!(!verdict.contains(" mm") && !summary.contains(" mm"), "{verdict}{summary}");
}

#[test]
fn noise_is_told_to_the_digits_that_count() {
    let (mut known, recording) = spoilt();
    known.noise.pixels = 0.312_345_678_9;
    let (_, page) = learned(&known, &recording);
    assert!(section(&page, "verdict").contains("where noise of 0.312 px a coordinate gives 0.442 px"));
}

#[test]
fn a_number_is_called_held_only_where_it_was() {
    let truth = random_rig(6, 3, 12, 1);
    let record = |rig: &Rig, samples, seed| {
        simulate(rig, &SimulateOptions { samples, seed, ..SimulateOptions::default() }).unwrap().recording
    };
    let mut moved = truth.clone();
    let turn = Pose::new(Vector3::new(0.0, 0.03, 0.0), Vector3::new(0.02, 0.0, 0.0));
    moved.cameras[1].pose = truth.cameras[1].pose.map(|pose| pose * turn);
    let mut recording = record(&truth, 40, 1);
    recording.samples.extend(record(&moved, 10, 2).samples);
    let mut known = truth.clone();
    known.estimate.fixed = vec!["cameras.*.cx".to_owned()];
    let (_, page) = learned(&known, &recording);
    let last = |path: &str| {
        let row = page.split(&format!("<td>{path}</td>")).nth(1).unwrap().split("</tr>").next().unwrap();
        row.rsplit("<td>").next().unwrap().trim_end_matches("</td>").to_owned()
    };
    let names: Vec<&str> = truth.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(last(&format!("cameras.{}.cx", names[0])), "held");
    // It was placed by itself, and nothing is said of how well.
    assert_eq!(last(&format!("cameras.{}.pose", names[1])), "not known");
    assert!(last(&format!("cameras.{}.pose", names[2])).contains("e-"));
}
