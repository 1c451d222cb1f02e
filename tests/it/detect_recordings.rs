//! Images in folders and bags become recordings: with the states that belong to them, and what is known of their cameras.
use crate::cli::Folder;
use crate::detect::{CENTRE, CHARUCO, FOCAL, SIZE, TAG36H11, View, is_dark, is_dark_charuco, png};
use handeye::detect::Gray;
use handeye::recording::{ImageSeen, OpenOptions, Pairing, RecordedCamera, Recording, Rows, Sample};
use mcap::WriteOptions;
use mcap::records::MessageHeader;
use nalgebra::{Rotation3, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use std::io::Cursor;

/// A camera on a hand that sees a board on a table: files in a folder, poses of the hand beside, and where the camera is on the hand.
fn hand_eye(folder: &Folder, count: u64) -> View {
    let hand_from_camera =
        View { rotation: Rotation3::from_euler_angles(0.02, -0.03, 0.5), origin: Vector3::new(0.03, -0.05, 0.08) };
    let world_from_board =
        View { rotation: Rotation3::from_euler_angles(3.1, 0.05, 0.3), origin: Vector3::new(0.5, 0.1, 0.02) };
    std::fs::create_dir_all(folder.path().join("shots/hand")).unwrap();
    let mut poses = "image,time,pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw".to_owned();
    for seed in 0..count {
        let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
        let view = View::random(&mut rng, [4.0 * CHARUCO, 3.0 * CHARUCO], 0.45 + 0.02 * seed as f64);
        let image = view.render(is_dark_charuco, 0.8, 2.0, &mut rng);
        let name = format!("shot-{seed}.png");
        std::fs::write(folder.path().join("shots/hand").join(&name), png(&image)).unwrap();
        // world_from_hand = world_from_board · board_from_camera · camera_from_hand, the board's frame at its first inner corner.
        let first = view.rotation * Vector3::new(CHARUCO, CHARUCO, 0.0) + view.origin;
        let (board_from_camera, at) = (view.rotation.inverse(), -(view.rotation.inverse() * first));
        let camera_from_hand = hand_from_camera.rotation.inverse();
        let camera_to_hand = -(camera_from_hand * hand_from_camera.origin);
        let rotation = world_from_board.rotation * board_from_camera * camera_from_hand;
        let origin = world_from_board.rotation * (board_from_camera * camera_to_hand + at) + world_from_board.origin;
        let quaternion = nalgebra::UnitQuaternion::from_rotation_matrix(&rotation);
        let q = quaternion.coords;
        poses += &format!(
            "\n{name},{seed},{:?},{:?},{:?},{:?},{:?},{:?},{:?}",
            origin.x, origin.y, origin.z, q.x, q.y, q.z, q.w
        );
    }
    folder.write("poses.csv", &poses);
    folder.write(
        "hand.yaml",
        &format!(
            "image_width: {}\nimage_height: {}\ncamera_name: hand\ncamera_matrix:\n  rows: 3\n  cols: 3\n  data: [{FOCAL}, 0, {}, 0, {FOCAL}, {}, 0, 0, 1]\n\
            distortion_model: plumb_bob\ndistortion_coefficients:\n  rows: 1\n  cols: 5\n  data: [0, 0, 0, 0, 0]\n",
            SIZE[0], SIZE[1], CENTRE[0], CENTRE[1]
        ),
    );
    hand_from_camera
}

#[test]
fn images_of_a_board_and_poses_of_the_hand_calibrate_the_hand_to_the_eye() {
    let folder = Folder::new("detect-hand-eye");
    let truth = hand_eye(&folder, 10);
    let (said, _) = folder.expect(
        0,
        "detect shots --pattern charuco=4x3:DICT_5X5_50:0.75 --states poses.csv --pair name --camera hand=hand.yaml --side 0.045 -o motions.jsonl",
    );
    assert!(said.contains("10 samples, 1 camera with 6 features") && said.contains("target pose"), "{said}");
    let recording = Recording::read(&folder.path().join("motions.jsonl")).unwrap();
    let targets = recording.samples.iter().filter(|sample| !sample.targets.is_empty()).count();
    assert!(targets >= 8, "{targets} of 10 targets");
    // Without the pixels it is hand-eye calibration as it stands in books.
    let mut of_targets = recording.clone();
    of_targets.samples.iter_mut().for_each(|sample| sample.pixels.clear());
    of_targets.write(&folder.path().join("targets.jsonl")).unwrap();
    folder.write("rig.toml", "[[cameras]]\nname = \"hand\"\nparent = \"tip\"\n");
    folder.expect(0, "calibrate targets.jsonl --rig rig.toml -o learned.toml");
    let learned = handeye::rig::Rig::read(&folder.path().join("learned.toml")).unwrap();
    let pose = learned.cameras[0].pose.unwrap();
    let off = (pose.translation - truth.origin).norm();
    let turned = Rotation3::from_matrix_unchecked(pose.rotation).angle_to(&truth.rotation);
    assert!(off < 2e-3 && turned < 5e-3, "{off} m and {turned} rad from the truth");
}

#[test]
fn compressed_images_in_a_bag_show_what_the_same_files_show() {
    let folder = Folder::new("detect-bag");
    hand_eye(&folder, 3);
    let pattern = "charuco=4x3:DICT_5X5_50:0.75";
    folder.expect(0, &format!("detect hand=shots/hand --pattern {pattern} -o files.jsonl"));
    let files = Recording::read(&folder.path().join("files.jsonl")).unwrap();
    let mut writer = WriteOptions::new().create(Cursor::new(Vec::new())).unwrap();
    let text = "std_msgs/Header header\nstring format\nuint8[] data\n\
        ================================================================================\n\
        MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
        ================================================================================\n\
        MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
    let schema = writer.add_schema("sensor_msgs/msg/CompressedImage", "ros2msg", text.as_bytes()).unwrap();
    let channel_id = writer.add_channel(schema, "/hand/image_raw/compressed", "cdr", &BTreeMap::new()).unwrap();
    for index in 0..4_u32 {
        // The last one is no image.
        let path = folder.path().join(format!("shots/hand/shot-{index}.png"));
        let data = std::fs::read(path).unwrap_or_else(|_| b"no image".to_vec());
        let mut bytes = vec![0, 1, 0, 0];
        [1 + index, 0, 1].iter().for_each(|number| bytes.extend(number.to_le_bytes()));
        // An empty frame, its end and padding; then "png" and its end.
        bytes.extend([0; 4]);
        bytes.extend(4_u32.to_le_bytes());
        bytes.extend(b"png\0");
        bytes.extend((data.len() as u32).to_le_bytes());
        bytes.extend(&data);
        let header = MessageHeader { channel_id, sequence: index, log_time: u64::from(index), publish_time: 0 };
        writer.write_to_known_channel(&header, &bytes).unwrap();
    }
    writer.finish().unwrap();
    std::fs::write(folder.path().join("bag.mcap"), writer.into_inner().into_inner()).unwrap();
    let (said, _) = folder.expect(0, &format!("detect bag.mcap --pattern {pattern} -o bag.jsonl"));
    assert!(said.contains("1 images are left out, the first of which is neither PNG nor JPEG"), "{said}");
    let bag = Recording::read(&folder.path().join("bag.jsonl")).unwrap();
    assert_eq!((&bag.features, bag.cameras[0].name.as_str()), (&files.features, "hand"));
    assert_eq!(bag.cameras[0].size, Some([SIZE[0] as u32, SIZE[1] as u32]));
    let pixels =
        |recording: &Recording| -> Vec<_> { recording.samples.iter().map(|sample| sample.pixels.clone()).collect() };
    assert_eq!(pixels(&bag), pixels(&files));
    let times: Vec<_> = bag.samples.iter().map(|sample| sample.time).collect();
    assert_eq!(times, [Some(1.0), Some(2.0), Some(3.0)]);
    let seen: Vec<usize> = bag.samples.iter().map(|sample| sample.pixels.len()).collect();
    assert!(seen.iter().all(|seen| *seen >= 4), "{seen:?} of 6 corners");
    let named = "--camera-topic hand/image_raw/compressed=eye --camera eye=320x240";
    folder.expect(0, &format!("detect bag.mcap --pattern {pattern} {named} -o named.jsonl"));
    assert_eq!(Recording::read(&folder.path().join("named.jsonl")).unwrap().cameras[0].name, "eye");
    let (_, error) = folder.expect(2, &format!("detect bag.mcap --pattern {pattern} --degrees -o out.jsonl"));
    assert!(error.contains("bag.mcap is a bag, where --degrees has no effect"), "{error}");
    // Without a pattern there is nothing in it.
    let error = Recording::open_with(&folder.path().join("bag.mcap"), &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.contains("has no image with features") && error.contains("/hand/image_raw/compressed"), "{error}");
}

#[test]
fn images_pair_with_rows_by_order_or_time_and_mistakes_are_named() {
    let folder = Folder::new("detect-pairs");
    let blank = Gray { width: SIZE[0], height: SIZE[1], pixels: vec![128; SIZE[0] * SIZE[1]] };
    let rows = TAG36H11[0].1;
    for camera in ["left", "right"] {
        std::fs::create_dir_all(folder.path().join("shots").join(camera)).unwrap();
        for (index, name) in ["10.0", "10.5", "11.0"].into_iter().enumerate() {
            let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
            let view = View::random(&mut rng, [0.1; 2], 0.5);
            let image = view.render(|x, y| is_dark(&rows, 10.0 * x, 10.0 * y), 0.8, 2.0, &mut rng);
            // The left camera is blind in the middle.
            let image = if camera == "left" && index == 1 { &blank } else { &image };
            std::fs::write(folder.path().join(format!("shots/{camera}/{name}.png")), png(image)).unwrap();
        }
    }
    folder.write("rows.csv", "time,joints.a,joint_action.a\n9.75,1,0.5\n10.25,2,0.5\n11.25,4,0.5\n");
    let (said, notes) = folder.expect(0, "detect shots --pattern tag36h11 --states rows.csv -o order.jsonl");
    let blind = "1 of 6 images show nothing of what is looked for (10.5 of left); samples are numbered from 0";
    assert!((said + &notes).contains(blind));
    let order = Recording::read(&folder.path().join("order.jsonl")).unwrap();
    let joints = |recording: &Recording| -> Vec<f64> {
        recording.samples.iter().map(|sample| sample.joints.as_ref().unwrap()[0]).collect()
    };
    assert_eq!((joints(&order), order.joints.clone()), (vec![1.0, 2.0, 4.0], vec!["a".to_owned()]));
    assert_eq!(order.samples.iter().map(|sample| sample.pixels.len()).collect::<Vec<_>>(), [8, 4, 8]);
    assert!(order.samples[0].joint_action.is_some() && order.samples[2].joint_action.is_none());
    assert_eq!(order.cameras.iter().map(|camera| camera.size).collect::<Vec<_>>(), [Some([320, 240]); 2]);
    folder.expect(0, "detect shots --pattern tag36h11 --states rows.csv --pair time -o time.jsonl");
    let time = Recording::read(&folder.path().join("time.jsonl")).unwrap();
    let found = joints(&time);
    assert!(found.len() == 3 && found.iter().zip([1.5, 2.5, 3.5]).all(|(a, b)| (a - b).abs() < 1e-6), "{found:?}");

    folder.write("degrees.csv", "b,a\n1,90\n2,90\n3,90\n");
    let said = "--states degrees.csv --joints a,b --degrees=a";
    folder.expect(0, &format!("detect shots --pattern tag36h11 {said} -o degrees.jsonl"));
    let read = Recording::read(&folder.path().join("degrees.jsonl")).unwrap();
    assert_eq!(
        (&read.joints[..], read.samples[2].joints.as_deref()),
        (&["a".to_owned(), "b".to_owned()][..], Some(&[std::f64::consts::FRAC_PI_2, 3.0][..]))
    );

    let fails = |arguments: &str, reasons: &[&str]| {
        let (_, error) = folder.expect(2, &format!("detect {arguments} -o out.jsonl"));
        assert!(reasons.iter().all(|reason| error.contains(reason)), "{arguments}: {error}");
    };
    fails(
        "shots --pattern tag36h12",
        &["unknown family of tags `tag36h12`", "did you mean `tag36h1", "boards are checkerboard="],
    );
    fails("shots --pattern checkerboard=9", &["checkerboard=COLUMNSxROWS"]);
    fails("shots --pattern charuco=20x20:DICT_4X4_50:0.7", &["needs 200 tags, and DICT_4X4_50 has 50"]);
    fails("nowhere --pattern tag36h11", &["nowhere"]);
    fails("shots --pattern tag36h11 --join 0.1", &["no recording is read, where --join has no effect"]);
    fails("left=shots --pattern tag36h11", &["shots: has no images"]);
    fails("shots --pattern tag36h11 --states rows.csv --pair name", &["rows.csv", "a column `image`"]);
    fails("shots --pattern tag36h11 --camera top=1x1", &["--camera: there are no images of a camera `top`"]);
    folder.write("two.csv", "time,joints.a\n1,1\n2,2\n");
    fails("shots --pattern tag36h11 --states two.csv", &["two.csv: there are 3 images of each camera and 2 rows"]);
    fails(
        "shots --pattern tag36h11 --states two.csv --pair time",
        &[
            "two.csv: no image was taken while the robot was recorded, from 1 s to 2 s",
            "the nearest, `10.0` of 10 s, is 8 s off",
        ],
    );
    folder.write("ends.csv", "time,joints.a\n9,1\n10.25,2\n");
    let (said, _) = folder.expect(0, "detect shots --pattern tag36h11 --states ends.csv --pair time -o ends.jsonl");
    assert!(
        said.contains("2 of 3 samples are outside of the time that the robot was recorded, image `11.0` by 0.75 s"),
        "{said}"
    );
    assert!(said.contains("up to 1.250000 s apart (image `10.0`)"), "{said}");
    folder.write("back.csv", "time,joints.a\n9,1\n12,2\n11,2\n");
    fails(
        "shots --pattern tag36h11 --states back.csv --pair time",
        &["back.csv:4:1: time goes back, from 12 s to 11 s"],
    );
    let (_, error) = folder.expect(1, "detect shots --pattern tag25h9 -o out.jsonl");
    assert!(error.contains("no image shows tag25h9"), "{error}");
    std::fs::copy(folder.path().join("shots/left/10.0.png"), folder.path().join("shots/left/10.0.jpg")).unwrap();
    fails(
        "shots --pattern tag36h11",
        &["10.0.jpg and shots/left/10.0.png: camera `left` has two images called `10.0`"],
    );
    std::fs::remove_file(folder.path().join("shots/left/10.0.jpg")).unwrap();
    folder.write("shots/left/12.0.png", "no image");
    fails("shots --pattern tag36h11", &["12.0.png: is neither PNG nor JPEG"]);
}

#[test]
fn images_that_are_numbers_are_in_the_order_of_the_numbers() {
    let folder = Folder::new("detect-numbers");
    let rows = TAG36H11[0].1;
    std::fs::create_dir_all(folder.path().join("left")).unwrap();
    // As text 100 comes before 99, and as people count names 9.5 before 9.25.
    for (index, name) in ["9.25", "9.5", "99", "100"].into_iter().enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
        let image =
            View::random(&mut rng, [0.1; 2], 0.5).render(|x, y| is_dark(&rows, 10.0 * x, 10.0 * y), 0.8, 2.0, &mut rng);
        std::fs::write(folder.path().join(format!("left/{name}.png")), png(&image)).unwrap();
    }
    folder.write("rows.csv", "time,image,joints.a\n9.25,9.25.png,1\n9.5,9.5.png,2\n99,99.png,3\n100,100.png,4\n");
    let joints = |how: &str| -> Vec<(f64, [f64; 2])> {
        folder.expect(0, &format!("detect left --pattern tag36h11 --states rows.csv --pair {how} -o out.jsonl"));
        let recording = Recording::read(&folder.path().join("out.jsonl")).unwrap();
        recording.samples.iter().map(|sample| (sample.joints.as_ref().unwrap()[0], sample.pixels[0].pixel)).collect()
    };
    let order = joints("order");
    assert_eq!(order.iter().map(|(joint, _)| *joint).collect::<Vec<_>>(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!((&order, &order), (&joints("name"), &joints("time")));
}

#[test]
fn a_size_for_a_camera_leaves_what_is_known_of_its_images() {
    let folder = Folder::new("detect-camera");
    hand_eye(&folder, 1);
    let pattern = "charuco=4x3:DICT_5X5_50:0.75";
    let size = format!("hand={}x{}", SIZE[0], SIZE[1]);
    folder.expect(0, &format!("detect shots --pattern {pattern} --camera hand=hand.yaml --camera {size} -o out.jsonl"));
    let camera = &Recording::read(&folder.path().join("out.jsonl")).unwrap().cameras[0];
    assert_eq!((camera.size, camera.fx), (Some([SIZE[0] as u32, SIZE[1] as u32]), Some(FOCAL)));
    let (_, error) = folder.expect(2, &format!("detect shots --pattern {pattern} --camera hand=8x6 -o out.jsonl"));
    assert!(error.contains("said to be of 8 x 6 px, and its images are of 320 x 240 px"), "{error}");
}

#[test]
fn what_was_commanded_stays_where_it_leads_to_the_next_image_and_what_is_lost_is_told() {
    let folder = Folder::new("detect-actions");
    let rows = TAG36H11[0].1;
    std::fs::create_dir_all(folder.path().join("left")).unwrap();
    for (index, name) in ["10", "11", "13"].into_iter().enumerate() {
        let mut rng = ChaCha8Rng::seed_from_u64(index as u64);
        let image =
            View::random(&mut rng, [0.1; 2], 0.5).render(|x, y| is_dark(&rows, 10.0 * x, 10.0 * y), 0.8, 2.0, &mut rng);
        std::fs::write(folder.path().join(format!("left/{name}.png")), png(&image)).unwrap();
    }
    let pose = "pose.x,pose.y,pose.z,pose.qx,pose.qy,pose.qz,pose.qw";
    folder.write(
        "rows.csv",
        &format!(
            "time,image,joints.a,joint_action.a,{pose}\n10,10.png,1,0.5,0,0,0,0,0,0,1\n11,11.png,2,0.25,1,0,0,0,0,0,1\n12,12.png,3,0.5,2,0,0,0,0,0,1\n\
             13,13.png,,,3,0,0,0,0,0,1\n"
        ),
    );
    for how in ["name", "time"] {
        let (said, _) =
            folder.expect(0, &format!("detect left --pattern tag36h11 --states rows.csv --pair {how} -o {how}.jsonl"));
        let samples = Recording::read(&folder.path().join(format!("{how}.jsonl"))).unwrap().samples;
        let actions: Vec<_> = samples.iter().map(|sample| sample.joint_action.clone()).collect();
        // From 11 it leads to 12, of which there is no image.
        assert_eq!(actions, [Some(vec![0.5]), None, None], "{how}");
        let no_image = if how == "name" { "is of" } else { "was taken at the time of" };
        for row in ["their row", "the row that they lead to"] {
            let why = format!("1 of 3 commanded motions are left out: no image that shows anything {no_image} {row}\n");
            assert!(said.contains(&why), "{why}: {said}");
        }
        let joints: Vec<_> = samples.iter().map(|sample| sample.joints.clone()).collect();
        assert_eq!(joints, [Some(vec![1.0]), Some(vec![2.0]), None], "{how}");
        assert!(samples.iter().all(|sample| sample.pose.is_some()), "{how}");
        let missing = "1 of 3 samples have a tip pose and no joints, which were read from 10 s to 12 s";
        assert_eq!(said.contains(missing), how == "time", "{said}");
    }
    // Rows in another order than their images: each is of one, and leads to one that does not come next.
    folder.write("turned.csv", "image,joints.a,joint_action.a\n10.png,1,0.5\n13.png,2,0.25\n11.png,3,0.5\n");
    let (said, _) = folder.expect(0, "detect left --pattern tag36h11 --states turned.csv --pair name -o turned.jsonl");
    let why = "2 of 2 commanded motions are left out: the row that they lead to is not that of the next image";
    assert!(said.contains(why) && !said.contains("no image"), "{said}");
    // A bag's states belong to its own images.
    folder.write("bag.mcap", "");
    let (_, error) = folder.expect(2, "detect left --pattern tag36h11 --states bag.mcap -o out.jsonl");
    assert!(
        error.starts_with("error: --states bag.mcap: a bag says where the robot was at the stamps of its own images"),
        "{error}"
    );
    let (_, error) = folder.expect(2, "detect left bag.mcap --pattern tag36h11 -o out.jsonl");
    assert!(error.starts_with("error: bag.mcap: a bag is looked at alone"), "{error}");
}

/// Two cameras 20 ms apart: the robot stands still at first, then its joint goes with the time, by 1 rad/s.
#[test]
fn images_by_time_between_which_the_robot_moved_are_samples_of_their_own() {
    let angle = |seconds: f64| (seconds - 1.05).max(0.0);
    let states = Recording {
        joints: vec!["a".to_owned()],
        samples: (0..40)
            .map(|index| 0.9 + 0.01 * f64::from(index))
            .map(|time| Sample { time: Some(time), joints: Some(vec![angle(time)]), ..Sample::default() })
            .collect(),
        ..Recording::default()
    };
    let image = |camera: u32, time: f64| ImageSeen {
        camera,
        name: format!("{time:.2}"),
        time: Some(time),
        features: vec![("f".to_owned(), [10.0, 20.0])],
    };
    let images: Vec<ImageSeen> =
        [1.0, 1.1, 1.2].into_iter().flat_map(|time| [image(0, time), image(1, time + 0.02)]).collect();
    let cameras = ["left", "right"].map(|name| RecordedCamera { name: name.to_owned(), ..RecordedCamera::default() });
    let rows = Rows { states: &states, names: &[], pairing: Pairing::Time };
    let (recording, notes) = Recording::from_images(cameras.to_vec(), &images, Some(rows)).unwrap();
    let found: Vec<(f64, f64, usize)> = recording
        .samples
        .iter()
        .map(|sample| (sample.time.unwrap(), sample.joints.as_ref().unwrap()[0], sample.pixels.len()))
        .collect();
    let expected = [(1.01, 2), (1.1, 1), (1.12, 1), (1.2, 1), (1.22, 1)];
    assert_eq!(found.len(), expected.len(), "{found:?}");
    for ((time, read, seen), (at, number)) in found.into_iter().zip(expected) {
        assert!((time - at).abs() < 1e-6 && (read - angle(at)).abs() < 1e-6 && seen == number, "{time} {read} {seen}");
    }
    assert!(notes.iter().any(|note| note.starts_with("2 times the robot moved")), "{notes:?}");
}
