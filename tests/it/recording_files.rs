//! A recording read back is the recording written; several join into one.
use crate::cli::Folder;
use crate::rig_files::{random_number, random_pose};
use handeye::Error;
use handeye::camera::CameraModel;
use handeye::recording::*;
use nalgebra::Matrix6;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::path::PathBuf;

/// Rounding of a rotation that goes through a quaternion.
const ROUNDING: f64 = 2e-15;

fn maybe<T>(random: &mut ChaCha8Rng, make: impl FnOnce(&mut ChaCha8Rng) -> T) -> Option<T> {
    random.random_bool(0.6).then(|| make(random))
}

/// Poses are such as files hold, so that they read back exactly.
fn random_recording(seed: u64) -> Recording {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let n_joints = random.random_range(0..8);
    let n_features = random.random_range(1..15);
    let mut recording = Recording {
        joints: (0..n_joints).map(|i| format!("jöint \"{i}\"")).collect(),
        features: (0..n_features).map(|i| format!("f{i}")).collect(),
        ..Recording::default()
    };
    for index in 0..random.random_range(1..4) {
        recording.cameras.push(RecordedCamera {
            // Not in alphabetical order: the header's order is kept.
            name: format!("{}-camera", 9 - index),
            size: maybe(random, |r| [r.random_range(1..5000), r.random_range(1..5000)]),
            model: maybe(random, |_| CameraModel::Rational),
            fx: maybe(random, |r| r.random_range(1.0..2000.0)),
            fy: maybe(random, |r| r.random_range(1.0..2000.0)),
            cx: maybe(random, random_number),
            cy: maybe(random, random_number),
            distortion: maybe(random, |r| (0..r.random_range(0..=8)).map(|_| random_number(r)).collect()),
        });
    }
    let n_cameras = recording.cameras.len() as u32;
    for index in 0..random.random_range(1..10) {
        let mut sample = Sample {
            time: maybe(random, random_number),
            joints: maybe(random, |r| (0..n_joints).map(|_| random_number(r)).collect()),
            pose: maybe(random, random_pose),
            joint_action: maybe(random, |r| (0..n_joints).map(|_| random_number(r)).collect()),
            pose_action: maybe(random, random_pose),
            ..Sample::default()
        };
        for camera in 0..n_cameras {
            for feature in 0..n_features {
                // The first sample sees everything, so that every feature leaves a trace.
                if index == 0 || random.random_bool(0.4) {
                    let pixel = std::array::from_fn(|_| random_number(random));
                    sample.pixels.push(Detection { camera, feature, pixel });
                }
                if random.random_bool(0.1) {
                    let point = std::array::from_fn(|_| random_number(random));
                    sample.points.push(PointDetection { camera, feature, point });
                }
            }
            for target in 0..random.random_range(0..3) {
                let pose = random_pose(random);
                let covariance = maybe(random, |r| {
                    let factor = Matrix6::from_fn(|i, k| if i == k { 1.0 } else { r.random_range(-0.1..0.1) });
                    let product: Matrix6<f64> = factor * factor.transpose();
                    0.5 * (product + product.transpose())
                });
                sample.targets.push(TargetDetection { camera, target: format!("tag{target}"), pose, covariance });
            }
        }
        recording.samples.push(sample);
    }
    recording
}

fn text(recording: &Recording) -> String {
    let mut bytes = Vec::new();
    recording.write_to(&mut bytes).unwrap();
    String::from_utf8(bytes).unwrap()
}

/// Equal but for the rounding of rotations.
fn assert_same(found: &Recording, expected: &Recording, what: &str) {
    let (mut found, mut unrounded) = (found.clone(), expected.clone());
    assert_eq!(found.samples.len(), expected.samples.len(), "{what}");
    for (found, expected) in found.samples.iter_mut().zip(&mut unrounded.samples) {
        assert_eq!(found.targets.len(), expected.targets.len(), "{what}");
        let targets = found.targets.iter_mut().zip(&mut expected.targets).map(|(a, b)| (&mut a.pose, &mut b.pose));
        let poses = found.pose.as_mut().zip(expected.pose.as_mut());
        let actions = found.pose_action.as_mut().zip(expected.pose_action.as_mut());
        for (found, expected) in targets.chain(poses).chain(actions) {
            assert!((found.rotation - expected.rotation).amax() <= ROUNDING, "{what}");
            found.rotation = expected.rotation;
        }
    }
    assert_eq!(&found, expected, "{what}");
}

#[test]
fn a_recording_read_back_is_the_recording_written_and_writes_the_same_bytes() {
    for seed in 0..100 {
        let recording = random_recording(seed);
        let written = text(&recording);
        let back = Recording::read_from(written.as_bytes(), "written.jsonl")
            .unwrap_or_else(|error| panic!("seed {seed}: {error}\n{written}"));
        assert_same(&back, &recording, &format!("seed {seed}"));
        assert_eq!(text(&back), written, "seed {seed}");
    }
}

#[test]
fn features_come_in_natural_order_however_they_were_met() {
    let input = r#"{"format":"handeye-recording","version":1,"joints":["j"],"cameras":{"b":{},"a":{}}}

{"pixels":{"a":{"f10":[1,2],"f2":[3,4]},"b":{"f2":[5,6]}}}
{"time":-1,"points":{"a":{"f1":[1,2,3]}},"joints":[1e-3]}
"#;
    let recording = Recording::read_from(input.as_bytes(), "x").unwrap();
    assert_eq!(recording.features, ["f1", "f2", "f10"]);
    let detection = |camera, feature, pixel| Detection { camera, feature, pixel };
    let expected = [detection(0, 1, [5.0, 6.0]), detection(1, 1, [3.0, 4.0]), detection(1, 2, [1.0, 2.0])];
    assert_eq!(recording.samples[0].pixels, expected);
    assert_eq!(recording.samples[1].points, [PointDetection { camera: 1, feature: 0, point: [1.0, 2.0, 3.0] }]);
    assert_eq!(recording.samples[1].joints, Some(vec![0.001]));
}

#[test]
fn a_recording_is_read_as_a_stream_with_the_line_of_every_sample() {
    let input = "\u{feff}{\"format\":\"handeye-recording\",\"version\":1,\"joints\":[\"j\"],\"cameras\":{}}\r\n\r\n\
                 {\"joints\":[1]}\r\n  \n{\"joints\":[2]}";
    let mut reader = Reader::new(input.as_bytes(), "x").unwrap();
    assert_eq!(reader.joints(), ["j"]);
    assert!(reader.cameras().is_empty());
    let lines: Vec<(usize, Option<Vec<f64>>)> =
        reader.by_ref().map(|sample| sample.map(|(line, sample)| (line, sample.joints)).unwrap()).collect();
    assert_eq!(lines, [(3, Some(vec![1.0])), (5, Some(vec![2.0]))]);
    assert!(reader.next().is_none());

    let mut broken =
        Reader::new("{\"format\":\"handeye-recording\",\"version\":1}\n{\"time\":}\n{}\n".as_bytes(), "x").unwrap();
    assert!(matches!(broken.next(), Some(Err(Error::Malformed { line: 2, .. }))));
    assert!(broken.next().is_none(), "nothing follows an error");
}

fn file(folder: &Folder, name: &str, text: &str) -> PathBuf {
    folder.write(name, text).path().join(name)
}

fn header(joints: &str, cameras: &str) -> String {
    format!("{{\"format\":\"handeye-recording\",\"version\":1,\"joints\":{joints},\"cameras\":{cameras}}}\n")
}

#[test]
fn several_recordings_join_and_no_command_leads_from_one_into_the_next() {
    let folder = Folder::new("join");
    let sample = |camera: &str, feature: &str| {
        format!("{{\"joint_action\":[0.5],\"pixels\":{{\"{camera}\":{{\"{feature}\":[1,2]}}}}}}\n")
    };
    let first = header(r#"["j"]"#, r#"{"left":{"size":[640,480]}}"#) + &sample("left", "f10") + &sample("left", "f10");
    let second = header(r#"["j"]"#, r#"{"right":{"fx":600},"left":{"fx":500,"size":[640,480]}}"#)
        + &sample("left", "f2")
        + &sample("right", "f10");
    let joined = Recording::read_all(&[file(&folder, "1.jsonl", &first), file(&folder, "2.jsonl", &second)]).unwrap();
    assert_eq!(joined.cameras.iter().map(|camera| camera.name.as_str()).collect::<Vec<_>>(), ["left", "right"]);
    assert_eq!((joined.cameras[0].fx, joined.cameras[0].size), (Some(500.0), Some([640, 480])));
    assert_eq!(joined.features, ["f2", "f10"]);
    let seen: Vec<(u32, u32)> = joined.samples.iter().map(|s| (s.pixels[0].camera, s.pixels[0].feature)).collect();
    assert_eq!(seen, [(0, 1), (0, 1), (0, 0), (1, 1)]);
    let actions: Vec<bool> = joined.samples.iter().map(|sample| sample.joint_action.is_some()).collect();
    assert_eq!(actions, [true, false, true, true]);
}

#[test]
fn recordings_of_different_rigs_do_not_join_and_both_files_are_named() {
    let folder = Folder::new("mismatch");
    let base =
        file(&folder, "base.jsonl", &(header(r#"["a","b"]"#, r#"{"left":{"size":[640,480],"fx":600}}"#) + "{}\n"));
    let other_joints = file(&folder, "joints.jsonl", &(header(r#"["b","a"]"#, "{}") + "{}\n"));
    let other_camera = file(&folder, "camera.jsonl", &(header(r#"["a","b"]"#, r#"{"left":{"fx":601}}"#) + "{}\n"));
    for (other, words) in
        [(other_joints, "different robots"), (other_camera, "disagree about camera `left`: `fx` is 600.0 and 601.0")]
    {
        let error = Recording::read_all(&[base.clone(), other.clone()]).unwrap_err();
        let message = error.to_string();
        assert!(matches!(error, Error::Unusable(_)), "{message}");
        for part in [words, &base.display().to_string(), &other.display().to_string()] {
            assert!(message.contains(part), "{message}");
        }
    }
    assert!(matches!(Recording::read_all(&[]), Err(Error::Unusable(_))));
}

/// Two arms in one recording, of which a rig is one.
#[test]
fn joints_of_a_recording_are_chosen_and_ordered_by_name_as_those_of_a_table() {
    let folder = Folder::new("chosen-joints");
    let lines = header(r#"["left_a","left_b","right_a","right_b"]"#, "{}")
        + "{\"joints\":[1,2,3,4],\"joint_action\":[0.1,0.2,0.3,0.4]}\n{\"joints\":[5,6,7,8]}\n";
    let path = file(&folder, "two.jsonl", &lines);
    let names = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
    let open = |joints: &[&str]| {
        let options = OpenOptions { joints: names(joints), known_joints: names(&["a", "b"]), ..OpenOptions::default() };
        Recording::open_with(&path, &options)
    };
    let Opened { recording, notes, .. } = open(&["right_b", "right_a"]).unwrap();
    assert_eq!(recording.joints, ["right_b", "right_a"]);
    assert_eq!(recording.samples[0].joints, Some(vec![4.0, 3.0]));
    assert_eq!(recording.samples[0].joint_action, Some(vec![0.4, 0.3]));
    assert_eq!(recording.samples[1].joints, Some(vec![8.0, 7.0]));
    assert_eq!(notes, ["joints that are left out: left_a, left_b; those that are taken: right_b, right_a"]);
    for (joints, says) in [
        (
            &[][..],
            "two.jsonl: several joints may be meant, whose first would be left_a or right_a: --joints names those of one robot",
        ),
        (&["left_a", "left_c"], "two.jsonl: there is no joint `left_c`"),
        (&["left_a", "left_a"], "two.jsonl: --joints names `left_a` twice"),
    ] {
        let error = open(joints).unwrap_err();
        assert!(matches!(error, Error::Unusable(_)) && error.to_string().contains(says), "{says}: {error}");
    }
    folder.write("arm.toml", "[[robot.joints]]\nname = \"a\"\n[[robot.joints]]\nname = \"b\"\n");
    folder.expect(2, "check arm.toml two.jsonl");
    let (text, _) = folder.expect(0, "check arm.toml two.jsonl --joints left_a,left_b");
    assert!(text.contains("joints that are left out: right_a, right_b"), "{text}");
}

#[test]
fn files_of_one_robot_join_whatever_the_order_of_its_joints_and_what_is_beside_them() {
    let folder = Folder::new("join-by-name");
    let first = file(&folder, "1.jsonl", &(header(r#"["a","b"]"#, "{}") + "{\"joints\":[1,2]}\n"));
    let next = file(&folder, "2.jsonl", &(header(r#"["finger","arm_b","arm_a"]"#, "{}") + "{\"joints\":[7,4,3]}\n"));
    let Opened { recording, notes, .. } =
        Recording::open_all(&[first.clone(), next.clone()], &OpenOptions::default()).unwrap();
    assert_eq!(recording.joints, ["a", "b"]);
    assert_eq!(recording.samples[1].joints, Some(vec![3.0, 4.0]));
    assert!(notes.iter().any(|note| note.contains("2.jsonl: joints that are left out: finger")), "{notes:?}");
    // The joints of the first file say which of two arms is meant in all others.
    let header = |joints: &str| header(joints, "{}");
    let left = file(&folder, "3.jsonl", &(header(r#"["left_a","left_b"]"#) + "{\"joints\":[1,2]}\n"));
    let both = header(r#"["right_b","right_a","left_b","left_a"]"#) + "{\"joints\":[9,8,6,5]}\n";
    let bare = file(&folder, "5.jsonl", &(header(r#"["finger","b","a"]"#) + "{\"joints\":[7,4,3]}\n"));
    let both = file(&folder, "4.jsonl", &both);
    let joined = Recording::open_all(&[left, bare, both], &OpenOptions::default()).unwrap().recording;
    assert_eq!(joined.joints, ["left_a", "left_b"]);
    let joints: Vec<Vec<f64>> = joined.samples.into_iter().map(|sample| sample.joints.unwrap()).collect();
    assert_eq!(joints, [[1.0, 2.0], [3.0, 4.0], [5.0, 6.0]]);
    let error = Recording::open_all(&[next, first], &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.contains("joints finger, arm_b, arm_a and a, b; where they are of one robot"), "{error}");
}

#[test]
fn what_cannot_be_read_back_is_not_written() {
    let folder = Folder::new("not-finite");
    let path = file(&folder, "recording.jsonl", "old");
    let mut recording = random_recording(1);
    recording.samples[0].time = Some(f64::NAN);
    assert!(matches!(recording.write(&path), Err(Error::Io { .. })));
    assert_eq!(std::fs::read_to_string(&path).unwrap(), "old");
    recording.samples[0].time = Some(0.5);
    recording.write(&path).unwrap();
    assert_same(&Recording::read(&path).unwrap(), &recording, "on disk");
}

#[test]
fn what_is_known_of_a_camera_is_said_of_every_file_that_has_it_and_a_camera_that_none_has_is_refused() {
    let folder = Folder::new("files-cameras");
    for (file, cameras) in [("left", &["left"][..]), ("right", &["right"]), ("both", &["left", "right"])] {
        let seen: Vec<String> = cameras.iter().map(|camera| format!("\"{camera}\":{{\"f0\":[1,2]}}")).collect();
        let headers: Vec<String> = cameras.iter().map(|camera| format!("\"{camera}\":{{}}")).collect();
        let header = format!("\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{{{}}}", headers.join(","));
        folder.write(&format!("{file}.jsonl"), &format!("{{{header}}}\n{{\"pixels\":{{{}}}}}\n", seen.join(",")));
    }
    let paths = ["left", "right", "both"].map(|file| folder.path().join(format!("{file}.jsonl")));
    let known = |name: &str| OpenOptions {
        cameras: vec![RecordedCamera {
            name: name.into(),
            size: Some([640, 480]),
            fx: Some(500.0),
            ..Default::default()
        }],
        ..OpenOptions::default()
    };
    let cameras = Recording::open_all(&paths, &known("right")).unwrap().recording.cameras;
    let found: Vec<_> = cameras.iter().map(|camera| (camera.name.as_str(), camera.size, camera.fx)).collect();
    assert_eq!(found, [("left", None, None), ("right", Some([640, 480]), Some(500.0))]);
    let error = Recording::open_all(&paths, &known("rihgt")).unwrap_err().to_string();
    assert!(error.ends_with("both.jsonl: there are no images of a camera `rihgt` (did you mean `right`?)"), "{error}");
    let (_, error) = folder.expect(2, "calibrate left.jsonl right.jsonl --camera top=640x480 -o x.toml");
    let expected = "error: left.jsonl, right.jsonl: there are no images of a camera `top`";
    assert!(error.starts_with(expected), "{error}");
    // Two files may not have two sizes of it.
    folder.write(
        "small.jsonl",
        &folder.read("right.jsonl").replace("{\"right\":{}}", "{\"right\":{\"size\":[320,240]}}"),
    );
    let (_, error) = folder.expect(2, "calibrate left.jsonl small.jsonl --camera right=640x480 -o x.toml");
    assert!(error.starts_with("error: small.jsonl: camera `right` is said to be of 640 x 480 px"), "{error}");
}

#[test]
fn joints_that_the_rig_does_not_have_are_left_out_of_a_recording_by_their_names_and_told() {
    let folder = Folder::new("files-joints");
    let text = "{\"format\":\"handeye-recording\",\"version\":1,\"joints\":[\"finger\",\"b\",\"a\"],\"cameras\":{}}\n\
        {\"joints\":[7,2,1],\"joint_action\":[70,20,10]}\n{\"joints\":[8,3,2]}\n";
    folder.write("rec.jsonl", text);
    let known_joints = vec!["a".to_owned(), "b".to_owned()];
    let options = OpenOptions { known_joints, ..OpenOptions::default() };
    let Opened { recording, notes, .. } = Recording::open_with(&folder.path().join("rec.jsonl"), &options).unwrap();
    assert_eq!((&recording.joints, &recording.samples[0].joints), (&options.known_joints, &Some(vec![1.0, 2.0])));
    assert_eq!(recording.samples[0].joint_action, Some(vec![10.0, 20.0]));
    let left_out = "joints that are left out: finger; those that are taken: a, b";
    assert!(notes.len() == 2 && notes[1] == left_out, "{notes:?}");
}
