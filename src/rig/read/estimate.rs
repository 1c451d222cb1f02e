//! The table `[estimate]`: what is held and what is roughly known, by parameter path.
use super::document::{Field, Fields, Node};
use crate::Error;
use crate::error::suggestion;
use crate::rig::paths::{CameraField, INTRINSICS, JointField, covers, matches};
use crate::rig::{Ends, Estimate, Length, Parameter, Rig};
use std::collections::BTreeMap;

/// Paths are checked against the other parts of the rig, which are complete.
pub(super) fn read_estimate(node: &Node, rig: &Rig) -> Result<Estimate, Error> {
    let fields = node.clone().table(&["fixed", "prior", "lengths", "tag_side"])?.labelled("estimate");
    let fixed = match fields.field("fixed") {
        Some(list) => list.value.list()?,
        None => Vec::new(),
    };
    let prior = fields.optional("prior", |node| {
        read_by_path(node, |field, path| {
            if let Some(problem) = problem_of_pattern(path, rig) {
                return Err(field.value.error(problem));
            }
            field.value.positive()
        })
    })?;
    Ok(Estimate {
        fixed: fixed.iter().map(|node| read_fixed(node, rig)).collect::<Result<_, Error>>()?,
        prior: prior.unwrap_or_default(),
        lengths: match fields.field("lengths") {
            Some(list) => list.value.list()?.iter().map(|node| read_length(node, rig)).collect::<Result<_, Error>>()?,
            None => Vec::new(),
        },
        tag_side: fields.optional("tag_side", read_tag_side)?,
    })
}

/// A length [m], or `[length, sd]`.
fn read_tag_side(node: &Node) -> Result<[f64; 2], Error> {
    let [side, sd] = if node.is_list() { node.numbers::<2>()? } else { [node.number()?, Length::RULER] };
    if let Some(problem) = Estimate::problem_of_tag_side([side, sd]) {
        return Err(node.error(problem));
    }
    Ok([side, sd])
}

/// `{ between = ["features.A", "features.B"], length = 0.12, sd = 0.0005 }`, or between two cameras.
fn read_length(node: &Node, rig: &Rig) -> Result<Length, Error> {
    let fields = node.clone().table(&["between", "length", "sd"])?.labelled("estimate.lengths");
    let need = |key: &str| fields.field(key).ok_or_else(|| fields.error(format!("has no `{key}`")));
    Ok(Length {
        between: read_ends(&need("between")?.value, rig)?,
        length: need("length")?.value.positive()?,
        sd: fields.optional("sd", Node::positive)?.unwrap_or(Length::RULER),
    })
}

/// Where the rig has no features or cameras of its own, the recording names them.
fn read_ends(node: &Node, rig: &Rig) -> Result<Ends, Error> {
    let paths = node.list()?.iter().map(|node| node.text()).collect::<Result<Vec<_>, Error>>()?;
    let [one, other] = paths.as_slice() else {
        return Err(node.error(format!("has two ends, as in [\"features.A\", \"features.B\"], found {}", paths.len())));
    };
    let ends = Ends::new([one, other]).map_err(|problem| node.error(problem))?;
    let known = ends.among(rig);
    match ends.problem(&known) {
        Some(problem) if !known.is_empty() => Err(node.error(problem)),
        _ => Ok(ends),
    }
}

fn read_fixed(node: &Node, rig: &Rig) -> Result<String, Error> {
    let pattern = node.text()?;
    match problem_of_fixed(pattern, rig) {
        Some(problem) => Err(node.error(problem)),
        None => Ok(pattern.to_owned()),
    }
}

/// Why a pattern holds nothing, or something that has no value.
pub(crate) fn problem_of_fixed(pattern: &str, rig: &Rig) -> Option<String> {
    if let Some(problem) = problem_of_pattern(pattern, rig) {
        return Some(problem);
    }
    let lacking = |parameter: &Parameter| {
        // A base that is left out is the identity, and intrinsics may come from the recording.
        !matches!(parameter, Parameter::Base | Parameter::CameraField { .. }) && !rig.has_value(parameter)
    };
    let mut parameters = rig.parameters().into_iter().filter(lacking).map(|parameter| parameter.path(rig));
    let path = parameters.find(|path| matches(pattern, path))?;
    Some(format!("`{pattern}` holds `{path}`, which has no value (give one, or do not hold it)"))
}

/// A table by parameter path. Quoted paths are one key; paths without quotes are tables within tables.
pub(super) fn read_by_path<'a, T>(
    node: &Node<'a>,
    read: impl Fn(&Field<'a>, &str) -> Result<T, Error>,
) -> Result<BTreeMap<String, T>, Error> {
    let mut values = BTreeMap::new();
    let mut open: Vec<(String, Fields)> = vec![(String::new(), node.clone().any_table()?)];
    while let Some((prefix, fields)) = open.pop() {
        for field in fields.iter() {
            let path = if prefix.is_empty() { field.key.to_owned() } else { format!("{prefix}.{}", field.key) };
            if field.value.is_table() {
                open.push((path, field.value.clone().any_table()?));
                continue;
            }
            let value = read(&field, &path)?;
            if values.insert(path.clone(), value).is_some() {
                return Err(field.value.error(format!("`{path}` is given twice")));
            }
        }
    }
    Ok(values)
}

/// Why a pattern covers nothing. Where the rig has no joints, cameras or features of its own, the recording names them.
pub(super) fn problem_of_pattern(pattern: &str, rig: &Rig) -> Option<String> {
    let components: Vec<&str> = pattern.split('.').collect();
    let joints: Vec<&str> = rig.robot.joints.iter().map(|joint| joint.name.as_str()).collect();
    let cameras: Vec<&str> = rig.cameras.iter().map(|camera| camera.name.as_str()).collect();
    let features: Vec<&str> = rig.features.iter().map(|feature| feature.name.as_str()).collect();
    let targets: Vec<&str> = rig.targets.iter().map(|target| target.name.as_str()).collect();
    let joint_fields: Vec<&str> = JointField::ALL.iter().map(|field| field.name()).collect();
    let lens = CameraField::ALL.iter().map(|field| field.name());
    let camera_fields: Vec<&str> = std::iter::once("pose").chain(lens).chain([INTRINSICS]).collect();
    // What may stand at each place of a path, for each kind of parameter; an empty list is any name.
    let grammar: [&[&[&str]]; 5] = [
        &[&["robot"], &["base"]],
        &[&["robot"], &["joints"], &joints, &joint_fields],
        &[&["cameras"], &cameras, &camera_fields],
        &[&["features"], &features, &["xyz"]],
        &[&["targets"], &targets, &["pose"]],
    ];
    let fits = |found: &str, known: &[&str]| match known {
        [] => !found.is_empty(),
        known => known.iter().any(|name| covers(found, name)),
    };
    // The first component at which no kind of parameter goes on, and what would do there.
    for (place, found) in components.iter().enumerate() {
        let begun = |kind: &&&[&[&str]]| components[..place].iter().zip(kind.iter()).all(|(c, known)| fits(c, known));
        let going: Vec<&&[&[&str]]> = grammar.iter().filter(begun).collect();
        let known: Vec<&[&str]> = going.iter().filter_map(|kind| kind.get(place).copied()).collect();
        if known.is_empty() {
            return Some(format!(
                "`{pattern}` matches nothing: there is nothing below `{}`",
                components[..place].join(".")
            ));
        }
        if !known.iter().any(|known| fits(found, known)) {
            let mut words: Vec<&str> = known.concat();
            words.dedup();
            return Some(format!("`{pattern}` matches nothing: unknown `{found}` {}", suggestion(found, words)));
        }
    }
    None
}
