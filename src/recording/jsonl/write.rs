//! Writing recordings: keys in the order of the format, floats in their shortest form.
use super::header::{FORMAT, VERSION};
use crate::Error;
use crate::geometry::orientation;
use crate::recording::{RecordedCamera, Recording, Sample};
use crate::rig::replace_file;
use handeye_solvers::Pose;
use nalgebra::Matrix6;
use std::io::{self, Write};
use std::path::Path;

impl Recording {
    /// Writes a recording file whole or not at all.
    pub fn write(&self, path: &Path) -> Result<(), Error> {
        replace_file(path, |file| self.write_to(file))
    }

    /// Writes a recording that reads back as this one; features that were never seen leave no trace.
    ///
    /// Errors: those of the output, and `InvalidData` where a number is not finite or an index has no name.
    pub fn write_to(&self, mut output: impl Write) -> io::Result<()> {
        let mut line = String::new();
        self.header(&mut line)?;
        output.write_all(line.as_bytes())?;
        for sample in &self.samples {
            line.clear();
            self.sample(sample, &mut line)?;
            output.write_all(line.as_bytes())?;
        }
        output.flush()
    }

    fn header(&self, line: &mut String) -> io::Result<()> {
        *line += &format!("{{\"format\":\"{FORMAT}\",\"version\":{VERSION},\"joints\":[");
        for (i, joint) in self.joints.iter().enumerate() {
            comma(line, i);
            text(line, joint)?;
        }
        *line += "],\"cameras\":{";
        for (i, camera) in self.cameras.iter().enumerate() {
            comma(line, i);
            text(line, &camera.name)?;
            write_camera(line, camera)?;
        }
        *line += "}}\n";
        Ok(())
    }

    fn sample(&self, sample: &Sample, line: &mut String) -> io::Result<()> {
        let camera = |index: u32| named(self.cameras.get(index as usize)).map(|camera| camera.name.as_str());
        let feature = |index: u32| named(self.features.get(index as usize)).map(String::as_str);
        let mut object = Members::begin(line);
        if let Some(time) = sample.time {
            number(object.member("time")?, time)?;
        }
        if let Some(joints) = &sample.joints {
            numbers(object.member("joints")?, joints)?;
        }
        if let Some(pose) = &sample.pose {
            write_pose(object.member("pose")?, pose)?;
        }
        if let Some(action) = &sample.joint_action {
            numbers(object.member("joint_action")?, action)?;
        }
        if let Some(action) = &sample.pose_action {
            write_pose(object.member("pose_action")?, action)?;
        }
        let pixels: Vec<_> = sample.pixels.iter().map(|d| (d.camera, d)).collect();
        by_camera(&mut object, "pixels", &pixels, camera, |table, detection| {
            numbers(table.member(feature(detection.feature)?)?, &detection.pixel)
        })?;
        let points: Vec<_> = sample.points.iter().map(|d| (d.camera, d)).collect();
        by_camera(&mut object, "points", &points, camera, |table, detection| {
            numbers(table.member(feature(detection.feature)?)?, &detection.point)
        })?;
        let targets: Vec<_> = sample.targets.iter().map(|d| (d.camera, d)).collect();
        by_camera(&mut object, "targets", &targets, camera, |table, detection| {
            write_pose_with(table.member(&detection.target)?, &detection.pose, detection.covariance.as_ref())
        })?;
        object.end();
        line.push('\n');
        Ok(())
    }
}

fn write_camera(line: &mut String, camera: &RecordedCamera) -> io::Result<()> {
    line.push(':');
    let mut object = Members::begin(line);
    if let Some([width, height]) = camera.size {
        *object.member("size")? += &format!("[{width},{height}]");
    }
    if let Some(model) = camera.model {
        text(object.member("model")?, model.name())?;
    }
    for (key, value) in [("fx", camera.fx), ("fy", camera.fy), ("cx", camera.cx), ("cy", camera.cy)] {
        if let Some(value) = value {
            number(object.member(key)?, value)?;
        }
    }
    if let Some(distortion) = &camera.distortion {
        numbers(object.member("distortion")?, distortion)?;
    }
    object.end();
    Ok(())
}

/// Camera -> name -> value, for detections that are ordered by camera; left out where there are none.
fn by_camera<'a, D>(
    object: &mut Members,
    key: &str,
    detections: &[(u32, D)],
    camera: impl Fn(u32) -> io::Result<&'a str>,
    mut write: impl FnMut(&mut Members, &D) -> io::Result<()>,
) -> io::Result<()> {
    if detections.is_empty() {
        return Ok(());
    }
    let mut cameras = Members::begin(object.member(key)?);
    for group in detections.chunk_by(|a, b| a.0 == b.0) {
        let mut table = Members::begin(cameras.member(camera(group[0].0)?)?);
        for (_, detection) in group {
            write(&mut table, detection)?;
        }
        table.end();
    }
    cameras.end();
    Ok(())
}

/// An object that is being written.
struct Members<'a> {
    line: &'a mut String,
    count: usize,
}

impl<'a> Members<'a> {
    fn begin(line: &'a mut String) -> Self {
        line.push('{');
        Members { line, count: 0 }
    }

    /// Writes a key, and gives the line for its value.
    fn member(&mut self, key: &str) -> io::Result<&mut String> {
        comma(self.line, self.count);
        self.count += 1;
        text(self.line, key)?;
        self.line.push(':');
        Ok(self.line)
    }

    fn end(self) {
        self.line.push('}');
    }
}

fn write_pose(line: &mut String, pose: &Pose) -> io::Result<()> {
    write_pose_with(line, pose, None)
}

fn write_pose_with(line: &mut String, pose: &Pose, covariance: Option<&Matrix6<f64>>) -> io::Result<()> {
    let mut object = Members::begin(line);
    numbers(object.member("xyz")?, pose.translation.as_slice())?;
    numbers(object.member("quat")?, &orientation::to_quaternion(&pose.rotation))?;
    if let Some(covariance) = covariance {
        // Symmetric, so that columns are rows.
        numbers(object.member("covariance")?, covariance.as_slice())?;
    }
    object.end();
    Ok(())
}

fn comma(line: &mut String, index: usize) {
    if index > 0 {
        line.push(',');
    }
}

fn text(line: &mut String, text: &str) -> io::Result<()> {
    *line += &serde_json::to_string(text)?;
    Ok(())
}

fn numbers(line: &mut String, numbers: &[f64]) -> io::Result<()> {
    line.push('[');
    for (i, value) in numbers.iter().enumerate() {
        comma(line, i);
        number(line, *value)?;
    }
    line.push(']');
    Ok(())
}

fn number(line: &mut String, value: f64) -> io::Result<()> {
    if !value.is_finite() {
        return Err(io::Error::new(io::ErrorKind::InvalidData, format!("a recording cannot hold the number {value}")));
    }
    *line += &format!("{value:?}");
    Ok(())
}

fn named<T>(name: Option<&T>) -> io::Result<&T> {
    name.ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "a detection refers to a name that does not exist"))
}
