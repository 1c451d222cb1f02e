//! LeRobot's datasets: Parquet files of numbers with a description beside.
use crate::cli::Folder;
use crate::tables::of_table;
use handeye::recording::{Actions, Angles, OpenOptions, Opened, Recording, TableOptions};
use parquet::basic::{Compression, ZstdLevel};
use parquet::column::writer::ColumnWriter;
use parquet::data_type::ByteArray;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::parser::parse_message_type;
use std::f64::consts::PI;
use std::path::Path;
use std::sync::Arc;

enum Column {
    /// A list of numbers a row.
    Lists(Vec<Vec<f32>>),
    Floats(Vec<f32>),
    Ints(Vec<i64>),
    /// Nanoseconds, as pandas writes times.
    Nanoseconds(Vec<i64>),
    /// A number in the middle of three rows.
    Middle(f64),
    /// An image of no content a row.
    Images(usize),
}

fn write(path: &Path, codec: Compression, columns: &[(&str, Column)]) {
    let field = |(name, column): &(&str, Column)| match column {
        Column::Lists(_) => {
            format!("optional group {name} (LIST) {{ repeated group list {{ optional float element; }} }}")
        }
        Column::Floats(_) => format!("optional float {name};"),
        Column::Ints(_) => format!("optional int64 {name};"),
        Column::Nanoseconds(_) => format!("optional int64 {name} (TIMESTAMP(NANOS, true));"),
        Column::Middle(_) => format!("optional double {name};"),
        Column::Images(_) => format!("optional group {name} {{ optional binary bytes; optional binary path (UTF8); }}"),
    };
    let schema = format!("message schema {{ {} }}", columns.iter().map(field).collect::<String>());
    let schema = Arc::new(parse_message_type(&schema).unwrap());
    let properties = Arc::new(WriterProperties::builder().set_compression(codec).build());
    std::fs::create_dir_all(path.parent().unwrap()).unwrap();
    let mut writer = SerializedFileWriter::new(std::fs::File::create(path).unwrap(), schema, properties).unwrap();
    let mut group = writer.next_row_group().unwrap();
    for (_, column) in columns {
        for _ in 0..if matches!(column, Column::Images(_)) { 2 } else { 1 } {
            let mut open = group.next_column().unwrap().unwrap();
            match (column, open.untyped()) {
                (Column::Lists(rows), ColumnWriter::FloatColumnWriter(writer)) => {
                    let first = |row: &Vec<f32>| (0..row.len()).map(|k| i16::from(k > 0)).collect::<Vec<i16>>();
                    let repeated: Vec<i16> = rows.iter().flat_map(first).collect();
                    let defined = vec![3; repeated.len()];
                    writer.write_batch(&rows.concat(), Some(&defined), Some(&repeated)).unwrap();
                }
                (Column::Floats(values), ColumnWriter::FloatColumnWriter(writer)) => {
                    writer.write_batch(values, Some(&vec![1; values.len()]), None).unwrap();
                }
                (Column::Ints(values) | Column::Nanoseconds(values), ColumnWriter::Int64ColumnWriter(writer)) => {
                    writer.write_batch(values, Some(&vec![1; values.len()]), None).unwrap();
                }
                (Column::Middle(value), ColumnWriter::DoubleColumnWriter(writer)) => {
                    writer.write_batch(&[*value], Some(&[0, 1, 0]), None).unwrap();
                }
                (Column::Images(rows), ColumnWriter::ByteArrayColumnWriter(writer)) => {
                    writer.write_batch(&vec![ByteArray::from("x"); *rows], Some(&vec![2; *rows]), None).unwrap();
                }
                _ => panic!("the schema has another type"),
            }
            open.close().unwrap();
        }
    }
    group.close().unwrap();
    writer.close().unwrap();
}

/// `meta/info.json` where `observation.state` and `action` have these names.
fn describe(folder: &Path, state: &str, action: &str) {
    std::fs::create_dir_all(folder.join("meta")).unwrap();
    let info = format!(
        "{{\"codebase_version\":\"v3.0\",\"fps\":10,\"features\":{{\"observation.state\":{{\"dtype\":\"float32\",\"shape\":[2],\"names\":{state}}},\
        \"action\":{{\"dtype\":\"float32\",\"shape\":[2],\"names\":{action}}},\
        \"observation.images.front\":{{\"dtype\":\"video\",\"shape\":[480,640,3],\"names\":[\"height\",\"width\",\"channels\"]}}}}}}"
    );
    std::fs::write(folder.join("meta/info.json"), info).unwrap();
}

fn rows(numbers: &[[f32; 2]]) -> Vec<Vec<f32>> {
    numbers.iter().map(|row| row.to_vec()).collect()
}

/// Three frames of an episode: joints in degrees, which the motors are to be half a degree beyond.
fn frames(episode: i64) -> Vec<(&'static str, Column)> {
    let base = 10.0 * episode as f32;
    let add = |numbers: [[f32; 2]; 3], add: f32| rows(&numbers.map(|row| row.map(|number| number + base + add)));
    vec![
        ("observation.state", Column::Lists(add([[0.1, 45.0], [1.0, 46.0], [2.0, 47.0]], 0.0))),
        ("action", Column::Lists(add([[1.0, 46.0], [2.0, 47.0], [3.0, 48.0]], 0.5))),
        ("timestamp", Column::Floats(vec![0.0, 0.1, 0.2])),
        ("frame_index", Column::Ints(vec![0, 1, 2])),
        ("episode_index", Column::Ints(vec![episode; 3])),
        ("observation.note", Column::Middle(5.0)),
    ]
}

/// Two episodes, each in a file of its own.
fn dataset(folder: &Path, names: &str, codec: Compression) {
    describe(folder, names, names);
    for episode in 0..2 {
        write(&folder.join(format!("data/chunk-000/file-{episode:03}.parquet")), codec, &frames(episode));
    }
}

fn times(recording: &Recording) -> Vec<f64> {
    recording.samples.iter().map(|sample| sample.time.unwrap()).collect()
}

fn near(found: &[f64], expected: &[f64], bound: f64) -> bool {
    found.len() == expected.len() && found.iter().zip(expected).all(|(a, b)| (a - b).abs() < bound)
}

#[test]
fn a_dataset_is_read_with_the_names_of_its_motors_and_degrees_where_they_are_said() {
    let folder = Folder::new("lerobot");
    let codecs = [Compression::UNCOMPRESSED, Compression::SNAPPY, Compression::ZSTD(ZstdLevel::default())];
    let names = ["[\"pan.pos\",\"lift.pos\"]", "{\"motors\":[\"pan\",\"lift\"]}"];
    for (codec, names) in codecs.into_iter().zip(names.into_iter().cycle()) {
        dataset(folder.path(), names, codec);
        let options = of_table(TableOptions {
            angles: Angles::Degrees(Vec::new()),
            actions: Actions::Targets,
            ..TableOptions::default()
        });
        let Opened { recording, notes, .. } = Recording::open_with(folder.path(), &options).unwrap();
        assert_eq!(recording.joints, ["pan", "lift"]);
        // 0.1 in 32 bits is 0.1, not 0.10000000149; the second episode goes on a second later, in whatever file it stands.
        let found = times(&recording);
        assert!(near(&found, &[0.0, 0.1, 0.2, 1.2, 1.3, 1.4], 1e-12), "{found:?}");
        let first = recording.samples[0].joints.as_ref().unwrap();
        assert!(near(first, &[0.1 * (PI / 180.0), 45.0 * (PI / 180.0)], 1e-15), "{first:?}");
        // From 1 to 2.5 degrees, and what is commanded last leads nowhere.
        let action = recording.samples[1].joint_action.as_ref().unwrap();
        assert!((action[0] - 1.5 * PI / 180.0).abs() < 1e-15, "{action:?}");
        assert!(recording.samples[2].joint_action.is_none() && recording.samples[3].joint_action.is_some());
        let said = notes.join("\n");
        assert!(said.contains("times begin anew 1 times") && said.contains("observation.note"), "{said}");

        let file = folder.path().join("data/chunk-000/file-001.parquet");
        let options = of_table(TableOptions { angles: Angles::Radians, ..TableOptions::default() });
        let Opened { recording, notes, .. } = Recording::open_with(&file, &options).unwrap();
        let joints: Vec<_> = recording.samples.iter().map(|sample| sample.joints.clone().unwrap()[1]).collect();
        assert_eq!(joints, [55.0, 56.0, 57.0]);
        assert!(notes.iter().any(|note| note.starts_with("actions are left out;")), "{notes:?}");

        let error = Recording::open_with(&file, &OpenOptions::default()).unwrap_err().to_string();
        assert!(error.contains("file-001.parquet: row 1, column `joints.lift`: 55 is more than two turns"), "{error}");
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
fn episodes_are_those_of_the_dataset_whatever_file_they_stand_in() {
    let folder = Folder::new("lerobot-episodes");
    dataset(folder.path(), "[\"pan\",\"lift\"]", Compression::UNCOMPRESSED);
    // The second file holds the end of episode 1 and all of episode 2.
    let file = |number: usize| folder.path().join(format!("data/chunk-000/file-{number:03}.parquet"));
    let joints = Column::Lists(rows(&[[3.0, 58.0], [20.0, 65.0], [21.0, 66.0]]));
    let columns = [
        ("observation.state", joints),
        ("action", Column::Lists(rows(&[[0.0; 2]; 3]))),
        ("timestamp", Column::Floats(vec![0.3, 0.0, 0.1])),
        ("frame_index", Column::Ints(vec![3, 0, 1])),
        ("episode_index", Column::Ints(vec![1, 2, 2])),
        ("observation.note", Column::Middle(5.0)),
    ];
    write(&file(2), Compression::UNCOMPRESSED, &columns);
    let read = |episodes: &[u64]| {
        let options = TableOptions { episodes: episodes.to_vec(), angles: Angles::Radians, actions: Actions::Motions };
        Recording::open_with(folder.path(), &of_table(options))
    };
    let one = read(&[1]).unwrap().recording;
    let second: Vec<f64> = one.samples.iter().map(|sample| sample.joints.as_ref().unwrap()[1]).collect();
    assert_eq!(second, [55.0, 56.0, 57.0, 58.0]);
    assert!(near(&times(&one), &[0.0, 0.1, 0.2, 0.3], 1e-12), "{:?}", times(&one));
    // It goes on in the next file, and so does what was commanded.
    assert!(one.samples[2].joint_action.is_some() && one.samples[3].joint_action.is_none());
    let two = read(&[0, 2]).unwrap().recording;
    assert!(near(&times(&two), &[0.0, 0.1, 0.2, 1.2, 1.3], 1e-12), "{:?}", times(&two));
    assert!(two.samples[2].joint_action.is_none());
    let error = read(&[1, 7]).unwrap_err().to_string();
    assert!(error.contains("has no episode 7; it has 0 to 2"), "{error}");
    // Files of other columns are of another dataset.
    write(&file(3), Compression::UNCOMPRESSED, &columns[..2]);
    let error = read(&[]).unwrap_err().to_string();
    assert!(error.contains("file-003.parquet: has the columns joints.pan"), "{error}");
}

#[test]
fn time_that_goes_back_within_an_episode_is_refused_with_its_row() {
    let folder = Folder::new("lerobot-back");
    let path = folder.path().join("data/file-000.parquet");
    let columns = |episodes: [i64; 3]| {
        [
            ("observation.state", Column::Lists(rows(&[[0.0; 2]; 3]))),
            ("timestamp", Column::Floats(vec![0.0, 0.5, 0.25])),
            ("episode_index", Column::Ints(episodes.to_vec())),
        ]
    };
    write(&path, Compression::UNCOMPRESSED, &columns([0, 0, 1]));
    let found = Recording::open_with(&path, &OpenOptions::default()).unwrap().recording;
    assert_eq!(times(&found), [0.0, 0.5, 1.5]);
    write(&path, Compression::UNCOMPRESSED, &columns([0, 0, 0]));
    let error = Recording::open_with(&path, &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.contains("row 3, column `timestamp`: time goes back, from 0.5 s to 0.25 s"), "{error}");
}

#[test]
fn times_whose_type_says_their_unit_are_in_it() {
    let folder = Folder::new("lerobot-nanoseconds");
    let path = folder.path().join("motions.parquet");
    for name in ["timestamp", "time_ns"] {
        let times = Column::Nanoseconds(vec![1_700_000_000_000_000_000, 1_700_000_010_000_000_000]);
        let columns = [("joints.a", Column::Floats(vec![0.5, 0.25])), (name, times)];
        write(&path, Compression::UNCOMPRESSED, &columns);
        let Opened { recording, notes, .. } = Recording::open_with(&path, &OpenOptions::default()).unwrap();
        let found = self::times(&recording);
        assert!(near(&found, &[1.7e9, 1.7e9 + 10.0], 1e-6), "{name}: {found:?}");
        assert!(!notes.iter().any(|note| note.contains("1970")), "{notes:?}");
    }
}

#[test]
fn actions_of_other_names_and_columns_of_other_kinds_leave_the_joints_readable() {
    let folder = Folder::new("lerobot-others");
    describe(folder.path(), "[\"pan\",\"lift\"]", "[\"x\",\"y\",\"gripper\"]");
    let columns = |action: Vec<Vec<f32>>| {
        [
            ("observation.state", Column::Lists(rows(&[[0.5, 0.25], [0.75, 0.5]]))),
            ("action", Column::Lists(action)),
            ("observation.images.front", Column::Images(2)),
            ("observation.image", Column::Images(2)),
            ("observation.environment_state", Column::Lists(rows(&[[1.0; 2]; 2]))),
            ("observation.effort.pan", Column::Floats(vec![1.0; 2])),
            ("next.reward", Column::Floats(vec![0.0; 2])),
        ]
    };
    let three = vec![vec![0.0, 1.0, 2.0]; 2];
    write(&folder.path().join("data/file-000.parquet"), Compression::SNAPPY, &columns(three));
    let read = |options: &OpenOptions| Recording::open_with(folder.path(), options);
    let Opened { recording, notes, .. } = read(&OpenOptions::default()).unwrap();
    assert_eq!((&recording.joints[..], recording.cameras.len()), (&["pan".to_owned(), "lift".to_owned()][..], 0));
    let joints: Vec<_> = recording.samples.iter().map(|sample| sample.joints.clone().unwrap()).collect();
    assert_eq!(joints, [[0.5, 0.25], [0.75, 0.5]]);
    let said = notes.join("\n");
    for passed in ["images.front", "image", "environment_state", "effort.pan"] {
        assert!(said.contains(&format!("observation.{passed}")), "{passed}: {said}");
    }
    assert!(said.contains("next.reward") && said.contains("actions are left out (of x, y, gripper)"), "{said}");
    let motions = of_table(TableOptions { actions: Actions::Motions, ..TableOptions::default() });
    let error = read(&motions).unwrap_err().to_string();
    assert!(error.contains("there is `action.x`, and no `action.pan`"), "{error}");

    // Without names of their own, commands are of the joints in their order.
    describe(folder.path(), "[\"pan\",\"lift\"]", "null");
    write(&folder.path().join("data/file-000.parquet"), Compression::SNAPPY, &columns(rows(&[[1.0, 1.5], [0.0, 0.0]])));
    let commanded = |actions: Actions| {
        let recording = read(&of_table(TableOptions { actions, ..TableOptions::default() })).unwrap().recording;
        recording.samples[0].joint_action.clone()
    };
    assert_eq!(commanded(Actions::Unsaid), None);
    assert_eq!(commanded(Actions::Motions), Some(vec![1.0, 1.5]));
    assert_eq!(commanded(Actions::Targets), Some(vec![0.5, 1.25]));

    // Names that are too few are none.
    describe(folder.path(), "[\"state\"]", "null");
    let Opened { recording, notes, .. } = read(&OpenOptions::default()).unwrap();
    assert_eq!(recording.joints, ["j1", "j2"]);
    assert!(
        notes
            .iter()
            .any(|note| note.contains("`observation.state` has 2 numbers, which meta/info.json names 1: state")),
        "{notes:?}"
    );
}

#[test]
fn a_file_that_is_damaged_anywhere_is_refused_or_read_and_ends_no_program() {
    let folder = Folder::new("lerobot-damaged");
    dataset(folder.path(), "[\"pan\",\"lift\"]", Compression::UNCOMPRESSED);
    let path = folder.path().join("data/chunk-000/file-000.parquet");
    let whole = std::fs::read(&path).unwrap();
    let options = of_table(TableOptions { angles: Angles::Radians, ..TableOptions::default() });
    for end in (0..whole.len()).step_by(97) {
        std::fs::write(&path, &whole[..end]).unwrap();
        let error = Recording::open_with(&path, &options).unwrap_err();
        assert!(error.is_input() && error.to_string().contains("file-000.parquet"), "cut at {end}: {error}");
    }
    let mut refused = 0;
    for place in (0..whole.len()).step_by(11) {
        let mut broken = whole.clone();
        broken[place] ^= 0x5a;
        std::fs::write(&path, &broken).unwrap();
        refused += usize::from(Recording::open_with(&path, &options).is_err_and(|error| error.is_input()));
    }
    assert!(refused > 10, "{refused} refused");
}
