//! A camera that was moved since its rig was learned.
use handeye::rig::Rig;
use handeye::solvers::Pose;
use handeye::solvers::manifold::so3;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;

/// The rig with its first camera 10 cm and 10 degrees away, both in random directions.
pub fn with_moved_camera(rig: &Rig, seed: u64) -> Rig {
    let random = &mut ChaCha8Rng::seed_from_u64(seed);
    let mut direction = || Vector3::from_fn(|_, _| random.sample::<f64, _>(StandardNormal)).normalize();
    let (shift, turn) = (direction() * 0.1, direction() * 10_f64.to_radians());
    let mut rig = rig.clone();
    let pose = rig.cameras[0].pose.expect("the rig is complete");
    rig.cameras[0].pose =
        Some(Pose { rotation: so3::exp(&turn) * pose.rotation, translation: pose.translation + shift });
    rig
}
