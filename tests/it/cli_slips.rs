//! Slips on the command line are answered with what was meant.
use crate::cli::Folder;
use handeye::recording::Recording;

#[test]
fn a_name_that_is_not_shipped_is_told_with_the_nearest_and_all() {
    let folder = Folder::new("slips-names");
    folder.write("rec.jsonl", "");
    for (arguments, expected) in [
        ("check ur3", "error: ur3: neither a rig file nor a shipped rig (did you mean `ur3e`? known: ur5, ur3e, "),
        ("check ur3e.toml", "error: ur3e.toml: neither a rig file nor a shipped rig (did you mean `ur3e`? known: "),
        ("check hexapod.toml", "error: hexapod.toml: neither a rig file nor a shipped rig (known: ur5, "),
        ("calibrate rec.jsonl --rig ur3 -o x.toml", "error: ur3: neither a rig file nor a shipped rig (did you mean"),
        (
            "servo ur5 ur5-reech",
            "error: ur5-reech: neither a scene file nor a shipped scene (did you mean `ur5-reach`? ",
        ),
        ("task wrnch", "error: wrnch: neither a task file nor a shipped task (did you mean `wrench`? known: wrench, "),
    ] {
        let (_, err) = folder.expect(2, arguments);
        assert!(err.starts_with(expected), "handeye {arguments}: {err}");
    }
}

#[test]
fn a_folder_that_is_missing_is_named() {
    let folder = Folder::new("slips-folder");
    for arguments in ["simulate ur5 -o absent/rec.jsonl", "export ur5 --to tf -o absent/rec.jsonl"] {
        let (_, err) = folder.expect(2, arguments);
        assert_eq!(err, "error: absent/rec.jsonl: there is no folder `absent`\n", "handeye {arguments}");
    }
}

#[test]
fn a_recording_in_the_place_of_the_rig_is_told_with_the_right_order() {
    let folder = Folder::new("slips-order");
    folder.expect(0, "simulate ur5 --samples 3 -o rec.jsonl");
    for name in ["bag.mcap", "table.csv", "table.parquet"] {
        folder.write(name, "\u{0}");
    }
    for recording in ["rec.jsonl", "bag.mcap", "table.csv", "table.parquet"] {
        for command in ["check", "evaluate", "infer", "monitor"] {
            let (_, err) = folder.expect(2, &format!("{command} {recording} ur5"));
            let expected = format!(
                "error: {recording}: that is a recording, and a rig is expected here; the rig comes first: handeye check RIG RECORDING"
            );
            assert!(err.starts_with(&expected), "{command}: {err}");
        }
    }
    folder.write("arm.toml", "name = \"arm\"\n");
    let (_, err) = folder.expect(2, "calibrate arm.toml --rig ur5 -o x.toml");
    assert_eq!(err, "error: arm.toml: that is a rig file, and a recording is expected here\n");
}

#[test]
fn joints_in_another_order_than_the_rigs_are_taken_by_their_names() {
    let folder = Folder::new("slips-joints");
    folder.expect(0, "simulate ur5 --samples 6 --seed 2 -o rec.jsonl");
    let mut recording = Recording::read(&folder.path().join("rec.jsonl")).unwrap();
    recording.joints.rotate_left(2);
    for sample in &mut recording.samples {
        for row in [&mut sample.joints, &mut sample.joint_action].into_iter().flatten() {
            row.rotate_left(2);
        }
    }
    recording.write(&folder.path().join("rotated.jsonl")).unwrap();
    let (expected, _) = folder.expect(0, "evaluate ur5 rec.jsonl");
    let (found, err) = folder.expect(0, "evaluate ur5 rotated.jsonl");
    assert_eq!(found, expected);
    assert!(
        err.starts_with("note: rotated.jsonl: joints are taken by their names, in the order of the rig: "),
        "{err}"
    );
    for command in ["infer ur5", "monitor ur5"] {
        let told = |file: &str| folder.expect(0, &format!("{command} {file}.jsonl")).0;
        assert_eq!(told("rotated"), told("rec"), "{command}");
    }
    let (text, _) = folder.expect(0, "check ur5 rotated.jsonl");
    let [order, rest] = ["joints are taken by their names", "median misfit"].map(|words| text.find(words).unwrap());
    assert!(order < rest && text.contains("as recorded it fits"), "{text}");
}

#[test]
fn every_command_that_reads_recordings_takes_the_options_of_reading() {
    let folder = Folder::new("slips-reading");
    folder.expect(0, "simulate ur5 --samples 3 -o rec.jsonl");
    for command in [
        "calibrate rec.jsonl -o x.toml",
        "check ur5 rec.jsonl",
        "evaluate ur5 rec.jsonl",
        "monitor ur5 rec.jsonl",
        "suggest ur5 --with rec.jsonl",
    ] {
        let (_, err) = folder.expect(2, &format!("{command} --joint-topic /left/joint_states"));
        assert_eq!(err, "error: rec.jsonl is a recording, where --joint-topic has no effect\n", "{command}");
    }
    // What they say is heeded.
    folder.write("one.toml", "[[robot.joints]]\nname = \"a\"\noffset = 0\nd = 0.1\na = 0.3\nalpha = 0\n");
    folder.write("table.csv", "time,joints.a,left.f0.u,left.f0.v\n0,5,10,20\n1,6,12,20\n");
    let largest = |options: &str| {
        let (json, _) = folder.expect(0, &format!("check one.toml table.csv --camera left=640x480 --json {options}"));
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        json["recording"]["joints"]["a"]["max"].as_f64().unwrap()
    };
    assert!((largest("") - 6.0).abs() < 1e-12);
    assert!((largest("--degrees") - 6_f64.to_radians()).abs() < 1e-12);
}
