//! What was learned, number by number, beside what was known.
use super::calibration::Subject;
use super::page::Page;
use crate::calibrate::prior_sds;
use crate::rig::{Camera, Parameter, Rig, Value};
use handeye_solvers::manifold::so3;

/// A number is that of its prior where its standard deviation exceeds this share of the prior's.
const ASSUMED: f64 = 0.9;

/// One row per parameter: before, learned, standard deviation.
pub(super) fn table(page: &mut Page, subject: &Subject<'_>) {
    let after = &subject.calibration.rig;
    let before = &start(subject);
    let sd = after.fit.as_ref().map(|fit| &fit.sd);
    let mut rows = Vec::new();
    for parameter in after.parameters() {
        let path = parameter.path(after);
        let Some(learned) = numbers(after, &parameter) else { continue };
        let given = before.parameters().into_iter().find(|known| known.path(before) == path);
        let known = given.as_ref().and_then(|known| numbers(before, known));
        let priors = given.and_then(|known| prior_sds(before, &known)).unwrap_or_default();
        let deviations = sd.and_then(|sd| sd.get(&path));
        let state = match deviations {
            Some(sd) => {
                let is_assumed = |index: usize, sd: f64| priors.get(index).is_some_and(|prior| sd > ASSUMED * prior);
                let cell = |(index, sd): (usize, &f64)| {
                    format!("{}{}", significant(*sd), if is_assumed(index, *sd) { " (assumed)" } else { "" })
                };
                sd.iter().enumerate().map(cell).collect::<Vec<_>>().join(", ")
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
    page.table(&["", "before", "learned", "standard deviation"], rows.iter().map(Vec::as_slice));
}

/// What learning started from: the rig that was given, and of its cameras what the recording's header says besides.
fn start(subject: &Subject<'_>) -> Rig {
    let mut before = subject.before.clone();
    for recorded in &subject.recording.cameras {
        if before.cameras.iter().all(|camera| camera.name != recorded.name) {
            before.cameras.push(Camera { name: recorded.name.clone(), ..Camera::default() });
        }
        let Some(camera) = before.cameras.iter_mut().find(|camera| camera.name == recorded.name) else { continue };
        if camera.distortion.is_none() && camera.model.is_none_or(|model| recorded.model.is_none_or(|own| own == model))
        {
            camera.distortion = recorded.distortion.clone();
        }
        camera.size = camera.size.or(recorded.size);
        camera.fx = camera.fx.or(recorded.fx);
        camera.fy = camera.fy.or(recorded.fy);
        camera.cx = camera.cx.or(recorded.cx);
        camera.cy = camera.cy.or(recorded.cy);
    }
    before
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
