"""The pose of a camera from points beside OpenCV's SQPnP and EPnP on the same cases, in one run.

    pip install opencv-python-headless scipy
    python benches/perspective_n_point.py
"""

import json
import os
import subprocess
import tempfile
import time

import cv2
import numpy as np
from scipy.spatial.transform import Rotation

ROOT = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
CAMERA = np.diag([600.0, 600.0, 1.0])


def row(points, name, deg, mm, us):
    over = int((np.array(deg) > 5).sum())
    print(f"{points:12} {name:14} {np.median(deg):8.3f} {np.median(mm):10.2f} {over:8} {max(deg):9.2f} {np.median(us):10.1f}")


def main():
    cv2.setNumThreads(1)
    with tempfile.TemporaryDirectory() as folder:
        out = os.path.join(folder, "cases.json")
        command = ["cargo", "bench", "--quiet", "--bench", "perspective_n_point", "--", out]
        subprocess.run(command, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        with open(out) as file:
            cases = json.load(file)
    print("points       solver         median °  median mm  over 5°   worst °  median µs")
    for points in dict.fromkeys(case["set"] for case in cases):
        chosen = [case for case in cases if case["set"] == points]
        row(points, "handeye", [c["deg"] for c in chosen], [c["mm"] for c in chosen], [c["us"] for c in chosen])
        for name, method in (("OpenCV SQPnP", cv2.SOLVEPNP_SQPNP), ("OpenCV EPnP", cv2.SOLVEPNP_EPNP)):
            deg, mm, us = [], [], []
            for case in chosen:
                xyz, pixels = np.array(case["points"]), np.array(case["pixels"])
                start = time.thread_time_ns()
                found, turn, shift = cv2.solvePnP(xyz, pixels, CAMERA, None, flags=method)
                us.append((time.thread_time_ns() - start) / 1e3)
                truth = Rotation.from_matrix(np.array(case["rotation"]).reshape(3, 3))
                off = (truth.inv() * Rotation.from_rotvec(turn.ravel())).magnitude() if found else np.pi
                deg.append(np.degrees(off))
                mm.append(1e3 * np.linalg.norm(shift.ravel() - case["translation"]) if found else np.inf)
            row(points, name, deg, mm, us)


main()
