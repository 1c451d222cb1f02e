//! The class `Rig`.
use crate::arrays::{Floats, NewArray, array, homogeneous, list, pose, rows, rows_of};
use crate::errors::{raise, unusable};
use handeye::Error;
use handeye::chain::JointKind;
use handeye::rig::{self, Camera, Limits, Model, Parameter, Parent, PoseNoise, Value, catalog};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::collections::BTreeMap;
use std::path::PathBuf;

/// A robot arm, the cameras that watch it and the features that they track: a rig file in memory.
///
/// What is unknown has no value, and is learned by ``handeye.calibrate``. Numbers are looked at and changed by their parameter path, as
/// in rig files and reports: ``rig["cameras.left.fx"]`` [px], ``rig["robot.joints.elbow.d"]`` [m], ``rig["features.f0.xyz"]`` [m, shape
/// (3,)], ``rig["cameras.left.pose"]`` (4 x 4, parent_from_camera); ``None`` where unknown; ``del rig[path]`` forgets a value.
/// ``Rig()`` is empty: everything is unknown.
///
/// Units: metres, radians, seconds, pixels. Poses are homogeneous matrices that map the child's coordinates into its parent's.
#[pyclass(module = "handeye", eq)]
#[derive(Clone, Default)]
pub struct Rig {
    pub inner: rig::Rig,
    /// The text of the file that it was read from, whose comments are kept.
    pub text: Option<String>,
}

/// Two rigs are the same where they say the same, whatever comments their files have.
impl PartialEq for Rig {
    fn eq(&self, other: &Self) -> bool {
        self.inner == other.inner
    }
}

impl Rig {
    /// The model of a complete rig.
    pub fn model(&self) -> PyResult<Model> {
        Model::new(&self.inner).map_err(raise)
    }

    pub fn camera(&self, name: &str) -> PyResult<&Camera> {
        let found = self.inner.cameras.iter().find(|camera| camera.name == name);
        found.ok_or_else(|| {
            let known: Vec<&str> = self.inner.cameras.iter().map(|camera| camera.name.as_str()).collect();
            unusable(format!("the rig has no camera `{name}` (known: {})", known.join(", ")))
        })
    }

    fn parameter(&self, path: &str) -> PyResult<Parameter> {
        self.inner.parameter(path).map_err(|error| PyKeyError::new_err(error.to_string()))
    }

    /// Takes a change over where a rig file could say it.
    fn change(&mut self, change: impl FnOnce(&mut rig::Rig)) -> PyResult<()> {
        let mut changed = self.inner.clone();
        change(&mut changed);
        match rig::Rig::parse(&changed.to_toml(), "rig") {
            Ok(_) => self.inner = changed,
            // The place is one in a text that nobody sees.
            Err(Error::Malformed { problem, .. }) => return Err(unusable(problem)),
            Err(error) => return Err(raise(error)),
        }
        Ok(())
    }

    fn limit(&self, of: impl Fn(&Limits) -> Option<f64>, unlimited: f64) -> Vec<f64> {
        self.inner.robot.joints.iter().map(|joint| of(&joint.limits).unwrap_or(unlimited)).collect()
    }

    fn set_limit(
        &mut self,
        what: &str,
        values: &Floats<'_>,
        of: impl Fn(&mut Limits) -> &mut Option<f64>,
    ) -> PyResult<()> {
        let values = list(what, values, self.inner.robot.joints.len())?;
        self.change(|rig| {
            for (joint, value) in rig.robot.joints.iter_mut().zip(&values) {
                *of(&mut joint.limits) = value.is_finite().then_some(*value);
            }
        })
    }
}

#[pymethods]
impl Rig {
    #[new]
    fn new() -> Self {
        Rig::default()
    }

    /// Reads a rig file (TOML), or takes the shipped rig of that name where there is no such file: see ``handeye.shipped_rigs()``.
    ///
    /// Raises ``UnusableInput`` with file, line and column for whatever is wrong inside.
    #[staticmethod]
    fn load(path: PathBuf) -> PyResult<Self> {
        let name = path.display().to_string();
        if !path.exists()
            && let Some((_, text)) = catalog::ALL.iter().find(|(known, _)| *known == name)
        {
            return Ok(Rig { inner: catalog::rig(&name).map_err(raise)?, text: Some((*text).to_owned()) });
        }
        let (inner, text) = rig::Rig::read_with_text(&path).map_err(raise)?;
        Ok(Rig { inner, text: Some(text) })
    }

    /// Reads the text of a rig file, which messages call ``file_name``; files that it names are looked for beside that.
    #[staticmethod]
    #[pyo3(signature = (text, file_name = "rig.toml"))]
    fn from_string(text: &str, file_name: &str) -> PyResult<Self> {
        let inner = rig::Rig::parse(text, file_name).map_err(raise)?;
        Ok(Rig { inner, text: Some(text.to_owned()) })
    }

    /// Writes a rig file, whole or not at all. Comments and order of the file that it was read from survive.
    fn save(&self, path: PathBuf) -> PyResult<()> {
        self.inner.write(&path, self.text.as_deref()).map_err(raise)
    }

    /// The text of a rig file that reads back as this rig, with the comments of the one that it was read from.
    fn to_toml(&self) -> PyResult<String> {
        match &self.text {
            Some(text) => self.inner.update_toml(text).map_err(raise),
            None => Ok(self.inner.to_toml()),
        }
    }

    /// A copy that changes by itself.
    fn copy(&self) -> Self {
        self.clone()
    }

    fn __copy__(&self) -> Self {
        self.clone()
    }

    fn __deepcopy__(&self, _memo: &Bound<'_, PyAny>) -> Self {
        self.clone()
    }

    fn __reduce__<'py>(&self, py: Python<'py>) -> PyResult<(Bound<'py, PyAny>, (String,))> {
        Ok((py.get_type::<Rig>().getattr("from_string")?, (self.to_toml()?,)))
    }

    fn __repr__(&self) -> String {
        let rig = &self.inner;
        let name = rig.name.as_ref().map_or_else(String::new, |name| format!("{name:?}: "));
        let (joints, cameras, features) = (rig.robot.joints.len(), rig.cameras.len(), rig.features.len());
        format!("<handeye.Rig {name}{joints} joints, {cameras} cameras, {features} features>")
    }

    /// What its author calls it.
    #[getter]
    fn name(&self) -> Option<&str> {
        self.inner.name.as_deref()
    }

    #[setter]
    fn set_name(&mut self, name: Option<String>) {
        self.inner.name = name;
    }

    /// How many joints it has.
    #[getter]
    fn n_joints(&self) -> usize {
        self.inner.robot.joints.len()
    }

    /// Names of the joints, from base to tip.
    #[getter]
    fn joint_names(&self) -> Vec<&str> {
        self.inner.robot.joints.iter().map(|joint| joint.name.as_str()).collect()
    }

    /// ``"revolute"`` or ``"prismatic"`` for every joint.
    #[getter]
    fn joint_types(&self) -> Vec<&'static str> {
        let name = |kind| match kind {
            JointKind::Revolute => "revolute",
            JointKind::Prismatic => "prismatic",
        };
        self.inner.robot.joints.iter().map(|joint| name(joint.kind)).collect()
    }

    /// Names of the cameras, in the file's order.
    #[getter]
    fn camera_names(&self) -> Vec<&str> {
        self.inner.cameras.iter().map(|camera| camera.name.as_str()).collect()
    }

    /// Names of the features, in the file's order: that of the arrays of ``predict``.
    #[getter]
    fn feature_names(&self) -> Vec<&str> {
        self.inner.features.iter().map(|feature| feature.name.as_str()).collect()
    }

    /// Names of the targets (tags and boards that are seen as whole poses), in the file's order.
    #[getter]
    fn target_names(&self) -> Vec<&str> {
        self.inner.targets.iter().map(|target| target.name.as_str()).collect()
    }

    /// Smallest reading of every joint [rad or m], -inf where unlimited; shape (n_joints,).
    #[getter]
    fn lower<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.lower, f64::NEG_INFINITY))
    }

    #[setter]
    fn set_lower(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("lower", &values, |limits| &mut limits.lower)
    }

    /// Largest reading of every joint [rad or m], inf where unlimited; shape (n_joints,).
    #[getter]
    fn upper<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.upper, f64::INFINITY))
    }

    #[setter]
    fn set_upper(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("upper", &values, |limits| &mut limits.upper)
    }

    /// Largest speed of every joint [rad/s or m/s], inf where unlimited; shape (n_joints,).
    #[getter]
    fn max_velocity<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.velocity, f64::INFINITY))
    }

    #[setter]
    fn set_max_velocity(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("max_velocity", &values, |limits| &mut limits.velocity)
    }

    /// Largest acceleration of every joint [rad/s² or m/s²], inf where unlimited; shape (n_joints,).
    #[getter]
    fn max_acceleration<'py>(&self, py: Python<'py>) -> NewArray<'py> {
        array(py, &[self.n_joints()], self.limit(|limits| limits.acceleration, f64::INFINITY))
    }

    #[setter]
    fn set_max_acceleration(&mut self, values: Floats<'_>) -> PyResult<()> {
        self.set_limit("max_acceleration", &values, |limits| &mut limits.acceleration)
    }

    /// Width and height of a camera's images [px], where the rig says so.
    fn image_size(&self, camera: &str) -> PyResult<Option<(u32, u32)>> {
        Ok(self.camera(camera)?.size.map(|[width, height]| (width, height)))
    }

    /// The lens model of a camera: ``"pinhole"``, ``"brown-conrady"``, ``"rational"``, ``"kannala-brandt"``; ``None`` where unknown.
    fn lens_model(&self, camera: &str) -> PyResult<Option<&'static str>> {
        Ok(self.camera(camera)?.model.map(|model| model.name()))
    }

    /// The matrix K of a camera [px], shape (3, 3), as OpenCV has it.
    ///
    /// Raises ``UnusableInput`` where fx, fy, cx or cy are unknown.
    fn camera_matrix<'py>(&self, py: Python<'py>, camera: &str) -> PyResult<NewArray<'py>> {
        let camera = self.camera(camera)?;
        let (Some(fx), Some(fy), Some(cx), Some(cy)) = (camera.fx, camera.fy, camera.cx, camera.cy) else {
            return Err(unusable(format!("camera `{}`: fx, fy, cx or cy is unknown", camera.name)));
        };
        Ok(array(py, &[3, 3], vec![fx, 0.0, cx, 0.0, fy, cy, 0.0, 0.0, 1.0]))
    }

    /// What a camera, a feature or a target is fixed to: ``"world"``, ``"tip"`` or the name of a joint, whose link it is. ``path``:
    /// ``"cameras.left"``, ``"features.f0"``, ``"targets.board"``.
    fn parent(&self, path: &str) -> PyResult<String> {
        let rig = &self.inner;
        let found = match path.split_once('.') {
            Some(("cameras", name)) => rig.cameras.iter().find(|one| one.name == name).map(|one| one.parent),
            Some(("features", name)) => rig.features.iter().find(|one| one.name == name).map(|one| one.parent),
            Some(("targets", name)) => rig.targets.iter().find(|one| one.name == name).map(|one| one.parent),
            _ => None,
        };
        match found {
            Some(Parent::World) => Ok("world".to_owned()),
            Some(Parent::Tip) => Ok("tip".to_owned()),
            Some(Parent::Link(joint)) => Ok(rig.robot.joints[joint].name.clone()),
            None => Err(PyKeyError::new_err(format!("the rig has no `{path}`, such as cameras.NAME or features.NAME"))),
        }
    }

    /// Paths of everything that can be learned, in the file's order.
    fn parameters(&self) -> Vec<String> {
        self.inner.parameters().iter().map(|parameter| parameter.path(&self.inner)).collect()
    }

    fn __getitem__<'py>(&self, py: Python<'py>, path: &str) -> PyResult<Option<Bound<'py, PyAny>>> {
        let parameter = self.parameter(path)?;
        Ok(match self.inner.value(&parameter) {
            None => None,
            Some(Value::Number(number)) => Some(number.into_pyobject(py)?.into_any()),
            Some(Value::Numbers(numbers)) => Some(array(py, &[numbers.len()], numbers).into_any()),
            Some(Value::Pose(pose)) => Some(homogeneous(py, &pose).into_any()),
        })
    }

    fn __setitem__(&mut self, path: &str, value: Option<Floats<'_>>) -> PyResult<()> {
        let parameter = self.parameter(path)?;
        let value = match value {
            None => None,
            Some(floats) => {
                let view = floats.as_array();
                let is_pose =
                    matches!(parameter, Parameter::Base | Parameter::CameraPose(_) | Parameter::TargetPose(_));
                Some(match view.ndim() {
                    _ if is_pose => Value::Pose(pose(path, view)?),
                    0 => Value::Number(view[[]]),
                    1 => Value::Numbers(view.iter().copied().collect()),
                    _ => return Err(unusable(format!("{path}: shape {:?} is that of no value", view.shape()))),
                })
            }
        };
        self.inner.set_value(&parameter, value).map_err(raise)
    }

    fn __delitem__(&mut self, path: &str) -> PyResult<()> {
        let parameter = self.parameter(path)?;
        self.inner.set_value(&parameter, None).map_err(raise)
    }

    fn __contains__(&self, path: &str) -> bool {
        self.inner.parameter(path).is_ok_and(|parameter| self.inner.has_value(&parameter))
    }

    /// True where every value is given, so that pixels can be predicted.
    #[getter]
    fn is_complete(&self) -> bool {
        Model::new(&self.inner).is_ok()
    }

    /// Paths of parameters that are held at their values when the rig is learned; ``*`` stands for any part of a name.
    #[getter]
    fn fixed(&self) -> Vec<String> {
        self.inner.estimate.fixed.clone()
    }

    #[setter]
    fn set_fixed(&mut self, paths: Vec<String>) -> PyResult<()> {
        self.change(|rig| rig.estimate.fixed = paths)
    }

    /// Standard deviations of Gaussian priors around values, by parameter path [unit of the value]; ``*`` stands for any part of a name.
    #[getter]
    fn prior(&self) -> BTreeMap<String, f64> {
        self.inner.estimate.prior.clone()
    }

    #[setter]
    fn set_prior(&mut self, prior: BTreeMap<String, f64>) -> PyResult<()> {
        self.change(|rig| rig.estimate.prior = prior)
    }

    /// Standard deviations of what is measured and commanded, as the table ``[noise]`` of rig files has them: ``pixels`` [px], ``points``
    /// [m], ``joints`` and ``joint_action`` [rad or m], and as pairs (translation [m], rotation [rad]) ``pose``, ``pose_action`` and
    /// ``target`` (``None``: estimated). Changed by ``set_noise``.
    #[getter]
    fn noise<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let noise = &self.inner.noise;
        let pair = |noise: PoseNoise| (noise.xyz, noise.rot);
        let dict = PyDict::new(py);
        dict.set_item("pixels", noise.pixels)?;
        dict.set_item("points", noise.points)?;
        dict.set_item("joints", noise.joints)?;
        dict.set_item("pose", pair(noise.pose))?;
        dict.set_item("target", noise.target.map(pair))?;
        dict.set_item("joint_action", noise.joint_action)?;
        dict.set_item("pose_action", pair(noise.pose_action))?;
        Ok(dict)
    }

    /// Changes standard deviations of what is measured and commanded; what is not named stays. Units: see ``noise``.
    #[pyo3(signature = (*, pixels=None, points=None, joints=None, pose=None, target=None, joint_action=None, pose_action=None))]
    #[expect(clippy::too_many_arguments, reason = "one keyword per noise")]
    fn set_noise(
        &mut self,
        pixels: Option<f64>,
        points: Option<f64>,
        joints: Option<f64>,
        pose: Option<(f64, f64)>,
        target: Option<(f64, f64)>,
        joint_action: Option<f64>,
        pose_action: Option<(f64, f64)>,
    ) -> PyResult<()> {
        let both = |(xyz, rot): (f64, f64)| PoseNoise { xyz, rot };
        self.change(|rig| {
            let noise = &mut rig.noise;
            noise.pixels = pixels.unwrap_or(noise.pixels);
            noise.points = points.unwrap_or(noise.points);
            noise.joints = joints.unwrap_or(noise.joints);
            noise.pose = pose.map_or(noise.pose, both);
            noise.target = target.map(both).or(noise.target);
            noise.joint_action = joint_action.unwrap_or(noise.joint_action);
            noise.pose_action = pose_action.map_or(noise.pose_action, both);
        })
    }

    /// Standard deviations of what was learned, by parameter path: poses as (3 translations [m], 3 of the rotation vector [rad]), points
    /// as three, numbers as one; shape (6,), (3,) or (1,). Empty where the rig was not learned.
    #[getter]
    fn deviations<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let dict = PyDict::new(py);
        for (path, numbers) in self.inner.fit.iter().flat_map(|fit| &fit.sd) {
            dict.set_item(path, array(py, &[numbers.len()], numbers.clone()))?;
        }
        Ok(dict)
    }

    /// Forward kinematics: world_from_tip at joint readings [rad or m].
    ///
    /// joints: shape (n_joints,) or (samples, n_joints). Returns (4, 4) or (samples, 4, 4).
    fn forward<'py>(&self, py: Python<'py>, joints: Floats<'py>) -> PyResult<NewArray<'py>> {
        let chain = self.arm()?.joint_chain();
        let (samples, is_one) = rows_of("joints", &joints, chain.len())?;
        let numbers = samples.iter().flat_map(|joints| rows(&chain.tip(joints))).collect();
        Ok(array(py, &shape(samples.len(), is_one, &[4, 4]), numbers))
    }

    /// Pose in the world of every link, the base first and the tip last.
    ///
    /// joints: shape (n_joints,) or (samples, n_joints). Returns (n_joints + 1, 4, 4) or (samples, n_joints + 1, 4, 4).
    fn links<'py>(&self, py: Python<'py>, joints: Floats<'py>) -> PyResult<NewArray<'py>> {
        let model = self.arm()?;
        let n = model.chain.len();
        let (samples, is_one) = rows_of("joints", &joints, n)?;
        let numbers = samples.iter().flat_map(|joints| model.links(joints)).flat_map(|pose| rows(&pose)).collect();
        Ok(array(py, &shape(samples.len(), is_one, &[n + 1, 4, 4]), numbers))
    }

    /// Geometric Jacobian of the tip in the world: how it turns [rad], then how its origin moves [m], per unit of every joint.
    ///
    /// joints: shape (n_joints,) or (samples, n_joints). Returns (6, n_joints) or (samples, 6, n_joints).
    fn jacobian<'py>(&self, py: Python<'py>, joints: Floats<'py>) -> PyResult<NewArray<'py>> {
        let chain = self.arm()?.joint_chain();
        let n = chain.len();
        let (samples, is_one) = rows_of("joints", &joints, n)?;
        let mut posture = Default::default();
        let mut numbers = vec![0.0; samples.len() * 6 * n];
        for (joints, rows) in samples.iter().zip(numbers.chunks_exact_mut((6 * n).max(1))) {
            chain.posture(joints, &mut posture);
            let tip = posture.tip().translation;
            for (i, axis) in posture.axes.iter().enumerate() {
                let (w, v) = axis.twist(&tip);
                (0..3).for_each(|k| (rows[k * n + i], rows[(3 + k) * n + i]) = (w[k], v[k]));
            }
        }
        Ok(array(py, &shape(samples.len(), is_one, &[6, n]), numbers))
    }

    /// Where every camera sees every feature [px], in the order of ``feature_names``; NaN for features behind a camera, and with
    /// ``in_image`` for those outside its image.
    ///
    /// joints: shape (n_joints,) or (samples, n_joints). Returns camera -> (n_features, 2) or (samples, n_features, 2).
    /// Raises ``UnusableInput`` where the rig is not complete.
    #[pyo3(signature = (joints, *, in_image = false))]
    fn predict<'py>(&self, py: Python<'py>, joints: Floats<'py>, in_image: bool) -> PyResult<Bound<'py, PyDict>> {
        let model = self.model()?;
        let (samples, is_one) = rows_of("joints", &joints, model.chain.len())?;
        let n = model.features.len();
        let mut of_camera = vec![Vec::with_capacity(2 * n * samples.len()); model.cameras.len()];
        for joints in &samples {
            let links = model.links(joints);
            for (index, (camera, numbers)) in model.cameras.iter().zip(&mut of_camera).enumerate() {
                let size = self.inner.cameras[index].size.filter(|_| in_image);
                for feature in 0..n {
                    let point = model.in_camera(index, feature, &links);
                    let pixel = camera.model.project(&camera.intrinsics, &point);
                    let is_seen = camera.model.is_in_front(&point) && size.is_none_or(|size| is_inside(size, pixel));
                    numbers.extend(if is_seen { pixel } else { [f64::NAN; 2] });
                }
            }
        }
        let dict = PyDict::new(py);
        for ((camera, lens), numbers) in self.inner.cameras.iter().zip(&model.cameras).zip(of_camera) {
            if lens.has_lens() {
                dict.set_item(&camera.name, array(py, &shape(samples.len(), is_one, &[n, 2]), numbers))?;
            }
        }
        Ok(dict)
    }

    /// Every feature in the frame of every camera [m], in the order of ``feature_names``, wherever it is.
    ///
    /// joints: shape (n_joints,) or (samples, n_joints). Returns camera -> (n_features, 3) or (samples, n_features, 3).
    fn predict_points<'py>(&self, py: Python<'py>, joints: Floats<'py>) -> PyResult<Bound<'py, PyDict>> {
        let model = self.model()?;
        let (samples, is_one) = rows_of("joints", &joints, model.chain.len())?;
        let n = model.features.len();
        let links: Vec<_> = samples.iter().map(|joints| model.links(joints)).collect();
        let dict = PyDict::new(py);
        for (index, camera) in self.inner.cameras.iter().enumerate() {
            let points = links.iter().flat_map(|links| (0..n).map(|feature| model.in_camera(index, feature, links)));
            let numbers = points.flat_map(|point| [point.x, point.y, point.z]).collect();
            dict.set_item(&camera.name, array(py, &shape(samples.len(), is_one, &[n, 3]), numbers))?;
        }
        Ok(dict)
    }
}

impl Rig {
    /// The model of the arm alone: cameras and features may be unknown.
    fn arm(&self) -> PyResult<Model> {
        Model::new(&rig::Rig { robot: self.inner.robot.clone(), ..rig::Rig::default() }).map_err(raise)
    }
}

/// The shape of an array with one entry per sample, or of its only entry.
fn shape(samples: usize, is_one: bool, of_one: &[usize]) -> Vec<usize> {
    if is_one { of_one.to_vec() } else { [&[samples], of_one].concat() }
}

fn is_inside([width, height]: [u32; 2], [u, v]: [f64; 2]) -> bool {
    let within = |x: f64, size: u32| x >= -0.5 && x < f64::from(size) - 0.5;
    within(u, width) && within(v, height)
}

/// Names of the rigs that come with handeye, for ``Rig.load``.
#[pyfunction]
pub fn shipped_rigs() -> Vec<&'static str> {
    catalog::ALL.iter().map(|(name, _)| *name).collect()
}
