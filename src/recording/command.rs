//! What robots take.
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;

/// What a robot is told to do until the next command.
#[derive(Clone, Debug, PartialEq)]
pub enum Command {
    /// Stand still.
    Hold,
    /// Go to these joint readings [rad or m].
    Joints(Vec<f64>),
    /// Move the joints by this much [rad or m].
    JointDelta(Vec<f64>),
    /// Move the joints this fast [rad/s or m/s].
    JointVelocity(Vec<f64>),
    /// Move the tip by A in the world: `P_next = A P` (eq. 12 of the paper).
    PoseDelta(Pose),
    /// Move the tip this fast: angular velocity [rad/s], then velocity of its origin [m/s], both along the world's axes.
    PoseVelocity([f64; 6]),
}

impl Command {
    /// False where a number in it is not finite: no robot should take it.
    pub fn is_finite(&self) -> bool {
        match self {
            Command::Hold => true,
            Command::Joints(numbers) | Command::JointDelta(numbers) | Command::JointVelocity(numbers) => {
                numbers.iter().all(|number| number.is_finite())
            }
            Command::PoseDelta(pose) => pose.rotation.iter().chain(&pose.translation).all(|number| number.is_finite()),
            Command::PoseVelocity(twist) => twist.iter().all(|number| number.is_finite()),
        }
    }

    /// The motion A of the world that takes a tip along a twist for `dt` seconds: R = exp(w dt), and the tip's origin p moves by v dt.
    pub fn along(twist: &[f64; 6], tip: &Pose, dt: f64) -> Pose {
        let [w, v] = [0, 3].map(|first| Vector3::new(twist[first], twist[first + 1], twist[first + 2]) * dt);
        let rotation = so3::exp(&w);
        Pose { rotation, translation: tip.translation + v - rotation * tip.translation }
    }
}
