//! The hand as a free body: errors, their slopes by its motion, and the placements where they vanish.
use crate::servo::image_tasks::drawn::mean;
use crate::servo::image_tasks::{Geometry, ImageTask, Place};
use handeye_solvers::manifold::{Variable, so3};
use handeye_solvers::scalar::{derivatives, seed};
use handeye_solvers::{Pose, Scalar};
use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};

/// A task with the hand's frame moved into its middle. A motion has six numbers: a rotation about that middle [rad], and its translation in
/// sizes of the hand.
pub(super) struct Problem<'a> {
    pub task: &'a ImageTask,
    pub geometry: Geometry,
    /// The middle in the hand's own frame [m].
    pub middle: Vector3<f64>,
    /// Size of the hand [m].
    pub size: f64,
    /// Where the target is, or what the first camera looks at [m].
    pub centre: Vector3<f64>,
    /// Largest error that counts as none, by row [px].
    pub tolerance: Vec<f64>,
    /// Slopes below this move nothing [px per unit of motion], beside those below a share of the largest.
    pub least_slope: f64,
}

/// Where a search ended.
#[derive(Clone, Debug)]
pub(super) struct Settled {
    pub pose: Pose,
    pub errors: Vec<f64>,
    /// True where it would go no further.
    pub is_still: bool,
}

/// What moves no error: the null space of the slopes.
pub(super) struct Null {
    pub rank: usize,
    /// 6 x (6 - rank), orthonormal.
    pub basis: DMatrix<f64>,
    /// The fixed direction that shows least, as a unit motion; `None` where nothing is fixed.
    pub weakest: Option<Vector6<f64>>,
}

/// Exact geometry: errors above this are none [px].
pub(super) const EXACT: f64 = 1e-4;

/// Slopes below this share of the largest are rounding.
const RELATIVE: f64 = 1e-5;

impl<'a> Problem<'a> {
    pub fn new(task: &'a ImageTask, geometry: &Geometry) -> Self {
        let mut geometry = geometry.clone();
        let of = |on_hand: bool| -> Vec<Vector3<f64>> {
            let pairs = task.features().iter().zip(&geometry.points);
            let is_there = |place: &Place| match place {
                Place::Hand(_) => on_hand,
                Place::Target(_) => !on_hand,
                Place::Image(_) => false,
            };
            pairs.filter(|(feature, _)| is_there(&feature.place)).map(|(_, point)| *point).collect()
        };
        let (on_hand, on_target) = (of(true), of(false));
        let carried: Vec<Vector3<f64>> =
            geometry.cameras.iter().filter(|view| view.on_hand).map(|view| view.pose.translation).collect();
        let middle = mean(&on_hand).or_else(|| mean(&carried)).unwrap_or_default();
        let radius = |points: &[Vector3<f64>]| {
            let middle = mean(points).unwrap_or_default();
            points.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max)
        };
        let sizes = [radius(&on_hand), radius(&on_target)];
        let size = sizes.into_iter().find(|size| *size > 1e-9).unwrap_or(0.1);
        let largest = sizes.into_iter().fold(size, f64::max);
        let ahead = |pose: &Pose| pose.translation + pose.rotation.column(2) * 8.0 * largest;
        let first = geometry.cameras.iter().find(|view| !view.on_hand).map(|view| ahead(&view.pose));
        let centre = mean(&on_target).or(first).unwrap_or_default();
        for (feature, point) in task.features().iter().zip(&mut geometry.points) {
            if matches!(feature.place, Place::Hand(_)) {
                *point -= middle;
            }
        }
        for view in geometry.cameras.iter_mut().filter(|view| view.on_hand) {
            view.pose.translation -= middle;
        }
        let tolerance = vec![EXACT; task.rows()];
        Problem { task, geometry, middle, size, centre, tolerance, least_slope: 0.0 }
    }

    /// The pose of the hand's own frame.
    pub fn world_from_hand(&self, pose: &Pose) -> Pose {
        Pose { rotation: pose.rotation, translation: pose.translation - pose.rotation * self.middle }
    }

    /// Where a feature is in the world [m]; `None` of one on the image.
    pub fn in_world(&self, feature: usize, pose: &Pose) -> Option<Vector3<f64>> {
        let point = self.geometry.points[feature];
        match self.task.features()[feature].place {
            Place::Hand(_) => Some(pose.transform(&point)),
            Place::Target(_) => Some(point),
            Place::Image(_) => None,
        }
    }

    pub fn moved(&self, pose: &Pose, motion: &Vector6<f64>) -> Pose {
        let turn = so3::exp(&motion.fixed_rows::<3>(0).into_owned());
        let translation = pose.translation + self.size * motion.fixed_rows::<3>(3);
        Pose { rotation: so3::renormalize(&(turn * pose.rotation)), translation }
    }

    /// The motion from one pose to another.
    pub fn difference(&self, from: &Pose, to: &Pose) -> Vector6<f64> {
        let turn = so3::log(&(to.rotation * from.rotation.transpose()));
        let shift = (to.translation - from.translation) / self.size;
        Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
    }

    /// Errors and their slopes by a motion.
    pub fn linearize(&self, pose: &Pose) -> (Vec<f64>, DMatrix<f64>) {
        let mut stored = [0.0; 12];
        pose.write_stored(&mut stored);
        let moving = Pose::seed(&stored, |i| seed::<6>(0.0, i) * if i < 3 { 1.0 } else { self.size });
        let errors = self.geometry.errors(self.task, &moving);
        let rows: Vec<[f64; 6]> = errors.iter().map(derivatives).collect();
        (errors.iter().map(Scalar::value).collect(), DMatrix::from_fn(rows.len(), 6, |i, k| rows[i][k]))
    }

    /// Levenberg's steps from a pose to where the squared errors have a minimum; `None` where they are not defined.
    pub fn settle(&self, start: &Pose, iterations: usize) -> Option<Settled> {
        let (mut errors, mut slopes) = self.linearize(start);
        let cost = |errors: &[f64]| errors.iter().map(|error| error * error).sum::<f64>();
        let mut pose = *start;
        let mut best = cost(&errors);
        if !best.is_finite() {
            return None;
        }
        let (mut damping, mut is_still) = (1e-3, false);
        for _ in 0..iterations {
            let hessian: Matrix6<f64> = (slopes.transpose() * &slopes).fixed_view::<6, 6>(0, 0).into_owned();
            let gradient = slopes.transpose() * DVector::from_column_slice(&errors);
            let gradient: Vector6<f64> = gradient.fixed_rows::<6>(0).into_owned();
            let largest = hessian.diagonal().max().max(f64::MIN_POSITIVE);
            let damped = hessian + Matrix6::identity() * (damping * largest);
            let Some(factor) = damped.cholesky() else {
                damping *= 10.0;
                continue;
            };
            let motion = -factor.solve(&gradient);
            if motion.norm() < 1e-13 {
                is_still = true;
                break;
            }
            let next = self.moved(&pose, &motion);
            let (tried, tried_slopes) = self.linearize(&next);
            let after = cost(&tried);
            if after < best {
                let small = best - after < 1e-10 * best || after < 1e-26;
                (pose, errors, slopes, best) = (next, tried, tried_slopes, after);
                damping = (0.1 * damping).max(1e-12);
                if small {
                    is_still = true;
                    break;
                }
            } else if damping > 1e6 {
                is_still = true;
                break;
            } else {
                damping *= 10.0;
            }
        }
        Some(Settled { pose, errors, is_still })
    }

    /// True where errors count as none, everything is in view and the hand is near the target.
    pub fn is_solved(&self, settled: &Settled) -> bool {
        let is_small = settled.errors.iter().zip(&self.tolerance).all(|(error, most)| error.abs() <= *most);
        is_small && self.is_in_view(&settled.pose)
    }

    pub fn is_in_view(&self, pose: &Pose) -> bool {
        let is_near = |point: &Vector3<f64>| (point - pose.translation).norm() < FAR * self.reach();
        is_near(&self.centre) && self.geometry.is_visible(self.task, pose)
    }

    /// Distance of the farthest camera from the target [m], or the size of what there is.
    fn reach(&self) -> f64 {
        let fixed = self.geometry.cameras.iter().filter(|view| !view.on_hand);
        fixed.map(|view| (view.pose.translation - self.centre).norm()).fold(8.0 * self.size, f64::max)
    }

    pub fn null(&self, pose: &Pose) -> Null {
        let (_, slopes) = self.linearize(pose);
        let (values, vectors) = {
            let eigen = (slopes.transpose() * &slopes).symmetric_eigen();
            (eigen.eigenvalues.map(|value| value.max(0.0).sqrt()), eigen.eigenvectors)
        };
        let least = self.least_slope.max(RELATIVE * values.max());
        let is_free = |k: &usize| values[*k].is_nan() || values[*k] <= least;
        let free: Vec<usize> = (0..6).filter(is_free).collect();
        let fixed = (0..6).filter(|k| !is_free(k)).min_by(|a, b| values[*a].total_cmp(&values[*b]));
        Null {
            rank: 6 - free.len(),
            basis: DMatrix::from_fn(6, free.len(), |i, k| vectors[(i, free[k])]),
            weakest: fixed.map(|k| vectors.fixed_view::<6, 1>(0, k).into_owned()),
        }
    }
}

/// A hand this many times as far from the target as the cameras is not there any more.
const FAR: f64 = 2.0;
