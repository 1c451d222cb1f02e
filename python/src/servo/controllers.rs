//! Controllers: from what is seen to what the robot shall do.
use super::decision::Decision;
use super::limits::{Limit, those_of};
use super::step::read;
use crate::arrays::{Floats, vector};
use crate::errors::{raise, unusable};
use crate::rig::{AnyRig, Rig, bounds};
use crate::sight::Layout;
use handeye::infer::Sighting;
use handeye::rig::{self, Joint, Limits};
use handeye::servo::uncalibrated::Settings;
use handeye::servo::{self, Gain, ImageSettings, InteractionMatrix, Measurement, PoseSettings, Takes};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// From what is seen to what the robot shall do: the base class of all controllers.
///
/// What is seen is camera -> (n_features, 2) [px], in the order of the rig's features, NaN where not seen.
#[pyclass(module = "handeye.servo", subclass, frozen)]
pub struct Controller {
    pub shared: Shared,
    pub layout: Layout,
    pub rig: Arc<rig::Rig>,
}

/// A controller that an object of Python and a loop have in common.
#[derive(Clone)]
pub struct Shared(Arc<Mutex<Kind>>);

pub enum Kind {
    ModelBased(servo::ModelBased),
    ModelBasedTip(servo::ModelBasedTip),
    ImageBased(servo::ImageBased),
    PoseBased(servo::PoseBased),
    UncalibratedJoints(Box<servo::UncalibratedJoints>),
}

impl Kind {
    fn any(&mut self) -> &mut dyn servo::Controller {
        match self {
            Kind::ModelBased(controller) => controller,
            Kind::ModelBasedTip(controller) => controller,
            Kind::ImageBased(controller) => controller,
            Kind::PoseBased(controller) => controller,
            Kind::UncalibratedJoints(controller) => &mut **controller,
        }
    }
}

impl Shared {
    fn lock(&self) -> MutexGuard<'_, Kind> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl servo::Controller for Shared {
    fn aim(&mut self, goal: &[Sighting]) {
        self.lock().any().aim(goal);
    }

    fn decide(
        &mut self,
        now: &Measurement<'_>,
        limits: &[&dyn servo::Limit],
        dt: f64,
    ) -> Result<servo::Decision, handeye::Error> {
        self.lock().any().decide(now, limits, dt)
    }

    fn error_px(&self, now: &Measurement<'_>, goal: &[Sighting], left_out: &[(usize, usize)]) -> Option<f64> {
        self.lock().any().error_px(now, goal, left_out)
    }

    fn reads_joints(&self) -> bool {
        self.lock().any().reads_joints()
    }

    fn held(&mut self) {
        self.lock().any().held();
    }
}

#[pymethods]
impl Controller {
    /// Sets where features shall be seen: camera -> (n_features, 2) [px], NaN for those that may be anywhere.
    fn aim(&self, goal: &Bound<'_, PyDict>) -> PyResult<()> {
        let mut sightings = Vec::new();
        self.layout.pixels(goal, &mut sightings)?;
        self.shared.lock().any().aim(&sightings);
        Ok(())
    }

    /// The command for the next ``dt`` seconds.
    ///
    /// pixels: what is seen now; points: depth camera -> (n_features, 3) [m], likewise. joints: readings, (n_joints,) [rad or m], where the robot gives any. time: when that was [s].
    ///
    /// Raises ``NotDone`` where what is seen determines no motion: hold the robot, and decide again on what is seen next.
    #[pyo3(signature = (pixels, joints = None, *, dt, time = 0.0, limits = None, points = None))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per measurement")]
    fn decide(
        &self,
        py: Python<'_>,
        pixels: &Bound<'_, PyDict>,
        joints: Option<&Bound<'_, PyAny>>,
        dt: f64,
        time: f64,
        limits: Option<Vec<Bound<'_, Limit>>>,
        points: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<Decision> {
        let points = self.layout.points(points)?;
        let (mut seen, mut readings) = (Vec::with_capacity(32), Vec::new());
        self.layout.pixels(pixels, &mut seen)?;
        if let Some(joints) = joints {
            read("joints", joints, self.rig.robot.joints.len(), &mut readings)?;
        }
        let limits = those_of(limits.as_deref(), &self.layout, self.rig.robot.joints.len())?;
        // Others run on while it thinks; the lock is taken without Python's, which a holder of it may wait for.
        let decided = py.detach(|| {
            let limits: Vec<&dyn servo::Limit> = limits.iter().map(|limit| *limit as &dyn servo::Limit).collect();
            let now = Measurement { time, joints: &readings, seen: &seen, points: &points };
            self.shared.lock().any().decide(&now, &limits, dt)
        });
        let inner = decided.map_err(raise)?;
        Ok(Decision { inner, rig: self.rig.clone() })
    }

    /// Tells the controller that the robot was held in place of its last command.
    fn held(&self) {
        self.shared.lock().any().held();
    }
}

impl Controller {
    fn of(rig: &Rig, kind: Kind) -> Self {
        let rig = Arc::new(rig.inner.clone());
        Controller { shared: Shared(Arc::new(Mutex::new(kind))), layout: Layout::of(&rig), rig }
    }
}

fn new<T: pyo3::PyClass<BaseType = Controller>>(controller: T, base: Controller) -> PyClassInitializer<T> {
    PyClassInitializer::from(base).add_subclass(controller)
}

/// The paper's controller: infers the present and the target joints from pixels, and commands the difference.
///
/// For robots whose joints may be unobserved. takes: what the robot takes, ``"joints"``, ``"joint-deltas"``, ``"joint-velocities"``,
/// ``"pose-deltas"`` or ``"pose-velocities"``.
#[pyclass(module = "handeye.servo", extends = Controller, frozen)]
pub struct ModelBased;

#[pymethods]
impl ModelBased {
    #[new]
    #[pyo3(signature = (rig, *, takes = "joint-deltas"))]
    fn new(rig: AnyRig<'_>, takes: &str) -> PyResult<PyClassInitializer<Self>> {
        let mut inner = servo::ModelBased::new(&rig.inner).map_err(raise)?;
        inner.takes = takes_of(takes)?;
        Ok(new(ModelBased, Controller::of(&rig, Kind::ModelBased(inner))))
    }

    /// Joints that were inferred last [rad or m], shape (n_joints,); ``None`` before the first decision.
    #[getter]
    fn joints<'py>(slf: PyRef<'py, Self>) -> Option<Bound<'py, PyArray1<f64>>> {
        let guard = slf.as_super().shared.lock();
        let Kind::ModelBased(inner) = &*guard else { return None };
        (!inner.joints().is_empty()).then(|| vector(slf.py(), inner.joints()))
    }

    /// Joints aimed at [rad or m], shape (n_joints,); ``None`` before the first decision.
    #[getter]
    fn target<'py>(slf: PyRef<'py, Self>) -> Option<Bound<'py, PyArray1<f64>>> {
        let guard = slf.as_super().shared.lock();
        let Kind::ModelBased(inner) = &*guard else { return None };
        (!inner.target().is_empty()).then(|| vector(slf.py(), inner.target()))
    }
}

/// The paper's controller for robots that move their tip and whose joints nobody knows; the rig may have no chain.
///
/// takes: ``"pose-deltas"`` or ``"pose-velocities"``. speed: largest of the tip's origin [m/s] and of its turning [rad/s].
#[pyclass(module = "handeye.servo", extends = Controller, frozen)]
pub struct ModelBasedTip;

#[pymethods]
impl ModelBasedTip {
    #[new]
    #[pyo3(signature = (rig, *, takes = "pose-deltas", speed = [f64::INFINITY; 2]))]
    fn new(rig: AnyRig<'_>, takes: &str, speed: [f64; 2]) -> PyResult<PyClassInitializer<Self>> {
        let mut inner = servo::ModelBasedTip::new(&rig.inner).map_err(raise)?;
        (inner.takes, inner.speed) = (takes_of(takes)?, speed);
        Ok(new(ModelBasedTip, Controller::of(&rig, Kind::ModelBasedTip(inner))))
    }
}

/// A gain: constant, or (near, far, slope) of an adaptive one.
#[derive(FromPyObject)]
enum GainArgument {
    Constant(f64),
    Adaptive(f64, f64, f64),
}

impl From<GainArgument> for Gain {
    fn from(argument: GainArgument) -> Self {
        match argument {
            GainArgument::Constant(share) => Gain::Constant(share),
            GainArgument::Adaptive(near, far, slope) => Gain::Adaptive { near, far, slope },
        }
    }
}

/// Image-based visual servoing: the error is what is seen minus what shall be seen, in all cameras at once.
///
/// matrix: where slopes are taken, ``"current"``, ``"desired"`` or ``"mean"``. gain: share of the error that a step takes away, or
/// (near, far, slope) of an adaptive one. infer_joints: the present joints are inferred from what is seen, near the readings. takes: see
/// ``ModelBased``.
#[pyclass(module = "handeye.servo", extends = Controller, frozen)]
pub struct ImageBased;

#[pymethods]
impl ImageBased {
    #[new]
    #[pyo3(signature = (rig, *, matrix = "mean", gain = GainArgument::Constant(1.0), infer_joints = false, takes = "joint-deltas"))]
    fn new(
        rig: AnyRig<'_>,
        matrix: &str,
        gain: GainArgument,
        infer_joints: bool,
        takes: &str,
    ) -> PyResult<PyClassInitializer<Self>> {
        let settings =
            ImageSettings { matrix: matrix_of(matrix)?, gain: gain.into(), infer_joints, ..ImageSettings::default() };
        let mut inner = servo::ImageBased::new(&rig.inner, settings).map_err(raise)?;
        inner.takes = takes_of(takes)?;
        Ok(new(ImageBased, Controller::of(&rig, Kind::ImageBased(inner))))
    }
}

/// Position-based visual servoing on the tip's pose, which is inferred from the pixels of all cameras in one problem.
///
/// xyz_sd [m], rot_sd [rad]: weights where the arm cannot reach position and orientation. The others: see ``ImageBased``.
#[pyclass(module = "handeye.servo", extends = Controller, frozen)]
pub struct PoseBased;

#[pymethods]
impl PoseBased {
    #[new]
    #[pyo3(signature = (rig, *, matrix = "mean", gain = GainArgument::Constant(1.0), infer_joints = false, xyz_sd = 1e-3, rot_sd = 5e-3,
        takes = "joint-deltas"))]
    fn new(
        rig: AnyRig<'_>,
        matrix: &str,
        gain: GainArgument,
        infer_joints: bool,
        xyz_sd: f64,
        rot_sd: f64,
        takes: &str,
    ) -> PyResult<PyClassInitializer<Self>> {
        let settings = PoseSettings { matrix: matrix_of(matrix)?, gain: gain.into(), infer_joints, xyz_sd, rot_sd };
        let mut inner = servo::PoseBased::new(&rig.inner, settings).map_err(raise)?;
        inner.takes = takes_of(takes)?;
        Ok(new(PoseBased, Controller::of(&rig, Kind::PoseBased(inner))))
    }
}

/// Servoing without a rig: it explores how joints move pixels, servoes, and keeps what it found up to date.
///
/// lower, upper: limits of the joints, (n_joints,) [rad or m], infinite where there are none. cameras: their names; n_features: how many
/// each sees. sd_px: standard deviation of a tracker's pixel coordinates [px]. gain: share of the errors that a step takes away.
/// exploration: size of the first motion along each direction [rad or m]. ``with_rig`` begins with a rig that may be outdated instead of
/// exploring.
#[pyclass(module = "handeye.servo", extends = Controller, frozen)]
pub struct UncalibratedJoints;

#[pymethods]
impl UncalibratedJoints {
    #[new]
    #[pyo3(signature = (lower, upper, *, cameras, n_features, max_velocity = None, sd_px = 0.5, gain = None, exploration = None,
        takes = "joint-deltas"))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per option")]
    fn new(
        lower: Floats<'_>,
        upper: Floats<'_>,
        cameras: Vec<String>,
        n_features: usize,
        max_velocity: Option<Floats<'_>>,
        sd_px: f64,
        gain: Option<f64>,
        exploration: Option<f64>,
        takes: &str,
    ) -> PyResult<PyClassInitializer<Self>> {
        let n = lower.as_array().len();
        let lower = bounds("lower", &lower, n, f64::NEG_INFINITY)?;
        let upper = bounds("upper", &upper, n, f64::INFINITY)?;
        let fastest = max_velocity
            .map_or_else(|| Ok(vec![None; n]), |fastest| bounds("max_velocity", &fastest, n, f64::INFINITY))?;
        let joint = |i: usize| Joint {
            name: format!("j{}", i + 1),
            limits: Limits { lower: lower[i], upper: upper[i], velocity: fastest[i], acceleration: None },
            ..Joint::default()
        };
        let joints: Vec<Joint> = (0..n).map(joint).collect();
        let settings = settings(Settings::default(), gain, exploration);
        let mut inner = servo::UncalibratedJoints::new(&joints, sd_px, settings).map_err(raise)?;
        inner.takes = takes_of(takes)?;
        let mut rig = rig::Rig::default();
        rig.robot.joints = joints;
        let shared = Shared(Arc::new(Mutex::new(Kind::UncalibratedJoints(Box::new(inner)))));
        let base = Controller { shared, layout: Layout::new(cameras, n_features), rig: Arc::new(rig) };
        Ok(new(UncalibratedJoints, base))
    }

    /// Begins with a complete rig that may be outdated: a camera may have been moved, a tool exchanged.
    #[staticmethod]
    #[pyo3(signature = (rig, *, sd_px = 0.5, gain = None, takes = "joint-deltas"))]
    fn with_rig(py: Python<'_>, rig: AnyRig<'_>, sd_px: f64, gain: Option<f64>, takes: &str) -> PyResult<Py<Self>> {
        let settings = settings(Settings::with_rig(), gain, None);
        let mut inner = servo::UncalibratedJoints::with_rig(&rig.inner, sd_px, settings).map_err(raise)?;
        inner.takes = takes_of(takes)?;
        let base = Controller::of(&rig, Kind::UncalibratedJoints(Box::new(inner)));
        Py::new(py, new(UncalibratedJoints, base))
    }
}

fn settings(mut settings: Settings, gain: Option<f64>, exploration: Option<f64>) -> Settings {
    settings.gain = gain.unwrap_or(settings.gain);
    settings.exploration.size = exploration.unwrap_or(settings.exploration.size);
    settings
}

fn takes_of(name: &str) -> PyResult<Takes> {
    by_name("takes", name, Takes::ALL, Takes::name)
}

fn matrix_of(name: &str) -> PyResult<InteractionMatrix> {
    by_name("matrix", name, InteractionMatrix::ALL, InteractionMatrix::name)
}

fn by_name<T: Copy>(what: &str, name: &str, all: &[T], name_of: fn(T) -> &'static str) -> PyResult<T> {
    all.iter().copied().find(|one| name_of(*one) == name).ok_or_else(|| {
        let known: Vec<&str> = all.iter().map(|one| name_of(*one)).collect();
        unusable(format!("{what}: unknown `{name}` (known: {})", known.join(", ")))
    })
}
