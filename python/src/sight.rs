//! What is seen at a moment, as a dictionary of arrays in Python and as a list of sightings in Rust.
use crate::arrays::Floats;
use crate::errors::unusable;
use handeye::infer::{PointSighting, Sighting};
use handeye::rig::Rig;
use numpy::{PyArray2, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyString};
use std::sync::Arc;

/// Names of the cameras, and how many features there are: what a dictionary of arrays is read by.
#[derive(Clone)]
pub struct Layout {
    cameras: Arc<[String]>,
    n_features: usize,
}

impl Layout {
    pub fn of(rig: &Rig) -> Self {
        let cameras = rig.cameras.iter().map(|camera| camera.name.clone()).collect();
        Layout { cameras, n_features: rig.features.len() }
    }

    pub fn new(cameras: Vec<String>, n_features: usize) -> Self {
        Layout { cameras: cameras.into(), n_features }
    }

    /// Refuses what is of another rig: indices of a camera and a feature that are not here.
    pub fn check_has(&self, whose: &str, camera: usize, feature: usize) -> PyResult<()> {
        is_known(whose, "camera", camera, self.cameras.len())?;
        is_known(whose, "feature", feature, self.n_features)
    }

    /// Pixels: camera -> (n_features, 2), NaN where not seen.
    pub fn pixels(&self, pixels: &Bound<'_, PyDict>, found: &mut Vec<Sighting>) -> PyResult<()> {
        found.clear();
        self.each(pixels, |camera, feature, pixel| found.push(Sighting { camera, feature, pixel }))
    }

    /// Points: depth camera -> (n_features, 3), NaN where not seen.
    pub fn points(&self, points: Option<&Bound<'_, PyDict>>) -> PyResult<Vec<PointSighting>> {
        let mut found = Vec::new();
        if let Some(points) = points {
            self.each(points, |camera, feature, point| found.push(PointSighting { camera, feature, point }))?;
        }
        Ok(found)
    }

    pub fn camera(&self, name: &str) -> PyResult<usize> {
        self.cameras
            .iter()
            .position(|camera| camera == name)
            .ok_or_else(|| unusable(format!("camera `{name}` is not known (known: {})", self.cameras.join(", "))))
    }

    fn each<const N: usize>(
        &self,
        arrays: &Bound<'_, PyDict>,
        mut add: impl FnMut(usize, usize, [f64; N]),
    ) -> PyResult<()> {
        for (name, array) in arrays {
            let name = name.cast::<PyString>()?;
            let name = name.to_cow()?;
            let camera = self.camera(&name)?;
            // An array of floats is copied as it is; everything else is made one by numpy.
            let numbers = match array.cast::<PyArray2<f64>>() {
                Ok(array) if array.is_c_contiguous() => {
                    self.check(&name, array.shape(), N)?;
                    array.to_vec()?
                }
                _ => {
                    let array: Floats<'_> = array.extract()?;
                    self.check(&name, array.shape(), N)?;
                    array.as_array().iter().copied().collect()
                }
            };
            for (feature, numbers) in numbers.as_chunks::<N>().0.iter().enumerate() {
                if !numbers.iter().any(|number| number.is_nan()) {
                    add(camera, feature, *numbers);
                }
            }
        }
        Ok(())
    }

    fn check(&self, name: &str, shape: &[usize], width: usize) -> PyResult<()> {
        let n = self.n_features;
        if shape == [n, width] {
            return Ok(());
        }
        Err(unusable(format!(
            "camera `{name}`: shape {shape:?}, and ({n}, {width}) would do, in the order of the features"
        )))
    }
}

/// Refuses the index of something that a rig does not have.
pub fn is_known(whose: &str, what: &str, index: usize, n: usize) -> PyResult<()> {
    let problem = || unusable(format!("{whose}: one is of {what} {index} (from 0) of its rig, and this one has {n}"));
    if index < n { Ok(()) } else { Err(problem()) }
}
