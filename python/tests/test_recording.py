"""Recordings: files, arrays in and out, and the bags of another writer."""

import json
import pickle
import warnings

import numpy as np
import pytest

import handeye


def arrays(recording):
    return {
        "joints": recording.joints,
        "pixels": recording.pixels,
        "times": recording.times,
        "poses": recording.poses,
        "points": recording.points,
        "targets": recording.targets,
        "joint_actions": recording.joint_actions,
        "pose_actions": recording.pose_actions,
    }


def names(recording):
    return {
        "joint_names": recording.joint_names,
        "feature_names": recording.feature_names,
        "cameras": recording.cameras,
    }


def test_arrays_are_what_the_file_says(motions):
    header, *samples = [json.loads(line) for line in motions.to_jsonl().splitlines()]
    assert header["joints"] == motions.joint_names and list(header["cameras"]) == motions.camera_names
    np.testing.assert_array_equal(motions.joints, [sample["joints"] for sample in samples])
    np.testing.assert_array_equal(motions.times, [sample["time"] for sample in samples])
    for camera, pixels in motions.pixels.items():
        assert pixels.shape == (len(motions), len(motions.feature_names), 2)
        for row, sample in zip(pixels, samples):
            seen = sample["pixels"].get(camera, {})
            for feature, pixel in zip(motions.feature_names, row):
                np.testing.assert_array_equal(pixel, seen.get(feature, [np.nan, np.nan]))


def test_arrays_out_are_arrays_in(motions):
    assert handeye.Recording.from_arrays(**arrays(motions), **names(motions)) == motions


def test_every_kind_of_measurement_survives(random, tmp_path):
    n = 5
    poses = np.tile(np.eye(4), (n, 1, 1))
    poses[:, :3, 3] = random.normal(size=(n, 3))
    some = poses.copy()
    some[2] = np.nan
    covariances = np.tile(np.diag([1e-6] * 3 + [1e-5] * 3), (n, 1, 1))
    points = random.normal(size=(n, 3, 3))
    points[1, 2] = np.nan
    recording = handeye.Recording.from_arrays(
        random.normal(size=(n, 2)),
        times=np.arange(n) / 10,
        poses=some,
        points={"depth": points},
        targets={"left": {"board": some, "tag": poses}},
        target_covariances={"left": {"board": covariances}},
        pose_actions=poses,
        cameras={"left": {"size": (640, 480), "fx": 600.0, "distortion": [0.1, -0.2]}},
    )
    recording.save(tmp_path / "recording.jsonl")
    again = handeye.Recording.load(tmp_path / "recording.jsonl")
    assert again == recording == pickle.loads(pickle.dumps(recording))
    assert again.joint_names == ["j1", "j2"] and again.feature_names == ["f0", "f1", "f2"]
    np.testing.assert_array_equal(again.points["depth"], points)
    np.testing.assert_allclose(again.poses, some, atol=1e-15)
    np.testing.assert_allclose(again.targets["left"]["board"], some, atol=1e-15)
    assert again.pixels == {} and again.joint_actions is None
    assert np.isnan(again.pose_actions[-1]).all(), "the last action leads nowhere"
    assert again.cameras["left"] == {"size": (640, 480), "fx": 600.0, "distortion": [0.1, -0.2]}


def test_features_are_put_into_natural_order():
    pixels = np.arange(6.0).reshape(1, 3, 2)
    recording = handeye.Recording.from_arrays([[0.0]], {"c": pixels}, feature_names=["f10", "f2", "f1"])
    assert recording.feature_names == ["f1", "f2", "f10"]
    np.testing.assert_array_equal(recording.pixels["c"], pixels[:, ::-1])


def test_names_and_lenses_come_from_a_rig(ur5, motions):
    plain = handeye.Recording.from_arrays(motions.joints, motions.pixels, times=motions.times, rig=ur5)
    assert plain.joint_names == ur5.joint_names and plain.cameras == motions.cameras
    np.testing.assert_array_equal(plain.pixels["left"], motions.pixels["left"])


def test_shapes_that_do_not_fit_are_refused_in_words():
    joints, pixels = np.zeros((4, 2)), np.zeros((4, 3, 2))
    for wrong, message in [
        ({"joints": joints, "pixels": {"c": pixels[:3]}}, "joints has 4 samples, pixels of `c` has 3"),
        ({"joints": joints, "pixels": {"c": pixels[..., :1]}}, r"pixels of `c`: shape \[4, 3, 1\], and \(samples, 3, 2\) would do"),
        ({"joints": joints, "joint_names": ["a"]}, "joints of 2 columns, and 1 names"),
        ({"joints": joints, "joint_names": ["a", "a"]}, "two joints are called `a`"),
        ({"joints": np.full((1, 2), np.inf)}, "sample 0: found inf"),
        ({"poses": np.zeros((4, 4, 4))}, "poses, sample 0: a pose is a homogeneous matrix"),
        ({"joints": joints, "cameras": {"c": {"focal": 1.0}}}, r"camera `c`: unknown key `focal` \(known: size"),
        ({"joints": joints, "cameras": {"c": {"model": "fisheye"}}}, "unknown model `fisheye` \\(known: pinhole"),
        (
            {"targets": {"c": {"board": np.tile(np.eye(4), (4, 1, 1))}}, "target_covariances": {"c": {"bord": np.zeros((4, 6, 6))}}},
            "target_covariances: there are no `targets` of camera `c`, `bord`",
        ),
        ({}, "no array is given"),
    ]:
        with pytest.raises(handeye.UnusableInput, match=message):
            handeye.Recording.from_arrays(**wrong)


def test_parts_keep_their_order(motions):
    part = motions[10:20:3]
    np.testing.assert_array_equal(part.joints, motions.joints[10:20:3])
    np.testing.assert_array_equal(motions.select([3, 1]).joints, motions.joints[[1, 3]])
    assert len(motions[:0].to_jsonl().splitlines()) == 1
    with pytest.raises(handeye.UnusableInput, match="sample 50 of 50"):
        motions.select([50])


def test_several_files_are_one_recording(motions, tmp_path):
    motions[:20].save(tmp_path / "one.jsonl")
    motions[20:].save(tmp_path / "two.jsonl")
    both = handeye.Recording.load([tmp_path / "one.jsonl", str(tmp_path / "two.jsonl")])
    np.testing.assert_array_equal(both.joints, motions.joints)
    np.testing.assert_array_equal(both.pixels["right"], motions.pixels["right"])


def test_a_mistake_in_a_file_has_a_place(motions, tmp_path):
    lines = motions.to_jsonl().splitlines()
    lines[3] = lines[3].replace('"joints":[', '"joints":[0.5,')
    (tmp_path / "wrong.jsonl").write_text("\n".join(lines) + "\n")
    with pytest.raises(handeye.UnusableInput, match="7") as raised:
        handeye.Recording.load(tmp_path / "wrong.jsonl")
    assert raised.value.line == 4


def test_a_table_is_what_was_written_into_it(motions, tmp_path):
    pixels = {camera: pixels for camera, pixels in motions.pixels.items()}
    header = [f"joints.{name}" for name in motions.joint_names]
    header += [f"{c}.{f}.{axis}" for c in pixels for f in motions.feature_names for axis in "uv"]
    rows = np.concatenate([motions.joints, *(p.reshape(len(motions), -1) for p in pixels.values())], axis=1)
    lines = [",".join(header)] + [",".join("" if np.isnan(x) else repr(float(x)) for x in row) for row in rows]
    (tmp_path / "motions.csv").write_text("\n".join(lines) + "\n")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        table = handeye.Recording.load(tmp_path / "motions.csv")
    np.testing.assert_array_equal(table.joints, motions.joints)
    np.testing.assert_array_equal(table.pixels["left"], motions.pixels["left"])


def test_a_bag_is_what_was_written_into_it(ur5, motions, tmp_path):
    bags = pytest.importorskip("mcap_ros2.writer")
    write_bag(bags, tmp_path / "motions.mcap", motions)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        bag = handeye.Recording.load(tmp_path / "motions.mcap", rig=ur5)
    assert bag.joint_names == ur5.joint_names and bag.notes == []
    np.testing.assert_array_equal(bag.joints, motions.joints)
    np.testing.assert_array_equal(bag.pixels["left"], motions.pixels["left"])
    with pytest.warns(UserWarning, match="order of the joint state that has most"):
        assert len(handeye.Recording.load(tmp_path / "motions.mcap").notes) == 1


HEADER = "std_msgs/Header header\n"
LINE = "=" * 80 + "\n"
STANDARD = (
    f"{LINE}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{LINE}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
JOINTS = f"{HEADER}string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{STANDARD}"
DETECTIONS = (
    f"{HEADER}vision_msgs/Detection2D[] detections\n{STANDARD}"
    f"{LINE}MSG: vision_msgs/Detection2D\nstring id\nvision_msgs/BoundingBox2D bbox\n"
    f"{LINE}MSG: vision_msgs/BoundingBox2D\nvision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n"
    f"{LINE}MSG: vision_msgs/Pose2D\nvision_msgs/Point2D position\nfloat64 theta\n"
    f"{LINE}MSG: vision_msgs/Point2D\nfloat64 x\nfloat64 y\n"
)


def write_bag(bags, path, recording):
    with open(path, "wb") as stream:
        writer = bags.Writer(stream)
        of_joints = writer.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
        of_pixels = writer.register_msgdef("vision_msgs/msg/Detection2DArray", DETECTIONS)
        for index, joints in enumerate(recording.joints):
            time = 1_700_000_000_000_000_000 + 100_000_000 * index
            stamp = {"sec": time // 10**9, "nanosec": time % 10**9}

            def write(topic, schema, fields, frame=""):
                message = {"header": {"stamp": stamp, "frame_id": frame}, **fields}
                writer.write_message(topic=topic, schema=schema, message=message, log_time=time, publish_time=time)

            state = {"name": recording.joint_names, "position": list(joints), "velocity": [], "effort": []}
            write("/joint_states", of_joints, state)
            for camera, pixels in recording.pixels.items():
                found = [
                    {"id": name, "bbox": {"center": {"position": {"x": u, "y": v}, "theta": 0.0}, "size_x": 0.0, "size_y": 0.0}}
                    for name, (u, v) in zip(recording.feature_names, pixels[index])
                    if not np.isnan(u)
                ]
                write(f"/{camera}/features", of_pixels, {"detections": found}, camera)
        writer.finish()


def test_options_of_other_formats_and_words_that_say_nothing_are_refused(motions, tmp_path):
    path = tmp_path / "motions.jsonl"
    motions.save(path)
    for wrong, message in [
        ({"frames": ("base", "tip")}, "frames: none of the recordings is a bag, so that it has no effect"),
        ({"camera_topics": {"/tags": None}}, "camera_topics: none of the recordings is a bag"),
        ({"degrees": True}, "degrees: none of the recordings is a table"),
        ({"joint_delay": 0.01}, "the robot moves too far from one to the next to know where it was between them"),
        ({"joints": ["a"]}, "there is no joint `a`"),
        ({"episodes": [0]}, "episodes: none of the recordings is a table"),
        ({"cameras": {"nose": {"size": (640, 480)}}}, "there are no images of a camera `nose`"),
    ]:
        with pytest.raises(handeye.UnusableInput, match=message):
            handeye.Recording.load(path, **wrong)


def test_one_sample_of_each_standstill_is_taken_where_asked_for(tmp_path):
    times = np.arange(60) / 10
    stops = np.floor(times) + np.clip(2 * (times % 1) - 1, 0, 1)  # half a second still, half a second on the way
    paused = handeye.Recording.from_arrays(np.column_stack([stops, -stops]), times=times)
    paused.save(tmp_path / "paused.jsonl")
    with pytest.warns(UserWarning, match="the robot pauses 6 times"):
        handeye.Recording.load(tmp_path / "paused.jsonl")
    with pytest.warns(UserWarning, match="one sample of each standstill is taken: 6 of 60"):
        still = handeye.Recording.load(tmp_path / "paused.jsonl", still=True)
    np.testing.assert_array_equal(still.joints[:, 0], np.arange(6))


def test_tables_say_their_units_actions_and_lenses_by_keywords(tmp_path):
    table = tmp_path / "motions.csv"
    table.write_text("joints.a,joints.b,action.a,action.b,left.f0.u,left.f0.v\n90,0.2,91,0.3,1,2\n80,0.1,81,0.2,3,4\n")
    lens = tmp_path / "left.yaml"
    lens.write_text(
        "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\ncamera_matrix: {rows: 3, cols: 3, data: [600, 0, 320, 0, 601, 240, 0, 0, 1]}\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0.1, 0, 0, 0, 0]}\n"
    )
    with pytest.raises(handeye.UnusableInput, match="degrees"):
        handeye.Recording.load(table)
    with pytest.warns(UserWarning):
        read = handeye.Recording.load(table, degrees=["a"], actions="targets", cameras={"left": lens})
    np.testing.assert_allclose(read.joints, [[np.pi / 2, 0.2], [np.deg2rad(80), 0.1]])
    np.testing.assert_allclose(read.joint_actions[0], [np.deg2rad(1), 0.1])
    assert read.cameras["left"]["fy"] == 601.0 and read.cameras["left"]["size"] == (640, 480)
    with pytest.warns(UserWarning):
        assert np.array_equal(read.joints, handeye.Recording.load(table, degrees="a").joints)
    with pytest.raises(handeye.UnusableInput, match="degrees"):
        handeye.Recording.load(table, degrees=[])
    with pytest.raises(handeye.UnusableInput, match="degrees: true, or names of joints, are meant, and not 3"):
        handeye.Recording.load(table, degrees=3)
    with pytest.raises(handeye.UnusableInput, match="neither targets nor motions"):
        handeye.Recording.load(table, degrees=["a"], actions="target")
    with pytest.raises(handeye.UnusableInput, match="joints are in one of them"):
        handeye.Recording.load(table, degrees=True, radians=True)
