//! The arm between two links of a URDF, with fixed joints folded into their neighbours.
use super::document::{Joint, Urdf};
use super::rows::rows;
use super::xml::child;
use crate::Error;
use crate::chain::{JointKind, LINK_PARAMETERS};
use crate::geometry::orientation;
use handeye_solvers::Pose;
use nalgebra::Vector3;

/// An arm as rows of the modified convention (`Convention::ModifiedDh`), with the frames of the URDF's links.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    /// The link that the arm stands on.
    pub base: String,
    /// `base_from_start`, where the first row begins.
    pub start: Pose,
    /// Joints that move, from base to tip.
    pub joints: Vec<ArmJoint>,
}

/// A joint that moves.
#[derive(Clone, Debug, PartialEq)]
pub struct ArmJoint {
    /// Its name.
    pub name: String,
    /// Its link; the last joint's is the tip.
    pub link: String,
    /// Turning or sliding.
    pub kind: JointKind,
    /// offset, d, a, alpha, beta [rad, m].
    pub row: [f64; LINK_PARAMETERS],
    /// True where its axis is nearly parallel to the one before, so that beta is needed to tilt it freely.
    pub has_beta: bool,
    /// `row_from_link`: the link's frame in the one that the row makes.
    pub frame: Pose,
    /// Smallest and largest reading [rad or m].
    pub range: Option<[f64; 2]>,
    /// Largest speed [rad/s or m/s].
    pub velocity: Option<f64>,
}

/// The arm's joints as the URDF has them.
pub(super) struct Path {
    /// Joints that move, from base to tip.
    pub(super) moving: Vec<Moving>,
    /// From the link of the last of them to the tip.
    pub(super) tool: Pose,
}

/// A joint that moves, as the URDF has it.
pub(super) struct Moving {
    pub(super) joint: usize,
    pub(super) kind: JointKind,
    /// Fixed joints before it: from the link of the joint before, or the base.
    pub(super) before: Pose,
    /// Its own <origin>.
    pub(super) origin: Pose,
    /// Unit vector in its link's frame.
    pub(super) axis: Vector3<f64>,
}

impl Urdf<'_> {
    /// The arm from one link to another, that hangs on it by joints which move.
    ///
    /// Errors: [`Error::Malformed`] where a joint between them is of another kind, mimics another or is not whole, and
    /// [`Error::Unusable`] where there is no such arm.
    pub fn arm(&self, base: &str, tip: &str) -> Result<Arm, Error> {
        let Path { moving, tool } = self.path(base, tip)?;
        let (start, placed) = rows(&moving, &tool);
        let mut joints = Vec::with_capacity(moving.len());
        for (moving, placed) in moving.iter().zip(placed) {
            let joint = &self.joints[moving.joint];
            let (range, velocity) = self.limits(joint)?;
            joints.push(ArmJoint {
                name: joint.name.to_owned(),
                link: joint.child.to_owned(),
                kind: moving.kind,
                row: placed.row,
                has_beta: placed.has_beta,
                frame: placed.frame,
                range,
                velocity,
            });
        }
        if let Some(last) = joints.last_mut() {
            tip.clone_into(&mut last.link);
        }
        Ok(Arm { base: base.to_owned(), start, joints })
    }

    /// The joints from base to tip. The base may hang on the arm's first link by fixed joints instead of carrying it.
    pub(super) fn path(&self, base: &str, tip: &str) -> Result<Path, Error> {
        let [base, tip] = [base, tip].map(|link| self.link(link).map_err(Error::Unusable));
        let (base, tip) = (base?, tip?);
        let mut descent = self.ascent(tip);
        let mut pending = Pose::identity();
        let mut top = base;
        for joint in self.ascent(base) {
            let joint_above = &self.joints[joint];
            if tip == top
                || descent.iter().any(|&joint| self.joints[joint].parent == top)
                || joint_above.kind != "fixed"
            {
                break;
            }
            pending = pending * self.origin(joint_above)?.inverse();
            top = joint_above.parent;
        }
        let Some(end) = descent.iter().position(|&joint| self.joints[joint].parent == top) else {
            let file = self.source.file;
            return Err(Error::Unusable(format!("{file}: no joints lead from link `{base}` to link `{tip}`")));
        };
        descent.truncate(end + 1);
        let mut moving = Vec::new();
        for &joint in descent.iter().rev() {
            let origin = self.origin(&self.joints[joint])?;
            match self.kind(&self.joints[joint])? {
                None => pending = pending * origin,
                Some(kind) => {
                    let axis = self.axis(&self.joints[joint])?;
                    moving.push(Moving { joint, kind, before: pending, origin, axis });
                    pending = Pose::identity();
                }
            }
        }
        if moving.is_empty() {
            let file = self.source.file;
            return Err(Error::Unusable(format!("{file}: nothing moves between link `{base}` and link `{tip}`")));
        }
        Ok(Path { moving, tool: pending })
    }

    /// `None` for a fixed joint.
    fn kind(&self, joint: &Joint) -> Result<Option<JointKind>, Error> {
        let node = self.node(joint);
        let kind = match joint.kind {
            "fixed" => return Ok(None),
            "revolute" | "continuous" => JointKind::Revolute,
            "prismatic" => JointKind::Prismatic,
            other => {
                let place = self.source.attribute(node, joint.name, "type")?.range_value().start;
                let problem = match other {
                    "floating" | "planar" => "an arm is a chain of joints with one reading each",
                    _ => "known: revolute, continuous, prismatic, fixed",
                };
                return Err(self
                    .source
                    .error(place, format!("joint `{}` is of type `{other}` ({problem})", joint.name)));
            }
        };
        if let Some(mimic) = child(node, "mimic") {
            let leader = mimic.attribute("joint").unwrap_or_default();
            let problem = format!(
                "joint `{}` mimics `{leader}`: on the way to the tip every joint has a reading of its own",
                joint.name
            );
            return Err(self.source.error(mimic.range().start, problem));
        }
        Ok(Some(kind))
    }

    fn node(&self, joint: &Joint) -> roxmltree::Node<'_, '_> {
        self.document.get_node(joint.node).unwrap_or_else(|| self.document.root_element())
    }

    fn origin(&self, joint: &Joint) -> Result<Pose, Error> {
        let Some(origin) = child(self.node(joint), "origin") else { return Ok(Pose::identity()) };
        let what = format!("joint `{}`: <origin>", joint.name);
        if let Some(attribute) = origin.attribute_node("quat_xyzw") {
            return Err(self
                .source
                .error(attribute.range().start, format!("{what}: `quat_xyzw` is not read, `rpy` would do")));
        }
        let numbers = |name: &str| match origin.attribute_node(name) {
            Some(attribute) => self.source.numbers::<3>(attribute, &what),
            None => Ok([0.0; 3]),
        };
        Ok(Pose { rotation: orientation::from_rpy(numbers("rpy")?), translation: Vector3::from(numbers("xyz")?) })
    }

    fn axis(&self, joint: &Joint) -> Result<Vector3<f64>, Error> {
        let Some(axis) = child(self.node(joint), "axis") else { return Ok(Vector3::x()) };
        let what = format!("joint `{}`: <axis>", joint.name);
        let attribute = self.source.attribute(axis, &what, "xyz")?;
        let axis = Vector3::from(self.source.numbers::<3>(attribute, &what)?);
        let largest = axis.amax();
        if largest < 1e-9 {
            return Err(self
                .source
                .error(attribute.range_value().start, format!("{what}: an axis of length 0 has no direction")));
        }
        Ok((axis / largest).normalize())
    }

    /// Range and largest speed. A speed of 0 is what files write that do not know it.
    fn limits(&self, joint: &Joint) -> Result<(Option<[f64; 2]>, Option<f64>), Error> {
        let Some(limit) = child(self.node(joint), "limit") else { return Ok((None, None)) };
        let what = format!("joint `{}`: <limit>", joint.name);
        let number = |name: &str| {
            limit.attribute_node(name).map(|attribute| self.source.numbers::<1>(attribute, &what)).transpose()
        };
        let (lower, upper, velocity) = (number("lower")?, number("upper")?, number("velocity")?);
        let velocity = velocity.map(|[v]| v).filter(|v| *v > 0.0);
        if joint.kind == "continuous" || lower.is_none() && upper.is_none() {
            return Ok((None, velocity));
        }
        let [[lower], [upper]] = [lower, upper].map(Option::unwrap_or_default);
        if lower > upper {
            let problem = format!("{what}: `lower` is {lower}, which is above `upper`, {upper}");
            return Err(self.source.error(limit.range().start, problem));
        }
        Ok((Some([lower, upper]), velocity))
    }
}
