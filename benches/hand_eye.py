#!/usr/bin/env python3
"""Hand-eye calibration on KinHEC's sequences: medians of `handeye calibrate` beside those of its reference solvers.

    pip install kinhec
    kinhec generate --tier smoke --out DATA
    kinhec benchmark DATA
    python benches/hand_eye.py DATA [--handeye target/release/handeye] [--tracks ...] [--stated]

Each sequence becomes a recording of targets and a rig that says only where the camera is mounted (and, for `robot_error`, the
nominal chain). Neither true values nor noise levels are passed on; `--stated` passes the noise of robot and camera on.
"""
import argparse, collections, json, math, pathlib, subprocess, tempfile, tomllib
from concurrent.futures import ThreadPoolExecutor
import numpy as np, pandas as pd
from kinhec import io, robots


def pose(m):
    w, x, y, z = np.roll(quaternion(m[:3, :3]), 1)
    return {"xyz": [float(v) for v in m[:3, 3]], "quat": [float(x), float(y), float(z), float(w)]}


def quaternion(r):
    """x, y, z, w of a rotation matrix, by its largest component."""
    k = np.array([[r[0, 0] - r[1, 1] - r[2, 2], 0, 0, 0], [r[1, 0] + r[0, 1], r[1, 1] - r[0, 0] - r[2, 2], 0, 0],
                  [r[2, 0] + r[0, 2], r[2, 1] + r[1, 2], r[2, 2] - r[0, 0] - r[1, 1], 0],
                  [r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1], r[0, 0] + r[1, 1] + r[2, 2]]])
    values, vectors = np.linalg.eigh(k, UPLO="L")
    return vectors[:, np.argmax(values)]


def matrix(p):
    x, y, z, w = p["quat"]
    m = np.eye(4)
    m[:3, :3] = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                 [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                 [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    m[:3, 3] = p["xyz"]
    return m


def write(seq, folder, stated):
    """A sequence as a recording and a rig."""
    m, with_joints = seq.manifest, seq.manifest["track"] == "robot_error"
    q = seq.robot.q_meas if with_joints else None
    samples = []
    for i, t in enumerate(seq.robot.t):
        sample = {"time": float(t)}
        if with_joints:
            sample["joints"] = [float(v) for v in q[i]]
        else:
            sample["pose"] = pose(seq.robot.T_base_ee_meas[i])
        samples.append(sample)
    valid = seq.camera.has_measurement
    for i, t in enumerate(seq.camera.t):
        if not valid[i]:
            continue
        targets = {"camera": {"target": pose(seq.camera.T_cam_target_meas[i])}}
        if seq.synchronous:
            samples[i]["targets"] = targets
        else:
            samples.append({"time": float(t), "targets": targets})
    samples.sort(key=lambda s: s["time"])
    joints = [f"j{k}" for k in range(len(q[0]))] if with_joints else []
    header = {"format": "handeye-recording", "version": 1, "joints": joints, "cameras": {"camera": {}}}
    recording = folder / "rec.jsonl"
    recording.write_text("\n".join(json.dumps(line) for line in [header] + samples) + "\n")
    lines = []
    if with_joints:
        robot = robots.get_robot(m["robot"])
        lines += ["[robot]", f'convention = "{"modified-dh" if robot.convention == "modified" else "dh"}"']
        for k, name in enumerate(joints):
            row = [float(v[k]) for v in (robot.theta_offset, robot.d, robot.a, robot.alpha)]
            lines += ["[[robot.joints]]", f'name = "{name}"', *(f"{key} = {v!r}" for key, v in zip(("offset", "d", "a", "alpha"), row))]
            if robot.q_sign and robot.q_sign[k] < 0:
                lines.append("reversed = true")
    lines += ["[[cameras]]", 'name = "camera"', f'parent = "{"tip" if seq.eye_in_hand else "world"}"']
    noise = []
    if stated:
        if m["robot_trans_std_m"] > 0:
            noise.append(f'pose = {{ xyz = {m["robot_trans_std_m"]!r}, rot = {m["robot_rot_std_rad"]!r} }}')
    if noise:
        lines += ["[noise]", *noise]
    rig = folder / "rig.toml"
    rig.write_text("\n".join(lines) + "\n")
    return recording, rig


def errors(found, true):
    r = found[:3, :3].T @ true[:3, :3]
    angle = math.degrees(2 * math.atan2(np.linalg.norm(r - np.eye(3)) / (2 * math.sqrt(2)), math.sqrt(max(0, (np.trace(r) + 1) / 4))))
    return angle, 1e3 * np.linalg.norm(found[:3, 3] - true[:3, 3])


def learn(seq, program, stated):
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        recording, rig = write(seq, folder, stated)
        learned = folder / "learned.toml"
        run = subprocess.run([program, "calibrate", recording, "--rig", rig, "-o", learned, "--json", "--threads", "1"],
                             capture_output=True, text=True)
        if not learned.exists():
            return None, run.stdout.strip() or run.stderr.strip()
        data = tomllib.loads(learned.read_text())
        camera, target = matrix(data["cameras"][0]["pose"]), matrix(data["targets"][0]["pose"])
        x, y = (camera, target) if seq.eye_in_hand else (target, camera)
        if seq.manifest["track"] == "robot_error":
            x = np.linalg.inv(robots.get_robot(seq.manifest["robot"]).tool_matrix) @ x
        report = json.loads(run.stdout)
        return errors(x, seq.X) + errors(y, seq.Y), report


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--handeye", default="target/release/handeye")
    parser.add_argument("--tracks", nargs="*")
    parser.add_argument("--stated", action="store_true")
    parser.add_argument("--each", action="store_true", help="print every sequence too")
    args = parser.parse_args()
    reference = pd.read_parquet(args.data / "benchmarks" / "results.parquet")
    manifest = io.load_manifest(args.data, args.tracks)
    found, offsets, degenerate = collections.defaultdict(list), [], 0
    sequences = [io._load_from_row(args.data, row.to_dict()) for _, row in manifest.iterrows()]
    with ThreadPoolExecutor(1) as pool:
        results = list(pool.map(lambda seq: learn(seq, args.handeye, args.stated), sequences))
    for seq, (error, report) in zip(sequences, results):
        track = seq.manifest["track"]
        found[track].append(error or (math.inf,) * 4)
        if error is None:
            print(f"{seq.id}: {report[:200]}")
        elif not seq.synchronous:
            offsets.append(1e3 * abs(report["targets"]["time_offset"]["value"] - seq.time_offset))
        degenerate += error is not None and bool(report["gauge"])
        if args.each and error:
            print(seq.id, seq.manifest["level"], *(f"{e:.3f}" for e in error), report["gauge"], report["rejected"], report["targets"]["scale"])
    print(f"\nmedian errors, ours | best reference solver of each column ({'stated' if args.stated else 'estimated'} noise)")
    print(f"{'track':12} {'n':>4}   {'X rot deg':>17}   {'X mm':>19}   {'Y rot deg':>17}   {'Y mm':>19}")
    for track, rows in found.items():
        of_track = reference[(reference.track == track) & reference.ok]
        if (of_track.eval_sync == "estimated").any():
            of_track = of_track[(of_track.eval_sync == "estimated") | (track != "temporal")]
        of_track = of_track[of_track.sequence_id.isin(manifest.sequence_id)]
        best = of_track.groupby("solver")[["X_rot_err_deg", "X_trans_err_mm", "Y_rot_err_deg", "Y_trans_err_mm"]].median().min()
        ours = np.median(np.array(rows), axis=0)
        cells = [f"{a:8.3f} | {b:8.3f}{'' if a <= b * 1.0005 else ' *'}" for a, b in zip(ours, best)]
        print(f"{track:12} {len(rows):4}   " + "   ".join(cells))
    if offsets:
        print(f"time offset: median error {np.median(offsets):.2f} ms over {len(offsets)} sequences")
    print(f"{degenerate} of {len(sequences)} sequences reported as degenerate")


if __name__ == "__main__":
    main()
