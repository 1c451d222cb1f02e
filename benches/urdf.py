"""Arms of URDFs as handeye reads and writes them, beside Pinocchio, in one run.

    pip install example-robot-data pin
    python benches/urdf.py [POSITIONS]

For each arm, at random joint positions: the largest distance [m] and entry of a rotation matrix by which handeye's links and tip miss
Pinocchio's; the same after a way through a rig file with rows; the same for the URDF that was written with all rows disturbed by up
to 0.02 m and rad, as Pinocchio reads it, against the rig; and whether the undisturbed URDF comes out with the same bytes.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
import pinocchio as pin

ROOT = Path(__file__).resolve().parent.parent
POSITIONS = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
ROBOTS = Path(pin.__file__).resolve().parents[4] / "share" / "example-robot-data" / "robots"

# File, base, tip.
ARMS = {
    "UR5": ("ur_description/urdf/ur5_robot.urdf", "base_link", "tool0"),
    "Panda": ("panda_description/urdf/panda.urdf", "panda_link0", "panda_hand"),
    "Kinova Jaco2": ("kinova_description/robots/kinova.urdf", "base", "j2s6s200_end_effector"),
    "xArm7": ("xarm_description/urdf/xarm7.urdf", "link_base", "link7"),
    "Baxter, left": ("baxter_description/urdf/baxter.urdf", "torso", "left_gripper"),
    "Baxter, right, from the head's base": ("baxter_description/urdf/baxter.urdf", "base", "right_gripper"),
    "Tiago, torso and arm": ("tiago_description/robots/tiago.urdf", "base_link", "arm_tool_link"),
    "Talos, left arm": ("talos_data/robots/talos_reduced.urdf", "base_link", "gripper_left_base_link"),
    "Z1": ("z1_description/urdf/z1.urdf", "world", "gripperStator"),
    "PR2, right arm": ("pr2_description/urdf/pr2.urdf", "base_footprint", "r_gripper_tool_frame"),
}


def pinocchio_links(path, base, tip, names, joints):
    """Poses in the base of the joints' links and, last, the tip."""
    model = pin.buildModelFromUrdf(str(path))
    data, base, tip = model.createData(), model.getFrameId(base, pin.FrameType.BODY), model.getFrameId(tip, pin.FrameType.BODY)
    ids = [model.getJointId(name) for name in names]
    out = np.empty((len(joints), len(names), 12))
    for i, row in enumerate(joints):
        q = pin.neutral(model)
        for id, value in zip(ids, row):
            joint = model.joints[id]
            # A continuous joint is a point of the unit circle.
            q[joint.idx_q : joint.idx_q + joint.nq] = [value] if joint.nq == 1 else [np.cos(value), np.sin(value)]
        pin.framesForwardKinematics(model, data, q)
        from_world = data.oMf[base].inverse()
        poses = [from_world * data.oMi[id] for id in ids[:-1]] + [from_world * data.oMf[tip]]
        out[i] = [np.concatenate([pose.rotation.ravel(), pose.translation]) for pose in poses]
    return out


def miss(ours, theirs):
    difference = np.abs(np.array(ours) - theirs)
    return max(np.linalg.norm(difference[..., 9:], axis=-1).max(), difference[..., :9].max())


def main():
    random = np.random.default_rng(1)
    arms = {name: arm for name, arm in ARMS.items() if (ROBOTS / arm[0]).exists()}
    for name in ARMS.keys() - arms.keys():
        print(f"{name}: {ROBOTS / ARMS[name][0]} is not there")
    with tempfile.TemporaryDirectory() as folder:
        tasks = []
        for index, (file, base, tip) in enumerate(arms.values()):
            chain = joints_between(ROBOTS / file, base, tip)
            joints = random.uniform(-np.pi, np.pi, (POSITIONS, chain)).tolist()
            out = os.path.join(folder, f"{index}.urdf")
            tasks.append({"urdf": str(ROBOTS / file), "base": base, "tip": tip, "out": out, "joints": joints})
        command = ["cargo", "bench", "--quiet", "--bench", "urdf"]
        answers = json.loads(subprocess.run(command, cwd=ROOT, check=True, input=json.dumps(tasks), text=True, stdout=subprocess.PIPE).stdout)
        print(f"{POSITIONS} positions {'':20} joints  parallel     read     rows  written  same bytes")
        for name, task, answer in zip(arms, tasks, answers):
            if "error" in answer:
                print(f"{name}: {answer['error']}")
                continue
            names = answer["names"]
            theirs = pinocchio_links(task["urdf"], task["base"], task["tip"], names, task["joints"])
            written = pinocchio_links(task["out"], task["base"], task["tip"], names, task["joints"])
            figures = [miss(answer["links"], theirs), miss(answer["rows"], theirs), miss(answer["disturbed"], written)]
            same = "yes" if answer["same_bytes"] else "NO"
            print(f"{name:36} {len(names):3} {answer['betas']:9}" + "".join(f"  {figure:.1e}" for figure in figures) + f"  {same}")


def joints_between(path, base, tip):
    """How many joints move between two links."""
    model = pin.buildModelFromUrdf(str(path))
    support = lambda link: set(model.supports[model.frames[model.getFrameId(link, pin.FrameType.BODY)].parentJoint])
    return len(support(tip) - support(base))


main()
