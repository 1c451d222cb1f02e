//! What the robot read when an image was taken: from the same sample, or smoothed from a stream of its own.
use crate::Error;
use crate::factors::{JointReadings, Polynomial, PoseReadings};
use crate::recording::{Recording, Sample};
use crate::rig::{Model, Rig};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{DMatrix, Vector3};

/// The robot's state at a sample with targets, as a polynomial of the clock's offset.
pub(super) struct Moment {
    /// Readings of the tip's pose, or that of the nominal chain.
    pub pose: PoseReadings,
    /// The offset that the readings were smoothed around [s].
    pub around: f64,
    /// Readings of the joints, where tips follow from them.
    pub joints: Option<JointReadings>,
}

/// The robot's samples, in order of time.
pub(super) struct Stream {
    /// True where tips follow from joints.
    pub by_joints: bool,
    /// True where samples with targets have no readings of their own.
    pub apart: bool,
    times: Vec<f64>,
    samples: Vec<usize>,
    poses: Vec<Pose>,
}

/// Readings this long before and after an image are smoothed together [s]: a robot's motion is a quadratic for as long.
const WINDOW: f64 = 0.04;

/// Fewest readings that a quadratic is laid through.
const FEWEST: usize = 4;

impl Stream {
    /// Where most samples with targets have readings of their own, these are used; otherwise times relate the two.
    pub fn new(rig: &Rig, recording: &Recording) -> Result<Stream, Error> {
        let chain = chain_of(rig);
        let by_joints = chain.is_some() && recording.samples.iter().any(|sample| sample.joints.is_some());
        let tip = |sample: &Sample| match &chain {
            Some(model) if by_joints => sample.joints.as_ref().map(|joints| model.tip(joints)),
            _ => sample.pose,
        };
        let with_targets = || recording.samples.iter().filter(|sample| !sample.targets.is_empty());
        let own = with_targets().filter(|sample| tip(sample).is_some()).count();
        let apart = 2 * own < with_targets().count();
        let (mut times, mut samples, mut poses) = (Vec::new(), Vec::new(), Vec::new());
        for (index, sample) in recording.samples.iter().enumerate() {
            if let Some(pose) = tip(sample)
                && (!apart || sample.time.is_some())
            {
                times.push(sample.time.unwrap_or(index as f64));
                samples.push(index);
                poses.push(pose);
            }
        }
        if samples.is_empty() {
            let why = if recording.samples.iter().any(|sample| sample.joints.is_some()) {
                "the samples have joints but no poses, and the rig does not give every row of [[robot.joints]]: give the nominal rows"
            } else {
                "no sample has the tip's pose or joints"
            };
            return Err(Error::NotEnoughData(why.into()));
        }
        if apart && times.len() < FEWEST {
            return Err(Error::NotEnoughData(
                "samples with targets have no pose, and too few others with a time have one".into(),
            ));
        }
        Ok(Stream { by_joints, apart, times, samples, poses })
    }

    /// The robot's own times and poses.
    pub fn trajectory(&self) -> (&[f64], &[Pose]) {
        (&self.times, &self.poses)
    }

    /// The robot's state at a sample; `None` where it has no readings, or its time is outside the stream's.
    pub fn moment(&self, recording: &Recording, index: usize, offset: f64) -> Option<Moment> {
        let joints_of = |sample: usize| recording.samples[sample].joints.as_deref().unwrap_or_default();
        if !self.apart {
            let place = self.samples.binary_search(&index).ok()?;
            let constant = |row: Vec<f64>| Polynomial { delay: 0.0, coefficients: vec![row] };
            let pose = PoseReadings { centre: self.poses[place], motion: constant(vec![0.0; 6]) };
            let joints = self.by_joints.then(|| JointReadings { joints: constant(joints_of(index).to_vec()) });
            return Some(Moment { pose, around: offset, joints });
        }
        let stamp = recording.samples[index].time?;
        let time = stamp - offset;
        let after = self.times.partition_point(|t| *t < time);
        if after == 0 || after == self.times.len() {
            return None;
        }
        let mut range =
            self.times.partition_point(|t| *t < time - WINDOW)..self.times.partition_point(|t| *t <= time + WINDOW);
        if range.len() < FEWEST {
            range = after.saturating_sub(FEWEST / 2)..(after + FEWEST / 2).min(self.times.len());
        }
        let middle = (range.start + range.end) / 2;
        let (origin, centre) = (self.times[middle], self.poses[middle]);
        let delays: Vec<f64> = range.clone().map(|k| self.times[k] - origin).collect();
        let steps = range.clone().map(|k| {
            let w = so3::log(&(centre.rotation.transpose() * self.poses[k].rotation));
            let v: Vector3<f64> = self.poses[k].translation - centre.translation;
            vec![w.x, w.y, w.z, v.x, v.y, v.z]
        });
        let polynomial = |rows: Vec<Vec<f64>>| {
            quadratic(&delays, &rows).map(|c| Polynomial { delay: stamp - origin, coefficients: c })
        };
        let motion = polynomial(steps.collect())?;
        let joints = match self.by_joints {
            true => Some(JointReadings {
                joints: polynomial(range.map(|k| joints_of(self.samples[k]).to_vec()).collect())?,
            }),
            false => None,
        };
        Some(Moment { pose: PoseReadings { centre, motion }, around: offset, joints })
    }
}

/// Coefficients of the quadratic nearest to these rows.
fn quadratic(delays: &[f64], rows: &[Vec<f64>]) -> Option<Vec<Vec<f64>>> {
    let powers = DMatrix::from_fn(delays.len(), 3, |i, k| delays[i].powi(k as i32));
    let values = DMatrix::from_fn(rows.len(), rows[0].len(), |i, k| rows[i][k]);
    // Times in units of the widest, so that the normal equations are well scaled.
    let width = delays.iter().fold(1e-9_f64, |most, delay| most.max(delay.abs()));
    let scaled = DMatrix::from_fn(delays.len(), 3, |i, k| powers[(i, k)] / width.powi(k as i32));
    let solution = (scaled.transpose() * &scaled).cholesky()?.solve(&(scaled.transpose() * values));
    Some((0..3).map(|k| solution.row(k).iter().map(|x| x / width.powi(k as i32)).collect()).collect())
}

/// The rig's chain, where it is known; nothing else of the model is.
pub(super) fn chain_of(rig: &Rig) -> Option<Model> {
    let arm = Rig { robot: rig.robot.clone(), ..Rig::default() };
    (!rig.robot.joints.is_empty()).then(|| Model::new(&arm).ok()).flatten()
}
