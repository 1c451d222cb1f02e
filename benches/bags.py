"""The same recording as a bag of two independent writers and as JSON Lines: the rigs that are learned from each.

    pip install mcap-ros2-support rosbags numpy
    python benches/bags.py [RECORDING RIG]

Default is ur3e-checkerboard in HANDEYE_SHARED. Features are written as vision_msgs/Detection2DArray, joints as sensor_msgs/JointState,
intrinsics as sensor_msgs/CameraInfo. Printed is whether the learned values agree byte for byte.
"""

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import numpy as np
from mcap_ros2.writer import Writer as McapWriter
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

HANDEYE = os.environ.get("HANDEYE", "handeye")
HEADER = "std_msgs/Header header\n"
LINE = "=" * 80 + "\n"
STANDARD = (
    LINE + "MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n"
    + LINE + "MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n"
)
JOINTS = HEADER + "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n" + STANDARD
INFO = (
    HEADER + "uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n"
    "uint32 binning_x\nuint32 binning_y\nsensor_msgs/RegionOfInterest roi\n" + STANDARD
    + LINE + "MSG: sensor_msgs/RegionOfInterest\nuint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"
)
PARTS = {
    "vision_msgs/msg/Detection2D": "string id\nvision_msgs/BoundingBox2D bbox\n",
    "vision_msgs/msg/BoundingBox2D": "vision_msgs/Pose2D center\nfloat64 size_x\nfloat64 size_y\n",
    "vision_msgs/msg/Pose2D": "vision_msgs/Point2D position\nfloat64 theta\n",
    "vision_msgs/msg/Point2D": "float64 x\nfloat64 y\n",
}
ARRAY = HEADER + "vision_msgs/Detection2D[] detections\n"
DETECTIONS = ARRAY + STANDARD + "".join(
    LINE + f"MSG: {name.replace('/msg/', '/')}\n{text}" for name, text in PARTS.items()
)


def stamp(sample):
    return 1_700_000_000_000_000_000 + 100_000_000 * sample


def read(path):
    lines = [json.loads(line) for line in Path(path).read_text().splitlines() if line.strip()]
    return lines[0], lines[1:]


def with_mcap_ros2(header, samples, path):
    with open(path, "wb") as stream:
        writer = McapWriter(stream)
        joints = writer.register_msgdef("sensor_msgs/msg/JointState", JOINTS)
        info = writer.register_msgdef("sensor_msgs/msg/CameraInfo", INFO)
        array = writer.register_msgdef("vision_msgs/msg/Detection2DArray", DETECTIONS)

        def write(topic, schema, time, message):
            writer.write_message(topic=topic, schema=schema, message=message, log_time=time, publish_time=time)

        for message in messages(header, samples):
            kind, topic, time, content = message
            write(topic, {"joints": joints, "info": info, "array": array}[kind], time, content)
        writer.finish()


def messages(header, samples):
    """Every message as (kind, topic, time, fields)."""

    def head(time, frame=""):
        return {"stamp": {"sec": time // 10**9, "nanosec": time % 10**9}, "frame_id": frame}

    for name, camera in header["cameras"].items():
        k = [camera["fx"], 0.0, camera["cx"], 0.0, camera["fy"], camera["cy"], 0.0, 0.0, 1.0]
        roi = {"x_offset": 0, "y_offset": 0, "height": 0, "width": 0, "do_rectify": False}
        yield "info", f"/{name}/camera_info", stamp(0) - 1, {
            "header": head(stamp(0) - 1, name), "height": camera["size"][1], "width": camera["size"][0],
            "distortion_model": "plumb_bob", "d": list(camera["distortion"]), "k": k, "r": [0.0] * 9, "p": [0.0] * 12,
            "binning_x": 0, "binning_y": 0, "roi": roi,
        }
    for index, sample in enumerate(samples):
        time = stamp(index)
        yield "joints", "/joint_states", time, {
            "header": head(time), "name": header["joints"], "position": sample["joints"], "velocity": [], "effort": [],
        }
        for camera, seen in sample.get("pixels", {}).items():
            found = [
                {"id": name, "bbox": {"center": {"position": {"x": u, "y": v}, "theta": 0.0}, "size_x": 0.0, "size_y": 0.0}}
                for name, (u, v) in seen.items()
            ]
            yield "array", f"/{camera}/features", time, {"header": head(time, camera), "detections": found}


def with_rosbags(header, samples, path):
    store = get_typestore(Stores.ROS2_HUMBLE)
    types = {}
    for name, text in [*PARTS.items(), ("vision_msgs/msg/Detection2DArray", ARRAY)]:
        types.update(get_types_from_msg(text, name))
    store.register(types)
    names = {
        "joints": "sensor_msgs/msg/JointState", "info": "sensor_msgs/msg/CameraInfo",
        "array": "vision_msgs/msg/Detection2DArray",
    }

    def build(type_name, content):
        kind = store.types[type_name]
        fields = {}
        for field, (what, detail) in store.fielddefs[type_name][1]:
            value = content[field]
            if what.name == "NAME":
                fields[field] = build(detail, value)
            elif what.name in ("ARRAY", "SEQUENCE"):
                (inner, name), _ = detail
                if inner.name == "NAME":
                    fields[field] = [build(name, one) for one in value]
                else:
                    is_text = (name[0] if isinstance(name, tuple) else name) == "string"
                    fields[field] = list(value) if is_text else np.array(value, dtype=np.float64)
            else:
                fields[field] = value
        return kind(**fields)

    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        connections = {}
        for kind, topic, time, content in messages(header, samples):
            if topic not in connections:
                connections[topic] = writer.add_connection(topic, names[kind], typestore=store)
            message = build(names[kind], content)
            writer.write(connections[topic], time, store.serialize_cdr(message, names[kind]))
    return next(Path(path).glob("*.mcap"))


def learned(recording, rig, folder, name):
    output = folder / f"{name}.toml"
    subprocess.run([HANDEYE, "calibrate", recording, "--rig", rig, "-o", output], check=True, stdout=subprocess.DEVNULL)
    return output.read_bytes()


def main():
    shared = Path(os.environ.get("HANDEYE_SHARED", "../shared")) / "data/ur3e-checkerboard"
    recording, rig = sys.argv[1:3] if len(sys.argv) > 2 else (shared / "recording.jsonl", shared / "ur3e.toml")
    header, samples = read(recording)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        plain = learned(recording, rig, folder, "plain")
        with_mcap_ros2(header, samples, folder / "one.mcap")
        two = with_rosbags(header, samples, folder / "two")
        for writer, path in [("mcap-ros2-support", folder / "one.mcap"), ("rosbags", two)]:
            same = learned(path, rig, folder, writer) == plain
            print(f"{writer:20} {path.stat().st_size:9} bytes: the learned rig is {'the same, byte for byte' if same else 'ANOTHER'}")


if __name__ == "__main__":
    main()
