//! Rows as samples.
use super::columns::{Angle, Columns, PoseColumns, Rotation, Time};
use super::remarks::{note_on_columns, nothing, without_effect};
use super::{Actions, Angles, Rows};
use crate::Error;
use crate::geometry::orientation;
use crate::recording::clock::{LATEST, are_far_apart, name_of_unit, unit_of_date};
use crate::recording::names::joint_name;
use crate::recording::{
    Detection, OpenOptions, Opened, PointDetection, RecordedCamera, Recording, Sample, TargetDetection,
};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use std::collections::BTreeSet;
use std::f64::consts::PI;

/// Beyond it no joint reading is believed to be in radians unless that is said: two turns to either side.
const FARTHEST: f64 = 4.0 * PI;

/// Two rows of a recording are hardly that far apart [s].
const DAY: f64 = 86_400.0;

/// Reads all rows. `cameras`: what the dataset says of cameras, which the options know better.
pub(super) fn read(mut rows: impl Rows, options: &OpenOptions, cameras: &[RecordedCamera]) -> Result<Opened, Error> {
    let columns = Columns::new(rows.header(), options).map_err(|(column, problem)| rows.error(column, problem))?;
    if let Some(problem) = without_effect(&columns, options) {
        return Err(Error::Unusable(format!("{}: {problem}", rows.file())));
    }
    let is_typed = columns.time.is_some_and(|time| rows.is_in_seconds(time.column));
    let mut reader = Reader::new(&columns, options, is_typed);
    let wanted = columns.wanted(rows.header().len());
    let (mut row, mut images) = (Vec::new(), Vec::new());
    while rows.next(&wanted, &mut row)? {
        let is_taken = reader.take(&row).map_err(|(column, problem)| rows.error(column, problem))?;
        images.extend(rows.image().filter(|_| is_taken).map(str::to_owned));
    }
    let Reader { samples, mut notes, rows: count, incomplete, restarts, farthest, episodes, unit, .. } = reader;
    let is_missing = |named: &&u64| !episodes.contains(named);
    if let Some(missing) = options.table.episodes.iter().find(is_missing) {
        let file = rows.file();
        return Err(Error::Unusable(format!("{file}: has no episode {missing}; it has {}", in_words(&episodes))));
    }
    let has_anything = |sample: &Sample| {
        sample.joints.is_some()
            || sample.pose.is_some()
            || sample.joint_action.is_some()
            || sample.pose_action.is_some()
            || !(sample.pixels.is_empty() && sample.points.is_empty() && sample.targets.is_empty())
    };
    if !samples.iter().any(has_anything) {
        return Err(Error::Unusable(nothing(&rows.file(), rows.header(), count)));
    }
    if incomplete > 0 {
        notes.push(format!("{incomplete} rows have some joints and not all, which are left out"));
    }
    if restarts > 0 {
        notes.push(format!("times begin anew {restarts} times, and are counted on from there, one second later"));
    }
    let is_guessed = !is_typed && columns.time.is_some_and(|time| time.unit.is_none());
    let is_far = is_guessed && are_far_apart(samples.iter().filter_map(|sample| sample.time));
    if is_far {
        let unit = unit.unwrap_or(1.0);
        let since = if unit == 1.0 { "" } else { " since 1970" };
        return Err(Error::Unusable(format!(
            "{}: as {}{since} most times would be a quarter of an hour or more apart; a column `time_s`, `time_ms`, `time_us` or `time_ns` says the unit",
            rows.file(),
            name_of_unit(unit)
        )));
    }
    if farthest > DAY && unit.is_none_or(|unit| unit == 1.0) {
        notes.push(format!(
            "rows are up to {farthest} s apart; where times are not in seconds, a column `time_ms`, `time_us` or `time_ns` says so"
        ));
    }
    notes.extend(rows.notes().iter().cloned());
    notes.extend(note_on_columns(&columns, options, rows.left_out()));
    let camera = |name: &String| {
        let unknown = || RecordedCamera { name: name.clone(), ..RecordedCamera::default() };
        cameras.iter().find(|camera| camera.name == *name).cloned().unwrap_or_else(unknown)
    };
    let (joints, features) = (columns.joint_names, columns.features.list);
    let cameras = columns.cameras.iter().map(camera).collect();
    let mut recording = Recording { joints, cameras, features, samples };
    let file = rows.file();
    let described = recording.describe_those_there(&options.cameras);
    described.map_err(|problem| Error::Unusable(format!("{file}: {problem}")))?;
    Ok(Opened { recording: recording.checked_as(&file)?, notes, images })
}

/// Numbers of episodes, those that follow one another as from and to.
fn in_words(episodes: &BTreeSet<u64>) -> String {
    let numbers: Vec<u64> = episodes.iter().copied().collect();
    let runs = numbers.chunk_by(|a, b| a + 1 == *b);
    let words: Vec<String> = runs
        .map(|run| match run {
            [first, .., last] => format!("{first} to {last}"),
            _ => run.iter().map(u64::to_string).collect(),
        })
        .collect();
    if words.is_empty() { "none".to_owned() } else { words.join(", ") }
}

/// Samples as they come.
struct Reader<'a> {
    columns: &'a Columns,
    options: &'a OpenOptions,
    samples: Vec<Sample>,
    notes: Vec<String>,
    /// Rows of the episodes that are read.
    rows: usize,
    /// Rows with some joints and not all.
    incomplete: usize,
    /// Where times began anew: how often, and what is added to them since [s].
    restarts: usize,
    shift: f64,
    /// The last time, and how far two that follow one another are apart at most [s].
    last: Option<f64>,
    farthest: f64,
    /// The seconds that one unit of the times takes; `None` before the first of those that do not say it.
    unit: Option<f64>,
    episode: Option<f64>,
    /// True where the rows so far say nothing in the column of episodes.
    episode_is_empty: Option<bool>,
    /// All that there are.
    episodes: BTreeSet<u64>,
    /// Where each joint stands, and what takes its numbers to radians or metres; `None`: they are that, as far as one can see.
    joints: Vec<(usize, Option<f64>)>,
    joint_action: Vec<(usize, Option<f64>)>,
}

impl<'a> Reader<'a> {
    /// `is_typed`: times are seconds, whatever they are called.
    fn new(columns: &'a Columns, options: &'a OpenOptions, is_typed: bool) -> Self {
        let scale = |(joint, angle): (&String, &Angle)| {
            let scale = match &options.table.angles {
                _ if angle.in_degrees => Some(PI / 180.0),
                Angles::Unsaid => None,
                Angles::Degrees(named) if named.is_empty() || named.iter().any(|name| joint_name(name) == *joint) => {
                    Some(PI / 180.0)
                }
                Angles::Degrees(_) | Angles::Radians => Some(1.0),
            };
            (angle.column, scale)
        };
        let scales = |angles: &[Angle]| columns.joint_names.iter().zip(angles).map(scale).collect::<Vec<_>>();
        let is_used = columns.joint_action.is_empty() && options.table.actions != Actions::Unsaid;
        let joint_action = scales(if is_used { &columns.action } else { &columns.joint_action });
        Reader {
            columns,
            options,
            samples: Vec::new(),
            notes: Vec::new(),
            rows: 0,
            incomplete: 0,
            restarts: 0,
            shift: 0.0,
            last: None,
            farthest: 0.0,
            unit: if is_typed { Some(1.0) } else { columns.time.and_then(|time| time.unit) },
            episode: None,
            episode_is_empty: None,
            episodes: BTreeSet::new(),
            joints: scales(&columns.joints),
            joint_action,
        }
    }

    /// Takes a row, and says whether it was one of those that are read. Errors: a column, and what is wrong with its number.
    fn take(&mut self, row: &[f64]) -> Result<bool, (usize, String)> {
        let columns = self.columns;
        let mut is_next = false;
        if let Some(column) = columns.episode {
            let episode = row[column];
            if self.episode_is_empty.replace(episode.is_nan()).is_some_and(|was_empty| was_empty != episode.is_nan()) {
                return Err((
                    column,
                    "this is empty in some rows only: each row has to say its episode, or none".to_owned(),
                ));
            }
            if episode >= 0.0 {
                self.episodes.insert(episode as u64);
            }
            let is_meant = |named: &u64| *named as f64 == episode;
            if !self.options.table.episodes.is_empty() && !self.options.table.episodes.iter().any(is_meant) {
                return Ok(false);
            }
            is_next = self.episode.is_some_and(|last| last != episode && !episode.is_nan());
            if is_next && let Some(last) = self.samples.last_mut() {
                // It does not lead to the first row of the next episode.
                (last.joint_action, last.pose_action) = (None, None);
            }
            self.episode = Some(episode);
        }
        self.rows += 1;
        let mut sample = Sample { time: self.time(row, is_next)?, ..Sample::default() };
        sample.joints = self.angles(row, &self.joints)?;
        sample.joint_action = self.angles(row, &self.joint_action)?;
        if self.options.table.actions == Actions::Targets && columns.joint_action.is_empty() {
            let motion =
                |(target, joints): (Vec<f64>, &Vec<f64>)| target.iter().zip(joints).map(|(a, b)| a - b).collect();
            sample.joint_action = sample.joint_action.zip(sample.joints.as_ref()).map(motion);
        }
        sample.pose = columns.pose.map_or(Ok(None), |pose| pose.read(row))?;
        sample.pose_action = columns.pose_action.map_or(Ok(None), |pose| pose.read(row))?;
        let is_partial = |angles: &[(usize, Option<f64>)]| {
            let missing = angles.iter().filter(|(column, _)| row[*column].is_nan()).count();
            missing > 0 && missing < angles.len()
        };
        if is_partial(&self.joints) || is_partial(&self.joint_action) {
            self.incomplete += 1;
        }
        for &(camera, feature, at) in &columns.pixels {
            if let Some(pixel) = whole(row, at)? {
                sample.pixels.push(Detection { camera, feature, pixel });
            }
        }
        for &(camera, feature, at) in &columns.points {
            if let Some(point) = whole(row, at)? {
                sample.points.push(PointDetection { camera, feature, point });
            }
        }
        for (camera, target, pose) in &columns.targets {
            if let Some(pose) = pose.read(row)? {
                let detection = TargetDetection { camera: *camera, target: target.clone(), pose, covariance: None };
                sample.targets.push(detection);
            }
        }
        self.samples.push(sample);
        Ok(true)
    }

    /// The time of a row [s], which goes on where an episode begins anew.
    fn time(&mut self, row: &[f64], is_next: bool) -> Result<Option<f64>, (usize, String)> {
        let Some(Time { column, .. }) = self.columns.time else { return Ok(None) };
        let number = row[column];
        if number.is_nan() {
            return Ok(None);
        }
        let mut seconds = number * self.unit.unwrap_or(1.0);
        if self.unit.is_none() {
            let (name, unit) = unit_of_date(number).unwrap_or(("seconds", 1.0));
            if unit != 1.0 {
                self.notes.push(format!(
                    "times are taken for {name} since 1970: {number} would be no date in seconds; where a clock counts since its start, a column \
                     `time_ms`, `time_us` or `time_ns` says so"
                ));
            }
            self.unit = Some(unit);
            seconds = number * unit;
        }
        if seconds.abs() > LATEST {
            let would_do = "a column `time_ms`, `time_us` or `time_ns` says another unit";
            return Err((column, format!("{seconds} s is no time, since 1970 or of a clock; {would_do}")));
        }
        let mut time = seconds + self.shift;
        if let Some(last) = self.last {
            if time < last && !is_next {
                let before = last - self.shift;
                return Err((
                    column,
                    format!(
                        "time goes back, from {before} s to {seconds} s; where that is another episode, a column `episode_index` says so"
                    ),
                ));
            }
            if time < last {
                self.restarts += 1;
                self.shift = last + 1.0 - seconds;
                time = last + 1.0;
            }
            self.farthest = self.farthest.max(time - last);
        }
        self.last = Some(time);
        Ok(Some(time))
    }

    /// Numbers of all joints; `None` where one is missing.
    fn angles(&self, row: &[f64], joints: &[(usize, Option<f64>)]) -> Result<Option<Vec<f64>>, (usize, String)> {
        if joints.is_empty() || joints.iter().any(|(column, _)| row[*column].is_nan()) {
            return Ok(None);
        }
        let angle = |&(column, scale): &(usize, Option<f64>)| match (row[column], scale) {
            (value, Some(scale)) => Ok(value * scale),
            (value, None) if value.abs() <= FARTHEST => Ok(value),
            (value, None) => Err((
                column,
                format!(
                    "{value} is more than two turns, and joints are in radians or metres: --degrees takes them for degrees, and --radians as \
                     they are"
                ),
            )),
        };
        joints.iter().map(angle).collect::<Result<Vec<f64>, _>>().map(Some)
    }
}

/// Numbers that were measured together; `None` where none of them was.
fn whole<const N: usize>(row: &[f64], columns: [usize; N]) -> Result<Option<[f64; N]>, (usize, String)> {
    Ok(is_there(row, &columns)?.then(|| columns.map(|column| row[column])))
}

/// True where all of these were measured, false where none was. Errors: the first that is missing.
fn is_there(row: &[f64], columns: &[usize]) -> Result<bool, (usize, String)> {
    match columns.iter().find(|column| row[**column].is_nan()) {
        None => Ok(true),
        Some(_) if columns.iter().all(|column| row[*column].is_nan()) => Ok(false),
        Some(&missing) => Err((missing, "this is empty, and what belongs to it is not".to_owned())),
    }
}

impl PoseColumns {
    /// The pose in a row; `None` where it was not measured.
    fn read(&self, row: &[f64]) -> Result<Option<Pose>, (usize, String)> {
        if !is_there(row, &self.columns())? {
            return Ok(None);
        }
        let rotation = match self.rotation {
            Rotation::Quaternion(columns) => orientation::from_quaternion(columns.map(|column| row[column]))
                .ok_or_else(|| (columns[0], "a quaternion of length 0 is no rotation".to_owned()))?,
            Rotation::RollPitchYaw(angles) => orientation::from_rpy(
                angles.map(|angle| row[angle.column] * if angle.in_degrees { PI / 180.0 } else { 1.0 }),
            ),
        };
        let [x, y, z] = self.xyz.map(|column| row[column]);
        Ok(Some(Pose { rotation, translation: Vector3::new(x, y, z) }))
    }
}
