"""Learns one generative model of a robot arm, its cameras and its features from a recording, and controls with it.

>>> import handeye
>>> motions = handeye.simulate(handeye.Rig.load("ur5"), samples=50, seed=1).recording
>>> learned = handeye.calibrate(motions)
>>> fresh = handeye.simulate(handeye.Rig.load("ur5"), samples=50, seed=2).recording
>>> bool(handeye.evaluate(learned.rig, fresh).rms_px < 1.1 * 0.3 * 2**0.5)
True

Units: metres, radians, seconds, pixels. Poses are homogeneous matrices (4 x 4) named parent_from_child, which map the child's
coordinates into its parent's. Cameras look along +z with x right and y down; pixel (0, 0) is the centre of the top-left pixel, u to the
right, v down. Features come in the order of ``feature_names``; what was not seen is NaN.
"""

from . import servo
from ._errors import Error, NotDone, UnusableInput
from ._handeye import (
    Branch,
    Calibration,
    Errors,
    Evaluation,
    Graph,
    Inference,
    Inferred,
    InferredPose,
    Influence,
    InverseKinematics,
    Minimization,
    Node,
    Progress,
    Reached,
    Recording,
    Rig,
    Simulation,
    Stage,
    TargetReport,
    TipDeviation,
    Weak,
    __version__,
    calibrate,
    evaluate,
    infer,
    random_rig,
    residuals,
    shipped_rigs,
    simulate,
)
from ._minimize import Minimum, minimize

__all__ = [
    "Branch",
    "Calibration",
    "Error",
    "Errors",
    "Evaluation",
    "Graph",
    "Inference",
    "Inferred",
    "InferredPose",
    "Influence",
    "InverseKinematics",
    "Minimization",
    "Minimum",
    "Node",
    "NotDone",
    "Progress",
    "Reached",
    "Recording",
    "Rig",
    "Simulation",
    "Stage",
    "TargetReport",
    "TipDeviation",
    "UnusableInput",
    "Weak",
    "__version__",
    "calibrate",
    "evaluate",
    "infer",
    "minimize",
    "random_rig",
    "residuals",
    "servo",
    "shipped_rigs",
    "simulate",
]
