"""Rigs: files, numbers by path, and the generative model against one written down here in numpy."""

import copy
import pickle

import numpy as np
import pytest

import handeye


def denavit_hartenberg(offset, d, a, alpha, joint):
    """Rz(offset + joint) Tz(d) Tx(a) Rx(alpha), as the textbook has it."""
    c, s, ca, sa = np.cos(offset + joint), np.sin(offset + joint), np.cos(alpha), np.sin(alpha)
    return np.array([[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]])


def links(rig, joints):
    base = rig["robot.base"]
    poses = [np.eye(4) if base is None else base]
    for name, joint in zip(rig.joint_names, joints):
        row = [rig[f"robot.joints.{name}.{field}"] for field in ("offset", "d", "a", "alpha")]
        poses.append(poses[-1] @ denavit_hartenberg(*row, joint))
    return np.array(poses)


def positions(rig, random, n):
    lower, upper = np.maximum(rig.lower, -np.pi), np.minimum(rig.upper, np.pi)
    return random.uniform(lower, upper, (n, rig.n_joints))


def test_forward_kinematics_are_those_of_the_textbook(ur5, random):
    joints = positions(ur5, random, 50)
    expected = np.array([links(ur5, row) for row in joints])
    np.testing.assert_allclose(ur5.links(joints), expected, atol=1e-12)
    np.testing.assert_allclose(ur5.forward(joints), expected[:, -1], atol=1e-12)
    np.testing.assert_array_equal(ur5.forward(joints[7]), ur5.forward(joints)[7])
    np.testing.assert_array_equal(ur5.forward(list(joints[7])), ur5.forward(joints)[7])


def test_the_jacobian_is_the_slope_of_the_forward_kinematics(ur5, random):
    step = 1e-6
    for joints in positions(ur5, random, 10):
        jacobian = ur5.jacobian(joints)
        for i in range(ur5.n_joints):
            moved = np.array([ur5.forward(joints + sign * step * np.eye(6)[i]) for sign in (1, -1)])
            velocity = (moved[0] - moved[1]) / (2 * step)
            np.testing.assert_allclose(jacobian[3:, i], velocity[:3, 3], atol=1e-8)
            turn = velocity[:3, :3] @ ur5.forward(joints)[:3, :3].T
            np.testing.assert_allclose(jacobian[:3, i], [turn[2, 1], turn[0, 2], turn[1, 0]], atol=1e-8)


def test_predicted_pixels_are_those_of_the_pinhole_formula(ur5, random):
    joints = positions(ur5, random, 30)
    predicted, points = ur5.predict(joints), ur5.predict_points(joints)
    for camera in ur5.camera_names:
        assert ur5.parent(f"cameras.{camera}") == "world" and ur5.lens_model(camera) == "pinhole"
        camera_from_world = np.linalg.inv(ur5[f"cameras.{camera}.pose"])
        k = ur5.camera_matrix(camera)
        for row, pixels, seen in zip(joints, predicted[camera], points[camera]):
            tip = links(ur5, row)[-1]
            for name, pixel, point in zip(ur5.feature_names, pixels, seen):
                expected = (camera_from_world @ tip @ np.append(ur5[f"features.{name}.xyz"], 1.0))[:3]
                np.testing.assert_allclose(point, expected, atol=1e-12)
                if expected[2] <= 0.0:
                    assert np.isnan(pixel).all()
                else:
                    np.testing.assert_allclose(pixel, (k @ expected)[:2] / expected[2], rtol=1e-9)
    assert any(np.isnan(pixels).any() for pixels in ur5.predict(joints, in_image=True).values())


def test_numbers_are_read_and_changed_by_their_path(ur5):
    rig = ur5.copy()
    rig["cameras.left.fx"] = 612.5
    rig["features.f0.xyz"] = [0.1, 0.2, 0.3]
    pose = np.eye(4)
    pose[:3, 3] = [1, 2, 3]
    rig["cameras.left.pose"] = pose
    again = handeye.Rig.from_string(rig.to_toml())
    assert again == rig and rig != ur5
    assert again["cameras.left.fx"] == 612.5
    np.testing.assert_array_equal(again["features.f0.xyz"], [0.1, 0.2, 0.3])
    np.testing.assert_array_equal(again["cameras.left.pose"], pose)
    assert rig.is_complete and "cameras.left.fx" in rig
    del rig["cameras.left.fx"]
    assert rig["cameras.left.fx"] is None and "cameras.left.fx" not in rig and not rig.is_complete
    with pytest.raises(handeye.UnusableInput, match="cameras.left.fx"):
        rig.predict(np.zeros(6))
    assert set(rig.parameters()) == set(ur5.parameters())


def test_what_cannot_be_is_refused_in_words(ur5):
    rig = ur5.copy()
    with pytest.raises(KeyError, match=r"did you mean `cameras.left.fx`\?"):
        rig["cameras.left.fz"]
    with pytest.raises(handeye.UnusableInput, match="a focal length is above 0 px, found -1"):
        rig["cameras.left.fx"] = -1.0
    with pytest.raises(handeye.UnusableInput, match="cameras.left.pose: a pose is a homogeneous matrix"):
        rig["cameras.left.pose"] = 2 * np.eye(4)
    with pytest.raises(handeye.UnusableInput, match=r"joints: shape \[3\], and \(6,\) or \(samples, 6\) would do"):
        rig.forward(np.zeros(3))
    with pytest.raises(handeye.UnusableInput, match="fixed|holds|no parameter|matches"):
        rig.fixed = ["cameras.middle"]
    assert rig == ur5


def test_limits_noise_and_what_is_held_survive_a_file(ur5, tmp_path):
    rig = ur5.copy()
    rig.name = "mine"
    rig.upper = [1.0, 2.0, 3.0, np.inf, 1.0, 1.0]
    rig.max_velocity = np.full(6, 0.5)
    rig.set_noise(pixels=0.25, joints=1e-3, pose=(1e-3, 2e-3))
    rig.fixed = ["cameras.*.cx", "cameras.*.cy"]
    rig.prior = {"cameras.*.fx": 10.0}
    rig.save(tmp_path / "rig.toml")
    again = handeye.Rig.load(tmp_path / "rig.toml")
    assert again == rig and again.name == "mine"
    assert again.upper[3] == np.inf and again.upper[1] == 2.0
    assert again.noise["pixels"] == 0.25 and again.noise["pose"] == (1e-3, 2e-3)
    assert again.fixed == ["cameras.*.cx", "cameras.*.cy"] and again.prior == {"cameras.*.fx": 10.0}


@pytest.mark.parametrize("name", ["lower", "upper", "max_velocity", "max_acceleration"])
def test_what_is_no_bound_is_refused_and_changes_nothing(ur5, name):
    rig = ur5.copy()
    unlimited = -np.inf if name == "lower" else np.inf
    for wrong in (np.nan, -unlimited):
        with pytest.raises(handeye.UnusableInput, match=f"{name}: .* is no bound"):
            setattr(rig, name, [unlimited, wrong, 1.0, 1.0, 1.0, 1.0])
        assert rig == ur5


def test_comments_of_a_file_survive(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('# mine\n[[cameras]]\nname = "left"  # the one at the window\nfx = 600.0\n')
    rig = handeye.Rig.load(str(path))
    rig["cameras.left.fx"] = 601.0
    rig.save(path)
    assert path.read_text() == '# mine\n[[cameras]]\nname = "left"  # the one at the window\nfx = 601.0\n'


def test_copies_change_by_themselves_and_pickles_are_the_same(ur5):
    for other in (ur5.copy(), copy.copy(ur5), copy.deepcopy(ur5), pickle.loads(pickle.dumps(ur5))):
        assert other == ur5
        other["cameras.left.fx"] = 1.0
        assert ur5["cameras.left.fx"] != 1.0


def test_every_shipped_rig_loads_and_moves():
    for name in handeye.shipped_rigs():
        rig = handeye.Rig.load(name)
        assert rig.forward(np.zeros((2, rig.n_joints))).shape == (2, 4, 4)
        assert repr(rig).startswith("<handeye.Rig")


def test_a_path_or_the_name_of_a_shipped_rig_is_as_good_as_the_rig(ur5, motions, tmp_path):
    ur5.save(tmp_path / "mine.toml")
    for rig in (str(tmp_path / "mine.toml"), tmp_path / "mine.toml", "ur5"):
        assert handeye.evaluate(rig, motions).rms_px == handeye.evaluate(ur5, motions).rms_px
        assert handeye.servo.Stepper(rig).step(np.zeros(6), [handeye.servo.JointTarget(np.ones(6))], dt=0.1).motion.shape == (6,)
        plain = handeye.Recording.from_arrays(motions.joints, motions.pixels, rig=rig)
        assert plain.joint_names == ur5.joint_names
    with pytest.raises(handeye.UnusableInput, match="nowhere.toml"):
        handeye.evaluate("nowhere.toml", motions)
    with pytest.raises(TypeError, match="a rig is a handeye.Rig, a path or the name of a shipped one"):
        handeye.evaluate(5, motions)
