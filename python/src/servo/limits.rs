//! Limits: what must not happen on the way.
use super::tasks::positive;
use crate::arrays::{Floats, pose, three};
use crate::errors::unusable;
use crate::rig::{AnyRig, Rig};
use crate::sight::{Layout, is_known};
use handeye::servo::limits::{self, Guide};
use handeye::servo::{Arm, Configuration, LimitRows};
use pyo3::prelude::*;

/// What must not happen on the way: the base class of all limits. Those of the joints are the rig's, and hard.
///
/// Limits give way only where they cannot all hold, the weakest first: ``strength``, from 1 to 100.
#[pyclass(module = "handeye.servo", subclass, frozen)]
pub struct Limit {
    pub inner: Kind,
}

pub enum Kind {
    HalfSpace(limits::HalfSpace),
    InImage(limits::InImage),
    LinkDistance(limits::LinkDistance),
    PixelSpeed(limits::PixelSpeed),
    TipBox(limits::TipBox),
    TipSpeed(limits::TipSpeed),
    VirtualFixture(limits::VirtualFixture),
}

impl handeye::servo::Limit for Kind {
    fn rows(&self, arm: &Arm, at: &Configuration, dt: f64, rows: &mut LimitRows) {
        match self {
            Kind::HalfSpace(limit) => limit.rows(arm, at, dt, rows),
            Kind::InImage(limit) => limit.rows(arm, at, dt, rows),
            Kind::LinkDistance(limit) => limit.rows(arm, at, dt, rows),
            Kind::PixelSpeed(limit) => limit.rows(arm, at, dt, rows),
            Kind::TipBox(limit) => limit.rows(arm, at, dt, rows),
            Kind::TipSpeed(limit) => limit.rows(arm, at, dt, rows),
            Kind::VirtualFixture(limit) => limit.rows(arm, at, dt, rows),
        }
    }
}

fn new<T: pyo3::PyClass<BaseType = Limit>>(limit: T, inner: Kind) -> PyClassInitializer<T> {
    PyClassInitializer::from(Limit { inner }).add_subclass(limit)
}

/// Keeps the tip's origin on one side of a plane, normal·p <= offset.
#[pyclass(module = "handeye.servo", extends = Limit, frozen)]
pub struct HalfSpace;

#[pymethods]
impl HalfSpace {
    /// normal: in the world, (3,), pointing out of where the tip may be; its length does not matter. offset: distance of the plane from
    /// the world's origin along it [m].
    #[new]
    #[pyo3(signature = (normal, offset, *, strength = 10.0))]
    fn new(normal: Floats<'_>, offset: f64, strength: f64) -> PyResult<PyClassInitializer<Self>> {
        let normal = three("normal", &normal)?.try_normalize(0.0);
        let normal = normal.ok_or_else(|| unusable("normal: of length 0"))?;
        let strength = positive("strength", strength)?;
        Ok(new(HalfSpace, Kind::HalfSpace(limits::HalfSpace { normal, offset, strength })))
    }
}

/// Keeps features inside a camera's image by a margin; brings those back that are outside.
#[pyclass(module = "handeye.servo", extends = Limit, frozen)]
pub struct InImage;

#[pymethods]
impl InImage {
    /// camera: its name. features: their names, all where left out. margin: how far inside the border [px].
    #[new]
    #[pyo3(signature = (rig, camera, *, features = None, margin = 10.0, strength = 10.0))]
    fn new(
        rig: AnyRig<'_>,
        camera: &str,
        features: Option<Vec<String>>,
        margin: f64,
        strength: f64,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (camera, features) = named(&rig, camera, features)?;
        if rig.inner.cameras[camera].size.is_none() {
            return Err(unusable(format!(
                "camera `{}`: the rig does not say how large its images are",
                rig.inner.cameras[camera].name
            )));
        }
        let strength = positive("strength", strength)?;
        Ok(new(InImage, Kind::InImage(limits::InImage { camera, features, margin, strength })))
    }
}

/// Keeps the speed of features along u and along v below a limit, so that trackers keep up.
#[pyclass(module = "handeye.servo", extends = Limit, frozen)]
pub struct PixelSpeed;

#[pymethods]
impl PixelSpeed {
    /// camera: its name. speed: largest along each axis [px/s]. features: their names, all where left out.
    #[new]
    #[pyo3(signature = (rig, camera, speed, *, features = None, strength = 10.0))]
    fn new(
        rig: AnyRig<'_>,
        camera: &str,
        speed: f64,
        features: Option<Vec<String>>,
        strength: f64,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (camera, features) = named(&rig, camera, features)?;
        let (speed, strength) = (positive("speed", speed)?, positive("strength", strength)?);
        Ok(new(PixelSpeed, Kind::PixelSpeed(limits::PixelSpeed { camera, features, speed, strength })))
    }
}

/// Keeps a point on one link away from a point on another, or on the base: spheres that must not touch.
#[pyclass(module = "handeye.servo", extends = Limit, frozen)]
pub struct LinkDistance;

#[pymethods]
impl LinkDistance {
    /// links: how many joints are before each link, 0 for the base, n_joints for the tip. points: one on each, in its frame, (2, 3) [m].
    /// distance: the least [m].
    #[new]
    #[pyo3(signature = (links, points, distance, *, strength = 10.0))]
    fn new(
        links: [usize; 2],
        points: [Floats<'_>; 2],
        distance: f64,
        strength: f64,
    ) -> PyResult<PyClassInitializer<Self>> {
        let points = [three("points", &points[0])?, three("points", &points[1])?];
        let (distance, strength) = (positive("distance", distance)?, positive("strength", strength)?);
        Ok(new(LinkDistance, Kind::LinkDistance(limits::LinkDistance { links, points, distance, strength })))
    }
}

/// Keeps the tip's origin inside a box that lies anyhow in the world.
#[pyclass(module = "handeye.servo", extends = Limit, frozen)]
pub struct TipBox;

#[pymethods]
impl TipBox {
    /// low, high: coordinates in the box's frame, (3,) [m]; infinite where there is no face. frame: world_from_box, (4, 4); the world's
    /// own where left out.
    #[new]
    #[pyo3(signature = (low, high, *, frame = None, strength = 10.0))]
    fn new(
        low: Floats<'_>,
        high: Floats<'_>,
        frame: Option<Floats<'_>>,
        strength: f64,
    ) -> PyResult<PyClassInitializer<Self>> {
        let (low, high) = (three("low", &low)?, three("high", &high)?);
        if !low.iter().zip(&high).all(|(low, high)| low <= high) {
            return Err(unusable("low, high: the box is empty"));
        }
        let frame = match frame {
            Some(frame) => pose("frame", frame.as_array())?,
            None => handeye::solvers::Pose::identity(),
        };
        Ok(new(TipBox, Kind::TipBox(limits::TipBox { frame, low, high, strength: positive("strength", strength)? })))
    }
}

/// Keeps the speed of the tip's origin below a limit.
#[pyclass(module = "handeye.servo", extends = Limit, frozen)]
pub struct TipSpeed;

#[pymethods]
impl TipSpeed {
    /// speed: the largest [m/s].
    #[new]
    #[pyo3(signature = (speed, *, strength = 10.0))]
    fn new(speed: f64, strength: f64) -> PyResult<PyClassInitializer<Self>> {
        let (speed, strength) = (positive("speed", speed)?, positive("strength", strength)?);
        Ok(new(TipSpeed, Kind::TipSpeed(limits::TipSpeed { speed, strength })))
    }
}

/// Keeps the tip's origin within a tolerance of a line or a plane, along which it is free.
#[pyclass(module = "handeye.servo", extends = Limit, frozen)]
pub struct VirtualFixture;

#[pymethods]
impl VirtualFixture {
    /// point: on the line or plane, in the world, (3,) [m]. direction of the line, or normal of the plane, (3,): one of the two.
    /// tolerance: farthest distance from it [m].
    #[new]
    #[pyo3(signature = (point, *, direction = None, normal = None, tolerance = 1e-3, strength = 10.0))]
    fn new(
        point: Floats<'_>,
        direction: Option<Floats<'_>>,
        normal: Option<Floats<'_>>,
        tolerance: f64,
        strength: f64,
    ) -> PyResult<PyClassInitializer<Self>> {
        let point = three("point", &point)?;
        let guide = match (direction, normal) {
            (Some(direction), None) => Guide::Line(point, three("direction", &direction)?),
            (None, Some(normal)) => Guide::Plane(point, three("normal", &normal)?),
            _ => return Err(unusable("direction of a line or normal of a plane: one of the two is needed")),
        };
        let (tolerance, strength) = (positive("tolerance", tolerance)?, positive("strength", strength)?);
        Ok(new(VirtualFixture, Kind::VirtualFixture(limits::VirtualFixture { guide, tolerance, strength })))
    }
}

/// Limits that are given along, where they fit a robot of so many joints with such cameras and features: those of another rig have other indices.
pub fn those_of<'a>(
    given: Option<&'a [Bound<'_, Limit>]>,
    layout: &Layout,
    n_joints: usize,
) -> PyResult<Vec<&'a Kind>> {
    let fits = |limit: &'a Bound<'_, Limit>| {
        let kind = &limit.get().inner;
        match kind {
            Kind::InImage(limits::InImage { camera, features, .. })
            | Kind::PixelSpeed(limits::PixelSpeed { camera, features, .. }) => {
                features.iter().try_for_each(|feature| layout.check_has("limits", *camera, *feature))?;
            }
            Kind::LinkDistance(limit) => {
                limit.links.iter().try_for_each(|link| is_known("limits", "link", *link, n_joints + 1))?
            }
            Kind::HalfSpace(_) | Kind::TipBox(_) | Kind::TipSpeed(_) | Kind::VirtualFixture(_) => {}
        }
        Ok(kind)
    };
    given.into_iter().flatten().map(fits).collect()
}

/// Indices of a camera and of features, all where none is named.
fn named(rig: &Rig, camera: &str, features: Option<Vec<String>>) -> PyResult<(usize, Vec<usize>)> {
    let known = &rig.inner.features;
    let index = |name: &String| {
        let found = known.iter().position(|feature| feature.name == *name);
        found.ok_or_else(|| unusable(format!("the rig has no feature `{name}`")))
    };
    let features = match features {
        Some(names) => names.iter().map(index).collect::<PyResult<_>>()?,
        None => (0..known.len()).collect(),
    };
    Ok((Layout::of(&rig.inner).camera(camera)?, features))
}
