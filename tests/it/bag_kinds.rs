//! Messages of bags in the forms that writers give them: both byte orders, both generations of Detection2D.
use crate::bag::cdr::Cdr;
use crate::cli::Folder;
use handeye::camera::CameraModel;
use handeye::recording::{OpenOptions, Opened, Recording};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::io::Cursor;

const LINE: &str = "================================================================================\n";
const STANDARD: &str = "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\n\
    MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";

/// Reads a bag of these messages: topic, type, schema, bytes.
fn read(folder: &Folder, messages: &[(&str, &str, String, Cdr)]) -> Result<Opened, handeye::Error> {
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    for (time, (topic, kind, text, cdr)) in messages.iter().enumerate() {
        let schema = writer.add_schema(kind, "ros2msg", text.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let time = time as u64;
        let header = MessageHeader { channel_id, sequence: 0, log_time: time, publish_time: time };
        writer.write_to_known_channel(&header, &cdr.bytes).unwrap();
    }
    writer.finish().unwrap();
    std::fs::write(folder.path().join("bag.mcap"), writer.into_inner().into_inner()).unwrap();
    Recording::open_with(&folder.path().join("bag.mcap"), &OpenOptions::default())
}

/// Names and pixels of one sample.
fn seen(bag: &Opened, sample: usize) -> Vec<(&str, [f64; 2])> {
    let recording = &bag.recording;
    let named = |seen: &handeye::recording::Detection| (recording.features[seen.feature as usize].as_str(), seen.pixel);
    recording.samples[sample].pixels.iter().map(named).collect()
}

/// Joints, camera and tags, with numbers of every width among them.
fn joints_camera_and_tags(is_big: bool) -> [(&'static str, &'static str, String, Cdr); 3] {
    let mut joints = Cdr::new(is_big);
    joints.header(12, 500_000_000, "base");
    // Numbers of one and two bytes before those of eight: what is skipped has to be skipped to the right place.
    joints.byte(7);
    joints.short(513);
    joints.int(2);
    joints.text("lift");
    joints.text("elbow");
    joints.int(2);
    joints.floats(&[-1.25, 1e-3]);
    let joints_text = format!(
        "std_msgs/Header header\nuint8 source\nuint16 sequence\nstring[] name\nfloat64[] position\n{LINE}{STANDARD}"
    );

    let mut info = Cdr::new(is_big);
    info.header(0, 0, "left");
    info.int(480);
    info.int(640);
    info.text("plumb_bob");
    info.int(5);
    info.floats(&[-0.25, 0.125, 1e-4, -2e-4, 0.0]);
    info.floats(&[600.5, 0.0, 319.25, 0.0, 601.5, 239.75, 0.0, 0.0, 1.0]);
    let info_text = format!(
        "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\n{LINE}{STANDARD}"
    );

    let mut tags = Cdr::new(is_big);
    tags.header(12, 500_000_000, "left");
    tags.int(1);
    tags.text("tag36h11");
    tags.int(300);
    tags.int(0);
    tags.half(0.5);
    tags.half(80.25);
    tags.floats(&[1.0, 2.0]);
    tags.floats(&[10.5, 20.25, 30.0, 20.5, 30.5, 40.0, 10.0, 40.5]);
    let tags_text = format!(
        "std_msgs/Header header\napriltag_msgs/AprilTagDetection[] detections\n{LINE}{STANDARD}{LINE}\
        MSG: apriltag_msgs/AprilTagDetection\nstring family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\n\
        float64[2] centre\nfloat64[8] corners\n"
    );
    [
        ("/joint_states", "sensor_msgs/msg/JointState", joints_text, joints),
        ("/left/camera_info", "sensor_msgs/msg/CameraInfo", info_text, info),
        ("/left/tags", "apriltag_msgs/msg/AprilTagDetectionArray", tags_text, tags),
    ]
}

#[test]
fn a_bag_says_the_same_in_both_byte_orders() {
    let folder = Folder::new("bag-byte-orders");
    for is_big in [false, true] {
        let bag = read(&folder, &joints_camera_and_tags(is_big)).unwrap();
        let recording = &bag.recording;
        assert_eq!(recording.joints, ["lift", "elbow"]);
        let [sample] = &recording.samples[..] else { panic!("{} samples", recording.samples.len()) };
        assert_eq!((sample.time, sample.joints.as_deref()), (Some(12.5), Some(&[-1.25, 1e-3][..])));
        let corners = [[10.5, 20.25], [30.0, 20.5], [30.5, 40.0], [10.0, 40.5]];
        let expected = ["tag36h11:300/0", "tag36h11:300/1", "tag36h11:300/2", "tag36h11:300/3"];
        assert_eq!(seen(&bag, 0), expected.into_iter().zip(corners).collect::<Vec<_>>());
        let [camera] = &recording.cameras[..] else { panic!("{} cameras", recording.cameras.len()) };
        assert_eq!((camera.name.as_str(), camera.size), ("left", Some([640, 480])));
        assert_eq!(
            (camera.fx, camera.fy, camera.cx, camera.cy),
            (Some(600.5), Some(601.5), Some(319.25), Some(239.75))
        );
        assert_eq!(camera.model, Some(CameraModel::BrownConrady));
        assert_eq!(camera.distortion.as_deref(), Some(&[-0.25, 0.125, 1e-4, -2e-4, 0.0][..]));
    }
}

#[test]
fn an_encoding_that_is_not_plain_cdr_is_named() {
    let folder = Folder::new("bag-encodings");
    for encoding in [2, 3, 6, 7, 10] {
        let mut messages = joints_camera_and_tags(false);
        messages[2].3.bytes[1] = encoding;
        let error = read(&folder, &messages).unwrap_err().to_string();
        let named = format!("is encoded as 00 {encoding:02x}");
        assert!(error.contains("/left/tags") && error.contains(&named), "{error}");
    }
}

/// A detection: id, class, centre.
type Seen<'a> = (&'a str, &'a str, [f64; 2]);

/// A Detection2DArray as vision_msgs 4 has it (ROS 2 from Galactic on), or as 2 and 3 have it: the centre without a position, the class as
/// the id of a result, no id of its own.
fn detections(is_new: bool, is_big: bool, stamp: u32, seen: &[Seen]) -> Cdr {
    let mut cdr = Cdr::new(is_big);
    cdr.header(stamp, 0, "camera");
    cdr.int(seen.len() as u32);
    for (id, class, centre) in seen {
        cdr.header(stamp, 0, "");
        cdr.int(1);
        cdr.text(class);
        cdr.floats(&[0.875]);
        cdr.floats(&[0.0; 7 + 36]);
        cdr.floats(centre);
        cdr.floats(&[0.0, 12.0, 9.0]);
        if is_new {
            cdr.text(id);
        } else {
            cdr.byte(1);
            cdr.text("never looked at");
        }
    }
    cdr
}

const POSE: &str = "MSG: geometry_msgs/PoseWithCovariance\ngeometry_msgs/Pose pose\nfloat64[36] covariance\n\
    ================================================================================\n\
    MSG: geometry_msgs/Pose\ngeometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n\
    ================================================================================\n\
    MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\nfloat64 z\n\
    ================================================================================\n\
    MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n";

fn new_schema() -> String {
    format!(
        "std_msgs/Header header\nvision_msgs/Detection2D[] detections\n{LINE}{STANDARD}{LINE}\
        MSG: vision_msgs/Detection2D\nstd_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\nvision_msgs/BoundingBox2D bbox\n\
        string id\n{LINE}\
        MSG: vision_msgs/ObjectHypothesisWithPose\nvision_msgs/ObjectHypothesis hypothesis\ngeometry_msgs/PoseWithCovariance pose\n{LINE}\
        MSG: vision_msgs/ObjectHypothesis\nstring class_id\nfloat64 score\n{LINE}\
        MSG: vision_msgs/BoundingBox2D\nvision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n{LINE}\
        MSG: vision_msgs/Pose2D\nvision_msgs/Point2D position\nfloat64 theta\n{LINE}\
        MSG: vision_msgs/Point2D\nfloat64 x\nfloat64 y\n{LINE}{POSE}"
    )
}

fn old_schema() -> String {
    format!(
        "std_msgs/Header header\nvision_msgs/Detection2D[] detections\n{LINE}{STANDARD}{LINE}\
        MSG: vision_msgs/Detection2D\nstd_msgs/Header header\nvision_msgs/ObjectHypothesisWithPose[] results\nvision_msgs/BoundingBox2D bbox\n\
        bool is_tracking\nstring tracking_id\n{LINE}\
        MSG: vision_msgs/ObjectHypothesisWithPose\nstring id\nfloat64 score\ngeometry_msgs/PoseWithCovariance pose\n{LINE}\
        MSG: vision_msgs/BoundingBox2D\ngeometry_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n{LINE}\
        MSG: geometry_msgs/Pose2D\nfloat64 x\nfloat64 y\nfloat64 theta\n{LINE}{POSE}"
    )
}

#[test]
fn detections_are_called_by_their_id_or_by_what_they_are_most_probably_of() {
    let folder = Folder::new("bag-detections");
    let first = [("left.bolt", "bolt", [100.5, 200.25]), ("", "nut", [7.0, 8.5])];
    let second = [("left.bolt", "bolt", [101.5, 201.25]), ("lost", "nut", [f64::NAN, 0.0])];
    let kind = "vision_msgs/msg/Detection2DArray";
    for is_big in [false, true] {
        let messages = [
            ("/seen", kind, new_schema(), detections(true, is_big, 3, &first)),
            ("/seen", kind, new_schema(), detections(true, is_big, 4, &second)),
        ];
        let bag = read(&folder, &messages).unwrap();
        // A point separates the parts of parameter paths, so that names cannot hold it.
        assert_eq!(seen(&bag, 0), [("left_bolt", [100.5, 200.25]), ("nut", [7.0, 8.5])]);
        assert_eq!(seen(&bag, 1), [("left_bolt", [101.5, 201.25])]);
        assert_eq!(bag.recording.samples.iter().map(|sample| sample.time).collect::<Vec<_>>(), [Some(3.0), Some(4.0)]);
        assert_eq!(bag.recording.cameras[0].name, "camera");
        let said = bag.notes.join("\n");
        assert!(said.contains("1 detections are no numbers, and are left out"), "{said}");

        let messages = [("/seen", kind, old_schema(), detections(false, is_big, 3, &first))];
        let bag = read(&folder, &messages).unwrap();
        assert_eq!(seen(&bag, 0), [("bolt", [100.5, 200.25]), ("nut", [7.0, 8.5])]);
    }
}

#[test]
fn a_detection_without_any_name_is_refused_with_its_topic_and_time() {
    let folder = Folder::new("bag-nameless");
    let mut cdr = Cdr::new(true);
    cdr.header(3, 0, "camera");
    cdr.int(1);
    cdr.header(3, 0, "");
    cdr.int(0);
    cdr.floats(&[5.0, 6.0, 0.0, 1.0, 1.0]);
    cdr.text("");
    let messages = [("/seen", "vision_msgs/msg/Detection2DArray", new_schema(), cdr)];
    let error = read(&folder, &messages).unwrap_err().to_string();
    assert!(error.contains("/seen") && error.contains("message 1") && error.contains("detections.id"), "{error}");
}
