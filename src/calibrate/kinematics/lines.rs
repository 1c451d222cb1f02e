//! Where the joints' axes are, from translations: linear once their directions are known.
use super::Axes;
use crate::chain::JointKind;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// A chain as lines in space where all joints read 0.
#[derive(Clone, Debug)]
pub(crate) struct Lines {
    /// A point of each axis; of prismatic joints, the origin.
    pub points: Vec<Vector3<f64>>,
    /// Unit direction of each axis.
    pub directions: Vec<Vector3<f64>>,
    /// Pose of the tip where all joints read 0.
    pub at_zero: Pose,
    /// Length, in the unit of the translations, of a unit of a prismatic joint's reading; `None` without such a joint.
    pub unit: Option<f64>,
}

/// Solves for points on the axes from tip poses.
///
/// With A_i = exp(w₁ j₁) ⋯ exp(w_i j_i), a revolute joint i adds (A_{i-1} - A_i) q_i to the tip's position, a prismatic one
/// A_{i-1} v_i j_i, and the tip at zero A_n p₀: least squares in all q_i, v_i and p₀, reweighted (Huber) against wrong
/// samples. What the data leave open (q along its axis, and more for few samples) is kept small by a slight ridge.
pub(crate) fn find_lines(kinds: &[JointKind], axes: &Axes, joints: &[&[f64]], poses: &[Pose]) -> Option<Lines> {
    let n = 3 * kinds.len() + 3;
    let blocks: Vec<Vec<Matrix3<f64>>> = joints.iter().map(|joints| blocks(kinds, axes, joints)).collect();
    let mut weights = vec![1.0; poses.len()];
    let mut x = DVector::zeros(n);
    let mut distances = vec![0.0; poses.len()];
    for _ in 0..10 {
        let (mut h, mut b) = (DMatrix::<f64>::zeros(n, n), DVector::zeros(n));
        for ((blocks, pose), &weight) in blocks.iter().zip(poses).zip(&weights) {
            for (i, bi) in blocks.iter().enumerate() {
                let mut slot = b.fixed_rows_mut::<3>(3 * i);
                slot += bi.tr_mul(&pose.translation) * weight;
                for (j, bj) in blocks.iter().enumerate().take(i + 1) {
                    let mut slot = h.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    slot += bi.tr_mul(bj) * weight;
                }
            }
        }
        let ridge = 1e-6 * h.trace() / n as f64 + 1e-12;
        for i in 0..n {
            h[(i, i)] += ridge;
        }
        x = h.cholesky()?.solve(&b);
        for (distance, (blocks, pose)) in distances.iter_mut().zip(blocks.iter().zip(poses)) {
            let predicted: Vector3<f64> =
                blocks.iter().enumerate().map(|(i, block)| block * x.fixed_rows::<3>(3 * i)).sum();
            *distance = (predicted - pose.translation).norm();
        }
        let width = 2.0 * crate::calibrate::evaluate::median(&mut distances.clone()) + 1e-12;
        weights = distances.iter().map(|distance| (width / distance).min(1.0)).collect();
    }
    let part = |i: usize| -> Vector3<f64> { x.fixed_rows::<3>(3 * i).into_owned() };
    let prismatic = kinds.iter().enumerate().filter(|(_, kind)| **kind == JointKind::Prismatic);
    let lengths: Vec<f64> = prismatic.map(|(i, _)| part(i).norm()).collect();
    let unit = (!lengths.is_empty()).then(|| lengths.iter().sum::<f64>() / lengths.len() as f64);
    let (mut points, mut directions) = (Vec::new(), Vec::new());
    for (i, kind) in kinds.iter().enumerate() {
        match kind {
            JointKind::Revolute => {
                points.push(part(i));
                directions.push(axes.directions[i]);
            }
            JointKind::Prismatic => {
                points.push(Vector3::zeros());
                directions.push(part(i).try_normalize(1e-12)?);
            }
        }
    }
    let at_zero = Pose { rotation: axes.at_zero, translation: part(kinds.len()) };
    Some(Lines { points, directions, at_zero, unit })
}

/// What multiplies each q_i or v_i, and p₀, in the tip's position.
fn blocks(kinds: &[JointKind], axes: &Axes, joints: &[f64]) -> Vec<Matrix3<f64>> {
    let mut before = Matrix3::identity();
    let mut blocks = Vec::with_capacity(kinds.len() + 1);
    for (i, kind) in kinds.iter().enumerate() {
        match kind {
            JointKind::Prismatic => blocks.push(before * joints[i]),
            JointKind::Revolute => {
                let after = before * so3::exp(&(axes.directions[i] * joints[i]));
                blocks.push(before - after);
                before = after;
            }
        }
    }
    blocks.push(before);
    blocks
}
