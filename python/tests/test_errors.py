"""One hierarchy of exceptions, with places, and the messages of the command."""

import pickle
import subprocess
import sys

import pytest

import handeye


def test_unusable_input_names_its_place(tmp_path):
    path = tmp_path / "rig.toml"
    path.write_text('[[cameras]]\nname = "left"\nmodel = "fisheye"\n')
    with pytest.raises(handeye.UnusableInput) as raised:
        handeye.Rig.load(path)
    error = raised.value
    assert (error.file, error.line, error.column) == (str(path), 3, 9)
    assert isinstance(error, handeye.Error) and isinstance(error, ValueError)
    again = pickle.loads(pickle.dumps(error))
    assert (str(again), again.line) == (str(error), 3)
    run = subprocess.run([sys.executable, "-m", "handeye", "check", path], capture_output=True, text=True)
    assert run.returncode == 2 and run.stderr == f"error: {error}\n"


def test_a_missing_file_is_unusable_input():
    with pytest.raises(handeye.UnusableInput, match="nowhere.toml"):
        handeye.Rig.load("nowhere.toml")
    with pytest.raises(handeye.UnusableInput, match="nowhere.jsonl"):
        handeye.Recording.load("nowhere.jsonl")


def test_too_little_data_is_work_not_done(motions, tmp_path):
    with pytest.raises(handeye.NotDone) as raised:
        handeye.calibrate(motions[:2])
    assert isinstance(raised.value, RuntimeError) and not isinstance(raised.value, handeye.UnusableInput)
    motions[:2].save(tmp_path / "two.jsonl")
    command = [sys.executable, "-m", "handeye", "calibrate", tmp_path / "two.jsonl", "-o", tmp_path / "learned.toml"]
    run = subprocess.run(command, capture_output=True, text=True)
    assert run.returncode == 1 and run.stderr.endswith(f"error: {raised.value}\n")


def test_a_rig_that_does_not_fit_the_recording_is_unusable(motions):
    with pytest.raises(handeye.UnusableInput, match="joints"):
        handeye.calibrate(motions, handeye.random_rig(joints=4))
