//! Where links and features are, and where they are seen.
use super::Rig;
use crate::arrays::{Floats, NewArray, array, rows, rows_of};
use crate::errors::raise;
use handeye::rig::{self, Model};
use pyo3::prelude::*;
use pyo3::types::PyDict;

impl Rig {
    /// The model of the arm alone: cameras and features may be unknown.
    fn arm(&self) -> PyResult<Model> {
        Model::new(&rig::Rig { robot: self.inner.robot.clone(), ..rig::Rig::default() }).map_err(raise)
    }
}

#[pymethods]
impl Rig {
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
        let (mut posture, mut columns) = (Default::default(), vec![[0.0; 6]; n]);
        let mut numbers = vec![0.0; samples.len() * 6 * n];
        for (joints, rows) in samples.iter().zip(numbers.chunks_exact_mut((6 * n).max(1))) {
            chain.posture(joints, &mut posture);
            posture.jacobian(&mut columns);
            for (i, column) in columns.iter().enumerate() {
                (0..6).for_each(|k| rows[k * n + i] = column[k]);
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
                let size = self.inner.cameras[index].size.filter(|_| in_image).map(|size| size.map(f64::from));
                for feature in 0..n {
                    let point = model.in_camera(index, feature, &links);
                    let seen = match size {
                        Some(size) => camera.pixel_inside(size, &point),
                        None if camera.model.is_in_front(&point) => {
                            Some(camera.model.project(&camera.intrinsics, &point))
                        }
                        None => None,
                    };
                    numbers.extend(seen.unwrap_or([f64::NAN; 2]));
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

/// The shape of an array with one entry per sample, or of its only entry.
fn shape(samples: usize, is_one: bool, of_one: &[usize]) -> Vec<usize> {
    if is_one { of_one.to_vec() } else { [&[samples], of_one].concat() }
}
