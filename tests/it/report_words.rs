//! Pages and commands tell a reader what a page is of, when samples were taken, what moves together, how far off predictions are in space, and how
//! a recording was read.
use crate::cli::Folder;
use crate::learning::{learn, record};
use crate::report_answers::{section, shown};
use handeye::calibrate::{Combination, Influence, evaluate};
use handeye::recording::Recording;
use handeye::report::{About, Subject, evaluation_html, evaluation_steps, html, residuals};
use handeye::rig::{Model, Rig, catalog};
use serde_json::Value;

/// Rows of the tables of a section, cell by cell, their heads apart.
fn rows<'a>(section: &'a str) -> Vec<Vec<&'a str>> {
    let cell = |cell: &'a str| cell.split("</td>").next().unwrap();
    section
        .split("<tr>")
        .map(|row| row.split("<td>").skip(1).map(cell).collect())
        .filter(|row: &Vec<&str>| !row.is_empty())
        .collect()
}

/// The page of what is learned of the joints of a UR5.
fn page_of(recording: &Recording, about: About<'_>) -> (Vec<Combination>, String) {
    let before = Rig { cameras: Vec::new(), features: Vec::new(), ..catalog::rig("ur5").unwrap() };
    let calibration = learn(&before, recording).unwrap();
    let subject =
        Subject { about, before: &before, calibration: &calibration, recording, suggestion: None, tables: &[] };
    let page = html(&subject).unwrap();
    (calibration.report.weak, page)
}

#[test]
fn a_page_is_named_after_rig_and_recordings_and_says_the_command_that_made_it() {
    let folder = Folder::new("report-named");
    folder.expect(0, "simulate ur5 --samples 20 --seed 1 -o monday.jsonl");
    folder.expect(0, "simulate ur5 --samples 20 --seed 2 -o tuesday.jsonl");
    for (command, title) in [
        (
            "calibrate monday.jsonl tuesday.jsonl -o learned.toml --report page.html",
            "learned.toml, learned from monday.jsonl, tuesday.jsonl",
        ),
        ("evaluate learned.toml tuesday.jsonl --report page.html", "learned.toml on tuesday.jsonl"),
        ("servo ur5 ur5-reach --report page.html", "UR5 reaches a target in two images, with the rig ur5"),
        ("servo ur5-uncalibrated --report page.html", "UR5 servoed without a rig"),
    ] {
        folder.expect(0, command);
        let page = folder.read("page.html");
        for element in [
            format!("<title>{title}</title>"),
            format!("<h1>{title}</h1>"),
            format!("<p class=\"command\"><code>handeye {command}</code></p>"),
        ] {
            assert!(page.contains(&element), "{element}: {}", &page[..page.find("<section").unwrap()]);
        }
        folder.expect(0, command);
        assert_eq!(page, folder.read("page.html"), "{command}: the same input gives the same bytes");
    }
}

#[test]
fn names_are_shown_as_code_and_circles_over_what_they_encircle() {
    let (_, page) = page_of(&record(&catalog::rig("ur5").unwrap(), 40, 4), "a page".into());
    let shown: String = page.split("<script").map(|part| part.split("</script>").last().unwrap()).collect();
    assert!(!shown.contains('`') && shown.contains("camera <code>left</code>"));
    for drawing in section(&page, "cameras").split("<svg").skip(1) {
        let last_dot = drawing.rfind("<circle class=\"mark\"").unwrap();
        match drawing.find("<circle class=\"ring\"") {
            Some(ring) => assert!(ring > last_dot, "a scatter's circles are drawn over its dots"),
            None => assert!(drawing.rfind("class=\"arrow\"").unwrap() < drawing.find("class=\"mark\"").unwrap()),
        }
    }
}

#[test]
fn samples_are_named_with_their_times_on_pages_and_in_the_terminal() {
    let truth = catalog::rig("ur5").unwrap();
    let mut recording = record(&truth, 30, 2);
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        sample.time = Some(100.0 + 0.25 * index as f64);
    }
    // Five standard deviations: worst, and not wrong.
    recording.samples[11].pixels.iter_mut().for_each(|seen| seen.pixel[0] += 1.5);
    let folder = Folder::new("report-times");
    recording.write(&folder.path().join("motions.jsonl")).unwrap();
    let (said, _) =
        folder.expect(0, "calibrate motions.jsonl --rig ur5 -o learned.toml --influence --report page.html");
    let page = folder.read("page.html");
    let is_of_its_time = |row: &Vec<&str>| {
        let [index, time] = [row[0], row[1]].map(|cell| cell.parse::<f64>().unwrap());
        time == 100.0 + 0.25 * index
    };
    for id in ["worst", "influence"] {
        let rows = rows(section(&page, id));
        assert!(rows.len() == 10 && rows.iter().all(is_of_its_time), "{id}: {rows:?}");
        assert!(section(&page, id).contains("<th>time s</th>"));
    }
    let worst = said.split("the samples that fit worst").nth(1).unwrap().lines().nth(2).unwrap();
    let worst: Vec<&str> = worst.split_whitespace().collect();
    assert_eq!(worst[..2], ["11", "102.750"], "{said}");
    let (json, _) = folder.expect(0, "calibrate motions.jsonl --rig ur5 -o learned.toml --influence --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["influence"]["worst_fitting"][0]["time"], 102.75);
    // Without times there is no column of them.
    recording.samples.iter_mut().for_each(|sample| sample.time = None);
    recording.write(&folder.path().join("motions.jsonl")).unwrap();
    let (said, _) = folder.expect(0, "evaluate learned.toml motions.jsonl --report page.html");
    let page = folder.read("page.html");
    assert!(said.contains("sample 11 (1.") && !page.contains("time s") && rows(section(&page, "worst"))[0].len() == 4);
}

#[test]
fn without_a_sample_that_nothing_replaces_the_tip_is_without_bound() {
    let truth = catalog::rig("ur5").unwrap();
    let recording = record(&truth, 20, 3);
    let mut calibration = learn(&truth, &recording).unwrap();
    let one =
        |sample: usize, tip: f64| Influence { sample, tip: Some(tip), rms_px: 0.4, rms_points_m: 0.0, misfit: 1.0 };
    calibration.report.influence = vec![one(4, 1e-4), one(9, f64::INFINITY)];
    let subject = Subject {
        about: "open".into(),
        before: &truth,
        calibration: &calibration,
        recording: &recording,
        suggestion: None,
        tables: &[],
    };
    let page = html(&subject).unwrap();
    let rows = rows(section(&page, "influence"));
    assert_eq!([rows[0][0], rows[0][2], rows[1][0], rows[1][2]], ["9", "without bound", "4", "0.100 mm"]);
}

#[test]
fn what_moves_together_is_a_sentence_with_all_its_numbers_folded_away() {
    let (weak, page) = page_of(&record(&catalog::rig("ur5").unwrap(), 40, 4), "weak".into());
    let open = section(&page, "open");
    let items: Vec<&str> = open.split("<li>").filter(|item| item.contains("<details>")).collect();
    assert!(!weak.is_empty() && items.len() == weak.len(), "{} {}", items.len(), weak.len());
    for (one, item) in weak.iter().zip(items) {
        let (sentence, folded) = item.split_once("<details>").unwrap();
        // Three parts of at most three names or a count each, not a path among them, and what would help.
        let moves = sentence.split(": ").next().unwrap();
        assert!(moves.starts_with("The ") && moves.len() < 400, "{moves}");
        assert!(!moves.contains("robot.") && !moves.contains("cameras.") && !moves.contains("features."), "{moves}");
        // All that move by a hundredth of the largest; of the others how many there are.
        let counts = |by: f64| by.abs() >= 0.01;
        let is_told = |(path, by): &(String, f64)| !counts(*by) || folded.contains(&format!("{by:+.3} {path}"));
        assert!(one.numbers.iter().all(is_told), "{folded}");
        let rest = one.numbers.iter().filter(|(_, by)| !counts(*by)).count();
        assert_eq!(folded.contains(&format!("and {rest} that move less")), rest > 0, "{folded}");
        assert!(one.to_string().contains(&one.moves));
        // It is told once.
        assert!(!open.contains(" determines the ") && !open.contains("determine only to"));
    }
}

#[test]
fn an_evaluation_tells_how_far_off_predictions_are_in_space_at_the_depth_of_each_feature() {
    let truth = catalog::rig("ur5").unwrap();
    let fresh = record(&truth, 40, 3);
    let judged = evaluate(&truth, &fresh).unwrap();
    let model = Model::new(&truth).unwrap();
    let of_residual = |one: &handeye::report::Residual| {
        let links = model.links(fresh.samples[one.sample].joints.as_ref().unwrap());
        let [fx, fy, ..] = model.cameras[one.camera].intrinsics;
        let [du, dv] = one.error;
        (du / fx).hypot(dv / fy) * model.in_camera(one.camera, one.feature, &links).z
    };
    let mut lengths: Vec<f64> = residuals(&truth, &fresh).unwrap().iter().map(of_residual).collect();
    lengths.sort_by(f64::total_cmp);
    let share = |share: f64| lengths[(share * (lengths.len() - 1) as f64).round() as usize];
    let space = judged.space.unwrap();
    // The lenses are square; what remains is which of two neighbours a quantile takes.
    assert!((space.median_m / share(0.5) - 1.0).abs() < 0.01, "{space:?} {}", share(0.5));
    assert!((space.p95_m / share(0.95) - 1.0).abs() < 0.01, "{space:?} {}", share(0.95));
    let figures = [space.median_m, space.p95_m].map(|length| format!("{:.3} mm", 1e3 * length));
    let page = evaluation_html(&"space".into(), &truth, &fresh, &judged).unwrap();
    let folder = Folder::new("report-space");
    fresh.write(&folder.path().join("fresh.jsonl")).unwrap();
    let (said, _) = folder.expect(0, "evaluate ur5 fresh.jsonl");
    for figure in figures {
        assert!(section(&page, "summary").contains(&figure) && said.contains(&figure), "{figure}: {said}");
    }
    // Of lengths in units of one of the arm's own nothing is said in millimetres.
    let learned = learn(&Rig { noise: truth.noise, ..Rig::default() }, &record(&truth, 40, 4)).unwrap();
    assert_eq!(evaluate(&learned.rig, &fresh).unwrap().space, None);
}

#[test]
fn an_evaluation_on_what_was_learned_from_says_that_it_is_one() {
    let truth = catalog::rig("ur5").unwrap();
    let mut recording = record(&truth, 40, 1);
    let learned = learn(&truth, &recording).unwrap().rig;
    let folder = Folder::new("report-own");
    // As the file has it.
    learned.write(&folder.path().join("learned.toml"), None).unwrap();
    let learned = Rig::read(&folder.path().join("learned.toml")).unwrap();
    let steps = |recording: &Recording| evaluation_steps(&learned, &evaluate(&learned, recording).unwrap()).join("\n");
    let (own, fresh) = ("The rig was learned from this recording", "nothing needs to be done");
    let said = steps(&recording);
    assert!(said.contains(own) && !said.contains(fresh), "{said}");
    let page = evaluation_html(&"own".into(), &learned, &recording, &evaluate(&learned, &recording).unwrap()).unwrap();
    assert!(section(&page, "summary").contains(own) && section(&page, "next").contains(own));
    // Other motions of the same rig are not taken for it, nor as many detections of readings that are a hair off.
    let other = steps(&record(&truth, 40, 2));
    assert!(!other.contains(own) && other.contains(fresh), "{other}");
    // It is said too where there is more to say.
    let mut spoilt = recording.clone();
    spoilt.samples[7].joints = spoilt.samples[8].joints.clone();
    let said = steps(&spoilt);
    assert!(said.contains(own) && said.contains("mistakes of the recording"), "{said}");
    recording.samples.iter_mut().flat_map(|sample| sample.joints.iter_mut().flatten()).for_each(|joint| *joint += 1e-9);
    assert!(!steps(&recording).contains(own));
}

#[test]
fn a_page_tells_how_its_recording_was_read_and_what_repeats_in_it() {
    let truth = catalog::rig("ur5").unwrap();
    let mut recording = record(&truth, 40, 1);
    // Beside the arm's joints there is a gripper's, and the first position is taken a dozen times.
    recording.joints.push("gripper".into());
    recording.samples.iter_mut().for_each(|sample| sample.joints.as_mut().unwrap().push(0.5));
    let first = recording.samples[0].clone();
    for sample in &mut recording.samples[1..12] {
        (sample.joints, sample.pixels) = (first.joints.clone(), first.pixels.clone());
    }
    let folder = Folder::new("report-reading");
    recording.write(&folder.path().join("motions.jsonl")).unwrap();
    for command in [
        "calibrate motions.jsonl --rig ur5 -o learned.toml --report page.html",
        "evaluate ur5 motions.jsonl --report page.html",
    ] {
        let (_, remarks) = folder.expect(0, command);
        let page = folder.read("page.html");
        let reading = section(&page, "reading");
        let notes: Vec<&str> = remarks.lines().filter_map(|line| line.strip_prefix("note: ")).collect();
        assert!(notes.iter().any(|note| note.contains("gripper")), "{remarks}");
        let (json, _) = folder.expect(0, &format!("{command} --json"));
        assert_eq!(serde_json::from_str::<Value>(&json).unwrap()["notes"], serde_json::json!(notes));
        assert!(notes.iter().all(|note| reading.contains(&shown(note))), "{notes:?}: {reading}");
        assert!(reading.contains("11 of 40 samples repeat the robot's state of an earlier one"), "{reading}");
    }
}
