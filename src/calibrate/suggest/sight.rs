//! What recording a joint position would tell: the detections it would give, as functions of the numbers of the rig.
use super::super::deviations::Honest;
use super::super::graph::State;
use super::super::numbers::{Numbers, Part};
use super::super::observation::Kind;
use super::super::outliers::Verdict;
use crate::chain::{ChainJacobian, JointKind};
use crate::factors::{Intrinsics, Reprojection};
use crate::reach::Views;
use crate::recording::Detection;
use crate::rig::Parent;
use handeye_solvers::{Factor, Pose};
use nalgebra::DMatrix;
use std::f64::consts::PI;

/// Where no joints are read, those of a position are known to a turn, or to this [m].
const SLIDE: f64 = 1.0;

/// Cameras, features and their noise, seen from the numbers of the rig.
pub(super) struct Sight<'a> {
    state: &'a State,
    numbers: &'a Numbers,
    views: &'a Views<'a>,
    /// Standard deviation of a pixel coordinate of each camera, larger where some detections are missed [px]; `None` where the
    /// camera moved, or gave points alone, and says nothing.
    sigmas: Vec<Option<f64>>,
    /// Standard deviation of each joint's reading [rad or m].
    joints: Vec<f64>,
}

impl<'a> Sight<'a> {
    /// `thinned`: share of the samples that the noise of the pixels was lowered to stand for.
    pub fn new(
        honest: &Honest<'_>,
        numbers: &'a Numbers,
        state: &'a State,
        verdict: &Verdict,
        views: &'a Views<'a>,
        thinned: f64,
    ) -> Self {
        let setup = &honest.setup;
        let are_read = setup.states.readings.iter().any(Option::is_some);
        let noise = setup.rig.noise.joints;
        let unread = |kind: &JointKind| if *kind == JointKind::Revolute { PI } else { SLIDE };
        let kinds = state.model.chain.kinds.iter();
        let joints = kinds.map(|kind| if are_read { noise } else { unread(kind) }).collect();
        let shares = shares_detected(honest, state, verdict, views);
        let sigmas = shares.into_iter().map(|share| Some(setup.sd(Kind::Pixels) / (thinned * share?).sqrt())).collect();
        Sight { state, numbers, views, sigmas, joints }
    }

    /// Detections that a position would give.
    pub fn detections(&self, joints: &[f64]) -> Vec<Detection> {
        let mut detections = self.views.detections(joints);
        detections.retain(|seen| self.sigmas[seen.camera as usize].is_some());
        detections
    }

    /// Derivatives of the detections of a position by the numbers, two rows for each, whitened. Where joints are noisy, those of the
    /// position are unknown too and marginalised: they add B D Bᵀ to the covariance of the pixels.
    pub fn rows(&self, joints: &[f64]) -> DMatrix<f64> {
        let model = &self.state.model;
        let detections = self.detections(joints);
        let links: Vec<Link> = (0..=joints.len()).map(|upto| self.link(upto, joints)).collect();
        let mut rows = DMatrix::zeros(2 * detections.len(), self.numbers.len);
        let mut by_joints = DMatrix::zeros(2 * detections.len(), joints.len());
        for (index, seen) in detections.iter().enumerate() {
            let (camera, feature) = (seen.camera as usize, seen.feature as usize);
            let (lens, point) = (&model.cameras[camera], &model.features[feature]);
            let link = |parent: Parent| match parent {
                Parent::World => None,
                Parent::Link(joint) => links.get(joint + 1),
                Parent::Tip => links.last(),
            };
            let (carrier, mount) = (link(point.parent), link(lens.parent));
            let pose = |link: Option<&Link>| link.map_or_else(Pose::identity, |link| link.pose);
            let on = (pose(carrier), point.xyz, pose(mount), lens.pose, Intrinsics::from(lens.intrinsics));
            let (_, blocks) = Reprojection { pixel: seen.pixel, model: lens.model }.linearize(&on);
            let weight = self.sigmas[camera].map_or(0.0, f64::recip);
            for row in 0..2 {
                let at = 2 * index + row;
                let mut add = |part, coordinate_of: &dyn Fn(usize) -> f64| {
                    for (k, column) in self.numbers.columns(part) {
                        rows[(at, column)] += weight * coordinate_of(k);
                    }
                };
                add(Part::Feature(feature), &|k| blocks[1][(row, k)]);
                add(Part::Camera(camera), &|k| blocks[3][(row, k)]);
                add(Part::Lens(camera), &|k| blocks[4][(row, k)]);
                for (block, link) in [(&blocks[0], carrier), (&blocks[2], mount)] {
                    let Some(Link { by, .. }) = link else { continue };
                    let through = |column: &[f64; 6]| (0..6).map(|i| block[(row, i)] * column[i]).sum::<f64>();
                    add(Part::Base, &|k| through(&by.base[k]));
                    add(Part::Chain, &|k| through(&by.parameters[k]));
                    for (k, column) in by.joints.iter().enumerate() {
                        by_joints[(at, k)] += weight * through(column);
                    }
                }
            }
        }
        self.marginalise(rows, by_joints)
    }

    fn marginalise(&self, rows: DMatrix<f64>, mut by_joints: DMatrix<f64>) -> DMatrix<f64> {
        if self.joints.iter().all(|sd| *sd == 0.0) {
            return rows;
        }
        by_joints.column_iter_mut().zip(&self.joints).for_each(|(mut column, sd)| column *= *sd);
        let mut covariance = &by_joints * by_joints.transpose();
        (0..covariance.nrows()).for_each(|i| covariance[(i, i)] += 1.0);
        let whitened = covariance.cholesky().and_then(|factor| factor.l().solve_lower_triangular(&rows));
        whitened.unwrap_or_else(|| DMatrix::zeros(0, rows.ncols()))
    }

    /// How the tip's position moves with the numbers: 3 rows [m].
    pub fn tip(&self, joints: &[f64]) -> DMatrix<f64> {
        let Link { by, .. } = self.link(joints.len(), joints);
        let mut rows = DMatrix::zeros(3, self.numbers.len);
        for (part, columns) in [(Part::Base, &by.base[..]), (Part::Chain, &by.parameters[..])] {
            for (k, column) in self.numbers.columns(part) {
                (0..3).for_each(|i| rows[(i, column)] = columns[k][3 + i]);
            }
        }
        rows
    }

    fn link(&self, upto: usize, joints: &[f64]) -> Link {
        let (model, mut by) = (&self.state.model, ChainJacobian::default());
        let pose = model.chain.linearize(&model.base, &model.parameters, joints, upto, &mut by);
        Link { pose, by }
    }
}

/// Where a link is, and how it moves.
struct Link {
    pose: Pose,
    by: ChainJacobian,
}

/// Share of what is in view that each camera detected in the recording; `None` of cameras that moved or gave no pixels.
fn shares_detected(honest: &Honest<'_>, state: &State, verdict: &Verdict, views: &Views<'_>) -> Vec<Option<f64>> {
    let mut in_view = vec![0_usize; verdict.moved.len()];
    for joints in state.joints.iter().zip(&state.placed).filter(|(_, placed)| **placed).map(|(joints, _)| joints) {
        views.detections(joints).iter().for_each(|seen| in_view[seen.camera as usize] += 1);
    }
    let mut detected = vec![0_usize; in_view.len()];
    let used = honest.setup.observations.iter().zip(&verdict.active).filter(|(_, active)| **active);
    used.filter(|(seen, _)| seen.kind() == Kind::Pixels).for_each(|(seen, _)| detected[seen.camera] += 1);
    let share = |(detected, in_view): (usize, usize)| (detected.max(1) as f64 / in_view.max(1) as f64).min(1.0);
    let shares = detected.into_iter().zip(in_view).map(share).zip(&verdict.moved).zip(&honest.setup.intrinsics);
    shares.map(|((share, moved), known)| (!moved && !known.unused).then_some(share)).collect()
}
