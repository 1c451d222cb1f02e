//! What was learned, number by number, beside what was known.
use super::calibration::Subject;
use super::page::Page;
use crate::calibrate::{Finding, prior_sds, with_headers};
use crate::rig::{Parameter, Rig, Value};
use handeye_solvers::manifold::so3;
use std::collections::BTreeMap;

/// A number is that of its prior where its standard deviation exceeds this share of the prior's.
const ASSUMED: f64 = 0.9;

/// One row per parameter: before, learned, standard deviation.
pub(super) fn table(page: &mut Page, subject: &Subject<'_>) {
    let after = &subject.calibration.rig;
    let before = &with_headers(subject.before, subject.recording);
    let sd = after.fit.as_ref().map(|fit| &fit.sd);
    let moved = |path: &str| {
        let is_of = |finding: &Finding| matches!(finding, Finding::CameraMoved { camera, .. } if path.starts_with(&format!("cameras.{camera}.")));
        subject.calibration.report.findings.iter().any(is_of)
    };
    let given: BTreeMap<String, Parameter> =
        before.parameters().into_iter().map(|parameter| (parameter.path(before), parameter)).collect();
    let mut rows = Vec::new();
    for parameter in after.parameters() {
        let path = parameter.path(after);
        let Some(learned) = numbers(after, &parameter) else { continue };
        let given = given.get(&path);
        let known = given.and_then(|known| numbers(before, known));
        let priors = given.and_then(|known| prior_sds(before, known)).unwrap_or_default();
        let deviations = sd.and_then(|sd| sd.get(&path));
        let state = match deviations {
            Some(sd) => {
                let is_assumed = |index: usize, sd: f64| priors.get(index).is_some_and(|prior| sd > ASSUMED * prior);
                let cell = |(index, sd): (usize, &f64)| {
                    format!("{}{}", significant(*sd), if is_assumed(index, *sd) { " (assumed)" } else { "" })
                };
                sd.iter().enumerate().map(cell).collect::<Vec<_>>().join(", ")
            }
            None if moved(&path) || sd.is_none_or(BTreeMap::is_empty) && !after.is_fixed(&parameter) => {
                "not known".to_owned()
            }
            None => "held".to_owned(),
        };
        let known = known.map_or_else(|| "-".to_owned(), |known| joined(&known, fixed));
        rows.push(vec![path, known, joined(&learned, fixed), state]);
    }
    page.section("values", "What was learned");
    page.paragraph("In metres, radians and pixels; poses as translation and rotation vector. The last column is the standard deviation that \
                    the recording leaves; where it says assumed, the recording tells next to nothing, and the number is that of the prior. What hangs \
                    on such numbers, as features do on the frame of the last link, has their deviation too.");
    page.values_table(&["", "before", "learned", "standard deviation"], rows.iter().map(Vec::as_slice));
}

/// The numbers of a parameter; `None` where it has no value.
fn numbers(rig: &Rig, parameter: &Parameter) -> Option<Vec<f64>> {
    Some(match rig.value(parameter)? {
        Value::Number(number) => vec![number],
        Value::Numbers(numbers) => numbers,
        Value::Pose(pose) => pose.translation.iter().chain(&so3::log(&pose.rotation)).copied().collect(),
    })
}

fn joined(values: &[f64], digits: impl Fn(f64) -> String) -> String {
    values.iter().map(|value| digits(*value)).collect::<Vec<_>>().join(", ")
}

/// As many decimals as matter: tenths of a millimetre and of a milliradian, hundredths of a pixel.
fn fixed(value: f64) -> String {
    let digits = if value.abs() >= 50.0 { format!("{value:.2}") } else { format!("{value:.4}") };
    if digits == "-0.0000" { "0.0000".to_owned() } else { digits }
}

/// Two digits that count.
fn significant(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}
