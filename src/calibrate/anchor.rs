//! Puts what the images showed, which is known up to a similarity, where the chain is.
use super::evaluate::median;
use super::graph::State;
use crate::geometry::robot_world;
use crate::rig::Parent;
use handeye_solvers::Pose;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// Seen poses P_t in terms of the chain's T_t: P_t = X T_t Y with X a similarity of space and Y fixed to the tip.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor {
    /// X: p ↦ scale · rotation · p + translation.
    pub scale: f64,
    pub world: Pose,
    /// Y, its translation in the chain's unit.
    pub tip: Pose,
}

/// Random subsets of samples that are tried, and their size.
const TRIALS: usize = 60;
const SUBSET: usize = 6;

impl Anchor {
    /// From seen tip poses and the chain's, of which up to a third may be wrong. `None` where the rotations share an axis.
    pub fn find(seen: &[Pose], chain: &[Pose], seed: u64) -> Option<Anchor> {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let all: Vec<usize> = (0..seen.len()).collect();
        let mut best: Option<(f64, Matrix3<f64>, Matrix3<f64>)> = None;
        for trial in 0..TRIALS {
            let subset: Vec<usize> = if trial == 0 {
                all.clone()
            } else {
                (0..SUBSET).map(|_| random.random_range(0..seen.len())).collect()
            };
            let pick = |poses: &[Pose]| subset.iter().map(|&i| poses[i]).collect::<Vec<_>>();
            let Some((tip, world)) = robot_world(&pick(seen), &pick(chain)) else { continue };
            let mut angles = angles(seen, chain, &world.rotation, &tip.rotation.transpose());
            let middle = median(&mut angles);
            if best.as_ref().is_none_or(|best| middle < best.0) {
                best = Some((middle, world.rotation, tip.rotation.transpose()));
            }
        }
        let (middle, world, tip) = best?;
        // Once more from all samples that agree.
        let angles = angles(seen, chain, &world, &tip);
        let near: Vec<usize> = all.into_iter().filter(|&i| angles[i] <= 3.0 * middle).collect();
        let pick = |poses: &[Pose]| near.iter().map(|&i| poses[i]).collect::<Vec<_>>();
        let (world, tip) = match robot_world(&pick(seen), &pick(chain)) {
            Some((tip, world)) => (world.rotation, tip.rotation.transpose()),
            None => (world, tip),
        };
        translations(&pick(seen), &pick(chain), world, tip)
    }

    /// Takes cameras, features and tips from where the images put them to where the chain has them.
    pub fn apply(&self, state: &mut State) {
        let in_world = |p: &Vector3<f64>| self.world.rotation.tr_mul(&(p - self.world.translation)) / self.scale;
        let in_tip = |p: &Vector3<f64>| self.tip.translation + self.tip.rotation * p / self.scale;
        let turned = self.world.rotation.transpose();
        for camera in &mut state.model.cameras {
            let pose = camera.pose;
            camera.pose = match camera.parent {
                Parent::World => Pose { rotation: turned * pose.rotation, translation: in_world(&pose.translation) },
                _ => Pose { rotation: self.tip.rotation * pose.rotation, translation: in_tip(&pose.translation) },
            };
        }
        for feature in &mut state.model.features {
            feature.xyz = if feature.parent == Parent::World { in_world(&feature.xyz) } else { in_tip(&feature.xyz) };
        }
        let from_tip = self.tip.inverse();
        for tip in &mut state.tips {
            let moved = Pose { rotation: turned * tip.rotation, translation: in_world(&tip.translation) };
            *tip = moved * from_tip;
        }
    }
}

/// Angles between R_P and R_X R_T R_Y.
fn angles(seen: &[Pose], chain: &[Pose], world: &Matrix3<f64>, tip: &Matrix3<f64>) -> Vec<f64> {
    let predicted = |chain: &Pose| Pose { rotation: world * chain.rotation * tip, translation: Vector3::zeros() };
    seen.iter().zip(chain).map(|(seen, chain)| predicted(chain).angle_to(seen)).collect()
}

/// t_P = s R_X t_T + R_X R_T u + x with u = s t_Y: linear in s, u and x; reweighted against wrong samples.
fn translations(seen: &[Pose], chain: &[Pose], world: Matrix3<f64>, tip: Matrix3<f64>) -> Option<Anchor> {
    let rows: Vec<SMatrix<f64, 3, 7>> = chain
        .iter()
        .map(|chain| {
            let mut row = SMatrix::<f64, 3, 7>::zeros();
            row.set_column(0, &(world * chain.translation));
            row.fixed_view_mut::<3, 3>(0, 1).copy_from(&(world * chain.rotation));
            row.fixed_view_mut::<3, 3>(0, 4).copy_from(&Matrix3::identity());
            row
        })
        .collect();
    let mut weights = vec![1.0; seen.len()];
    let mut x = SVector::<f64, 7>::zeros();
    for _ in 0..10 {
        let (mut h, mut b) = (SMatrix::<f64, 7, 7>::zeros(), SVector::<f64, 7>::zeros());
        for ((row, seen), &weight) in rows.iter().zip(seen).zip(&weights) {
            h += row.tr_mul(row) * weight;
            b += row.tr_mul(&seen.translation) * weight;
        }
        x = h.cholesky()?.solve(&b);
        let distances: Vec<f64> =
            rows.iter().zip(seen).map(|(row, seen)| (row * x - seen.translation).norm()).collect();
        let width = 2.0 * median(&mut distances.clone()) + 1e-12;
        weights = distances.iter().map(|distance| (width / distance).min(1.0)).collect();
    }
    let part = |k: usize| -> Vector3<f64> { x.fixed_rows::<3>(k).into_owned() };
    let scale = x[0];
    (scale > 0.0 && scale.is_finite()).then(|| Anchor {
        scale,
        world: Pose { rotation: world, translation: part(4) },
        tip: Pose { rotation: tip, translation: part(1) / scale },
    })
}
