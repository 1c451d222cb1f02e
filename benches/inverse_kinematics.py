"""Inverse kinematics beside optik and the Robotics Toolbox for Python on the same poses, in one run.

    pip install optik-py roboticstoolbox-python scipy
    python benches/inverse_kinematics.py [CASES]

CPU time of a call, of the whole process as optik works on a thread of its own; reached means within 1e-5 m and 1e-5 rad by the forward kinematics below, and inside the limits.
The peers' URDFs stand in peers/servo of the folder ../shared, or where HANDEYE_SHARED says.
"""

import json
import os
import subprocess
import sys
import tempfile
import time

import numpy as np
import optik
from roboticstoolbox import ET, ETS
from scipy.spatial.transform import Rotation

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
SHARED = os.environ.get("HANDEYE_SHARED", os.path.join(ROOT, "..", "shared"))
COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 2000


def tips(case, q):
    """Poses of the tip for rows of joints."""
    m = np.tile(np.eye(4), (len(q), 1, 1))
    for i, (offset, d, a, alpha) in enumerate(case["dh"]):
        c, s, ca, sa = np.cos(q[:, i] + offset), np.sin(q[:, i] + offset), np.cos(alpha), np.sin(alpha)
        o, e = np.zeros_like(c), np.ones_like(c)
        if case["dh_convention"] == "standard":
            rows = [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [o, sa * e, ca * e, d * e], [o, o, o, e]]
        else:
            rows = [[c, -s, o, a * e], [s * ca, c * ca, -sa * e, -sa * d * e], [s * sa, c * sa, ca * e, ca * d * e], [o, o, o, e]]
        m = m @ np.moveaxis(np.array(rows), 2, 0)
    return m


def report(name, case, q, us, ours=None):
    found = ~np.isnan(q).any(axis=1)
    m = tips(case, np.nan_to_num(q))
    xyz = np.linalg.norm(m[:, :3, 3] - case["targets"][:, :3, 3], axis=1)
    rot = Rotation.from_matrix(np.swapaxes(m[:, :3, :3], 1, 2) @ case["targets"][:, :3, :3]).magnitude()
    lower, upper = np.array(case["limits"]).T
    inside = ((q >= lower - 1e-6) & (q <= upper + 1e-6)).all(axis=1)
    good = found & inside & (xyz < 1e-5) & (rot < 1e-5)
    median, last = np.median(us), np.percentile(us, 99)
    ratio = f"{median / ours:10.1f}" if ours else ""
    print(f"  {name:44} {100 * good.mean():7.2f} {median:10.1f} {last:9.1f} {ratio}", flush=True)
    return median


def timed(call, n, joints):
    q, us = np.full((n, joints), np.nan), []
    for i in range(n):
        start = time.process_time_ns()
        found = call(i)
        us.append((time.process_time_ns() - start) / 1e3)
        if found is not None:
            q[i] = found
    return q, np.array(us)


def main():
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "ours.json")
        command = ["cargo", "bench", "--quiet", "--bench", "inverse_kinematics", "--", out]
        subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL, env={**os.environ, "HANDEYE_SHARED": SHARED})
        with open(out) as file:
            ours = json.load(file)
    for name in ("ur5", "panda"):
        with open(os.path.join(SHARED, "cases", f"ik_{name}.json")) as file:
            case = json.load(file)
        poses, seeds = np.array(case["pose"])[:COUNT], np.array(case["q_seed"])[:COUNT]
        case["targets"] = np.tile(np.eye(4), (len(poses), 1, 1))
        case["targets"][:, :3, 3], case["targets"][:, :3, :3] = poses[:, :3], Rotation.from_quat(poses[:, 3:]).as_matrix()
        lower, upper = np.array(case["limits"]).T
        n, joints = len(poses), len(lower)
        print(f"{name}, {n} poses {'':33} reached % median µs   99 % µs   over ours")
        us = report("handeye", case, np.array(ours[name]["joints"])[:n], np.array(ours[name]["us"])[:n])

        robot = optik.Robot.from_urdf_file(os.path.join(SHARED, "peers", "servo", f"{name}.urdf"), "base", "tip")
        robot.set_parallelism(1)
        config = optik.SolverConfig(solution_mode="speed", max_time=0.1, max_restarts=0, tol_f=1e-12)
        start = np.clip(seeds, lower, upper)
        solve = lambda i: (lambda found: None if found is None else found[0])(robot.ik(config, case["targets"][i], start[i]))
        report("optik, one thread", case, *timed(solve, n, joints), us)

        links = []
        for (_, d, a, alpha), bounds in zip(case["dh"], case["limits"]):
            turn, fixed = [ET.Rz(qlim=bounds), ET.tz(d)], [ET.tx(a), ET.Rx(alpha)]
            links += turn + fixed if case["dh_convention"] == "standard" else fixed[::-1] + turn
        chain = ETS(links)
        settings = {"ilimit": 30, "slimit": 100, "tol": 1e-11, "joint_limits": True, "method": "chan", "k": 1.0}
        solve = lambda i: (lambda found: found.q if found.success else None)(chain.ik_LM(case["targets"][i], q0=seeds[i], **settings))
        report("Robotics Toolbox, C++ ik_LM, 100 restarts", case, *timed(solve, n, joints), us)


main()
