//! Recordings in tables: CSV, and Parquet as LeRobot writes it.
use crate::cli::Folder;
use handeye::recording::{Actions, Angles, Recording, Sample, Table, TableOptions};
use handeye::rig::catalog;
use handeye::simulate::{SimulateOptions, simulate};
use parquet::data_type::{DoubleType, FloatType, Int64Type};
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::f64::consts::PI;
use std::fmt::Write as _;
use std::path::Path;
use std::sync::Arc;

fn csv(folder: &Folder, text: &str, options: &TableOptions) -> Result<Table, handeye::Error> {
    folder.write("table.csv", text);
    Table::read_csv(&folder.path().join("table.csv"), options)
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
    let options =
        TableOptions { known_joints: recording.joints.clone(), angles: Angles::Radians, ..TableOptions::default() };
    for text in [text, format!("\u{feff}# a comment\n\n{}\r\n", reversed.join("\r\n"))] {
        let Table { recording: found, notes, .. } = csv(&folder, &text, &options).unwrap();
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
}

#[test]
fn columns_mean_what_their_names_say() {
    let folder = Folder::new("tables-names");
    let text = "timestamp_ms,joints.lift,joints.elbow_deg,pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw,\
        joint_action.lift,joint_action.elbow,left.tag36h11:3/0.u,left.tag36h11:3/0.v,depth.f10.x,depth.f10.y,depth.f10.z,\
        top.board.x,top.board.y,top.board.z,top.board.roll_deg,top.board.pitch_deg,top.board.yaw_deg,comment\n\
        1500,0.25,90,1,2,3,0,0,1,0,0.5,-0.5,10.5,20.25,0.1,0.2,0.3,1,1,1,0,0,90,begins\n\
        2000,nan,,,,,,,,,,,,,,NULL,,,,,,,,\n";
    let Table { recording, notes, .. } = csv(&folder, text, &TableOptions::default()).unwrap();
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
        TableOptions { joints: names(&["actual_q_1", "actual_q_0"]), ..TableOptions::default() },
        TableOptions { known_joints: names(&["actual_q_1", "actual_q_0"]), ..TableOptions::default() },
    ] {
        let Table { recording, notes, .. } = csv(&folder, text, &options).unwrap();
        assert_eq!(recording.joints, ["actual_q_1", "actual_q_0"]);
        assert_eq!(recording.samples[0].joints, Some(vec![1.5, 0.5]));
        assert!(notes.iter().any(|note| note.contains("left out: gripper")), "{notes:?}");
    }
    let options = TableOptions { joints: names(&["actual_q_2"]), ..TableOptions::default() };
    let error = csv(&folder, text, &options).unwrap_err().to_string();
    assert!(error.contains("table.csv:1:1") && error.contains("no joint `actual_q_2`"), "{error}");
}

#[test]
fn degrees_are_taken_where_they_are_said_and_never_guessed() {
    let folder = Folder::new("tables-degrees");
    let text = "joints.a,joints.b,left.f.u,left.f.v\n0,0.5,1,2\n93.5,0.25,1,2\n";
    let error = csv(&folder, text, &TableOptions::default()).unwrap_err().to_string();
    assert!(error.contains("table.csv:3:1: 93.5 is more than two turns") && error.contains("--degrees"), "{error}");
    let read = |angles: Angles| {
        let options = TableOptions { angles, ..TableOptions::default() };
        csv(&folder, text, &options).unwrap().recording.samples[1].joints.clone().unwrap()
    };
    assert_eq!(read(Angles::Radians), [93.5, 0.25]);
    assert_eq!(read(Angles::Degrees(Vec::new())), [93.5 * (PI / 180.0), 0.25 * (PI / 180.0)]);
    assert_eq!(read(Angles::Degrees(vec!["a".to_owned()])), [93.5 * (PI / 180.0), 0.25]);
    let small = csv(&folder, "joints.a,left.f.u,left.f.v\n1,1,2\n", &TableOptions::default()).unwrap();
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
            "pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw\n0,0,0,0,0,0,0\n",
            "table.csv:2:7: a quaternion of length 0",
        ),
        ("joints.tip\n0\n", "table.csv:1:1: a joint cannot be called `tip`"),
        ("joints.a,joint_action.b\n0,1\n", "table.csv:1:10: there is `joint_action.b`, and no `joint_action.a`"),
    ];
    for (text, expected) in cases {
        let error = csv(&folder, text, &TableOptions::default()).unwrap_err();
        assert!(error.is_input() && error.to_string().contains(expected), "{text:?}: {error}");
    }
    std::fs::write(folder.path().join("table.csv"), b"joints.a\n1\n\xff\n").unwrap();
    let error = Table::read_csv(&folder.path().join("table.csv"), &TableOptions::default()).unwrap_err().to_string();
    assert!(error.contains("table.csv:3:1: this is no UTF-8"), "{error}");
}

/// A dataset as LeRobot lays it out: two episodes of three frames, degrees, names in `meta/info.json`.
fn dataset(folder: &Path, names: &str, codec: parquet::basic::Compression) {
    let schema = "message schema {
        optional group observation.state (LIST) { repeated group list { optional float element; } }
        optional group action (LIST) { repeated group list { optional float element; } }
        optional float timestamp;
        optional int64 frame_index;
        optional int64 episode_index;
        optional double observation.note;
    }";
    std::fs::create_dir_all(folder.join("data/chunk-000")).unwrap();
    std::fs::create_dir_all(folder.join("meta")).unwrap();
    let info = format!(
        "{{\"codebase_version\":\"v3.0\",\"fps\":10,\"features\":{{\"observation.state\":{{\"dtype\":\"float32\",\"shape\":[2],\"names\":{names}}},\
        \"action\":{{\"dtype\":\"float32\",\"shape\":[2],\"names\":{names}}},\
        \"observation.images.front\":{{\"dtype\":\"video\",\"shape\":[480,640,3],\"names\":[\"height\",\"width\",\"channels\"]}}}}}}"
    );
    std::fs::write(folder.join("meta/info.json"), info).unwrap();
    let schema = Arc::new(parse_message_type(schema).unwrap());
    let properties = Arc::new(WriterProperties::builder().set_compression(codec).build());
    let file = std::fs::File::create(folder.join("data/chunk-000/file-000.parquet")).unwrap();
    let mut writer = SerializedFileWriter::new(file, schema, properties).unwrap();
    for episode in 0..2 {
        let base = 10.0 * episode as f32;
        let mut group = writer.next_row_group().unwrap();
        for (values, add) in [(&[0.1_f32, 45.0, 1.0, 46.0, 2.0, 47.0], 0.0), (&[1.0, 46.0, 2.0, 47.0, 3.0, 48.0], 0.5)]
        {
            let values: Vec<f32> = values.iter().map(|value| value + base + add).collect();
            let mut column = group.next_column().unwrap().unwrap();
            column.typed::<FloatType>().write_batch(&values, Some(&[3; 6]), Some(&[0, 1, 0, 1, 0, 1])).unwrap();
            column.close().unwrap();
        }
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<FloatType>().write_batch(&[0.0, 0.1, 0.2], Some(&[1; 3]), None).unwrap();
        column.close().unwrap();
        for numbers in [[0, 1, 2], [episode; 3]] {
            let mut column = group.next_column().unwrap().unwrap();
            column.typed::<Int64Type>().write_batch(&numbers, Some(&[1; 3]), None).unwrap();
            column.close().unwrap();
        }
        let mut column = group.next_column().unwrap().unwrap();
        column.typed::<DoubleType>().write_batch(&[5.0], Some(&[0, 1, 0]), None).unwrap();
        column.close().unwrap();
        group.close().unwrap();
    }
    writer.close().unwrap();
}

#[test]
fn a_lerobot_dataset_is_read_with_the_names_of_its_motors_and_degrees_where_they_are_said() {
    let folder = Folder::new("tables-lerobot");
    use parquet::basic::{Compression, ZstdLevel};
    let codecs = [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::ZSTD(ZstdLevel::default())];
    let names = ["[\"pan.pos\",\"lift.pos\"]", "{\"motors\":[\"pan\",\"lift\"]}"];
    for (codec, names) in codecs.into_iter().zip(names.into_iter().cycle()) {
        dataset(folder.path(), names, codec);
        let file = folder.path().join("data/chunk-000/file-000.parquet");
        let options =
            TableOptions { angles: Angles::Degrees(Vec::new()), actions: Actions::Targets, ..TableOptions::default() };
        let Table { recording, notes, .. } = Table::read_parquet(&file, &options).unwrap();
        assert_eq!(recording.joints, ["pan", "lift"]);
        assert_eq!(recording.samples.len(), 6);
        let times: Vec<f64> = recording.samples.iter().map(|sample| sample.time.unwrap()).collect();
        // 0.1 in 32 bits is 0.1, not 0.10000000149; the second episode goes on a second later.
        assert!(times.iter().zip([0.0, 0.1, 0.2, 1.2, 1.3, 1.4]).all(|(a, b)| (a - b).abs() < 1e-12), "{times:?}");
        let first = &recording.samples[0];
        let expected = [0.1 * (PI / 180.0), 45.0 * (PI / 180.0)];
        assert!(first.joints.as_ref().unwrap().iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-15));
        // From 1 to 2.5 degrees, and what is commanded last leads nowhere.
        let action = recording.samples[1].joint_action.as_ref().unwrap();
        assert!((action[0] - 1.5 * PI / 180.0).abs() < 1e-15, "{action:?}");
        assert!(recording.samples[2].joint_action.is_none());
        let said = notes.join("\n");
        assert!(said.contains("times begin anew 1 times") && said.contains("observation.note"), "{said}");

        let options = TableOptions { episodes: vec![1], angles: Angles::Radians, ..TableOptions::default() };
        let Table { recording, notes, .. } = Table::read_lerobot(folder.path(), &options).unwrap();
        let joints: Vec<_> = recording.samples.iter().map(|sample| sample.joints.clone().unwrap()[1]).collect();
        assert_eq!(joints, [55.0, 56.0, 57.0]);
        assert!(notes.iter().any(|note| note.contains("actions are left out")), "{notes:?}");

        let error = Table::read_parquet(&file, &TableOptions::default()).unwrap_err().to_string();
        assert!(error.contains("row 1, column `joints.lift`: 45 is more than two turns"), "{error}");
    }
    let (said, _) = folder.expect(0, "convert . --degrees --joints lift,pan --episodes 0 -o out.jsonl");
    assert!(said.contains("3 samples of 2 joints"), "{said}");
    assert_eq!(Recording::read(&folder.path().join("out.jsonl")).unwrap().joints, ["lift", "pan"]);
    let (_, error) = folder.expect(2, "convert . --degrees --joint-topic /a -o out.jsonl");
    assert!(error.contains("--joint-topic has no effect"), "{error}");
    let (_, error) = folder.expect(2, "convert . --degrees=elbow -o out.jsonl");
    assert!(error.contains("no joint `elbow`"), "{error}");
}

#[test]
fn a_parquet_file_that_is_damaged_anywhere_is_refused_or_read_and_ends_no_program() {
    let folder = Folder::new("tables-damaged");
    dataset(folder.path(), "[\"pan\",\"lift\"]", parquet::basic::Compression::UNCOMPRESSED);
    let path = folder.path().join("data/chunk-000/file-000.parquet");
    let whole = std::fs::read(&path).unwrap();
    let options = TableOptions { angles: Angles::Radians, ..TableOptions::default() };
    for end in (0..whole.len()).step_by(97) {
        std::fs::write(&path, &whole[..end]).unwrap();
        let error = Table::read_parquet(&path, &options).unwrap_err();
        assert!(error.is_input() && error.to_string().contains("file-000.parquet"), "cut at {end}: {error}");
    }
    for place in (0..whole.len()).step_by(11) {
        let mut broken = whole.clone();
        broken[place] ^= 0x5a;
        std::fs::write(&path, &broken).unwrap();
        let _ = Table::read_parquet(&path, &options);
    }
}
