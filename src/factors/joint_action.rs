//! A commanded motion of one joint, executed with an error (eq. 14 of the paper).
use handeye_solvers::{DynamicVector, Factor, Jacobian, Scalar};

/// The joint's motion minus the commanded one [rad or m], on the states of all joints before and after.
#[derive(Clone, Copy, Debug)]
pub struct JointAction {
    /// Index of the joint, from the base.
    pub joint: usize,
    /// The commanded motion [rad or m].
    pub action: f64,
}

impl Factor<1> for JointAction {
    type On = (DynamicVector, DynamicVector);

    fn residual<T: Scalar>(&self, (before, after): (DynamicVector<T>, DynamicVector<T>)) -> [T; 1] {
        [after[self.joint] - before[self.joint] - self.action]
    }

    fn evaluate(&self, x: &[&[f64]], jacobian: Option<&mut Jacobian<'_>>) -> [f64; 1] {
        if let Some(jacobian) = jacobian {
            for (argument, slope) in [-1.0, 1.0].into_iter().enumerate() {
                if jacobian.wanted(argument) {
                    let row = jacobian.row(0, argument);
                    row.fill(0.0);
                    row[self.joint] = slope;
                }
            }
        }
        [x[1][self.joint] - x[0][self.joint] - self.action]
    }
}
