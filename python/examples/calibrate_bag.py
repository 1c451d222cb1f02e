"""A ROS 2 bag to a learned rig and a page to read, without an installation of ROS.

    pip install ./python mcap-ros2-support
    python python/examples/calibrate_bag.py [BAG [RIG]]

RIG is a rig file or the name of a shipped rig (ur5e, panda, ...), whose names tell which joints are the arm's, and in which order. Without a bag
of your own, one is written first: a simulated UR5 before two cameras, joint states, camera info and detections on the topics
that a driver and a tag detector would use. Cells (# %%) open as a notebook in VS Code and Jupytext.
"""

import sys
import tempfile
from pathlib import Path

import numpy as np

import handeye

# %% A bag as a driver and a detector would record it
LINE = "=" * 80 + "\n"
HEADER = "std_msgs/Header header\n"
STANDARD = (
    f"{LINE}MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    f"{LINE}MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
SCHEMAS = {
    "sensor_msgs/msg/JointState": f"{HEADER}string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n{STANDARD}",
    "sensor_msgs/msg/CameraInfo": (
        f"{HEADER}uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
        f"uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n{STANDARD}"
        f"{LINE}MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"
    ),
    "vision_msgs/msg/Detection2DArray": (
        f"{HEADER}vision_msgs/Detection2D[] detections\n{STANDARD}"
        f"{LINE}MSG: vision_msgs/Detection2D\nstring id\nvision_msgs/BoundingBox2D bbox\n"
        f"{LINE}MSG: vision_msgs/BoundingBox2D\nvision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n"
        f"{LINE}MSG: vision_msgs/Pose2D\nvision_msgs/Point2D position\nfloat64 theta\n"
        f"{LINE}MSG: vision_msgs/Point2D\nfloat64 x\nfloat64 y\n"
    ),
}


def write_bag(path, rig, recording):
    """A recording as the messages of a driver (100 Hz around each image) and of detectors."""
    from mcap_ros2.writer import Writer

    with open(path, "wb") as stream:
        writer = Writer(stream)
        schemas = {name: writer.register_msgdef(name, text) for name, text in SCHEMAS.items()}

        def write(time, topic, schema, frame, fields):
            stamp = {"sec": time // 10**9, "nanosec": time % 10**9}
            message = {"header": {"stamp": stamp, "frame_id": frame}, **fields}
            writer.write_message(topic, schemas[schema], message, log_time=time, publish_time=time)

        start = 1_700_000_000_000_000_000
        for camera, known in recording.cameras.items():
            k = rig.camera_matrix(camera).ravel().tolist()
            roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
            width, height = known["size"]
            fields = {"height": height, "width": width, "distortion_model": "plumb_bob", "d": [0.0] * 5, "k": k, "r": [0.0] * 9}
            fields |= {"p": [0.0] * 12, "binning_x": 0, "binning_y": 0, "roi": roi}
            write(start, f"/{camera}/camera_info", "sensor_msgs/msg/CameraInfo", camera, fields)
        for index, joints in enumerate(recording.joints):
            image = start + 1_000_000_000 * (index + 1)
            # The arm waits for the image; states come between images' stamps.
            for time in range(image - 25_000_000, image + 30_000_000, 10_000_000):
                state = {"name": recording.joint_names, "position": list(joints), "velocity": [], "effort": []}
                write(time, "/joint_states", "sensor_msgs/msg/JointState", "", state)
            for camera, pixels in recording.pixels.items():
                found = [
                    {"id": name, "bbox": {"center": {"position": {"x": u, "y": v}, "theta": 0.0}, "size_x": 8.0, "size_y": 8.0}}
                    for name, (u, v) in zip(recording.feature_names, pixels[index])
                    if not np.isnan(u)
                ]
                write(image, f"/{camera}/detections", "vision_msgs/msg/Detection2DArray", camera, {"detections": found})
        writer.finish()


# %% The bag
folder = Path(tempfile.mkdtemp(prefix="handeye-"))
known = sys.argv[2] if len(sys.argv) > 2 else None
if len(sys.argv) > 1:
    bag = Path(sys.argv[1])
else:
    bag, ur5 = folder / "motions.mcap", handeye.Rig.load("ur5")
    write_bag(bag, ur5, handeye.simulate(ur5, samples=60, seed=1, missed=0.1).recording)
    print(f"wrote {bag} ({bag.stat().st_size} bytes)")
motions = handeye.Recording.load(bag, rig=known)
print(f"read {motions}")

# %% Learning: every fifth sample is held out, to judge by
stages = []


def progress(now):
    if now.stage not in stages:
        stages.append(now.stage)
        print(f"  {now.stage}", file=sys.stderr)


held_out = list(range(0, len(motions), 5))
used = [i for i in range(len(motions)) if i not in held_out]
learned = handeye.calibrate(motions.select(used), known, progress=progress)
print(learned)

# %% How good it is
judged = handeye.evaluate(learned.rig, motions.select(held_out))
print(f"on samples held out: {judged.rms_px:.3f} px rms, median {judged.median_px:.3f} px")
learned.rig.save(folder / "learned.toml")
learned.report(folder / "report.html", title=bag.name)
print(f"wrote {folder}/learned.toml and {folder}/report.html")
