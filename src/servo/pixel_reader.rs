//! From pixels to one answer where there may be several: the one near to where the arm is expected.
use super::{Arm, Configuration};
use crate::Error;
use crate::infer::{Branch, InferOptions, Inference, InferredPose, Prior, Sighting};
use crate::rig::Rig;
use handeye_solvers::Pose;

/// Infers joints and tip poses for controllers.
pub(super) struct PixelReader {
    inference: Inference,
    /// Standard deviation of a pixel coordinate [px].
    pub sigma: f64,
}

/// An answer does not explain the pixels where they are e to this power less likely than by the best.
const UNLIKELY: f64 = 3.0;

/// Answers whose pixels differ from the target's by less than this more than the best are as near [px].
const AS_NEAR: f64 = 1e-3;

/// A rig that is off explains no pixels exactly, and its best branch may be a far one: joints that leave this many times the pixel
/// distances of the best are about as good.
const AS_GOOD: f64 = 2.0;

impl PixelReader {
    /// Of a complete rig.
    pub fn new(rig: &Rig) -> Result<Self, Error> {
        let inference = Inference::new(rig, InferOptions::default())?;
        Ok(PixelReader { inference, sigma: rig.noise.pixels.max(AS_NEAR) })
    }

    /// Of the joints that may explain what is seen, those nearest to some joints [rad or m].
    pub fn joints_seen(&mut self, seen: &[Sighting], near: &[f64]) -> Result<Branch, Error> {
        let plausible = self.plausible(seen, near)?;
        let nearest = plausible.into_iter().min_by(|a, b| away(a, near).total_cmp(&away(b, near)));
        nearest.ok_or_else(|| Error::NotEnoughData("no joints explain what was seen".to_owned()))
    }

    /// The same for an arm that noise may have put a little outside its limits, where no joints explain what is seen: those inside that come
    /// nearest to it.
    pub fn joints_seen_or_near(&mut self, seen: &[Sighting], near: &[f64]) -> Result<Branch, Error> {
        match self.joints_seen(seen, near) {
            Err(Error::NotEnoughData(why)) if !near.is_empty() => {
                let local = self.inference.joints_near(seen, &Prior::start(near))?;
                if local.open.is_empty() { Ok(local) } else { Err(Error::NotEnoughData(why)) }
            }
            found => found,
        }
    }

    /// The joints that come nearest to the pixels aimed at, also where they are out of reach; of those that come as near, the ones nearest
    /// to some joints [rad or m].
    pub fn joints_aimed_at(&mut self, goal: &[Sighting], near: &[f64]) -> Result<Branch, Error> {
        let plausible = match self.plausible(goal, near) {
            // Out of reach: as near as the limits allow from here.
            Err(Error::NotEnoughData(_)) => return self.inference.joints_near(goal, &Prior::start(near)),
            found => found?,
        };
        let least = plausible.iter().map(|branch| branch.rms_px).fold(f64::INFINITY, f64::min);
        let as_near = plausible.into_iter().filter(|branch| branch.rms_px <= least + AS_NEAR);
        let best = as_near.min_by(|a, b| away(a, near).total_cmp(&away(b, near)));
        best.ok_or_else(|| Error::NotEnoughData("no joints lead to the pixels that are aimed at".to_owned()))
    }

    /// The same for a rig that may be off: also the joints that the pixels lead to from where the arm is, where they are nearer and about as
    /// good.
    pub fn joints_on_the_way(&mut self, goal: &[Sighting], from: &[f64]) -> Result<Vec<f64>, Error> {
        let best = self.joints_aimed_at(goal, from)?;
        let local = self.inference.joints_near(goal, &Prior::start(from)).ok();
        let is_better =
            |local: &Branch| local.rms_px <= AS_GOOD * best.rms_px + AS_NEAR && away(local, from) < away(&best, from);
        Ok(local.filter(is_better).unwrap_or(best).joints)
    }

    /// Brings a configuration to the present joints: as they are read, or, to `infer`, from what is seen near the readings; where that does
    /// not determine them, to the readings all the same. Readings may be empty where joints are inferred.
    pub fn configure(
        &mut self,
        arm: &Arm,
        seen: &[Sighting],
        (read, infer): (&[f64], bool),
        at: &mut Configuration,
    ) -> Result<(), Error> {
        if !(infer && read.is_empty()) {
            arm.check(read)?;
        }
        match if infer { self.joints_seen(seen, read).map(Some) } else { Ok(None) } {
            Ok(Some(found)) => arm.configure(&found.joints, at),
            Err(error) if read.is_empty() || error.is_input() => return Err(error),
            _ => arm.configure(read, at),
        }
        Ok(())
    }

    /// Of the tip's poses in the world that may explain pixels, the one nearest to another; `None` where they leave it open.
    pub fn tip(&self, sightings: &[Sighting], near: &Pose) -> Option<Pose> {
        let all = self.inference.poses(sightings);
        let least = all.iter().map(|pose| self.misfit(sightings, pose.rms_px)).fold(f64::INFINITY, f64::min);
        let likely = |pose: &InferredPose| self.misfit(sightings, pose.rms_px) <= least + UNLIKELY;
        let poses = all.into_iter().filter(likely).map(|inferred| inferred.pose);
        // Two poses of points in a plane differ by a turn.
        poses.min_by(|a, b| a.angle_to(near).total_cmp(&b.angle_to(near)))
    }

    fn plausible(&mut self, seen: &[Sighting], near: &[f64]) -> Result<Vec<Branch>, Error> {
        let mut all = self.inference.joints(seen, &Prior::start(near))?;
        // By the pixels alone: that more joints near by explain them as well, as at a singularity, does not make a branch better.
        let least = all.iter().map(|branch| self.misfit(seen, branch.rms_px)).fold(f64::INFINITY, f64::min);
        all.retain(|branch| self.misfit(seen, branch.rms_px) <= least + UNLIKELY);
        Ok(all)
    }

    /// Half the sum of the squared pixel distances over their variance.
    fn misfit(&self, sightings: &[Sighting], rms_px: f64) -> f64 {
        0.5 * sightings.len() as f64 * (rms_px / self.sigma).powi(2)
    }
}

/// Squared distance of a branch's joints from others.
fn away(branch: &Branch, near: &[f64]) -> f64 {
    branch.joints.iter().zip(near).map(|(joint, near)| (joint - near).powi(2)).sum()
}
