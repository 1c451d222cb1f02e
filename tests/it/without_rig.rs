//! The experiments of servoing without a rig come out as their geometry, statics and control have it.
use handeye::experiments::{Options, Outcome, Row, find};

fn run(name: &str, trials: usize) -> Outcome {
    find(name).unwrap().run(&Options { trials, seed: 1 }).unwrap()
}

/// The row whose label has all of these words.
fn row<'a>(outcome: &'a Outcome, words: &[&str]) -> &'a Row {
    let mut found = outcome.rows.iter().filter(|row| words.iter().all(|word| row.label.contains(word)));
    let row = found.next().unwrap_or_else(|| panic!("no row has {words:?}"));
    assert!(found.next().is_none(), "{words:?} is of several rows");
    row
}

fn median(outcome: &Outcome, label: &str) -> f64 {
    let row = outcome.rows.iter().find(|row| row.label == label);
    row.unwrap_or_else(|| panic!("no row `{label}`")).median().unwrap()
}

#[test]
fn errors_grow_with_the_distance_by_its_square_where_trackers_err_with_it() {
    let outcome = run("figure5.17", 5);
    // Slopes fall with the distance; two cameras that look the same way tell depth by the square of it.
    let ratio = row(&outcome, &["0.2 px, 3D error at 0.55 m"]).median().unwrap();
    assert!((ratio / (0.55 / 0.4) - 1.0).abs() < 0.15, "{ratio}");
    let ratio = row(&outcome, &["0.2 px · d/0.4 m, 3D error at 0.55 m"]).median().unwrap();
    assert!((ratio / (0.55_f64 / 0.4).powi(2) - 1.0).abs() < 0.15, "{ratio}");
    let published = row(&outcome, &["0.2 px · d/0.4 m, 3D error at 0.55 m"]).published.unwrap().mean;
    assert!((ratio / published - 1.0).abs() < 0.25, "{ratio}, published {published}");
    assert!(!outcome.notes[0].contains("ours"), "ours never diverges: {}", outcome.notes[0]);
    for view in ["parallel cameras", "cameras at 90 degrees"] {
        let of =
            |tracker: &str, distance: &str| median(&outcome, &format!("{tracker}, {distance} m, 3D error, {view}"));
        assert!(of("0.2 px", "2") > 2.0 * of("0.2 px", "0.4"), "{view}");
        assert!(of("perfect", "2") < 1e-3 && of("perfect", "0.4") < 1e-3, "{view}");
        assert!(of("0.2 px · d/0.4 m", "2") > 3.0 * of("0.2 px", "2"), "{view}");
        // The image error is that of the trackers: √2 · 0.2 px in each row, of which the arm's 4 joints take up little.
        let image = median(&outcome, &format!("0.2 px, 2 m, image error, {view}"));
        assert!((0.2..0.36).contains(&image), "{view}: {image}");
    }
    // Who weighs what is seen by how well it is seen meets the target from everywhere.
    let ours = median(&outcome, "0.2 px · d/0.4 m, ours, 2 m, 3D error, cameras at 90 degrees");
    assert!(ours < 10.0, "{ours} mm");
}

#[test]
fn a_dead_band_leaves_its_share_of_the_gain_unless_the_controller_is_told() {
    let outcome = run("dead-band", 10);
    for (gain, most) in [("0.1", 10.0), ("0.25", 4.0), ("0.5", 2.0)] {
        let told = row(&outcome, &[&format!("told of the dead band, gain {gain}")]);
        assert!(told.values.iter().all(|off| *off <= 1.5), "gain {gain}: {:?}", told.values);
        let told = row(&outcome, &[&format!("told of it, our defaults, gain {gain}")]);
        assert!(told.values.iter().all(|off| *off <= 1.5), "gain {gain}: {:?}", told.values);
        let untold = row(&outcome, &[&format!("told nothing, gain {gain}")]).median().unwrap();
        // The Jacobian of the start is up to half off.
        assert!((0.4 * most..1.6 * most).contains(&untold), "gain {gain}: {untold} of {most}");
    }
}

#[test]
fn a_wrench_ends_on_the_side_that_it_begins_nearer_to_and_with_the_same_errors_unless_the_side_is_told() {
    let outcome = run("wrench", 5);
    let share = |side: &str, turn: &str| {
        row(&outcome, &[&format!("share on the {side} side, begins turned by {turn}")]).mean().unwrap()
    };
    for turn in ["0°", "30°"] {
        assert_eq!(
            (share("right", &format!("{turn}, side told")), share("other", &format!("{turn}, side told"))),
            (1.0, 0.0)
        );
    }
    let of = |words: &str| outcome.rows.iter().find(|row| row.label == words).unwrap().mean().unwrap();
    assert_eq!(of("share on the right side, begins turned by 30°"), 1.0);
    assert_eq!(of("share on the other side, begins turned by 150°"), 1.0);
    let error = |series: &str| of(&format!("image error [px], {series}, after 60"));
    assert!(error("begins turned by 30°") < 1.0 && error("by 150°") < 1.0);
    assert!(error("by 150°, side told") > 3.0, "on the other side, the errors say so: {}", error("by 150°, side told"));
}

#[test]
fn a_gripper_and_points_in_space_are_brought_as_near_as_noise_allows_and_a_moving_target_is_followed() {
    let pick = run("pick-alignment", 10);
    for series in ["0.1 px", "0.5 px"] {
        let label = format!("share within 3 mm at the end, {series}");
        assert_eq!(row(&pick, &[&label]).mean(), Some(1.0), "{series}");
    }
    let depth = run("depth-camera", 10);
    for (series, noise) in [("1 mm", 1.0), ("3 mm", 3.0), ("6 mm", 6.0)] {
        let end = median(&depth, &format!("3D error [mm], {series}, after 50"));
        assert!(end < 1.5 * noise, "{series}: {end} mm");
    }
    assert!(median(&depth, "3D error [mm], exact, after 50") < 0.5);
    let moving = run("moving-target", 6);
    for series in ["half as fast", "as recorded", "twice as fast"] {
        // 1 / gain, of which the Jacobian is some tenths off.
        let lag = median(&moving, &format!("lag in motions of the hand, {series}"));
        assert!((1.4..2.6).contains(&lag), "{series}: {lag}");
        assert!(median(&moving, &format!("at rest at the end, {series}, mm")) < 1.5, "{series}");
    }
}

#[test]
fn contact_with_the_table_is_kept_and_a_drone_keeps_to_its_line() {
    let spring = run("virtual-spring", 8);
    for series in ["no friction", "friction 0.02", "friction 0.05"] {
        let least = row(&spring, &[&format!("least force of contact, exploring included, {series}")]);
        // K times 0.2 m, exploring and sliding included.
        assert!(least.values.iter().all(|force| (38.0..42.0).contains(force)), "{series}: {:?}", least.values);
        let end = median(&spring, &format!("tool from target [mm], {series}, after 40"));
        assert!(end < 5.0, "{series}: {end} mm");
    }
    assert!(median(&spring, "tool from target [mm], no friction, after 40") < 1.0);
    let drone = run("drone", 10);
    let off = |series: &str| median(&drone, &format!("nose off the line, last 20 commands, {series}, degrees"));
    assert!(off("hovering") < 0.5 && off("flown by a pilot") < 0.5);
    // Wind of 1 degree per command, gain 0.5.
    assert!((1.5..2.5).contains(&off("flown, turned by wind")), "{}", off("flown, turned by wind"));
    assert!(spring.notes.iter().chain(&drone.notes).all(|note| !note.contains("stopped") || note.contains(": 0 of")));
}
