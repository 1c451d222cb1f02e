//! Where the robot was when images were taken, between the rows that say it.
use super::actions::take_actions;
use super::clock::{nanoseconds, seconds};
use super::images::Pairing;
use super::track::{At, Track};
use super::whereabouts::Whereabouts;
use super::{Recording, Sample};
use handeye_solvers::Pose;
use std::collections::BTreeMap;

/// When images were taken [ns], and what the first of them is called.
pub(super) struct Moment<'a> {
    pub name: &'a str,
    pub time: i64,
}

/// Joints and poses at the times of the images, as they are interpolated there; and what is commanded where images were taken at the times of two rows
/// that follow one another. `spans`: from when to when rows say anything, see [`whereabouts`].
///
/// Errors: in words, where rows say nothing, or nothing of the time of any image.
pub(super) fn at_times(
    images: &[Moment],
    Whereabouts { joints, poses, .. }: Whereabouts,
    spans: [Span; 2],
    states: &Recording,
    notes: &mut Vec<String>,
) -> Result<Vec<Sample>, String> {
    let gaps: Vec<Gaps> = joints.iter().zip(&poses).map(|(joints, pose)| [gap(joints), gap(pose)]).collect();
    note_on_outside(images, &gaps, spans, notes)?;
    notes.extend(note_on_gaps(images, &gaps));
    notes.extend(notes_on_missing(&gaps, spans));

    let sample = |(joints, pose): (Option<At<Vec<f64>>>, Option<At<Pose>>)| Sample {
        joints: joints.map(|at| at.value),
        pose: pose.map(|at| at.value),
        ..Sample::default()
    };
    let mut samples: Vec<Sample> = joints.into_iter().zip(poses).map(sample).collect();
    let times = states.samples.iter().enumerate().filter_map(|(row, sample)| Some((nanoseconds(sample.time?), row)));
    let row_at: BTreeMap<i64, usize> = times.collect();
    let rows: Vec<Option<usize>> = images.iter().map(|image| row_at.get(&image.time).copied()).collect();
    take_actions(&mut samples, &rows, states, Pairing::Time, notes);
    Ok(samples)
}

/// Where rows have the robot at some moments [ns, sorted], and from when to when they say anything of its joints and of its tip.
pub(super) fn whereabouts(moments: Vec<i64>, states: &Recording) -> (Whereabouts, [Span; 2]) {
    let mut joints: Track<Vec<f64>> = Track::new(moments.len());
    let mut poses: Track<Pose> = Track::new(moments.len());
    for sample in &states.samples {
        let Some(time) = sample.time.map(nanoseconds) else { continue };
        if let Some(read) = &sample.joints {
            joints.add(&moments, time, read);
        }
        if let Some(pose) = &sample.pose {
            poses.add(&moments, time, pose);
        }
    }
    let spans = [joints.span(), poses.span()];
    let (joints, poses) = (joints.at(&moments), poses.at(&moments));
    (Whereabouts { moments, joints, poses }, spans)
}

/// How far apart the joints are, and the tip poses, that a sample lies between [ns]; `None` where it does not.
type Gaps = [Option<i64>; 2];

/// First and last time at which something was read [ns].
pub(super) type Span = Option<[i64; 2]>;

fn gap<T>(found: &Option<At<T>>) -> Option<i64> {
    found.as_ref().map(|at| at.gap)
}

/// Says how many images were taken while nothing was read. Errors: where all were.
fn note_on_outside(images: &[Moment], gaps: &[Gaps], spans: [Span; 2], notes: &mut Vec<String>) -> Result<(), String> {
    let (Some(first), Some(last)) =
        (spans.iter().flatten().map(|span| span[0]).min(), spans.iter().flatten().map(|span| span[1]).max())
    else {
        return Err("no row has a time and joints or a pose".to_owned());
    };
    let off = |image: &Moment| first.saturating_sub(image.time).max(image.time.saturating_sub(last));
    let outside: Vec<&Moment> =
        images.iter().zip(gaps).filter(|(_, gaps)| **gaps == [None; 2]).map(|(image, _)| image).collect();
    if outside.len() == images.len()
        && let Some(nearest) = outside.iter().min_by_key(|image| off(image))
    {
        return Err(format!(
            "no image was taken while the robot was recorded, from {} s to {} s: the nearest, `{}` of {} s, is {} s off",
            seconds(first),
            seconds(last),
            nearest.name,
            seconds(nearest.time),
            seconds(off(nearest))
        ));
    }
    if let Some(farthest) = outside.iter().max_by_key(|image| off(image)) {
        notes.push(format!(
            "{} of {} samples are outside of the time that the robot was recorded, image `{}` by {} s",
            outside.len(),
            images.len(),
            farthest.name,
            seconds(off(farthest))
        ));
    }
    Ok(())
}

fn note_on_gaps(images: &[Moment], gaps: &[Gaps]) -> Option<String> {
    let widest = |gaps: &Gaps| gaps.iter().flatten().copied().max().unwrap_or(0);
    let pairs = images.iter().zip(gaps).rev();
    let (image, gaps) = pairs.max_by_key(|(_, gaps)| widest(gaps)).filter(|(_, gaps)| widest(gaps) > 0)?;
    let (name, apart) = (image.name, seconds(widest(gaps)));
    Some(format!("states are interpolated, between two that are up to {apart:.6} s apart (image `{name}`)"))
}

/// Joints that are missing where there are tip poses, and the other way round.
fn notes_on_missing(gaps: &[Gaps], spans: [Span; 2]) -> Vec<String> {
    let note = |(missing, what, other): (usize, &str, &str)| {
        let [first, last] = spans[missing]?.map(seconds);
        let count = gaps.iter().filter(|gaps| gaps[missing].is_none() && gaps[1 - missing].is_some()).count();
        let all = gaps.len();
        (count > 0).then(|| {
            format!("{count} of {all} samples have {other} and no {what}, which were read from {first} s to {last} s")
        })
    };
    [(0, "joints", "a tip pose"), (1, "tip poses", "joints")].into_iter().filter_map(note).collect()
}
