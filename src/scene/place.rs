//! The world of a scene: its rig, and what its task puts there.
use super::Scene;
use crate::Error;
use crate::recording::{Detection, Recording};
use crate::rig::{Camera, Feature, Model, Parent, Rig};
use crate::servo::image_tasks::{Found, ImageTask, Place};
use crate::simulate::world::{Object, World};
use handeye_solvers::Pose;

/// A world, and how its task is solved.
pub(super) struct Setting {
    pub world: World,
    /// Of the task, or of the rig that is known: by whose names measurements are told.
    pub names: Rig,
    /// The object that carries the target's features.
    target: Option<usize>,
    model: Model,
    /// Which features of the world's recordings are on the hand.
    on_hand: Vec<bool>,
}

impl Setting {
    /// Errors: [`Error::Unusable`] where rig and task do not fit; those of [`World::new`].
    pub fn new(scene: &Scene, truth: &Rig, known: &Rig) -> Result<Setting, Error> {
        let (placed, carried) = match &scene.task {
            Some(task) => with_task(truth, task)?,
            None => (truth.clone(), Vec::new()),
        };
        let mut options = scene.world.clone();
        for fault in &scene.faults {
            options.faults.push(fault.of(&placed)?);
        }
        for slip in &scene.slips {
            options.slips.push(slip.of(&placed)?);
        }
        for coupling in &scene.couplings {
            options.execution.couplings.push(coupling.of(&placed)?);
        }
        let model = Model::new(&placed)?;
        let mut world = World::new(&placed, &scene.start, options)?;
        let target = (!carried.is_empty()).then(|| {
            let place = scene.target.motion(0.0) * model.tip(&scene.target.at(0.0));
            world.put(Object::new(carried.clone(), place))
        });
        let names = scene.task.as_ref().map_or_else(|| known.clone(), names);
        let is_on_hand = |name: &String| {
            let place = scene.task.as_ref().and_then(|task| Some(&task.features()[task.feature(name)?].place));
            matches!(place, Some(Place::Hand(_)))
        };
        let on_hand = world.header().features.iter().map(is_on_hand).collect();
        Ok(Setting { world, names, target, model, on_hand })
    }

    /// Puts the target of a task where it is now, and says where what is on the hand shall be seen, and how far off it is [m].
    pub fn aim(&mut self, scene: &Scene) -> (Vec<Detection>, f64) {
        let time = self.world.time();
        let joints = scene.target.at(time);
        if scene.task.is_none() {
            return (self.world.exact(&joints), self.world.distance(&joints));
        }
        let tip: Pose = scene.target.motion(time) * self.model.tip(&joints);
        if let Some(target) = self.target {
            self.world.carry(target, tip);
        }
        let mut goal = self.world.exact_with_tip(&tip);
        goal.retain(|seen| self.on_hand[seen.feature as usize]);
        (goal, self.world.distance_from_tip(&tip))
    }

    /// Names of what is seen.
    pub fn header(&self) -> &Recording {
        self.world.header()
    }
}

/// Cameras and features of a task, by name and in its order.
fn names(task: &ImageTask) -> Rig {
    let camera = |name: &String| Camera { name: name.clone(), ..Camera::default() };
    let feature = |name: &String| Feature { name: name.clone(), parent: Parent::World, xyz: None };
    Rig {
        cameras: task.cameras().iter().map(camera).collect(),
        features: task.features().iter().map(|one| feature(&one.name)).collect(),
        ..Rig::default()
    }
}

/// The rig with the features of a task in place of its own, and which of them the target carries.
fn with_task(truth: &Rig, task: &ImageTask) -> Result<(Rig, Vec<usize>), Error> {
    let (mut features, mut carried) = (Vec::new(), Vec::new());
    for (feature, found) in task.features().iter().zip(task.in_rig(truth)?.features) {
        match found {
            Found::Image => {}
            Found::Task(xyz) => {
                carried.extend(matches!(feature.place, Place::Target(_)).then_some(features.len()));
                features.push(Feature { name: feature.name.clone(), parent: Parent::Tip, xyz: Some(xyz.into()) });
            }
            Found::Rig(index) => features.push(truth.features[index].clone()),
        }
    }
    Ok((Rig { features, ..truth.clone() }, carried))
}
