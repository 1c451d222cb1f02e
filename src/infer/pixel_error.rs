//! How far pixels and points are from where joints put them, and the step of the joints that brings them nearer.
use super::box_step::BoxStep;
use super::information::Information;
use super::joint_box::JointBox;
use super::sighting::Telling;
use super::views::Views;
use crate::chain::{JointChain, Posture};
use handeye_solvers::Pose;
use nalgebra::{DMatrix, Vector3};

/// Whitened pixel distance from which a detection counts in proportion to its distance only (Huber): one in 90 lies further out by
/// chance, 3 σ on an axis.
pub(super) const HUBER: f64 = 3.0;

/// Cost, gradient and Gauss-Newton matrix of
///
///   Σ ρ(|predicted - seen|² / σ²) + ½ (q - mean)ᵀ W (q - mean),   ρ Huber's loss
///
/// by the joints; points likewise, in metres. Only joints between a camera and a feature move the pixel, all as if the feature moved and the camera stood still.
/// Kept between calls, so that none but the first allocates.
#[derive(Clone, Debug, Default)]
pub(super) struct PixelError {
    posture: Posture,
    cameras: Vec<Pose>,
    screws: Vec<(Vector3<f64>, Vector3<f64>)>,
    /// Of pixels and points alone, by rows; the lower triangle is filled.
    hessian: Vec<f64>,
    gradient: Vec<f64>,
    total: Vec<f64>,
    rows: [Vec<f64>; 2],
    columns: Vec<Vector3<f64>>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    program: BoxStep,
    /// Sum of the squared pixel distances [px²], and of those of points [m²].
    pub squares: [f64; 2],
    /// Cost of pixels and points alone.
    pub seen: f64,
}

impl PixelError {
    /// The cost with these joints.
    pub fn look(
        &mut self,
        (chain, views): (&JointChain, &Views),
        telling: &Telling,
        information: &Information,
        joints: &[f64],
    ) -> f64 {
        let n = joints.len();
        chain.posture(joints, &mut self.posture);
        self.cameras.clear();
        let links = &self.posture.links;
        let frame = |depth: usize| (depth > 0).then(|| &links[depth]);
        self.cameras
            .extend(views.cameras.iter().map(|view| frame(view.depth).map_or(view.pose, |link| *link * view.pose)));
        // Motion of the world's origin with each joint, so that a point p moves by w × p + m.
        self.screws.clear();
        self.screws.extend(self.posture.axes.iter().map(|axis| axis.twist(&Vector3::zeros())));
        self.hessian.clear();
        self.hessian.resize(n * n, 0.0);
        self.gradient.clear();
        self.gradient.resize(n, 0.0);
        (self.squares, self.seen) = ([0.0; 2], 0.0);
        for row in &mut self.rows {
            row.resize(n, 0.0);
        }
        self.columns.resize(n, Vector3::zeros());
        let inverse = 1.0 / telling.sd.pixels;
        for sighting in &telling.pixels {
            let depth = views.features[sighting.feature].depth;
            let glance = views.glance(sighting, frame(depth), &self.cameras[sighting.camera]);
            let squared = glance.error[0] * glance.error[0] + glance.error[1] * glance.error[1];
            self.squares[0] += squared;
            let (loss, weight) = huber(squared * inverse * inverse);
            self.seen += loss;
            let (from, to) = views.between(sighting.camera, sighting.feature);
            let scale = weight * inverse * inverse;
            let sign = if depth == to { 1.0 } else { -1.0 };
            let [first, second] = &mut self.rows;
            let [a, b] = glance.rows.map(|row| row * sign);
            let (turn_a, turn_b) = (glance.point.cross(&a), glance.point.cross(&b));
            for i in from..to {
                let (w, m) = &self.screws[i];
                first[i] = turn_a.dot(w) + a.dot(m);
                second[i] = turn_b.dot(w) + b.dot(m);
            }
            for i in from..to {
                let (a, b) = (scale * first[i], scale * second[i]);
                self.gradient[i] -= a * glance.error[0] + b * glance.error[1];
                let hessian = &mut self.hessian[i * n..i * n + i + 1];
                for j in from..=i {
                    hessian[j] += a * first[j] + b * second[j];
                }
            }
        }
        let inverse = 1.0 / telling.sd.points;
        for sighting in &telling.points {
            let depth = views.features[sighting.feature].depth;
            let (error, point) = views.glance_at_point(sighting, frame(depth), &self.cameras[sighting.camera]);
            self.squares[1] += error.norm_squared();
            let (loss, weight) = huber(error.norm_squared() * inverse * inverse);
            self.seen += loss;
            let (from, to) = views.between(sighting.camera, sighting.feature);
            let scale = weight * inverse * inverse;
            let sign = if depth == to { 1.0 } else { -1.0 };
            for i in from..to {
                let (w, m) = &self.screws[i];
                self.columns[i] = (w.cross(&point) + m) * sign;
            }
            for i in from..to {
                let column = self.columns[i] * scale;
                self.gradient[i] -= column.dot(&error);
                let row = self.hessian[i * n + from..=i * n + i].iter_mut();
                row.zip(&self.columns[from..=i]).for_each(|(entry, other)| *entry += column.dot(other));
            }
        }
        let mut cost = self.seen;
        self.total.clone_from(&self.hessian);
        for i in 0..n {
            let row = &information.matrix[i * n..(i + 1) * n];
            let pull: f64 = row.iter().zip(&information.mean).zip(joints).map(|((w, mean), q)| w * (mean - q)).sum();
            cost += 0.5 * pull * (information.mean[i] - joints[i]);
            self.gradient[i] += pull;
            self.total[i * n..=i * n + i].iter_mut().zip(row).for_each(|(h, w)| *h += w);
        }
        cost
    }

    /// The damped step from where [`PixelError::look`] was, inside the limits; `None` where it is not finite.
    pub fn step(&mut self, limits: &JointBox, joints: &[f64], lambda: f64) -> Option<&[f64]> {
        let n = joints.len();
        limits.rooms(joints, &mut self.lower, &mut self.upper);
        // In proportion to how well the joint is seen on its own.
        let mean = (0..n).map(|i| self.total[i * n + i]).sum::<f64>() / n.max(1) as f64;
        let solved = self.program.solve(&self.total, &self.gradient, lambda * mean, &self.lower, &self.upper);
        solved.then_some(&self.program.step)
    }

    /// How much of the cost the last step takes away, if all is as linear as it seems.
    pub fn expected_decrease(&self) -> f64 {
        0.5 * self.gradient.iter().zip(&self.program.step).map(|(g, s)| g * s).sum::<f64>()
    }

    /// Gauss-Newton matrix of pixels and points alone, where [`PixelError::look`] was.
    pub fn square(&self) -> DMatrix<f64> {
        let n = self.gradient.len();
        DMatrix::from_fn(n, n, |i, j| self.hessian[i.max(j) * n + i.min(j)])
    }

    /// Pose of the tip where [`PixelError::look`] was.
    pub fn tip(&self) -> Pose {
        self.posture.tip()
    }
}

/// Loss and weight of a squared whitened distance.
#[inline]
pub(super) fn huber(squared: f64) -> (f64, f64) {
    if squared <= HUBER * HUBER {
        (0.5 * squared, 1.0)
    } else {
        let distance = squared.sqrt();
        (HUBER * distance - 0.5 * HUBER * HUBER, HUBER / distance)
    }
}
