//! The joints of an arm in bags in which a gripper's come too.
use crate::bag::{HEADER, HEADER_PARTS, JOINTS, image, images_beside, joint_state, read_with};
use crate::cli::Folder;
use handeye::recording::{BagOptions, OpenOptions, Opened};

type Message = (&'static str, &'static str, String, u64, Vec<u8>);

fn names<const N: usize>(names: [&str; N]) -> Vec<String> {
    names.map(str::to_owned).to_vec()
}

fn state(topic: &'static str, time: u64, names: &[String], positions: &[f64]) -> Message {
    let text = format!("{HEADER}{JOINTS}{HEADER_PARTS}");
    (topic, "sensor_msgs/msg/JointState", text, time, joint_state(time, names, positions))
}

/// States every 25 ms, of an arm whose joints are the time and its half, and of a gripper that is before it each time.
fn messages(of_time: impl Fn(u64, f64) -> Vec<Message>) -> Vec<Message> {
    (0..20).map(|index| 900_000_000 + 25_000_000 * index).flat_map(|time| of_time(time, time as f64 / 1e9)).collect()
}

fn on_one_topic() -> Vec<Message> {
    messages(|time, seconds| {
        let gripper = state("/joint_states", time, &names(["finger"]), &[7.0]);
        vec![gripper, state("/joint_states", time, &names(["a", "b"]), &[seconds, 0.5 * seconds])]
    })
}

fn on_two_topics() -> Vec<Message> {
    messages(|time, seconds| {
        let gripper = state("/gripper/joint_states", time, &names(["finger"]), &[7.0]);
        vec![gripper, state("/joint_states", time, &names(["a", "b"]), &[seconds, 0.5 * seconds])]
    })
}

fn in_one_state() -> Vec<Message> {
    messages(|time, seconds| {
        vec![state("/joint_states", time, &names(["finger", "a", "b"]), &[7.0, seconds, 0.5 * seconds])]
    })
}

fn assert_arm(opened: &Opened, what: &str) {
    assert_eq!(opened.recording.joints, ["a", "b"], "{what}");
    for (index, sample) in opened.recording.samples.iter().enumerate() {
        let seconds = 1.0 + 0.1 * index as f64;
        let [a, b] = sample.joints.as_ref().unwrap()[..] else { panic!("{what}") };
        assert!((a - seconds).abs() < 1e-9 && (b - 0.5 * seconds).abs() < 1e-9, "{what}: {a} {b} at {seconds}");
    }
    let said: Vec<&String> = opened.notes.iter().filter(|note| note.contains("finger")).collect();
    assert_eq!(said, ["joints that are left out: finger; those that are taken: a, b"], "{what}");
}

#[test]
fn the_joints_of_the_rig_or_of_the_options_are_found_by_name_wherever_the_gripper_s_are() {
    let folder = Folder::new("bag-gripper");
    for (what, messages) in
        [("one topic", on_one_topic()), ("two topics", on_two_topics()), ("one state", in_one_state())]
    {
        let bytes = images_beside(4, &messages);
        let known_joints = names(["a", "b"]);
        let of_rig = OpenOptions { known_joints, ..OpenOptions::default() };
        assert_arm(&read_with(&bytes, &folder, &of_rig).unwrap(), what);
        let named = OpenOptions { joints: names(["a", "b"]), ..OpenOptions::default() };
        assert_arm(&read_with(&bytes, &folder, &named).unwrap(), what);
        let joints = "[[robot.joints]]\nname = \"a\"\n[[robot.joints]]\nname = \"b\"\n";
        folder.write("arm.toml", joints);
        let (text, _) = folder.expect(0, "check arm.toml bag.mcap");
        assert!(
            text.contains("bag.mcap: joints that are left out: finger; those that are taken: a, b"),
            "{what}: {text}"
        );
    }
}

#[test]
fn without_names_the_state_of_most_joints_is_the_arm_s_and_two_topics_are_refused() {
    let folder = Folder::new("bag-gripper-unnamed");
    assert_arm(&read_with(&images_beside(4, &on_one_topic()), &folder, &OpenOptions::default()).unwrap(), "one topic");
    let two = images_beside(4, &on_two_topics());
    let error = read_with(&two, &folder, &OpenOptions::default()).unwrap_err().to_string();
    assert!(error.ends_with("--joint-topic has to name one of /gripper/joint_states, /joint_states"), "{error}");
    // All that is in one state may be the arm's, which is said.
    let Opened { recording, notes, .. } =
        read_with(&images_beside(4, &in_one_state()), &folder, &OpenOptions::default()).unwrap();
    assert_eq!(recording.joints, ["finger", "a", "b"]);
    assert!(notes.iter().any(|note| note.contains("has most: finger, a, b; where")), "{notes:?}");
}

#[test]
fn joints_that_no_state_has_together_are_told_from_those_that_none_has() {
    let folder = Folder::new("bag-gripper-apart");
    let bytes = images_beside(4, &on_one_topic());
    let error =
        |joints| read_with(&bytes, &folder, &OpenOptions { joints, ..OpenOptions::default() }).unwrap_err().to_string();
    let apart = error(names(["a", "finger"]));
    assert!(apart.ends_with("no state has all of the joints a, finger; their joints are finger; a, b"), "{apart}");
    let missing = error(names(["a", "c"]));
    assert!(missing.ends_with("has no joint `c`; it has finger; a, b"), "{missing}");
}

#[test]
fn points_in_joint_names_are_what_a_rig_can_call_them() {
    let folder = Folder::new("bag-points-in-names");
    let messages = messages(|time, seconds| vec![state("/joint_states", time, &names(["arm.a"]), &[seconds])]);
    let options = OpenOptions { known_joints: names(["arm_a"]), ..OpenOptions::default() };
    let Opened { recording, notes, .. } = read_with(&images_beside(4, &messages), &folder, &options).unwrap();
    assert_eq!(recording.joints, ["arm_a"]);
    assert!(!notes.iter().any(|note| note.contains("in the order of")), "{notes:?}");
}

#[test]
fn states_of_an_arm_and_a_gripper_on_one_topic_are_told_apart_and_those_without_positions_say_nothing() {
    let folder = Folder::new("bag-two-publishers");
    let [arm, gripper] = [names(["a", "b"]), names(["finger", "thumb"])];
    let mut others = Vec::new();
    // Every 25 ms, in turns; the arm's joints are the time and its half. The first one has no positions.
    for index in 0..20_u64 {
        let time = 900_000_000 + 25_000_000 * index;
        let seconds = time as f64 / 1e9;
        let bytes = match index {
            0 => joint_state(time, &arm, &[]),
            _ if index % 2 == 0 || index == 1 => joint_state(time, &arm, &[seconds, 0.5 * seconds]),
            _ => joint_state(time, &gripper, &[100.0, 200.0]),
        };
        others.push((
            "/joint_states",
            "sensor_msgs/msg/JointState",
            format!("{HEADER}{JOINTS}{HEADER_PARTS}"),
            time,
            bytes,
        ));
    }
    // Recorders write what comes late behind what came after it.
    others[8..].reverse();
    let Opened { recording, notes, .. } =
        read_with(&images_beside(4, &others), &folder, &OpenOptions::default()).unwrap();
    assert_eq!(recording.joints, ["a", "b"]);
    for (index, sample) in recording.samples.iter().enumerate() {
        let seconds = 1.0 + 0.1 * index as f64;
        let [a, b] = sample.joints.as_ref().unwrap()[..] else { panic!() };
        assert!((a - seconds).abs() < 1e-9 && (b - 0.5 * seconds).abs() < 1e-9, "{a} {b} at {seconds}");
    }
    assert!(notes.iter().any(|note| note.contains("10 of 20 joint states lack a joint or a position")), "{notes:?}");
}

/// Names within a driver's prefix and suffix, in the driver's order, as those of a rig's; of two arms neither is taken for the other.
#[test]
fn joints_of_a_driver_are_those_of_the_rig_in_the_order_of_the_rig() {
    let folder = Folder::new("bag-driver");
    let options = OpenOptions { known_joints: names(["a", "b"]), ..OpenOptions::default() };
    let of = |joints: [&str; 3]| {
        let states = messages(|time, seconds| {
            vec![state("/joint_states", time, &names(joints), &[0.5 * seconds, 7.0, seconds])]
        });
        read_with(&images_beside(4, &states), &folder, &options)
    };
    let Opened { recording, notes, .. } = of(["left_b_joint", "finger_joint", "left_a_joint"]).unwrap();
    assert_eq!(recording.joints, ["left_a_joint", "left_b_joint"]);
    for (index, sample) in recording.samples.iter().enumerate() {
        let seconds = 1.0 + 0.1 * index as f64;
        let [a, b] = sample.joints.as_ref().unwrap()[..] else { panic!() };
        assert!((a - seconds).abs() < 1e-9 && (b - 0.5 * seconds).abs() < 1e-9, "{a} {b} at {seconds}");
    }
    assert!(!notes.iter().any(|note| note.contains("--joints")), "{notes:?}");
    // Neither of the right words nor within the same ones: the rig's names say nothing of these.
    assert_eq!(of(["left_b", "finger", "right_a"]).unwrap().recording.joints.len(), 3);
    let both = messages(|time, seconds| {
        let arms = names(["left_a", "left_b", "right_a", "right_b"]);
        vec![state("/joint_states", time, &arms, &[seconds, 0.5 * seconds, 0.0, 0.0])]
    });
    let several = |messages: &[Message]| {
        let error = read_with(&images_beside(4, messages), &folder, &options).unwrap_err().to_string();
        assert!(error.contains("left_a or right_a: --joints names those of one robot"), "{error}");
    };
    several(&both);
    // In turn on one topic, in either order.
    let in_turn = |first: [&str; 2], second: [&str; 2]| {
        messages(|time, seconds| {
            let positions = [seconds, 0.5 * seconds];
            [first, second].map(|arm| state("/joint_states", time, &names(arm), &positions)).to_vec()
        })
    };
    several(&in_turn(["left_a", "left_b"], ["right_a", "right_b"]));
    several(&in_turn(["right_a", "right_b"], ["left_a", "left_b"]).into_iter().rev().collect::<Vec<_>>());
    // Just so comes before any prefix, whatever came first, and a state of which positions are missing hides nothing.
    for joints in [["left_a", "left_b"], ["b", "a"]] {
        let mut states = in_turn(joints, ["a", "b"]);
        states.insert(0, state("/joint_states", 890_000_000, &names(["a", "b"]), &[7.0]));
        let found = read_with(&images_beside(4, &states), &folder, &options).unwrap().recording;
        assert_eq!(found.joints, ["a", "b"], "{joints:?}");
    }
    // Named, and there are no states to name them in.
    let named = OpenOptions { joints: names(["a", "b"]), ..OpenOptions::default() };
    let error = read_with(&images_beside(4, &[]), &folder, &named).unwrap_err().to_string();
    assert!(error.contains("has no joint states, of which --joints"), "{error}");
}

/// Two cameras 20 ms apart, an arm that begins to move at 1.35 s: one joint goes with the time, by 1 rad/s.
#[test]
fn images_between_which_the_robot_moved_are_samples_of_their_own_with_the_joints_of_their_own_time() {
    let folder = Folder::new("bag-moving");
    let angle = |seconds: f64| (seconds - 1.35).max(0.0);
    let mut beside: Vec<Message> = (0..90)
        .map(|index| 950_000_000 + 10_000_000 * index)
        .map(|time| state("/joint_states", time, &names(["a"]), &[angle(time as f64 / 1e9)]))
        .collect();
    beside.extend((0..8).map(|index| image("/right/tags", "right", 1_020_000_000 + 100_000_000 * index)));
    let bytes = images_beside(8, &beside);
    let Opened { recording, notes, .. } = read_with(&bytes, &folder, &OpenOptions::default()).unwrap();
    // At 1.0, 1.1, 1.2 and 1.3 s it stood still.
    assert_eq!(recording.samples.len(), 4 + 2 * 4);
    for (index, sample) in recording.samples.iter().enumerate() {
        let [first, last] = [sample.pixels.first(), sample.pixels.last()].map(|seen| seen.unwrap().camera);
        assert_eq!(first == last, index >= 4, "sample {index}");
        let (time, read) = (sample.time.unwrap(), sample.joints.as_ref().unwrap()[0]);
        let expected = if index < 4 { 1.01 + 0.1 * index as f64 } else { 1.4 + 0.1 * ((index - 4) / 2) as f64 };
        let later = if index >= 4 { 0.02 * f64::from(first) } else { 0.0 };
        assert!((time - expected - later).abs() < 1e-9 && (read - angle(time)).abs() < 1e-9, "{index}: {time} {read}");
    }
    assert!(notes.iter().any(|note| note.starts_with("4 times the robot moved")), "{notes:?}");
    let bag = BagOptions { join: Some(0.03), ..BagOptions::default() };
    let joined = read_with(&bytes, &folder, &OpenOptions { bag, ..OpenOptions::default() }).unwrap().recording;
    assert_eq!(joined.samples.len(), 8);
}

/// Three images of which the outer two look at the same, and one of another group at the very time of one that is taken apart.
#[test]
fn every_image_counts_in_whether_the_robot_moved_and_none_loses_its_joints() {
    let folder = Folder::new("bag-back");
    let there_and_back = |seconds: f64| 0.5 - 25.0 * (seconds - 1.02).abs();
    let joints = |angle: &dyn Fn(f64) -> f64| -> Vec<Message> {
        let times = (0..90).map(|index| 950_000_000 + 10_000_000 * index);
        times.map(|time| state("/joint_states", time, &names(["a"]), &[angle(time as f64 / 1e9)])).collect()
    };
    let mut beside = joints(&there_and_back);
    beside.push(image("/right/tags", "right", 1_020_000_000));
    beside.push(image("/top/tags", "top", 1_040_000_000));
    // Two images of one camera are 0.1 s apart.
    let recording = read_with(&images_beside(2, &beside), &folder, &OpenOptions::default()).unwrap().recording;
    let read: Vec<f64> = recording.samples.iter().map(|sample| sample.joints.as_ref().unwrap()[0]).collect();
    assert_eq!(recording.samples.len(), 4);
    assert!(read.iter().zip([0.0, 0.5, 0.0]).all(|(a, b)| (a - b).abs() < 1e-9), "{read:?}");

    let mut beside = joints(&|seconds| seconds);
    beside.push(image("/right/tags", "right", 1_020_000_000));
    beside.push(image("/left/tags", "left", 1_020_000_000));
    let recording = read_with(&images_beside(3, &beside), &folder, &OpenOptions::default()).unwrap().recording;
    for sample in &recording.samples {
        let (time, read) = (sample.time.unwrap(), sample.joints.as_ref().unwrap()[0]);
        assert!((time - read).abs() < 1e-9, "{time} {read}");
    }
    let at = |time: f64| recording.samples.iter().filter(|sample| (sample.time.unwrap() - time).abs() < 1e-9).count();
    assert_eq!((recording.samples.len(), at(1.02)), (4, 1));
}
