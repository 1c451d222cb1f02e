//! What bags say of cameras, and of which images it is.
use crate::bag::cdr::Cdr;
use crate::bag::{images_beside, read_with};
use crate::cli::Folder;
use handeye::camera::CameraModel;
use handeye::recording::{Found, OpenOptions, Opened, RecordedCamera, Recording};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use std::collections::BTreeMap;
use std::io::Cursor;

const STANDARD: &str = "================================================================================\n\
    MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\n\
    MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const INFO: &str = "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\n\
    float64[12] p\nuint32 binning_x\nuint32 binning_y\n";

type Message = (&'static str, &'static str, String, Cdr);

/// A CameraInfo of 640 x 480 px, with a K and a P that differ.
fn info(topic: &'static str, frame: &str, binning: u32) -> Message {
    info_of(topic, frame, binning, "plumb_bob")
}

fn info_of(topic: &'static str, frame: &str, binning: u32, model: &str) -> Message {
    let mut cdr = Cdr::new(false);
    cdr.header(0, 0, frame);
    cdr.int(480);
    cdr.int(640);
    cdr.text(model);
    cdr.int(5);
    cdr.floats(&[-0.25, 0.125, 0.0, 0.0, 0.0]);
    cdr.floats(&[600.0, 0.0, 319.0, 0.0, 601.0, 239.0, 0.0, 0.0, 1.0]);
    cdr.floats(&[0.0; 9]);
    cdr.floats(&[550.0, 0.0, 310.0, -60.0, 0.0, 551.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
    cdr.int(binning);
    cdr.int(binning);
    (topic, "sensor_msgs/msg/CameraInfo", format!("{INFO}{STANDARD}"), cdr)
}

/// A compressed image whose content is its second.
fn image(topic: &'static str, frame: &str, second: u32) -> Message {
    let mut cdr = Cdr::new(false);
    cdr.header(second, 0, frame);
    cdr.text("png");
    cdr.int(1);
    cdr.byte(second as u8);
    let text = format!("std_msgs/Header header\nstring format\nuint8[] data\n{STANDARD}");
    (topic, "sensor_msgs/msg/CompressedImage", text, cdr)
}

/// Reads a bag in which every image shows one feature; `size`: of the image of a second.
fn detect(
    folder: &Folder,
    messages: Vec<Message>,
    options: &OpenOptions,
    size: impl Fn(u8) -> [u32; 2],
) -> Result<Opened, handeye::Error> {
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    for (time, (topic, kind, text, cdr)) in messages.iter().enumerate() {
        let schema = writer.add_schema(kind, "ros2msg", text.as_bytes()).unwrap();
        let channel_id = writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).unwrap();
        let header = MessageHeader { channel_id, sequence: 0, log_time: time as u64, publish_time: 0 };
        writer.write_to_known_channel(&header, &cdr.bytes).unwrap();
    }
    writer.finish().unwrap();
    let path = folder.path().join("bag.mcap");
    std::fs::write(&path, writer.into_inner().into_inner()).unwrap();
    let look = |bytes: &&[u8]| Ok(Found { size: size(bytes[0]), features: vec![("f0".to_owned(), [1.0, 2.0])] });
    Recording::detect_with(&path, options, &mut |images: &[&[u8]]| images.iter().map(look).collect())
}

fn lens(camera: &RecordedCamera) -> [Option<f64>; 4] {
    [camera.fx, camera.fy, camera.cx, camera.cy]
}

const RAW: [Option<f64>; 4] = [Some(600.0), Some(601.0), Some(319.0), Some(239.0)];
const RECTIFIED: [Option<f64>; 4] = [Some(550.0), Some(551.0), Some(310.0), Some(230.0)];

#[test]
fn rectified_images_have_the_lens_of_the_projection_matrix_and_others_that_of_the_camera_matrix() {
    let folder = Folder::new("bag-rectified");
    let read = |topic: &'static str| {
        let messages = vec![info("/left/camera_info", "left", 0), image(topic, "left", 1)];
        let bag = detect(&folder, messages, &OpenOptions::default(), |_| [640, 480]).unwrap();
        bag.recording.cameras[0].clone()
    };
    for topic in ["/left/image_raw/compressed", "/left/compressed"] {
        let camera = read(topic);
        assert_eq!((lens(&camera), camera.model), (RAW, Some(CameraModel::BrownConrady)), "{topic}");
        assert_eq!(camera.distortion.map(|list| list[0]), Some(-0.25), "{topic}");
    }
    for topic in ["/left/image_rect/compressed", "/left/image_rect_color/compressed"] {
        let camera = read(topic);
        assert_eq!((lens(&camera), camera.model), (RECTIFIED, Some(CameraModel::Pinhole)), "{topic}");
        assert_eq!(camera.distortion, None, "{topic}");
    }
    let both = ["/left/image_raw/compressed", "/left/image_rect/compressed"];
    let messages = both.map(|topic| image(topic, "left", 1)).into_iter().chain([info("/left/camera_info", "left", 0)]);
    let error = detect(&folder, messages.collect(), &OpenOptions::default(), |_| [640, 480]).unwrap_err().to_string();
    assert!(both.iter().all(|topic| error.contains(topic)) && error.contains("only one is of rectified"), "{error}");
}

#[test]
fn images_of_another_size_than_the_camera_info_are_refused_with_both_sizes_unless_their_lens_is_given() {
    let folder = Folder::new("bag-sizes");
    let messages = || {
        let images = [1, 2].map(|second| image("/left/image_raw/compressed", "left", second));
        images.into_iter().chain([info("/left/camera_info", "left", 0)]).collect::<Vec<_>>()
    };
    let error = detect(&folder, messages(), &OpenOptions::default(), |_| [320, 240]).unwrap_err().to_string();
    for part in
        ["bag.mcap: /left/image_raw/compressed: images are of 320 x 240 px", "/left/camera_info is of 640 x 480 px"]
    {
        assert!(error.contains(part), "{error}");
    }
    let given = RecordedCamera { name: "left".into(), fx: Some(300.0), ..RecordedCamera::default() };
    let options = OpenOptions { cameras: vec![given], ..OpenOptions::default() };
    let camera = detect(&folder, messages(), &options, |_| [320, 240]).unwrap().recording.cameras[0].clone();
    assert_eq!((camera.size, lens(&camera)), (Some([320, 240]), [Some(300.0), None, None, None]));
    let notes = detect(&folder, messages(), &options, |_| [320, 240]).unwrap().notes;
    let said = "/left/camera_info is of 640 x 480 px, and images of camera `left` are of 320 x 240 px";
    assert!(notes.iter().any(|note| note.starts_with(said)), "{notes:?}");
    let notes = detect(&folder, messages(), &options, |_| [640, 480]).unwrap().notes;
    assert!(!notes.iter().any(|note| note.contains("640 x 480")), "{notes:?}");
    let error =
        detect(&folder, messages(), &OpenOptions::default(), |second| [640, if second == 2 { 360 } else { 480 }]);
    let error = error.unwrap_err().to_string();
    assert!(
        error.contains("the image of 2.000000 s is of 640 x 360 px, and those before are of 640 x 480 px"),
        "{error}"
    );
    // Without a CameraInfo, the size is that of the images.
    let alone = vec![image("/left/image_raw/compressed", "left", 1)];
    let camera = detect(&folder, alone, &OpenOptions::default(), |_| [320, 240]).unwrap().recording.cameras[0].clone();
    assert_eq!((camera.size, camera.fx), (Some([320, 240]), None));
}

#[test]
fn a_size_that_is_given_leaves_the_lens_of_the_bag() {
    let folder = Folder::new("bag-given");
    let messages = || vec![info("/left/camera_info", "left", 0), image("/left/image_raw/compressed", "left", 1)];
    let of = |name: &str, size| {
        let cameras = vec![RecordedCamera { name: name.into(), size: Some(size), ..RecordedCamera::default() }];
        detect(&folder, messages(), &OpenOptions { cameras, ..OpenOptions::default() }, |_| [640, 480])
    };
    let camera = of("left", [640, 480]).unwrap().recording.cameras[0].clone();
    assert_eq!((lens(&camera), camera.distortion.is_some()), (RAW, true));
    let error = of("left", [320, 240]).unwrap_err().to_string();
    assert!(error.contains("is said to be of 320 x 240 px, and its images are of 640 x 480 px"), "{error}");
    let error = of("top", [640, 480]).unwrap_err().to_string();
    assert!(error.contains("bag.mcap: there are no images of a camera `top`"), "{error}");
}

#[test]
fn a_camera_info_that_cannot_be_read_matters_where_it_is_of_the_images() {
    let folder = Folder::new("bag-unrelated");
    let read = |messages| detect(&folder, messages, &OpenOptions::default(), |_| [640, 480]);
    let image = || image("/left/image_raw/compressed", "left", 1);
    let bag =
        read(vec![info("/depth/camera_info", "depth", 2), info("/left/camera_info", "left", 0), image()]).unwrap();
    assert_eq!(lens(&bag.recording.cameras[0]), RAW);
    let error = read(vec![info("/left/camera_info", "left", 2), image()]).unwrap_err().to_string();
    assert!(error.contains("/left/camera_info") && error.contains("binned or cut out"), "{error}");
}

#[test]
fn a_lens_that_is_given_is_held_to_the_size_that_the_camera_info_says_where_no_image_is_there() {
    let folder = Folder::new("bag-given-size");
    let (topic, kind, text, cdr) = info("/left/camera_info", "left", 0);
    let bytes = images_beside(2, &[(topic, kind, text, 1, cdr.bytes)]);
    let read = |size| {
        let lens = RecordedCamera { name: "left".into(), size, fx: Some(300.0), ..RecordedCamera::default() };
        read_with(&bytes, &folder, &OpenOptions { cameras: vec![lens], ..OpenOptions::default() })
    };
    for size in [None, Some([640, 480])] {
        let camera = read(size).unwrap().recording.cameras[0].clone();
        assert_eq!((camera.size, lens(&camera)), (Some([640, 480]), [Some(300.0), None, None, None]));
    }
    let error = read(Some([320, 240])).unwrap_err().to_string();
    assert!(error.contains("is said to be of 320 x 240 px, and its images are of 640 x 480 px"), "{error}");
}

#[test]
fn a_distortion_model_that_is_not_known_matters_to_images_that_have_distortion() {
    let folder = Folder::new("bag-unknown-model");
    let read = |topic: &'static str, options: &OpenOptions| {
        let messages = vec![info_of("/left/camera_info", "left", 0, "thin_prism"), image(topic, "left", 1)];
        detect(&folder, messages, options, |_| [640, 480])
    };
    let rectified = read("/left/image_rect/compressed", &OpenOptions::default()).unwrap();
    assert_eq!(lens(&rectified.recording.cameras[0]), RECTIFIED);
    let error = read("/left/image_raw/compressed", &OpenOptions::default()).unwrap_err().to_string();
    let expected = "bag.mcap: /left/camera_info has an unknown distortion model `thin_prism`; --camera left=FILE gives the intrinsics";
    assert!(error.contains(expected), "{error}");
    let given = RecordedCamera { name: "left".into(), fx: Some(300.0), ..RecordedCamera::default() };
    let given = OpenOptions { cameras: vec![given], ..OpenOptions::default() };
    assert_eq!(read("/left/image_raw/compressed", &given).unwrap().recording.cameras[0].fx, Some(300.0));
}
