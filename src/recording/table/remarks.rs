//! What has to be said of a table's columns.
use super::columns::Columns;
use super::{Actions, Angles, TableOptions};
use crate::error::suggestion;
use crate::recording::OpenOptions;
use crate::recording::names::joint_name;
use crate::recording::order::note_on_others;
use crate::recording::same_joints::are_those;

/// What the options name and the table does not have.
pub(super) fn without_effect(columns: &Columns, options: &OpenOptions) -> Option<String> {
    let joints = || columns.joint_names.iter().map(String::as_str);
    let TableOptions { angles, actions, episodes } = &options.table;
    if let Angles::Degrees(named) = angles
        && let Some(name) = named.iter().find(|name| !columns.joint_names.contains(&joint_name(name)))
    {
        return Some(format!("there is no joint `{name}` to take for degrees {}", suggestion(name, joints())));
    }
    let mut read = [&columns.joints, &columns.joint_action, &columns.action].into_iter().flatten();
    let problem = match (angles, actions) {
        _ if !episodes.is_empty() && columns.episode.is_none() => {
            "has no column `episode_index`, of which --episodes would name some"
        }
        (_, Actions::Targets | Actions::Motions) if !columns.joint_action.is_empty() => {
            "has commanded motions in `joint_action.NAME`, beside which --actions has no effect"
        }
        (_, Actions::Targets | Actions::Motions) if columns.actions.is_empty() => {
            "has no columns `action.NAME` (nor LeRobot's `action`), of which --actions would say what they hold"
        }
        (_, Actions::Targets) if columns.joints.is_empty() => {
            "has no columns `joints.NAME`, from which --actions targets would lead; `motions` needs none"
        }
        (Angles::Degrees(_), _) if read.next().is_none() => "has no joints, which --degrees would take for degrees",
        (Angles::Radians, _) if read.all(|angle| angle.in_degrees) => {
            "has no joints but in columns that say `_deg`, where --radians has no effect"
        }
        _ => return None,
    };
    Some(problem.to_owned())
}

/// Why a table is no recording.
pub(super) fn nothing(file: &str, header: &[String], rows: usize) -> String {
    let columns = header.join(", ");
    match rows {
        0 => format!("{file}: has no rows, only the columns {columns}"),
        _ => format!(
            "{file}: has no joints (`joints.NAME`, or columns that --joints names), no pose (`pose.x`) and no features (`CAMERA.FEATURE.u`); it \
             has the columns {columns}"
        ),
    }
}

/// What the columns leave open, or hold beside what is taken.
pub(super) fn note_on_columns(columns: &Columns, options: &OpenOptions, left_out: &[String]) -> Vec<String> {
    let mut notes = Vec::new();
    let others: Vec<&str> = columns.others.iter().chain(left_out).map(String::as_str).collect();
    if !others.is_empty() {
        notes.push(format!("columns that say nothing of a recording are left out: {}", others.join(", ")));
    }
    if !columns.actions.is_empty() && options.table.actions == Actions::Unsaid {
        let of = if columns.actions == columns.joint_names {
            String::new()
        } else {
            format!(" (of {})", columns.actions.join(", "))
        };
        notes.push(format!(
            "actions are left out{of}; --actions says whether they are targets or motions of the joints"
        ));
    }
    notes.extend(note_on_others(&columns.named_joints, &columns.joint_names));
    let is_given = !options.joints.is_empty() || are_those(&options.known_joints, &columns.joint_names);
    if !columns.joints.is_empty() && !is_given {
        notes.push(format!(
            "joints are in the order of the columns: {}; where that is not from base to tip, give a rig with these names or --joints",
            columns.joint_names.join(", ")
        ));
    }
    let unsaid = columns.joints.iter().filter(|joint| !joint.in_degrees).count();
    if unsaid > 0 && options.table.angles == Angles::Unsaid {
        notes.push("joints are taken for radians or metres, since no column says `_deg`".to_owned());
    }
    notes
}
