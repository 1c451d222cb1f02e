//! Whether the errors of a fit are noise: the answer in words, with the figures that it rests on, and their histogram.
use super::charts::histogram;
use super::page::Page;
use super::residuals::Residual;
use super::sections::scales;
use crate::calibrate::{Distance, Finding, Kind, OverstatedNoise, is_wrong, yardstick};
use crate::rig::Rig;
use std::collections::BTreeMap;

/// Noise puts this share of coordinates beyond three standard deviations; more than so many times as many is not noise.
const BEYOND: f64 = 0.0027;
const TAILS: f64 = 3.0;

/// Errors of one image that go the same way this many times as much as independent ones do are not noise.
const SHIFTED: f64 = 2.0;

/// The answer, and the distances beside what Gaussian noise of their own size gives. `findings`: what was left out; `overstated`: noise that is
/// stated larger than it is.
pub(super) fn section(
    page: &mut Page,
    rig: &Rig,
    residuals: &[Residual],
    findings: &[Finding],
    overstated: &[OverstatedNoise],
) {
    let sds = scales(rig, residuals);
    let used = in_use(rig, residuals, findings);
    if used.is_empty() {
        return;
    }
    page.section("histogram", "Are the errors noise?");
    let left_out = match residuals.len() - used.len() {
        0 => "Nothing was left out of these figures.".to_owned(),
        count => format!("The {count} detections that do not fit are not counted."),
    };
    page.paragraph(&format!("{} {left_out}", answer(&used, &sds).1));
    page.list(&overstated.iter().map(|one| format!("But {one}.")).collect::<Vec<_>>());
    let coordinates: Vec<f64> = used.iter().flat_map(|residual| over_sd(residual, &sds)).collect();
    let gaussian = |x: f64| (-0.5 * x * x).exp() / (2.0 * std::f64::consts::PI).sqrt();
    page.drawing(
        &histogram(&coordinates, [-5.0, 5.0], 50, Some(&gaussian)),
        "residual coordinates over the standard deviation of their camera, and the curve that noise alone would give; what lies beyond 5 is counted at the ends",
    );
}

/// Whether nothing but noise is in the errors of what was not left out; true where there are none.
pub(super) fn is_alone(rig: &Rig, residuals: &[Residual], findings: &[Finding]) -> bool {
    let sds = scales(rig, residuals);
    let used = in_use(rig, residuals, findings);
    used.is_empty() || answer(&used, &sds).0
}

/// What was not left out, with others or by itself, as a calibration judges it.
pub(super) fn in_use<'a>(rig: &Rig, residuals: &'a [Residual], findings: &[Finding]) -> Vec<&'a Residual> {
    let mut used: Vec<&Residual> = residuals.iter().filter(|one| !is_named(rig, one, findings)).collect();
    let mut distances: Vec<f64> = used.iter().map(|one| one.distance()).collect();
    let yardstick = yardstick(Kind::Pixels, rig.noise.pixels, &mut distances);
    used.retain(|one| !is_wrong(one.distance(), yardstick));
    used
}

fn over_sd(residual: &Residual, sds: &[f64]) -> [f64; 2] {
    residual.error.map(|error| error / sds[residual.camera])
}

/// Yes or no, and by which figures.
fn answer(used: &[&Residual], sds: &[f64]) -> (bool, String) {
    let coordinates: Vec<f64> = used.iter().flat_map(|residual| over_sd(residual, sds)).collect();
    let n = coordinates.len() as f64;
    let beyond = coordinates.iter().filter(|x| x.abs() > 3.0).count() as f64 / n;
    // |Σ e|² of n independent errors of two coordinates is 2 n on average.
    let mut images: BTreeMap<(usize, usize), ([f64; 2], f64)> = BTreeMap::new();
    for residual in used {
        let (sum, count) = images.entry((residual.sample, residual.camera)).or_default();
        let [u, v] = over_sd(residual, sds);
        *sum = [sum[0] + u, sum[1] + v];
        *count += 1.0;
    }
    let of_images = images.values().map(|([u, v], count)| (u * u + v * v) / (2.0 * count));
    let shifted = of_images.sum::<f64>() / images.len() as f64;
    // Three standard deviations of either figure under noise are allowed on top.
    let most_beyond = (TAILS * BEYOND).max(BEYOND + 3.0 * (BEYOND / n).sqrt());
    let most_shifted = SHIFTED.max(1.0 + 3.0 / (images.len() as f64).sqrt());
    let figures = format!(
        "{:.1} % of the coordinates lie beyond three standard deviations (noise alone: {:.1} %), and the errors within an image go the same way \
         {shifted:.1} times as much as independent ones (noise alone: 1.0)",
        1e2 * beyond,
        1e2 * BEYOND
    );
    let words = match (beyond > most_beyond, shifted > most_shifted) {
        (false, false) => return (true, format!("Yes: {figures}.")),
        (_, true) => {
            "Whole images are shifted, by joints that do not repeat or are read with noise, a lens model that leaves something out, or images \
             that were not taken where the joints were read."
        }
        (true, false) => "There are more large errors than noise makes: single detections are wrong.",
    };
    (false, format!("No: {figures}. {words}"))
}

/// True for a detection of a sample, an image or a camera that is named as not fitting.
fn is_named(rig: &Rig, residual: &Residual, findings: &[Finding]) -> bool {
    let camera_name = &rig.cameras[residual.camera].name;
    let is_meant = |finding: &Finding| match finding {
        Finding::WrongJoints { sample, .. } | Finding::UnknownState { sample } => *sample == residual.sample,
        Finding::WrongImage { sample, camera, off: Distance::Pixels(_) } => {
            *sample == residual.sample && camera == camera_name
        }
        Finding::CameraMoved { camera, .. } => camera == camera_name,
        // What is wrong are the image's points.
        Finding::WrongImage { off: Distance::Metres(_), .. }
        | Finding::Outliers { .. }
        | Finding::UnseenCamera { .. }
        | Finding::Misfit { .. }
        | Finding::Lag { .. }
        | Finding::MissedLength { .. }
        | Finding::FarFromGiven { .. } => false,
    };
    findings.iter().any(is_meant)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rig::catalog;

    #[test]
    fn an_image_whose_points_are_wrong_keeps_its_pixels() {
        let rig = catalog::rig("ur5").unwrap();
        let residual = Residual { sample: 3, camera: 0, feature: 0, seen: [0.0; 2], error: [0.1; 2] };
        let wrong = |off: Distance| Finding::WrongImage { sample: 3, camera: rig.cameras[0].name.clone(), off };
        assert!(is_named(&rig, &residual, &[wrong(Distance::Pixels(40.0))]));
        assert!(!is_named(&rig, &residual, &[wrong(Distance::Metres(0.04))]));
    }
}
