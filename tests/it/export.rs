//! What others read of a rig: where its cameras stand, in ROS and Kalibr, and every format from the command line.
use crate::cli::Folder;
use crate::intrinsics::same;
use handeye::export::{to_camchain, to_intrinsics, to_static_transforms, to_tf};
use handeye::intrinsics::read_intrinsics;
use handeye::rig::{Camera, Fit, Parent, Rig, catalog};
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::Vector3;

fn ur5_with_a_camera_on_the_hand() -> Rig {
    let mut rig = catalog::rig("ur5").unwrap();
    rig.robot.base = Some(Pose::new(Vector3::new(0.1, -0.2, 0.3), Vector3::new(1.0, 2.0, 3.0)));
    let hand = Camera { name: "it's a hand".into(), parent: Parent::Tip, ..rig.cameras[0].clone() };
    let elbow = Camera { name: "elbow".into(), parent: Parent::Link(2), ..rig.cameras[1].clone() };
    rig.cameras.extend([hand, elbow]);
    rig.robot.link = Some("base_link".into());
    rig.robot.joints[2].link = Some("forearm_link".into());
    rig.robot.joints[5].link = Some("tool0".into());
    rig
}

#[test]
fn static_transforms_put_base_and_cameras_where_they_are() {
    let rig = ur5_with_a_camera_on_the_hand();
    let text = to_static_transforms(&rig).unwrap();
    let mut found = Vec::new();
    for line in text.lines() {
        let value = |key: &str| {
            let rest = line.split(&format!("--{key} ")).nth(1).unwrap();
            rest.split(" --").next().unwrap().to_owned()
        };
        let number = |key: &str| value(key).parse::<f64>().unwrap();
        let rotation = so3::from_quaternion(["qx", "qy", "qz", "qw"].map(number));
        let pose = Pose { rotation, translation: Vector3::from(["x", "y", "z"].map(number)) };
        assert!(line.starts_with("ros2 run tf2_ros static_transform_publisher --x "));
        found.push((value("frame-id"), value("child-frame-id"), pose));
    }
    let expected = [
        ("world", "base_link", rig.robot.base),
        ("world", "left", rig.cameras[0].pose),
        ("world", "right", rig.cameras[1].pose),
        ("tool0", r"'it'\''s a hand'", rig.cameras[2].pose),
        ("forearm_link", "elbow", rig.cameras[3].pose),
    ];
    assert_eq!(found.len(), expected.len(), "{text}");
    for ((parent, child, pose), expected) in found.iter().zip(expected) {
        assert_eq!((parent.as_str(), child.as_str()), (expected.0, expected.1));
        let expected = expected.2.unwrap();
        assert_eq!(pose.translation, expected.translation);
        assert!((pose.rotation - expected.rotation).amax() < 1e-15);
    }
    // The same numbers as a message.
    let message = to_tf(&rig).unwrap();
    assert_eq!(message.matches("- header:\n    frame_id: \"").count(), 5, "{message}");
    assert!(message.contains("child_frame_id: \"it's a hand\"\n"), "{message}");
    for number in text.split_whitespace().filter(|word| word.parse::<f64>().is_ok()) {
        assert!(message.contains(&format!(": {number}")), "{number} in\n{message}");
    }
}

#[test]
fn a_camchain_says_how_each_camera_stands_against_the_one_before() {
    let rig = catalog::rig("ur5").unwrap();
    let text = to_camchain(&rig).unwrap();
    let rows: Vec<Vec<f64>> = text
        .lines()
        .filter_map(|line| line.strip_prefix("  - ["))
        .map(|row| row.trim_end_matches(']').split(", ").map(|x| x.parse().unwrap()).collect())
        .collect();
    let [left, right] = [0, 1].map(|camera: usize| rig.cameras[camera].pose.unwrap());
    let in_left = Vector3::new(0.1, -0.3, 1.2);
    let expected = right.inverse_transform(&left.transform(&in_left));
    for i in 0..3 {
        let found = (0..3).map(|k| rows[i][k] * in_left[k]).sum::<f64>() + rows[i][3];
        assert!((found - expected[i]).abs() < 1e-14, "{text}");
    }
}

#[test]
fn export_writes_every_format_from_the_command_line() {
    let folder = Folder::new("export");
    for (arguments, words) in [
        ("export ur5 --to camera-info --camera left", "distortion_model: plumb_bob"),
        ("export ur5 --to opencv --camera right", "%YAML:1.0"),
        ("export ur5 --to kalibr", "T_cn_cnm1"),
        ("export ur5 --to tf", "transforms:"),
        ("export ur5 --to static-transforms", "static_transform_publisher"),
        ("export ur5 --to dh", "[[robot.joints]]"),
    ] {
        let (out, _) = folder.expect(0, arguments);
        assert!(out.contains(words), "{arguments}\n{out}");
        folder.expect(0, &format!("{arguments} -o out"));
        assert_eq!(folder.read("out"), out, "{arguments}");
    }
    for (arguments, words) in [
        ("export ur5 --to opencv", "--camera has to name one of the rig's cameras: left, right"),
        ("export ur5 --to opencv --camera middle", "left, right"),
        ("export ur3e --to opencv", "the rig has no cameras"),
        ("export ur5 --to tf --camera left", "--camera is for"),
        ("export ur5 --to dh --urdf absent", "--urdf is for --to urdf"),
        ("export ur5 --to urdf", "--urdf"),
        ("export ur5 --to dh --tip-frame tool0", "--tip-frame and --camera-frame are for --to tf"),
        ("export ur5 --to urdf --urdf absent", "absent: "),
        ("export absent.toml --to tf", "absent.toml: "),
    ] {
        let (_, err) = folder.expect(2, arguments);
        assert!(err.contains(words), "{arguments}\n{err}");
    }
    let camera = &catalog::rig("ur5").unwrap().cameras[0];
    let (text, _) = folder.expect(0, "export ur5 --to camera-info --camera left");
    assert!(same(&to_intrinsics(camera).unwrap(), &read_intrinsics(&text, "x", None).unwrap()));
}

#[test]
fn frames_are_called_as_they_are_elsewhere_and_an_arm_that_was_learned_is_said_to_be_one() {
    let folder = Folder::new("export-frames");
    let mut rig = ur5_with_a_camera_on_the_hand();
    rig.write(&folder.path().join("arm.toml"), None).unwrap();
    let (out, _) = folder.expect(0, "export arm.toml --to static-transforms --base-frame ur_base --tip-frame flange");
    let ends = ["--frame-id world --child-frame-id ur_base", "--frame-id flange --child-frame-id 'it'\\''s a hand'"];
    assert!(ends.iter().all(|end| out.lines().any(|line| line.ends_with(end))) && !out.contains('#'), "{out}");
    let (out, _) = folder.expect(0, "export arm.toml --to tf --base-frame ur_base --tip-frame flange");
    assert!(out.contains("child_frame_id: \"ur_base\"") && out.contains("frame_id: \"flange\""), "{out}");
    // The frame of a driver, with the optical one turned and 2 cm to its side.
    let turned = so3::from_quaternion([-0.5, 0.5, -0.5, 0.5]);
    let frame = "left=left_link,0.0,0.02,0.0,-0.5,0.5,-0.5,0.5";
    let (out, _) = folder.expect(0, &format!("export arm.toml --to tf --camera-frame {frame}"));
    let of_link = out.split("child_frame_id: \"left_link\"").nth(1).unwrap();
    let numbers: Vec<f64> =
        of_link.split(['{', '}', ',', ':']).filter_map(|word| word.trim().parse().ok()).take(7).collect();
    let link = Pose {
        rotation: so3::from_quaternion([numbers[3], numbers[4], numbers[5], numbers[6]]),
        translation: Vector3::new(numbers[0], numbers[1], numbers[2]),
    };
    let camera = link * Pose { rotation: turned, translation: Vector3::new(0.0, 0.02, 0.0) };
    let expected = rig.cameras[0].pose.unwrap();
    assert!((camera.translation - expected.translation).norm() < 1e-12, "{out}");
    assert!((camera.rotation - expected.rotation).amax() < 1e-12 && !out.contains("\"left\""), "{out}");
    for (wrong, words) in [
        ("top=link", "--camera-frame top: the cameras of the rig are left, right"),
        ("left=link,1,2,3", "expected CAMERA=FRAME or CAMERA=FRAME,X,Y,Z,QX,QY,QZ,QW"),
        ("left=link,0,0,0,0,0,0,2", "no quaternion of length 1"),
    ] {
        let (_, err) = folder.expect(2, &format!("export arm.toml --to tf --camera-frame {wrong}"));
        assert!(err.contains(words), "{wrong}: {err}");
    }
    rig.cameras[0].name = "left_optical_frame".to_owned();
    rig.write(&folder.path().join("named.toml"), None).unwrap();
    let (_, err) = folder.expect(0, "export named.toml --to tf");
    assert!(err.contains("`left_optical_frame` below a frame of its own, --camera-frame"), "{err}");
    let (_, err) = folder.expect(0, "export named.toml --to tf --camera-frame left_optical_frame=left");
    assert!(err.is_empty(), "{err}");
    rig.fit = Some(Fit { sd: [("robot.joints.elbow.a".to_owned(), vec![1e-4])].into(), ..Fit::default() });
    assert!(to_static_transforms(&rig).unwrap().starts_with("# of the arm as it was learned"));
    assert!(to_tf(&rig).unwrap().starts_with("# of the arm as it was learned"));
}

#[test]
fn lengths_that_are_no_metres_are_not_given_for_such_without_a_word() {
    let folder = Folder::new("export-unit");
    let mut rig = catalog::rig("ur5").unwrap();
    let metres = to_static_transforms(&rig).unwrap();
    let unit = "lengths are in units of a of joint `elbow`: nothing that is known is metric";
    rig.fit = Some(Fit { gauge: vec!["the base is held".into()], ..Fit::default() });
    rig.write(&folder.path().join("metric.toml"), None).unwrap();
    rig.fit = Some(Fit { gauge: vec!["the base is held".into(), unit.into()], ..Fit::default() });
    rig.write(&folder.path().join("learned.toml"), None).unwrap();
    for format in ["static-transforms", "tf", "kalibr"] {
        let (out, err) = folder.expect(0, &format!("export learned.toml --to {format}"));
        let (comment, rest) = out.split_once('\n').unwrap();
        assert!(comment.starts_with("# these are not metres: ") && comment.contains(unit), "{format}: {out}");
        assert!(comment.contains("--rig"), "what would do: {comment}");
        let (expected, _) = folder.expect(0, &format!("export metric.toml --to {format}"));
        assert_eq!(rest, expected, "{format}");
        assert!(err.starts_with("note: learned.toml: these are not metres: ") && err.lines().count() == 1, "{err}");
    }
    let (out, err) = folder.expect(0, "export learned.toml --to opencv --camera left");
    assert!(!out.contains("metres") && err.is_empty(), "a camera's intrinsics have no lengths: {out}{err}");
    assert!(!metres.contains('#'));
}

#[test]
fn a_rig_without_anything_to_say_is_refused() {
    let folder = Folder::new("export-nothing");
    folder.write("arm.toml", "name = \"arm\"\n");
    for format in ["static-transforms", "tf", "kalibr"] {
        let (out, err) = folder.expect(2, &format!("export arm.toml --to {format}"));
        assert!(out.is_empty() && err.starts_with("error: the rig has no cameras"), "{format}: {out}{err}");
    }
}
