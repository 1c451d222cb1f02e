"""What a known rig is for: pixels to joints and poses, poses to joints."""

import json
import subprocess
import sys

import numpy as np
import pytest

import handeye


def test_joints_are_found_from_pixels_alone(ur5, fresh):
    inferred = handeye.infer(ur5, fresh)
    assert len(inferred) == len(fresh) and inferred.errors == [None] * len(fresh)
    best = [
        min((np.abs(branch.joints - joints).max() for branch in branches), default=np.inf)
        for branches, joints in zip(inferred.branches, fresh.joints)
    ]
    assert np.median(best) < 0.01, "the true joints are among the branches"
    np.testing.assert_allclose(inferred.poses, ur5.forward(inferred.joints), atol=1e-9)
    np.testing.assert_array_equal(inferred.sd, np.sqrt(np.diagonal(inferred.covariance, axis1=1, axis2=2)))


def test_a_recording_is_inferred_as_by_the_command(ur5, fresh, tmp_path):
    fresh[:5].save(tmp_path / "fresh.jsonl")
    command = [sys.executable, "-m", "handeye", "infer", "ur5", tmp_path / "fresh.jsonl"]
    lines = subprocess.run(command, check=True, capture_output=True, text=True).stdout.splitlines()
    inferred = handeye.infer(ur5, handeye.Recording.load(tmp_path / "fresh.jsonl"))
    np.testing.assert_array_equal(inferred.joints, [json.loads(line)["joints"] for line in lines])
    np.testing.assert_array_equal(inferred.probability, [json.loads(line)["probability"] for line in lines])


def test_errors_of_the_joints_are_as_large_as_their_covariance_says(ur5):
    # Exact joints are the start, so that it is this branch; 6 errors squared over their covariance have a mean of 6.
    simulated = handeye.simulate(ur5, samples=200, seed=5)
    inference = handeye.Inference(ur5)
    squares = []
    for index, joints in enumerate(simulated.truth.joints):
        pixels = {camera: pixels[index] for camera, pixels in simulated.recording.pixels.items()}
        branch = inference.joints_near(pixels, joints)
        error = branch.joints - joints
        squares.append(error @ np.linalg.solve(branch.covariance, error))
    # Mean of 200: standard deviation sqrt(12 / 200) = 0.25. The rig states 0.3 px, which is what was simulated.
    assert np.mean(squares) == pytest.approx(6.0, abs=4 * 0.25)


def test_poses_and_tracking_agree_with_the_branches(ur5, fresh):
    inference = handeye.Inference(ur5)
    pixels = {camera: pixels[0] for camera, pixels in fresh.pixels.items()}
    [pose, *_] = inference.poses(pixels)
    near = inference.joints_near(pixels, fresh.joints[0])
    assert np.linalg.norm(pose.pose[:3, 3] - near.pose[:3, 3]) < 0.005
    assert pose.covariance.shape == (6, 6) and near.open.shape == (0, 6)
    still = inference.joints_after([near], np.zeros(6), pixels)
    np.testing.assert_allclose(still[0].joints, near.joints, atol=1e-3)


def test_readings_narrow_what_pixels_leave_open(ur5, fresh):
    inference = handeye.Inference(ur5)
    one = {"left": np.full((len(ur5.feature_names), 2), np.nan)}
    one["left"][0] = fresh.pixels["left"][0][~np.isnan(fresh.pixels["left"][0]).any(axis=1)][0]
    [branch, *_] = inference.joints(one, near=fresh.joints[0])
    assert len(branch.open) == 4, "one pixel says two things"
    [read, *_] = inference.joints(one, near=fresh.joints[0], sd=np.full(6, 1e-3))
    assert (np.sqrt(np.diag(read.covariance)) < 1.1e-3).all()
    with pytest.raises(handeye.NotDone, match="nothing"):
        inference.joints({})


def test_inverse_kinematics_reach_what_is_within_reach(ur5, fresh):
    inverse = handeye.InverseKinematics(ur5)
    for target, joints in zip(ur5.forward(fresh.joints[:20]), fresh.joints):
        reached = inverse.solve(target, near=joints + 0.1)
        assert reached.reached
        np.testing.assert_allclose(ur5.forward(reached.joints), target, atol=1e-6)
        branches = inverse.branches(target)
        assert all(np.allclose(ur5.forward(branch.joints), target, atol=1e-6) for branch in branches)
        assert min(np.abs(branch.joints - joints).max() for branch in branches) < 1e-5
    away = np.eye(4)
    away[0, 3] = 5.0
    assert not inverse.solve(away).reached


def test_what_is_seen_has_the_shape_of_the_rig(ur5):
    inference = handeye.Inference(ur5)
    with pytest.raises(handeye.UnusableInput, match=r"camera `left`: shape \[3, 2\], and"):
        inference.joints({"left": np.zeros((3, 2))})
    with pytest.raises(handeye.UnusableInput, match=r"camera `top` is not known \(known: left, right\)"):
        inference.joints({"top": np.zeros((len(ur5.feature_names), 2))})
