//! Standard deviations of what was measured and commanded, estimated from the data: variance components.
//!
//! The residuals of a group of measurements are smaller than its noise, for part of the noise goes into what is estimated. Each
//! variance is the sum of its squared residuals over its redundancy, n - Σ h, with h the leverage of a measurement: what its own
//! noise moves its prediction (Förstner 1979).
use super::graph::State;
use super::leverage::{PredictedPoints, count_free, leverage_of_priors};
use super::observation::Kind;
use super::outliers::Verdict;
use super::residuals::{distances, whitened};
use super::stage::{Stage, Stages};
use crate::factors::Motion;
use crate::recording::{Recording, Sample};
use crate::rig::Noise;
use handeye_solvers::manifold::so3;
use handeye_solvers::{Covariance, Error, Key, Pose};

/// Where a recording holds something of which no noise is stated, the estimation starts here [px, rad or m].
const ANGLE: f64 = 0.01;
const LENGTH: f64 = 0.005;

/// Variances are not taken below this share of those before in one round, nor standard deviations below a least one.
const SHRINK: f64 = 0.01;
const LEAST: f64 = 1e-7;

/// Sum of squares and redundancy of a group of measurements.
#[derive(Clone, Copy, Debug, Default)]
struct Component {
    squares: f64,
    redundancy: f64,
}

impl Component {
    fn add(&mut self, squares: f64, count: f64, leverage: f64) {
        self.squares += squares;
        self.redundancy += count - leverage;
    }

    /// The estimate, or the value before where nothing is left to tell.
    fn sigma(&self, before: f64) -> f64 {
        if before == 0.0 || self.redundancy < 1.0 {
            return before;
        }
        (self.squares / self.redundancy).max(SHRINK * before * before).sqrt().max(LEAST)
    }
}

/// Where a rig states no noise of what a recording holds, a first guess of it.
pub(super) fn guess(noise: &mut Noise, recording: &Recording) {
    let holds = |has: &dyn Fn(&Sample) -> bool| recording.samples.iter().any(has);
    let guess = |value: &mut f64, guess: f64, is_held: bool| {
        if *value == 0.0 && is_held {
            *value = guess;
        }
    };
    guess(&mut noise.joints, ANGLE, holds(&|sample| sample.joints.is_some()));
    guess(&mut noise.joint_action, ANGLE, holds(&|sample| sample.joint_action.is_some()));
    let (poses, actions) = (holds(&|sample| sample.pose.is_some()), holds(&|sample| sample.pose_action.is_some()));
    for (pose, is_held) in [(&mut noise.pose, poses), (&mut noise.pose_action, actions)] {
        guess(&mut pose.xyz, LENGTH, is_held);
        guess(&mut pose.rot, ANGLE, is_held);
    }
}

/// One round of the estimation at the minimum of a stage.
pub(super) fn estimate(
    stages: &Stages<'_>,
    last: &Stage<'_>,
    state: &State,
    verdict: &Verdict,
) -> Result<Noise, Error> {
    let all = Components::new(stages, last, state, verdict)?;
    let mut noise = stages.setup.rig.noise;
    noise.pixels = all.pixels.sigma(stages.setup.sd(Kind::Pixels));
    noise.points = all.points.sigma(stages.setup.sd(Kind::Points));
    noise.joints = all.joints.sigma(noise.joints);
    noise.joint_action = all.joint_action.sigma(noise.joint_action);
    noise.pose.rot = all.rot.sigma(noise.pose.rot);
    noise.pose.xyz = all.xyz.sigma(noise.pose.xyz);
    noise.pose_action.rot = all.action_rot.sigma(noise.pose_action.rot);
    noise.pose_action.xyz = all.action_xyz.sigma(noise.pose_action.xyz);
    Ok(noise)
}

/// How many coordinates of the pixels in use, and of the points, are left over once everything is estimated.
pub(super) fn redundancies(
    stages: &Stages<'_>,
    last: &Stage<'_>,
    state: &State,
    verdict: &Verdict,
) -> Result<[f64; 2], Error> {
    let all = Components::new(stages, last, state, verdict)?;
    Ok([all.pixels.redundancy, all.points.redundancy])
}

/// Every group of measurements.
struct Components {
    pixels: Component,
    points: Component,
    joints: Component,
    joint_action: Component,
    rot: Component,
    xyz: Component,
    action_rot: Component,
    action_xyz: Component,
}

impl Components {
    fn new(stages: &Stages<'_>, last: &Stage<'_>, state: &State, verdict: &Verdict) -> Result<Self, Error> {
        let setup = stages.setup;
        let (states, before) = (&setup.states, setup.rig.noise);
        let mut built = stages.build(last, state);
        let motions: Vec<Option<Key<Pose>>> = (0..setup.len())
            .map(|sample| {
                let on = (built.tips[sample]?, *built.tips.get(sample + 1)?.as_ref()?);
                states.pose_actions[sample]?;
                Some(built.graph.derive(Motion, on))
            })
            .collect();
        let has_both = setup.has(Kind::Pixels) && setup.has(Kind::Points);
        let predicted = has_both.then(|| PredictedPoints::new(setup, state, last.freedom, &mut built));
        let free = count_free(last.freedom, &built) + if setup.tool_is_open() { 6 } else { 0 };
        let mut covariance = Covariance::new(&built.graph)?;
        let taken_by_priors = leverage_of_priors(stages.priors, last.freedom, &built, &mut covariance);
        let mut taken = taken_by_priors;

        let (mut joints, mut joint_action) = (Component::default(), Component::default());
        let (mut rot, mut xyz) = (Component::default(), Component::default());
        let (mut action_rot, mut action_xyz) = (Component::default(), Component::default());
        for sample in (0..setup.len()).filter(|&sample| state.placed[sample]) {
            if let (Some(key), Some(readings), true) =
                (built.joints[sample], &states.readings[sample], state.trusted[sample])
                && !states.exact[sample]
            {
                let squares = state.joints[sample].iter().zip(readings).map(|(a, b)| (a - b).powi(2)).sum();
                let leverage = covariance.of(key).trace() / before.joints.powi(2);
                joints.add(squares, readings.len() as f64, leverage);
                taken += leverage;
            }
            if let (Some(action), true) = (&states.joint_actions[sample], before.joint_action > 0.0)
                && let (Some(a), Some(b)) = (built.joints[sample], built.joints[sample + 1])
            {
                let moved = state.joints[sample + 1].iter().zip(&state.joints[sample]).map(|(next, now)| next - now);
                let squares = moved.zip(action).map(|(moved, action)| (moved - action).powi(2)).sum();
                let both = covariance.of(a).trace() + covariance.of(b).trace() - 2.0 * covariance.between(a, b).trace();
                let leverage = both / before.joint_action.powi(2);
                joint_action.add(squares, action.len() as f64, leverage);
                taken += leverage;
            }
            let read = states.poses[sample].filter(|_| state.trusted[sample] && before.pose.is_noisy());
            if let (Some(reading), Some(tip)) = (read, built.tips[sample]) {
                let seen = built.graph.value(tip) * state.tool;
                taken += add_pose(
                    &mut rot,
                    &mut xyz,
                    &seen,
                    &reading,
                    &covariance.of(tip),
                    before.pose.rot,
                    before.pose.xyz,
                );
            }
            if let (Some(action), Some(motion)) = (states.pose_actions[sample], motions[sample])
                && before.pose_action.is_noisy()
            {
                let (moved, block) = (built.graph.value(motion), covariance.of(motion));
                let (rot, xyz) = (before.pose_action.rot, before.pose_action.xyz);
                taken += add_pose(&mut action_rot, &mut action_xyz, &moved, &action, &block, rot, xyz);
            }
        }
        // All leverages add up to the number of free coordinates: what is left is that of the pixels, or of the points.
        let mut seen = [Component::default(); 2];
        let used = distances(setup, state).into_iter().zip(&setup.observations).zip(&verdict.active);
        for ((distance, one), _) in used.filter(|(_, active)| **active) {
            seen[one.kind() as usize].add(distance * distance, one.kind().coordinates(), 0.0);
        }
        let [mut pixels, mut points] = seen;
        let left = (free as f64 - taken).max(0.0);
        let of_points = match &predicted {
            Some(predicted) => predicted.leverage(setup, last, &whitened(setup, state), &mut covariance).min(left),
            None if setup.has(Kind::Points) => left,
            None => 0.0,
        };
        points.add(0.0, 0.0, of_points);
        pixels.add(0.0, 0.0, left - of_points);
        Ok(Components { pixels, points, joints, joint_action, rot, xyz, action_rot, action_xyz })
    }
}

/// Noise of readings and motions below this is none, however it goes on to shrink [rad or m]: images show nothing of it.
const NONE: f64 = 5e-5;

/// Largest relative change of a standard deviation.
pub(super) fn change(a: &Noise, b: &Noise) -> f64 {
    let seen = |noise: &Noise| [noise.pixels, noise.points];
    let told = |noise: &Noise| {
        let Noise { joints, pose, joint_action, pose_action, .. } = *noise;
        [joints, pose.xyz, pose.rot, joint_action, pose_action.xyz, pose_action.rot]
    };
    let of_images = seen(a).into_iter().zip(seen(b));
    let of_robot = told(a).into_iter().zip(told(b)).filter(|(a, b)| a.max(*b) > NONE);
    of_images.chain(of_robot).filter(|(a, _)| *a > 0.0).map(|(a, b)| (b / a - 1.0).abs()).fold(0.0, f64::max)
}

/// Adds the error of a pose to its two components, and returns its leverage.
fn add_pose(
    rot: &mut Component,
    xyz: &mut Component,
    pose: &Pose,
    reading: &Pose,
    block: &nalgebra::DMatrix<f64>,
    rot_sd: f64,
    xyz_sd: f64,
) -> f64 {
    let mut taken = 0.0;
    let turned = so3::log(&(pose.rotation * reading.rotation.transpose())).norm_squared();
    let moved = (pose.translation - reading.translation).norm_squared();
    for (component, first, squares, sd) in [(rot, 0, turned, rot_sd), (xyz, 3, moved, xyz_sd)] {
        if sd > 0.0 {
            let leverage = (first..first + 3).map(|i| block[(i, i)]).sum::<f64>() / (sd * sd);
            component.add(squares, 3.0, leverage);
            taken += leverage;
        }
    }
    taken
}
