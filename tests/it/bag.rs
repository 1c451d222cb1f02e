//! Bags of ROS 2: read as the recordings that they came from.
use crate::cli::Folder;
use handeye::recording::{BagOptions, OpenOptions, Opened, Recording};
use handeye::rig::catalog;
use handeye::simulate::{SimulateOptions, simulate};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::io::Cursor;
use std::path::Path;

#[path = "../../benches/common/cdr.rs"]
pub mod cdr;

use cdr::Cdr;

pub const HEADER: &str = "std_msgs/Header header\n";
pub const HEADER_PARTS: &str = "================================================================================\n\
    MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\n\
    MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
pub const JOINTS: &str = "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n";
const INFO: &str = "uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n\
    uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n";
const INFO_PARTS: &str = "================================================================================\n\
    MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n";
const TAGS: &str = "apriltag_msgs/AprilTagDetection[] detections\n";
const TAGS_PARTS: &str = "================================================================================\n\
    MSG: apriltag_msgs/AprilTagDetection\nstring family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\n\
    apriltag_msgs/Point centre\napriltag_msgs/Point[4] corners\nfloat64[9] homography\n\
    ================================================================================\n\
    MSG: apriltag_msgs/Point\nfloat64 x\nfloat64 y\n";

pub fn joint_state(stamp: u64, names: &[String], positions: &[f64]) -> Vec<u8> {
    let mut cdr = Cdr::stamped(stamp, "");
    cdr.int(names.len() as u32);
    names.iter().for_each(|name| cdr.text(name));
    cdr.sequence(positions);
    cdr.sequence(&[]);
    cdr.sequence(&[]);
    cdr.bytes
}

/// When each sample is, the states before and after it, and the order of the joints in a state [ns].
const EVERY: u64 = 100_000_000;

/// The recording as a bag: joints at the stamps of images, tags of one feature per corner.
pub fn bag(recording: &Recording, options: WriteOptions, shuffled: bool) -> Vec<u8> {
    let mut writer = options.create(Cursor::new(Vec::new())).unwrap();
    let mut channel = |topic: &str, kind: &str, text: String| {
        let schema = writer.add_schema(kind, "ros2msg", text.as_bytes()).unwrap();
        writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap()
    };
    let joints = channel("/joint_states", "sensor_msgs/msg/JointState", format!("{HEADER}{JOINTS}{HEADER_PARTS}"));
    let cameras: Vec<(u16, u16)> = recording
        .cameras
        .iter()
        .map(|camera| {
            let info = format!("{HEADER}{INFO}{HEADER_PARTS}{INFO_PARTS}");
            let tags = format!("{HEADER}{TAGS}{HEADER_PARTS}{TAGS_PARTS}");
            let name = &camera.name;
            (
                channel(&format!("/{name}/camera_info"), "sensor_msgs/msg/CameraInfo", info),
                channel(&format!("/{name}/tags"), "apriltag_msgs/msg/AprilTagDetectionArray", tags),
            )
        })
        .collect();
    let mut write = |channel_id: u16, time: u64, data: &[u8]| {
        let header = MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, data).unwrap();
    };
    for (camera, (info, _)) in recording.cameras.iter().zip(&cameras) {
        let [width, height] = camera.size.unwrap();
        let mut cdr = Cdr::stamped(0, &camera.name);
        cdr.int(height);
        cdr.int(width);
        cdr.text("plumb_bob");
        cdr.sequence(&[0.0; 5]);
        let k = [camera.fx, camera.cx, camera.fy, camera.cy].map(Option::unwrap);
        [k[0], 0.0, k[1], 0.0, k[2], k[3], 0.0, 0.0, 1.0].iter().for_each(|number| cdr.float(*number));
        (0..21).for_each(|_| cdr.float(0.0));
        (0..6).for_each(|_| cdr.int(0));
        cdr.byte(0);
        write(*info, 1, &cdr.bytes);
    }
    let mut order: Vec<usize> = (0..recording.joints.len()).collect();
    if shuffled {
        order.reverse();
    }
    let names: Vec<String> = order.iter().map(|joint| recording.joints[*joint].clone()).collect();
    for (index, sample) in recording.samples.iter().enumerate() {
        let stamp = 1_000_000_000 + EVERY * index as u64;
        let read = sample.joints.as_ref().unwrap();
        let positions: Vec<f64> = order.iter().map(|joint| read[*joint]).collect();
        write(joints, stamp, &joint_state(stamp, &names, &positions));
        for (camera, (_, tags)) in cameras.iter().enumerate() {
            let seen: Vec<_> = sample.pixels.iter().filter(|seen| seen.camera as usize == camera).collect();
            let tags_seen: Vec<u32> = (0..recording.features.len() as u32 / 4)
                .filter(|tag| (0..4).all(|corner| seen.iter().any(|seen| seen.feature == 4 * tag + corner)))
                .collect();
            let mut cdr = Cdr::stamped(stamp, &recording.cameras[camera].name);
            cdr.int(tags_seen.len() as u32);
            for tag in tags_seen {
                cdr.text("tag36h11");
                cdr.int(tag);
                cdr.int(0);
                cdr.int(0);
                cdr.int(0);
                (0..2).for_each(|_| cdr.float(0.0));
                for corner in 0..4 {
                    let seen = seen.iter().find(|seen| seen.feature == 4 * tag + corner).unwrap();
                    seen.pixel.iter().for_each(|number| cdr.float(*number));
                }
                (0..9).for_each(|_| cdr.float(0.0));
            }
            write(*tags, stamp, &cdr.bytes);
        }
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// A recording of whole tags, as a bag can hold it.
fn recorded() -> Recording {
    let rig = catalog::rig("ur5").unwrap();
    let options = SimulateOptions { samples: 40, in_view: 1.0, seed: 3, ..SimulateOptions::default() };
    let mut recording = simulate(&rig, &options).unwrap().recording;
    recording.features = (0..12).map(|k| format!("tag36h11:{}/{}", k / 4, k % 4)).collect();
    for (index, sample) in recording.samples.iter_mut().enumerate() {
        sample.time = Some(1.0 + 0.1 * index as f64);
        (sample.joint_action, sample.pose_action, sample.pose) = (None, None, None);
    }
    recording
}

fn read(bytes: &[u8], folder: &Folder) -> Result<Opened, handeye::Error> {
    // In the order of a rig, so that nothing has to be said of it.
    let known_joints = recorded().joints;
    read_with(bytes, folder, &OpenOptions { known_joints, ..OpenOptions::default() })
}

pub fn read_with(bytes: &[u8], folder: &Folder, options: &OpenOptions) -> Result<Opened, handeye::Error> {
    std::fs::write(folder.path().join("bag.mcap"), bytes).unwrap();
    Recording::open_with(&folder.path().join("bag.mcap"), options)
}

const POSE: &str = "geometry_msgs/Pose pose\n";
const TRANSFORMS: &str = "geometry_msgs/TransformStamped[] transforms\n";
const SPACE: &str = "================================================================================\n\
    MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n\
    ================================================================================\n\
    MSG: geometry_msgs/TransformStamped\nstd_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n\
    ================================================================================\n\
    MSG: geometry_msgs/Transform\ngeometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n\
    ================================================================================\n\
    MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ================================================================================\n\
    MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ================================================================================\n\
    MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";

/// An image of one tag each 0.1 s from 1 s on, and the messages beside: topic, type, schema, time [ns] and bytes.
pub fn images_beside(n: u64, others: &[(&str, &str, String, u64, Vec<u8>)]) -> Vec<u8> {
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    let mut write = |topic: &str, kind: &str, text: &str, time: u64, data: &[u8]| {
        let schema = writer.add_schema(kind, "ros2msg", text.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, data).unwrap();
    };
    let images = (0..n).map(|index| image("/left/tags", "left", 1_000_000_000 + EVERY * index));
    for (topic, kind, text, time, data) in images.collect::<Vec<_>>().iter().chain(others) {
        write(topic, kind, text, *time, data);
    }
    writer.finish().unwrap();
    writer.into_inner().into_inner()
}

/// An image of one tag: topic, type, schema, time [ns] and bytes.
pub fn image(topic: &'static str, frame: &str, stamp: u64) -> (&'static str, &'static str, String, u64, Vec<u8>) {
    let mut cdr = Cdr::stamped(stamp, frame);
    cdr.int(1);
    cdr.text("tag36h11");
    (0..4).for_each(|_| cdr.int(0));
    (0..19).for_each(|number| cdr.float(f64::from(number)));
    let text = format!("{HEADER}{TAGS}{HEADER_PARTS}{TAGS_PARTS}");
    (topic, "apriltag_msgs/msg/AprilTagDetectionArray", text, stamp, cdr.bytes)
}

/// A pose: origin, then the quaternion of a turn about z.
fn put_pose(cdr: &mut Cdr, xyz: [f64; 3], angle: f64) {
    xyz.iter().chain(&[0.0, 0.0, (0.5 * angle).sin(), (0.5 * angle).cos()]).for_each(|number| cdr.float(*number));
}

fn transform(parent: &str, child: &str, time: u64, xyz: [f64; 3], angle: f64) -> Vec<u8> {
    let mut cdr = Cdr::new(false);
    cdr.int(1);
    cdr.int((time / 1_000_000_000) as u32);
    cdr.int((time % 1_000_000_000) as u32);
    cdr.text(parent);
    cdr.text(child);
    put_pose(&mut cdr, xyz, angle);
    cdr.bytes
}

#[test]
fn states_are_interpolated_to_the_stamps_of_images_and_those_outside_are_left_open() {
    let folder = Folder::new("bag-states");
    let names = ["b".to_owned(), "a".to_owned()];
    let state = format!("{HEADER}{JOINTS}{HEADER_PARTS}");
    let pose_text = format!("{HEADER}{POSE}{HEADER_PARTS}{SPACE}");
    // Images at 1.0, 1.1, 1.2 and 1.3 s; states at 1.05 and 1.25 s.
    let times = [1_050_000_000, 1_250_000_000];
    let mut others = Vec::new();
    for (index, time) in times.into_iter().enumerate() {
        let part = index as f64;
        let joints = joint_state(time, &names, &[part, 10.0 - 2.0 * part]);
        others.push(("/joint_states", "sensor_msgs/msg/JointState", state.clone(), time, joints));
        let mut cdr = Cdr::stamped(time, "base");
        put_pose(&mut cdr, [part, 0.0, 2.0], part);
        others.push(("/tip", "geometry_msgs/msg/PoseStamped", pose_text.clone(), time, cdr.bytes));
    }
    let joints = vec!["a".to_owned(), "b".to_owned()];
    let options = OpenOptions {
        joints,
        bag: BagOptions { pose_topic: Some("tip".to_owned()), ..BagOptions::default() },
        ..OpenOptions::default()
    };
    let Opened { recording, notes, .. } = read_with(&images_beside(4, &others), &folder, &options).unwrap();
    assert_eq!(recording.joints, ["a", "b"]);
    assert_eq!(recording.samples.len(), 4);
    for (index, sample) in recording.samples.iter().enumerate() {
        let part = (index as f64 * 0.1 - 0.05) / 0.2;
        if !(0.0..=1.0).contains(&part) {
            assert_eq!((&sample.joints, sample.pose.is_none()), (&None, true), "sample {index}");
            continue;
        }
        let [a, b] = sample.joints.as_ref().unwrap()[..] else { panic!() };
        assert!((a - (10.0 - 2.0 * part)).abs() < 1e-12 && (b - part).abs() < 1e-12, "{a} {b} at {part}");
        let pose = sample.pose.unwrap();
        let angle = pose.rotation[(1, 0)].atan2(pose.rotation[(0, 0)]);
        assert!((angle - part).abs() < 1e-12 && (pose.translation.x - part).abs() < 1e-12, "{pose:?} at {part}");
    }
    let said = notes.join("\n");
    assert!(said.contains("joint states are interpolated, between two that are up to 0.200000 s apart"), "{said}");
    assert!(said.contains("2 of 4 samples are outside the joint states"), "{said}");
}

#[test]
fn the_tip_is_found_in_the_tree_of_frames_and_a_way_that_is_not_there_is_refused() {
    let folder = Folder::new("bag-frames");
    let text = format!("{TRANSFORMS}{HEADER_PARTS}{SPACE}");
    let kind = "tf2_msgs/msg/TFMessage";
    let at = |time| 1_000_000_000 + time;
    // world -> base stands, world -> arm moves along x and turns, arm -> tip stands.
    let others = [
        (
            "/tf_static",
            kind,
            text.clone(),
            1,
            transform("world", "base", 0, [1.0, 2.0, 0.0], std::f64::consts::FRAC_PI_2),
        ),
        ("/tf_static", kind, text.clone(), 2, transform("arm", "tip", 0, [0.0, 0.5, 0.0], 0.0)),
        ("/tf", kind, text.clone(), at(0), transform("world", "arm", at(0), [1.0, 2.0, 3.0], 0.0)),
        ("/tf", kind, text.clone(), at(2 * EVERY), transform("world", "arm", at(2 * EVERY), [3.0, 2.0, 3.0], 0.4)),
    ];
    let bytes = images_beside(3, &others);
    let frames = |tip: &str| OpenOptions {
        bag: BagOptions { frames: Some(["base".to_owned(), tip.to_owned()]), ..BagOptions::default() },
        ..OpenOptions::default()
    };
    let found = read_with(&bytes, &folder, &frames("tip")).unwrap().recording;
    for (index, sample) in found.samples.iter().enumerate() {
        let part = index as f64 / 2.0;
        let (x, angle) = (1.0 + 2.0 * part, 0.4 * part);
        // The tip in the world, then as the base sees it, which is turned by a quarter.
        let world = [x - 0.5 * angle.sin() - 1.0, 2.0 + 0.5 * angle.cos() - 2.0];
        let pose = sample.pose.unwrap();
        let expected = [world[1], -world[0], 3.0];
        let off = (0..3).map(|k| (pose.translation[k] - expected[k]).abs()).fold(0.0, f64::max);
        assert!(off < 1e-12, "sample {index}: {:?} and {expected:?}", pose.translation);
    }
    let error = read_with(&bytes, &folder, &frames("gripper")).unwrap_err().to_string();
    assert!(error.contains("no way from `base` to `gripper`") && error.contains("arm, base, tip"), "{error}");
    assert!(error.ends_with("--base-frame and --tip-frame name two that hang together"), "{error}");
}

#[test]
fn a_bag_of_every_layout_is_the_recording_that_it_came_from() {
    let folder = Folder::new("bag-layouts");
    let recording = recorded();
    let layouts = [
        WriteOptions::new().compression(Some(Compression::Zstd)),
        WriteOptions::new().compression(Some(Compression::Lz4)),
        WriteOptions::new().compression(None).chunk_size(Some(2000)),
        WriteOptions::new().compression(None).use_chunks(false),
    ];
    for options in layouts {
        let Opened { recording: found, notes, .. } = read(&bag(&recording, options, false), &folder).unwrap();
        assert_eq!(found.joints, recording.joints);
        assert_eq!(found.features, recording.features);
        assert_eq!(found.samples.len(), recording.samples.len());
        for (found, sample) in found.samples.iter().zip(&recording.samples) {
            assert_eq!((&found.joints, &found.pixels), (&sample.joints, &sample.pixels));
            assert!((found.time.unwrap() - sample.time.unwrap()).abs() < 1e-9);
        }
        assert_eq!(found.cameras.len(), recording.cameras.len());
        for (found, camera) in found.cameras.iter().zip(&recording.cameras) {
            assert_eq!(
                (&found.name, found.size, found.fx, found.cy),
                (&camera.name, camera.size, camera.fx, camera.cy)
            );
        }
        assert!(notes.is_empty(), "{notes:?}");
    }
}

#[test]
fn the_rig_learned_from_a_bag_is_that_of_the_recording_byte_for_byte_in_any_order_of_joints() {
    let folder = Folder::new("bag-calibrate");
    let recording = recorded();
    folder.write(
        "rig.toml",
        &format!("[robot]\njoints = [{}]\n", {
            let joint = |name: &String| format!("{{ name = \"{name}\" }}");
            recording.joints.iter().map(joint).collect::<Vec<_>>().join(", ")
        }),
    );
    std::fs::write(folder.path().join("bag.mcap"), bag(&recording, WriteOptions::new(), true)).unwrap();
    let names = recording.joints.join(",");
    let (said, _) = folder.expect(0, "convert bag.mcap -o as-it-stands.jsonl");
    assert!(said.contains("in the order of the joint state that has most: wrist_3, wrist_2"), "{said}");
    let (said, _) = folder.expect(0, &format!("convert bag.mcap --joints {names} -o converted.jsonl"));
    assert!(
        said.starts_with("converted.jsonl: 40 samples of 6 joints, 2 cameras with 12 features, 960 detections"),
        "{said}"
    );
    let mut plain = Recording::read(&folder.path().join("converted.jsonl")).unwrap();
    // What stands in the file, without the way through a bag.
    for (sample, other) in plain.samples.iter_mut().zip(&recording.samples) {
        assert_eq!((&sample.joints, &sample.pixels), (&other.joints, &other.pixels));
        sample.time = other.time;
    }
    plain.write(&folder.path().join("plain.jsonl")).unwrap();
    folder.expect(0, "calibrate bag.mcap --rig rig.toml -o from-bag.toml");
    folder.expect(0, "calibrate plain.jsonl --rig rig.toml -o from-plain.toml");
    assert_eq!(folder.read("from-bag.toml"), folder.read("from-plain.toml"));
}

#[test]
fn a_bag_that_is_cut_off_anywhere_is_read_as_far_as_it_goes_or_refused_with_the_reason() {
    let folder = Folder::new("bag-cut");
    let recording = recorded();
    let whole = bag(&recording, WriteOptions::new().compression(None).chunk_size(Some(4000)), false);
    let (mut shorter, mut refused) = (0, 0);
    for end in (0..whole.len()).step_by(997) {
        match read(&whole[..end], &folder) {
            Ok(Opened { recording: found, notes, .. }) => {
                assert!(found.samples.len() <= recording.samples.len());
                if found.samples.len() < recording.samples.len() {
                    assert!(!notes.is_empty(), "cut at {end}: {} samples and not a word", found.samples.len());
                    shorter += 1;
                }
            }
            Err(error) => {
                assert!(error.to_string().contains("bag.mcap"), "{error}");
                refused += 1;
            }
        }
    }
    assert!(shorter > 20 && refused >= 1, "{shorter} shorter, {refused} refused");
    // Bytes that are wrong in the middle end no program.
    let mut broken = whole.clone();
    for place in (0..whole.len()).step_by(3001) {
        broken[place] ^= 0x5a;
        let _ = read(&broken, &folder);
        broken[place] = whole[place];
    }
}

#[test]
fn what_a_bag_lacks_is_said_with_what_it_has() {
    let folder = Folder::new("bag-mistakes");
    let recording = recorded();
    std::fs::write(folder.path().join("bag.mcap"), bag(&recording, WriteOptions::new(), false)).unwrap();
    folder.write("no.mcap", "{\"format\":\"handeye-recording\"}");
    for (arguments, says) in [
        (
            "bag.mcap --joint-topic /nowhere",
            "bag.mcap: --joint-topic names `/nowhere`, on which there are no such messages; there are /joint_states (",
        ),
        (
            "bag.mcap --camera-topic /nowhere",
            "bag.mcap: has no image with features (apriltag_msgs/AprilTagDetectionArray or vision_msgs/Detection2DArray) on the topics of \
             --camera-topic; it has /joint_states (",
        ),
        ("bag.mcap --joints elbow,wrist_9", "bag.mcap: /joint_states: has no joint `wrist_9`; it has shoulder_pan, "),
        ("no.mcap", "no.mcap: is no MCAP file\n"),
    ] {
        let (_, error) = folder.expect(2, &format!("convert {arguments} -o out.jsonl"));
        assert!(error.starts_with(&format!("error: {says}")), "{arguments}: {error}");
    }
    assert!(!folder.path().join("out.jsonl").exists());
}

/// The bag in two files, the second of which has its own numbers of channels, in the folder that ROS 2 makes.
fn split(bytes: &[u8], folder: &Path) {
    std::fs::create_dir_all(folder).unwrap();
    std::fs::write(folder.join("metadata.yaml"), "rosbag2_bagfile_information: {}\n").unwrap();
    let messages: Vec<_> = mcap::MessageStream::new(bytes).unwrap().map(Result::unwrap).collect();
    let (first, second) = messages.split_at(messages.len() / 2);
    // Letter by letter the second one comes first.
    for (name, part) in [("run_9.mcap", first), ("run_10.mcap", second)] {
        let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
        part.iter().for_each(|message| writer.write(message).unwrap());
        writer.finish().unwrap();
        std::fs::write(folder.join(name), writer.into_inner().into_inner()).unwrap();
    }
}

#[test]
fn the_folder_of_a_bag_that_was_split_is_read_as_the_whole_bag() {
    let folder = Folder::new("bag-folder");
    let bytes = bag(&recorded(), WriteOptions::new(), true);
    let whole = read(&bytes, &folder).unwrap();
    let parts = folder.path().join("run");
    split(&bytes, &parts);
    let options = OpenOptions { known_joints: recorded().joints, ..OpenOptions::default() };
    let joined = Recording::open_with(&parts, &options).unwrap();
    assert_eq!(joined.recording, whole.recording);
    assert_eq!(joined.notes, whole.notes);
    folder.expect(0, "convert run -o run.jsonl --join 0");
    folder.expect(0, "check ur5 run");
    // A part that is cut off is named, and the other one is read.
    let last = std::fs::read(parts.join("run_10.mcap")).unwrap();
    std::fs::write(parts.join("run_10.mcap"), &last[..last.len() / 2]).unwrap();
    let cut = Recording::open_with(&parts, &options).unwrap();
    assert!(cut.notes[0].starts_with("run_10.mcap: is cut off at byte"), "{:?}", cut.notes);
    // A recorder that was killed leaves no metadata.
    std::fs::remove_file(parts.join("metadata.yaml")).unwrap();
    assert_eq!(Recording::open_with(&parts, &options).unwrap().recording, cut.recording);
}

#[test]
fn a_bag_in_sqlite_is_refused_with_what_makes_it_one_that_is_read() {
    let folder = Folder::new("bag-sqlite");
    std::fs::create_dir(folder.path().join("run")).unwrap();
    folder.write("run/metadata.yaml", "").write("run/run_0.db3", "SQLite format 3");
    for file in ["run", "run/run_0.db3"] {
        let (_, err) = folder.expect(2, &format!("calibrate {file} -o learned.toml"));
        assert!(err.starts_with(&format!("error: {file}: is a bag in SQLite")), "{err}");
        assert!(err.contains(&format!("`ros2 bag convert -i {file} -o mcap.yaml`")), "{err}");
    }
    std::fs::create_dir(folder.path().join("other")).unwrap();
    folder.write("other/text", "");
    let (_, err) = folder.expect(2, "calibrate other -o learned.toml");
    assert!(err.contains("is a folder, and neither a LeRobot dataset") && err.contains("nor a bag"), "{err}");
}
