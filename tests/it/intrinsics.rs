//! Intrinsics of cameras in the files of ROS, OpenCV and Kalibr.
use crate::cli::Folder;
use crate::malformed_input::{mutations, place};
use handeye::Error;
use handeye::camera::CameraModel;
use handeye::intrinsics::{Intrinsics, read_intrinsics, to_camera_info, to_kalibr, to_opencv};
use handeye::rig::Rig;

/// As camera_calibration writes it.
const CAMERA_INFO: &str = "\
image_width: 640
image_height: 480
camera_name: narrow_stereo
camera_matrix:
  rows: 3
  cols: 3
  data: [438.783367, 0.000000, 305.593336, 0.000000, 437.302876, 243.738352, 0.000000, 0.000000, 1.000000]
distortion_model: plumb_bob
distortion_coefficients:
  rows: 1
  cols: 5
  data: [-0.361976, 0.110510, 0.001014, 0.000505, 0.000000]
rectification_matrix:
  rows: 3
  cols: 3
  data: [0.999978, 0.002789, -0.006046, -0.002816, 0.999986, -0.004401, 0.006034, 0.004417, 0.999972]
projection_matrix:
  rows: 3
  cols: 4
  data: [393.653800, 0.000000, 322.797939, 0.000000, 0.000000, 393.653800, 241.090902, 0.000000, 0.000000, 0.000000, 1.000000, 0.000000]
";

/// As `ros2 topic echo /camera_info` prints it; a second message follows.
const TOPIC: &str = "\
header:
  stamp:
    sec: 12
    nanosec: 500
  frame_id: camera_color_optical_frame
height: 720
width: 1280
distortion_model: rational_polynomial
d:
- 0.5
- -2.5
- 0.0005
- -0.0002
- 1.4
- 0.375
- -2.25
- 1.25
k:
- 606.5
- 0.0
- 639.25
- 0.0
- 606.25
- 363.5
- 0.0
- 0.0
- 1.0
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  y_offset: 0
  do_rectify: false
---
height: 1
";

/// As cv::FileStorage writes it, long lists over several lines.
const OPENCV: &str = "%YAML:1.0
---
calibration_time: \"Thu Nov 26 12:00:00 2026\"
image_width: 640
image_height: 480
board_width: 9
flags: 0
camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.3591573396163199e+02, 0., 3.4228315473308373e+02, 0.,
       5.3591573396163199e+02, 2.3557082909788173e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ -2.6637260909660682e-01, -3.8588898922304653e-02,
       1.7831947042852964e-03, -2.8122100441115472e-04,
       2.3839153080878486e-01 ]
avg_reprojection_error: 3.9259109564815858e-01
";

const CAMCHAIN: &str = "\
cam0:
  camera_model: pinhole
  intrinsics: [461.629, 460.152, 362.680, 246.049]
  distortion_model: radtan
  distortion_coeffs: [-0.27695497, 0.06712482, 0.00087538, 0.00011556]
  T_cam_imu:
  - [0.01779318, 0.99967549, -0.01822936, 0.07008565]
  - [-0.9998017, 0.01795239, 0.00860714, -0.01771023]
  - [0.00893160, 0.01807260, 0.99979678, 0.00399246]
  - [0.0, 0.0, 0.0, 1.0]
  timeshift_cam_imu: -8.121e-05
  rostopic: /cam0/image_raw
  resolution: [752, 480]
cam1:
  camera_model: pinhole
  intrinsics: [461.5, 460.5, 362.5, 246.5]
  distortion_model: equidistant
  distortion_coeffs: [-0.01, 0.02, -0.03, 0.04]
  T_cn_cnm1:
  - [1.0, 0.0, 0.0, -0.11]
  - [0.0, 1.0, 0.0, 0.0]
  - [0.0, 0.0, 1.0, 0.0]
  - [0.0, 0.0, 0.0, 1.0]
  resolution: [752, 480]
";

#[test]
fn calibration_files_say_what_they_say() {
    let read = |text, camera| read_intrinsics(text, "file", camera).unwrap();
    let expected = |name: Option<&str>, size, model, focal, centre, distortion: &[f64]| Intrinsics {
        name: name.map(str::to_owned),
        size: Some(size),
        model,
        focal,
        centre,
        distortion: distortion.to_vec(),
    };
    let brown = CameraModel::BrownConrady;
    assert_eq!(
        read(CAMERA_INFO, None),
        expected(
            Some("narrow_stereo"),
            [640, 480],
            brown,
            [438.783367, 437.302876],
            [305.593336, 243.738352],
            &[-0.361976, 0.110510, 0.001014, 0.000505, 0.0]
        )
    );
    let d = [0.5, -2.5, 0.0005, -0.0002, 1.4, 0.375, -2.25, 1.25];
    assert_eq!(
        read(TOPIC, None),
        expected(None, [1280, 720], CameraModel::Rational, [606.5, 606.25], [639.25, 363.5], &d)
    );
    let d = [
        -2.663_726_090_966_068e-1,
        -3.858_889_892_230_465e-2,
        1.7831947042852964e-03,
        -2.812_210_044_111_547e-4,
        2.3839153080878486e-01,
    ];
    let f = 5.359_157_339_616_32e2;
    assert_eq!(
        read(OPENCV, None),
        expected(None, [640, 480], brown, [f, f], [3.4228315473308373e+02, 2.3557082909788173e+02], &d)
    );
    let d = [-0.27695497, 0.06712482, 0.00087538, 0.00011556];
    assert_eq!(
        read(CAMCHAIN, Some("cam0")),
        expected(Some("cam0"), [752, 480], brown, [461.629, 460.152], [362.680, 246.049], &d)
    );
    let fisheye = CameraModel::KannalaBrandt;
    let d = [-0.01, 0.02, -0.03, 0.04];
    assert_eq!(
        read(CAMCHAIN, Some("cam1")),
        expected(Some("cam1"), [752, 480], fisheye, [461.5, 460.5], [362.5, 246.5], &d)
    );
    // A fisheye calibration of OpenCV, and the coefficients of a thin prism that are all zero.
    let text = OPENCV.replace("flags: 0", "fisheye_model: 1").replace(",\n       2.3839153080878486e-01", "");
    assert_eq!(read(&text, None).model, fisheye);
    let text = OPENCV.replace("2.3839153080878486e-01", "1., 2., 3., 4., 0., 0., 0., 0.");
    assert_eq!((read(&text, None).model, read(&text, None).distortion.len()), (CameraModel::Rational, 8));
}

fn every_model() -> Vec<Intrinsics> {
    let all = [-0.1, 1e-7, 0.003, -0.25, 0.0, 0.5, 0.125, -1e-3];
    let camera = |(index, &model): (usize, &CameraModel)| Intrinsics {
        name: Some(format!("käm #{index}")),
        size: Some([640, 480]),
        model,
        focal: [600.1, 1.0 / 3.0 * 1e3],
        centre: [319.5, 1e-9],
        distortion: all[..model.distortion().len()].to_vec(),
    };
    CameraModel::ALL.iter().enumerate().map(camera).collect()
}

/// The same camera: a pinhole may be a lens with coefficients of zero, and coefficients of zero may be left out.
pub fn same(a: &Intrinsics, b: &Intrinsics) -> bool {
    let padded = |camera: &Intrinsics| {
        let mut all = camera.distortion.clone();
        all.resize(8, 0.0);
        all
    };
    let model = a.model == b.model || (a.model == CameraModel::Pinhole && padded(b) == [0.0; 8]);
    model && a.size == b.size && a.focal == b.focal && a.centre == b.centre && padded(a) == padded(b)
}

#[test]
fn what_is_written_of_every_camera_model_reads_back_as_the_same_digits() {
    for camera in every_model() {
        let back = read_intrinsics(&to_camera_info(&camera).unwrap(), "x", None).unwrap();
        assert!(same(&camera, &back) && back.name == camera.name, "{camera:?}\n{back:?}");
        let back = read_intrinsics(&to_opencv(&camera), "x", None).unwrap();
        assert!(same(&camera, &back), "{camera:?}\n{back:?}");
        let written = to_kalibr(&[(camera.clone(), None)]);
        if camera.model == CameraModel::Rational {
            assert!(written.unwrap_err().to_string().contains("a rational lens, which a camchain cannot say"));
        } else {
            let back = read_intrinsics(&written.unwrap(), "x", None).unwrap();
            assert!(same(&camera, &back), "{camera:?}\n{back:?}");
        }
    }
}

#[test]
fn every_mistake_in_a_calibration_file_is_told_with_its_place() {
    let change = |text: &str, right: &str, marked: &str| {
        let changed = text.replacen(right, marked, 1);
        assert_ne!(changed, text, "{right}");
        changed
    };
    let camera_info = |right, marked| (change(CAMERA_INFO, right, marked), None);
    let camchain = |right, marked| (change(CAMCHAIN, right, marked), Some("cam0"));
    for ((marked, camera), words) in [
        (camera_info("plumb_bob", "@thin_prism"), "unknown distortion model `thin_prism` (known: plumb_bob"),
        (camera_info("[438.783367, 0.000000", "@[438.783367"), "expected the 9 numbers of a camera matrix, found 8"),
        (camera_info("[438.783367, 0.0", "[438.783367, @x"), "expected a finite number, found `x00000`"),
        (camera_info("[438.783367", "[@.inf"), "expected a finite number, found `.inf`"),
        (
            camera_info(
                "\n  rows: 3\n  cols: 3\n  data: [438.783367, 0.000000",
                "\n  rows: 3\n  cols: 3\n  data: @[438.783367, 0.1",
            ),
            "without skew",
        ),
        (
            camera_info(
                "[438.783367, 0.000000, 305.593336, 0.000000, 437.302876",
                "[438.783367, 0.000000, 305.593336, 0.000000, 0",
            ),
            "above 0",
        ),
        (camera_info("image_width: 640", "image_width: @-640"), "above 0, found `-640`"),
        (camera_info("image_width: 640", "image_height: 640\nimage_width: 640"), "`image_height` is given twice"),
        (camera_info("camera_matrix", "@camera_matricks"), ""),
        (camera_info("rows: 1\n", "rows: @*x\n"), ""),
        (camera_info("rows: 1\n", "rows: [1\n"), "this is not YAML"),
        (camera_info("distortion_model: plumb_bob", "binning_x: @2\ndistortion_model: plumb_bob"), "binned or cut out"),
        (
            camera_info("0.000505, 0.000000]", "0.000505, 0, 0, 0, 1e-9]"),
            "found 8 coefficients with 0.000000001 among the last",
        ),
        (
            (change(OPENCV, "2.3839153080878486e-01 ]", "1, 2, 3 ]"), None),
            "expected 4, 5, 8, 12 or 14 coefficients, found 7",
        ),
        (camchain("pinhole", "@omni"), "unknown camera model `omni` (known: pinhole)"),
        (camchain("radtan", "@fov"), "unknown distortion model `fov`"),
        (camchain("[461.629,", "@["), "expected the 4 numbers fu, fv, pu, pv"),
        (camchain("[752, 480]", "@[752]"), "expected width and height"),
        ((format!("@{CAMCHAIN}"), Some("cam2")), "no camera is called `cam2` (known: cam0, cam1)"),
        ((format!("@{CAMCHAIN}"), None), "there are several cameras, name one"),
        ((format!("@{CAMERA_INFO}"), Some("cam0")), "not a Kalibr camchain"),
        (("@name: x\n".to_owned(), None), "this is no camera calibration"),
        (("@".to_owned(), None), "the file is empty"),
        (("@just words".to_owned(), None), "this is no camera calibration"),
    ] {
        let error = read_intrinsics(&marked.replacen('@', "", 1), "file", camera).unwrap_err();
        assert!(error.to_string().contains(words) && matches!(error, Error::Malformed { .. }), "{words}: {error}");
        if marked.contains('@') && !words.is_empty() {
            let (_, line, column) = place(&marked);
            assert!(
                error.to_string().starts_with(&format!("file:{line}:{column}: ")),
                "{words}: {line}:{column} {error}"
            );
        }
    }
}

#[test]
fn no_damage_to_a_calibration_file_goes_without_a_place_or_brings_the_program_down() {
    let seeds = [CAMERA_INFO, TOPIC, OPENCV, CAMCHAIN].map(|text| text.as_bytes().to_vec());
    let (fine, refused) = mutations(&seeds, 10_000, |bytes| {
        let text = std::str::from_utf8(bytes).ok()?;
        Some(read_intrinsics(text, "file", text.contains("cam1").then_some("cam0")))
    });
    assert!(fine > 1000 && refused > 1000, "{fine} fine and {refused} refused: the damage tests little");
    for text in
        ["[".repeat(100_000), "{a: ".repeat(100_000), "- ".repeat(100_000), "? ".repeat(100_000), "&a ".repeat(1000)]
    {
        assert!(matches!(read_intrinsics(&text, "deep", None), Err(Error::Malformed { .. })));
    }
}

#[test]
fn a_rig_takes_its_intrinsics_from_a_calibration_file_and_keeps_what_was_learned() {
    let folder = Folder::new("intrinsics");
    let file = "[[cameras]]\nname = \"left\"\nintrinsics = \"info/left.yaml\" # from the maker\nparent = \"world\" # mounted\n\n\
                [[cameras]]\nname = \"right\"\nintrinsics = { file = \"chain.yaml\", camera = \"cam1\" }\n";
    std::fs::create_dir_all(folder.path().join("info")).unwrap();
    folder.write("info/left.yaml", CAMERA_INFO).write("chain.yaml", CAMCHAIN).write("rig.toml", file);
    let (mut rig, text) = Rig::read_with_text(&folder.path().join("rig.toml")).unwrap();
    assert_eq!((rig.cameras[0].fx, rig.cameras[0].size), (Some(438.783367), Some([640, 480])));
    assert_eq!(rig.cameras[1].model, Some(CameraModel::KannalaBrandt));
    rig.cameras[0].fx = Some(440.0);
    let updated = rig.update_toml(&text).unwrap();
    assert!(updated.contains("parent = \"world\" # mounted") && !updated.contains("intrinsics"), "{updated}");
    assert_eq!(Rig::parse(&updated, "elsewhere").unwrap(), rig);

    folder.write("rig.toml", &file.replace("name = \"left\"", "name = \"left\"\nfx = 1"));
    let (_, err) = folder.expect(2, "check rig.toml");
    assert!(err.contains("rig.toml:3:6: camera `left`: `fx`: is what `intrinsics` says"), "{err}");
    folder.write("rig.toml", &file.replace("name = \"left\"", "name = \"left\"\nsize = [1, 1]"));
    let (_, err) = folder.expect(2, "check rig.toml");
    assert!(err.contains("rig.toml:4:14: camera `left`: `intrinsics`: images are of 640x480 px there"), "{err}");
    folder.write("rig.toml", file).write("info/left.yaml", &CAMERA_INFO.replace("plumb_bob", "plum"));
    let (_, err) = folder.expect(2, "check rig.toml");
    assert!(err.contains("info/left.yaml:8:19: unknown distortion model `plum`"), "{err}");
}
