//! The first line of a recording: format, joints and cameras.
use super::entries::{Entries, Keys, List, Number, Numbers, Object, Text, Texts};
use crate::camera::CameraModel;
use crate::recording::RecordedCamera;
use crate::rig::{problem_of_distortion, problem_of_joint_name, problem_of_name};
use serde::de::MapAccess;

pub(super) const FORMAT: &str = "handeye-recording";
pub(super) const VERSION: u32 = 1;

/// What the header says.
pub(super) struct Header {
    pub(super) joints: Vec<String>,
    pub(super) cameras: Vec<RecordedCamera>,
    keys: Keys,
}

impl Header {
    pub(super) fn new() -> Self {
        let keys = Keys::new(&["format", "version", "joints", "cameras"]);
        Header { joints: Vec::new(), cameras: Vec::new(), keys }
    }
}

impl Entries for Header {
    type Key = &'static str;
    const WHAT: &'static str = "a header {\"format\":\"handeye-recording\",\"version\":1,...}";

    fn key(&mut self, name: &str) -> Result<&'static str, String> {
        self.keys.meet(name).map_err(|problem| format!("{problem}; the first line is {}", Self::WHAT))
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, key: &'static str, map: &mut A) -> Result<(), A::Error> {
        match key {
            "format" => map.next_value_seed(Text(|name: &str| {
                if name == FORMAT { Ok(()) } else { Err(format!("unknown format `{name}` (known: {FORMAT})")) }
            })),
            "version" => map.next_value_seed(Number(|version| {
                let known = f64::from(VERSION);
                if version == known { Ok(()) } else { Err(format!("unknown version {version} (known: {VERSION})")) }
            })),
            "joints" => {
                let mut met: Vec<String> = Vec::new();
                self.joints = map.next_value_seed(Texts(|name: &str| {
                    if let Some(problem) = problem_of_joint_name(name) {
                        return Err(problem);
                    }
                    if met.iter().any(|other| other == name) {
                        return Err(format!("two joints are called `{name}`"));
                    }
                    met.push(name.to_owned());
                    Ok(name.to_owned())
                }))?;
                Ok(())
            }
            _ => map.next_value_seed(Object(&mut Cameras(&mut self.cameras))),
        }
    }

    fn finish(&mut self) -> Result<(), String> {
        match ["format", "version"].into_iter().find(|key| !self.keys.has(key)) {
            Some(key) => Err(format!("the header has no `{key}`; the first line is {}", Self::WHAT)),
            None => Ok(()),
        }
    }
}

/// Camera -> what is known of it.
struct Cameras<'a>(&'a mut Vec<RecordedCamera>);

impl Entries for Cameras<'_> {
    type Key = String;
    const WHAT: &'static str = "a table of cameras";

    fn key(&mut self, name: &str) -> Result<String, String> {
        if let Some(problem) = problem_of_name(name) {
            return Err(problem);
        }
        if self.0.iter().any(|camera| camera.name == name) {
            return Err(format!("camera `{name}` is given twice"));
        }
        Ok(name.to_owned())
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, name: String, map: &mut A) -> Result<(), A::Error> {
        let mut entries = Camera {
            camera: RecordedCamera { name, ..RecordedCamera::default() },
            keys: Keys::new(&["size", "model", "fx", "fy", "cx", "cy", "distortion"]),
        };
        map.next_value_seed(Object(&mut entries))?;
        self.0.push(entries.camera);
        Ok(())
    }
}

struct Camera {
    camera: RecordedCamera,
    keys: Keys,
}

impl Entries for Camera {
    type Key = &'static str;
    const WHAT: &'static str = "a table that describes a camera";

    fn key(&mut self, name: &str) -> Result<&'static str, String> {
        self.keys.meet(name).map_err(|problem| format!("camera `{}`: {problem}", self.camera.name))
    }

    fn value<'de, A: MapAccess<'de>>(&mut self, key: &'static str, map: &mut A) -> Result<(), A::Error> {
        let Camera { camera, .. } = self;
        let name = camera.name.as_str();
        let positive = |number: f64| match number {
            number if number > 0.0 => Ok(Some(number)),
            _ => Err(format!("camera `{name}`: `{key}` must be above 0, found {number}")),
        };
        let any = |number: f64| Ok(Some(number));
        match key {
            "size" => camera.size = map.next_value_seed(Numbers(|size| read_size(size, name).map(Some)))?,
            "model" => camera.model = map.next_value_seed(Text(|model: &str| read_model(model, name).map(Some)))?,
            "fx" => camera.fx = map.next_value_seed(Number(positive))?,
            "fy" => camera.fy = map.next_value_seed(Number(positive))?,
            "cx" => camera.cx = map.next_value_seed(Number(any))?,
            "cy" => camera.cy = map.next_value_seed(Number(any))?,
            _ => camera.distortion = map.next_value_seed(List(|numbers| Ok(Some(numbers))))?,
        }
        Ok(())
    }

    fn finish(&mut self) -> Result<(), String> {
        let found = self.camera.distortion.as_ref().map_or(0, Vec::len);
        match problem_of_distortion(self.camera.model, found) {
            Some(problem) => Err(format!("camera `{}`: `distortion`: {problem}", self.camera.name)),
            None => Ok(()),
        }
    }
}

fn read_size(size: [f64; 2], camera: &str) -> Result<[u32; 2], String> {
    if size.iter().any(|side| side.fract() != 0.0 || *side < 1.0 || *side > f64::from(u32::MAX)) {
        let [width, height] = size;
        return Err(format!(
            "camera `{camera}`: width and height must be whole numbers above 0, found {width} and {height}"
        ));
    }
    Ok(size.map(|side| side as u32))
}

fn read_model(model: &str, camera: &str) -> Result<CameraModel, String> {
    CameraModel::from_name(model).ok_or_else(|| {
        let known: Vec<&str> = CameraModel::ALL.iter().map(|model| model.name()).collect();
        format!("camera `{camera}`: unknown model `{model}` (known: {})", known.join(", "))
    })
}
