//! How much of a rig is known, unknown and held, by kind of parameter.
use super::table::Table;
use handeye::rig::{Parameter, Rig};
use serde_json::{Map, Value, json};

/// Kinds of parameters, in the order of [`Rig::parameters`].
const KINDS: [&str; 6] = ["base", "joint parameters", "camera poses", "intrinsics", "features", "targets"];

/// Parameters of one kind. A base that is held and left out is the identity, and counts as held.
#[derive(Clone, Copy, Default)]
pub struct Count {
    /// Given: a starting point that is refined.
    pub known: usize,
    /// Left out: learned.
    pub unknown: usize,
    /// Held at their values.
    pub held: usize,
}

/// Counts by kind, and the paths of what is unknown and held.
#[derive(Default)]
pub struct Counts {
    by_kind: [Count; KINDS.len()],
    pub unknown: Vec<String>,
    pub held: Vec<String>,
}

impl Counts {
    pub fn new(rig: &Rig) -> Self {
        let mut counts = Counts::default();
        for parameter in rig.parameters() {
            let of_kind = &mut counts.by_kind[kind(&parameter)];
            if rig.is_fixed(&parameter) {
                of_kind.held += 1;
                counts.held.push(parameter.path(rig));
            } else if rig.has_value(&parameter) {
                of_kind.known += 1;
            } else {
                of_kind.unknown += 1;
                counts.unknown.push(parameter.path(rig));
            }
        }
        counts
    }

    pub fn total(&self) -> Count {
        let add = |sum: Count, of_kind: &Count| Count {
            known: sum.known + of_kind.known,
            unknown: sum.unknown + of_kind.unknown,
            held: sum.held + of_kind.held,
        };
        self.by_kind.iter().fold(Count::default(), add)
    }

    pub fn table(&self) -> Table {
        let mut table = Table::new(&["", "given", "unknown", "held"]);
        for (kind, count) in KINDS.iter().zip(&self.by_kind) {
            if count.known + count.unknown + count.held > 0 {
                let numbers = [count.known, count.unknown, count.held].map(|n| n.to_string());
                table.row([(*kind).to_owned()].into_iter().chain(numbers));
            }
        }
        table
    }

    /// Kind -> counts.
    pub fn json(&self) -> Value {
        let entry = |(kind, count): (&&str, &Count)| {
            let Count { known, unknown, held } = count;
            (kind.replace(' ', "_"), json!({ "known": known, "unknown": unknown, "held": held }))
        };
        Value::Object(KINDS.iter().zip(&self.by_kind).map(entry).collect::<Map<_, _>>())
    }
}

fn kind(parameter: &Parameter) -> usize {
    match parameter {
        Parameter::Base => 0,
        Parameter::JointField { .. } => 1,
        Parameter::CameraPose(_) => 2,
        Parameter::CameraField { .. } => 3,
        Parameter::FeatureXyz(_) => 4,
        Parameter::TargetPose(_) => 5,
    }
}

/// In words, what of a learned rig was unknown before, what was refined, and what was held.
pub fn learned_in_words(before: &Rig, learned: &Rig) -> String {
    let given: std::collections::BTreeSet<String> = before
        .parameters()
        .iter()
        .filter(|parameter| before.has_value(parameter))
        .map(|parameter| parameter.path(before))
        .collect();
    let mut numbers = [[0; 3]; KINDS.len()];
    for parameter in learned.parameters().into_iter().filter(|parameter| learned.has_value(parameter)) {
        let what = match (learned.is_fixed(&parameter), given.contains(&parameter.path(learned))) {
            (true, _) => 2,
            (false, true) => 1,
            (false, false) => 0,
        };
        numbers[kind(&parameter)][what] += 1;
    }
    let parts = ["learned", "refined", "held"].iter().enumerate().filter_map(|(what, verb)| {
        let of_kind = KINDS.iter().zip(&numbers).filter(|(_, numbers)| numbers[what] > 0);
        let list: Vec<String> = of_kind.map(|(kind, numbers)| plural(numbers[what], kind)).collect();
        (!list.is_empty()).then(|| format!("{verb} {}", list.join(", ")))
    });
    parts.collect::<Vec<_>>().join("; ")
}

fn plural(n: usize, kind: &str) -> String {
    match n {
        1 if kind == "base" => "the base".to_owned(),
        1 => format!("1 {}", kind.strip_suffix('s').unwrap_or(kind)),
        _ => format!("{n} {kind}"),
    }
}
