"""Corners of rendered tags and boards as handeye and as OpenCV find them: how many, and how far from where they are.

    pip install opencv-contrib-python-headless numpy
    python benches/detect.py [IMAGES]

640 x 480 images (f = 600 px) of prints of 30 cm at 0.45 to 1 m, tilted by up to 55 degrees, 16 samples a pixel, blur of 0.5, 0.8 and 1.2 px, noise of 1, 3 and 6 of
255, light that changes over the image. Tags and boards are OpenCV's. *wrong* are farther than 3 px from their place.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np

HANDEYE = os.environ.get("HANDEYE", "handeye")
WIDTH, HEIGHT, SAMPLES, FOCAL = 640, 480, 4, 600.0


def tags(family, cells, rng):
    """A print of four tags, and where their corners are: clockwise from the upper left one."""
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, family))
    ids = rng.choice(len(dictionary.bytesList), 4, replace=False)
    side, gap = 16 * cells, 48
    image, places = np.full((2 * side + 3 * gap,) * 2, 255, np.uint8), {}
    for index, tag in enumerate(ids):
        y, x = (gap + part * (side + gap) for part in divmod(index, 2))
        image[y : y + side, x : x + side] = cv2.aruco.generateImageMarker(dictionary, int(tag), side)
        for corner, (right, down) in enumerate([(0, 0), (side, 0), (side, side), (0, side)]):
            places[f"{tag}/{corner}"] = (x + right, y + down)
    return image, places


def checkerboard(_):
    side, rows, columns = 40, 6, 9
    image = np.full(((rows + 3) * side, (columns + 3) * side), 255, np.uint8)
    for row in range(rows + 1):
        for column in range(columns + 1):
            if (row + column) % 2 == 0:
                image[(row + 1) * side : (row + 2) * side, (column + 1) * side : (column + 2) * side] = 0
    return image, {f"{r}/{c}": ((c + 2) * side, (r + 2) * side) for r in range(rows) for c in range(columns)}


def charuco_board():
    return cv2.aruco.CharucoBoard((7, 5), 40, 30, cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_5X5_100))


def charuco(_):
    side = 56
    image = np.pad(charuco_board().generateImage((7 * side, 5 * side), marginSize=0), side, constant_values=255)
    return image, {f"{r}/{c}": ((c + 2) * side, (r + 2) * side) for r in range(4) for c in range(6)}


def render(make, index):
    rng = np.random.default_rng(1000 * index + 7)
    print_, places = make(rng)
    height, width = print_.shape
    camera = np.array([[FOCAL, 0, WIDTH / 2 - 0.5], [0, FOCAL, HEIGHT / 2 - 0.5], [0, 0, 1]])
    while True:
        tilt, axis, turn = rng.uniform(0, np.radians(55)), rng.uniform(0, 2 * np.pi), rng.uniform(-np.pi, np.pi)
        rotation = cv2.Rodrigues(np.array([np.cos(axis), np.sin(axis), 0]) * tilt)[0] @ cv2.Rodrigues(np.array([0, 0, turn]))[0]
        scale = 0.3 / max(height, width)
        middle = np.array([rng.uniform(-0.12, 0.12), rng.uniform(-0.1, 0.1), rng.uniform(0.45, 1.0)])
        right, down = rotation[:, 0] * scale, rotation[:, 1] * scale
        project = camera @ np.column_stack([right, down, middle - right * width / 2 - down * height / 2])

        def pixel(place):
            u, v, w = project @ np.array([*place, 1.0])
            return np.array([u / w, v / w])

        corners = np.array([pixel(place) for place in [(0, 0), (width, 0), (width, height), (0, height)]])
        if (corners > 2).all() and (corners[:, 0] < WIDTH - 3).all() and (corners[:, 1] < HEIGHT - 3).all():
            break
    v, u = ((np.mgrid[0 : HEIGHT * SAMPLES, 0 : WIDTH * SAMPLES]) + 0.5) / SAMPLES - 0.5
    x, y, w = np.einsum("ij,jkl->ikl", np.linalg.inv(project), np.stack([u, v, np.ones_like(u)]))
    column, row = np.floor(x / w).astype(int), np.floor(y / w).astype(int)
    inside = (column >= 0) & (column < width) & (row >= 0) & (row < height)
    bright = np.full(u.shape, 0.5)
    bright[inside] = print_[row[inside], column[inside]] / 255
    low, high = rng.uniform(20, 60), rng.uniform(150, 230)
    image = (low + (high - low) * bright).reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES).mean((1, 3))
    image *= 1 + rng.uniform(-0.15, 0.15) * (np.arange(WIDTH) / WIDTH - 0.5)
    image = cv2.GaussianBlur(image, (0, 0), [0.5, 0.8, 1.2][index % 3])
    image += rng.normal(0, [1, 3, 6][index // 3 % 3], image.shape)
    return np.clip(np.rint(image), 0, 255).astype(np.uint8), {name: pixel(place) for name, place in places.items()}


def report(name, truth, found):
    off, there, wrong = [], 0, 0
    for image, places in truth.items():
        there += len(places)
        for corner, pixel in found.get(image, {}).items():
            error = np.array(pixel) - places.get(corner, [np.inf] * 2)
            if np.hypot(*error) > 3:
                wrong += 1
            else:
                off.append(error)
    size = np.hypot(*np.array(off).T) if off else np.array([np.nan])
    bias = np.mean(off, axis=0) if off else [np.nan] * 2
    print(
        f"{name:42} {len(off):5} of {there:5}, wrong {wrong:3}; px: median {np.median(size):.3f}, 95 % {np.percentile(size, 95):.3f}, "
        f"bias {bias[0]:+.3f} {bias[1]:+.3f}"
    )


def handeye(folder, pattern, order=(0, 1, 2, 3)):
    output = folder / "out.jsonl"
    subprocess.run([HANDEYE, "detect", folder, "--pattern", pattern, "-o", output], check=True, stdout=subprocess.DEVNULL)
    # Samples have no names of images: images that show nothing are told by detecting one by one.
    found, lines = {}, [json.loads(line) for line in output.read_text().splitlines()[1:]]
    for line in lines:
        seen = next(iter(line["pixels"].values()))
        corners = {}
        for name, pixel in seen.items():
            corner = name.split(":")[1]
            if name.startswith("tag"):
                tag, k = corner.split("/")
                corner = f"{tag}/{order[int(k)]}"
            corners[corner] = pixel
        found[len(found)] = corners
    return found


def opencv_tags(image, family, refinement):
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = refinement
    detector = cv2.aruco.ArucoDetector(cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, family)), parameters)
    corners, ids, _ = detector.detectMarkers(image)
    if ids is None:
        return {}
    return {f"{tag}/{k}": quad.reshape(4, 2)[k] for quad, tag in zip(corners, ids.ravel()) for k in range(4)}


def opencv_checkerboard(image, truth):
    is_found, corners = cv2.findChessboardCorners(image, (9, 6))
    if not is_found:
        return {}
    corners = cv2.cornerSubPix(image, corners, (5, 5), (-1, -1), (3, 50, 1e-4)).reshape(6, 9, 2)
    # OpenCV leaves open at which end it begins.
    if np.hypot(*(corners[0, 0] - truth["0/0"])) > np.hypot(*(corners[5, 8] - truth["0/0"])):
        corners = corners[::-1, ::-1]
    return {f"{row}/{column}": corners[row, column] for row in range(6) for column in range(9)}


def opencv_charuco(image):
    corners, ids, _, _ = cv2.aruco.CharucoDetector(charuco_board()).detectBoard(image)
    if ids is None:
        return {}
    return {f"{k // 6}/{k % 6}": corner for corner, k in zip(corners.reshape(-1, 2), ids.ravel())}


def main():
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 36
    kinds = {
        "tag36h11": lambda rng: tags("DICT_APRILTAG_36h11", 8, rng),
        "DICT_4X4_50": lambda rng: tags("DICT_4X4_50", 6, rng),
        "checkerboard=9x6": checkerboard,
        "charuco=7x5:DICT_5X5_100:0.75": charuco,
    }
    for pattern, make in kinds.items():
        images, truth, found = {}, {}, {}
        for index in range(count):
            images[index], truth[index] = render(make, index)
        for index, image in images.items():
            with tempfile.TemporaryDirectory() as name:
                cv2.imwrite(f"{name}/0.png", image)
                try:
                    # OpenCV holds AprilTags upside down, which their own detector counts from the lower left against the clock.
                    found[index] = handeye(Path(name), pattern, (1, 0, 3, 2)).get(0, {})
                except subprocess.CalledProcessError:
                    found[index] = {}
        report(f"{pattern}: handeye", truth, found)
        if pattern.startswith("checkerboard"):
            report(f"{pattern}: OpenCV, cornerSubPix", truth, {k: opencv_checkerboard(image, truth[k]) for k, image in images.items()})
        elif pattern.startswith("charuco"):
            report(f"{pattern}: OpenCV", truth, {k: opencv_charuco(image) for k, image in images.items()})
        else:
            family = {"tag36h11": "DICT_APRILTAG_36h11"}.get(pattern, pattern)
            for name, refinement in [("cornerSubPix", 1), ("contour", 2)]:
                found = {k: opencv_tags(image, family, refinement) for k, image in images.items()}
                report(f"{pattern}: OpenCV, {name}", truth, found)


if __name__ == "__main__":
    main()
