//! Slips on the command line are answered with what was meant.
use crate::cli::Folder;
use handeye::recording::Recording;

#[test]
fn a_name_that_is_not_shipped_is_told_with_the_nearest_and_all() {
    let folder = Folder::new("slips-names");
    folder.write("rec.jsonl", "");
    for (arguments, expected) in [
        ("check ur3", "error: ur3: neither a rig file nor a shipped rig (did you mean `ur3e`? known: ur5, ur5_arm, "),
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
                "error: {recording}: that is a recording, and a rig is expected here: handeye calibrate RECORDING --rig RIG, but handeye check RIG RECORDING"
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
        err.starts_with("note: rotated.jsonl: joints are taken by their names, in the order shoulder_pan, "),
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

/// A recording of the UR5 as CSV: joints in degrees or radians, and pixels.
fn csv(recording: &Recording, to_unit: fn(f64) -> f64) -> String {
    let joints = recording.joints.iter().map(|joint| format!("joints.{joint}"));
    let pixels = recording.samples[0].pixels.iter().flat_map(|seen| {
        let (camera, feature) =
            (&recording.cameras[seen.camera as usize].name, &recording.features[seen.feature as usize]);
        ["u", "v"].map(|axis| format!("{camera}.{feature}.{axis}"))
    });
    let mut text = joints.chain(pixels).collect::<Vec<_>>().join(",");
    for sample in &recording.samples {
        let joints = sample.joints.as_ref().unwrap().iter().map(|joint| to_unit(*joint));
        let numbers = joints.chain(sample.pixels.iter().flat_map(|seen| seen.pixel));
        text += &format!("\n{}", numbers.map(|number| format!("{number:?}")).collect::<Vec<_>>().join(","));
    }
    text
}

const READERS: [&str; 6] = [
    "calibrate FILE --rig ur5 -o x.toml",
    "check ur5 FILE",
    "evaluate ur5 FILE",
    "infer ur5 FILE",
    "monitor ur5 FILE",
    "suggest x.toml --count 1 --rig ur5 --with FILE",
];

#[test]
fn every_command_that_reads_recordings_takes_the_options_of_reading() {
    let folder = Folder::new("slips-reading");
    folder.expect(0, "simulate ur5 --samples 8 --in-view 1 --seed 4 -o rec.jsonl");
    folder.expect(0, "calibrate rec.jsonl --rig ur5 -o x.toml");
    for command in READERS {
        let (_, err) =
            folder.expect(2, &format!("{} --joint-topic /left/joint_states", command.replace("FILE", "rec.jsonl")));
        assert_eq!(err, "error: rec.jsonl is a recording, where --joint-topic has no effect\n", "{command}");
    }
    // What they say is heeded: in degrees as they are said to be, the numbers are those of the recording in radians.
    let recording = Recording::read(&folder.path().join("rec.jsonl")).unwrap();
    folder
        .write("radians.csv", &csv(&recording, |joint| joint))
        .write("degrees.csv", &csv(&recording, f64::to_degrees));
    let sizes = recording.cameras.iter().map(|camera| {
        let [width, height] = camera.size.unwrap();
        format!("--camera {}={width}x{height}", camera.name)
    });
    let sizes = sizes.collect::<Vec<_>>().join(" ");
    let maximum = |file: &str, option: &str| {
        let (json, _) = folder.expect(0, &format!("check ur5 {file} {sizes} {option} --json"));
        let json: serde_json::Value = serde_json::from_str(&json).unwrap();
        json["recording"]["joints"]["elbow"]["max"].as_f64().unwrap()
    };
    assert!((maximum("radians.csv", "--radians") - maximum("degrees.csv", "--degrees")).abs() < 1e-12);
    for command in READERS.iter().filter(|command| !command.starts_with("check")) {
        let (_, err) = folder.expect(2, &format!("{} --degrees=no_joint", command.replace("FILE", "degrees.csv")));
        assert!(err.contains("degrees.csv: there is no joint `no_joint` to take for degrees"), "{command}: {err}");
        folder.expect(0, &format!("{} {sizes} --degrees", command.replace("FILE", "degrees.csv")));
    }
}

#[test]
fn options_of_reading_are_refused_where_nothing_is_read() {
    let folder = Folder::new("slips-nothing-read");
    for command in ["check ur5", "suggest ur5"] {
        for option in [
            "--camera left=8x6",
            "--joints a",
            "--join 0.1",
            "--degrees",
            "--actions targets",
            "--joint-topic /joint_states",
        ] {
            let (_, err) = folder.expect(2, &format!("{command} {option}"));
            let name = option.split(' ').next().unwrap();
            assert_eq!(err, format!("error: no recording is read, where {name} has no effect\n"), "{command}");
        }
    }
}

/// Whatever a command reads, it writes over none of it: files that the rig names and the lenses of `--camera` among it.
#[test]
fn no_file_that_is_read_is_written_over() {
    let folder = Folder::new("slips-written-over");
    let lens = "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n\
                camera_matrix: { rows: 3, cols: 3, data: [600, 0, 319.5, 0, 600, 239.5, 0, 0, 1] }\n\
                distortion_coefficients: { rows: 1, cols: 5, data: [0, 0, 0, 0, 0] }\n";
    folder.write("left.yaml", lens).write("right.yaml", lens);
    let mut rig = handeye::rig::catalog::rig("ur5").unwrap();
    let left = &mut rig.cameras[0];
    (left.size, left.model, left.distortion) = (None, None, None);
    (left.fx, left.fy, left.cx, left.cy) = (None, None, None, None);
    let named = "name = \"left\"\n";
    folder.write("rig.toml", &rig.to_toml().replace(named, &format!("{named}intrinsics = \"left.yaml\"\n")));
    folder.expect(0, "simulate rig.toml -o motions.jsonl");
    for command in [
        "simulate rig.toml -o left.yaml",
        "simulate rig.toml -o new.jsonl --truth left.yaml",
        "calibrate motions.jsonl --rig rig.toml -o left.yaml",
        "calibrate motions.jsonl --camera right=right.yaml -o right.yaml",
        "evaluate rig.toml motions.jsonl --report left.yaml",
        "evaluate rig.toml motions.jsonl --camera right=right.yaml --report right.yaml",
        "suggest rig.toml --with motions.jsonl -o left.yaml",
        "monitor rig.toml motions.jsonl -o left.yaml",
        "export rig.toml --to static-transforms -o left.yaml",
    ] {
        let (_, complaint) = folder.expect(2, command);
        assert!(complaint.contains("it is an input too"), "{command}: {complaint}");
    }
    assert_eq!([folder.read("left.yaml"), folder.read("right.yaml")], [lens, lens]);
}

/// A bag of an arm with a gripper, learned without a word of what robot it is.
#[test]
fn joints_that_never_move_and_the_names_of_a_shipped_arm_are_remarked_on() {
    let folder = Folder::new("slips-gripper");
    folder.expect(0, "simulate ur5 --samples 40 --seed 1 -o rec.jsonl");
    let path = folder.path().join("rec.jsonl");
    let mut recording = Recording::read(&path).unwrap();
    let plain = recording.joints.clone();
    recording.joints = plain.iter().map(|joint| format!("left_{joint}_joint")).chain(["finger".to_owned()]).collect();
    recording.samples.iter_mut().flat_map(|sample| &mut sample.joints).for_each(|joints| joints.push(0.04));
    recording.write(&path).unwrap();
    let output = folder.run("calibrate rec.jsonl -o x.toml");
    let err = String::from_utf8(output.stderr).unwrap();
    let arm = plain.iter().map(|joint| format!("left_{joint}_joint")).collect::<Vec<_>>().join(",");
    assert!(
        err.contains(&format!(
            "never move: finger; where they are not the arm's, as a gripper's are not, --joints {arm} leaves"
        )),
        "{err}"
    );
    assert!(err.contains("called as those of shipped rigs (ur5_arm, ur5e, ur3e, ur10, ur10e)"), "{err}");
    let (_, err) = folder.expect(0, &format!("calibrate rec.jsonl --joints {arm} --rig ur5_arm -o x.toml"));
    assert!(!err.contains("never move"), "{err}");
}
