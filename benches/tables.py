"""One recording as CSV (csv of Python) and as LeRobot datasets (pyarrow), and as JSON Lines: the rigs that are learned from each.

    pip install pyarrow
    python benches/tables.py [RECORDING RIG]

Default is ur3e-checkerboard in HANDEYE_SHARED. Datasets are laid out as LeRobot's versions 2.1 and 3.0 are: joints in degrees in lists of 32-bit floats, so that
readings are off by up to 2e-6 rad; features are columns of their own.
"""

import csv
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path

import pyarrow as pa
import pyarrow.parquet as pq

HANDEYE = os.environ.get("HANDEYE", "handeye")


def pixels(header, samples):
    """Columns of all features, an empty list of none that was seen."""
    names = sorted({(camera, feature) for sample in samples for camera, seen in sample.get("pixels", {}).items() for feature in seen})
    columns = {}
    assert names, "the recording shows features"
    for camera, feature in names:
        for axis, letter in enumerate("uv"):
            seen = [sample.get("pixels", {}).get(camera, {}).get(feature) for sample in samples]
            columns[f"{camera}.{feature}.{letter}"] = [pixel[axis] if pixel else None for pixel in seen]
    return columns


def with_csv(header, samples, path):
    columns = {f"joints.{joint}": [sample["joints"][k] for sample in samples] for k, joint in enumerate(header["joints"])}
    columns |= pixels(header, samples)
    with open(path, "w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(columns)
        writer.writerows(zip(*columns.values(), strict=True))


def with_lerobot(header, samples, folder, version):
    (folder / "meta").mkdir(parents=True)
    data = folder / "data/chunk-000"
    data.mkdir(parents=True)
    names = [f"{joint}.pos" for joint in header["joints"]]
    state = {"dtype": "float32", "shape": [len(names)], "names": names if version == "v3.0" else {"motors": header["joints"]}}
    images = {
        f"observation.images.{name}": {"dtype": "video", "shape": [*camera["size"][::-1], 3], "names": ["height", "width", "channels"]}
        for name, camera in header["cameras"].items()
    }
    info = {"codebase_version": version, "fps": 10, "features": {"observation.state": state, "action": state, **images}}
    (folder / "meta/info.json").write_text(json.dumps(info))
    states = [[math.degrees(joint) for joint in sample["joints"]] for sample in samples]
    count = len(samples)
    table = pa.table(
        {
            "observation.state": pa.array(states, pa.list_(pa.float32(), len(names))),
            "action": pa.array(states, pa.list_(pa.float32(), len(names))),
            "timestamp": pa.array([k / 10 for k in range(count)], pa.float32()),
            "frame_index": pa.array(range(count), pa.int64()),
            "episode_index": pa.array([0] * count, pa.int64()),
            "index": pa.array(range(count), pa.int64()),
            "task_index": pa.array([0] * count, pa.int64()),
            **{name: pa.array(column, pa.float64()) for name, column in pixels(header, samples).items()},
        }
    )
    name = "file-000.parquet" if version == "v3.0" else "episode_000000.parquet"
    pq.write_table(table, data / name, compression="snappy" if version == "v3.0" else "zstd")


def learned(recording, rig, folder, name):
    output = folder / f"{name}.toml"
    subprocess.run([HANDEYE, "calibrate", recording, "--rig", rig, "-o", output], check=True, stdout=subprocess.DEVNULL)
    report = subprocess.run([HANDEYE, "--json", "evaluate", output, folder / "plain.jsonl"], check=True, capture_output=True)
    return output.read_bytes(), json.loads(report.stdout)["rms_px"]


def main():
    shared = Path(os.environ.get("HANDEYE_SHARED", "../shared")) / "data/ur3e-checkerboard"
    recording, rig = sys.argv[1:3] if len(sys.argv) > 2 else (shared / "recording.jsonl", shared / "ur3e.toml")
    lines = [json.loads(line) for line in Path(recording).read_text().splitlines() if line.strip()]
    header, samples = lines[0], lines[1:]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        (folder / "plain.jsonl").write_text(Path(recording).read_text())
        plain, rms = learned(folder / "plain.jsonl", rig, folder, "plain")
        print(f"JSON Lines: {rms:.6f} px rms")
        with_csv(header, samples, folder / "motions.csv")
        same, rms = learned(folder / "motions.csv", rig, folder, "csv")
        print(f"CSV: {rms:.6f} px rms, the learned rig is {'the same, byte for byte' if same == plain else 'ANOTHER'}")
        for version in ["v2.1", "v3.0"]:
            with_lerobot(header, samples, folder / version, version)
            converted = folder / f"{version}.jsonl"
            command = [HANDEYE, "convert", folder / version, "--degrees", "--joints", ",".join(header["joints"]), "-o", converted]
            subprocess.run(command, check=True, stdout=subprocess.DEVNULL)
            read = [json.loads(line) for line in converted.read_text().splitlines()][1:]
            pairs = list(zip(read, samples, strict=True))
            off = max(abs(a - b) for one, other in pairs for a, b in zip(one["joints"], other["joints"], strict=True))
            same = all(one.get("pixels") == other.get("pixels") for one, other in pairs)
            print(f"LeRobot {version}: joints off by {off:.1e} rad at most, pixels {'the same' if same else 'OTHERS'}")


if __name__ == "__main__":
    main()
