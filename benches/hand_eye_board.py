#!/usr/bin/env python3
"""Hand-eye calibration with a board on a table: median errors of `handeye calibrate` beside those of OpenCV on the same trials.

    pip install numpy scipy 'opencv-python-headless<5'
    python benches/hand_eye_board.py [--handeye target/release/handeye] [--trials 100] [--mode targets|pixels] [--plain]

A camera on the hand (640 x 480, f = 800) sees a board of 8 x 6 corners, 30 mm apart, from 15 poses, with 0.3 px of noise; the
robot's poses are noisy. The rig states the noise of the robot, and each detection of the board its covariance, unless --plain.
"""
import argparse, json, pathlib, subprocess, tempfile, tomllib
import cv2, numpy as np
from scipy.spatial.transform import Rotation

FOCAL, SIZE, CENTRE, NOISE = 800.0, (640, 480), (320.0, 240.0), 0.3
CORNERS = np.array([[0.03 * i - 0.105, 0.03 * j - 0.075, 0.0] for j in range(6) for i in range(8)])
INTRINSICS = np.array([[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1]])
SETTINGS = [(15, 0.0005, np.radians(0.03), 0.52), (15, 0.002, np.radians(0.2), 1.47)]


def pose(rotvec, xyz):
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = Rotation.from_rotvec(rotvec).as_matrix(), xyz
    return m


def written(m):
    return {"xyz": m[:3, 3].tolist(), "quat": Rotation.from_matrix(m[:3, :3]).as_quat().tolist()}


def read(p):
    return pose(Rotation.from_quat(p["quat"]).as_rotvec(), p["xyz"])


def project(camera_from_board):
    p = CORNERS @ camera_from_board[:3, :3].T + camera_from_board[:3, 3]
    return FOCAL * p[:, :2] / p[:, 2:] + CENTRE, p[:, 2]


def looking_at(eye, point, roll):
    z = (point - eye) / np.linalg.norm(point - eye)
    up = np.array([0, 1.0, 0]) if abs(z[1]) < 0.9 else np.array([1.0, 0, 0])
    x = np.cross(up, z) / np.linalg.norm(np.cross(up, z))
    m = np.eye(4)
    m[:3, :3], m[:3, 3] = np.c_[x, np.cross(z, x), z] @ Rotation.from_rotvec([0, 0, roll]).as_matrix(), eye
    return m


def trial(random, count, sd_xyz, sd_rot):
    """tip_from_camera, base_from_board, and noisy (base_from_tip, pixels) of every sample."""
    x = pose(random.normal(0, 0.3, 3), random.uniform(-0.08, 0.08, 3))
    board = pose([np.pi, 0, 0.2], [0.5, 0.1, 0.0])
    samples = []
    while len(samples) < count:
        distance, polar, around = random.uniform(0.35, 0.6), random.uniform(0, 0.6), random.uniform(0, 2 * np.pi)
        towards = np.array([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)])
        eye = board[:3, 3] + distance * towards
        camera = looking_at(eye, board[:3, 3] + random.normal(0, 0.02, 3), random.uniform(-np.pi, np.pi))
        pixels, depth = project(np.linalg.inv(camera) @ board)
        if (depth < 0.05).any() or (pixels < 5).any() or (pixels[:, 0] > 635).any() or (pixels[:, 1] > 475).any():
            continue
        tip = camera @ np.linalg.inv(x)
        samples.append((tip @ pose(random.normal(0, sd_rot, 3), random.normal(0, sd_xyz, 3)),
                        pixels + random.normal(0, NOISE, pixels.shape)))
    return x, board, samples


def detected(pixels):
    _, rotvec, xyz = cv2.solvePnP(CORNERS, pixels, INTRINSICS, None, flags=cv2.SOLVEPNP_ITERATIVE)
    return pose(rotvec.ravel(), xyz.ravel())


def covariance(seen):
    """Of translation and rotation vector along the camera's axes, from the pixels' noise to first order."""
    turned = CORNERS @ seen[:3, :3].T
    information = np.zeros((6, 6))
    for lever, (x, y, z) in zip(turned, turned + seen[:3, 3]):
        of_point = FOCAL / z * np.array([[1, 0, -x / z], [0, 1, -y / z]])
        skew = np.array([[0, -lever[2], lever[1]], [lever[2], 0, -lever[0]], [-lever[1], lever[0], 0]])
        jacobian = of_point @ np.c_[np.eye(3), -skew] / NOISE
        information += jacobian.T @ jacobian
    return np.linalg.inv(information)


def learn(program, samples, sd_xyz, sd_rot, mode, plain):
    """tip_from_camera."""
    camera = {"size": SIZE, "fx": FOCAL, "fy": FOCAL, "cx": CENTRE[0], "cy": CENTRE[1]}
    lines = [{"format": "handeye-recording", "version": 1, "joints": [], "cameras": {"camera": camera}}]
    for tip, pixels in samples:
        line = {"pose": written(tip)}
        if mode == "targets":
            seen = detected(pixels)
            board = written(seen)
            if not plain:
                board["covariance"] = covariance(seen).ravel().tolist()
            line["targets"] = {"camera": {"board": board}}
        else:
            line["pixels"] = {"camera": {f"c{i}": uv.tolist() for i, uv in enumerate(pixels)}}
        lines.append(line)
    rig = ["[[cameras]]", 'name = "camera"', 'parent = "tip"', "model = 'pinhole'", "size = [640, 480]",
           f"fx = {FOCAL}", f"fy = {FOCAL}", f"cx = {CENTRE[0]}", f"cy = {CENTRE[1]}"]
    if mode == "pixels":
        for i in range(len(CORNERS)):
            rig += ["[[features]]", f'name = "c{i}"', 'parent = "world"']
    rig += ["[noise]", f"pixels = {NOISE}", f"pose = {{ xyz = {sd_xyz}, rot = {sd_rot} }}",
            "[estimate]", 'fixed = ["cameras.*.fx", "cameras.*.fy", "cameras.*.cx", "cameras.*.cy"]']
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        (folder / "rec.jsonl").write_text("\n".join(map(json.dumps, lines)) + "\n")
        (folder / "rig.toml").write_text("\n".join(rig) + "\n")
        run = subprocess.run([program, "calibrate", folder / "rec.jsonl", "--rig", folder / "rig.toml", "-o", folder / "learned.toml",
                              "--threads", "1"], capture_output=True, text=True)
        if not (folder / "learned.toml").exists():
            raise SystemExit(run.stderr)
        return read(tomllib.loads((folder / "learned.toml").read_text())["cameras"][0]["pose"])


def park(samples):
    seen = [detected(pixels) for _, pixels in samples]
    r, t = cv2.calibrateHandEye([tip[:3, :3] for tip, _ in samples], [tip[:3, 3] for tip, _ in samples],
                                [s[:3, :3] for s in seen], [s[:3, 3] for s in seen], method=cv2.CALIB_HAND_EYE_PARK)
    return np.r_[np.c_[r, t], [[0, 0, 0, 1]]]


def error(found, true):
    turn = Rotation.from_matrix(true[:3, :3].T @ found[:3, :3]).magnitude()
    return 1e3 * np.linalg.norm(found[:3, 3] - true[:3, 3]), np.degrees(turn)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--handeye", default="target/release/handeye")
    parser.add_argument("--trials", type=int, default=100)
    parser.add_argument("--mode", choices=["targets", "pixels"], default="targets")
    parser.add_argument("--plain", action="store_true", help="detections without their covariance: it is estimated")
    args = parser.parse_args()
    print(f"median errors of the camera's pose on the tip, {args.trials} trials, {args.mode}")
    print(f"{'robot noise':>18}   {'handeye':>20}   {'OpenCV, Park':>20}   most that is accepted")
    for count, sd_xyz, sd_rot, bar in SETTINGS:
        random = np.random.default_rng(7)
        ours, peer = [], []
        for _ in range(args.trials):
            x, _, samples = trial(random, count, sd_xyz, sd_rot)
            ours.append(error(learn(args.handeye, samples, sd_xyz, sd_rot, args.mode, args.plain), x))
            peer.append(error(park(samples), x))
        cells = ["{:8.3f} mm {:6.3f}°".format(*np.median(rows, axis=0)) for rows in (ours, peer)]
        print(f"{1e3 * sd_xyz:5.1f} mm {np.degrees(sd_rot):7.2f}°   {cells[0]:>20}   {cells[1]:>20}   {bar:.2f} mm")


if __name__ == "__main__":
    main()
