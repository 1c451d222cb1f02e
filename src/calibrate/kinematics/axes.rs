//! Directions of the joints' axes from rotations, by many random starts.
use crate::chain::JointKind;
use handeye_solvers::manifold::so3;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use rayon::prelude::*;

/// R(j) = exp(w₁ j₁) ⋯ exp(wₙ jₙ) R₀ over the revolute joints.
#[derive(Clone, Debug)]
pub(crate) struct Axes {
    /// Unit direction of every joint's axis in the world where all joints read 0; of prismatic joints, anything.
    pub directions: Vec<Vector3<f64>>,
    /// R₀.
    pub at_zero: Matrix3<f64>,
    /// Sum of ρ of the angles to the given rotations.
    pub cost: f64,
    /// Angle to each given rotation [rad].
    pub angles: Vec<f64>,
    /// The same at the random start, and iterations from there.
    pub first_angles: Vec<f64>,
    pub iterations: usize,
}

/// Random starts per wave, fixed so that the outcome does not depend on the number of threads; and waves at most.
const WAVE: usize = 32;
const WAVES: usize = 12;

/// Iterations of a start that is only looked at, and of one that is followed to the end.
const GLANCE: usize = 12;
const FOLLOW: usize = 60;

/// Starts of a wave that are followed to the end.
const PROMISING: usize = 4;

/// Finds the axes from rotations `rotations[t]` of the tip at `joints[t]`.
///
/// `sigma`: about how far a good rotation is off [rad]; angles far beyond it lose their pull, so that some readings may be
/// wrong. Stops as soon as half of the angles are within 3 `sigma`; otherwise returns the best of all starts.
pub(crate) fn find_axes(
    kinds: &[JointKind],
    joints: &[&[f64]],
    rotations: &[Matrix3<f64>],
    sigma: f64,
    seed: u64,
) -> Option<Axes> {
    let problem = Problem { kinds, joints, rotations };
    let mut best: Option<Axes> = None;
    for wave in 0..WAVES {
        let start = |k: usize| {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            rng.set_stream((wave * WAVE + k) as u64);
            problem.minimize(problem.random_start(&mut rng), 0.5, GLANCE)
        };
        let mut glances: Vec<Axes> = (0..WAVE).into_par_iter().map(start).collect();
        glances.sort_by(|a, b| a.cost.total_cmp(&b.cost));
        glances.truncate(PROMISING);
        let follow = |start: Axes| {
            let near = problem.minimize(start, 0.5, FOLLOW);
            problem.minimize(near, 3.0 * sigma, FOLLOW)
        };
        let followed: Vec<Axes> = glances.into_par_iter().map(follow).collect();
        for axes in followed {
            if best.as_ref().is_none_or(|best| axes.cost < best.cost) {
                best = Some(axes);
            }
        }
        let good = |axes: &Axes| {
            let mut angles = axes.angles.clone();
            crate::calibrate::evaluate::median(&mut angles) < 3.0 * sigma
        };
        if best.as_ref().is_some_and(good) {
            break;
        }
    }
    best
}

struct Problem<'a> {
    kinds: &'a [JointKind],
    joints: &'a [&'a [f64]],
    rotations: &'a [Matrix3<f64>],
}

impl Problem<'_> {
    /// Uniform directions, and an R₀ that fits the first sample.
    fn random_start(&self, rng: &mut ChaCha8Rng) -> Axes {
        let mut normal = || Vector3::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal)).normalize();
        let directions: Vec<Vector3<f64>> = self.kinds.iter().map(|_| normal()).collect();
        let turned = self.turn(&directions, self.joints[0]);
        Axes {
            directions,
            at_zero: turned.transpose() * self.rotations[0],
            cost: f64::INFINITY,
            angles: Vec::new(),
            first_angles: Vec::new(),
            iterations: 0,
        }
    }

    /// exp(w₁ j₁) ⋯ exp(wₙ jₙ).
    fn turn(&self, directions: &[Vector3<f64>], joints: &[f64]) -> Matrix3<f64> {
        let revolute =
            self.kinds.iter().zip(directions.iter().zip(joints)).filter(|(kind, _)| **kind == JointKind::Revolute);
        revolute.fold(Matrix3::identity(), |turned, (_, (direction, &joint))| turned * so3::exp(&(direction * joint)))
    }

    /// Levenberg-Marquardt on the angles under Cauchy's loss of this width [rad].
    fn minimize(&self, start: Axes, width: f64, iterations: usize) -> Axes {
        let n = 3 * self.kinds.len() + 3;
        let mut best = start;
        (best.cost, best.angles) = self.cost(&best, width);
        if best.first_angles.is_empty() {
            best.first_angles.clone_from(&best.angles);
        }
        let (mut h, mut b) = (DMatrix::zeros(n, n), DVector::zeros(n));
        self.linearize(&best, width, &mut h, &mut b);
        let mut lambda = 1e-3;
        for _ in 0..iterations {
            let mut damped = h.clone();
            for i in 0..n {
                damped[(i, i)] += lambda * h[(i, i)] + 1e-9;
            }
            let Some(factor) = damped.cholesky() else { break };
            let step = -factor.solve(&b);
            best.iterations += 1;
            let mut trial = best.clone();
            for (i, direction) in trial.directions.iter_mut().enumerate() {
                let w = step.fixed_rows::<3>(3 * i).into_owned();
                *direction = (so3::exp(&w) * *direction).normalize();
            }
            let w = step.fixed_rows::<3>(n - 3).into_owned();
            trial.at_zero = so3::renormalize(&(so3::exp(&w) * trial.at_zero));
            (trial.cost, trial.angles) = self.cost(&trial, width);
            if trial.cost < best.cost {
                let decrease = 1.0 - trial.cost / best.cost;
                best = trial;
                if decrease < 1e-6 {
                    break;
                }
                self.linearize(&best, width, &mut h, &mut b);
                lambda = (lambda * 0.2_f64).max(1e-9);
            } else {
                lambda *= 5.0;
                if lambda > 1e6 {
                    break;
                }
            }
        }
        best
    }

    fn cost(&self, axes: &Axes, width: f64) -> (f64, Vec<f64>) {
        let angle = |(joints, rotation): (&&[f64], &Matrix3<f64>)| {
            let predicted = self.turn(&axes.directions, joints) * axes.at_zero;
            so3::log(&(predicted * rotation.transpose())).norm()
        };
        let angles: Vec<f64> = self.joints.iter().zip(self.rotations).map(angle).collect();
        let cost = angles.iter().map(|angle| (angle / width).powi(2).ln_1p()).sum();
        (cost, angles)
    }

    /// Normal equations of r = log(R̂ Rᵀ). With E_i = exp(w_i j_i) and A = E₁ ⋯ E_{i-1}, turning axis i by δ turns R̂ on the
    /// left by A (I - E_i) δ; turning R₀ by δ does so by E₁ ⋯ E_n δ.
    fn linearize(&self, axes: &Axes, width: f64, h: &mut DMatrix<f64>, b: &mut DVector<f64>) {
        let n = self.kinds.len();
        h.fill(0.0);
        b.fill(0.0);
        let mut blocks = vec![Matrix3::zeros(); n + 1];
        for (joints, rotation) in self.joints.iter().zip(self.rotations) {
            let mut before = Matrix3::identity();
            for i in 0..n {
                blocks[i] = Matrix3::zeros();
                if self.kinds[i] == JointKind::Revolute {
                    let after = before * so3::exp(&(axes.directions[i] * joints[i]));
                    blocks[i] = before - after;
                    before = after;
                }
            }
            blocks[n] = before;
            let r = so3::log(&(before * axes.at_zero * rotation.transpose()));
            let weight = 1.0 / (width * width + r.norm_squared());
            let inverse = so3::left_jacobian_inverse(&r);
            for block in &mut blocks {
                *block = inverse * *block;
            }
            for (i, bi) in blocks.iter().enumerate() {
                let mut slot = b.fixed_rows_mut::<3>(3 * i);
                slot += bi.tr_mul(&r) * weight;
                for (j, bj) in blocks.iter().enumerate().take(i + 1) {
                    let mut slot = h.fixed_view_mut::<3, 3>(3 * i, 3 * j);
                    slot += bi.tr_mul(bj) * weight;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_of_random_arms_are_found_from_noisy_rotations() {
        for n in [4, 6, 7] {
            for (range, samples) in [(1.0, 30), (1.0, 50), (2.5, 50)] {
                let mut found = 0;
                for seed in 0..20 {
                    let mut rng = ChaCha8Rng::seed_from_u64(seed);
                    let mut normal = || Vector3::from_fn(|_, _| rng.sample::<f64, _>(StandardNormal));
                    let truth: Vec<Vector3<f64>> = (0..n).map(|_| normal().normalize()).collect();
                    let kinds = vec![JointKind::Revolute; n];
                    let joints: Vec<Vec<f64>> =
                        (0..samples).map(|_| (0..n).map(|_| rng.random_range(-range..range)).collect()).collect();
                    let joints: Vec<&[f64]> = joints.iter().map(Vec::as_slice).collect();
                    let empty = Problem { kinds: &kinds, joints: &joints, rotations: &[] };
                    let rotations: Vec<Matrix3<f64>> = joints
                        .iter()
                        .map(|joints| {
                            let noise = Vector3::from_fn(|_, _| 0.01 * rng.sample::<f64, _>(StandardNormal));
                            so3::exp(&noise) * empty.turn(&truth, joints)
                        })
                        .collect();
                    let axes = find_axes(&kinds, &joints, &rotations, 0.02, seed).expect("there are samples");
                    found += usize::from(axes.directions.iter().zip(&truth).all(|(a, b)| a.angle(b) < 0.1));
                }
                assert!(found >= 19, "{n} joints within ±{range}, {samples} samples: {found} of 20");
            }
        }
    }
}
