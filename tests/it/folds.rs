//! `--folds` says what a rig is worth on samples that it has not seen, from nothing and with a rig, near the floor of the noise.
use crate::cli::Folder;
use serde_json::Value;

#[test]
fn folds_from_nothing_come_near_the_floor_and_near_what_fresh_samples_say() {
    let folder = Folder::new("folds-from-nothing");
    folder.expect(0, "simulate ur5 --samples 60 --seed 1 -o motions.jsonl");
    folder.expect(0, "simulate ur5 --samples 100 --seed 2 -o fresh.jsonl");
    let json = |arguments: &str| -> Value {
        let (out, _) = folder.expect(0, &format!("{arguments} --json"));
        serde_json::from_str(&out).unwrap()
    };
    let rms = |of: &Value| of["rms_px"].as_f64().unwrap();
    // 0.3 px per axis.
    let floor = 0.3 * 2.0_f64.sqrt();
    for rig in ["", "--rig ur5"] {
        let report = json(&format!("calibrate motions.jsonl {rig} -o learned.toml --folds 6"));
        let (fitted, held_out) = (rms(&report), rms(&report["held_out"]));
        let fresh = rms(&json("evaluate learned.toml fresh.jsonl"));
        // 60 samples are some 1,300 distances, and 10 some 220: their rms is off by 1/√(4n), 3 σ are 4 and 10 %.
        let bound = |mean: f64, off: f64| floor * (mean - off)..floor * (mean + off);
        assert!(bound(1.03, 0.05).contains(&held_out), "{held_out} px held out with `{rig}`");
        assert!(
            bound(held_out / floor, 0.06).contains(&fresh),
            "{fresh} px fresh, {held_out} px held out with `{rig}`"
        );
        assert!(fitted < held_out, "{fitted} px fitted, {held_out} px held out with `{rig}`");
        for fold in report["held_out"]["folds"].as_array().unwrap() {
            assert!(bound(1.03, 0.12).contains(&rms(fold)), "{fold} with `{rig}`");
        }
    }
}
