//! How far a learned rig may be off.
use crate::arrays::{Floats, NewArray, array, list};
use crate::errors::raise;
use crate::rig::AnyRig;
use crate::sight::Layout;
use handeye::{rig, servo};
use pyo3::prelude::*;
use std::sync::Arc;

/// How far a learned rig may be off in what it predicts, from the standard deviations of its numbers: for the margins of limits.
#[pyclass(module = "handeye.servo", frozen)]
pub struct PredictionBounds {
    inner: servo::PredictionBounds,
    layout: Layout,
    rig: Arc<rig::Rig>,
}

#[pymethods]
impl PredictionBounds {
    /// rig: one that was learned.
    #[new]
    fn new(rig: AnyRig<'_>) -> PyResult<Self> {
        let inner = servo::PredictionBounds::new(&rig.inner).map_err(raise)?;
        Ok(PredictionBounds { inner, layout: Layout::of(&rig.inner), rig: Arc::new(rig.inner.clone()) })
    }

    /// Bounds of the standard deviations of all predicted pixels of a camera [px], the larger of u and v: shape (n_features,).
    fn pixels<'py>(&self, py: Python<'py>, joints: Floats<'_>, camera: &str) -> PyResult<NewArray<'py>> {
        let joints = list("joints", &joints, self.rig.robot.joints.len())?;
        let camera = self.layout.camera(camera)?;
        let n = self.rig.features.len();
        let bounds = (0..n).map(|feature| self.inner.pixel(&joints, camera, feature).unwrap_or(f64::NAN)).collect();
        Ok(array(py, &[n], bounds))
    }

    /// Bound of the standard deviation of the tip's position [m], along whichever direction.
    fn tip(&self, joints: Floats<'_>) -> PyResult<f64> {
        Ok(self.inner.tip(&list("joints", &joints, self.rig.robot.joints.len())?))
    }
}
