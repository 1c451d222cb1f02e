//! Every limit at once in 1,000 random closed loops with noise: what a limit promises, the true arm keeps.
use crate::servo::{look, moved, positions};
use handeye::chain::JointKind;
use handeye::rig::Rig;
use handeye::servo::limits::{Guide, HalfSpace, InImage, LinkDistance, PixelSpeed, TipBox, TipSpeed, VirtualFixture};
use handeye::servo::tasks::ImagePoints;
use handeye::servo::{Arm, Configuration, Constraint, Goal, Limit, Step, Stepper};
use handeye::simulate::random_rig;
use handeye_solvers::Pose;
use nalgebra::{Matrix3, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

const DT: f64 = 0.02;
const STEPS: usize = 60;
/// Standard deviations of a joint reading [rad or m] and of a pixel coordinate.
const READING: f64 = 2e-4;
const PIXELS: f64 = 0.3;
/// Of every commanded motion, the arm makes at least this share.
const EXECUTED: f64 = 0.9;
const SPEED: f64 = 1.5;
const ACCELERATION: f64 = 20.0;

/// An arm on its way with every limit.
struct World {
    rig: Rig,
    arm: Arm,
    left: InImage,
    right: InImage,
    pixel_speed: PixelSpeed,
    tip_speed: TipSpeed,
    tip_box: TipBox,
    wall: HalfSpace,
    apart: LinkDistance,
    guide: Option<VirtualFixture>,
    /// Farthest that the tip can be from an axis [m].
    reach: f64,
}

impl World {
    /// Between two positions of the joints, around which the limits are laid; `outside` puts the start beyond some of them.
    fn new(seed: u64, rig: Rig, from: &[f64], to: &[f64], outside: bool) -> World {
        let arm = Arm::new(&rig).unwrap();
        let configured = |joints: &[f64]| {
            let mut at = Configuration::default();
            arm.configure(joints, &mut at);
            at
        };
        let (start, end) = (configured(from), configured(to));
        let (p, q) = (start.posture.tip().translation, end.posture.tip().translation);
        let features: Vec<usize> = (0..rig.features.len()).collect();
        let image = |camera| InImage { camera, features: features.clone(), margin: 5.0, strength: 30.0 };
        let shift = if outside { 0.05 } else { 0.0 };
        let (low, high) = (p.inf(&q), p.sup(&q));
        let around = Vector3::repeat(0.08);
        let along = (q - p).try_normalize(1e-6).unwrap_or_else(Vector3::x);
        let across = along.cross(&Vector3::ith(along.iamin(), 1.0)).normalize();
        let between = |at: &Configuration| (at.posture.tip().translation - at.posture.links[1].translation).norm();
        let guide = match seed % 5 {
            1 => Some(Guide::Plane(p + across * shift, across)),
            3 => Some(Guide::Line(p + across * shift, along)),
            _ => None,
        };
        let segments = start.posture.links.windows(2).map(|pair| (pair[1].translation - pair[0].translation).norm());
        World {
            reach: segments.sum::<f64>() + 0.2,
            left: image(0),
            right: image(1),
            pixel_speed: PixelSpeed { camera: 0, features: features.clone(), speed: 400.0, strength: 1.0 },
            tip_speed: TipSpeed { speed: 0.5, strength: 5.0 },
            tip_box: TipBox {
                frame: Pose { rotation: Matrix3::identity(), translation: Vector3::x() * shift },
                low: low - around,
                high: high + around,
                strength: 20.0,
            },
            wall: HalfSpace { normal: along, offset: along.dot(&q) + 0.02, strength: 50.0 },
            apart: LinkDistance {
                links: [arm.joints(), 1],
                points: [Vector3::zeros(); 2],
                distance: between(&start).min(between(&end)) - 0.02 + shift,
                strength: 40.0,
            },
            guide: guide.map(|guide| VirtualFixture { guide, tolerance: 0.03, strength: 10.0 }),
            rig,
            arm,
        }
    }

    fn limits(&self) -> Vec<&dyn Limit> {
        let mut limits: Vec<&dyn Limit> =
            vec![&self.left, &self.right, &self.pixel_speed, &self.tip_speed, &self.tip_box, &self.wall, &self.apart];
        limits.extend(self.guide.as_ref().map(|guide| guide as &dyn Limit));
        limits
    }

    /// How far inside a limit that says where something may be: the least over what it limits [px or m]; 0 for limits of speeds.
    fn room(&self, limit: usize, at: &Configuration) -> f64 {
        let tip = at.posture.tip().translation;
        match limit {
            0 | 1 => self.in_image(limit, at) - 5.0,
            4 => {
                let inside = tip - self.tip_box.frame.translation;
                (inside - self.tip_box.low).min().min((self.tip_box.high - inside).min())
            }
            5 => self.wall.offset - self.wall.normal.dot(&tip),
            6 => (tip - at.posture.links[1].translation).norm() - self.apart.distance,
            7 => {
                let off = match self.guide.map(|fixture| fixture.guide) {
                    Some(Guide::Plane(point, normal)) => normal.dot(&(tip - point)).abs(),
                    Some(Guide::Line(point, along)) => along.cross(&(tip - point)).norm(),
                    None => 0.0,
                };
                0.03 - off
            }
            _ => 0.0,
        }
    }

    /// How far the nearest feature is from the border of an image [px].
    fn in_image(&self, camera: usize, at: &Configuration) -> f64 {
        let features = (0..self.rig.features.len()).map(|feature| self.arm.pixel(at, camera, feature).unwrap());
        let border = |[u, v]: [f64; 2]| (u + 0.5).min(639.5 - u).min(v + 0.5).min(479.5 - v);
        features.map(border).fold(f64::INFINITY, f64::min)
    }

    /// What is left of a limit after a motion [px or m], as its row leaves it: half of the room that was there, or all that a speed
    /// allows.
    fn left_over(&self, limit: usize, before: &Configuration, after: &Configuration) -> f64 {
        match limit {
            2 => {
                let moves = (0..self.rig.features.len()).flat_map(|feature| {
                    let [a, b] = [before, after].map(|at| self.arm.pixel(at, 0, feature).unwrap());
                    [(a[0] - b[0]).abs(), (a[1] - b[1]).abs()]
                });
                self.pixel_speed.speed * DT - moves.fold(0.0, f64::max)
            }
            3 => {
                let moved = before.posture.tip().translation - after.posture.tip().translation;
                self.tip_speed.speed * DT - moved.norm()
            }
            _ => self.room(limit, after) - 0.5 * self.room(limit, before),
        }
    }

    /// What a limit may be passed by [px or m], where the joints together move by `motion` and are known to `error` [rad]. A point of
    /// the arm moves by the distance from an axis at most, and that is also its second derivative by any two joints; a pixel follows.
    fn tolerance(&self, limit: usize, at: &Configuration, motion: f64, error: f64) -> f64 {
        let (slope, curvature) = if limit < 3 {
            let camera = if limit == 1 { 1 } else { 0 };
            let tip = at.posture.tip();
            let points = self.rig.features.iter().map(|feature| tip.transform(&feature.xyz.unwrap().into()));
            let nearest =
                points.map(|point| (point - at.cameras[camera].translation).norm()).fold(f64::INFINITY, f64::min);
            let share = self.reach / nearest;
            // u = f X / Z with X at most 0.6 Z, the image's half width.
            let slope = 1.6 * 600.0 * share;
            (slope, slope * (1.0 + 2.0 * share))
        } else {
            (self.reach, self.reach)
        };
        0.5 * curvature * motion * motion + slope * error + 1e-9
    }
}

/// The arm of a loop: the four kinds of the issue in turn.
fn random_arm(seed: u64) -> Rig {
    let kind = seed as usize % 4;
    let mut rig = random_rig([4, 6, 7, 5][kind], 2, 6, seed);
    if kind == 3 {
        let slider = &mut rig.robot.joints[2];
        slider.kind = JointKind::Prismatic;
        (slider.limits.lower, slider.limits.upper) = (Some(-0.1), Some(0.1));
    }
    for joint in &mut rig.robot.joints {
        joint.limits.velocity = Some(SPEED);
        joint.limits.acceleration = Some(ACCELERATION);
    }
    rig
}

/// Joints are hard: their range, from where they are believed to be, and their speed to the last bit; their acceleration but for what
/// the range asks for.
fn joints_hold(seed: u64, arm: &Arm, at: &Configuration, step: &Step) {
    for (i, (motion, limits)) in step.motion.iter().zip(arm.limits()).enumerate() {
        let (before, after) = (at.joints[i], at.joints[i] + motion);
        let (lower, upper) = (limits.lower.unwrap(), limits.upper.unwrap());
        let (least, most) = (lower.min(before), upper.max(before));
        assert!(motion.is_finite() && least - 1e-12 <= after && after <= most + 1e-12, "seed {seed}: joint {i}");
        assert!(motion.abs() <= SPEED * DT + 1e-12, "seed {seed}: joint {i} too fast");
        let change = (motion / DT - at.velocity[i]).abs();
        // Where readings that scatter leave less room to stop than there was, the range comes first.
        let scatter = 12.0 * READING / DT;
        let outside = before < lower || before > upper;
        assert!(
            outside || change <= ACCELERATION * DT + scatter,
            "seed {seed}: joint {i} changes its speed by {change}"
        );
    }
}

#[test]
fn every_limit_holds_in_every_step_of_random_loops_with_noise_and_starts_outside() {
    let (mut in_view, mut loops) = (0, 0);
    // Of every limit: steps in which it need not give way, and all.
    let mut kept = [[0; 2]; 8];
    for seed in 0..1000 {
        let rig = random_arm(seed);
        let places = positions(&rig, 2, seed);
        let starts_outside = [seed % 5 == 0, seed % 10 == 1];
        let world = World::new(seed, rig, &places[0], &places[1], starts_outside[1]);
        let (arm, limits) = (&world.arm, world.limits());
        let goal = look(arm, &world.rig, &places[1]);
        let mut joints = places[0].clone();
        if starts_outside[0] {
            joints[1] = arm.limits()[1].upper.unwrap() + 0.3;
        }
        let (mut truth, mut believed, mut stepper) =
            (Configuration::default(), Configuration::default(), Stepper::default());
        let random = &mut ChaCha8Rng::seed_from_u64(seed);
        let [reading, pixel] = [READING, PIXELS].map(|sd| Normal::new(0.0, sd).unwrap());
        arm.configure(&joints, &mut truth);
        let mut stayed = true;
        for index in 0..STEPS {
            let read: Vec<f64> = joints.iter().map(|joint| joint + reading.sample(random)).collect();
            let mut seen = look(arm, &world.rig, &joints);
            seen.iter_mut()
                .for_each(|seen| seen.pixel = seen.pixel.map(|coordinate| coordinate + pixel.sample(random)));
            arm.configure(&read, &mut believed);
            let task = ImagePoints { targets: goal.clone(), seen, sd: 1.0 };
            let step = stepper.step(arm, &believed, &[Goal::new(&task)], &limits, DT);
            assert!(!step.failed, "seed {seed}, step {index}");
            joints_hold(seed, arm, &believed, step);
            let gave_way = |limit: usize| {
                let slack = step.active.iter().filter(|active| active.slack > 0.0);
                slack
                    .into_iter()
                    .any(|active| matches!(active.constraint, Constraint::Limit { limit: of, .. } if of == limit))
            };
            let any = step.active.iter().any(|active| active.slack > 0.0);
            assert_eq!(any, !step.conflict.is_empty(), "seed {seed}, step {index}: {step:?}");
            let (mut predicted, mut after) = (Configuration::default(), Configuration::default());
            let mut aim = read.clone();
            moved(&mut aim, &step.motion);
            arm.configure(&aim, &mut predicted);
            let errors: f64 = joints.iter().zip(&read).map(|(joint, read)| (joint - read).abs()).sum();
            let mut length = 0.0;
            for (joint, motion) in joints.iter_mut().zip(&step.motion) {
                *joint += motion * random.random_range(EXECUTED..1.0);
                length += motion.abs();
            }
            arm.configure(&joints, &mut after);
            for (limit, kept) in kept.iter_mut().enumerate().take(limits.len()) {
                let holds = !gave_way(limit);
                kept[0] += usize::from(holds);
                kept[1] += 1;
                let planned = world.left_over(limit, &believed, &predicted);
                let allowed = world.tolerance(limit, &believed, length, 0.0);
                assert!(!holds || planned >= -allowed, "seed {seed}, step {index}, limit {limit}: {planned} {allowed}");
                let left = world.left_over(limit, &truth, &after);
                let allowed = world.tolerance(limit, &believed, length, (1.0 - EXECUTED) * length + 2.0 * errors);
                assert!(!holds || left >= -allowed, "seed {seed}, step {index}, limit {limit}: {left} {allowed}");
            }
            stayed &= (0..2).all(|camera| world.in_image(camera, &after) >= 0.0);
            believed.velocity = step.motion.iter().map(|motion| motion / DT).collect();
            truth = after;
        }
        if !starts_outside.contains(&true) {
            loops += 1;
            in_view += usize::from(stayed);
        }
    }
    assert!(kept.iter().all(|[held, all]| 2 * held > *all), "limits held in {kept:?} steps");
    assert_eq!((in_view, loops), (700, 700), "features stayed in the images of {in_view} of {loops} loops");
}
