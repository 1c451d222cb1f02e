//! Writing rig files: a new one, or new values in the author's own.
mod lists;
mod parts;
mod values;

use super::read::{parse, read_text};
use super::replace::replace_file;
use super::{Estimate, Fit, Joint, Length, Rig, Robot};
use crate::Error;
use lists::{set_texts, write_list};
use parts::{write_camera, write_feature, write_joint, write_noise, write_target};
use std::path::Path;
use toml_edit::{Array, DocumentMut, InlineTable, Item, Table, TableLike, Value};
use values::{Writer, number, numbers, set};

const HEADER: &str =
    "# Units: metres, radians, seconds, pixels. A pose maps its frame's coordinates into the parent's.\n\n";
const JOINTS: &str = "# From base to tip: Denavit-Hartenberg rows.\n";
const CAMERAS: &str = "# What is left out is unknown, and is learned.\n";
const NOISE: &str = "# Standard deviations of what is measured and commanded.\n";
const ESTIMATE: &str = "# What is held at the values above, and standard deviations of priors around them.\n";
const FIT: &str = "# How well the values above explain the recording.\n";
const DEVIATIONS: &str = "# Standard deviation of every learned value; of a pose: translation, then rotation vector.\n";

impl Rig {
    /// The text of a rig file that reads back as this rig.
    pub fn to_toml(&self) -> String {
        let mut document = DocumentMut::new();
        document.as_table_mut().decor_mut().set_prefix(HEADER);
        write_rig(&mut document, None, self);
        document.to_string()
    }

    /// The text of a rig file with this rig's values in place of those that differ.
    ///
    /// Comments, order and format of everything else stay. New tables follow at the end.
    ///
    /// Errors: where `original` is no rig file.
    pub fn update_toml(&self, original: &str) -> Result<String, Error> {
        let name = "the rig file to update";
        let before = parse(original, name, Some(self))?;
        let mut document: DocumentMut = original
            .parse()
            .map_err(|error: toml_edit::TomlError| Error::at(name, original, 0, error.message().to_owned()))?;
        write_rig(&mut document, Some(&before), self);
        Ok(document.to_string())
    }

    /// Writes a rig file whole or not at all; `original`, where given, is the text whose comments and order are kept.
    pub fn write(&self, path: &Path, original: Option<&str>) -> Result<(), Error> {
        let text = original.map_or_else(|| Ok(self.to_toml()), |original| self.update_toml(original))?;
        replace_file(path, |file| file.write_all(text.as_bytes()))
    }

    /// Reads a rig file together with its text, which [`Rig::write`] can keep the comments of.
    pub fn read_with_text(path: &Path) -> Result<(Rig, String), Error> {
        let text = read_text(path)?;
        Ok((Rig::parse(&text, &path.display().to_string())?, text))
    }
}

/// Brings a document from one rig to another; `before` is `None` for an empty document, which gets everything.
fn write_rig(document: &mut DocumentMut, before: Option<&Rig>, now: &Rig) {
    let fresh = before.is_none();
    let blank = Rig::default();
    let before = before.unwrap_or(&blank);
    let name = |name: &String| Value::from(name.as_str());
    Writer { table: document.as_table_mut(), fresh }.put("name", &before.name, &now.name, name);

    let is_urdf = document.get("robot").is_some_and(|robot| robot.get("urdf").is_some());
    if fresh || is_urdf || before.robot != now.robot {
        in_section(document, "robot", "", |table| write_robot(table, fresh, &before.robot, &now.robot));
    }
    let joints = (before.robot.joints.as_slice(), now.robot.joints.as_slice());
    let names: Vec<&str> = now.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let is_new = write_list(document.as_table_mut(), "cameras", &names, |table, index, existed| {
        let camera = &now.cameras[index];
        let old = before.cameras.iter().find(|old| existed && old.name == camera.name);
        write_camera(table, old.map(|old| (old, joints.0)), (camera, joints.1));
    });
    if is_new {
        append_list(document, "cameras", CAMERAS);
    }
    let names: Vec<&str> = now.features.iter().map(|feature| feature.name.as_str()).collect();
    let is_new = write_list(document.as_table_mut(), "features", &names, |table, index, existed| {
        let feature = &now.features[index];
        let old = before.features.iter().find(|old| existed && old.name == feature.name);
        write_feature(table, old.map(|old| (old, joints.0)), (feature, joints.1));
    });
    if is_new {
        append_list(document, "features", "");
    }
    let names: Vec<&str> = now.targets.iter().map(|target| target.name.as_str()).collect();
    let is_new = write_list(document.as_table_mut(), "targets", &names, |table, index, existed| {
        let target = &now.targets[index];
        let old = before.targets.iter().find(|old| existed && old.name == target.name);
        write_target(table, old.map(|old| (old, joints.0)), (target, joints.1));
    });
    if is_new {
        append_list(document, "targets", "");
    }
    if fresh || before.noise != now.noise {
        let old = (!fresh).then_some(&before.noise);
        in_section(document, "noise", NOISE, |table| write_noise(table, old, &now.noise));
    }
    if before.estimate != now.estimate {
        in_section(document, "estimate", ESTIMATE, |table| write_estimate(table, &before.estimate, &now.estimate));
    }
    if before.fit != now.fit {
        document.remove("fit");
        if let Some(fit) = &now.fit {
            in_section(document, "fit", FIT, |table| write_fit(table, fit));
        }
    }
}

fn write_robot(table: &mut dyn TableLike, fresh: bool, before: &Robot, now: &Robot) {
    let is_urdf = table.contains_key("urdf");
    if is_urdf {
        // Rows, which say what was learned, take its place.
        ["urdf", "base", "tip", "pose"].iter().for_each(|key| drop(table.remove(key)));
    }
    let mut writer = Writer { table, fresh: fresh || is_urdf };
    writer.put_default("convention", before.convention, now.convention, |convention| Value::from(convention.name()));
    writer.put_pose("base", &before.base, &now.base);
    writer.put("link", &before.link, &now.link, |link| Value::from(link.as_str()));
    writer.put_pose("start", &before.start, &now.start);
    let names: Vec<&str> = now.joints.iter().map(|joint| joint.name.as_str()).collect();
    let is_new = write_list(table, "joints", &names, |table, index, existed| {
        let joint: &Joint = &now.joints[index];
        let old = before.joints.iter().find(|old| existed && old.name == joint.name);
        write_joint(table, old, joint);
    });
    if is_new && let Some(tables) = table.get_mut("joints").and_then(Item::as_array_of_tables_mut) {
        comment_on(tables.get_mut(0), &format!("\n{JOINTS}"));
    }
}

fn write_estimate(table: &mut dyn TableLike, before: &Estimate, now: &Estimate) {
    if before.fixed != now.fixed {
        set_texts(table, "fixed", &now.fixed);
    }
    if before.prior != now.prior {
        let mut prior = Table::new();
        for (path, sd) in &now.prior {
            prior.insert(path, Item::Value(number(*sd)));
        }
        table.remove("prior");
        table.insert("prior", Item::Table(prior));
    }
    if before.tag_side != now.tag_side {
        match now.tag_side {
            Some([side, Length::RULER]) => set(table, "tag_side", number(side)),
            Some(side) => set(table, "tag_side", numbers(&side)),
            None => drop(table.remove("tag_side")),
        }
    }
    if before.lengths != now.lengths {
        let lengths: Array = now.lengths.iter().map(length).collect();
        set(table, "lengths", Value::Array(lengths));
    }
}

fn length(given: &Length) -> Value {
    let (kind, names) = given.between.parts();
    let mut table = InlineTable::new();
    table.insert("between", Value::Array(names.iter().map(|name| format!("{kind}.{name}")).collect()));
    table.insert("length", number(given.length));
    table.insert("sd", number(given.sd));
    Value::InlineTable(table)
}

fn write_fit(table: &mut dyn TableLike, fit: &Fit) {
    for (key, count) in [("samples", fit.samples), ("observations", fit.observations), ("rejected", fit.rejected)] {
        set(table, key, Value::from(i64::try_from(count).unwrap_or(i64::MAX)));
    }
    set(table, "rms_px", number(fit.rms_px));
    set(table, "mean_px", number(fit.mean_px));
    if let Some(rms) = fit.rms_points_m {
        set(table, "rms_points_m", number(rms));
    }
    set_texts(table, "gauge", &fit.gauge);
    if !fit.joints.is_empty() {
        set(table, "joints", Value::Array(fit.joints.iter().map(|range| numbers(range)).collect()));
    }
    if fit.sd.is_empty() {
        return;
    }
    let mut deviations = Table::new();
    comment_on(Some(&mut deviations), &format!("\n{DEVIATIONS}"));
    for (path, sd) in &fit.sd {
        let value = if let [sd] = sd.as_slice() { number(*sd) } else { numbers(sd) };
        deviations.insert(path, Item::Value(value));
    }
    table.insert("sd", Item::Table(deviations));
}

/// Writes into the table of that name, which is appended with a comment where there is none.
fn in_section(document: &mut DocumentMut, key: &str, comment: &str, write: impl FnOnce(&mut dyn TableLike)) {
    if let Some(table) = document.get_mut(key).and_then(Item::as_table_like_mut) {
        return write(table);
    }
    let mut table = Table::new();
    write(&mut table);
    append(document, &mut table, comment);
    document.insert(key, Item::Table(table));
}

fn append_list(document: &mut DocumentMut, key: &str, comment: &str) {
    if let Some(Item::ArrayOfTables(mut tables)) = document.remove(key) {
        if let Some(first) = tables.get_mut(0) {
            append(document, first, comment);
        }
        document.insert(key, Item::ArrayOfTables(tables));
    }
}

/// Places a table after all others. Comments at the end of the file stay with what they followed.
fn append(document: &mut DocumentMut, table: &mut Table, comment: &str) {
    let trailing = document.trailing().as_str().unwrap_or_default().trim_end().to_owned();
    document.set_trailing("");
    let after = if trailing.is_empty() { String::new() } else { format!("{trailing}\n") };
    let gap = if document.is_empty() { "" } else { "\n" };
    comment_on(Some(table), &format!("{after}{gap}{comment}"));
    table.set_position(Some(isize::MAX));
}

fn comment_on(table: Option<&mut Table>, comment: &str) {
    if let Some(table) = table {
        table.decor_mut().set_prefix(comment);
    }
}
