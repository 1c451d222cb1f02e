//! The robot's state in every sample: what was read of it, what was commanded, and which of the paper's settings that makes.
use super::evaluate::Correspondence;
use crate::Error;
use crate::recording::{Recording, Sample};
use crate::rig::{Noise, Parent, PoseNoise, Rig};
use handeye_solvers::Pose;

/// What is known of the state of every sample. All lists are as long as the samples.
#[derive(Clone, Debug, Default)]
pub(crate) struct States {
    /// Whether tips follow from joints through a chain; otherwise their poses are what was read or commanded.
    pub chain: bool,
    /// The joints' readings.
    pub readings: Vec<Option<Vec<f64>>>,
    /// The tip's pose as it was read, where that says something of the tip.
    pub poses: Vec<Option<Pose>>,
    /// Commanded motions from a sample to the next, where they say something.
    pub joint_actions: Vec<Option<Vec<f64>>>,
    pub pose_actions: Vec<Option<Pose>>,
    /// Whether the state is known exactly.
    pub exact: Vec<bool>,
    /// Readings, or what actions make of readings near by; `None` where nothing tells of the state but the images.
    pub starts: Vec<Option<Start>>,
    /// How many poses say nothing, for want of their noise.
    unused_poses: usize,
    /// How many poses of targets there are, which say nothing beside pixels.
    unused_targets: usize,
}

/// A first value of a state.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Start {
    Joints(Vec<f64>),
    Tip(Pose),
}

impl Start {
    pub fn joints(&self) -> Option<&[f64]> {
        if let Start::Joints(joints) = self { Some(joints) } else { None }
    }
}

impl States {
    /// Which samples of a recording take part, and what is known of their states.
    pub fn new(rig: &Rig, recording: &Recording) -> Result<(Vec<usize>, States), Error> {
        let samples = &recording.samples;
        let holds = |has: &dyn Fn(&Sample) -> bool| samples.iter().filter(|sample| has(sample)).count();
        let joints = holds(&|sample| sample.joints.is_some());
        let joint_actions = holds(&|sample| sample.joint_action.is_some());
        let (poses, pose_actions) =
            (holds(&|sample| sample.pose.is_some()), holds(&|sample| sample.pose_action.is_some()));
        let chain = joints > 0 || joint_actions > 0;
        if !chain && poses == 0 && pose_actions == 0 {
            return Err(Error::NotEnoughData("no sample of the recording has joints, a tip pose or an action".into()));
        }
        let noise = &rig.noise;
        let mut states = States { chain, ..States::default() };
        let index = Correspondence::new(rig, recording);
        let sees = |sample: &Sample| {
            let is_known = |camera: u32, feature: u32| {
                index.cameras[camera as usize].is_some() && index.features[feature as usize].is_some()
            };
            sample.pixels.iter().any(|seen| is_known(seen.camera, seen.feature))
                || sample.points.iter().any(|seen| is_known(seen.camera, seen.feature))
        };
        let mut taken = Vec::new();
        for (number, sample) in samples.iter().enumerate() {
            let linked = if chain { sample.joint_action.is_some() } else { sample.pose_action.is_some() };
            let read = if chain { sample.joints.is_some() } else { sample.pose.is_some() };
            let after = number > 0 && {
                let before = &samples[number - 1];
                if chain { before.joint_action.is_some() } else { before.pose_action.is_some() }
            };
            if linked || read || after || sees(sample) {
                taken.push(number);
                states.push(sample, noise);
            }
        }
        states.drop_links(&taken);
        if chain {
            states.start_joints(recording.joints.len(), noise)
        } else {
            states.start_tips(noise)
        }
        if !chain {
            check_poses(rig)?;
        }
        Ok((taken, states))
    }

    /// How many samples there are.
    pub fn len(&self) -> usize {
        self.readings.len()
    }

    /// True where recorded tip poses take part beside joints.
    pub fn poses_beside_joints(&self) -> bool {
        self.chain && self.poses.iter().any(Option::is_some)
    }

    fn push(&mut self, sample: &Sample, noise: &Noise) {
        let chain = self.chain;
        let use_pose = if chain { noise.pose.is_noisy() } else { true };
        let exact = if chain {
            sample.joints.is_some() && noise.joints == 0.0
        } else {
            sample.pose.is_some() && !noise.pose.is_noisy()
        };
        self.readings.push(sample.joints.clone().filter(|_| chain));
        self.poses.push(sample.pose.filter(|_| use_pose));
        self.unused_poses += usize::from(sample.pose.is_some() && !use_pose);
        self.unused_targets += sample.targets.len();
        self.joint_actions.push(sample.joint_action.clone().filter(|_| chain));
        self.pose_actions.push(sample.pose_action.filter(|_| !chain || noise.pose_action.is_noisy()));
        self.exact.push(exact);
    }

    /// Actions lead to the next sample of the recording: where that takes no part, nowhere.
    fn drop_links(&mut self, taken: &[usize]) {
        for (state, &sample) in taken.iter().enumerate() {
            if taken.get(state + 1) != Some(&(sample + 1)) {
                self.joint_actions[state] = None;
                self.pose_actions[state] = None;
            }
        }
    }

    /// Readings; where there is none, what actions make of the nearest one before, else after. Without any reading, joints are
    /// counted from the first state that an action leads from, which is zero.
    fn start_joints(&mut self, count: usize, noise: &Noise) {
        let moved = |from: &Vec<f64>, action: &Vec<f64>, sign: f64| -> Vec<f64> {
            from.iter().zip(action).map(|(joint, action)| joint + sign * action).collect()
        };
        let starts = follow(
            self.readings.clone(),
            &self.joint_actions,
            &mut self.exact,
            noise.joint_action == 0.0,
            vec![0.0; count],
            |from, action| moved(from, action, 1.0),
            |from, action| moved(from, action, -1.0),
        );
        self.starts = starts.into_iter().map(|start| start.map(Start::Joints)).collect();
    }

    /// The same for tip poses: P_next = A P. Without any reading, the first is the identity: the tip's frame is any.
    fn start_tips(&mut self, noise: &Noise) {
        let starts = follow(
            self.poses.clone(),
            &self.pose_actions,
            &mut self.exact,
            !noise.pose_action.is_noisy(),
            Pose::identity(),
            |from, action| *action * *from,
            |from, action| action.inverse() * *from,
        );
        self.starts = starts.into_iter().map(|start| start.map(Start::Tip)).collect();
    }

    /// Which setting of the paper applies, and what of the recording takes part.
    pub fn words(&self, noise: &Noise) -> Vec<String> {
        let samples = self.len();
        let joints = self.readings.iter().flatten().count();
        let joint_actions = self.joint_actions.iter().flatten().count();
        let (poses, pose_actions) = (self.poses.iter().flatten().count(), self.pose_actions.iter().flatten().count());
        let pose = |noise: PoseNoise| format!("{:.3e} m, {:.3e} rad", noise.xyz, noise.rot);
        let of =
            |count: usize| if count == samples { String::new() } else { format!(", in {count} of {samples} samples") };
        let mut words = Vec::new();
        if self.chain && joints > 0 {
            words.push(match noise.joints {
                0.0 => format!("joint readings are exact{}", of(joints)),
                sd => {
                    format!("joint readings are noisy ({sd:.3e} rad or m){}: joints are estimated (eq. 11)", of(joints))
                }
            });
        }
        if self.chain && joint_actions > 0 {
            let counted = if joints == 0 { "; joints are counted from the first sample, which is zero" } else { "" };
            words.push(match noise.joint_action {
                _ if self.exact.iter().all(|exact| *exact) && joints > 0 => "joint actions tell nothing new: all joints are exact".to_owned(),
                0.0 if joints == 0 => format!("joint actions are executed exactly{counted}"),
                0.0 => "joint actions only start joints that were not read: [noise] joint_action does not say how good they are".to_owned(),
                sd => format!("joint actions are noisy ({sd:.3e} rad or m): joints are estimated (eq. 15){counted}"),
            });
        }
        if self.unused_poses > 0 {
            words.push("tip poses are not used beside joints: [noise] pose does not say how good they are".to_owned());
        }
        if poses > 0 {
            words.push(match (self.chain, noise.pose.is_noisy()) {
                (true, _) => {
                    format!("tip poses are noisy ({}){}, and used beside the joints", pose(noise.pose), of(poses))
                }
                (false, true) => {
                    format!("tip poses are noisy ({}){}: they are estimated (eq. 9)", pose(noise.pose), of(poses))
                }
                (false, false) => format!("tip poses are exact{} (eq. 9 in the limit)", of(poses)),
            });
        }
        if !self.chain && pose_actions > 0 {
            let from = if poses == 0 { "; the tip's frame is the world's in the first sample" } else { "" };
            words.push(if noise.pose_action.is_noisy() {
                format!("pose actions are noisy ({}): tip poses are estimated (eq. 13){from}", pose(noise.pose_action))
            } else {
                format!("pose actions are executed exactly{from}")
            });
        }
        if self.unused_targets > 0 {
            words.push(format!(
                "the {} poses of targets are not used: where joints and pixels were recorded, the pixels say more; leave out the \
                 pixels to learn from targets",
                self.unused_targets
            ));
        }
        let unknown = self.starts.iter().filter(|start| start.is_none()).count();
        if unknown > 0 {
            words.push(format!("the states of {unknown} samples are known from their images alone"));
        }
        words
    }
}

/// What is fixed to a link needs a chain.
fn check_poses(rig: &Rig) -> Result<(), Error> {
    let on_link = |parent: Parent| matches!(parent, Parent::Link(_));
    let camera = rig.cameras.iter().find(|camera| on_link(camera.parent)).map(|camera| &camera.name);
    let feature = rig.features.iter().find(|feature| on_link(feature.parent)).map(|feature| &feature.name);
    match camera.or(feature) {
        Some(name) => Err(Error::Unusable(format!(
            "`{name}` is fixed to a link, but the recording has tip poses and no joints: nothing tells where the link is"
        ))),
        None => Ok(()),
    }
}

/// Fills in states from actions, forwards and then backwards, and marks as exact what exact actions make of exact states.
/// Where nothing was read, the first state from which an action leads is `first`, exactly.
fn follow<S, A>(
    mut starts: Vec<Option<S>>,
    actions: &[Option<A>],
    exact: &mut [bool],
    actions_are_exact: bool,
    first: S,
    next: impl Fn(&S, &A) -> S,
    previous: impl Fn(&S, &A) -> S,
) -> Vec<Option<S>> {
    if starts.iter().all(Option::is_none)
        && let Some(index) = actions.iter().position(Option::is_some)
    {
        starts[index] = Some(first);
        exact[index] = true;
    }
    let mut fill = |from: usize, to: usize, action: &A, go: &dyn Fn(&S, &A) -> S| {
        if let (None, Some(start)) = (&starts[to], &starts[from]) {
            starts[to] = Some(go(start, action));
            exact[to] = actions_are_exact && exact[from];
        }
    };
    for (state, action) in actions.iter().enumerate() {
        if let Some(action) = action {
            fill(state, state + 1, action, &next);
        }
    }
    for (state, action) in actions.iter().enumerate().rev() {
        if let Some(action) = action {
            fill(state + 1, state, action, &previous);
        }
    }
    starts
}
