//! Table 3: how long the model's queries take.
use super::setting::{record, rig};
use super::{Experiment, Options, Outcome, Published, Row};
use crate::Error;
use crate::chain::{JointChain, Posture};
use crate::factors::{ForwardKinematics, Intrinsics, PoseReading, Reprojection};
use crate::infer::{InferOptions, Inference, InverseKinematics, InverseOptions, Names, Prior, Sighting};
use crate::rig::{Model, Rig};
use cpu_time::ThreadTime;
use handeye_solvers::{DynamicVector, Graph, Pose, Workspace};
use std::hint::black_box;
use std::sync::Arc;

pub(super) const EXPERIMENT: Experiment = Experiment {
    name: "table3",
    about: "how long the model's queries take",
    source: "Gothoskar et al., table 3",
    trials: 50,
    is_timed: true,
    is_seeded: true,
    run,
};

/// Mean and standard deviation [ms].
const PUBLISHED: [(&str, f64, f64); 11] = [
    ("forward kinematics", 1.27, 0.01),
    ("forward camera-feature", 1.43, 0.01),
    ("forward end to end", 2.58, 0.01),
    ("loss, pixels", 0.041, 0.003),
    ("loss, pose", 0.0785, 0.004),
    ("gradient, end to end", 16.1, 0.81),
    ("gradient, kinematics", 12.6, 0.45),
    ("gradient, camera-feature", 9.12, 0.37),
    ("infer pose from image", 0.511, 0.185),
    ("infer joints from pose", 101.0, 1.1),
    ("infer joints from image", 102.0, 1.1),
];

/// A query is repeated until this much CPU time has gone by [ms].
const ENOUGH: f64 = 1.0;

fn run(options: &Options) -> Result<Outcome, Error> {
    let rig = rig()?;
    let mut rows: Vec<Vec<Option<f64>>> = vec![Vec::new(); PUBLISHED.len()];
    // One after the other: on two threads they would disturb each other.
    for trial in 0..options.trials as u64 {
        let times = Queries::new(&rig, options.seed.wrapping_add(trial))?.times()?;
        rows.iter_mut().zip(times).for_each(|(row, time)| row.push(Some(time)));
    }
    let row = |(&(label, mean, sd), ours): (&(&str, f64, f64), Vec<Option<f64>>)| {
        Row::new(label, Published::spread(mean, sd), &ours)
    };
    let rows: Vec<Row> = PUBLISHED.iter().zip(rows).map(row).collect();
    let faster = |row: &Row| Some((row.published?.mean / row.median()?, row.label.clone()));
    let least = rows.iter().filter_map(faster).min_by(|a, b| a.0.total_cmp(&b.0));
    let least = least.map(|(ratio, label)| format!("at least {ratio:.0} times faster than published ({label})"));
    Ok(Outcome {
        setting: "UR5, 12 features, 2 cameras; one sample".to_owned(),
        measure: "CPU time of one thread [ms]",
        abscissa: None,
        rows,
        notes: least.into_iter().chain([NOTE.to_owned()]).collect(),
    })
}

const NOTE: &str = "the paper's are of PyTorch; gradients are by every parameter of the part, and ours are whole normal equations; joints \
                    from a pose start at random ones inside the limits, joints from an image at nothing";

/// One sample, and what the queries need.
struct Queries {
    model: Model,
    chain: JointChain,
    inference: Inference,
    inverse: InverseKinematics,
    joints: Vec<f64>,
    /// Of another sample: where inverse kinematics begins.
    start: Vec<f64>,
    sightings: Vec<Sighting>,
    sigma: f64,
}

impl Queries {
    fn new(rig: &Rig, seed: u64) -> Result<Self, Error> {
        let recording = record(rig, 2, seed)?;
        let names = Names::new(rig, &recording);
        let joints = |sample: usize| recording.samples[sample].joints.clone().unwrap_or_default();
        let model = Model::new(rig)?;
        Ok(Queries {
            chain: model.joint_chain(),
            model,
            inference: Inference::new(rig, InferOptions::default())?,
            inverse: InverseKinematics::new(rig, InverseOptions::default())?,
            joints: joints(0),
            start: joints(1),
            sightings: names.sightings(&recording.samples[0]),
            sigma: rig.noise.pixels,
        })
    }

    /// In the order of the published ones [ms].
    fn times(mut self) -> Result<[f64; 11], Error> {
        let Queries { model, chain, inference, inverse, joints, start, sightings, sigma } = &mut self;
        let mut posture = Posture::default();
        chain.posture(joints, &mut posture);
        let tip = posture.tip();
        let mut pixels = vec![[0.0; 2]; sightings.len()];
        let seen: Vec<[f64; 2]> = sightings.iter().map(|sighting| sighting.pixel).collect();
        let predict = |links: &[Pose], pixels: &mut [[f64; 2]]| {
            for (pixel, sighting) in pixels.iter_mut().zip(sightings.iter()) {
                *pixel = model.pixel(sighting.camera, sighting.feature, links);
            }
        };
        let kinematics = time(|| {
            black_box(chain.tip(black_box(joints)));
        });
        let camera_feature = time(|| predict(black_box(&posture.links), black_box(&mut pixels)));
        let end_to_end = time(|| {
            chain.posture(black_box(joints), &mut posture);
            predict(&posture.links, black_box(&mut pixels));
        });
        let loss_pixels = time(|| {
            let squared = |(a, b): (&[f64; 2], &[f64; 2])| (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2);
            black_box(black_box(&pixels).iter().zip(&seen).map(squared).sum::<f64>());
        });
        let loss_pose = time(|| {
            let other = black_box(&model.base);
            black_box(tip.angle_to(other).powi(2) + (tip.translation - other.translation).norm_squared());
        });
        // Before the graphs: their kernels leave wide vector registers in use, which slows down what follows.
        let pose = time(|| {
            black_box(inference.poses(black_box(&*sightings)));
        });
        let by_kinematics = time_of(kinematics_graph(model, joints, &tip));
        let by_camera_feature = time_of(image_graph(model, sightings, *sigma, None, &tip));
        let by_all = time_of(image_graph(model, sightings, *sigma, Some(joints), &tip));
        let joints_from_pose = time(|| {
            black_box(inverse.solve(black_box(&tip), start));
        });
        inference.joints(&*sightings, &Prior::none())?;
        let joints_from_image = time(|| {
            // It has just succeeded.
            let _ = black_box(inference.joints(black_box(&*sightings), &Prior::none()));
        });
        Ok([
            kinematics,
            camera_feature,
            end_to_end,
            loss_pixels,
            loss_pose,
            by_all,
            by_kinematics,
            by_camera_feature,
            pose,
            joints_from_pose,
            joints_from_image,
        ])
    }
}

/// The chain's parameters and base against a pose of the tip.
fn kinematics_graph(model: &Model, joints: &[f64], tip: &Pose) -> Graph {
    let mut graph = Graph::new();
    let derived = derive_tip(&mut graph, model, joints);
    let tool = graph.held(Pose::identity());
    graph.factor(PoseReading { reading: *tip }, (derived, tool));
    graph
}

fn derive_tip(graph: &mut Graph, model: &Model, joints: &[f64]) -> handeye_solvers::Key<Pose> {
    let base = graph.free(model.base);
    let parameters = graph.free(DynamicVector::from_column_slice(&model.parameters));
    let joints = graph.held(DynamicVector::from_column_slice(joints));
    let kinematics = ForwardKinematics { chain: Arc::new(model.chain.clone()), upto: model.chain.len() };
    graph.derive(kinematics, (base, parameters, joints))
}

/// Cameras and features against the pixels, with the chain where joints are given, or else with the pose of the tip.
fn image_graph(model: &Model, sightings: &[Sighting], sigma: f64, joints: Option<&[f64]>, tip: &Pose) -> Graph {
    let mut graph = Graph::new();
    let tip = match joints {
        Some(joints) => derive_tip(&mut graph, model, joints),
        None => graph.free(*tip),
    };
    let world = graph.held(Pose::identity());
    let mut cameras = Vec::new();
    for camera in &model.cameras {
        let keys = (graph.free(camera.pose), graph.free(Intrinsics::from(camera.intrinsics)));
        graph.hold_coordinates(keys.1, &(4..12).collect::<Vec<_>>());
        cameras.push(keys);
    }
    let features: Vec<_> = model.features.iter().map(|feature| graph.free(feature.xyz)).collect();
    for sighting in sightings {
        let (pose, intrinsics) = cameras[sighting.camera];
        let factor = Reprojection { pixel: sighting.pixel, model: model.cameras[sighting.camera].model };
        graph.factor(factor, (tip, features[sighting.feature], world, pose, intrinsics)).sigma(sigma);
    }
    graph
}

/// CPU time of one linearisation [ms].
fn time_of(graph: Graph) -> f64 {
    let mut workspace = Workspace::new(&graph);
    time(|| {
        black_box(workspace.linearize_at(black_box(&graph)));
    })
}

/// CPU time of one run [ms], the mean over as many as take a millisecond.
fn time(mut query: impl FnMut()) -> f64 {
    query();
    let start = ThreadTime::now();
    let mut runs = 0_u32;
    loop {
        let batch = 1 + runs / 2;
        (0..batch).for_each(|_| query());
        runs += batch;
        let elapsed = 1e3 * start.elapsed().as_secs_f64();
        if elapsed > ENOUGH {
            return elapsed / f64::from(runs);
        }
    }
}
