//! Motions of a rigid body as people tell them.
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;
use nalgebra::Vector3;

/// A twist of the hand, by its screw: points x move by w × (x - point) + pitch w, in the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Every point moves along a unit direction.
    Translation {
        /// The direction.
        direction: Vector3<f64>,
    },
    /// About an axis.
    Rotation {
        /// A point of the axis [m].
        point: Vector3<f64>,
        /// Its unit direction.
        direction: Vector3<f64>,
    },
    /// About an axis and along it at once.
    Screw {
        /// A point of the axis [m].
        point: Vector3<f64>,
        /// Its unit direction.
        direction: Vector3<f64>,
        /// Way along the axis [m/rad].
        pitch: f64,
    },
}

impl Motion {
    /// From an angular velocity and the velocity of a point `at`; `size`: a length that counts as much as a radian [m].
    pub(super) fn of_twist(turn: Vector3<f64>, velocity: Vector3<f64>, at: Vector3<f64>, size: f64) -> Motion {
        if turn.norm() * size < SMALL * velocity.norm() {
            return Motion::Translation { direction: velocity.normalize() };
        }
        let rate = turn.norm();
        let direction = turn / rate;
        let point = at + turn.cross(&velocity) / (rate * rate);
        let pitch = direction.dot(&velocity) / rate;
        if pitch.abs() < SMALL * size {
            return Motion::Rotation { point, direction };
        }
        Motion::Screw { point, direction, pitch }
    }

    /// Velocity of a point of the hand at `x`, per radian, or per metre of a translation.
    pub fn velocity(&self, x: &Vector3<f64>) -> Vector3<f64> {
        match self {
            Motion::Translation { direction } => *direction,
            Motion::Rotation { point, direction } => direction.cross(&(x - point)),
            Motion::Screw { point, direction, pitch } => direction.cross(&(x - point)) + *pitch * direction,
        }
    }

    /// Angular velocity, of length 1 or 0.
    pub fn turn(&self) -> Vector3<f64> {
        match self {
            Motion::Translation { .. } => Vector3::zeros(),
            Motion::Rotation { direction, .. } | Motion::Screw { direction, .. } => *direction,
        }
    }
}

/// Shares of a motion below this are rounding.
const SMALL: f64 = 1e-4;

/// A finite motion of the hand from one placement to another: about an axis by an angle, and along it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Displacement {
    /// Unit direction of the axis, or of the way where nothing turns.
    pub direction: Vector3<f64>,
    /// The point of the axis next to where the hand's middle is in both placements, halfway [m].
    pub point: Vector3<f64>,
    /// By how much it turns, in [0, π] [rad].
    pub angle: f64,
    /// By how much it moves along the axis [m].
    pub along: f64,
}

impl Displacement {
    /// From one pose in the world to another, of a frame in the hand's middle.
    pub(super) fn between(from: &Pose, to: &Pose, size: f64) -> Self {
        let turn = so3::log(&(to.rotation * from.rotation.transpose()));
        let way = to.translation - from.translation;
        let halfway = 0.5 * (from.translation + to.translation);
        let angle = turn.norm();
        if angle < 1e-6 || angle * size < 1e-9 * way.norm() {
            let along = way.norm();
            let direction = way.try_normalize(0.0).unwrap_or_default();
            return Displacement { direction, point: halfway, angle: 0.0, along };
        }
        let direction = turn / angle;
        let along = direction.dot(&way);
        // Both ends are seen from the axis under the angle: it is cot(angle / 2) / 2 of the way across beside its middle.
        let point = halfway + 0.5 / (0.5 * angle).tan() * direction.cross(&(way - along * direction));
        Displacement { direction, point, angle, along }
    }
}
