"""Hand-eye calibration beside OpenCV's: a camera on the hand sees a board from 15 poses.

    pip install ./python 'opencv-python-headless<5'
    python python/examples/compare_with_opencv.py [TRIALS]

A camera (640 x 480, f = 800 px) on the hand sees a board of 8 x 6 corners, 30 mm apart, with 0.3 px of noise; the robot's poses are noisy
too. Printed is the median error of the camera's pose on the hand, of OpenCV's closed forms and of handeye, from the same detections of the
board; handeye is told how noisy they are. Cells
(# %%) open as a notebook in VS Code and Jupytext.
"""

import sys

import cv2
import numpy as np

import handeye

# %% The scene
FOCAL, SIZE, CENTRE, NOISE = 800.0, (640, 480), (320.0, 240.0), 0.3
CORNERS = np.array([[0.03 * i - 0.105, 0.03 * j - 0.075, 0.0] for j in range(6) for i in range(8)])
INTRINSICS = np.array([[FOCAL, 0, CENTRE[0]], [0, FOCAL, CENTRE[1]], [0, 0, 1]])
LENS = {"camera": {"size": SIZE, "fx": FOCAL, "fy": FOCAL, "cx": CENTRE[0], "cy": CENTRE[1]}}
SETTINGS = [(0.0005, np.radians(0.03)), (0.002, np.radians(0.2))]
METHODS = {"Tsai": cv2.CALIB_HAND_EYE_TSAI, "Park": cv2.CALIB_HAND_EYE_PARK, "Daniilidis": cv2.CALIB_HAND_EYE_DANIILIDIS}


def pose(rotation_vector, translation):
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = cv2.Rodrigues(np.asarray(rotation_vector, float))[0], translation
    return matrix


def project(camera_from_board):
    points = CORNERS @ camera_from_board[:3, :3].T + camera_from_board[:3, 3]
    return FOCAL * points[:, :2] / points[:, 2:] + CENTRE, points[:, 2]


def looking_at(eye, point, roll):
    z = (point - eye) / np.linalg.norm(point - eye)
    x = np.cross([0, 1.0, 0] if abs(z[1]) < 0.9 else [1.0, 0, 0], z)
    x /= np.linalg.norm(x)
    matrix = np.eye(4)
    matrix[:3, :3], matrix[:3, 3] = np.c_[x, np.cross(z, x), z] @ pose([0, 0, roll], 0)[:3, :3], eye
    return matrix


def trial(random, count, sd_xyz, sd_rot):
    """tip_from_camera, and noisy base_from_tip (count, 4, 4) and pixels (count, 48, 2)."""
    tip_from_camera = pose(random.normal(0, 0.3, 3), random.uniform(-0.08, 0.08, 3))
    board = pose([np.pi, 0, 0.2], [0.5, 0.1, 0.0])
    tips, pixels = [], []
    while len(tips) < count:
        distance, polar, around = random.uniform(0.35, 0.6), random.uniform(0, 0.6), random.uniform(0, 2 * np.pi)
        towards = np.array([np.sin(polar) * np.cos(around), np.sin(polar) * np.sin(around), np.cos(polar)])
        eye = board[:3, 3] + distance * towards
        camera = looking_at(eye, board[:3, 3] + random.normal(0, 0.02, 3), random.uniform(-np.pi, np.pi))
        seen, depth = project(np.linalg.inv(camera) @ board)
        if (depth > 0.05).all() and (seen > 5).all() and (seen < np.array(SIZE) - 5).all():
            tips.append(camera @ np.linalg.inv(tip_from_camera) @ pose(random.normal(0, sd_rot, 3), random.normal(0, sd_xyz, 3)))
            pixels.append(seen + random.normal(0, NOISE, seen.shape))
    return tip_from_camera, np.array(tips), np.array(pixels)


# %% What a board detector reports
def detected(pixels):
    """camera_from_board, as a board detector reports it."""
    _, turn, shift = cv2.solvePnP(CORNERS, pixels, INTRINSICS, None, flags=cv2.SOLVEPNP_ITERATIVE)
    return pose(turn.ravel(), shift.ravel())


def covariance(seen):
    """Of translation, then rotation vector, along the camera's axes, from the pixels' noise to first order."""
    information = np.zeros((6, 6))
    turned = CORNERS @ seen[:3, :3].T
    for lever, (x, y, z) in zip(turned, turned + seen[:3, 3]):
        of_point = FOCAL / z * np.array([[1, 0, -x / z], [0, 1, -y / z]])
        skew = np.array([[0, -lever[2], lever[1]], [lever[2], 0, -lever[0]], [-lever[1], lever[0], 0]])
        jacobian = of_point @ np.c_[np.eye(3), -skew] / NOISE
        information += jacobian.T @ jacobian
    return np.linalg.inv(information)


# %% What is known beforehand
def rig(sd_xyz, sd_rot):
    """The lens, that the camera is on the hand, and the noise of the robot; not where on the hand."""
    return handeye.Rig.from_string(
        f'[[cameras]]\nname = "camera"\nparent = "tip"\nmodel = "pinhole"\nsize = {list(SIZE)}\nfx = {FOCAL}\nfy = {FOCAL}\n'
        f"cx = {CENTRE[0]}\ncy = {CENTRE[1]}\n[noise]\npose = {{ xyz = {sd_xyz}, rot = {sd_rot} }}\n"
        '[estimate]\nfixed = ["cameras.*.fx", "cameras.*.fy", "cameras.*.cx", "cameras.*.cy"]\n'
    )


def error(found, true):
    turn = np.linalg.norm(cv2.Rodrigues(true[:3, :3].T @ found[:3, :3])[0])
    return 1e3 * np.linalg.norm(found[:3, 3] - true[:3, 3]), np.degrees(turn)


# %% Trials
trials = int(sys.argv[1]) if len(sys.argv) == 2 else 100
print(f"median error of the camera's pose on the hand, {trials} trials of 15 poses")
for sd_xyz, sd_rot in SETTINGS:
    random = np.random.default_rng(7)
    known, errors = rig(sd_xyz, sd_rot), {}
    for _ in range(trials):
        true, tips, pixels = trial(random, 15, sd_xyz, sd_rot)
        boards = np.array([detected(one) for one in pixels])
        for name, method in METHODS.items():
            found = cv2.calibrateHandEye(tips[:, :3, :3], tips[:, :3, 3], boards[:, :3, :3], boards[:, :3, 3], method=method)
            errors.setdefault(f"OpenCV, {name}", []).append(error(np.r_[np.c_[found], [[0, 0, 0, 1]]], true))
        recording = handeye.Recording.from_arrays(
            poses=tips,
            targets={"camera": {"board": boards}},
            target_covariances={"camera": {"board": [covariance(board) for board in boards]}},
            cameras=LENS,
        )
        learned = handeye.calibrate(recording, known)
        errors.setdefault("handeye", []).append(error(learned.rig["cameras.camera.pose"], true))
    print(f"robot noise {1e3 * sd_xyz:.1f} mm and {np.degrees(sd_rot):.2f}°:")
    for name, all_of_it in errors.items():
        xyz, rot = np.median(all_of_it, axis=0)
        print(f"  {name:20} {xyz:7.3f} mm {rot:7.4f}°")
