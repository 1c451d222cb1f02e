//! A distance that was measured.
use handeye_solvers::{Factor, Pose, Scalar, Vector};

/// Distance of two points that are fixed to the same thing minus the measured one [m].
///
///   r = |p - q| - length
#[derive(Clone, Copy, Debug)]
pub struct PointDistance {
    /// What was measured [m].
    pub length: f64,
}

/// The same of the origins of two poses in the same frame.
#[derive(Clone, Copy, Debug)]
pub struct OriginDistance {
    /// What was measured [m].
    pub length: f64,
}

/// Where two points coincide, their distance has no derivative; this far apart it has one [m].
const APART: f64 = 1e-12;

impl Factor<1> for PointDistance {
    type On = (Vector<3>, Vector<3>);

    fn residual<T: Scalar>(&self, (p, q): (Vector<3, T>, Vector<3, T>)) -> [T; 1] {
        [distance(std::array::from_fn(|k| p[k] - q[k])) - self.length]
    }
}

impl Factor<1> for OriginDistance {
    type On = (Pose, Pose);

    fn residual<T: Scalar>(&self, (p, q): (Pose<T>, Pose<T>)) -> [T; 1] {
        [distance(std::array::from_fn(|k| p.translation[k] - q.translation[k])) - self.length]
    }
}

fn distance<T: Scalar>([x, y, z]: [T; 3]) -> T {
    (x * x + y * y + z * z + APART * APART).sqrt()
}
