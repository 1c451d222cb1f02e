//! The learned rig and what is to be said of it: misfits, what the motions leave open, how well the closed forms agree.
use super::graph::{Built, Freedom, State};
use super::setup::Setup;
use super::start::Start;
use super::{scatter, turning};
use crate::Error;
use crate::calibrate::{Calibration, PointErrors, Report, StageReport};
use crate::chain::LINK_PARAMETERS;
use crate::recording::Recording;
use crate::rig::{Fit, Rig};
use handeye_solvers::{Covariance, DynamicVector, Key, Pose, Solver};
use std::collections::BTreeMap;

/// What was learned from targets, beside the rig.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TargetReport {
    /// Root mean square of the translations' misfits, per axis, over what was used [m].
    pub rms_xyz: f64,
    /// The same of the rotations [rad].
    pub rms_rot: f64,
    /// How far the clock of the images is ahead of the robot's, and its standard deviation [s], where they were recorded apart.
    pub time_offset: Option<(f64, f64)>,
    /// Factor of the reported translations and its standard deviation, where it is not 1.
    pub scale: Option<(f64, f64)>,
    /// Closed forms that are far from what was learned.
    pub disagreements: Vec<Disagreement>,
    /// True where pixels were recorded too; they were not used.
    pub pixels_unused: bool,
}

impl TargetReport {
    /// What else there is to say in words: the clock, the scale, closed forms that disagree, and pixels that were not used.
    pub fn remarks(&self) -> Vec<String> {
        let clock = self.time_offset.map(|(offset, sd)| {
            format!("the images' clock is {:.2} ms ahead of the robot's (± {:.2} ms)", 1e3 * offset, 1e3 * sd)
        });
        let scale = self.scale.map(|(scale, sd)| {
            format!(
                "the targets' translations are {scale:.4} times (± {sd:.4}) the robot's: they are monocular, or the target's size is wrong"
            )
        });
        let disagreement = |Disagreement { name, rot, xyz }: &Disagreement| {
            let (deg, mm) = (rot.to_degrees(), 1e3 * xyz);
            format!("the closed form of {name} disagrees: {deg:.1}° and {mm:.0} mm from what was learned")
        };
        let unused = "pixels were recorded too, without joints, and were not used";
        let unused = self.pixels_unused.then(|| unused.to_owned());
        clock.into_iter().chain(scale).chain(self.disagreements.iter().map(disagreement)).chain(unused).collect()
    }
}

/// A closed form that does not agree with what was learned.
#[derive(Clone, Debug, PartialEq)]
pub struct Disagreement {
    /// Whose it is.
    pub name: String,
    /// How far its pose of what is on the tip is off [rad].
    pub rot: f64,
    /// The same [m].
    pub xyz: f64,
}

/// Misfits from this many standard deviations on count as wrong detections.
const WRONG: f64 = 6.0;

/// Turns about a second axis below this many standard deviations of a turn's noise do not count.
const TURNS: f64 = 5.0;
/// Turns about a second axis below this share of those about the first leave the place along it weak.
const ONE_AXIS: f64 = 0.02;

/// A closed form this far from the rest disagrees [rad, m].
const APART_ROT: f64 = 0.05;
const APART_XYZ: f64 = 0.05;

/// Everything at the end of a calibration.
pub(super) struct Account<'a> {
    pub setup: &'a Setup,
    pub state: &'a State,
    pub freedom: Freedom,
    pub built: &'a Built,
    pub starts: &'a [Start],
}

impl Account<'_> {
    pub fn finish(
        &self,
        solver: Solver,
        stage: StageReport,
        converged: bool,
        recording: &Recording,
    ) -> Result<Calibration, Error> {
        let (setup, state) = (self.setup, self.state);
        let (mut used, mut sums, mut samples) = (0, [0.0; 2], vec![false; setup.moments.len()]);
        for (index, view) in setup.views.iter().enumerate() {
            if scatter::size(setup, state, index) < 6.0 * WRONG * WRONG {
                used += 1;
                samples[view.moment] = true;
                let r = scatter::residual(setup, state, index);
                (0..6).for_each(|k| sums[k / 3] += r[k] * r[k]);
            }
        }
        let rms = |sum: f64| (sum / (3 * used.max(1)) as f64).sqrt();
        let mut gauge = self.open_directions();
        let deviations = Covariance::with(&self.built.graph, solver).ok();
        if deviations.is_none() {
            gauge.push("standard deviations are not given: some direction is open".into());
        }
        let (sd, offset_sd, scale_sd) = deviations.map(|c| self.deviations(c)).unwrap_or_default();
        let targets = TargetReport {
            rms_rot: rms(sums[0]),
            rms_xyz: rms(sums[1]),
            time_offset: self.freedom.offset.then_some((state.offset, offset_sd)),
            scale: self.freedom.scale.then_some((state.scale, scale_sd)),
            disagreements: self.disagreements(),
            pixels_unused: recording.samples.iter().any(|sample| !sample.pixels.is_empty()),
        };
        let n_samples = samples.iter().filter(|used| **used).count();
        let rejected = setup.views.len() - used;
        let mut rig = self.learned();
        rig.fit =
            Some(Fit { samples: n_samples, observations: used, rejected, gauge: gauge.clone(), sd, ..Fit::default() });
        let report = Report {
            samples: n_samples,
            observations: used,
            rejected,
            rms_px: 0.0,
            mean_px: 0.0,
            median_px: 0.0,
            points: PointErrors::default(),
            cameras: Vec::new(),
            stages: vec![stage],
            converged,
            metric: true,
            gauge,
            states: vec![self.states()],
            noise: None,
            findings: Vec::new(),
            tip: None,
            camera_poses: Vec::new(),
            weak: Vec::new(),
            influence: Vec::new(),
            targets: Some(targets),
        };
        Ok(Calibration { rig, report })
    }

    /// Where tips come from, in words.
    fn states(&self) -> String {
        let noise = &self.setup.rig.noise;
        let clock = if self.setup.apart { ", smoothed over time" } else { "" };
        let tips = match (self.setup.by_joints, noise.pose.xyz > 0.0 || noise.pose.rot > 0.0) {
            (true, _) => "tips follow from the joints and the chain, which is learned too",
            (false, true) => "tips are free under the noise of their poses",
            (false, false) => "tips are where their poses say",
        };
        let told = self.setup.views.iter().filter(|view| view.whitening.is_some()).count();
        let targets = match (told, noise.target) {
            (0, None) => "estimated from their scatter",
            (0, Some(_)) => "stated",
            (told, None) if told < self.setup.views.len() => {
                "what their covariances say, and estimated from the scatter where they have none"
            }
            _ => "what their covariances say",
        };
        let drift = match self.state.walks {
            [0.0, 0.0] => String::new(),
            [rot, xyz] => format!(", and they drift by {:.4}° and {:.2} mm a view", rot.to_degrees(), 1e3 * xyz),
        };
        format!("{tips}{clock}; the noise of targets is {targets}{drift}")
    }

    fn learned(&self) -> Rig {
        let (mut rig, state) = (self.setup.rig.clone(), self.state);
        rig.cameras.iter_mut().zip(&state.cameras).for_each(|(camera, pose)| camera.pose = Some(*pose));
        rig.targets.iter_mut().zip(&state.targets).for_each(|(target, pose)| target.pose = Some(*pose));
        if self.built.parameters.is_some() {
            rig.robot.base = Some(state.base);
            for (joint, row) in rig.robot.joints.iter_mut().zip(state.parameters.chunks(LINK_PARAMETERS)) {
                (joint.offset, joint.d, joint.a, joint.alpha) =
                    (Some(row[0]), Some(row[1]), Some(row[2]), Some(row[3]));
                joint.beta = joint.beta.map(|_| row[4]);
            }
        }
        rig
    }

    /// What motions do not determine, in words, with the direction.
    fn open_directions(&self) -> Vec<String> {
        let (axis, [first, second]) = turning(&self.state.tips);
        let noise = self.state.sigmas[..3].iter().fold(self.setup.rig.noise.pose.rot, |most, sigma| most.max(*sigma));
        let direction = format!("[{:.3}, {:.3}, {:.3}]", axis.x, axis.y, axis.z);
        if first < TURNS * noise {
            return vec![
                "the tip does not turn: the translation between tip and what is mounted on it is open, and was kept near 0; turn \
                 the tip about two axes"
                    .into(),
            ];
        }
        if second < TURNS * noise || second < ONE_AXIS * first {
            return vec![format!(
                "the tip turns about one axis alone, {direction} in its own frame: where things mounted on it are along that axis, \
                 and how they are turned about it, is open and only what is given decides; turn the tip about another axis too"
            )];
        }
        Vec::new()
    }

    /// Standard deviations by parameter path, of the offset and of the scale.
    fn deviations(&self, mut covariance: Covariance<'_>) -> (BTreeMap<String, Vec<f64>>, f64, f64) {
        let rig = &self.setup.rig;
        let mut sd = BTreeMap::new();
        let mut pose = |key: Key<Pose>| {
            let block = covariance.of(key);
            let sd: Vec<f64> = block.diagonal().iter().map(|variance| variance.max(0.0).sqrt()).collect();
            [&sd[3..], &sd[..3]].concat()
        };
        for (camera, key) in rig.cameras.iter().zip(&self.built.cameras) {
            sd.insert(format!("cameras.{}.pose", camera.name), pose(*key));
        }
        for (target, key) in rig.targets.iter().zip(&self.built.targets) {
            sd.insert(format!("targets.{}.pose", target.name), pose(*key));
        }
        if let Some(key) = self.built.parameters {
            let key: Key<DynamicVector> = key;
            let block = covariance.of(key);
            let fields = ["offset", "d", "a", "alpha"];
            for (index, joint) in rig.robot.joints.iter().enumerate() {
                for (k, field) in fields.iter().enumerate() {
                    let at = LINK_PARAMETERS * index + k;
                    let path = format!("robot.joints.{}.{field}", joint.name);
                    sd.insert(path, vec![block[(at, at)].max(0.0).sqrt()]);
                }
            }
        }
        sd.retain(|_, values| values.iter().any(|value| *value > 0.0));
        let scalar = |covariance: &mut Covariance<'_>, key, free: bool| {
            if free { covariance.of::<handeye_solvers::Vector<1>>(key)[(0, 0)].max(0.0).sqrt() } else { 0.0 }
        };
        let offset = scalar(&mut covariance, self.built.offset, self.freedom.offset);
        let scale = scalar(&mut covariance, self.built.scale, self.freedom.scale);
        (sd, offset, scale)
    }

    /// Closed forms on all samples that are far from what was learned, the best start of each.
    fn disagreements(&self) -> Vec<Disagreement> {
        let (camera, target) = super::most_seen(self.setup);
        let on_hand = self.setup.rig.cameras[camera].parent != crate::rig::Parent::World;
        let learned = if on_hand { self.state.cameras[camera] } else { self.state.targets[target] };
        let mut seen: Vec<Disagreement> = Vec::new();
        for start in self.starts.iter().filter(|start| (start.scale != 1.0) == self.freedom.scale) {
            let (rot, xyz) = (learned.angle_to(&start.x), (learned.translation - start.x.translation).norm());
            if seen.iter().all(|other| other.name != start.name) {
                seen.push(Disagreement { name: start.name.to_owned(), rot, xyz });
            }
        }
        seen.retain(|start| start.rot > APART_ROT || start.xyz > APART_XYZ);
        seen
    }
}
