//! The pose of the tip from the pixels and points of all cameras, in one problem.
use super::pixel_error::huber;
use super::sighting::Telling;
use super::views::Views;
use crate::geometry::{align, pose_from_rays, poses_from_rays};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3x6, Matrix6, Vector3, Vector6};

/// A pose of the tip that explains what was seen.
#[derive(Clone, Debug, PartialEq)]
pub struct InferredPose {
    /// `world_from_tip`.
    pub pose: Pose,
    /// Covariance of its error: of the rotation vector [rad], then of the translation [m], both along the world's axes. What the
    /// rig itself is off by is not in it.
    pub covariance: Matrix6<f64>,
    /// Root mean square of the pixel distances that are left [px]; 0 without pixels.
    pub rms_px: f64,
    /// Root mean square of the distances of points that are left [m]; 0 without points.
    pub rms_points_m: f64,
    /// How probable it is among those that were found.
    pub probability: f64,
}

/// Most Levenberg-Marquardt iterations; 3 to 6 are the rule.
const ITERATIONS: usize = 25;

/// Relative decrease of the cost at which refining stops: the cost is then within a millionth of a standard deviation.
const CONVERGED: f64 = 1e-10;

/// Expected decrease of the cost at which a last step is taken unseen: it is shorter than 1e-5 standard deviations.
const ARRIVED: f64 = 1e-10;

/// Poses with costs this far above the least are not worth mentioning: their probability is under 1e-8.
const HOPELESS: f64 = 20.0;

/// Adds a pose, or, of two that are the same, keeps the better.
fn add(found: &mut Vec<(Pose, Normal)>, refined: (Pose, Normal)) {
    match found.iter_mut().find(|(other, _)| other.angle_to(&refined.0) <= SAME) {
        Some(same) if refined.1.cost < same.1.cost => *same = refined,
        Some(_) => {}
        None => found.push(refined),
    }
}

/// Two poses whose rotations differ by less [rad] are one.
const SAME: f64 = 1e-3;

/// Least ratio of the extreme eigenvalues of the scaled normal equations at which the pose counts as determined.
const DETERMINED: f64 = 1e-12;

/// Poses of the tip, most probable first; empty where the sightings leave it open.
///
/// Sightings of features on the tip by cameras in the world count, and of features in the world by cameras on the tip.
/// `n_joints`: joints that move the tip.
pub(super) fn poses(views: &Views, seen: &Telling, n_joints: usize) -> Vec<InferredPose> {
    let is_whole = |camera: usize, feature: usize| views.between(camera, feature) == (0, n_joints);
    let mut used = seen.clone();
    used.pixels.retain(|sighting| is_whole(sighting.camera, sighting.feature));
    used.points.retain(|sighting| is_whole(sighting.camera, sighting.feature));
    let group = Group::larger(views, &used);
    let problem = Problem { views, seen: &used };
    let mut found: Vec<(Pose, Normal)> = Vec::new();
    found.extend(align(&group.of_points, &group.measured).and_then(|start| problem.refine(&group.tip(&start))));
    let several = group.origins.iter().any(|origin| (origin - group.origins[0]).norm_squared() > 0.0);
    if several
        && found.first().is_none_or(|(_, normal)| !problem.is_plausible(normal))
        && let Some(start) = pose_from_rays(&group.points, &group.origins, &group.directions)
        && let Some(refined) = problem.refine(&group.tip(&start))
    {
        add(&mut found, refined);
    }
    if !found.iter().any(|(_, normal)| problem.is_plausible(normal)) {
        for start in poses_from_rays(&group.points, &group.origins, &group.directions) {
            if let Some(refined) = problem.refine(&group.tip(&start)) {
                add(&mut found, refined);
            }
        }
    }
    found.sort_by(|a, b| a.1.cost.total_cmp(&b.1.cost));
    let least = found.first().map_or(0.0, |(_, normal)| normal.cost);
    found.retain(|(_, normal)| normal.cost < least + HOPELESS);
    let inferred = |(pose, normal): &(Pose, Normal)| {
        let covariance = normal.covariance()?;
        let rms = |squares: f64, count: usize| (squares / count.max(1) as f64).sqrt();
        let (rms_px, rms_points_m) =
            (rms(normal.squares[0], used.pixels.len()), rms(normal.squares[1], used.points.len()));
        let probability = (least - normal.cost).exp() * covariance.determinant().max(0.0).sqrt();
        Some(InferredPose { pose: *pose, covariance, rms_px, rms_points_m, probability })
    };
    let mut inferred: Vec<InferredPose> = found.iter().filter_map(inferred).collect();
    let sum: f64 = inferred.iter().map(|one| one.probability).sum();
    inferred.iter_mut().for_each(|one| one.probability /= sum.max(f64::MIN_POSITIVE));
    inferred.sort_by(|a, b| b.probability.total_cmp(&a.probability));
    inferred
}

/// Sightings of one kind as points and rays: features on the tip and rays in the world, or features in the world and rays on the tip.
#[derive(Default)]
struct Group {
    on_tip: bool,
    points: Vec<Vector3<f64>>,
    origins: Vec<Vector3<f64>>,
    directions: Vec<Vector3<f64>>,
    /// Features of which depth cameras gave points, and where these are in the frame of the rays.
    of_points: Vec<Vector3<f64>>,
    measured: Vec<Vector3<f64>>,
}

impl Group {
    /// The kind that has more of them.
    fn larger(views: &Views, seen: &Telling) -> Group {
        let on_tip = |feature: usize| views.features[feature].depth > 0;
        let pixels = seen.pixels.iter().map(|sighting| sighting.feature);
        let features: Vec<usize> = pixels.chain(seen.points.iter().map(|sighting| sighting.feature)).collect();
        let count = features.iter().filter(|feature| on_tip(**feature)).count();
        let tips_are_more = 2 * count >= features.len();
        let mut group = Group { on_tip: tips_are_more, ..Group::default() };
        for sighting in seen.pixels.iter().filter(|sighting| on_tip(sighting.feature) == tips_are_more) {
            let camera = &views.cameras[sighting.camera];
            let Some(ray) = camera.model.unproject(&camera.intrinsics, sighting.pixel) else { continue };
            group.add_ray(views.features[sighting.feature].xyz, &camera.pose, &ray);
        }
        for sighting in seen.points.iter().filter(|sighting| on_tip(sighting.feature) == tips_are_more) {
            let (camera, feature) = (&views.cameras[sighting.camera], views.features[sighting.feature].xyz);
            let point = Vector3::from(sighting.point);
            group.of_points.push(feature);
            group.measured.push(camera.pose.transform(&point));
            if let Some(ray) = point.try_normalize(f64::MIN_POSITIVE) {
                group.add_ray(feature, &camera.pose, &ray);
            }
        }
        group
    }

    fn add_ray(&mut self, feature: Vector3<f64>, camera: &Pose, ray: &Vector3<f64>) {
        self.points.push(feature);
        self.origins.push(camera.translation);
        self.directions.push(camera.rotation * ray);
    }

    /// `world_from_tip` of a pose `rays_from_points`.
    fn tip(&self, rays_from_points: &Pose) -> Pose {
        if self.on_tip { *rays_from_points } else { rays_from_points.inverse() }
    }
}

struct Problem<'a> {
    views: &'a Views,
    seen: &'a Telling,
}

/// Normal equations in `Pose`'s own step, the rotation about the tip's origin.
struct Normal {
    hessian: Matrix6<f64>,
    gradient: Vector6<f64>,
    cost: f64,
    /// Sum of the squared distances of pixels [px²], and of points [m²].
    squares: [f64; 2],
}

impl Problem<'_> {
    fn look(&self, tip: &Pose) -> Normal {
        let mut normal = Normal { hessian: Matrix6::zeros(), gradient: Vector6::zeros(), cost: 0.0, squares: [0.0; 2] };
        let inverse = 1.0 / self.seen.sd.pixels;
        let mut mounted: Option<(usize, Pose)> = None;
        for sighting in &self.seen.pixels {
            let (camera, feature) = (&self.views.cameras[sighting.camera], &self.views.features[sighting.feature]);
            let world_from_camera = match mounted {
                Some((index, pose)) if index == sighting.camera => pose,
                _ if camera.depth > 0 => *tip * camera.pose,
                _ => camera.pose,
            };
            mounted = Some((sighting.camera, world_from_camera));
            let glance = self.views.glance(sighting, (feature.depth > 0).then_some(tip), &world_from_camera);
            let squared = glance.error[0] * glance.error[0] + glance.error[1] * glance.error[1];
            let (loss, weight) = huber(squared * inverse * inverse);
            normal.cost += loss;
            normal.squares[0] += squared;
            let sign = if feature.depth > 0 { 1.0 } else { -1.0 };
            let arm = glance.point - tip.translation;
            let scale = weight * inverse * inverse;
            for (row, error) in glance.rows.iter().zip(glance.error) {
                let turn = arm.cross(row);
                let column = Vector6::new(turn.x, turn.y, turn.z, row.x, row.y, row.z) * sign;
                let scaled = column * scale;
                normal.gradient -= scaled * error;
                normal.hessian += scaled * column.transpose();
            }
        }
        let inverse = 1.0 / self.seen.sd.points;
        for sighting in &self.seen.points {
            let (camera, feature) = (&self.views.cameras[sighting.camera], &self.views.features[sighting.feature]);
            let world_from_camera = if camera.depth > 0 { *tip * camera.pose } else { camera.pose };
            let frame = (feature.depth > 0).then_some(tip);
            let (error, point) = self.views.glance_at_point(sighting, frame, &world_from_camera);
            let (loss, weight) = huber(error.norm_squared() * inverse * inverse);
            normal.cost += loss;
            normal.squares[1] += error.norm_squared();
            let sign = if feature.depth > 0 { 1.0 } else { -1.0 };
            let mut columns = Matrix3x6::zeros();
            columns.fixed_columns_mut::<3>(0).copy_from(&(-(point - tip.translation).cross_matrix() * sign));
            columns.fixed_columns_mut::<3>(3).fill_diagonal(sign);
            let scaled = columns.transpose() * (weight * inverse * inverse);
            normal.gradient -= scaled * error;
            normal.hessian += scaled * columns;
        }
        normal
    }

    /// The pose that minimises the cost, from a start.
    fn refine(&self, start: &Pose) -> Option<(Pose, Normal)> {
        let (mut pose, mut normal, mut lambda) = (*start, self.look(start), 1e-6);
        for _ in 0..ITERATIONS {
            let mut damped = normal.hessian;
            (0..6).for_each(|k| damped[(k, k)] *= 1.0 + lambda);
            let step = damped.cholesky()?.solve(&normal.gradient);
            let next = Pose {
                rotation: so3::renormalize(&(so3::exp(&step.fixed_rows::<3>(0).into_owned()) * pose.rotation)),
                translation: pose.translation + step.fixed_rows::<3>(3),
            };
            if 0.5 * normal.gradient.dot(&step) < ARRIVED {
                pose = next;
                break;
            }
            let tried = self.look(&next);
            let change = normal.cost - tried.cost;
            if change > 0.0 {
                (pose, normal, lambda) = (next, tried, lambda * 0.1);
                if change < CONVERGED * (1.0 + normal.cost) {
                    break;
                }
            } else if change > -CONVERGED * (1.0 + normal.cost) || lambda > 1e6 {
                break;
            } else {
                lambda *= 10.0;
            }
        }
        Some((pose, normal))
    }

    fn is_plausible(&self, normal: &Normal) -> bool {
        is_plausible(normal.cost, self.seen.coordinates() - 6.0)
    }
}

/// False where residuals are so large that noise explains them in one case of a million: five standard deviations of χ², and what its
/// skewness adds for few degrees of freedom.
pub(super) fn is_plausible(cost: f64, freedom: f64) -> bool {
    let freedom = freedom.max(0.0);
    2.0 * cost < freedom + 5.0 * (2.0 * freedom).sqrt() + 15.0
}

impl Normal {
    /// `None` where the pose is not determined.
    fn covariance(&self) -> Option<Matrix6<f64>> {
        let scale = self.hessian.diagonal().map(|d| 1.0 / d.sqrt());
        let outer = scale * scale.transpose();
        let scaled = self.hessian.component_mul(&outer);
        let inverse = scaled.cholesky()?.inverse();
        // Both matrices have a trace of about 6 times the largest eigenvalue at most.
        let condition = scaled.trace() * inverse.trace();
        (condition < 1.0 / DETERMINED).then(|| inverse.component_mul(&outer))
    }
}
