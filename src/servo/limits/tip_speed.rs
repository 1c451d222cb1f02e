//! How fast the tip may move.
use super::{Arm, Configuration, Limit, LimitRows};
use nalgebra::Vector3;

/// Keeps the speed of the tip's origin below a limit, by a polyhedron of 14 faces inside the ball: where a face lies nearest, 81 % of the
/// limit are the most.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct TipSpeed {
    /// Largest speed [m/s].
    pub speed: f64,
    /// See [`LimitRows::push`].
    pub strength: f64,
}

/// Directions of the faces: along the axes and the diagonals of a cube.
const FACES: [[f64; 3]; 7] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [1.0, 1.0, -1.0],
    [1.0, -1.0, 1.0],
    [-1.0, 1.0, 1.0],
];

/// Nearest distance of a face from the centre of a polyhedron of these faces whose farthest corner is at 1.
const INSCRIBED: f64 = 0.8068;

impl Limit for TipSpeed {
    fn rows(&self, _arm: &Arm, at: &Configuration, dt: f64, rows: &mut LimitRows) {
        let tip = at.posture.tip().translation;
        let bound = INSCRIBED * self.speed * dt;
        for face in FACES {
            let direction = Vector3::from(face).normalize();
            for sign in [1.0, -1.0] {
                let slope = |axis: &crate::chain::Axis| sign * direction.dot(&axis.twist(&tip).1);
                rows.push(at.posture.axes.iter().map(slope), bound, self.strength);
            }
        }
    }
}
