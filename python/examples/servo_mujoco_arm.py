"""A UR-like arm in MuJoCo: wiggle, learn arm and cameras from nothing, then servo features to pixels.

    pip install ./python mujoco
    python python/examples/servo_mujoco_arm.py

The arm has position actuators with friction, so that it does not quite arrive where it is told to. Two cameras that nobody has measured
see the corners of a plate in its hand with 0.3 px of noise. Printed are the pixels that are left after every command. Cells (# %%)
open as a notebook in VS Code and Jupytext.
"""

import mujoco
import numpy as np

import handeye
from handeye import servo

# %% The arm
SIZE, NOISE = (640, 480), 0.3
MODEL = """
<mujoco model="six joints, three of them parallel">
  <compiler angle="radian" autolimits="true"/>
  <option timestep="0.002" integrator="implicitfast"/>
  <default>
    <joint damping="20" frictionloss="1" armature="0.1" range="-3.14 3.14"/>
    <position kp="2000" kv="200" ctrlrange="-3.14 3.14"/>
    <geom type="capsule" size="0.04" contype="0" conaffinity="0" density="500"/>
    <site size="0.005"/>
  </default>
  <worldbody>
    <camera name="left" pos="1.7 -0.9 1.0" xyaxes="0.5 0.866 0 -0.25 0.144 0.957" fovy="45"/>
    <camera name="right" pos="1.8 0.8 0.9" xyaxes="-0.42 0.907 0 -0.25 -0.116 0.961" fovy="50"/>
    <body name="shoulder" pos="0 0 0.163" gravcomp="1">
      <joint name="shoulder_pan" axis="0 0 1"/> <geom fromto="0 0 -0.1 0 0 0"/>
      <body name="upper_arm" pos="0 0.138 0" gravcomp="1">
        <joint name="shoulder_lift" axis="0 1 0"/> <geom fromto="0 0 0 0 0 0.425"/>
        <body name="forearm" pos="0 -0.131 0.425" gravcomp="1">
          <joint name="elbow" axis="0 1 0"/> <geom fromto="0 0 0 0 0 0.392"/>
          <body name="wrist_1_link" pos="0 0 0.392" gravcomp="1">
            <joint name="wrist_1" axis="0 1 0"/> <geom fromto="0 0 0 0 0.127 0"/>
            <body name="wrist_2_link" pos="0 0.127 0" gravcomp="1">
              <joint name="wrist_2" axis="0 0 1"/> <geom fromto="0 0 0 0 0 0.1"/>
              <body name="hand" pos="0 0 0.1" gravcomp="1">
                <joint name="wrist_3" axis="0 1 0"/> <geom type="box" size="0.06 0.005 0.06" pos="0 0.1 0"/>
                <site name="f0" pos="-0.06 0.105 -0.06"/> <site name="f1" pos="0.06 0.105 -0.06"/>
                <site name="f2" pos="-0.06 0.105 0.06"/> <site name="f3" pos="0.06 0.105 0.06"/>
                <site name="f4" pos="0 0.145 0"/> <site name="f5" pos="0.03 0.125 -0.03"/>
              </body>
            </body>
          </body>
        </body>
      </body>
    </body>
  </worldbody>
  <actuator>
    <position joint="shoulder_pan"/> <position joint="shoulder_lift"/> <position joint="elbow"/>
    <position joint="wrist_1"/> <position joint="wrist_2"/> <position joint="wrist_3"/>
  </actuator>
</mujoco>
"""


class Robot:
    """The simulated arm: joints in, readings and pixels out."""

    def __init__(self, seed):
        self.model = mujoco.MjModel.from_xml_string(MODEL)
        self.data = mujoco.MjData(self.model)
        self.random = np.random.default_rng(seed)
        self.names = [self.model.joint(i).name for i in range(self.model.njnt)]
        self.cameras = {self.model.camera(i).name: i for i in range(self.model.ncam)}
        self.features = [self.model.site(i).name for i in range(self.model.nsite)]

    def place(self, joints):
        """Puts the arm somewhere at once."""
        self.data.qpos[:], self.data.ctrl[:], self.data.qvel[:] = joints, joints, 0.0
        mujoco.mj_forward(self.model, self.data)

    def move(self, joints, seconds):
        """Goes there under its own dynamics."""
        self.data.ctrl[:] = joints
        mujoco.mj_step(self.model, self.data, round(seconds / self.model.opt.timestep))

    def look(self, noise=NOISE):
        """Pixels of every camera, NaN outside its image. MuJoCo's cameras look along -z, with y up."""
        seen = {}
        for name, i in self.cameras.items():
            axes, at = self.data.cam_xmat[i].reshape(3, 3), self.data.cam_xpos[i]
            x, y, z = ((self.data.site_xpos - at) @ axes).T
            focal = 0.5 * SIZE[1] / np.tan(0.5 * np.radians(self.model.cam_fovy[i]))
            pixels = np.c_[focal * x / -z, -focal * y / -z] + [(SIZE[0] - 1) / 2, (SIZE[1] - 1) / 2]
            pixels[(z >= 0) | (pixels < 0).any(axis=1) | (pixels > np.array(SIZE) - 1).any(axis=1)] = np.nan
            seen[name] = pixels + self.random.normal(0, noise, pixels.shape)
        return seen


# %% Wiggling
def wiggle(robot, n, seed):
    """A recording of random positions in which both cameras see the plate."""
    random, joints, pixels = np.random.default_rng(seed), [], {camera: [] for camera in robot.cameras}
    while len(joints) < n:
        # Over the table, in front of the cameras, turned all ways.
        robot.place([0.0, 0.5, 1.2, 0.0, 0.0, 0.0] + random.uniform(-1, 1, 6) * [0.8, 0.5, 0.6, 1.2, 1.4, 2.5])
        seen = robot.look()
        if all((~np.isnan(seen[camera]).any(axis=1)).sum() >= 4 for camera in seen):
            joints.append(robot.data.qpos.copy())
            [pixels[camera].append(seen[camera]) for camera in seen]
    cameras = {camera: {"size": SIZE} for camera in pixels}
    return handeye.Recording.from_arrays(
        joints, pixels, joint_names=robot.names, feature_names=robot.features, cameras=cameras
    )


# %% From nothing
robot = Robot(seed=1)
motions, fresh = wiggle(robot, 60, seed=1), wiggle(robot, 60, seed=2)
learned = handeye.calibrate(motions)
judged = handeye.evaluate(learned.rig, fresh)
print(f"learned from {len(motions)} positions, nothing known but the size of the images:")
print(f"  {judged.rms_px:.3f} px rms on {len(fresh)} others; the noise alone is {NOISE * 2**0.5:.3f} px rms")
for camera, i in robot.cameras.items():
    true = 0.5 * SIZE[1] / np.tan(0.5 * np.radians(robot.model.cam_fovy[i]))
    found, sd = learned.rig[f"cameras.{camera}.fx"], learned.deviations[f"cameras.{camera}.fx"][0]
    print(f"  fx of camera {camera}: {found:.1f} ± {sd:.1f} px (true: {true:.1f})")

# %% To three targets: pixels before every command
rig = learned.rig
rig.lower, rig.upper, rig.max_velocity = np.full(6, -3.1), np.full(6, 3.1), np.full(6, 1.0)
loop = servo.ServoLoop(servo.ModelBased(rig, takes="joints"), tolerance_px=0.7)
robot.place(fresh.joints[0])
now, dt = 0.0, 1.0
for number in (1, 2, 3):
    here = robot.data.qpos.copy()
    robot.place(fresh.joints[number])
    goal = robot.look(noise=0.0)
    robot.place(here)
    loop.aim(goal)
    errors = []
    while True:
        tick = loop.tick(now, robot.look(), robot.data.qpos, dt=dt)
        errors.append(tick.error_px)
        if tick.stop:
            break
        if tick.command.value is not None:
            robot.move(tick.command.value, dt)
        now += dt
    print(f"target {number}: {' '.join(f'{error:.2f}' for error in errors)} px: {tick.stop}")
