//! Pick alignment: two cameras on the hand bring its gripper, which is fixed in their images, to an object.
use super::scenes::{UR5_TARGET, against_command, camera, ends, go, scene, view};
use crate::Error;
use crate::experiments::setting::trials;
use crate::experiments::{Experiment, Options, Outcome, Row};
use crate::recording::Command;
use crate::rig::{self, Model, Parent, Rig, catalog};
use crate::scene::Run;
use crate::servo::Takes;
use crate::servo::image_tasks::{Feature, ImageTask, Kind, Part, Place, PointToPoint, Trackers};
use crate::simulate::world::{Execution, Tracker, World, WorldOptions};
use handeye_solvers::Pose;
use nalgebra::Vector3;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

pub(in crate::experiments) const PICK: Experiment = Experiment {
    name: "pick-alignment",
    about: "a gripper that is fixed in the images of cameras on the hand is brought to an object without a rig",
    source: "Ramirez 2016, sections 4.4.4 and 5.1.1, in words",
    trials: 20,
    is_timed: false,
    is_seeded: true,
    run,
};

/// How far the hand begins from where the object is in the gripper, along each axis [m].
const AWAY: f64 = 0.06;

/// The gripper, the cameras, and what these look at, in the tip's frame [m].
const GRIPPER: Vector3<f64> = Vector3::new(0.0, 0.0, 0.2);
const CAMERAS: [Vector3<f64>; 2] = [Vector3::new(-0.07, -0.09, -0.1), Vector3::new(0.07, -0.09, -0.1)];

/// Of the trackers [px], by series, and how the robot errs after every motion [m].
const NOISE: [(&str, f64); 3] = [("0.1 px", 0.1), ("0.5 px", 0.5), ("2 px", 2.0)];
const EXECUTION: f64 = 0.0003;

/// Off by less than this, the gripper closes on the object [m].
const CLOSES: f64 = 0.003;

/// Commands that are shown, and every how many.
const SHOWN: (usize, usize) = (30, 2);

fn run(options: &Options) -> Result<Outcome, Error> {
    let results = trials(options, trial)?;
    let (mut rows, mut shares, mut notes) = (Vec::new(), Vec::new(), Vec::new());
    for (index, (series, _)) in NOISE.iter().enumerate() {
        let runs: Vec<Run> = results.iter().map(|runs| runs[index].clone()).collect();
        rows.extend(against_command("image error [px]", series, &runs, SHOWN, |moment| moment.error_px));
        rows.extend(against_command("gripper from object [mm]", series, &runs, SHOWN, |moment| {
            Some(1e3 * moment.error_m)
        }));
        let closes = |run: &Run| run.moments.last().is_some_and(|moment| moment.error_m < CLOSES);
        let closes: Vec<Option<f64>> = runs.iter().map(|run| Some(f64::from(u8::from(closes(run))))).collect();
        shares.push(Row::new(format!("share within {} mm at the end, {series}", 1e3 * CLOSES), None, &closes));
        notes.push(format!("{series}: {}", ends(&runs)));
    }
    rows.extend(shares);
    notes.push(
        "published in words: precise enough to finalise the grasp of objects on a shelf, and of a straw that a depth camera does not see"
            .to_owned(),
    );
    Ok(Outcome {
        setting: format!(
            "UR5 that takes motions of its tip and errs by {} mm in each, 2 cameras on its hand, a point to a point; our defaults; a trial is a \
             start up to {} cm away along each axis",
            1e3 * EXECUTION,
            1e2 * AWAY
        ),
        measure: "root mean square of the rows [px], distance of the gripper from the object [mm], shares",
        abscissa: Some("commands, those of exploring included"),
        rows,
        notes,
    })
}

fn trial(seed: u64) -> Result<Vec<Run>, Error> {
    let arm = catalog::rig("ur5")?;
    let names = ["left", "right"];
    let mut cameras = Vec::new();
    for (name, from) in names.iter().zip(&CAMERAS) {
        let pose = view(from, &GRIPPER, &Vector3::y())?;
        cameras.push(camera(name, Parent::Tip, pose, 600.0, [640, 480]));
    }
    let rig = Rig { cameras, features: Vec::new(), ..arm };
    // As anybody sees who looks at the images: where the gripper is in them.
    let gripper = rig::Feature { name: "gripper".to_owned(), parent: Parent::Tip, xyz: Some(GRIPPER.into()) };
    let model = Model::new(&Rig { features: vec![gripper], ..rig.clone() })?;
    let links = model.links(&UR5_TARGET);
    let pixels: Vec<[f64; 2]> = (0..names.len()).map(|camera| model.pixel(camera, 0, &links)).collect();
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let away = Vector3::from_fn(|_, _| random.random_range(-AWAY..AWAY));
    let mut placed = World::new(&rig, &UR5_TARGET, WorldOptions::default())?;
    placed.execute(&Command::PoseDelta(Pose { translation: away, ..Pose::identity() }), 1.0)?;
    let start = placed.joints().to_vec();
    let mut runs = Vec::new();
    for (_, noise) in NOISE {
        let features = vec![
            Feature { name: "gripper".to_owned(), place: Place::Image(pixels.clone()) },
            Feature { name: "object".to_owned(), place: Place::Target(Some(GRIPPER)) },
        ];
        let part = Part { kind: Kind::PointToPoint(PointToPoint { point: 0, to: 1 }), cameras: vec![0, 1] };
        let trackers = Trackers { pixels: noise, ..Trackers::default() };
        let task = ImageTask::new(None, names.map(str::to_owned).to_vec(), features, vec![part], trackers)?;
        let mut scene = scene(rig.clone(), task, start.clone(), UR5_TARGET.to_vec(), seed);
        scene.takes = Takes::PoseDelta;
        scene.world.tracker = Tracker::Gaussian(noise);
        let mut execution = Execution::default();
        execution.pose.xyz = EXECUTION;
        scene.world.execution = execution;
        scene.settings.tolerance_px = 1.5 * noise;
        scene.settings.window = 20;
        runs.push(go(&scene)?);
    }
    Ok(runs)
}
