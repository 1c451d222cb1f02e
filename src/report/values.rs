//! What was learned, number by number, beside what was known.
use super::calibration::Subject;
use super::page::Page;
use crate::rig::{Parameter, Rig, Value};
use handeye_solvers::manifold::so3;

/// One row per parameter: before, learned, standard deviation.
pub(super) fn table(page: &mut Page, subject: &Subject<'_>) {
    let (before, after) = (subject.before, &subject.calibration.rig);
    let sd = after.fit.as_ref().map(|fit| &fit.sd);
    let mut rows = Vec::new();
    for parameter in after.parameters() {
        let path = parameter.path(after);
        let Some(learned) = numbers(after, &parameter) else { continue };
        let known = before
            .parameters()
            .into_iter()
            .find(|known| known.path(before) == path)
            .and_then(|known| numbers(before, &known));
        let deviations = sd.and_then(|sd| sd.get(&path));
        let state = match deviations {
            Some(sd) => joined(sd, significant),
            None => "held".to_owned(),
        };
        let known = known.map_or_else(|| "-".to_owned(), |known| joined(&known, fixed));
        rows.push(vec![path, known, joined(&learned, fixed), state]);
    }
    page.section("values", "What was learned");
    page.paragraph("In metres, radians and pixels; poses as translation and rotation vector. The last column is the standard deviation that the recording leaves.");
    page.table(&["", "before", "learned", "standard deviation"], rows.iter().map(Vec::as_slice));
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
    if value.abs() >= 50.0 { format!("{value:.2}") } else { format!("{value:.4}") }
}

/// Two digits that count.
fn significant(value: f64) -> String {
    if value == 0.0 { "0".to_owned() } else { format!("{value:.1e}") }
}
