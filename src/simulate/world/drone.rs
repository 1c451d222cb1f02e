//! A drone that flies over a line on the ground.
use nalgebra::{Matrix3, Vector2, Vector3};

/// A drone whose camera looks down, upright with the drone, and a straight line on the ground, the x axis of the world.
///
/// Its camera has x to the right of the drone's nose and y to its back, so that a line that the nose points along is vertical in the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drone {
    /// Where it is [m]; z up from the ground.
    pub position: Vector3<f64>,
    /// Where its nose points, from the x axis of the world, about the vertical [rad].
    pub yaw: f64,
    /// How far it leans forward, and to its right [rad].
    pub lean: [f64; 2],
}

/// Focal length and half the size of the image [px].
const FOCAL: f64 = 560.0;
const HALF: [f64; 2] = [320.0, 180.0];

/// Between the points of the line that are reported [px].
const APART: f64 = 200.0;

impl Drone {
    /// Two points by which a tracker tells where the line lies in the image [px], always as far apart, about the middle of what is seen of it;
    /// the one further along the world's x axis first. `None` where none of it is seen.
    pub fn line(&self) -> Option<[[f64; 2]; 2]> {
        let nose = Vector3::new(self.yaw.cos(), self.yaw.sin(), 0.0);
        let right = Vector3::new(self.yaw.sin(), -self.yaw.cos(), 0.0);
        let turn = |axis: Vector3<f64>, angle: f64| handeye_solvers::manifold::so3::exp(&(axis * angle));
        let leaning = turn(right, -self.lean[0]) * turn(nose, self.lean[1]);
        let axes = leaning * Matrix3::from_columns(&[right, -nose, -Vector3::z()]);
        // Of the line's direction and of the point below the drone, in the camera's frame.
        let along = axes.transpose() * Vector3::x();
        let below = axes.transpose() * Vector3::new(0.0, -self.position.y, -self.position.z);
        // In the image, points (below + s along) / depth: a line through two of them, clipped to the image.
        let normal = below.cross(&along);
        let direction = Vector2::new(normal.y, -normal.x);
        let length = direction.norm();
        if length.is_nan() || length < 1e-12 {
            return None;
        }
        let offset = -normal.z * FOCAL / length;
        let (direction, foot) = (direction / length, offset * Vector2::new(normal.x, normal.y) / length);
        let (mut least, mut most) = (f64::NEG_INFINITY, f64::INFINITY);
        for axis in 0..2 {
            if direction[axis].abs() < 1e-12 {
                if foot[axis].abs() > HALF[axis] {
                    return None;
                }
                continue;
            }
            let ends = [-1.0, 1.0].map(|side| (side * HALF[axis] - foot[axis]) / direction[axis]);
            least = least.max(ends[0].min(ends[1]));
            most = most.min(ends[0].max(ends[1]));
        }
        if least >= most {
            return None;
        }
        let middle = 0.5 * (least + most);
        let pixel = |side: f64| {
            let at = foot + (middle + side * APART / 2.0) * direction;
            [at.x + HALF[0], at.y + HALF[1]]
        };
        // Where points go that are further along.
        let ahead =
            direction.dot(&Vector2::new(along.x * below.z - below.x * along.z, along.y * below.z - below.y * along.z));
        Some(if ahead > 0.0 { [pixel(1.0), pixel(-1.0)] } else { [pixel(-1.0), pixel(1.0)] })
    }
}
