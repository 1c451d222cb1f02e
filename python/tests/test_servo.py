"""Steps, limits, controllers and loops, carried out by a robot that is the rig itself, or another one."""

import gc
import weakref

import numpy as np
import pytest

import handeye
from handeye import servo


@pytest.fixture(scope="module")
def places(ur5):
    return handeye.simulate(ur5, samples=40, seed=4).truth.joints


def test_a_step_is_the_damped_gauss_newton_step_where_nothing_holds_it_back(places):
    rig = handeye.Rig.load("ur5")
    rig.lower, rig.upper = np.full(6, -50.0), np.full(6, 50.0)
    rig.max_velocity = rig.max_acceleration = np.full(6, np.inf)
    stepper = servo.Stepper(rig, damping=0.0)
    for joints in places[:10]:
        target = rig.predict(joints + 0.01)
        step = stepper.step(joints, [servo.ImagePoints(rig, target)], dt=1.0)
        change, slopes = [], []
        for camera, seen in rig.predict(joints).items():
            ok = ~np.isnan(seen).any(axis=1) & ~np.isnan(target[camera]).any(axis=1)
            change.append((target[camera] - seen)[ok].ravel())
            moved = [rig.predict(joints + sign * 1e-6 * np.eye(6))[camera] for sign in (1, -1)]
            slopes.append(((moved[0] - moved[1]) / 2e-6)[:, ok].reshape(6, -1).T)
        expected = np.linalg.lstsq(np.concatenate(slopes), np.concatenate(change), rcond=None)[0]
        np.testing.assert_allclose(step.motion, expected, atol=1e-5)
        assert not step.failed and step.active == []


def test_a_loop_of_steps_arrives_and_keeps_its_limits(ur5, places):
    start, goal = places[0], places[1]
    task = servo.ImagePoints(ur5, ur5.predict(goal))
    stepper, joints, dt = servo.Stepper(ur5), start.copy(), 0.02
    velocity = np.zeros(6)
    limits = [servo.TipSpeed(0.4), servo.InImage(ur5, "left")]
    named = set()
    for _ in range(1500):
        step = stepper.step(joints, [servo.Goal(task, share=0.1)], dt=dt, limits=limits, velocity=velocity)
        after = joints + step.motion
        assert (after >= ur5.lower - 1e-12).all() and (after <= ur5.upper + 1e-12).all()
        assert (np.abs(step.motion) <= ur5.max_velocity * dt + 1e-12).all()
        way = np.linalg.norm((ur5.forward(after) - ur5.forward(joints))[:3, 3])
        assert way <= 1.05 * 0.4 * dt, "a tangent leaves out curvature"
        named |= {active.limit for active in step.active}
        joints, velocity = after, step.motion / dt
    assert 0 in named, "the tip's speed was what held it back"
    error = np.concatenate([(ur5.predict(joints)[c] - ur5.predict(goal)[c]).ravel() for c in ur5.camera_names])
    assert np.nanmax(np.abs(error)) < 0.01


def test_priorities_are_strict(ur5, places):
    pose, posture = servo.TipPose(ur5.forward(places[1])), servo.JointTarget(places[2])
    joints, stepper = places[0], servo.Stepper(ur5)
    for _ in range(800):
        step = stepper.step(joints, [servo.Goal(pose), servo.Goal(posture, priority=1)], dt=0.05)
        joints = joints + step.motion
    np.testing.assert_allclose(ur5.forward(joints), ur5.forward(places[1]), atol=1e-6)


def test_a_task_of_ones_own_does_what_the_built_in_one_does(ur5, places):
    own = servo.FunctionTask(lambda joints: (places[1] - joints, np.eye(6)), sd=0.01)
    built_in = servo.JointTarget(places[1], sd=0.01)
    motions = [servo.Stepper(ur5).step(places[0], [task], dt=0.1).motion for task in (own, built_in)]
    np.testing.assert_array_equal(*motions)

    def fail(joints):
        raise LookupError("no such place")

    with pytest.raises(LookupError, match="no such place"):
        servo.Stepper(ur5).step(places[0], [servo.FunctionTask(fail)], dt=0.1)
    with pytest.raises(handeye.UnusableInput, match=r"joint target: shape \[7\], and \(6,\) would do"):
        servo.Stepper(ur5).step(places[0], [servo.JointTarget(np.zeros(7))], dt=0.1)
    with pytest.raises(handeye.UnusableInput, match=r"slopes: shape \[6, 5\], and \(6, 6\) would do"):
        servo.Stepper(ur5).step(places[0], [servo.FunctionTask(lambda joints: (joints, np.ones((6, 5))))], dt=0.1)


def controllers(rig):
    return {
        "model": servo.ModelBased(rig),
        "image": servo.ImageBased(rig, gain=0.8),
        "image, adaptive": servo.ImageBased(rig, gain=(1.0, 0.3, 0.05), matrix="current"),
        "pose": servo.PoseBased(rig),
        "hybrid": servo.UncalibratedJoints.with_rig(rig),
    }


@pytest.mark.parametrize("name", controllers(handeye.Rig.load("ur5")))
@pytest.mark.parametrize("seed", range(3))
def test_every_controller_arrives_with_a_learned_rig(learned, ur5, places, name, seed):
    """The robot and its cameras are the true rig, the controller has the one that was learned; a pixel of noise each."""
    random = np.random.default_rng(seed)
    start, goal = places[2 * seed], places[2 * seed + 1]
    order = [ur5.feature_names.index(feature) for feature in learned.rig.feature_names]

    def look(joints):
        seen = ur5.predict(joints, in_image=True)
        return {camera: pixels[order] + random.normal(0, 0.3, (len(order), 2)) for camera, pixels in seen.items()}

    loop = servo.ServoLoop(controllers(learned.rig)[name], tolerance_px=1.0, window=40, timeout=500.0)
    loop.aim({camera: pixels[order] for camera, pixels in ur5.predict(goal, in_image=True).items()})
    now, joints, dt = 0.0, start.copy(), 1.0
    while True:
        tick = loop.tick(now, look(joints), joints, dt=dt)
        if tick.stop:
            break
        if tick.command.kind == "joint-deltas":
            joints = joints + tick.command.value
        now += dt
    assert tick.stop.is_success and str(tick.stop) == tick.stop.words, tick
    assert tick.error_px < 1.0


def test_without_a_rig_it_explores_and_arrives(ur5, places):
    random = np.random.default_rng(5)
    near = places[0] + random.uniform(-0.15, 0.15, 6)
    controller = servo.UncalibratedJoints(
        ur5.lower, ur5.upper, cameras=ur5.camera_names, n_features=len(ur5.feature_names), sd_px=0.3
    )
    loop = servo.ServoLoop(controller, tolerance_px=1.0, window=40, timeout=1000.0)
    loop.aim(ur5.predict(near))
    now, joints, began = 0.0, places[0].copy(), None
    while True:
        seen = {camera: pixels + random.normal(0, 0.3, pixels.shape) for camera, pixels in ur5.predict(joints).items()}
        tick = loop.tick(now, seen, joints, dt=1.0)
        began = tick.error_px if began is None else began
        if tick.stop:
            break
        joints = joints if tick.command.value is None else joints + tick.command.value
        now += 1.0
    assert tick.stop.name == "converged" and began > 10.0, (tick, began)


def test_the_loop_holds_still_on_what_is_old_or_missing(ur5, places):
    loop = servo.ServoLoop(servo.ModelBased(ur5), patience=3.0)
    loop.aim(ur5.predict(places[1]))
    old = loop.tick(10.0, ur5.predict(places[0]), dt=0.5, time=9.0)
    assert old.command.kind == "hold" and old.command.value is None and "1.000 s old" in old.waits
    blind = {camera: np.full_like(pixels, np.nan) for camera, pixels in ur5.predict(places[0]).items()}
    lost = loop.tick(14.0, blind, dt=0.5)
    assert lost.stop.name == "lost" and not lost.stop.is_success and lost.error_px is None


def test_commands_come_as_what_the_robot_takes(ur5, places):
    seen, goal = ur5.predict(places[0]), ur5.predict(places[1])
    values = {}
    for takes in ("joints", "joint-deltas", "joint-velocities", "pose-deltas", "pose-velocities"):
        controller = servo.ModelBased(ur5, takes=takes)
        controller.aim(goal)
        command = controller.decide(seen, places[0], dt=0.1).command
        assert command.kind == takes
        values[takes] = command.value
    np.testing.assert_allclose(values["joints"], places[0] + values["joint-deltas"], atol=1e-3)
    np.testing.assert_allclose(values["joint-velocities"], values["joint-deltas"] / 0.1, rtol=1e-12)
    before, after = ur5.forward([places[0], values["joints"]])
    np.testing.assert_allclose(values["pose-deltas"] @ before, after, atol=2e-3)
    np.testing.assert_allclose(values["pose-velocities"][3:] * 0.1, (after - before)[:3, 3], atol=2e-3)
    with pytest.raises(handeye.UnusableInput, match=r"takes: unknown `torques` \(known: joints, joint-deltas"):
        servo.ModelBased(ur5, takes="torques")


def test_limits_refuse_what_makes_no_sense(ur5):
    for wrong, message in [
        (lambda: servo.HalfSpace([0, 0, 0], 1.0), "normal: of length 0"),
        (lambda: servo.TipBox([0, 0, 1], [1, 1, 0]), "the box is empty"),
        (lambda: servo.TipSpeed(-1.0), "speed: -1, and it has to be above 0"),
        (lambda: servo.InImage(ur5, "top"), "camera `top` is not known"),
        (lambda: servo.PixelSpeed(ur5, "left", 100.0, features=["f99"]), "no feature `f99`"),
        (lambda: servo.VirtualFixture([0, 0, 0]), "one of the two is needed"),
        (lambda: servo.Goal(servo.JointTarget(np.zeros(6)), share=0.0), "share: in"),
    ]:
        with pytest.raises(handeye.UnusableInput, match=message):
            wrong()


def test_limits_and_tasks_of_another_rig_are_refused(ur5, places):
    pixels = ur5.predict(places[0])
    other = handeye.random_rig(6, cameras=3, features=12, seed=1)
    far = servo.InImage(other, list(other.predict(np.zeros(6)))[2])
    controller = servo.ImageBased(ur5)
    controller.aim(ur5.predict(places[1]))
    loop = servo.ServoLoop(controller)
    stepper = servo.Stepper(ur5)
    target = servo.JointTarget(places[1])
    for limit, message in [
        (far, r"camera 2 \(from 0\) of its rig, and this one has 2"),
        (servo.LinkDistance([0, 9], [[0, 0, 0], [0, 0, 0]], 0.1), r"link 9 \(from 0\) of its rig, and this one has 7"),
    ]:
        for use in [
            lambda: controller.decide(pixels, places[0], dt=0.1, limits=[limit]),
            lambda: loop.tick(0.0, pixels, places[0], dt=0.1, limits=[limit]),
            lambda: stepper.step(places[0], [target], dt=0.1, limits=[limit]),
        ]:
            with pytest.raises(ValueError, match=message):
                use()
    points = servo.ImagePoints(other, other.predict(np.zeros(6)))
    with pytest.raises(ValueError, match=r"camera 2 \(from 0\) of its rig, and this one has 2"):
        stepper.step(places[0], [points], dt=0.1)


class Holder:
    """Holds what calls it: a cycle that only the collector sees."""

    def change(self, joints):
        return np.zeros(1), np.zeros((1, len(joints)))


def test_a_task_that_calls_its_owner_is_collected():
    owner = Holder()
    owner.goal = servo.Goal(servo.FunctionTask(owner.change))
    is_there = weakref.ref(owner)
    del owner
    gc.collect()
    assert is_there() is None


def test_bounds_of_a_learned_rig_hold_what_it_is_off_by(learned, ur5, places):
    bounds = servo.PredictionBounds(learned.rig)
    order = [ur5.feature_names.index(name) for name in learned.rig.feature_names]
    off = [ur5.predict(joints)["left"][order] - learned.rig.predict(joints)["left"] for joints in places]
    sd = [bounds.pixels(joints, "left") for joints in places]
    assert (np.abs(off).max(axis=2) < 4 * np.array(sd)).mean() > 0.99
    assert bounds.tip(places[0]) > 0.0
