//! What servoing without a rig promises: the same step and limits, from a Jacobian that is estimated on the way.
use handeye::experiments::camera_rotation::{Run, Scene, Tracker, View, World, carried_around, servo};
use handeye::experiments::{Options, Outcome, find};
use handeye::rig::Limits;
use handeye::servo::uncalibrated::{Estimate, Exploration, Phase, Quantity, Row, Settings, Stop, Uncalibrated, Update};
use handeye::servo::{Bound, Constraint, JointBounds, LimitRows, MotionSolver, TaskRows};
use nalgebra::{DMatrix, Vector3, dmatrix};
use std::f64::consts::TAU;

const TRACKERS: [Tracker; 3] = [Tracker::Perfect, Tracker::Rounded, Tracker::Gaussian(0.2)];

fn mean(figures: impl IntoIterator<Item = f64>) -> f64 {
    let all: Vec<f64> = figures.into_iter().collect();
    all.iter().sum::<f64>() / all.len() as f64
}

/// No limits but the quantities' own.
fn none(n: usize) -> LimitRows {
    let mut limits = LimitRows::default();
    limits.clear(n);
    limits
}

/// The largest relative difference from the reconstruction in a table's rows of that kind, beyond half its last printed digit.
fn off(outcome: &Outcome, kind: &str, digit: f64, keep: impl Fn(&str) -> bool) -> f64 {
    let rows = outcome.rows.iter().filter(|row| row.label.ends_with(kind) && keep(&row.label));
    let one = |row: &handeye::experiments::Row| {
        let (ours, theirs) = (row.mean().unwrap(), row.reconstructed.unwrap());
        ((ours - theirs).abs() - 0.5 * digit).max(0.0) / theirs.max(f64::MIN_POSITIVE)
    };
    rows.map(one).fold(0.0, f64::max)
}

#[test]
fn rows_that_come_from_no_rig_are_met_inside_their_bounds_and_limits() {
    // Two quantities, u = x + y and v = x - y; wanted are u = 3 before x = 5, with x at most 1.2 per step and y - x at most 0.3.
    let (mut bounds, mut limits) = (JointBounds::default(), LimitRows::default());
    let slow = Limits { velocity: Some(12.0), ..Limits::default() };
    bounds.update(&[slow, Limits::default()], &[0.0, 0.0], &[0.0, 0.0], 0.1);
    limits.clear(2);
    limits.begin(4);
    limits.push([-1.0, 1.0], 0.3, 10.0);
    let mut tasks = [TaskRows::default(), TaskRows::default()];
    tasks.iter_mut().for_each(|rows| rows.clear(2));
    tasks[0].push([1.0, 1.0], 3.0, 0.1);
    tasks[1].push([1.0, 0.0], 5.0, 1.0);
    let mut solver = MotionSolver::new(0.0);
    let step = solver.solve(&tasks, &limits, &bounds);
    // The limit keeps y at x + 0.3 or less, so that u is at most 2 x + 0.3 = 2.7.
    assert!((step.motion[0] - 1.2).abs() < 1e-6 && (step.motion[1] - 1.5).abs() < 1e-6, "{step:?}");
    let held: Vec<Constraint> = step.active.iter().map(|active| active.constraint).collect();
    assert!(held.contains(&Constraint::Joint { joint: 0, bound: Bound::Velocity, upper: true }), "{held:?}");
    assert!(held.contains(&Constraint::Limit { limit: 4, row: 0 }), "{held:?}");
    // Without tasks, what moves too fast to stop is still braked: from 10 at 1 m from its end, by 30 per second squared.
    let ends = Limits { upper: Some(1.0), acceleration: Some(30.0), ..Limits::default() };
    bounds.update(&[ends], &[0.0], &[10.0], 0.1);
    limits.clear(1);
    let step = solver.solve(&[], &limits, &bounds);
    assert!(step.motion[0] > 0.4 && !step.failed, "{step:?}");
    // What is not a number moves nothing.
    tasks[0].push([f64::NAN, 1.0], 1.0, 1.0);
    bounds.update(&[Limits::default(); 2], &[0.0; 2], &[0.0; 2], 0.1);
    limits.clear(2);
    let step = solver.solve(&tasks, &limits, &bounds);
    assert!(step.failed && step.motion == [0.0, 0.0], "{step:?}");
}

#[test]
fn the_tables_of_the_thesis_come_out_as_an_independent_reconstruction_has_them() {
    let run = |name: &str| find(name).unwrap().run(&Options { trials: 360, seed: 1 }).unwrap();
    let diverged = |outcome: &Outcome| {
        let rows = outcome.rows.iter().filter(|row| row.label.ends_with("diverged"));
        rows.map(|row| (row.mean().unwrap() - row.reconstructed.unwrap()).abs()).fold(0.0, f64::max)
    };
    let all = |_: &str| true;
    for name in ["table5.1", "table5.2"] {
        let outcome = run(name);
        assert_eq!(outcome.rows.len(), 80);
        let figures = [("image error", 1e-3), ("3D error", 1e-5), ("steps to 10 px", 1e-2)];
        for (kind, digit) in figures {
            let off = off(&outcome, kind, digit, all);
            assert!(off < 0.01, "{name}: {kind} is off by {off:.3}");
        }
        assert!(diverged(&outcome) <= 1.0, "{name}");
    }
    // Noise is drawn anew. At a gain of 1, where a few places that nearly diverge make the means, five rows are taken together.
    let noisy = run("table5.3");
    for (kind, digit) in [("image error", 1e-3), ("3D error", 1e-5), ("steps to 10 px", 1e-2)] {
        let off = off(&noisy, kind, digit, |label| !label.contains("gain 1,"));
        assert!(off < 0.08, "{kind} is off by {off:.3}");
        let rows = || noisy.rows.iter().filter(move |row| row.label.contains("gain 1,") && row.label.ends_with(kind));
        let [ours, theirs] =
            [mean(rows().map(|row| row.mean().unwrap())), mean(rows().map(|row| row.reconstructed.unwrap()))];
        assert!((ours / theirs - 1.0).abs() < 0.08, "{kind} at a gain of 1: {ours}, reconstructed {theirs}");
    }
    // Counts of 360 with a share of a tenth have a standard deviation of 6.
    assert!(diverged(&noisy) <= 18.0);
}

#[test]
fn the_first_trial_around_the_target_is_the_reconstructed_scene_whatever_the_seed_and_the_others_are_drawn() {
    for name in ["figure5.9", "figure5.10"] {
        let run = |trials: usize, seed: u64| find(name).unwrap().run(&Options { trials, seed }).unwrap();
        // Perfect trackers: nothing else is drawn.
        let first = run(1, 1);
        assert_eq!(first.rows, run(1, 7).rows, "{name}");
        let [one, other] = [run(2, 1), run(2, 7)];
        assert_ne!(one.rows, other.rows, "{name}");
        let values = |outcome: &Outcome| outcome.rows.iter().find(|row| row.values.len() == 2).unwrap().values.clone();
        assert_eq!(values(&one)[0], values(&other)[0], "{name}");
    }
}

#[test]
fn no_place_of_the_cameras_diverges_and_all_arrive_sooner_than_with_a_jacobian_that_is_kept() {
    for tracker in TRACKERS {
        for (size, gain) in [(2.0_f64, 1.0), (6.0, 0.25), (6.0, 0.5), (6.0, 1.0), (10.0, 0.75)] {
            let around = |settings: &Settings| carried_around(&Scene::RECONSTRUCTED, tracker, settings, 90, 1).unwrap();
            let explored = Exploration::fixed(size.to_radians());
            let ours = around(&Settings { gain, exploration: explored, ..Settings::default() });
            let plain = around(&Settings::plain(gain, size.to_radians()));
            let case = format!("{tracker:?}, {size} degrees, gain {gain}");
            assert!(ours.iter().all(|run| run.stop.is_none() && run.steps(1).is_some()), "{case}");
            let arrived = || (0..90).filter(|i| !plain[*i].diverged() && plain[*i].steps(1).is_some());
            let iterations = |runs: &[Run]| mean(arrived().map(|i| runs[i].steps(1).unwrap() as f64));
            let left = |runs: &[Run]| mean(arrived().map(|i| *runs[i].errors.last().unwrap()));
            assert!(iterations(&ours) < iterations(&plain), "{case}: {} iterations", iterations(&ours));
            assert!(left(&ours) < left(&plain), "{case}: {} px", left(&ours));
            let all = mean(ours.iter().map(|run| run.steps(1).unwrap() as f64));
            assert!(gain < 1.0 || all <= 7.0, "{case}: {all} iterations in the mean");
        }
    }
}

/// Means over the places where both arrive, of the defaults and of a Jacobian that is kept.
fn beside_kept(scene: &Scene, tracker: Tracker, size_deg: f64, gain: f64, figure: impl Fn(&Run) -> f64) -> [f64; 2] {
    let around = |settings: &Settings| carried_around(scene, tracker, settings, 36, 1).unwrap();
    let explored = Exploration::fixed(size_deg.to_radians());
    let ours = around(&Settings { gain, exploration: explored, ..Settings::default() });
    let kept = around(&Settings::plain(gain, size_deg.to_radians()));
    assert!(ours.iter().all(|run| !run.diverged()));
    let arrive = |run: &Run| !run.diverged() && run.steps(1).is_some();
    let both: Vec<usize> = (0..36).filter(|i| arrive(&kept[*i]) && arrive(&ours[*i])).collect();
    [&ours, &kept].map(|runs| mean(both.iter().map(|i| figure(&runs[*i]))))
}

#[test]
fn a_large_motion_does_not_spoil_what_is_known_of_directions_that_hardly_show() {
    let scene = Scene::drawn(8).unwrap();
    for (tracker, gain) in [(Tracker::Perfect, 0.75), (Tracker::Gaussian(0.2), 1.0)] {
        let [ours, kept] = beside_kept(&scene, tracker, 10.0, gain, |run| run.steps(1).unwrap() as f64);
        assert!(ours < kept, "{tracker:?}: {ours} iterations, {kept} with the Jacobian kept");
    }
}

#[test]
fn errors_that_no_known_motion_removes_are_removed_by_one_that_is_tried() {
    let scene = Scene::drawn(16).unwrap();
    let space = beside_kept(&scene, Tracker::Gaussian(0.2), 6.0, 0.25, |run| run.error_3d);
    let image = beside_kept(&scene, Tracker::Gaussian(0.2), 6.0, 0.25, |run| *run.errors.last().unwrap());
    assert!(space[0] < 0.8 * space[1], "{space:?} m");
    assert!(image[0] < 1.02 * image[1], "{image:?} px");
}

/// Where things stand still, whole pixels are the same again and again.
#[test]
fn whole_pixels_tell_more_where_places_around_are_visited() {
    let left = |seed: u64, tracker: Tracker, dither: f64| {
        let settings = Settings { dither, ..Settings::default() };
        let runs = carried_around(&Scene::drawn(seed).unwrap(), tracker, &settings, 36, 1).unwrap();
        assert!(runs.iter().all(|run| run.stop.is_none()), "scene {seed}");
        // Some end in another solution than the one that is meant.
        let mut ends: Vec<f64> = runs.iter().map(|run| run.error_3d).collect();
        ends.sort_by(f64::total_cmp);
        0.5 * (ends[17] + ends[18])
    };
    let ratio = |seed: u64| left(seed, Tracker::Rounded, 1.2) / left(seed, Tracker::Rounded, 0.0);
    let ratios: Vec<f64> = (0..8).map(ratio).collect();
    assert!(mean(ratios.iter().copied()) < 0.92 && ratios.iter().all(|ratio| *ratio < 1.05), "{ratios:?}");
    // What is no whole pixel is averaged without it.
    let [with, without] = [1.2, 0.0].map(|dither| left(0, Tracker::Gaussian(0.2), dither));
    assert_eq!(with, without);
}

/// After 0.5 rad slopes along what hardly shows have changed by 8 standard deviations, and the errors are said to fall by 400 px.
#[test]
fn what_a_wrong_jacobian_promises_is_not_taken_for_sure() {
    let settings = Settings { gain: 1.0, exploration: Exploration::fixed(2_f64.to_radians()), ..Settings::default() };
    let runs = carried_around(&Scene::drawn(4).unwrap(), Tracker::Rounded, &settings, 360, 1).unwrap();
    let diverged: Vec<usize> = (0..360).filter(|place| runs[*place].diverged()).collect();
    assert!(diverged.is_empty(), "{diverged:?}");
}

#[test]
fn two_views_at_about_a_right_angle_serve_best_and_one_point_of_view_is_refused_before_anything_moves() {
    let of = |first: f64, apart_deg: f64| {
        let views = [first, first + apart_deg.to_radians()].map(|angle| View { angle, beside: 0.0, distance: 1.0 });
        let mut world = World::new(&Scene::RECONSTRUCTED, &views, Tracker::Perfect, 1).unwrap();
        (servo(&mut world, &Settings::plain(0.5, 0.1)).unwrap(), world.joints().to_vec())
    };
    // The condition number, and what 50 iterations leave; the thesis has both smallest where cameras are orthogonal.
    let around = |apart_deg: f64| -> [f64; 2] {
        let runs: Vec<Run> = (0..24).map(|first| of(f64::from(first) * TAU / 24.0, apart_deg).0).collect();
        [mean(runs.iter().map(|run| run.condition.unwrap())), mean(runs.iter().map(|run| *run.errors.last().unwrap()))]
    };
    let figures: Vec<[f64; 2]> = (1..12).map(|index| around(15.0 * f64::from(index))).collect();
    let best = |k: usize| 15 * (1 + (0..11).min_by(|a, b| figures[*a][k].total_cmp(&figures[*b][k])).unwrap());
    assert!((75..=105).contains(&best(0)), "condition numbers and errors {figures:?}");
    assert!((75..=120).contains(&best(1)), "condition numbers and errors {figures:?}");
    for first in 0..24 {
        let (refused, joints) = of(f64::from(first) * TAU / 24.0, 0.0);
        assert!(
            matches!(&refused.stop, Some(Stop::Undetermined(why)) if why.contains("one point of view")),
            "{refused:?}"
        );
        assert_eq!(joints, Scene::RECONSTRUCTED.start);
    }
}

/// A linear world: errors are J (q - q*), whose quantities ignore motions below a dead band.
struct Linear {
    jacobian: [[f64; 2]; 3],
    target: [f64; 2],
    at: [f64; 2],
    dead_band: f64,
}

impl Linear {
    fn new(dead_band: f64) -> Self {
        let jacobian = [[500.0, 120.0], [-80.0, 300.0], [210.0, -90.0]];
        Linear { jacobian, target: [0.4, -0.3], at: [0.0, 0.0], dead_band }
    }

    fn errors(&self) -> Vec<f64> {
        let away = [self.at[0] - self.target[0], self.at[1] - self.target[1]];
        self.jacobian.iter().map(|row| row[0] * away[0] + row[1] * away[1]).collect()
    }

    fn carry_out(&mut self, motion: &[f64]) {
        for (at, motion) in self.at.iter_mut().zip(motion).filter(|(_, motion)| motion.abs() >= self.dead_band) {
            *at += motion;
        }
    }

    fn controller(&self, settings: Settings, limits: Limits) -> Uncalibrated {
        Uncalibrated::new(self.quantities(limits), vec![Row { sd: 0.1, camera: 0 }; 3], settings).unwrap()
    }

    fn quantities(&self, limits: Limits) -> Vec<Quantity> {
        ["x", "y"].map(|name| Quantity { name: name.to_owned(), limits, dead_band: self.dead_band }).to_vec()
    }
}

#[test]
fn a_dead_band_leaves_what_one_motion_inside_it_leaves_and_not_its_share_of_the_gain() {
    let largest = |world: &Linear| (0..2).map(|i| (world.at[i] - world.target[i]).abs()).fold(0.0, f64::max);
    let serve = |aware: bool| {
        let mut world = Linear::new(0.002);
        let settings = Settings { gain: 0.25, trust: None, update: Update::Keep, ..Settings::default() };
        let mut servo = Linear::new(if aware { 0.002 } else { 0.0 }).controller(settings, Limits::default());
        for _ in 0..100 {
            let at = world.at;
            let motion = servo.step(&at, &world.errors(), &none(2), 1.0).unwrap().motion.to_vec();
            world.carry_out(&motion);
        }
        largest(&world)
    };
    assert!(serve(true) <= 1.5 * 0.002, "{}", serve(true));
    assert!(serve(false) > 3.0 * 0.002, "{}", serve(false));
}

#[test]
fn nothing_moves_on_what_is_no_number_and_rows_that_are_lost_are_done_without() {
    let mut world = Linear::new(0.0);
    let mut servo = world.controller(Settings::default(), Limits::default());
    while servo.phase() == &Phase::Exploring {
        let motion = servo.step(&world.at, &world.errors(), &none(2), 1.0).unwrap().motion.to_vec();
        world.carry_out(&motion);
    }
    let command = servo.step(&[f64::NAN, 0.0], &world.errors(), &none(2), 1.0).unwrap();
    assert!(
        command.motion == [0.0, 0.0] && matches!(command.phase, Phase::Waiting(why) if why.contains("`x`")),
        "{command:?}"
    );
    // One row is not enough for two quantities; two are.
    let mut errors = world.errors();
    errors[1..].fill(f64::NAN);
    let command = servo.step(&world.at, &errors, &none(2), 1.0).unwrap();
    assert!(
        command.motion == [0.0, 0.0] && matches!(command.phase, Phase::Waiting(why) if why.contains("1 of 3")),
        "{command:?}"
    );
    for _ in 0..60 {
        let mut errors = world.errors();
        errors[0] = f64::NAN;
        let motion = servo.step(&world.at, &errors, &none(2), 1.0).unwrap().motion.to_vec();
        world.carry_out(&motion);
    }
    assert_eq!(servo.phase(), &Phase::Converged);
    assert!(world.errors().iter().all(|error| error.abs() < 0.5), "{:?}", world.errors());
}

#[test]
fn where_exploring_anew_shows_nothing_servoing_goes_on_with_what_was_known() {
    let mut world = Linear::new(0.0);
    let mut controller = world.controller(Settings::default(), Limits::default());
    // At right angles to both columns of the Jacobian: no motion removes it, and after a while the Jacobian is doubted for it.
    let [a, b] = [0, 1].map(|k| Vector3::from_fn(|row, _| world.jacobian[row][k]));
    let beside = 20.0 * a.cross(&b).normalize();
    let (mut has_servoed, mut explorations, mut frozen) = (false, 0, None);
    for _ in 0..200 {
        let errors: Vec<f64> = world.errors().iter().zip(beside.iter()).map(|(error, more)| error + more).collect();
        // The trackers freeze while it is explored anew.
        let seen = frozen.clone().unwrap_or(errors.clone());
        let command = controller.step(&world.at, &seen, &none(2), 1.0).unwrap();
        let (phase, motion) = (command.phase.clone(), command.motion.to_vec());
        assert!(!matches!(phase, Phase::Stopped(_)), "{phase:?}");
        let is_anew = has_servoed && phase == Phase::Exploring;
        explorations += usize::from(is_anew && frozen.is_none());
        frozen = is_anew.then(|| frozen.unwrap_or(errors));
        has_servoed |= phase != Phase::Exploring;
        world.carry_out(&motion);
    }
    assert!(explorations >= 1);
    let away = (world.at[0] - world.target[0]).hypot(world.at[1] - world.target[1]);
    assert!(away < 1e-3, "{away} from where the errors are least");
}

#[test]
fn exploring_anew_goes_no_farther_than_tells_what_is_seen_from_noise() {
    let mut world = Linear::new(0.0);
    let settings = Settings { exploration: Exploration::fixed(0.2), ..Settings::default() };
    let mut controller = world.controller(settings, Limits::default());
    let [a, b] = [0, 1].map(|k| Vector3::from_fn(|row, _| world.jacobian[row][k]));
    let beside = 20.0 * a.cross(&b).normalize();
    let (mut has_servoed, mut farthest) = (false, 0.0_f64);
    for _ in 0..60 {
        let errors: Vec<f64> = world.errors().iter().zip(beside.iter()).map(|(error, more)| error + more).collect();
        let command = controller.step(&world.at, &errors, &none(2), 1.0).unwrap();
        let (is_exploring, motion) = (command.phase == &Phase::Exploring, command.motion.to_vec());
        has_servoed |= !is_exploring;
        if has_servoed && is_exploring {
            farthest = farthest.max(motion[0].hypot(motion[1]));
        }
        world.carry_out(&motion);
    }
    // 30 times 0.1 px by 190 px per unit or more, and from one side to the other.
    assert!(farthest > 0.0 && farthest < 0.04, "{farthest}");
}

/// Visits of places where errors are whole pixels: how many steps they take, and how far from the target the last place and the step after it are.
fn dithered(held_at: f64) -> (usize, [f64; 2]) {
    let mut world = Linear::new(0.0);
    let rows = vec![Row { sd: 0.4, camera: 0 }; 3];
    let settings = Settings { gain: 0.25, ..Settings::default() };
    let mut servo = Uncalibrated::new(world.quantities(Limits::default()), rows, settings).unwrap();
    let (mut has_servoed, mut steps, mut ends) = (false, 0, [0.0; 2]);
    for _ in 0..300 {
        let errors: Vec<f64> = world.errors().iter().map(|error| error.round()).collect();
        let command = servo.step(&world.at, &errors, &none(2), 1.0).unwrap();
        let (is_exploring, motion) = (command.phase == &Phase::Exploring, command.motion.to_vec());
        let was_dithering = steps > 0;
        has_servoed |= !is_exploring;
        steps += usize::from(has_servoed && is_exploring);
        let away = |world: &Linear| (world.at[0] - world.target[0]).hypot(world.at[1] - world.target[1]);
        let before = away(&world);
        world.carry_out(&motion);
        world.at[0] = world.at[0].min(held_at);
        if was_dithering && !is_exploring {
            ends = [before, away(&world)];
            break;
        }
    }
    (steps, ends)
}

#[test]
fn places_around_are_visited_once_each_and_given_up_where_one_is_out_of_reach() {
    // Two directions: 4 places and their mirror images. From the last, one step takes away what is known to be left, whatever the gain.
    let (steps, [last, after]) = dithered(f64::INFINITY);
    assert_eq!(steps, 8);
    assert!(after < 0.5 * last, "{last} from the target, {after} a step later");
    let (steps, _) = dithered(0.4002);
    assert!((20..=30).contains(&steps), "{steps} steps");
}

#[test]
fn limits_hold_while_exploring_and_servoing() {
    let limits = Limits { lower: Some(-0.01), upper: Some(0.35), velocity: Some(0.1), acceleration: None };
    let mut world = Linear::new(0.0);
    let mut servo = world.controller(Settings { gain: 1.0, ..Settings::default() }, limits);
    for _ in 0..200 {
        let motion = servo.step(&world.at, &world.errors(), &none(2), 0.1).unwrap().motion.to_vec();
        assert!(motion.iter().all(|motion| motion.abs() <= 0.01 + 1e-12), "{motion:?}");
        world.carry_out(&motion);
        assert!(world.at.iter().all(|at| (-0.01 - 1e-12..=0.35 + 1e-12).contains(at)), "{:?}", world.at);
    }
    // The nearest that the box allows: x at its upper end, y at its lower.
    assert!((world.at[0] - 0.35).abs() < 1e-6 && (world.at[1] + 0.01).abs() < 1e-6, "{:?}", world.at);
}

#[test]
fn every_update_corrects_a_jacobian_that_is_wrong_in_spite_of_noise() {
    let updates = [
        Update::Broyden { rate: 0.5, gate: 3.0 },
        Update::LeastSquares { forgetting: 0.9, gate: 1.0 },
        Update::Adaptive,
    ];
    for update in updates {
        let mut world = Linear::new(0.0);
        let settings = Settings { update, divergence: f64::INFINITY, ..Settings::default() };
        let mut servo = world.controller(settings, Limits::default());
        let wrong = dmatrix![400.0, 220.0; 20.0, 380.0; 110.0, -190.0];
        let doubt = DMatrix::from_diagonal_element(2, 2, 100.0 * 100.0);
        servo
            .begin_with(Estimate::new(&[0.1; 3], &wrong, &[doubt.clone(), doubt.clone(), doubt], 0.7).unwrap())
            .unwrap();
        let off = |servo: &Uncalibrated| {
            let estimate = servo.estimate().unwrap();
            let rows = [[500.0, 120.0], [-80.0, 300.0], [210.0, -90.0]].into_iter().enumerate();
            rows.map(|(i, row)| (estimate.slopes(i)[0] - row[0]).hypot(estimate.slopes(i)[1] - row[1])).sum::<f64>()
        };
        let before = off(&servo);
        for step in 0..100_u32 {
            // Somebody else moves the quantities about, and noise changes its sign with every row and step.
            world.at = [0.02 * f64::from(step).sin(), 0.02 * (1.7 * f64::from(step)).cos()];
            let noise = |row: usize| if (row + step as usize).is_multiple_of(2) { 0.1 } else { -0.1 };
            let errors: Vec<f64> = world.errors().iter().enumerate().map(|(row, error)| error + noise(row)).collect();
            servo.step(&world.at, &errors, &none(2), 1.0).unwrap();
        }
        assert!(off(&servo) < 0.15 * before, "{update:?}: {before} -> {}", off(&servo));
    }
}

#[test]
fn settings_that_mean_nothing_are_refused_by_name() {
    let with = |change: &dyn Fn(&mut Settings)| {
        let mut settings = Settings::default();
        change(&mut settings);
        let world = Linear::new(0.0);
        Uncalibrated::new(world.quantities(Limits::default()), vec![Row { sd: 0.1, camera: 0 }; 3], settings)
            .err()
            .map(|error| error.to_string())
    };
    assert_eq!(with(&|_| ()), None);
    type Change<'a> = &'a dyn Fn(&mut Settings);
    let cases: [(Change<'_>, &str); 8] = [
        (&|s| s.gain = 1.5, "`gain` is 1.5"),
        (&|s| s.curvature = -1.0, "`curvature` is -1"),
        (&|s| s.divergence = f64::NAN, "`divergence` is NaN"),
        (&|s| s.worst_condition = f64::NAN, "`worst_condition` is NaN"),
        (&|s| s.exploration.largest = 0.0, "`exploration.largest` is 0"),
        (&|s| s.exploration.directions = vec![vec![1.0, 0.0]], "1 exploratory directions"),
        (&|s| s.update = Update::LeastSquares { forgetting: 0.0, gate: 1.0 }, "`forgetting` is 0"),
        (&|s| s.update = Update::Broyden { rate: 2.0, gate: 1.0 }, "`rate` is 2"),
    ];
    for (change, words) in cases {
        assert!(with(change).is_some_and(|error| error.contains(words)), "{words}: {:?}", with(change));
    }
}

/// From a Jacobian that is handed in, the first step is by the whole error that is seen, and rows that are seen later are taken as they are.
#[test]
fn what_is_handed_in_is_not_taught_by_errors_that_were_there_all_along() {
    let mut world = Linear::new(0.0);
    let mut servo = world.controller(Settings { gain: 1.0, trust: None, ..Settings::default() }, Limits::default());
    let right = dmatrix![500.0, 120.0; -80.0, 300.0; 210.0, -90.0];
    let doubt = DMatrix::from_diagonal_element(2, 2, 100.0);
    let estimate = Estimate::new(&[0.1; 3], &right, &[doubt.clone(), doubt.clone(), doubt], 0.7).unwrap();
    servo.begin_with(estimate).unwrap();
    world.at = [0.1, -0.05];
    for step in 0..3 {
        let mut errors = world.errors();
        if step == 0 {
            errors[2] = f64::NAN;
        }
        let motion = servo.step(&world.at, &errors, &none(2), 1.0).unwrap().motion.to_vec();
        world.at.iter_mut().zip(motion).for_each(|(at, motion)| *at += motion);
        let left = world.errors().iter().map(|error| error.abs()).fold(0.0, f64::max);
        assert!(left < 1.0, "step {step}: {left} px are left");
    }
    let off = (servo.estimate().unwrap().slopes(2)[0] - 210.0).abs();
    assert!(off < 1.0, "a slope that was right is off by {off}");
    let shapes = Estimate::new(&[0.1; 3], &right, &[], 0.7).err().unwrap().to_string();
    assert!(shapes.contains("0 covariances"), "{shapes}");
}

#[test]
fn nothing_seen_is_not_converged_and_cameras_at_the_goal_are_not_one() {
    let mut world = Linear::new(0.0);
    let mut servo = world.controller(Settings::plain(0.5, 0.01), Limits::default());
    for _ in 0..30 {
        let motion = servo.step(&world.at, &world.errors(), &none(2), 1.0).unwrap().motion.to_vec();
        world.at.iter_mut().zip(motion).for_each(|(at, motion)| *at += motion);
    }
    let blind = servo.step(&world.at, &[f64::NAN; 3], &none(2), 1.0).unwrap();
    assert!(matches!(blind.phase, Phase::Waiting(_)) && blind.motion == [0.0, 0.0], "{blind:?}");
    // Two cameras of three rows that see no error yet are two cameras.
    let rows: Vec<Row> = (0..6).map(|row| Row { sd: 0.1, camera: row / 3 }).collect();
    let mut servo = Uncalibrated::new(world.quantities(Limits::default()), rows, Settings::default()).unwrap();
    let there = servo.step(&[0.0, 0.0], &[0.01, -0.02, 0.03, 0.0, 0.02, -0.01], &none(2), 1.0).unwrap();
    assert!(matches!(there.phase, Phase::Exploring), "{there:?}");
    let mut servo = Uncalibrated::new(
        world.quantities(Limits::default()),
        (0..6).map(|row| Row { sd: 0.1, camera: usize::MAX - row / 3 }).collect(),
        Settings::default(),
    )
    .unwrap();
    let one = servo.step(&[0.0, 0.0], &[5.0, -2.0, 3.0, 5.0, -2.0, 3.0], &none(2), 1.0).unwrap();
    assert!(matches!(one.phase, Phase::Stopped(Stop::Undetermined(_))), "{one:?}");
}

/// Section 5.2.2 of the thesis, in words: smallest and fastest near orthogonal cameras, and refused where they coincide.
#[test]
fn cameras_serve_best_where_they_are_orthogonal_and_are_refused_where_they_coincide() {
    let outcome = find("figure5.10").unwrap().run(&Options { trials: 100, seed: 1 }).unwrap();
    for series in ["condition number", "iterations to 10 px"] {
        let rows: Vec<_> = outcome.rows.iter().filter(|row| row.series == series).collect();
        assert_eq!(rows[0].x, Some(10.0));
        let means = rows.iter().filter_map(|row| Some((row.mean()?, row.x?)));
        let (_, best) = means.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap();
        assert!((best % 180.0 - 90.0).abs() <= 15.0, "{series}: {best} degrees");
    }
    assert!(outcome.notes.iter().any(|note| note.contains("100 of 100 are refused before the arm moves")));
}
