//! Joints from pixels and points: every branch that explains them, with covariance and probability.
use super::branch::{Branch, Minimum, branches};
use super::inverse::{InverseKinematics, InverseOptions};
use super::joint_box::JointBox;
use super::pixel_error::PixelError;
use super::pose::{InferredPose, is_plausible, poses};
use super::prior::Prior;
use super::sighting::{Sd, Sightings, Telling};
use super::views::Views;
use crate::Error;
use crate::chain::JointChain;
use crate::rig::{Model, Rig};

/// How joints are inferred.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InferOptions {
    /// Starts of the inverse kinematics at most; fewer where all branches are likely to be found.
    pub starts: usize,
    /// Starts that are refined in pixels where the pixels give no pose of the tip, or one that does not explain them.
    pub pixel_starts: usize,
    /// Shifts the starts: the same seed gives the same result.
    pub seed: u64,
}

impl Default for InferOptions {
    fn default() -> Self {
        InferOptions { starts: 60, pixel_starts: 60, seed: 1 }
    }
}

/// Infers poses and joints of a known rig from pixels and points; prepared once.
///
/// Joints are found by least squares over all cameras and features, starting from the inverse kinematics of the tip's pose, which is
/// found from all cameras in one problem. Detections count by the rig's `noise.pixels`, points of depth cameras by its
/// `noise.points`, wrong ones in proportion to their distance
/// only (Huber).
#[derive(Clone, Debug)]
pub struct Inference {
    pub(super) options: InferOptions,
    pub(super) chain: JointChain,
    pub(super) views: Views,
    pub(super) limits: JointBox,
    pub(super) sd: Sd,
    pub(super) action_sd: f64,
    inverse: InverseKinematics,
    pub(super) error: PixelError,
    pub(super) trial: Vec<f64>,
}

/// The inverse kinematics stops within this many standard deviations of the pose: refining in pixels does the rest.
const TOLERANCE: f64 = 5.0;

impl Inference {
    /// Of a complete rig.
    ///
    /// Errors: [`Error::Unusable`] with the paths of what is missing, or where the rig has no joints.
    pub fn new(rig: &Rig, options: InferOptions) -> Result<Self, Error> {
        let model = Model::new(rig)?;
        let inverse = InverseOptions { starts: options.starts, seed: options.seed, ..InverseOptions::default() };
        Ok(Inference {
            options,
            chain: model.joint_chain(),
            views: Views::new(&model),
            limits: JointBox::new(rig),
            action_sd: rig.noise.joint_action,
            sd: Sd::of(rig),
            inverse: InverseKinematics::new(rig, inverse)?,
            error: PixelError::default(),
            trial: Vec::new(),
        })
    }

    /// Poses of the tip, most probable first; empty where the sightings leave it open.
    ///
    /// From features on the tip seen by cameras in the world, and features in the world seen by cameras on the tip. Points in a plane
    /// before one camera often have two poses.
    pub fn poses<'a>(&self, sightings: impl Into<Sightings<'a>>) -> Vec<InferredPose> {
        poses(&self.views, &self.views.known(sightings.into(), self.sd), self.chain.len())
    }

    /// The joints' branches that explain the sightings, most probable first: never empty.
    ///
    /// Where the sightings leave directions open ([`Branch::open`]), the joints stay there where the prior has them. With a prior
    /// whose deviations are finite, branches are weighed by it too.
    ///
    /// Errors: [`Error::NotEnoughData`] where nothing that any joint moves was seen and there is no prior; [`Error::Unusable`] where
    /// the prior is not of this rig.
    pub fn joints<'a>(&mut self, sightings: impl Into<Sightings<'a>>, prior: &Prior) -> Result<Vec<Branch>, Error> {
        prior.check(self.chain.len())?;
        let seen = self.telling(sightings.into(), prior)?;
        let information = prior.information(&self.limits);
        let mut minima: Vec<Minimum> = Vec::new();
        if prior.is_given() {
            self.add(&mut minima, &seen, &information, prior, prior.mean.clone());
        }
        for pose in poses(&self.views, &seen, self.chain.len()) {
            let sd = pose.covariance.diagonal().map(f64::sqrt);
            let tolerance = (TOLERANCE * sd.fixed_rows::<3>(3).norm(), TOLERANCE * sd.fixed_rows::<3>(0).norm());
            for reached in self.inverse.likely_branches(&pose.pose, &information.mean, tolerance) {
                self.add(&mut minima, &seen, &information, prior, reached.joints);
            }
        }
        let freedom = seen.coordinates() - self.chain.len() as f64;
        if !minima.iter().any(|minimum| is_plausible(minimum.seen, freedom)) {
            self.search(&mut minima, &seen, &information, prior);
        }
        if minima.is_empty() {
            return Err(Error::NotEnoughData("no joints inside the limits come near to what was seen".to_owned()));
        }
        Ok(branches(minima, &seen))
    }

    /// The joints near a start: one local search, for tracking. From a start that is near, some ten times faster than
    /// [`Inference::joints`].
    ///
    /// Errors: as [`Inference::joints`]; [`Error::Unusable`] where the prior has no mean.
    pub fn joints_near<'a>(&mut self, sightings: impl Into<Sightings<'a>>, prior: &Prior) -> Result<Branch, Error> {
        prior.check(self.chain.len())?;
        if !prior.is_given() {
            return Err(Error::Unusable("a local search needs joints to begin with".to_owned()));
        }
        let seen = self.telling(sightings.into(), prior)?;
        let information = prior.information(&self.limits);
        let minimum = self.refine(&seen, &information, prior, prior.mean.clone(), false);
        let minimum =
            minimum.ok_or_else(|| Error::NotEnoughData("the search from this start broke down".to_owned()))?;
        branches(vec![minimum], &seen)
            .pop()
            .ok_or_else(|| Error::NotEnoughData("the search from this start broke down".to_owned()))
    }

    /// Those that some joint moves.
    pub(super) fn moved(&self, sightings: Sightings<'_>) -> Telling {
        let mut seen = self.views.known(sightings, self.sd);
        let moves = |camera: usize, feature: usize| {
            let (from, to) = self.views.between(camera, feature);
            from < to
        };
        seen.pixels.retain(|sighting| moves(sighting.camera, sighting.feature));
        seen.points.retain(|sighting| moves(sighting.camera, sighting.feature));
        seen
    }

    /// The same; fails where there is none, and nothing else is known.
    fn telling(&self, sightings: Sightings<'_>, prior: &Prior) -> Result<Telling, Error> {
        let seen = self.moved(sightings);
        if seen.is_empty() && !prior.is_given() {
            return Err(Error::NotEnoughData(
                "nothing that the joints move was seen: no detection of a feature and a camera of the rig that a joint is between"
                    .to_owned(),
            ));
        }
        Ok(seen)
    }
}
