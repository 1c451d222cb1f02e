//! What a rig says of a parameter, to be read and changed by path.
use super::{CameraField, JointField, Parameter, Rig, problem_of_distortion};
use crate::Error;
use crate::error::suggestion;
use handeye_solvers::Pose;

/// What a parameter is: one number, several, or a pose [m, rad, px].
#[derive(Clone, Debug, PartialEq)]
pub enum Value {
    /// A number of a joint or a camera.
    Number(f64),
    /// A feature's coordinates, or a lens's coefficients.
    Numbers(Vec<f64>),
    /// Of the base, a camera or a target in what it is fixed to.
    Pose(Pose),
}

impl Rig {
    /// The parameter of a path, such as `cameras.left.fx`; see [`Rig::parameters`]. A joint's `beta` and a camera's `distortion` have
    /// paths where they are not given, too.
    ///
    /// Errors: [`Error::Unusable`] where the rig has no such parameter.
    pub fn parameter(&self, path: &str) -> Result<Parameter, Error> {
        let parameters = self.every_parameter();
        let found = parameters.iter().find(|parameter| parameter.path(self) == path);
        found.copied().ok_or_else(|| {
            let known: Vec<String> = parameters.iter().map(|parameter| parameter.path(self)).collect();
            let known = suggestion(path, known.iter().map(String::as_str));
            Error::Unusable(format!("the rig has no parameter `{path}` {known}"))
        })
    }

    fn every_parameter(&self) -> Vec<Parameter> {
        let mut parameters = self.parameters();
        let betas = (0..self.robot.joints.len()).map(|joint| Parameter::JointField { joint, field: JointField::Beta });
        let fields = |camera| CameraField::ALL.iter().map(move |&field| Parameter::CameraField { camera, field });
        for parameter in betas.chain((0..self.cameras.len()).flat_map(fields)) {
            if !parameters.contains(&parameter) {
                parameters.push(parameter);
            }
        }
        parameters
    }

    /// What the rig says of a parameter; `None` where it is unknown.
    pub fn value(&self, parameter: &Parameter) -> Option<Value> {
        match *parameter {
            Parameter::Base => self.robot.base.map(Value::Pose),
            Parameter::JointField { joint, field } => field.value(&self.robot.joints[joint]).map(Value::Number),
            Parameter::CameraPose(camera) => self.cameras[camera].pose.map(Value::Pose),
            Parameter::CameraField { camera, field } => {
                let camera = &self.cameras[camera];
                match field {
                    CameraField::Fx => camera.fx.map(Value::Number),
                    CameraField::Fy => camera.fy.map(Value::Number),
                    CameraField::Cx => camera.cx.map(Value::Number),
                    CameraField::Cy => camera.cy.map(Value::Number),
                    CameraField::Distortion => camera.distortion.clone().map(Value::Numbers),
                }
            }
            Parameter::FeatureXyz(feature) => self.features[feature].xyz.map(|xyz| Value::Numbers(xyz.to_vec())),
            Parameter::TargetPose(target) => self.targets[target].pose.map(Value::Pose),
        }
    }

    /// Gives a parameter a value, or takes it out with `None`, so that it is unknown. The rest stays as it is, `fit` too.
    ///
    /// Errors: [`Error::Unusable`] where the parameter is something else than the value, or a number is not what it may be.
    pub fn set_value(&mut self, parameter: &Parameter, value: Option<Value>) -> Result<(), Error> {
        let Some(value) = value else {
            self.forget(parameter);
            return Ok(());
        };
        let refuse = |rig: &Rig, problem: &str| Err(Error::Unusable(format!("{}: {problem}", parameter.path(rig))));
        if !value.is_finite() {
            return refuse(self, "a value is not finite");
        }
        match (*parameter, value) {
            (Parameter::Base, Value::Pose(pose)) => self.robot.base = Some(pose),
            (Parameter::CameraPose(camera), Value::Pose(pose)) => self.cameras[camera].pose = Some(pose),
            (Parameter::TargetPose(target), Value::Pose(pose)) => self.targets[target].pose = Some(pose),
            (Parameter::JointField { joint, field }, Value::Number(value)) => {
                let joint = &mut self.robot.joints[joint];
                *match field {
                    JointField::Offset => &mut joint.offset,
                    JointField::D => &mut joint.d,
                    JointField::A => &mut joint.a,
                    JointField::Alpha => &mut joint.alpha,
                    JointField::Beta => &mut joint.beta,
                } = Some(value);
            }
            (Parameter::CameraField { camera, field: CameraField::Distortion }, Value::Numbers(coefficients)) => {
                if let Some(problem) = problem_of_distortion(self.cameras[camera].model, coefficients.len()) {
                    return refuse(self, &problem);
                }
                self.cameras[camera].distortion = Some(coefficients);
            }
            (Parameter::CameraField { camera, field }, Value::Number(value)) if field != CameraField::Distortion => {
                if matches!(field, CameraField::Fx | CameraField::Fy) && value <= 0.0 {
                    return refuse(self, &format!("a focal length is above 0 px, found {value}"));
                }
                let camera = &mut self.cameras[camera];
                *match field {
                    CameraField::Fx => &mut camera.fx,
                    CameraField::Fy => &mut camera.fy,
                    CameraField::Cx => &mut camera.cx,
                    _ => &mut camera.cy,
                } = Some(value);
            }
            (Parameter::FeatureXyz(feature), Value::Numbers(xyz)) => match <[f64; 3]>::try_from(xyz) {
                Ok(xyz) => self.features[feature].xyz = Some(xyz),
                Err(xyz) => return refuse(self, &format!("three coordinates are needed, found {}", xyz.len())),
            },
            (_, value) => return refuse(self, &format!("found {}, {} would do", value.kind(), what(parameter))),
        }
        Ok(())
    }
}

impl Value {
    fn is_finite(&self) -> bool {
        match self {
            Value::Number(number) => number.is_finite(),
            Value::Numbers(numbers) => numbers.iter().all(|number| number.is_finite()),
            Value::Pose(pose) => pose.rotation.iter().chain(&pose.translation).all(|number| number.is_finite()),
        }
    }

    fn kind(&self) -> &'static str {
        match self {
            Value::Number(_) => "a number",
            Value::Numbers(_) => "a list of numbers",
            Value::Pose(_) => "a pose",
        }
    }
}

/// What a parameter takes.
fn what(parameter: &Parameter) -> &'static str {
    match parameter {
        Parameter::Base | Parameter::CameraPose(_) | Parameter::TargetPose(_) => "a pose",
        Parameter::FeatureXyz(_) => "three coordinates",
        Parameter::CameraField { field: CameraField::Distortion, .. } => "a list of coefficients",
        Parameter::CameraField { .. } | Parameter::JointField { .. } => "a number",
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::catalog;

    #[test]
    fn every_parameter_of_a_shipped_rig_is_found_by_its_path_and_takes_its_own_value_again() {
        for (name, _) in catalog::ALL {
            let rig = catalog::rig(name).unwrap();
            let mut copy = rig.clone();
            for parameter in rig.parameters() {
                let path = parameter.path(&rig);
                assert_eq!(rig.parameter(&path).unwrap(), parameter);
                let value = rig.value(&parameter);
                assert_eq!(value.is_some(), rig.has_value(&parameter), "{path}");
                copy.set_value(&parameter, None).unwrap();
                assert_eq!(copy.value(&parameter), None, "{path}");
                copy.set_value(&parameter, value).unwrap();
            }
            assert_eq!(copy, rig);
        }
    }

    #[test]
    fn what_a_parameter_cannot_be_is_refused_with_its_path() {
        let mut rig = catalog::rig("ur5").unwrap();
        let mut refused = |path: &str, value: Value| {
            let parameter = rig.parameter(path).unwrap();
            rig.set_value(&parameter, Some(value)).unwrap_err().to_string()
        };
        let fx = "cameras.left.fx";
        assert_eq!(refused(fx, Value::Number(f64::NAN)), "cameras.left.fx: a value is not finite");
        assert_eq!(refused(fx, Value::Number(-1.0)), "cameras.left.fx: a focal length is above 0 px, found -1");
        assert_eq!(refused(fx, Value::Pose(Pose::identity())), "cameras.left.fx: found a pose, a number would do");
        assert_eq!(
            refused("features.f0.xyz", Value::Numbers(vec![0.0])),
            "features.f0.xyz: three coordinates are needed, found 1"
        );
        assert!(refused("cameras.left.distortion", Value::Numbers(vec![0.1])).contains("`pinhole` has none"));
        let unknown = rig.parameter("cameras.left.fz").unwrap_err().to_string();
        assert_eq!(unknown, "the rig has no parameter `cameras.left.fz` (did you mean `cameras.left.fx`?)");
    }
}
