#!/usr/bin/env python3
"""Hand-eye calibration on KinHEC's sequences: medians of `handeye calibrate` beside those of its reference solvers.

    pip install kinhec
    kinhec generate --tier small --out DATA      (where no folder of that name stands; half an hour; `smoke`: half a minute)
    kinhec benchmark DATA
    python benches/hand_eye.py DATA [--handeye target/release/handeye] [--tracks ...] [--stated] [--limit]

Each sequence becomes a recording of targets and a rig that says only where the camera is mounted (and, for `robot_error`, the
nominal chain). Neither true values nor noise levels are passed on; `--stated` passes the noise of robot and camera on. Where the
clocks are apart, the reference solvers have their estimate of the offset too. A column's reference is the solver with the least
median of that column, on the sequences that the benchmark has been run on (`--max-sequences`); `wins` counts the sequences on which ours is nearer to the truth than that solver. `--limit` adds, for
`robot_error`, a maximum a posteriori fit that is told all noise levels and starts at the truth: nothing can do better on average.
"""
import argparse, collections, json, math, pathlib, subprocess, tempfile, tomllib
import numpy as np, pandas as pd
from kinhec import io, robots
from kinhec.metrics import calibration_errors

COLUMNS = {"X_rot_err_deg": "X deg", "X_trans_err_mm": "X mm", "Y_rot_err_deg": "Y deg", "Y_trans_err_mm": "Y mm"}


def pose(m):
    x, y, z, w = quaternion(m[:3, :3])
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
    lines, noise = [], []
    if with_joints:
        robot = robots.get_robot(m["robot"])
        lines += ["[robot]", f'convention = "{"modified-dh" if robot.convention == "modified" else "dh"}"']
        for k, name in enumerate(joints):
            row = [float(v[k]) for v in (robot.theta_offset, robot.d, robot.a, robot.alpha)]
            lines += ["[[robot.joints]]", f'name = "{name}"', *(f"{key} = {v!r}" for key, v in zip(("offset", "d", "a", "alpha"), row))]
            if robot.q_sign and robot.q_sign[k] < 0:
                lines.append("reversed = true")
    lines += ["[[cameras]]", 'name = "camera"', f'parent = "{"tip" if seq.eye_in_hand else "world"}"']
    if stated and not with_joints and m["robot_trans_std_m"] > 0:
        noise.append(f'pose = {{ xyz = {m["robot_trans_std_m"]!r}, rot = {m["robot_rot_std_rad"]!r} }}')
    if stated and with_joints:
        noise.append(f'joints = {m["joint_std_rad"]!r}')
        angle, length = max(m["dh_ang_std_rad"], 1e-7), max(m["dh_len_std_m"], 1e-7)
        priors = [f'"robot.joints.*.{key}" = {sd!r}' for key, sd in zip(("offset", "d", "a", "alpha"), (angle, length, length, angle))]
        lines += ["[estimate.prior]", *priors]
    if noise:
        lines += ["[noise]", *noise]
    rig = folder / "rig.toml"
    rig.write_text("\n".join(lines) + "\n")
    return recording, rig


def learn(seq, program, stated):
    """Errors of X and Y in the order of COLUMNS and the report; no errors where nothing was learned."""
    with tempfile.TemporaryDirectory() as folder:
        folder = pathlib.Path(folder)
        recording, rig = write(seq, folder, stated)
        learned = folder / "learned.toml"
        run = subprocess.run([program, "calibrate", recording, "--rig", rig, "-o", learned, "--json", "--threads", "1"],
                             capture_output=True, text=True)
        if not learned.exists():
            return None, {"failure": run.stdout.strip() or run.stderr.strip()}
        data = tomllib.loads(learned.read_text())
        camera, target = matrix(data["cameras"][0]["pose"]), matrix(data["targets"][0]["pose"])
        x, y = (camera, target) if seq.eye_in_hand else (target, camera)
        if seq.manifest["track"] == "robot_error":
            x = np.linalg.inv(robots.get_robot(seq.manifest["robot"]).tool_matrix) @ x
        errors = calibration_errors(x, seq.X, y, seq.Y)
        return [errors[column] for column in COLUMNS], json.loads(run.stdout)


def limit(seq):
    """Errors of a fit that is told all noise levels and starts at the truth, with the joints' noise carried to the poses."""
    from scipy.optimize import least_squares
    from kinhec import kinematics, se3
    from dataclasses import replace
    m, robot = seq.manifest, robots.get_robot(seq.manifest["robot"])
    valid = seq.camera.has_measurement
    q, seen = seq.robot.q_meas[valid], seq.camera.T_cam_target_meas[valid]
    n = robot.dof
    fields = ("a", "d", "alpha", "theta_offset")
    nominal = np.concatenate([getattr(robot, field) for field in fields])
    sd = np.repeat([m["dh_len_std_m"], m["dh_len_std_m"], m["dh_ang_std_rad"], m["dh_ang_std_rad"]], n)
    true = seq.extra.get("true_dh", {})
    off = np.concatenate([true.get(field, getattr(robot, field)) for field in fields]) - nominal
    free = sd > 0

    def chain(step):
        rows = dict(zip(fields, (nominal + step).reshape(4, n).tolist()))
        return replace(robot, **rows)

    def misfits(x, y, model, joints):
        """Of rotation in the target's frame [rad] and of translation in the camera's [m], as the noise is."""
        predicted = se3.inverse(kinematics.forward_kinematics_batch(model, joints) @ x) @ y
        turn = se3.log_so3(np.swapaxes(seen[:, :3, :3], 1, 2) @ predicted[:, :3, :3])
        return np.concatenate([turn, predicted[:, :3, 3] - seen[:, :3, 3]], axis=1)

    camera = np.diag(np.square([m["camera_rot_std_rad"]] * 3 + [m["camera_trans_std_m"]] * 2 + [m["camera_trans_std_z_m"]]))
    at_truth = misfits(seq.X, seq.Y, chain(off), q)
    slopes = [(misfits(seq.X, seq.Y, chain(off), q + 1e-6 * np.eye(n)[k]) - at_truth) / 1e-6 for k in range(n)]
    slopes = np.stack(slopes, axis=2)
    covariances = camera + m["joint_std_rad"] ** 2 * slopes @ np.swapaxes(slopes, 1, 2)
    whitening = np.linalg.inv(np.linalg.cholesky(covariances))

    def at(p):
        step = np.zeros(4 * n)
        step[free] = p[12:] * sd[free]
        return seq.X @ se3.exp_se3(p[:6]), seq.Y @ se3.exp_se3(p[6:12]), chain(step)

    def residual(p):
        return np.concatenate([np.einsum("nij,nj->ni", whitening, misfits(*at(p), q)).ravel(), p[12:]])

    start = np.concatenate([np.zeros(12), off[free] / sd[free]])
    x, y, _ = at(least_squares(residual, start).x)
    errors = calibration_errors(x, seq.X, y, seq.Y)
    return [errors[column] for column in COLUMNS]


def reference_errors(data, manifest):
    """Rows of the reference solvers on these sequences, with estimated offsets where the clocks are apart."""
    rows = pd.read_parquet(data / "benchmarks" / "results.parquet")
    rows = rows[rows.ok & rows.sequence_id.isin(manifest.sequence_id)]
    return rows[(rows.eval_sync == "estimated") | (rows.sync == "synchronous")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", type=pathlib.Path)
    parser.add_argument("--handeye", default="target/release/handeye")
    parser.add_argument("--tracks", nargs="*")
    parser.add_argument("--stated", action="store_true")
    parser.add_argument("--limit", action="store_true")
    parser.add_argument("--each", type=pathlib.Path, metavar="FILE", help="write what was found on every sequence, as JSON Lines")
    args = parser.parse_args()
    manifest = io.load_manifest(args.data, args.tracks)
    reference = reference_errors(args.data, manifest)
    manifest = manifest[manifest.sequence_id.isin(reference.sequence_id)]
    rows, limits = [], collections.defaultdict(list)
    for _, row in manifest.iterrows():
        seq = io._load_from_row(args.data, row.to_dict())
        errors, report = learn(seq, args.handeye, args.stated)
        found = {"sequence_id": seq.id, "track": row.track, "level": row.level, "gauge": report.get("gauge", []),
                 "failure": report.get("failure", ""), **dict(zip(COLUMNS, errors or [math.inf] * 4))}
        if errors is None:
            print(f"{seq.id}: {report['failure'][:300]}")
        elif not seq.synchronous:
            found["offset_error_ms"] = 1e3 * abs(report["targets"]["time_offset"]["value"] - seq.time_offset)
        if args.limit and row.track == "robot_error":
            limits[row.track].append(limit(seq))
        rows.append(found)
    ours = pd.DataFrame(rows)
    if args.each:
        ours.to_json(args.each, orient="records", lines=True)
    print_table(ours, reference, limits, "stated" if args.stated else "estimated")
    print_offsets(ours, reference)
    print_degenerate(ours)


def print_table(ours, reference, limits, noise):
    print(f"\nmedian errors with {noise} noise")
    print(f"{'track':12} {'n':>4}  {'':6} {'ours':>8} {'reference':>9} {'ratio':>6} {'wins':>9}  {'limit':>8}  solver")
    for track, of_track in ours.groupby("track", sort=False):
        for k, (column, name) in enumerate(COLUMNS.items()):
            solvers = reference[reference.track == track].groupby("solver")[column].median().dropna()
            best = solvers.idxmin()
            of_best = reference[(reference.track == track) & (reference.solver == best)].set_index("sequence_id")[column]
            pairs = of_track.set_index("sequence_id")[column].to_frame("ours").join(of_best.rename("best"), how="left")
            wins = int((pairs.ours < pairs.best.fillna(math.inf)).sum())
            median = of_track[column].median()
            bound = f"{np.median(np.array(limits[track])[:, k]):8.4f}" if track in limits else f"{'':8}"
            print(f"{track:12} {len(of_track):4}  {name:6} {median:8.4f} {solvers[best]:9.4f} {median / solvers[best]:6.2f} "
                  f"{wins:4}/{len(pairs):<4}  {bound}  {best}")


def print_offsets(ours, reference):
    if "offset_error_ms" not in ours:
        return
    for track, of_track in ours[ours.offset_error_ms.notna()].groupby("track", sort=False):
        theirs = reference[(reference.track == track) & (reference.sync != "synchronous")].drop_duplicates("sequence_id").time_offset_err_ms
        print(f"time offset, {track}: median error {of_track.offset_error_ms.median():.2f} ms over {len(of_track)} sequences "
              f"(reference: {theirs.median():.2f} ms)")


def print_degenerate(ours):
    motions = ours[ours.track == "motion"]
    if motions.empty:
        return
    print("\nmotions reported as degenerate, by level:")
    for level, rows in motions.groupby("level", sort=False):
        said = rows[rows.gauge.map(len) > 0]
        print(f"{level:36} {len(said)} of {len(rows)}  {said.gauge.iloc[0][0][:90] if len(said) else ''}")
    others = ours[ours.track != "motion"]
    print(f"other tracks: {(others.gauge.map(len) > 0).sum()} of {len(others)}")


if __name__ == "__main__":
    main()
