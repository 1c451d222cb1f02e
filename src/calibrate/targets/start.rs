//! Starting values in closed form: several ways, which must agree or the report says so.
use crate::geometry::{hand_eye_daniilidis, hand_eye_park, robot_world};
use handeye_solvers::Pose;
use nalgebra::{Matrix3, SMatrix, SVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A way to start, and what it gives: X and Z with a X = Z b, and the scale of b's translations.
#[derive(Clone, Copy)]
pub(super) struct Start {
    pub name: &'static str,
    pub x: Pose,
    pub z: Pose,
    pub scale: f64,
}

/// Random subsets of this many poses are tried, each with Shah's closed form, so that one consistent among wrong poses is met.
const SUBSETS: usize = 300;
const SUBSET: usize = 4;

/// Errors up to about this size pull [rad, m].
const TURN: f64 = 0.01;
const LENGTH: f64 = 0.005;

/// All starts for a X = Z b, the best first. `a`: `world_from_tip`, `b`: poses of the target's carrier in the camera or the other way
/// about; equal lengths, at least 3.
///
/// Each is given twice, with translations as they are and with their scale solved for.
pub(super) fn starts(a: &[Pose], b: &[Pose], seed: u64) -> Vec<Start> {
    let (motions_a, motions_b) = motions(a, b);
    let mut rotations: Vec<(&'static str, Matrix3<f64>)> = Vec::new();
    let mut direct = Vec::new();
    if let Some(x) = hand_eye_park(&motions_a, &motions_b) {
        rotations.push(("Park", x.rotation));
    }
    if let Some(x) = hand_eye_daniilidis(&motions_a, &motions_b) {
        rotations.push(("Daniilidis", x.rotation));
        direct.push(("Daniilidis", x));
    }
    if let Some((x, _)) = robot_world(a, b) {
        rotations.push(("Shah", x.rotation));
    }
    let mut found: Vec<Start> = rotations.iter().flat_map(|(name, r)| completed(name, r, a, b)).collect();
    for (name, x) in direct {
        found.extend(mean_z(&x, a, b).map(|z| Start { name, x, z, scale: 1.0 }));
    }
    found.extend(best_of_subsets(a, b, seed));
    if found.is_empty() {
        // Nothing turns about two axes: any frames will do, and priors decide.
        let x = Pose::identity();
        found.extend(mean_z(&x, a, b).map(|z| Start { name: "identity", x, z, scale: 1.0 }));
    }
    found.sort_by(|p, q| cost(p, a, b).total_cmp(&cost(q, a, b)));
    found
}

/// Motions to the first samples after a few steps each, so that they are large.
fn motions(a: &[Pose], b: &[Pose]) -> (Vec<Pose>, Vec<Pose>) {
    let n = a.len();
    let stride = n.div_ceil(200);
    let (mut of_a, mut of_b) = (Vec::new(), Vec::new());
    for gap in [1, 2, n / 3, n / 2].into_iter().filter(|gap| *gap > 0) {
        for i in (0..n - gap.min(n - 1)).step_by(stride) {
            of_a.push(a[i].inverse() * a[i + gap]);
            of_b.push(b[i].inverse() * b[i + gap]);
        }
    }
    (of_a, of_b)
}

fn best_of_subsets(a: &[Pose], b: &[Pose], seed: u64) -> Option<Start> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut best: Option<(f64, Start)> = None;
    for _ in 0..SUBSETS {
        let subset: [usize; SUBSET] = std::array::from_fn(|_| random.random_range(0..a.len()));
        let (few_a, few_b) = (subset.map(|i| a[i]), subset.map(|i| b[i]));
        let Some((x, _)) = robot_world(&few_a, &few_b) else { continue };
        for start in completed("Shah on a subset", &x.rotation, &few_a, &few_b) {
            let cost = cost(&start, a, b);
            if best.as_ref().is_none_or(|(least, _)| cost < *least) {
                best = Some((cost, start));
            }
        }
    }
    best.map(|(_, start)| start)
}

/// Rotation of Z and both translations for a rotation of X, with the scale of b's translations 1 and solved for.
fn completed(name: &'static str, r_x: &Matrix3<f64>, a: &[Pose], b: &[Pose]) -> Vec<Start> {
    let Some(z) = mean_z(&Pose { rotation: *r_x, translation: Vector3::zeros() }, a, b) else { return Vec::new() };
    [false, true].into_iter().filter_map(|scaled| translations(name, r_x, &z.rotation, a, b, scaled)).collect()
}

/// R_a t_x - t_z - λ R_z t_b = -t_a, linear in t_x, t_z and λ = 1/scale.
fn translations(
    name: &'static str,
    r_x: &Matrix3<f64>,
    r_z: &Matrix3<f64>,
    a: &[Pose],
    b: &[Pose],
    scaled: bool,
) -> Option<Start> {
    let (mut hessian, mut vector) = (SMatrix::<f64, 7, 7>::zeros(), SVector::<f64, 7>::zeros());
    for (a, b) in a.iter().zip(b) {
        let seen = r_z * b.translation;
        let mut rows = SMatrix::<f64, 3, 7>::zeros();
        rows.fixed_view_mut::<3, 3>(0, 0).copy_from(&a.rotation);
        rows.fixed_view_mut::<3, 3>(0, 3).copy_from(&-Matrix3::identity());
        let known = if scaled { Vector3::zeros() } else { seen };
        rows.fixed_view_mut::<3, 1>(0, 6).copy_from(&if scaled { -seen } else { Vector3::zeros() });
        hessian += rows.transpose() * rows;
        vector += rows.transpose() * (known - a.translation);
    }
    if !scaled {
        hessian[(6, 6)] = 1.0;
    }
    // What motions about one axis leave open stays near 0.
    let least = 1e-9 * hessian.trace();
    let t = (hessian + SMatrix::identity() * least).cholesky()?.solve(&vector);
    let scale = if scaled { 1.0 / t[6] } else { 1.0 };
    let at = |k: usize| t.fixed_rows::<3>(k).into_owned();
    let start = Start {
        name,
        x: Pose { rotation: *r_x, translation: at(0) },
        z: Pose { rotation: *r_z, translation: at(3) },
        scale,
    };
    (scale > 0.0 && t.iter().all(|x| x.is_finite())).then_some(start)
}

/// Z from X: a mean over all samples.
fn mean_z(x: &Pose, a: &[Pose], b: &[Pose]) -> Option<Pose> {
    let each: Vec<Pose> = a.iter().zip(b).map(|(a, b)| *a * *x * b.inverse()).collect();
    let rotation = crate::geometry::nearest_rotation(&each.iter().map(|z| z.rotation).sum::<Matrix3<f64>>())?;
    let translation = each.iter().map(|z| z.translation).sum::<Vector3<f64>>() / each.len() as f64;
    Some(Pose { rotation, translation })
}

/// Heavy-tailed misfit, so that wrong poses do not choose.
fn cost(start: &Start, a: &[Pose], b: &[Pose]) -> f64 {
    let stride = a.len().div_ceil(200);
    let each = a.iter().zip(b).step_by(stride).map(|(a, b)| {
        let b = Pose { translation: b.translation / start.scale, ..*b };
        let (left, right) = (*a * start.x, start.z * b);
        let turn = left.angle_to(&right) / TURN;
        let length = (left.translation - right.translation).norm() / LENGTH;
        (turn * turn).ln_1p() + (length * length).ln_1p()
    });
    each.sum()
}
