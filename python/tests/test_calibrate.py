"""Learning: the same bytes as the command, progress, Ctrl-C, other threads of Python, and what is told of the result."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import handeye

NOISE = 0.3  # px, of the shipped UR5


def test_a_rig_is_learned_from_the_recording_alone(learned, fresh):
    assert learned.converged and learned.samples == 50
    judged = handeye.evaluate(learned.rig, fresh)
    assert judged.rms_px < 1.1 * NOISE * 2**0.5
    assert judged.samples == 50 and set(judged.cameras) == {"left", "right"}
    assert learned.stages[-1].name == "end to end" and learned.stages[-1].loss_after <= learned.stages[-1].loss_before
    assert learned.gauge and learned.tip.median > 0.0


@pytest.mark.parametrize("with_rig", [False, True])
def test_the_learned_rig_is_that_of_the_command_byte_for_byte(motions, ur5, tmp_path, with_rig):
    motions.save(tmp_path / "motions.jsonl")
    command = [sys.executable, "-m", "handeye", "calibrate", tmp_path / "motions.jsonl", "-o", tmp_path / "learned.toml"]
    command += ["--report", tmp_path / "page.html", *(["--rig", "ur5"] if with_rig else [])]
    subprocess.run(command, check=True, capture_output=True)
    for threads in (1, 2, None):
        learned = handeye.calibrate(handeye.Recording.load(tmp_path / "motions.jsonl"), ur5 if with_rig else None, threads=threads)
        learned.rig.save(tmp_path / "ours.toml")
        assert (tmp_path / "ours.toml").read_bytes() == (tmp_path / "learned.toml").read_bytes()
        assert learned.rig.to_toml() == (tmp_path / "learned.toml").read_text()
    # But for the command, which the page of a command says.
    lines = (tmp_path / "page.html").read_text().splitlines(keepends=True)
    page = "".join(line for line in lines if not line.startswith('<p class="command">'))
    assert learned.html("learned.toml, learned from motions.jsonl") == page and len(page) < sum(map(len, lines))


def test_errors_are_those_of_the_pixels_counted_here(learned, fresh):
    rig = learned.rig
    predicted, seen = rig.predict(fresh.joints), fresh.pixels
    order = [rig.feature_names.index(name) for name in fresh.feature_names]
    errors = {camera: predicted[camera][:, order] - seen[camera] for camera in seen}
    distances = np.concatenate([np.linalg.norm(error, axis=-1).ravel() for error in errors.values()])
    distances = distances[~np.isnan(distances)]
    judged = handeye.evaluate(rig, fresh)
    assert judged.observations == len(distances)
    for found, expected in [
        (judged.rms_px, np.sqrt((distances**2).mean())),
        (judged.mean_px, distances.mean()),
        (judged.median_px, np.median(distances)),
        (judged.total.max_px, distances.max()),
    ]:
        assert found == pytest.approx(expected, rel=1e-9)
    for camera, residuals in handeye.residuals(rig, fresh).items():
        np.testing.assert_allclose(residuals, errors[camera], atol=1e-9)


def test_progress_is_told_on_the_calling_thread(motions):
    told = []
    handeye.calibrate(motions, progress=lambda progress: told.append((progress, threading.get_ident())))
    assert {ident for _, ident in told} == {threading.get_ident()}
    stages = [progress.stage for progress, _ in told]
    assert stages[-1] == "end to end" and len(set(stages)) > 2
    assert all(0 <= progress.done <= progress.of for progress, _ in told)


def test_what_the_callback_raises_ends_the_work(motions):
    calls = []

    def fail(progress):
        calls.append(progress)
        raise LookupError("enough")

    with pytest.raises(LookupError, match="enough"):
        handeye.calibrate(motions, progress=fail)
    assert len(calls) == 1


@pytest.mark.parametrize("threads", [None, 1])
def test_ctrl_c_ends_the_work(threads):
    # Of a rig this large, that takes seconds.
    motions = handeye.simulate(handeye.random_rig(7, 3, 20, seed=1), samples=300).recording
    stages, began = [], threading.Event()

    def progress(now):
        stages.append(now.stage)
        began.set()

    def interrupt():
        began.wait()
        time.sleep(0.05)
        os.kill(os.getpid(), signal.SIGINT)

    other = threading.Thread(target=interrupt)
    other.start()
    with pytest.raises(KeyboardInterrupt):
        handeye.calibrate(motions, progress=progress, threads=threads)
    other.join()
    assert stages and "end to end" not in stages


def test_other_threads_of_python_go_on_meanwhile(ur5):
    motions = handeye.simulate(ur5, samples=300).recording
    counted, done = [], threading.Event()

    def count():
        while not done.wait(0.005):
            counted.append(None)

    other = threading.Thread(target=count)
    other.start()
    before = len(counted)
    handeye.calibrate(motions, threads=1)
    meanwhile = len(counted) - before
    done.set()
    other.join()
    assert meanwhile > 3, "with the interpreter held, it would be 1 at most"


def test_what_moved_is_relearned_from_a_few_samples(ur5):
    moved = ur5.copy()
    pose = moved["cameras.left.pose"]
    pose[:3, 3] += [0.05, -0.03, 0.02]
    moved["cameras.left.pose"] = pose
    five = handeye.simulate(moved, samples=5, seed=3).recording
    again = handeye.calibrate(five, ur5, relearn=["cameras.left"])
    np.testing.assert_array_equal(again.rig["cameras.right.pose"], ur5["cameras.right.pose"])
    shift = again.rig["cameras.left.pose"][:3, 3] - pose[:3, 3]
    sd = again.deviations["cameras.left.pose"][:3]
    assert (np.abs(shift) < 5 * sd).all() and (sd < 0.01).all()


def test_a_measured_length_tells_how_large_everything_is(motions, ur5):
    def distance(rig, one, other):
        return np.linalg.norm(np.subtract(rig[f"features.{one}.xyz"], rig[f"features.{other}.xyz"]))

    learned = handeye.calibrate(motions, lengths=[("features.f0", "features.f7", distance(ur5, "f0", "f7"))])
    assert learned.tip.metric
    with_sd = [("features.f0", "features.f7", distance(ur5, "f0", "f7"), 0.0005)]
    assert handeye.calibrate(motions, lengths=with_sd).rig == learned.rig
    assert abs(distance(learned.rig, "f2", "f9") / distance(ur5, "f2", "f9") - 1.0) < 0.01
    assert not handeye.calibrate(motions).tip.metric
    with pytest.raises(ValueError, match="two features or two cameras"):
        handeye.calibrate(motions, lengths=[("f0", "f7", 0.1)])
    for wrong in (0.0, -0.1, float("nan")):
        with pytest.raises(handeye.UnusableInput, match="above 0"):
            handeye.calibrate(motions, lengths=[("features.f0", "features.f7", wrong)])
    with pytest.raises(handeye.UnusableInput, match="below 2 m"):
        handeye.calibrate(motions, tag_side=(60.0, 0.2))
    with pytest.raises(handeye.UnusableInput, match="no tag has its four corners"):
        handeye.calibrate(motions, tag_side=0.06)


def test_cameras_that_no_rig_lists_are_put_on_the_hand(ur5, motions):
    # These stand in the world, so that nothing can be learned where they are taken to be on the hand.
    assert handeye.calibrate(motions, "ur5_arm").converged
    with pytest.raises(handeye.NotDone):
        handeye.calibrate(motions, "ur5_arm", eye_in_hand=True)
    with pytest.raises(handeye.UnusableInput, match="eye_in_hand: the rig lists every camera"):
        handeye.calibrate(motions, ur5, eye_in_hand=True)


def test_what_is_known_is_held(motions):
    held = handeye.calibrate(motions, "ur5_arm", hold=["cameras.*.intrinsics", "robot.joints.elbow.d"])
    free = handeye.calibrate(motions, "ur5_arm")
    for path in ("cameras.left.fx", "robot.joints.elbow.d"):
        assert path not in held.deviations and free.deviations[path] > 0
    assert held.rig["robot.joints.elbow.d"] == handeye.Rig.load("ur5_arm")["robot.joints.elbow.d"]
    with pytest.raises(handeye.UnusableInput, match="hold: .*`cameras.lefd` matches nothing"):
        handeye.calibrate(motions, "ur5_arm", hold=["cameras.lefd"])
    with pytest.raises(handeye.UnusableInput, match="hold: what is not learned anew"):
        handeye.calibrate(motions, held.rig, hold=["cameras.left.fx"], relearn=["cameras.left"])


def test_wrong_samples_are_named(ur5, motions):
    pixels = motions.pixels
    for camera in pixels:
        pixels[camera][[7, 21]] = pixels[camera][[21, 7]]
    wrong = handeye.Recording.from_arrays(motions.joints, pixels, times=motions.times, rig=ur5)
    findings = handeye.calibrate(wrong).findings
    assert any("sample 7" in finding and "swapped" in finding for finding in findings), findings


def test_influence_and_noise_are_estimated_where_asked_for(motions):
    learned = handeye.calibrate(motions[:30], estimate_noise=True, influence=True)
    # Some 1,200 coordinates: 2 % is one standard deviation.
    assert learned.rig.noise["pixels"] == pytest.approx(NOISE, rel=0.08)
    assert sorted(one.sample for one in learned.influence) == list(range(30))
    assert all(one.tip > 0.0 and one.misfit > 0.0 for one in learned.influence)


def test_noise_is_picked_or_estimated_and_not_both(motions):
    for other in ({"estimate_noise": True}, {"relearn": ["cameras.left"]}):
        with pytest.raises(handeye.UnusableInput, match=f"select_noise: .* {next(iter(other))}"):
            handeye.calibrate(motions, "ur5", select_noise=True, **other)


def test_the_report_is_one_page_about_this_calibration(learned, tmp_path):
    learned.report(tmp_path / "page.html", title="My <robot>")
    page = (tmp_path / "page.html").read_text()
    assert page.startswith("<!") and "My &lt;robot&gt;" in page and "http://" not in page.replace("http://www.w3.org", "")
    assert page == learned.html("My <robot>")
    text = str(learned)
    assert f"{learned.rms_px:.3f} px rms" in text and all(line in text for line in learned.gauge)
    for camera in learned.rig.camera_names:
        shift = np.linalg.norm(learned.deviations[f"cameras.{camera}.pose"][:3])
        length = f"{shift:.2e}".replace("e-0", "e-")
        assert f"camera `{camera}`: " in text and f"± {length}; turned by " in text


def test_an_evaluation_has_a_page_too(learned, fresh, tmp_path):
    judged = handeye.evaluate(learned.rig, fresh)
    judged.report(tmp_path / "page.html", title="Fresh <samples>")
    page = (tmp_path / "page.html").read_text()
    assert page == judged.html("Fresh <samples>") and "Fresh &lt;samples&gt;" in page
    # Nothing metric was known while it was learned.
    assert judged.in_space is None and not judged.learned_from_it


def test_an_evaluation_tells_lengths_and_whether_it_is_of_what_was_learned_from(ur5, motions, fresh):
    median, most = handeye.evaluate(ur5, fresh).in_space
    # 0.3 px of noise per axis through lenses of 600 px at about a metre.
    assert 0.2e-3 < median < 1e-3 and 1.5 < most / median < 3.0
    learned = handeye.calibrate(motions, ur5).rig
    judged = handeye.evaluate(learned, motions)
    assert any("learned from this recording" in step for step in judged.steps)
    assert all(words in str(judged) for words in [*judged.steps, *judged.findings, f"{1e3 * judged.in_space[0]:.3f} mm"])
    assert handeye.evaluate(learned, motions).learned_from_it and not handeye.evaluate(learned, fresh).learned_from_it


def test_what_is_told_shows_itself_in_words(motions):
    learned = handeye.calibrate(motions[:20], "ur5", influence=True)
    assert f"{1e3 * learned.tip.by_data:.3f} mm by the data alone" in repr(learned.tip)
    for one in (*learned.weak, *learned.influence, *learned.stages):
        assert " at 0x" not in repr(one) and len(repr(one)) > 30
