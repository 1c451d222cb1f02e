//! The command line: exit statuses, messages with their place, one JSON object, and no file touched on failure.
use serde_json::Value;
use std::fs;
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

/// A folder of its own for a test, removed afterwards.
pub struct Folder(PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("handeye-{name}-{}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Folder(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    pub fn write(&self, name: &str, text: &str) -> &Self {
        fs::write(self.0.join(name), text).unwrap();
        self
    }

    pub fn read(&self, name: &str) -> String {
        fs::read_to_string(self.0.join(name)).unwrap()
    }

    pub fn run(&self, arguments: &str) -> Output {
        let arguments = arguments.split_whitespace();
        Command::new(env!("CARGO_BIN_EXE_handeye")).args(arguments).current_dir(&self.0).output().unwrap()
    }

    pub fn names(&self) -> Vec<String> {
        let mut names: Vec<String> =
            fs::read_dir(&self.0).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
        names.sort();
        names
    }

    /// Runs, expects an exit status, and gives what was written on standard output and standard error.
    pub fn expect(&self, status: i32, arguments: &str) -> (String, String) {
        let output = self.run(arguments);
        let [out, err] = [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert_eq!(output.status.code(), Some(status), "handeye {arguments}\n{out}{err}");
        (out, err)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Two joints, one camera, one sample.
const RECORDING: &str = r#"{"format":"handeye-recording","version":1,"joints":["a","b"],"cameras":{"left":{"size":[640,480]}}}
{"joints":[0.1,0.2],"pixels":{"left":{"f0":[312.5,201.25]}}}
"#;

#[test]
fn unusable_input_has_status_2_a_place_and_leaves_the_output_alone() {
    let folder = Folder::new("unusable");
    let header = RECORDING.lines().next().unwrap();
    let joint = |name: &str| format!("[[robot.joints]]\nname = \"{name}\"\n");
    folder
        .write("out.toml", "precious")
        .write("good.jsonl", RECORDING)
        .write("good.toml", "name = \"anything\"\n")
        .write("key.toml", "name = \"x\"\n[[cameras]]\nname = \"left\"\nfxx = 600\n")
        .write("three.toml", &["a", "b", "c"].map(joint).concat())
        .write("right.toml", "[[cameras]]\nname = \"right\"\n")
        .write("empty.jsonl", "")
        .write("header.jsonl", &format!("{header}\n"))
        .write("cut.jsonl", &RECORDING[..RECORDING.len() - 20])
        .write("count.jsonl", &RECORDING.replace("[0.1,0.2]", "[0.1]"))
        .write("camera.jsonl", &RECORDING.replace("{\"left\":{\"f0\"", "{\"lift\":{\"f0\""))
        .write("nan.jsonl", &RECORDING.replace("0.1", "NaN"))
        .write("folder", "")
        .write("twice.toml", &["a", "a"].map(joint).concat());
    let before = folder.names();
    for (arguments, expected) in [
        ("calibrate absent.jsonl -o out.toml", "error: absent.jsonl: "),
        ("calibrate good.jsonl --rig absent.toml -o out.toml", "error: absent.toml: "),
        ("calibrate good.jsonl --rig key.toml -o out.toml", "error: key.toml:4:1: "),
        ("calibrate good.jsonl --rig twice.toml -o out.toml", "error: twice.toml:4:8: "),
        ("calibrate good.jsonl --rig three.toml -o out.toml", "error: good.jsonl:1:1: the recording has 2 joints"),
        ("calibrate good.jsonl --rig right.toml -o out.toml", "error: good.jsonl:1:1: camera `left` is not in the rig"),
        ("calibrate empty.jsonl -o out.toml", "error: empty.jsonl:1:1: "),
        ("calibrate header.jsonl -o out.toml", "error: header.jsonl:1:1: "),
        ("calibrate cut.jsonl -o out.toml", "error: cut.jsonl:2:"),
        ("calibrate count.jsonl -o out.toml", "error: count.jsonl:2:11: sample has 1 joints, the header names 2"),
        ("calibrate camera.jsonl -o out.toml", "error: camera.jsonl:2:31: "),
        ("calibrate nan.jsonl -o out.toml", "error: nan.jsonl:2:12: "),
        ("calibrate good.jsonl good.jsonl count.jsonl -o out.toml", "error: count.jsonl:2:11: "),
        ("calibrate good.jsonl -o absent/out.toml", "error: absent/out.toml: "),
        ("calibrate good.jsonl -o good.jsonl", "error: good.jsonl: this would be written over"),
        ("calibrate good.jsonl -o out.toml --folds 5", "error: --folds 5: "),
        ("evaluate good.toml good.jsonl", "error: the rig has 0 joints, the recording 2"),
        ("evaluate three.toml good.jsonl", "error: good.jsonl:1:1: the recording has 2 joints"),
        ("evaluate ur5 absent.jsonl", "error: absent.jsonl: "),
        ("check key.toml", "error: key.toml:4:1: "),
        ("check right.toml good.jsonl", "error: good.jsonl:1:1: camera `left` is not in the rig"),
        ("simulate good.toml -o out.toml", "error: the rig has no cameras"),
        ("simulate ur3e -o out.toml", "error: the rig has no cameras"),
        (
            "simulate three.toml -o out.toml",
            "error: the rig is not complete: it has no value for `robot.joints.a.offset`",
        ),
        ("simulate ur5 --missed 1.5 -o out.toml", "error: `missed` is a share between 0 and 1"),
        ("simulate ur5 -o rec.jsonl --truth absent/truth.jsonl", "error: absent/truth.jsonl: "),
        ("simulate ur5 -o rec.jsonl --truth rec.jsonl", "error: rec.jsonl: "),
    ] {
        let (out, err) = folder.expect(2, arguments);
        assert!(err.starts_with(expected) && err.lines().count() == 1, "handeye {arguments}: {err}");
        assert_eq!(out, "", "handeye {arguments}");
        let (out, _) = folder.expect(2, &format!("{arguments} --json"));
        let told = serde_json::from_str::<Value>(&out).unwrap();
        assert_eq!(format!("error: {}\n", told["error"].as_str().unwrap()), err, "handeye {arguments} --json");
        assert_eq!(folder.read("out.toml"), "precious", "handeye {arguments}");
        assert_eq!(folder.names(), before, "handeye {arguments} leaves no file behind");
    }
    let (_, err) = folder.expect(2, "check key.toml");
    assert!(err.contains("`fx`"), "an unknown key is told with the nearest: {err}");
}

#[test]
fn unusable_arguments_have_status_2_and_a_hint() {
    let folder = Folder::new("arguments");
    for (arguments, expected) in [
        ("calibrat", "calibrate"),
        ("calibrate", "--output"),
        ("calibrate rec.jsonl", "--output"),
        ("calibrate rec.jsonl -o x --folds 1", "--folds"),
        ("calibrate rec.jsonl -o x --threads 0", "--threads"),
        ("calibrate rec.jsonl -o x --sede 3", "--seed"),
        ("simulate ur5 --samples many -o x", "--samples"),
        ("completions ksh93", "bash"),
        ("", "Usage"),
    ] {
        let (out, err) = folder.expect(2, arguments);
        assert!(out.is_empty() && err.contains(expected), "handeye {arguments}: {err}");
    }
    let (out, _) = folder.expect(2, "calibrate --json");
    assert!(serde_json::from_str::<Value>(&out).unwrap()["error"].as_str().unwrap().contains("--output"));
}

#[test]
fn what_cannot_be_done_has_status_1_and_leaves_the_output_alone() {
    let folder = Folder::new("undone");
    folder.write("good.jsonl", RECORDING).write("out.toml", "precious");
    let (out, err) = folder.expect(1, "calibrate good.jsonl -o out.toml --json");
    let told = serde_json::from_str::<Value>(&out).unwrap();
    assert_eq!(format!("error: {}\n", told["error"].as_str().unwrap()), err);
    assert_eq!(folder.read("out.toml"), "precious");
}

#[test]
fn every_command_prints_one_object_with_json_and_none_without() {
    let folder = Folder::new("json");
    let object = |arguments: &str| -> Value {
        let (out, err) = folder.expect(0, &format!("{arguments} --json"));
        assert_eq!(err, "", "handeye {arguments}: no progress where nobody watches");
        let value: Value = serde_json::from_str(&out).unwrap();
        assert!(value.is_object(), "handeye {arguments}");
        let (text, _) = folder.expect(0, arguments);
        assert!(serde_json::from_str::<Value>(&text).is_err(), "handeye {arguments}: {text}");
        value
    };
    let simulated = object("simulate ur5 --samples 5 --seed 3 --missed 0.1 -o rec.jsonl --truth truth.jsonl");
    let (seen, missed) = (simulated["observations"].as_u64().unwrap(), simulated["missed"].as_u64().unwrap());
    assert!(simulated["samples"] == 5 && seen > 60 && missed > 0);

    let checked = object("check ur5 rec.jsonl truth.jsonl");
    assert_eq!(checked["recording"]["samples"], 10);
    assert_eq!(checked["recording"]["observations"].as_u64(), Some(2 * seen + missed));
    assert_eq!((&checked["unknown_paths"], &checked["held"]), (&serde_json::json!(["robot.base"]), &0.into()));

    let exact = object("evaluate ur5 truth.jsonl");
    assert!(exact["rms_px"].as_f64().unwrap() < 1e-6, "the rig predicts what it was without noise");
    let noisy = object("evaluate ur5 rec.jsonl");
    assert_eq!((&noisy["samples"], &noisy["observations"], &noisy["rejected"]), (&5.into(), &seen.into(), &0.into()));
    for of in [&noisy, &noisy["cameras"]["left"], &noisy["cameras"]["right"]] {
        // 0.3 px per axis make 0.424 px; of n distances the root mean square is off by 0.424/√(4n), n > 40.
        let rms = of["rms_px"].as_f64().unwrap();
        assert!((rms - 0.424).abs() < 0.1 && of["mean_px"].as_f64().unwrap() < rms, "{of}");
    }
    assert!(object("completions fish")["script"].as_str().unwrap().contains("calibrate"));
}

#[test]
fn the_same_seed_simulates_the_same_file() {
    let folder = Folder::new("seed");
    for (name, seed) in [("a", 1), ("b", 1), ("c", 2)] {
        folder.expect(0, &format!("simulate ur5 --samples 4 --seed {seed} -o {name}"));
    }
    assert_eq!(folder.read("a"), folder.read("b"));
    assert_ne!(folder.read("a"), folder.read("c"));
}

#[test]
fn help_and_completions_are_there_for_every_command() {
    let folder = Folder::new("help");
    let (help, _) = folder.expect(0, "--help");
    for command in ["demo", "check", "simulate", "calibrate", "evaluate", "completions"] {
        assert!(help.contains(command));
        let (help, _) = folder.expect(0, &format!("{command} --help"));
        assert!(help.contains("Usage: handeye") && help.contains("--json"), "{help}");
    }
    for shell in ["bash", "zsh", "fish", "elvish", "powershell"] {
        let (script, _) = folder.expect(0, &format!("completions {shell}"));
        assert!(script.contains("calibrate"), "{shell}");
    }
}

#[test]
fn a_reader_who_has_seen_enough_is_no_failure() {
    let folder = Folder::new("pipe");
    let mut child = Command::new(env!("CARGO_BIN_EXE_handeye"))
        .args(["completions", "bash"])
        .current_dir(folder.path())
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut complaint = String::new();
    child.stderr.take().unwrap().read_to_string(&mut complaint).unwrap();
    assert_eq!((child.wait().unwrap().code(), complaint.as_str()), (Some(0), ""));
}
