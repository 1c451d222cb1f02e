//! Recordings in tables: CSV.
use crate::cli::Folder;
use handeye::recording::{Angles, OpenOptions, Opened, Recording, Sample, TableOptions};
use handeye::rig::catalog;
use handeye::simulate::{SimulateOptions, simulate};
use std::f64::consts::PI;
use std::fmt::Write as _;

fn csv(folder: &Folder, text: &str, options: &OpenOptions) -> Result<Opened, handeye::Error> {
    folder.write("table.csv", text);
    Recording::open_with(&folder.path().join("table.csv"), options)
}

pub fn of_table(table: TableOptions) -> OpenOptions {
    OpenOptions { table, ..OpenOptions::default() }
}

/// A recording as CSV, number by number.
fn written(recording: &Recording) -> String {
    let mut text = "time".to_owned();
    for joint in &recording.joints {
        write!(text, ",joints.{joint}").unwrap();
    }
    let pairs: Vec<(u32, u32)> = (0..recording.cameras.len() as u32)
        .flat_map(|camera| (0..recording.features.len() as u32).map(move |feature| (camera, feature)))
        .collect();
    for (camera, feature) in &pairs {
        let (camera, feature) = (&recording.cameras[*camera as usize].name, &recording.features[*feature as usize]);
        write!(text, ",{camera}.{feature}.u,{camera}.{feature}.v").unwrap();
    }
    for sample in &recording.samples {
        write!(text, "\n{:?}", sample.time.unwrap()).unwrap();
        for joint in sample.joints.as_ref().unwrap() {
            write!(text, ",{joint:?}").unwrap();
        }
        for pair in &pairs {
            match sample.pixels.iter().find(|seen| (seen.camera, seen.feature) == *pair) {
                Some(seen) => write!(text, ",{:?},{:?}", seen.pixel[0], seen.pixel[1]).unwrap(),
                None => text.push_str(",,"),
            }
        }
    }
    text
}

fn recorded() -> Recording {
    let options = SimulateOptions { samples: 30, seed: 5, ..SimulateOptions::default() };
    let mut recording = simulate(&catalog::rig("ur5").unwrap(), &options).unwrap().recording;
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        let Sample { joints, pixels, .. } = std::mem::take(sample);
        *sample = Sample { time: Some(0.5 * index as f64), joints, pixels, ..Sample::default() };
    }
    recording
}

#[test]
fn a_recording_as_csv_is_the_same_recording_in_any_order_of_columns_and_joints() {
    let folder = Folder::new("tables-same");
    let recording = recorded();
    let text = written(&recording);
    // The columns the other way round, apart by semicolons.
    let reversed: Vec<String> =
        text.lines().map(|line| line.split(',').rev().collect::<Vec<_>>().join(" ; ")).collect();
    let options = OpenOptions {
        known_joints: recording.joints.clone(),
        ..of_table(TableOptions { angles: Angles::Radians, ..TableOptions::default() })
    };
    for text in [text, format!("\u{feff}# a comment\n\n{}\r\n", reversed.join("\r\n"))] {
        let Opened { recording: found, notes, .. } = csv(&folder, &text, &options).unwrap();
        assert_eq!((&found.joints, &found.features), (&recording.joints, &recording.features));
        assert_eq!(found.samples, recording.samples);
        assert!(notes.is_empty(), "{notes:?}");
    }
}

#[test]
fn the_rig_learned_from_csv_is_that_of_the_recording_byte_for_byte() {
    let folder = Folder::new("tables-calibrate");
    let recording = recorded();
    folder.write("motions.csv", &written(&recording));
    let rig = catalog::rig("ur5").unwrap();
    folder.write("rig.toml", &rig.to_toml());
    recording.write(&folder.path().join("motions.jsonl")).unwrap();
    folder.expect(0, "calibrate motions.csv --rig rig.toml -o from-csv.toml");
    folder.expect(0, "calibrate motions.jsonl --rig rig.toml -o from-lines.toml");
    assert_eq!(folder.read("from-csv.toml"), folder.read("from-lines.toml"));
    // What is known of cameras is added to any format, and joints are chosen in any.
    let name = &recording.cameras[0].name;
    let (_, error) = folder.expect(2, &format!("convert motions.jsonl --camera {name}=8x6 -o out.jsonl"));
    assert!(error.contains("motions.jsonl: camera") && error.contains("is said to be of 8 x 6 px"), "{error}");
    let (_, error) = folder.expect(2, "convert motions.jsonl --joints a -o out.jsonl");
    assert!(error.contains("motions.jsonl: there is no joint `a`"), "{error}");
}

#[test]
fn columns_mean_what_their_names_say() {
    let folder = Folder::new("tables-names");
    let text = "timestamp_ms,joints.lift,joints.elbow_deg,pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw,\
        joint_action.lift,joint_action.elbow,left.tag36h11:3/0.u,left.tag36h11:3/0.v,depth.f10.x,depth.f10.y,depth.f10.z,\
        top.board.x,top.board.y,top.board.z,top.board.roll_deg,top.board.pitch_deg,top.board.yaw_deg,comment\n\
        1500,0.25,90,1,2,3,0,0,1,0,0.5,-0.5,10.5,20.25,0.1,0.2,0.3,1,1,1,0,0,90,begins\n\
        2000,nan,,,,,,,,,,,,,,NULL,,,,,,,,\n";
    let Opened { recording, notes, .. } = csv(&folder, text, &OpenOptions::default()).unwrap();
    assert_eq!(recording.joints, ["lift", "elbow"]);
    let cameras: Vec<&str> = recording.cameras.iter().map(|camera| camera.name.as_str()).collect();
    assert_eq!(
        (cameras, &recording.features[..]),
        (vec!["depth", "left", "top"], &["f10".to_owned(), "tag36h11:3/0".to_owned()][..])
    );
    let [first, second] = &recording.samples[..] else { panic!() };
    assert_eq!(first.time, Some(1.5));
    assert_eq!(first.joints, Some(vec![0.25, PI / 2.0]));
    assert_eq!(first.joint_action, Some(vec![0.5, -0.5]));
    assert_eq!((first.pixels[0].camera, first.pixels[0].feature, first.pixels[0].pixel), (1, 1, [10.5, 20.25]));
    assert_eq!((first.points[0].camera, first.points[0].feature, first.points[0].point), (0, 0, [0.1, 0.2, 0.3]));
    // Half a turn about z, and a quarter of one.
    let turned =
        |rotation: &nalgebra::Matrix3<f64>, x: [f64; 3]| (0..3).all(|k| (rotation[(k, 0)] - x[k]).abs() < 1e-15);
    let pose = first.pose.unwrap();
    assert!(turned(&pose.rotation, [-1.0, 0.0, 0.0]) && pose.translation.as_slice() == [1.0, 2.0, 3.0], "{pose:?}");
    let target = &first.targets[0];
    assert!(
        target.target == "board" && target.camera == 2 && turned(&target.pose.rotation, [0.0, 1.0, 0.0]),
        "{target:?}"
    );
    assert_eq!(*second, Sample { time: Some(2.0), ..Sample::default() });
    let said = notes.join("\n");
    assert!(said.contains("left out: comment"), "{said}");
}

#[test]
fn joints_are_found_under_the_names_that_the_options_or_the_rig_give_them() {
    let folder = Folder::new("tables-joints");
    let text = "t,actual_q_0,actual_q_1,gripper,left.f.u,left.f.v\n0,0.5,1.5,7,1,2\n";
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>();
    for options in [
        OpenOptions { joints: names(&["actual_q_1", "actual_q_0"]), ..OpenOptions::default() },
        OpenOptions { known_joints: names(&["actual_q_1", "actual_q_0"]), ..OpenOptions::default() },
    ] {
        let Opened { recording, notes, .. } = csv(&folder, text, &options).unwrap();
        assert_eq!(recording.joints, ["actual_q_1", "actual_q_0"]);
        assert_eq!(recording.samples[0].joints, Some(vec![1.5, 0.5]));
        assert!(notes.iter().any(|note| note.contains("left out: gripper")), "{notes:?}");
    }
    let options = OpenOptions { joints: names(&["actual_q_2"]), ..OpenOptions::default() };
    let error = csv(&folder, text, &options).unwrap_err().to_string();
    assert!(error.contains("table.csv:1:1") && error.contains("no joint `actual_q_2`"), "{error}");
}

#[test]
fn degrees_are_taken_where_they_are_said_and_never_guessed() {
    let folder = Folder::new("tables-degrees");
    let text = "joints.a,joints.b,left.f.u,left.f.v\n0,0.5,1,2\n93.5,0.25,1,2\n";
    let error = csv(&folder, text, &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.contains("table.csv:3:1: 93.5 is more than two turns") && error.contains("--degrees"), "{error}");
    let read = |angles: Angles| {
        let options = of_table(TableOptions { angles, ..TableOptions::default() });
        csv(&folder, text, &options).unwrap().recording.samples[1].joints.clone().unwrap()
    };
    assert_eq!(read(Angles::Radians), [93.5, 0.25]);
    assert_eq!(read(Angles::Degrees(Vec::new())), [93.5 * (PI / 180.0), 0.25 * (PI / 180.0)]);
    assert_eq!(read(Angles::Degrees(vec!["a".to_owned()])), [93.5 * (PI / 180.0), 0.25]);
    let small = csv(&folder, "joints.a,left.f.u,left.f.v\n1,1,2\n", &OpenOptions::default()).unwrap();
    assert!(small.notes.iter().any(|note| note.contains("taken for radians")), "{:?}", small.notes);
}

#[test]
fn mistakes_in_a_table_are_named_with_line_and_column() {
    let folder = Folder::new("tables-mistakes");
    let cases = [
        ("", "table.csv:1:1: is empty"),
        ("time,joints.a\n", "has no rows"),
        ("time,a,b\n0,1,2\n", "it has the columns time, a, b"),
        ("joints.a,joints.a\n1,2\n", "table.csv:1:10: two columns are called `joints.a`"),
        ("time,joints.a\n0,1\n1,x2\n", "table.csv:3:3: `x2` is no number"),
        ("time,joints.a\n0,1\n\n# between\n1, inf\n", "table.csv:5:4: `inf` is no number"),
        ("time,\"joints.a\"\n\"0\",\"one\"\n", "table.csv:2:5: `one` is no number"),
        ("time,joints.a\n0,1\n1\n", "table.csv:3:1: this row has 1 values, and the header names 2"),
        ("time,left.f.u\n0,1\n", "table.csv:1:6: there is `left.f.u`, and no `left.f.v`"),
        ("left.f.u,left.f.v\n3,\n", "table.csv:2:3: this is empty"),
        ("time,left.f.w\n0,1\n", "table.csv:1:6: nothing is known of a coordinate `w`"),
        ("time,pose.x,pose.y,pose.z\n0,1,2,3\n", "table.csv:1:6: there is `pose.x`, and no `pose.qx`"),
        (
            "episode_index,joints.a\n0,1\n,2\n1,3\n",
            "table.csv:3:1: this is empty in some rows only: each row has to say its episode, or none",
        ),
        (
            "pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw\n0,0,0,0,0,0,0\n",
            "table.csv:2:7: a quaternion of length 0",
        ),
        (
            "joints.a,pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw\n0,0,0,0,0,0,0,1\n0,0,0,0,0,0,0,\n",
            "table.csv:3:15: this is empty",
        ),
        (
            "joints.a,pose_action.x,pose_action.y,pose_action.z,pose_action.roll,pose_action.pitch,pose_action.yaw\n0,0,,0,0,0,0\n",
            "table.csv:2:5: this is empty",
        ),
        (
            "joints.a,left.tag.x,left.tag.y,left.tag.z,left.tag.roll,left.tag.pitch,left.tag.yaw\n0,0,0,0,nan,0,0\n",
            "table.csv:2:9: this is empty",
        ),
        ("time,joints.a\n0,1\n1,1\n0.5,1\n", "table.csv:4:1: time goes back, from 1 s to 0.5 s"),
        ("time,joints.a\n1,1\n1700000000000000000,1\n", "table.csv:3:1: 1700000000000000000 s is no time"),
        ("time,joints.a\n123456789012,1\n", "table.csv:2:1: 123456789012 s is no time"),
        ("time_s,joints.a\n1700000000000000000,1\n", "table.csv:2:1: 1700000000000000000 s is no time"),
        ("joints.tip\n0\n", "table.csv:1:1: a joint cannot be called `tip`"),
        ("joints.a,joint_action.b\n0,1\n", "table.csv:1:10: there is `joint_action.b`, and no `joint_action.a`"),
    ];
    for (text, expected) in cases {
        let error = csv(&folder, text, &OpenOptions::default()).unwrap_err();
        assert!(error.is_input() && error.to_string().contains(expected), "{text:?}: {error}");
    }
    std::fs::write(folder.path().join("table.csv"), b"joints.a\n1\n\xff\n").unwrap();
    let error =
        Recording::open_with(&folder.path().join("table.csv"), &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.contains("table.csv:3:1: this is no UTF-8"), "{error}");
}

#[test]
fn times_that_are_dates_in_another_unit_are_converted_and_that_is_said() {
    let folder = Folder::new("tables-units");
    for (name, unit, is_said) in [
        ("time", 1e9, true),
        ("timestamp", 1e6, true),
        ("t", 1e3, true),
        ("time", 1.0, false),
        ("time_ns", 1e9, false),
        ("timestamp_ms", 1e3, false),
    ] {
        let start = 1_700_000_000.0 * unit;
        let text = format!("{name},joints.a\n{start:.0},0.5\n{:.0},0.6\n", start + 10.0 * unit);
        let Opened { recording, notes, .. } = csv(&folder, &text, &OpenOptions::default()).unwrap();
        let [first, second] = [0, 1].map(|row| recording.samples[row].time.unwrap());
        assert!(
            (first - 1.7e9).abs() < 1e-6 && (second - first - 10.0).abs() < 1e-6,
            "{name}, {unit}: {first} {second}"
        );
        let said = notes.iter().any(|note| note.contains("since 1970"));
        assert_eq!(said, is_said, "{name}, {unit}: {notes:?}");
    }
    // One long pause, as over a weekend, is no other unit.
    let text = "t,joints.a\n0,0.5\n1,0.6\n200001,0.7\n200002,0.8\n";
    let Opened { notes, .. } = csv(&folder, text, &OpenOptions::default()).unwrap();
    assert!(notes.iter().any(|note| note.contains("up to 200000 s apart")), "{notes:?}");
}

#[test]
fn a_table_is_held_to_what_a_recording_file_is_held_to() {
    let folder = Folder::new("tables-checked");
    let text = "joints.a,joint_action.a,left.f.u,left.f.v\n0,0.5,1,2\n0.5,0.5,1,2\n";
    let Opened { recording, .. } = csv(&folder, text, &OpenOptions::default()).unwrap();
    // What is commanded last leads nowhere.
    let actions: Vec<_> = recording.samples.iter().map(|sample| sample.joint_action.clone()).collect();
    assert_eq!(actions, [Some(vec![0.5]), None]);
    let mut text = Vec::new();
    recording.write_to(&mut text).unwrap();
    assert_eq!(Recording::read_from(&text[..], "text").unwrap(), recording);
}

#[test]
fn a_clock_that_counts_since_its_start_is_no_date() {
    let folder = Folder::new("tables-boot");
    // Of a clock that has run for 20 minutes, or that begins with the recording, in nanoseconds and in microseconds, 30 times a second: as dates, or
    // as the seconds that numbers are where nothing says otherwise, they would be hours apart.
    for (start, step, name, unit, taken_for) in [
        (1_200_000_000_000_u64, 33_000_000, "time_ns", 1e9, "milliseconds since 1970"),
        (1_200_000_000, 33_000, "time_us", 1e6, "seconds"),
        (0, 33_000_000, "time_ns", 1e9, "seconds"),
        (0, 33_000, "time_us", 1e6, "seconds"),
    ] {
        let rows = |name: &str| -> String {
            let row = |k: u64| format!("{},0.{k}\n", start + step * k);
            format!("{name},joints.a\n{}", (0..5).map(row).collect::<String>())
        };
        // So many nanoseconds are no time in seconds at all.
        let in_seconds = (taken_for == "seconds").then_some(("time_s", 1.0));
        for (name, unit) in [(name, unit)].into_iter().chain(in_seconds) {
            let said = csv(&folder, &rows(name), &OpenOptions::default()).unwrap();
            let times: Vec<f64> = said.recording.samples.iter().map(|sample| sample.time.unwrap()).collect();
            assert!((times[4] - times[0] - 4.0 * step as f64 / unit).abs() < 1e-9, "{name}: {times:?}");
        }
        let error = csv(&folder, &rows("time"), &OpenOptions::default()).unwrap_err().to_string();
        let expected = format!(
            "table.csv: as {taken_for} most times would be a quarter of an hour or more apart; a column `time_s`, "
        );
        assert!(error.contains(&expected), "{start}, {step}: {error}");
    }
}

#[test]
fn an_empty_column_of_episodes_says_nothing() {
    let folder = Folder::new("tables-no-episode");
    let text = "time,episode_index,joints.a,joint_action.a\n0,,1,0.5\n1,,2,0.5\n2,,3,0.5\n";
    let found = csv(&folder, text, &OpenOptions::default()).unwrap().recording;
    let actions: Vec<_> = found.samples.iter().map(|sample| sample.joint_action.clone()).collect();
    assert_eq!(actions, [Some(vec![0.5]), Some(vec![0.5]), None]);
    // Nor may time go back, as it may from one episode to the next.
    let back = csv(&folder, &text.replace("\n2,", "\n0.5,"), &OpenOptions::default()).unwrap_err().to_string();
    assert!(back.contains("table.csv:4:1: time goes back"), "{back}");
    let one = of_table(TableOptions { episodes: vec![1], ..TableOptions::default() });
    let error = csv(&folder, text, &one).unwrap_err().to_string();
    assert!(error.ends_with("has no episode 1; it has none"), "{error}");
}

#[test]
fn joints_with_points_in_their_names_are_called_as_in_a_dataset_of_lerobot() {
    let folder = Folder::new("tables-points");
    let text = "time,joints.shoulder_pan.pos,joints.arm.lift_deg,joint_action.shoulder_pan.pos,joint_action.arm.lift\n0,0.5,90,1,2\n1,1,0,1,2\n";
    let plain = "time,shoulder_pan.pos,arm.lift_deg\n0,0.5,90\n1,1,0\n";
    let names = |names: [&str; 2]| names.map(str::to_owned).to_vec();
    for (text, options) in [
        (text, OpenOptions::default()),
        (text, OpenOptions { joints: names(["shoulder_pan.pos", "arm.lift"]), ..OpenOptions::default() }),
        (plain, OpenOptions { joints: names(["shoulder_pan.pos", "arm.lift"]), ..OpenOptions::default() }),
        (plain, OpenOptions { known_joints: names(["shoulder_pan", "arm_lift"]), ..OpenOptions::default() }),
    ] {
        let found = csv(&folder, text, &options).unwrap().recording;
        assert_eq!(found.joints, ["shoulder_pan", "arm_lift"], "{text}");
        assert_eq!(found.samples[0].joints, Some(vec![0.5, PI / 2.0]), "{text}");
    }
    let first = csv(&folder, text, &OpenOptions::default()).unwrap().recording.samples[0].clone();
    assert_eq!(first.joint_action, Some(vec![1.0, 2.0]));
    let degrees = Angles::Degrees(vec!["shoulder_pan.pos".to_owned()]);
    let read = csv(&folder, text, &of_table(TableOptions { angles: degrees, ..TableOptions::default() })).unwrap();
    assert_eq!(read.recording.samples[0].joints, Some(vec![0.5 * (PI / 180.0), PI / 2.0]));
}

#[test]
fn joints_that_are_not_taken_are_told_and_options_without_effect_refused() {
    let folder = Folder::new("tables-effects");
    let text = "time,joints.finger,joints.a\n0,7,0.5\n1,7,1\n";
    let options = OpenOptions { known_joints: vec!["a".to_owned()], ..OpenOptions::default() };
    let Opened { recording, notes, .. } = csv(&folder, text, &options).unwrap();
    assert_eq!((&recording.joints, &recording.samples[0].joints), (&options.known_joints, &Some(vec![0.5])));
    let told = notes.iter().filter(|note| note.contains("finger")).collect::<Vec<_>>();
    assert_eq!(told, ["joints that are left out: finger; those that are taken: a"]);

    let seen = "left.f.u,left.f.v\n1,2\n";
    for (text, options, says) in [
        (
            text,
            "--actions targets",
            "has no columns `action.NAME` (nor LeRobot's `action`), of which --actions would say",
        ),
        (
            "joints.a,joint_action.a,action.a\n0,1,1\n",
            "--actions motions",
            "has commanded motions in `joint_action.NAME`, beside which --actions has no effect",
        ),
        ("action.a,left.f.u,left.f.v\n1,1,2\n", "--actions targets", "has no columns `joints.NAME`, from which"),
        (seen, "--degrees", "has no joints, which --degrees would take for degrees"),
        (seen, "--radians", "has no joints but in columns that say `_deg`, where --radians has no effect"),
        ("joints.a_deg\n90\n", "--radians", "has no joints but in columns that say `_deg`"),
    ] {
        folder.write("table.csv", text);
        let (_, error) = folder.expect(2, &format!("convert table.csv {options} -o out.jsonl"));
        assert!(error.starts_with(&format!("error: table.csv: {says}")), "{text} {options}: {error}");
    }
}

/// Commands and speeds have the joints' names too, and are not what was read of them.
#[test]
fn columns_beside_the_joints_are_not_taken_for_them() {
    let folder = Folder::new("tables-beside");
    let options = OpenOptions { known_joints: vec!["a".to_owned(), "b".to_owned()], ..OpenOptions::default() };
    let open = |text: &str| csv(&folder, text, &options).map(|opened| opened.recording);
    let text = "joints.left_b_joint,joints.left_a_joint,joint_action.left_a_joint,joint_action.left_b_joint,velocity.a,velocity.b,l.f.u,l.f.v\n\
                1,2,0.1,0.2,9,9,5,6\n3,4,0.1,0.2,9,9,5,6\n";
    let read = open(text).unwrap();
    assert_eq!(read.joints, ["left_a_joint", "left_b_joint"]);
    assert_eq!(read.samples[0].joints.as_deref(), Some(&[2.0, 1.0][..]));
    assert_eq!(read.samples[0].joint_action.as_deref(), Some(&[0.1, 0.2][..]));
    let bare = open("b,a,a_velocity,b_velocity,l.f.u,l.f.v\n1,2,9,9,5,6\n").unwrap();
    assert_eq!(bare.samples[0].joints.as_deref(), Some(&[2.0, 1.0][..]));
    for none in ["velocity.a,velocity.b", "a_velocity,b_velocity", "action.a,action.b"] {
        let read = open(&format!("{none},l.f.u,l.f.v\n1,2,5,6\n")).unwrap();
        assert!(read.joints.is_empty() && read.samples[0].joints.is_none(), "{none}: {:?}", read.joints);
    }
    let only = open("joint_action.a,joint_action.b,l.f.u,l.f.v\n0.1,0.2,5,6\n0.1,0.2,5,6\n").unwrap();
    assert_eq!(
        (&only.joints[..], only.samples[0].joint_action.is_some()),
        (&["a".to_owned(), "b".to_owned()][..], true)
    );
    let error = open("joints.left_a,joints.left_b,joints.right_a,joints.right_b\n1,2,3,4\n").unwrap_err().to_string();
    assert!(error.contains("left_a or right_a: --joints names those of one robot"), "{error}");
}
