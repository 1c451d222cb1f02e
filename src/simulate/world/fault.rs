//! Trackers that fail.
use super::sight::Report;
use crate::Error;
use crate::rig::{ModelCamera, Rig};

/// What goes wrong with a tracker, and when.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Index of the camera in the rig.
    pub camera: usize,
    /// Index of the feature in the rig.
    pub feature: usize,
    /// What.
    pub kind: FaultKind,
    /// When it begins [s].
    pub from: f64,
    /// When it ends [s]; infinite for good.
    pub until: f64,
}

/// How a tracker fails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FaultKind {
    /// Nothing is reported.
    Lost,
    /// What was reported last is reported again.
    Frozen,
    /// What is reported is off by this [px]; of a depth camera, its point too, at the same distance.
    Jumped([f64; 2]),
    /// What is reported moves away this fast [px/s], likewise.
    Drifting([f64; 2]),
}

impl Fault {
    /// That it is of a camera and a feature of the rig, and of numbers that may be.
    pub(super) fn check(&self, rig: &Rig) -> Result<(), Error> {
        let [cameras, features] = [rig.cameras.len(), rig.features.len()];
        let by = match self.kind {
            FaultKind::Lost | FaultKind::Frozen => [0.0; 2],
            FaultKind::Jumped(by) | FaultKind::Drifting(by) => by,
        };
        let is_known = self.camera < cameras && self.feature < features;
        let is_finite = self.from.is_finite() && !self.until.is_nan() && by.iter().all(|x| x.is_finite());
        if !is_known || !is_finite {
            return Err(Error::Unusable(format!(
                "{self:?}: is not of one of {cameras} cameras and {features} features, or not of finite numbers"
            )));
        }
        Ok(())
    }

    /// What the camera's tracker reports in place of what it would; `before`: what it reported last, if anything.
    pub(super) fn report(
        &self,
        camera: &ModelCamera,
        now: Report,
        before: Option<Report>,
        time: f64,
    ) -> Option<Report> {
        if !(self.from..self.until).contains(&time) {
            return Some(now);
        }
        let off = |by: [f64; 2], times: f64| {
            let by = by.map(|by| by * times);
            let add = |[u, v]: [f64; 2]| [u + by[0], v + by[1]];
            let seen_at = add(camera.model.project(&camera.intrinsics, &now.point));
            // Beyond what the lens shows there is no ray, and the point stays.
            let ray = camera.model.unproject(&camera.intrinsics, seen_at);
            let point = ray.map_or(now.point, |ray| now.point.norm() * ray);
            Some(Report { pixel: add(now.pixel), point })
        };
        match self.kind {
            FaultKind::Lost => None,
            FaultKind::Frozen => before.or(Some(now)),
            FaultKind::Jumped(by) => off(by, 1.0),
            FaultKind::Drifting(speed) => off(speed, time - self.from),
        }
    }
}
