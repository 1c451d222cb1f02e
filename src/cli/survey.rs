//! What a recording holds: samples, images, features, joint ranges, and which cameras see the same.
use super::table::Table;
use super::words::{count, list};
use handeye::recording::{Recording, Sample};
use handeye::rig::Rig;
use serde_json::{Map, Value, json};

/// Samples in which a feature has to be seen to be determined.
const NEEDED: usize = 2;

/// What is in a recording.
pub struct Survey {
    samples: usize,
    /// How many samples have joints, a pose, a joint action, a pose action.
    with: [(&'static str, usize); 4],
    joints: Vec<Range>,
    cameras: Vec<Seen>,
    /// Two cameras, samples that both see a feature in, and detections of the same feature at the same time.
    shared: Vec<(String, String, usize, usize)>,
    /// Features seen in fewer samples than needed.
    rare: Vec<String>,
}

/// Readings of a joint.
struct Range {
    name: String,
    least: f64,
    largest: f64,
    /// Readings outside the rig's limits.
    outside: usize,
}

/// What one camera saw.
#[derive(Default)]
struct Seen {
    name: String,
    images: usize,
    /// Pixels and points.
    detections: usize,
    points: usize,
    features: usize,
}

impl Survey {
    pub fn new(rig: &Rig, recording: &Recording) -> Self {
        let samples = &recording.samples;
        let having = |has: &dyn Fn(&Sample) -> bool| samples.iter().filter(|sample| has(sample)).count();
        let with = [
            ("joints", having(&|sample| sample.joints.is_some())),
            ("pose", having(&|sample| sample.pose.is_some())),
            ("joint_action", having(&|sample| sample.joint_action.is_some())),
            ("pose_action", having(&|sample| sample.pose_action.is_some())),
        ];
        let n_cameras = recording.cameras.len();
        let mut shared = Vec::new();
        for a in 0..n_cameras {
            for b in a + 1..n_cameras {
                let counts = samples.iter().map(|sample| in_common(sample, a as u32, b as u32));
                let (both, detections) =
                    counts.fold((0, 0), |(n, sum), common| (n + usize::from(common > 0), sum + common));
                let name = |index: usize| recording.cameras[index].name.clone();
                shared.push((name(a), name(b), both, detections));
            }
        }
        let mut seen = vec![0; recording.features.len()];
        for sample in samples {
            let mut features: Vec<u32> = detections(sample).map(|(_, feature)| feature).collect();
            features.sort_unstable();
            features.dedup();
            features.iter().for_each(|feature| seen[*feature as usize] += 1);
        }
        let rare = recording.features.iter().zip(seen).filter(|(_, samples)| *samples < NEEDED);
        Survey {
            samples: samples.len(),
            with,
            joints: (0..recording.joints.len()).filter_map(|joint| range(rig, recording, joint)).collect(),
            cameras: (0..n_cameras).map(|camera| seen_by(recording, camera)).collect(),
            shared,
            rare: rare.map(|(name, _)| name.clone()).collect(),
        }
    }

    pub fn json(&self) -> Value {
        let joints = self.joints.iter().map(|range| {
            let Range { least, largest, outside, .. } = range;
            (range.name.clone(), json!({ "min": least, "max": largest, "outside_limits": outside }))
        });
        let cameras = self.cameras.iter().map(|seen| {
            let Seen { images, detections, points, features, .. } = seen;
            let json = json!({ "images": images, "observations": detections, "points": points, "features": features });
            (seen.name.clone(), json)
        });
        let shared = self.shared.iter().map(|(a, b, samples, observations)| {
            json!({ "cameras": [a, b], "samples": samples, "observations": observations })
        });
        let with = self.with.iter().map(|(key, n)| ((*key).to_owned(), json!(n)));
        json!({
            "samples": self.samples,
            "observations": self.cameras.iter().map(|seen| seen.detections).sum::<usize>(),
            "samples_with": with.collect::<Map<_, _>>(),
            "joints": joints.collect::<Map<_, _>>(),
            "cameras": cameras.collect::<Map<_, _>>(),
            "shared": shared.collect::<Vec<_>>(),
            "rare_features": self.rare,
        })
    }
}

impl std::fmt::Display for Survey {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let with: Vec<String> =
            self.with.iter().filter(|(_, n)| *n > 0).map(|(key, n)| format!("{n} with {key}")).collect();
        writeln!(f, "the recording has {} ({})\n", count(self.samples, "sample"), with.join(", "))?;
        let has_points = self.cameras.iter().any(|seen| seen.points > 0);
        let points = |cell: String| has_points.then_some(cell);
        let header = ["camera", "images", "detections"].into_iter().chain(has_points.then_some("points"));
        let mut table = Table::new(&header.chain(["features", "per image"]).collect::<Vec<_>>());
        for seen in &self.cameras {
            let per_image = seen.detections as f64 / seen.images.max(1) as f64;
            let counts = [seen.images, seen.detections].map(|n| n.to_string());
            let row = [seen.name.clone()].into_iter().chain(counts).chain(points(seen.points.to_string()));
            table.row(row.chain([seen.features.to_string(), format!("{per_image:.1}")]));
        }
        write!(f, "{table}")?;
        for (a, b, samples, observations) in &self.shared {
            let shared = if *samples == 0 {
                "see nothing at the same time".to_owned()
            } else {
                format!("share {} in {}", count(*observations, "detection"), count(*samples, "sample"))
            };
            writeln!(f, "  {a} and {b} {shared}")?;
        }
        let mut table = Table::new(&["joint", "least", "largest", "outside limits"]);
        for Range { name, least, largest, outside } in &self.joints {
            table.row([name.clone(), format!("{least:.3}"), format!("{largest:.3}"), outside.to_string()]);
        }
        write!(f, "\n{table}")?;
        if !self.rare.is_empty() {
            writeln!(f, "\nseen in fewer than {NEEDED} samples, which does not determine them: {}", list(&self.rare))?;
        }
        Ok(())
    }
}

fn seen_by(recording: &Recording, camera: usize) -> Seen {
    let mut seen = Seen { name: recording.cameras[camera].name.clone(), ..Seen::default() };
    let mut features = std::collections::BTreeSet::new();
    for sample in &recording.samples {
        let of_camera = |one: &u32| *one as usize == camera;
        let of_sample = detections(sample).filter(|(camera, _)| of_camera(camera)).map(|(_, feature)| feature);
        let before = seen.detections;
        for feature in of_sample {
            seen.detections += 1;
            features.insert(feature);
        }
        seen.points += sample.points.iter().filter(|point| of_camera(&point.camera)).count();
        seen.images += usize::from(seen.detections > before);
    }
    seen.features = features.len();
    seen
}

/// Camera and feature of every pixel and point.
fn detections(sample: &Sample) -> impl Iterator<Item = (u32, u32)> + '_ {
    let pixels = sample.pixels.iter().map(|seen| (seen.camera, seen.feature));
    pixels.chain(sample.points.iter().map(|seen| (seen.camera, seen.feature)))
}

/// Features that two cameras see in one sample.
fn in_common(sample: &Sample, a: u32, b: u32) -> usize {
    let of = |camera| -> std::collections::BTreeSet<u32> {
        detections(sample).filter(|one| one.0 == camera).map(|one| one.1).collect()
    };
    of(a).intersection(&of(b)).count()
}

/// Readings of a joint, where there are any.
fn range(rig: &Rig, recording: &Recording, joint: usize) -> Option<Range> {
    let readings = recording.samples.iter().filter_map(|sample| Some(sample.joints.as_ref()?[joint]));
    let limits = rig.robot.joints.get(joint).map(|joint| joint.limits).unwrap_or_default();
    let (mut least, mut largest, mut outside) = (f64::INFINITY, f64::NEG_INFINITY, 0);
    for reading in readings {
        least = reading.min(least);
        largest = reading.max(largest);
        outside += usize::from(limits.exclude(reading));
    }
    (least <= largest).then(|| Range { name: recording.joints[joint].clone(), least, largest, outside })
}
