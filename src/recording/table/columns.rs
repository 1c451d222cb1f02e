//! What the columns of a table are, by their names.
use super::Actions;
use crate::error::suggestion;
use crate::recording::OpenOptions;
use crate::recording::clock::UNITS;
use crate::recording::names::{Names, joint_name, natural_order};
use crate::recording::same_joints::{Places, places, several};
use crate::rig::{problem_of_joint_name, problem_of_name};
use std::collections::BTreeMap;

/// Where in a row each thing stands.
#[derive(Debug, Default)]
pub(super) struct Columns {
    pub time: Option<Time>,
    pub episode: Option<usize>,
    /// Names of the joints, from base to tip.
    pub joint_names: Vec<String>,
    /// Names in `joints.NAME`.
    pub named_joints: Vec<String>,
    /// One per joint, or none at all.
    pub joints: Vec<Angle>,
    pub joint_action: Vec<Angle>,
    /// What `action.NAME` says, where the options say whether that is a target or a motion.
    pub action: Vec<Angle>,
    /// Names in `action.NAME`.
    pub actions: Vec<String>,
    pub pose: Option<PoseColumns>,
    pub pose_action: Option<PoseColumns>,
    pub cameras: Vec<String>,
    pub features: Names,
    /// Camera, feature and the columns of its coordinates.
    pub pixels: Vec<(u32, u32, [usize; 2])>,
    pub points: Vec<(u32, u32, [usize; 3])>,
    pub targets: Vec<(u32, String, PoseColumns)>,
    /// Columns that say nothing that is known, by name.
    pub others: Vec<String>,
}

/// The column of times.
#[derive(Clone, Copy, Debug)]
pub(super) struct Time {
    pub column: usize,
    /// The seconds that one of its units takes, where its name says it.
    pub unit: Option<f64>,
}

/// The column of a joint, and whether its name says that it is in degrees.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angle {
    pub column: usize,
    pub in_degrees: bool,
}

/// The columns of a pose: origin, and x, y, z, w of the quaternion or roll, pitch, yaw.
#[derive(Clone, Copy, Debug)]
pub(super) struct PoseColumns {
    pub xyz: [usize; 3],
    pub rotation: Rotation,
}

impl PoseColumns {
    /// All of them.
    pub(super) fn columns(&self) -> Vec<usize> {
        let rotation = match self.rotation {
            Rotation::Quaternion(columns) => columns.to_vec(),
            Rotation::RollPitchYaw(angles) => angles.iter().map(|angle| angle.column).collect(),
        };
        self.xyz.into_iter().chain(rotation).collect()
    }
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Rotation {
    Quaternion([usize; 4]),
    RollPitchYaw([Angle; 3]),
}

/// Names of times, without their units.
const TIMES: &[&str] = &["time", "timestamp", "t"];
/// What LeRobot counts by, which says nothing of a robot.
const COUNTERS: &[&str] = &["frame_index", "index", "task_index", "sample", "frame"];
/// What names of LeRobot's columns begin with, of which none is a camera.
const FOREIGN: &[&str] = &["observation", "next", "annotation", "action"];
/// What a column of names of images is called.
pub(super) const IMAGES: &[&str] = &["image", "file", "filename"];
const ORIGIN: [&str; 3] = ["x", "y", "z"];
const QUATERNION: [&str; 4] = ["qx", "qy", "qz", "qw"];
const ROLL_PITCH_YAW: [&str; 3] = ["roll", "pitch", "yaw"];

/// A column whose name cannot be taken, and why.
pub(super) type Problem = (usize, String);

impl Columns {
    /// Reads the header. Joints are those of the options; or those that they know where the table has all of them, or all `joints.NAME` in
    /// their order.
    pub(super) fn new(header: &[String], options: &OpenOptions) -> Result<Columns, Problem> {
        let mut columns = Columns::default();
        let mut met: BTreeMap<&str, usize> = BTreeMap::new();
        let mut named_joints = Group::default();
        let (mut joint_action, mut action) = (Group::default(), Group::default());
        let mut poses: BTreeMap<&str, Parts> = BTreeMap::new();
        let mut seen: BTreeMap<(&str, &str), Parts> = BTreeMap::new();
        for (index, name) in header.iter().enumerate() {
            let name = name.as_str();
            if name.is_empty() {
                continue;
            }
            if met.insert(name, index).is_some() {
                return Err((index, format!("two columns are called `{name}`")));
            }
            if let Some(unit) = unit_of_time(name) {
                if columns.time.is_some() {
                    return Err((index, format!("`{name}` is a second column of times")));
                }
                columns.time = Some(Time { column: index, unit });
                continue;
            }
            // A joint's name may have points itself: `joints.shoulder_pan.pos`.
            let group = match name.split_once('.') {
                Some(("joints" | "joint", joint)) => Some((&mut named_joints, joint)),
                Some(("joint_action", joint)) => Some((&mut joint_action, joint)),
                Some(("action", joint)) => Some((&mut action, joint)),
                _ => None,
            };
            if let Some((group, joint)) = group {
                group.add(index, joint)?;
                continue;
            }
            match name.split('.').collect::<Vec<_>>()[..] {
                ["episode_index"] => columns.episode = Some(index),
                [name] if COUNTERS.contains(&name) || IMAGES.contains(&name) => {}
                [pose @ ("pose" | "pose_action"), part] => poses.entry(pose).or_default().add(index, part)?,
                [first, ..] if FOREIGN.contains(&first) => columns.others.push(name.to_owned()),
                [camera, feature, part] => {
                    if let Some(problem) = problem_of_name(camera).or_else(|| problem_of_name(feature)) {
                        return Err((index, problem));
                    }
                    seen.entry((camera, feature)).or_default().add(index, part)?;
                }
                _ => columns.others.push(name.to_owned()),
            }
        }
        columns.take_joints(header, &named_joints, &options.joints, &options.known_joints)?;
        columns.joint_action = columns.in_order(&joint_action, "joint_action")?;
        columns.actions = action.0.iter().map(|(name, _)| name.clone()).collect();
        if options.table.actions != Actions::Unsaid {
            columns.action = columns.in_order(&action, "action")?;
        }
        for (name, parts) in poses {
            let pose = parts.pose(name)?;
            *(if name == "pose" { &mut columns.pose } else { &mut columns.pose_action }) = Some(pose);
        }
        let mut cameras: Vec<&str> = seen.keys().map(|(camera, _)| *camera).collect();
        cameras.sort_by(|a, b| natural_order(a, b));
        cameras.dedup();
        columns.cameras = cameras.iter().map(|&camera| camera.to_owned()).collect();
        for ((camera, name), parts) in seen {
            let index = cameras.iter().position(|known| *known == camera).unwrap_or(0) as u32;
            columns.take_seen(index, name, &format!("{camera}.{name}"), &parts)?;
        }
        Ok(columns)
    }

    /// Which of a number of columns say something.
    pub(super) fn wanted(&self, count: usize) -> Vec<bool> {
        let mut wanted = vec![false; count];
        let angles = [&self.joints, &self.joint_action, &self.action].into_iter().flatten().map(|angle| angle.column);
        let seen = self.pixels.iter().flat_map(|(_, _, at)| at).chain(self.points.iter().flat_map(|(_, _, at)| at));
        let targets = self.targets.iter().map(|(_, _, pose)| pose);
        let poses = self.pose.iter().chain(&self.pose_action).chain(targets).flat_map(PoseColumns::columns);
        let single = self.time.map(|time| time.column).into_iter().chain(self.episode);
        for column in angles.chain(seen.copied()).chain(poses).chain(single) {
            wanted[column] = true;
        }
        wanted
    }

    /// Finds the joints: `joints.NAME`, or columns called as the options or the rig call the joints.
    fn take_joints(
        &mut self,
        header: &[String],
        named: &Group,
        joints: &[String],
        known: &[String],
    ) -> Result<(), Problem> {
        let find = |joint: &String| {
            let plain = || {
                let at = |name: &str| header.iter().position(|column| joint_name(column) == joint_name(name));
                let in_degrees = at(&format!("{joint}_deg"));
                let column = at(joint).or(in_degrees)?;
                Some(Angle { column, in_degrees: in_degrees == Some(column) })
            };
            named.find(&joint_name(joint)).or_else(plain)
        };
        let all = |joints: &[String]| joints.iter().map(find).collect::<Option<Vec<Angle>>>();
        if let Some(missing) = joints.iter().find(|joint| find(joint).is_none()) {
            let there = named.0.iter().map(|(name, _)| name.as_str()).chain(self.others.iter().map(String::as_str));
            return Err((0, format!("there is no joint `{missing}` {}", suggestion(missing, there))));
        }
        let in_groups: Vec<String> = named.0.iter().map(|(name, _)| name.clone()).collect();
        let names = match places(known, &in_groups) {
            _ if !joints.is_empty() => joints.to_vec(),
            Places::Found(places) => places.into_iter().map(|place| in_groups[place].clone()).collect(),
            Places::Several(first) => return Err((0, several(&first))),
            // Other columns are joints where they are called just as the rig calls its own.
            Places::Missing if !known.is_empty() && all(known).is_some() => known.to_vec(),
            Places::Missing => in_groups,
        };
        self.joints = all(&names).unwrap_or_default();
        self.others.retain(|other| !self.joints.iter().any(|joint| header[joint.column] == *other));
        // A column may be asked for by a name that no parameter path can hold.
        self.joint_names = names.iter().map(|name| joint_name(name)).collect();
        self.named_joints = named.0.iter().map(|(name, _)| name.clone()).collect();
        for (name, joint) in self.joint_names.iter().zip(&self.joints) {
            if let Some(problem) = problem_of_joint_name(name) {
                return Err((joint.column, problem));
            }
        }
        Ok(())
    }

    /// The columns of a group, one per joint; none where the group is empty.
    fn in_order(&mut self, group: &Group, what: &str) -> Result<Vec<Angle>, Problem> {
        let Some(&(ref first, Angle { column, .. })) = group.0.first() else { return Ok(Vec::new()) };
        if self.joint_names.is_empty() {
            // Only motions were recorded.
            self.joint_names = group.0.iter().map(|(name, _)| name.clone()).collect();
        }
        let find = |joint: &String| group.find(joint);
        let missing = self.joint_names.iter().find(|joint| find(joint).is_none());
        match missing {
            None => Ok(self.joint_names.iter().filter_map(find).collect()),
            Some(joint) => Err((column, format!("there is `{what}.{first}`, and no `{what}.{joint}`"))),
        }
    }

    fn take_seen(&mut self, camera: u32, name: &str, path: &str, parts: &Parts) -> Result<(), Problem> {
        let has =
            |names: &[&str]| parts.0.keys().any(|part| names.contains(&part.strip_suffix("_deg").unwrap_or(part)));
        if has(&["u", "v"]) {
            let feature = self.features.intern(name);
            self.pixels.push((camera, feature, [parts.need("u", path)?, parts.need("v", path)?]));
        }
        if has(&QUATERNION) || has(&ROLL_PITCH_YAW) {
            self.targets.push((camera, name.to_owned(), parts.pose(path)?));
        } else if has(&ORIGIN) {
            let feature = self.features.intern(name);
            let [x, y, z] = ORIGIN.map(|axis| parts.need(axis, path));
            self.points.push((camera, feature, [x?, y?, z?]));
        }
        Ok(())
    }
}

/// Joints by name, in the order of the columns.
#[derive(Default)]
struct Group(Vec<(String, Angle)>);

impl Group {
    fn add(&mut self, column: usize, name: &str) -> Result<(), Problem> {
        let (name, in_degrees) = name.strip_suffix("_deg").map_or((name, false), |name| (name, true));
        let name = if name.is_empty() { String::new() } else { joint_name(name) };
        if let Some(problem) = problem_of_joint_name(&name) {
            return Err((column, problem));
        }
        if self.find(&name).is_some() {
            return Err((column, format!("joint `{name}` has two columns")));
        }
        self.0.push((name, Angle { column, in_degrees }));
        Ok(())
    }

    fn find(&self, name: &str) -> Option<Angle> {
        self.0.iter().find(|(known, _)| known == name).map(|(_, angle)| *angle)
    }
}

/// Coordinates of one thing, by the last part of the columns' names.
#[derive(Default)]
struct Parts<'a>(BTreeMap<&'a str, usize>);

impl<'a> Parts<'a> {
    fn add(&mut self, column: usize, part: &'a str) -> Result<(), Problem> {
        let angle = part.strip_suffix("_deg").unwrap_or(part);
        let is_known = ["u", "v"].contains(&part)
            || ORIGIN.contains(&part)
            || QUATERNION.contains(&part)
            || ROLL_PITCH_YAW.contains(&angle);
        if !is_known {
            let known = ["u", "v"].into_iter().chain(ORIGIN).chain(QUATERNION).chain(ROLL_PITCH_YAW);
            return Err((column, format!("nothing is known of a coordinate `{part}` {}", suggestion(part, known))));
        }
        self.0.insert(part, column);
        Ok(())
    }

    fn need(&self, part: &str, of: &str) -> Result<usize, Problem> {
        let first = self.0.iter().next().map_or((0, ""), |(name, column)| (*column, name));
        self.0.get(part).copied().ok_or_else(|| (first.0, format!("there is `{of}.{}`, and no `{of}.{part}`", first.1)))
    }

    fn angle(&self, part: &str, of: &str) -> Result<Angle, Problem> {
        match self.0.get(format!("{part}_deg").as_str()) {
            Some(&column) => Ok(Angle { column, in_degrees: true }),
            None => Ok(Angle { column: self.need(part, of)?, in_degrees: false }),
        }
    }

    fn pose(&self, of: &str) -> Result<PoseColumns, Problem> {
        let [x, y, z] = ORIGIN.map(|axis| self.need(axis, of));
        let is_rpy = ROLL_PITCH_YAW.iter().any(|angle| self.0.keys().any(|part| part.starts_with(angle)));
        let rotation = if is_rpy {
            let [roll, pitch, yaw] = ROLL_PITCH_YAW.map(|part| self.angle(part, of));
            Rotation::RollPitchYaw([roll?, pitch?, yaw?])
        } else {
            let [x, y, z, w] = QUATERNION.map(|part| self.need(part, of));
            Rotation::Quaternion([x?, y?, z?, w?])
        };
        Ok(PoseColumns { xyz: [x?, y?, z?], rotation })
    }
}

/// The unit of a column of times, where its name says it [s]; `None` of any other column.
fn unit_of_time(name: &str) -> Option<Option<f64>> {
    let of_time = |name: &str| TIMES.contains(&name);
    let unit = UNITS.iter().find_map(|(_, suffix, unit)| Some((name.strip_suffix(suffix)?, *unit)));
    match unit {
        _ if of_time(name) => Some(None),
        Some((name, unit)) if of_time(name) => Some(Some(unit)),
        _ => None,
    }
}
