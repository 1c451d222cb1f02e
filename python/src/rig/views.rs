//! What cameras and features are, beside their numbers.
use super::Rig;
use crate::arrays::{NewArray, array};
use crate::errors::unusable;
use handeye::rig::{Camera, Parent};
use pyo3::exceptions::PyKeyError;
use pyo3::prelude::*;

impl Rig {
    pub fn camera(&self, name: &str) -> PyResult<&Camera> {
        let found = self.inner.cameras.iter().find(|camera| camera.name == name);
        found.ok_or_else(|| {
            let known: Vec<&str> = self.inner.cameras.iter().map(|camera| camera.name.as_str()).collect();
            unusable(format!("the rig has no camera `{name}` (known: {})", known.join(", ")))
        })
    }
}

#[pymethods]
impl Rig {
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
}
