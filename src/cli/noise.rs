//! Standard deviations of what is measured and commanded, in words, tables and JSON.
use super::table::Table;
use handeye::calibrate::NoiseTrial;
use handeye::rig::{Noise, PoseNoise};
use serde_json::{Value, json};

/// Everything that is not exact.
pub fn in_words(noise: &Noise) -> String {
    let mut parts = vec![format!("pixels {:.3} px", noise.pixels)];
    let pose =
        |name: &str, noise: PoseNoise| format!("{name} {:.2} mm and {:.3} mrad", 1e3 * noise.xyz, 1e3 * noise.rot);
    let scalar = |name: &str, sd: f64| format!("{name} {:.3} mrad (or mm)", 1e3 * sd);
    parts.extend((noise.joints > 0.0).then(|| scalar("joints", noise.joints)));
    parts.extend(noise.pose.is_noisy().then(|| pose("tip poses", noise.pose)));
    parts.extend((noise.joint_action > 0.0).then(|| scalar("joint actions", noise.joint_action)));
    parts.extend(noise.pose_action.is_noisy().then(|| pose("pose actions", noise.pose_action)));
    parts.join(", ")
}

/// As in the rig file's `[noise]`.
pub fn json(noise: &Noise) -> Value {
    let pose = |noise: PoseNoise| json!({ "xyz": noise.xyz, "rot": noise.rot });
    json!({
        "pixels": noise.pixels,
        "joints": noise.joints,
        "pose": pose(noise.pose),
        "joint_action": noise.joint_action,
        "pose_action": pose(noise.pose_action),
    })
}

pub fn trials_table(trials: &[NoiseTrial]) -> String {
    let best = NoiseTrial::best(trials);
    let mut table = Table::new(&["noise of states", "joints", "pose xyz", "pose rot", "held out, mean px", ""]);
    for trial in trials {
        let Noise { joints, pose, .. } = trial.noise;
        let chosen = if Some(trial) == best { "chosen" } else { "" };
        table.row(
            [format!("x {}", trial.factor)]
                .into_iter()
                .chain([joints, pose.xyz, pose.rot].map(|sd| format!("{sd:.2e}")))
                .chain([format!("{:.3}", trial.mean_px), chosen.to_owned()]),
        );
    }
    format!("noise of states by how well samples held out of the fit are predicted:\n{table}")
}

pub fn trials_json(trials: &[NoiseTrial]) -> Value {
    let trial =
        |trial: &NoiseTrial| json!({ "factor": trial.factor, "noise": json(&trial.noise), "mean_px": trial.mean_px });
    trials.iter().map(trial).collect()
}
