//! The Python package `handeye`: the crate of the same name behind numpy arrays. Documentation for users stands in the docstrings.
mod arrays;
mod calibrate;
mod cli;
mod errors;
mod evaluate;
mod graph;
mod infer;
mod inverse;
mod minimization;
mod node;
mod recording;
mod recording_arrays;
mod residual;
mod rig;
mod servo;
mod sight;
mod simulate;
mod work;

/// Learns one generative model of robot, features and cameras from a recording, and controls with it.
#[pyo3::pymodule]
mod _handeye {
    #[expect(non_upper_case_globals, reason = "Python's name for it")]
    #[pymodule_export]
    const __version__: &str = env!("CARGO_PKG_VERSION");

    #[pymodule_export]
    use crate::calibrate::{Calibration, Influence, Stage, TargetReport, TipDeviation, Weak, calibrate};
    #[pymodule_export]
    use crate::cli::run_command;
    #[pymodule_export]
    use crate::evaluate::{Errors, Evaluation, evaluate, residuals};
    #[pymodule_export]
    use crate::graph::Graph;
    #[pymodule_export]
    use crate::infer::{Branch, Inference, Inferred, InferredPose, infer};
    #[pymodule_export]
    use crate::inverse::{InverseKinematics, Reached};
    #[pymodule_export]
    use crate::minimization::Minimization;
    #[pymodule_export]
    use crate::node::Node;
    #[pymodule_export]
    use crate::recording::Recording;
    #[pymodule_export]
    use crate::rig::{Rig, shipped_rigs};
    #[pymodule_export]
    use crate::servo::{
        Active, Controller, Decision, FunctionTask, Goal, HalfSpace, ImageBased, ImagePoints, InImage, JointTarget,
        Limit, LinkDistance, LookAt, Manipulability, ModelBased, ModelBasedTip, MotionCommand, PixelSpeed, PoseBased,
        PredictionBounds, ServoLoop, Step, Stepper, Stop, Task, Tick, TipBox, TipPose, TipSpeed, UncalibratedJoints,
        VirtualFixture,
    };
    #[pymodule_export]
    use crate::simulate::{Simulation, random_rig, simulate};
    #[pymodule_export]
    use crate::work::Progress;
}
