//! `handeye infer`: JSON Lines of joints and poses, and clear refusals.
use crate::cli::Folder;
use crate::infer::wrap;
use serde_json::Value;

fn lines(text: &str) -> Vec<Value> {
    text.lines().map(|line| serde_json::from_str(line).unwrap()).collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|number| number.as_f64().unwrap()).collect()
}

#[test]
fn a_recording_s_joints_are_inferred_with_a_rig_that_was_learned_from_nothing() {
    let folder = Folder::new("infer");
    folder.expect(0, "simulate ur5 --samples 50 --seed 1 -o motions.jsonl");
    folder.expect(0, "simulate ur5 --samples 20 --seed 2 -o fresh.jsonl --truth truth.jsonl");
    folder.expect(0, "calibrate motions.jsonl -o learned.toml");
    let (text, _) = folder.expect(0, "infer learned.toml fresh.jsonl");
    let (inferred, truth) = (lines(&text), lines(&folder.read("truth.jsonl")));
    assert_eq!(inferred.len(), 20);
    let mut near = 0;
    for (line, truth) in inferred.iter().zip(&truth[1..]) {
        assert_eq!(line["time"], truth["time"]);
        assert!(line["rms_px"].as_f64().unwrap() < 0.8 && line["probability"].as_f64().unwrap() > 0.3, "{line}");
        assert_eq!(numbers(&line["pose"]["quat"]).len() + numbers(&line["pose"]["xyz"]).len(), 7);
        let (joints, sd) = (numbers(&line["joints"]), numbers(&line["sd"]));
        let off = joints.iter().zip(numbers(&truth["joints"])).map(|(a, b)| wrap(a - b).abs());
        // The rig's own errors are not in the deviations.
        near += usize::from(off.zip(sd).all(|(off, sd)| off < 6.0 * sd + 0.01));
    }
    // Near singularities two branches may be as good, and the wrong one more probable.
    assert!(near >= 18, "{near} of 20 are where they were");
    let (json, _) = folder.expect(0, "infer learned.toml fresh.jsonl --json");
    let json: Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["inferred"].as_array().unwrap(), &inferred);
    assert_eq!((&json["samples"], &json["failed"]), (&Value::from(20), &Value::from(0)));
}

/// The UR5 with joint limits of a whole turn to either side, and noise of actions.
fn turning(folder: &Folder) {
    let text = include_str!("../../models/ur5.toml");
    let limits = "limits = { lower = -6.3, upper = 6.3 }";
    let lines = text.lines().map(|line| if line.starts_with("limits") { limits } else { line });
    let text = lines.collect::<Vec<_>>().join("\n");
    folder.write("turning.toml", &text);
    let noise = "pixels = 0.3\njoints = 0.02\njoint_action = 0.01";
    folder.write("noisy.toml", &include_str!("../../models/ur5.toml").replace("pixels = 0.3", noise));
    folder.write("turning-noisy.toml", &text.replace("pixels = 0.3", noise));
}

#[test]
fn branches_are_listed_and_told_apart_by_actions_or_readings() {
    let folder = Folder::new("infer-branches");
    turning(&folder);
    folder.expect(0, "simulate noisy.toml --samples 10 --seed 4 -o acted.jsonl --truth truth.jsonl");
    let truth = lines(&folder.read("truth.jsonl"));
    let right = |text: &str| -> usize {
        let near = |(line, truth): (&Value, &Value)| {
            let pairs = numbers(&line["joints"]).into_iter().zip(numbers(&truth["joints"]));
            pairs.into_iter().all(|(a, b)| wrap(a - b).abs() < 0.1)
        };
        lines(text).iter().zip(&truth[1..]).filter(|pair| near(*pair)).count()
    };
    let (alone, _) = folder.expect(0, "infer turning-noisy.toml acted.jsonl");
    assert!(lines(&alone).iter().all(|line| line["branches"].as_array().is_some_and(|branches| branches.len() >= 3)));
    let (acted, _) = folder.expect(0, "infer turning-noisy.toml acted.jsonl --actions");
    assert!(right(&alone) <= 6 && right(&acted) >= 9, "{} alone, {} with actions", right(&alone), right(&acted));
    let (read, _) = folder.expect(0, "infer turning-noisy.toml acted.jsonl --readings");
    assert_eq!(right(&read), 10);
    assert!(lines(&read).iter().all(|line| line["probability"].as_f64().unwrap() > 0.999));
}

#[test]
fn what_cannot_be_inferred_is_said_in_its_line_or_refused() {
    let folder = Folder::new("infer-refusals");
    turning(&folder);
    let header = r#"{"format":"handeye-recording","version":1,"joints":["a","b","c","d","e","f"],"cameras":{"left":{"size":[640,480]}}}"#;
    let seen = r#"{"time":1.5,"pixels":{"left":{"f0":[300.0,200.0]}}}"#;
    let blind = r#"{"time":2.5,"pixels":{"left":{"stranger":[300.0,200.0]}}}"#;
    folder.write("some.jsonl", &format!("{header}\n{seen}\n{blind}\n"));
    folder.write("blind.jsonl", &format!("{header}\n{blind}\n"));
    let (text, _) = folder.expect(0, "infer ur5 some.jsonl");
    let found = lines(&text);
    assert_eq!(found[0]["open"].as_array().unwrap().len(), 4, "{text}");
    assert_eq!(found[1]["time"], 2.5);
    assert!(found[1]["error"].as_str().unwrap().contains("nothing that the joints move was seen"), "{text}");
    assert!(found[1].get("joints").is_none());
    let (_, complaint) = folder.expect(1, "infer ur5 blind.jsonl");
    assert!(complaint.contains("nothing was inferred from 1 sample"), "{complaint}");
    let (_, complaint) = folder.expect(2, "infer ur5 some.jsonl --readings");
    assert!(complaint.contains("ur5: --readings needs the noise of the joint readings"), "{complaint}");
    let (_, complaint) = folder.expect(2, "infer ur5 some.jsonl --actions");
    assert!(complaint.contains("--actions needs samples with `joint_action`"), "{complaint}");
    let (_, complaint) = folder.expect(2, "infer panda some.jsonl");
    assert!(complaint.contains("the recording has 6 joints, the rig panda has 7, under other names"), "{complaint}");
    folder.write("partial.toml", "[[cameras]]\nname = \"left\"\nfx = 600.0\n");
    let (_, complaint) = folder.expect(2, "infer partial.toml some.jsonl");
    assert!(complaint.contains("the rig is not complete") && complaint.contains("cameras.left.pose"), "{complaint}");
}
