//! A noisy reading of one joint (eq. 10 of the paper).
use handeye_solvers::{DynamicVector, Factor, Jacobian, Scalar};

/// The joint's state minus its reading [rad or m], on the states of all joints.
#[derive(Clone, Copy, Debug)]
pub struct JointReading {
    /// Index of the joint, from the base.
    pub joint: usize,
    /// What was read [rad or m].
    pub reading: f64,
}

impl Factor<1> for JointReading {
    type On = (DynamicVector,);

    fn residual<T: Scalar>(&self, (joints,): (DynamicVector<T>,)) -> [T; 1] {
        [joints[self.joint] - self.reading]
    }

    fn evaluate(&self, x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>) -> [f64; 1] {
        if let Some(jacobian) = jacobian
            && jacobian.wanted(0)
        {
            let row = jacobian.row(0, 0);
            row.fill(0.0);
            row[self.joint] = 1.0;
        }
        [x[0][self.joint] - self.reading]
    }
}
