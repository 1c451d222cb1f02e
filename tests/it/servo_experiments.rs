//! The paper's servoing in simulation reaches what the noise of the robot allows, and no sooner than that is there more to gain.
use handeye::experiments::{Options, Outcome, find};

fn run(name: &str, trials: usize) -> Outcome {
    let outcome = find(name).unwrap().run(&Options { trials, seed: 1 }).unwrap();
    assert!(outcome.rows.iter().all(|row| row.failed == 0), "{name} has failed trials");
    outcome
}

fn mean(outcome: &Outcome, label: &str) -> f64 {
    let row = outcome.rows.iter().find(|row| row.label == label);
    row.unwrap_or_else(|| panic!("no row `{label}`")).mean().unwrap()
}

/// A rig learned from a noisy controller whose state nobody observes leads to the target plus one noisy motion, from the second command on:
/// means of 20 trials with 10 targets each, against 2,000 draws of the floor.
#[test]
fn an_unobserved_controller_is_servoed_to_the_floor_of_its_noise() {
    for (name, series) in [("figure10", ["0.01 m and rad", "0.02 m and rad"]), ("figure11", ["0.01 rad", "0.02 rad"])] {
        let outcome = run(name, 20);
        for series in series {
            let floor = mean(&outcome, &format!("{series}, floor"));
            for command in 2..=5 {
                let ratio = mean(&outcome, &format!("{series}, after {command} commands")) / floor;
                assert!(ratio < 1.1, "{name}, {series}, command {command}: {ratio} times the floor");
            }
            assert!(mean(&outcome, &format!("{series}, after 0 commands")) > 10.0 * floor);
        }
        let left = mean(&outcome, "2 % of the motion, after 4 commands");
        assert!(left < 1.0, "{name}: {left} px where noise is in proportion to the motion");
    }
}

#[test]
fn learned_rigs_arrive_with_one_command_and_noisy_ones_at_the_floor() {
    let exact = run("figure8", 10);
    assert!(mean(&exact, "ours, after 1 command") < 0.5 && mean(&exact, "ours, after 0 commands") > 100.0);
    let noisy = run("figure9", 20);
    for command in 2..=10 {
        let ratio = mean(&noisy, &format!("ours, after {command} commands")) / mean(&noisy, "ours, floor");
        assert!(ratio < 1.1, "command {command}: {ratio} times the floor");
    }
}

#[test]
fn objects_are_grasped_and_inserted_by_a_robot_that_errs() {
    let grasping = run("grasping", 50);
    assert!(mean(&grasping, "share within 5 mm") >= 0.98 && mean(&grasping, "off by, mm") < 1.5);
    let insertion = run("insertion", 50);
    assert!(mean(&insertion, "share within 2 mm") >= 0.95, "{}", mean(&insertion, "share within 2 mm"));
}
