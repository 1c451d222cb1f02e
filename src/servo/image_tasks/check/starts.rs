//! Where searches for solved placements begin.
use super::problem::Problem;
use crate::servo::image_tasks::Place;
use crate::servo::image_tasks::drawn::{axes, in_ball, looking};
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{PI, TAU};

/// Times that a start is drawn again where something would be out of view.
const TRIES: usize = 20;

/// The hand at the identity of its own frame, then anywhere around the target in any orientation.
pub(super) fn starts(problem: &Problem, n: usize, seed: u64) -> Vec<Pose> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let home = Pose { translation: problem.middle, ..Pose::identity() };
    let carried = problem.geometry.cameras.iter().find(|view| view.on_hand);
    let is_carried = problem.geometry.cameras.iter().all(|view| view.on_hand);
    let mut draw = || match carried.filter(|_| is_carried) {
        None => Pose {
            rotation: any_rotation(&mut random),
            translation: problem.centre + 2.0 * problem.size * in_ball(&mut random),
        },
        Some(view) => {
            let away = problem.size * random.random_range(4.0..12.0);
            let from = problem.centre + away * in_ball(&mut random).normalize();
            let at = problem.centre + problem.size * in_ball(&mut random);
            let world_from_camera = looking(from, &at);
            let (sine, cosine) = random.random_range(0.0..TAU).sin_cos();
            let roll = Matrix3::new(cosine, -sine, 0.0, sine, cosine, 0.0, 0.0, 0.0, 1.0);
            Pose { rotation: world_from_camera.rotation * roll, ..world_from_camera } * view.pose.inverse()
        }
    };
    let mut in_view = || (0..TRIES).map(|_| draw()).find(|pose| problem.geometry.is_visible(problem.task, pose));
    let drawn: Vec<Pose> = (1..n).filter_map(|_| in_view()).collect();
    std::iter::once(home).chain(drawn).collect()
}

/// Half-turns of a solved placement: symmetric shapes end in these.
pub(super) fn half_turns(problem: &Problem, solved: &Pose, seed: u64) -> Vec<Pose> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let features = problem.task.features().iter().zip(&problem.geometry.points);
    let on_hand = features.filter(|(feature, _)| matches!(feature.place, Place::Hand(_))).map(|(_, point)| point);
    // The main axes of the hand, then any.
    let spread: Matrix3<f64> = on_hand.map(|point| point * point.transpose()).sum();
    let main = spread.symmetric_eigen().eigenvectors;
    let axes: Vec<Vector3<f64>> =
        main.column_iter().map(Into::into).chain((0..7).map(|_| in_ball(&mut random).normalize())).collect();
    let turned = |axis: &Vector3<f64>| Pose { rotation: solved.rotation * so3::exp(&(PI * axis)), ..*solved };
    axes.iter().map(turned).filter(|pose| problem.geometry.is_visible(problem.task, pose)).collect()
}

/// Uniform: an axis anywhere, turned about itself.
fn any_rotation(random: &mut ChaCha8Rng) -> Matrix3<f64> {
    let [right, down, ahead] = axes(&in_ball(random));
    let angle = random.random_range(0.0..TAU);
    let right: Vector3<f64> = angle.cos() * right + angle.sin() * down;
    Matrix3::from_columns(&[right, ahead.cross(&right), ahead])
}
