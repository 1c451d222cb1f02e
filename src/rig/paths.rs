//! Parameter paths: the names by which files and reports call what can be learned of a rig.
use super::{Joint, Rig};

/// Something that can be learned, by index into the rig's lists.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Parameter {
    /// `robot.base`
    Base,
    /// `robot.joints.NAME.FIELD`
    JointField {
        /// Index of the joint.
        joint: usize,
        /// Which of its numbers.
        field: JointField,
    },
    /// `cameras.NAME.pose`
    CameraPose(usize),
    /// `cameras.NAME.FIELD`
    CameraField {
        /// Index of the camera.
        camera: usize,
        /// Which of its intrinsics.
        field: CameraField,
    },
    /// `features.NAME.xyz`
    FeatureXyz(usize),
    /// `targets.NAME.pose`
    TargetPose(usize),
}

/// A number of a joint.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum JointField {
    /// [`Joint::offset`]
    Offset,
    /// [`Joint::d`]
    D,
    /// [`Joint::a`]
    A,
    /// [`Joint::alpha`]
    Alpha,
    /// [`Joint::beta`], which only some joints have.
    Beta,
}

/// Intrinsics of a camera: four numbers, and the list of distortion coefficients.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum CameraField {
    /// [`super::Camera::fx`]
    Fx,
    /// [`super::Camera::fy`]
    Fy,
    /// [`super::Camera::cx`]
    Cx,
    /// [`super::Camera::cy`]
    Cy,
    /// [`super::Camera::distortion`]
    Distortion,
}

impl JointField {
    /// Every field, in the order of [`Rig::parameters`].
    pub const ALL: &'static [JointField] =
        &[JointField::Offset, JointField::D, JointField::A, JointField::Alpha, JointField::Beta];

    /// Its key in files.
    pub fn name(self) -> &'static str {
        match self {
            JointField::Offset => "offset",
            JointField::D => "d",
            JointField::A => "a",
            JointField::Alpha => "alpha",
            JointField::Beta => "beta",
        }
    }

    /// Its value, where the joint has one.
    pub fn value(self, joint: &Joint) -> Option<f64> {
        match self {
            JointField::Offset => joint.offset,
            JointField::D => joint.d,
            JointField::A => joint.a,
            JointField::Alpha => joint.alpha,
            JointField::Beta => joint.beta,
        }
    }
}

impl CameraField {
    /// Every field, in the order of [`Rig::parameters`].
    pub const ALL: &'static [CameraField] =
        &[CameraField::Fx, CameraField::Fy, CameraField::Cx, CameraField::Cy, CameraField::Distortion];

    /// Its key in files.
    pub fn name(self) -> &'static str {
        match self {
            CameraField::Fx => "fx",
            CameraField::Fy => "fy",
            CameraField::Cx => "cx",
            CameraField::Cy => "cy",
            CameraField::Distortion => "distortion",
        }
    }
}

impl Parameter {
    /// Its path, such as `cameras.left.fx`. The rig is the one that gave the parameter.
    pub fn path(&self, rig: &Rig) -> String {
        match *self {
            Parameter::Base => "robot.base".to_owned(),
            Parameter::JointField { joint, field } => {
                format!("robot.joints.{}.{}", rig.robot.joints[joint].name, field.name())
            }
            Parameter::CameraPose(camera) => format!("cameras.{}.pose", rig.cameras[camera].name),
            Parameter::CameraField { camera, field } => {
                format!("cameras.{}.{}", rig.cameras[camera].name, field.name())
            }
            Parameter::FeatureXyz(feature) => format!("features.{}.xyz", rig.features[feature].name),
            Parameter::TargetPose(target) => format!("targets.{}.pose", rig.targets[target].name),
        }
    }
}

impl Rig {
    /// Everything that can be learned of this rig: base, joints, cameras, features, targets, each in the file's order.
    ///
    /// Left out are the `beta` of joints that have none, the distortion of cameras whose model has none, and the intrinsics of
    /// depth cameras that have none.
    pub fn parameters(&self) -> Vec<Parameter> {
        let mut parameters = vec![Parameter::Base];
        for (index, joint) in self.robot.joints.iter().enumerate() {
            let fields = JointField::ALL.iter().filter(|field| **field != JointField::Beta || joint.beta.is_some());
            parameters.extend(fields.map(|&field| Parameter::JointField { joint: index, field }));
        }
        for (index, camera) in self.cameras.iter().enumerate() {
            parameters.push(Parameter::CameraPose(index));
            if camera.gives_points_alone() {
                continue;
            }
            let distorts = camera.model.is_some_and(|model| !model.distortion().is_empty())
                || camera.distortion.as_ref().is_some_and(|coefficients| !coefficients.is_empty());
            let fields = CameraField::ALL.iter().filter(|field| **field != CameraField::Distortion || distorts);
            parameters.extend(fields.map(|&field| Parameter::CameraField { camera: index, field }));
        }
        parameters.extend((0..self.features.len()).map(Parameter::FeatureXyz));
        parameters.extend((0..self.targets.len()).map(Parameter::TargetPose));
        parameters
    }

    /// True where the rig gives a value. A base that is left out has none, nor has a `beta`: they are identity and 0.
    pub fn has_value(&self, parameter: &Parameter) -> bool {
        match *parameter {
            Parameter::Base => self.robot.base.is_some(),
            Parameter::JointField { joint, field } => field.value(&self.robot.joints[joint]).is_some(),
            Parameter::CameraPose(camera) => self.cameras[camera].pose.is_some(),
            Parameter::CameraField { camera, field } => {
                let camera = &self.cameras[camera];
                match field {
                    CameraField::Fx => camera.fx.is_some(),
                    CameraField::Fy => camera.fy.is_some(),
                    CameraField::Cx => camera.cx.is_some(),
                    CameraField::Cy => camera.cy.is_some(),
                    CameraField::Distortion => camera.distortion.is_some(),
                }
            }
            Parameter::FeatureXyz(feature) => self.features[feature].xyz.is_some(),
            Parameter::TargetPose(target) => self.targets[target].pose.is_some(),
        }
    }

    /// Takes a value out, so that it is unknown.
    pub(crate) fn forget(&mut self, parameter: &Parameter) {
        match *parameter {
            Parameter::Base => self.robot.base = None,
            Parameter::JointField { joint, field } => {
                let joint = &mut self.robot.joints[joint];
                match field {
                    JointField::Offset => joint.offset = None,
                    JointField::D => joint.d = None,
                    JointField::A => joint.a = None,
                    JointField::Alpha => joint.alpha = None,
                    JointField::Beta => joint.beta = None,
                }
            }
            Parameter::CameraPose(camera) => self.cameras[camera].pose = None,
            Parameter::CameraField { camera, field } => {
                let camera = &mut self.cameras[camera];
                match field {
                    CameraField::Fx => camera.fx = None,
                    CameraField::Fy => camera.fy = None,
                    CameraField::Cx => camera.cx = None,
                    CameraField::Cy => camera.cy = None,
                    CameraField::Distortion => camera.distortion = None,
                }
            }
            Parameter::FeatureXyz(feature) => self.features[feature].xyz = None,
            Parameter::TargetPose(target) => self.targets[target].pose = None,
        }
    }

    /// True where the parameter is held at its value.
    pub fn is_fixed(&self, parameter: &Parameter) -> bool {
        let path = parameter.path(self);
        self.estimate.fixed.iter().any(|pattern| matches(pattern, &path))
    }

    /// Standard deviation of the prior around the parameter's value, in its unit (m and rad for a pose).
    ///
    /// Where several patterns match, the most specific counts: that with the fewest `*`, then the longest.
    pub fn prior_sd(&self, parameter: &Parameter) -> Option<f64> {
        let path = parameter.path(self);
        let stars = |pattern: &str| pattern.matches('*').count();
        let matching = self.estimate.prior.iter().filter(|(pattern, _)| matches(pattern, &path));
        let (_, sd) = matching.min_by_key(|(pattern, _)| {
            (stars(pattern), std::cmp::Reverse(pattern.split('.').count()), std::cmp::Reverse(pattern.len()))
        })?;
        Some(*sd)
    }
}

/// In patterns, all numbers of a camera but its pose.
pub(crate) const INTRINSICS: &str = "intrinsics";

/// True where a pattern covers a path: `*` stands for any characters of one component, a shorter pattern covers all below
/// it, and `cameras.NAME.intrinsics` covers focal lengths, image centre and distortion.
pub fn matches(pattern: &str, path: &str) -> bool {
    if let Some(camera) = pattern.strip_suffix(INTRINSICS)
        && camera.starts_with("cameras.")
        && camera.matches('.').count() == 2
    {
        return CameraField::ALL.iter().any(|field| matches(&format!("{camera}{}", field.name()), path));
    }
    let mut components = path.split('.');
    pattern.split('.').all(|wanted| components.next().is_some_and(|found| covers(wanted, found)))
}

/// The same of one component.
pub(crate) fn covers(pattern: &str, name: &str) -> bool {
    match pattern.split_once('*') {
        None => pattern == name,
        Some((start, rest)) => name
            .strip_prefix(start)
            .is_some_and(|end| end.char_indices().map(|(i, _)| i).chain([end.len()]).any(|i| covers(rest, &end[i..]))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::camera::CameraModel;
    use crate::rig::{Camera, Feature, Parent};

    fn rig() -> Rig {
        let mut rig = Rig::default();
        for (name, beta) in [("shoulder", None), ("elbow", Some(0.0))] {
            rig.robot.joints.push(Joint { name: name.into(), beta, ..Joint::default() });
        }
        for (name, model) in [("left", CameraModel::Pinhole), ("right", CameraModel::Rational)] {
            rig.cameras.push(Camera { name: name.into(), model: Some(model), ..Camera::default() });
        }
        rig.features.push(Feature { name: "f0".into(), parent: Parent::Tip, xyz: None });
        rig
    }

    #[test]
    fn every_parameter_has_the_path_that_the_format_names() {
        let rig = rig();
        let paths: Vec<String> = rig.parameters().iter().map(|parameter| parameter.path(&rig)).collect();
        assert_eq!(
            paths.join(" "),
            "robot.base \
             robot.joints.shoulder.offset robot.joints.shoulder.d robot.joints.shoulder.a robot.joints.shoulder.alpha \
             robot.joints.elbow.offset robot.joints.elbow.d robot.joints.elbow.a robot.joints.elbow.alpha robot.joints.elbow.beta \
             cameras.left.pose cameras.left.fx cameras.left.fy cameras.left.cx cameras.left.cy \
             cameras.right.pose cameras.right.fx cameras.right.fy cameras.right.cx cameras.right.cy cameras.right.distortion \
             features.f0.xyz"
        );
    }

    #[test]
    fn a_star_stands_for_any_part_of_one_name_and_a_short_path_for_all_below() {
        for (pattern, path, expected) in [
            ("cameras.*.fx", "cameras.left.fx", true),
            ("cameras.*.fx", "cameras.left.fy", false),
            ("cameras.*", "cameras.left.fx", true),
            ("cameras", "cameras.left.fx", true),
            ("cam", "cameras.left.fx", false),
            ("*", "cameras.left.fx", true),
            ("*.fx", "cameras.left.fx", false),
            ("cameras.left.fx.x", "cameras.left.fx", false),
            ("robot.joints.*.a", "robot.joints.elbow.alpha", false),
            ("", "robot.base", false),
            ("features.tool*", "features.tool12.xyz", true),
            ("features.tool*", "features.tool.xyz", true),
            ("features.tool*", "features.board.xyz", false),
            ("features.*-*-corner", "features.tag-3-corner.xyz", true),
            ("features.*-*-corner", "features.tag-corner.xyz", false),
            ("feature*.tool", "features.tool.xyz", true),
            ("*.tool*", "robot.joints.tool.a", false),
            ("cameras.*.intrinsics", "cameras.left.fx", true),
            ("cameras.left.intrinsics", "cameras.left.distortion", true),
            ("cameras.left.intrinsics", "cameras.right.fx", false),
            ("cameras.*.intrinsics", "cameras.left.pose", false),
            ("cameras.intrinsics", "cameras.intrinsics.pose", true),
            ("features.f.intrinsics", "features.f.xyz", false),
        ] {
            assert_eq!(matches(pattern, path), expected, "{pattern} {path}");
        }
    }

    #[test]
    fn held_is_what_a_pattern_covers() {
        let mut rig = rig();
        rig.estimate.fixed = vec!["robot".into(), "cameras.left".into()];
        let free: Vec<String> =
            rig.parameters().iter().filter(|p| !rig.is_fixed(p)).map(|parameter| parameter.path(&rig)).collect();
        assert!(free.iter().all(|path| path.starts_with("cameras.right") || path.starts_with("features")), "{free:?}");
        assert_eq!(free.len(), 7);
    }

    #[test]
    fn the_most_specific_prior_counts() {
        let mut rig = rig();
        for (pattern, sd) in [("cameras", 9.0), ("cameras.*.fx", 8.0), ("cameras.*.*", 7.0), ("cameras.left.fx", 6.0)] {
            rig.estimate.prior.insert(pattern.into(), sd);
        }
        let sd = |camera, field| rig.prior_sd(&Parameter::CameraField { camera, field });
        assert_eq!(sd(0, CameraField::Fx), Some(6.0), "no star, and longest");
        assert_eq!(sd(1, CameraField::Fx), Some(9.0), "no star beats one");
        assert_eq!(rig.prior_sd(&Parameter::FeatureXyz(0)), None);
        rig.estimate.prior.remove("cameras");
        let sd = |camera, field| rig.prior_sd(&Parameter::CameraField { camera, field });
        assert_eq!(sd(1, CameraField::Fx), Some(8.0), "one star beats two");
        assert_eq!(sd(1, CameraField::Fy), Some(7.0));
    }
}
