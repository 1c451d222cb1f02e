//! Whatever is wrong with a file is told with its place, what was found, and what would do.
use handeye::Error;
use handeye::recording::Recording;
use handeye::rig::{Rig, catalog};
use handeye::urdf::Urdf;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

/// A text in which the character after `@` is where the problem stands.
pub fn place(marked: &str) -> (String, usize, usize) {
    let (before, after) = marked.split_once('@').expect("a marked place");
    let line_start = before.rfind('\n').map_or(0, |newline| newline + 1);
    let column = 1 + before[line_start..].chars().count();
    (format!("{before}{after}"), 1 + before.matches('\n').count(), column)
}

fn assert_error<T: std::fmt::Debug>(read: Result<T, Error>, marked: &str, words: &str) {
    let (_, line, column) = place(marked);
    match read {
        Err(Error::Malformed { file, line: found_line, column: found_column, problem }) => {
            assert_eq!((found_line, found_column), (line, column), "{marked}\n{problem}");
            assert!(problem.contains(words), "{marked}\n found: {problem}\nwanted: {words}");
            assert_eq!(file, "file", "{marked}");
        }
        other => panic!("{marked}\n{other:?}"),
    }
}

#[test]
fn every_mistake_in_a_rig_file_is_told_with_its_place_and_what_would_do() {
    for (marked, words) in [
        // TOML itself.
        ("name = @UR5\n", "string"),
        ("name = \"UR5\"\n@name = \"UR10\"\n", "duplicate key"),
        ("[robot@\n", ""),
        // Types.
        ("@name = 5", ""),
        ("[[robot.joints]]\nname = \"j\"\nd = @\"0.1\"\n", "joint `j`: `d`: expected a number, found a string"),
        ("[[robot.joints]]\nname = \"j\"\nreversed = @1\n", "expected true or false, found the number 1"),
        (
            "[[cameras]]\nname = \"ü\"\nfx = 1\nsize = [640, @480.5]\n",
            "expected a whole number, found the number 480.5",
        ),
        ("@robot = 3", ""),
        ("cameras = @{ name = 'c' }", "`cameras`: expected an array, found a table"),
        ("@[robot]\njoints = 1\n", ""),
        // Numbers.
        ("[[robot.joints]]\nname = 'j'\nalpha = @nan\n", "joint `j`: `alpha`: expected a finite number, found NaN"),
        ("noise = { joints = @-inf }", "expected a finite number"),
        ("[noise]\npixels = @-0.5\n", "noise: `pixels`: must be 0 or more, found -0.5"),
        ("[noise.pose]\nrot = @-1\n", "must be 0 or more"),
        ("[noise]\npoints = @-0.005\n", "noise: `points`: must be 0 or more, found -0.005"),
        ("[[cameras]]\nname = 'c'\ndepth = @1\n", "camera `c`: `depth`: expected true or false, found the number 1"),
        ("[[cameras]]\nname = 'c'\nfx = @0\n", "camera `c`: `fx`: must be above 0, found 0"),
        ("[[cameras]]\nname = 'c'\nsize = @[0, 480]\n", "width and height must be above 0"),
        ("[[cameras]]\nname = 'c'\nsize = @[640]\n", "expected width and height, found 1"),
        ("[[cameras]]\nname = 'c'\nsize = [@99999999999, 1]\n", "out of range"),
        ("[[features]]\nname = 'f'\nxyz = @[1, 2]\n", "feature `f`: `xyz`: expected 3 numbers, found 2"),
        ("[[features]]\nname = 'f'\nxyz = [1, 2, @'3']\n", "expected a number, found a string"),
        (
            "[[robot.joints]]\nname = 'j'\nlimits = @{ lower = 1, upper = -1 }\n",
            "`lower` is 1, which is above `upper`, -1",
        ),
        ("[[robot.joints]]\nname = 'j'\nlimits = { velocity = @0 }\n", "must be above 0"),
        // Keys and words.
        ("[[robot.joints]]\nname = 'j'\n@ofset = 1\n", "joint `j`: unknown key `ofset` (did you mean `offset`?)"),
        (
            "[[robot.joints]]\nname = 'j'\n@theta = 1\n",
            "(known: name, type, offset, d, a, alpha, beta, reversed, limits, link, frame)",
        ),
        ("[[@camera]]\nname = 'c'\n", "unknown key `camera` (did you mean `cameras`?)"),
        ("[[robot.joints]]\nname = 'j'\nlimits = { @max = 1 }\n", "(known: lower, upper, velocity, acceleration)"),
        ("[fit]\n@rms = 1\n", "unknown key `rms`"),
        (
            "[[cameras]]\nname = 'left'\nmodel = @'fisheye'\n",
            "camera `left`: `model`: unknown model `fisheye` (known: pinhole, brown-conrady, rational, kannala-brandt)",
        ),
        ("[robot]\nconvention = @'craig'\n", "unknown convention `craig` (known: dh, modified-dh)"),
        ("[[robot.joints]]\nname = 'j'\ntype = @'fixed'\n", "unknown joint type `fixed` (known: revolute, prismatic)"),
        // Names and parents.
        ("@[[robot.joints]]\nd = 1\n", "joint 1: has no `name`"),
        ("[[robot.joints]]\nname = 'a'\n[[robot.joints]]\nname = @'a'\n", "another joint is called `a`, in line 2"),
        ("[[cameras]]\nname = 'a'\n[[cameras]]\nname = @'a'\n", "another camera is called `a`, in line 2"),
        ("[[features]]\nname = 'a'\n[[features]]\nname = @'a'\n", "another feature is called `a`, in line 2"),
        ("[[features]]\nname = @''\n", "a name is empty"),
        ("[[features]]\nname = @'f.1'\n", "has a '.'"),
        ("[[cameras]]\nname = @'*'\n", "has a '*'"),
        ("[[robot.joints]]\nname = @'tip'\n", "a joint cannot be called `tip`"),
        (
            "[[robot.joints]]\nname = 'elbow'\n[[cameras]]\nname = 'c'\nparent = @'elbov'\n",
            "no joint is called `elbov` (did you mean `elbow`?)",
        ),
        ("[[features]]\nname = 'f'\nparent = @'flange'\n", "no joint is called `flange` (known: world, tip)"),
        // Poses.
        ("[robot]\nbase = @{ quat = [0, 0, 0, 1] }\n", "has no `xyz`"),
        ("[robot]\nbase = @{ xyz = [0, 0, 0] }\n", "give `quat` = [x, y, z, w] or `rpy`"),
        ("[robot]\nbase = { xyz = [0, 0, 0], quat = [0, 0, 0, 1], rpy = @[0, 0, 0] }\n", "not both"),
        ("[robot]\nbase = { xyz = [0, 0, 0], quat = @[0, 0, 0, 0] }\n", "a quaternion of length 0"),
        ("[robot]\nbase = { xyz = [0, 0, 0], quat = @[0, 0, 1] }\n", "expected 4 numbers, found 3"),
        // Distortion.
        ("[[cameras]]\nname = 'c'\nmodel = 'pinhole'\ndistortion = @[0.1]\n", "the model `pinhole` has none"),
        ("[[cameras]]\nname = 'c'\nmodel = 'kannala-brandt'\ndistortion = @[1, 2, 3, 4, 5]\n", "has 4 (k1 k2 k3 k4)"),
        ("[[cameras]]\nname = 'c'\ndistortion = @[1, 2, 3, 4, 5, 6, 7, 8, 9]\n", "no model has more than 8"),
        // Parameter paths.
        (
            "[[cameras]]\nname = 'left'\n[estimate]\nfixed = ['robot.base', @'cameras.lefd.fx']\n",
            "unknown `lefd` (did you mean `left`?)",
        ),
        (
            "[estimate]\nfixed = [@'cameras.*.focal']\n",
            "unknown `focal` (known: pose, fx, fy, cx, cy, distortion, intrinsics)",
        ),
        ("[estimate]\nfixed = [@'camera']\n", "(did you mean `cameras`?)"),
        ("[estimate]\nfixed = [@'robot.base.xyz']\n", "there is nothing below `robot.base`"),
        ("[estimate]\nfixed = @'robot'\n", "expected an array, found a string"),
        ("[estimate]\nfixed = [@1]\n", "expected a string"),
        (
            "[[robot.joints]]\nname = 'j'\nd = 1\n[estimate]\nfixed = [@'robot.joints']\n",
            "holds `robot.joints.j.offset`, which has no value",
        ),
        ("[estimate.prior]\n'robot.base' = @0\n", "must be above 0"),
        ("[estimate.prior]\n'robot.bass' = @1\n", "(did you mean `base`?)"),
        ("[[features]]\nname = 'f'\n[fit.sd]\n'features.g.xyz' = @[1, 1, 1]\n", "unknown `g`"),
    ] {
        let (text, _, _) = place(marked);
        if words.is_empty() {
            // Only that it is refused, at some place.
            assert!(matches!(Rig::parse(&text, "file"), Err(Error::Malformed { .. })), "{text}");
        } else {
            assert_error(Rig::parse(&text, "file"), marked, words);
        }
    }
}

const HEADER: &str =
    r#"{"format":"handeye-recording","version":1,"joints":["a","b"],"cameras":{"left":{"size":[640,480]},"right":{}}}"#;

#[test]
fn every_mistake_in_a_recording_is_told_with_its_place_and_what_would_do() {
    let whole_files = [
        ("@", "is empty, and a recording begins with a header"),
        ("@\n\n", "is empty"),
        ("{\"format\":@\"rosbag\",\"version\":1}\n{}\n", "unknown format `rosbag` (known: handeye-recording)"),
        ("{\"format\":\"handeye-recording\",\"version\":@2}\n{}\n", "unknown version 2 (known: 1)"),
        ("@{\"version\":1}\n{}\n", "the header has no `format`"),
        ("{@\"time\":0.5,\"joints\":[1]}\n", "unknown key `time` (known: format, version, joints, cameras)"),
        ("@[1, 2]\n", "expected a header"),
        ("@name = \"UR5\"\n", "this is not JSON"),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"joints\":[\"a\",@\"a\"]}\n{}\n",
            "two joints are called `a`",
        ),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"joints\":[@\"world\"]}\n{}\n",
            "a joint cannot be called `world`",
        ),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{\"c\":{},@\"c\":{}}}\n{}\n",
            "camera `c` is given twice",
        ),
        ("{\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{@\"c.1\":{}}}\n{}\n", "has a '.'"),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{\"c\":{\"size\":@[-640,480]}}}\n{}\n",
            "found -640 and 480",
        ),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{\"c\":{\"fy\":@0}}}\n{}\n",
            "`fy` must be above 0",
        ),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{\"c\":{\"model\":@\"fisheye\"}}}\n{}\n",
            "unknown model `fisheye` (known: pinhole",
        ),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{\"c\":@{\"distortion\":[1],\"model\":\"pinhole\"}}}\n{}\n",
            "has none",
        ),
        (
            "{\"format\":\"handeye-recording\",\"version\":1,\"cameras\":{\"c\":{@\"focal\":1}}}\n{}\n",
            "camera `c`: unknown key `focal`",
        ),
        ("{\"format\":\"handeye-rec@", "the last line is cut off"),
    ];
    let only_header = format!("@{HEADER}\n\n");
    let whole_files = whole_files.map(|(marked, words)| (marked.to_owned(), words));
    let samples = [
        (r#"{"joints":@[1,2,3,4,5]}"#, "sample has 5 joints, the header names 2"),
        (r#"{"joint_action":@[1]}"#, "`joint_action` has 1 joints, the header names 2"),
        (r#"{"joints":[1,@"2"]}"#, "expected a number"),
        (r#"{"joints":[1,@null]}"#, "expected a number"),
        (r#"{"joints":@{"a":1}}"#, "expected an array of numbers"),
        (r#"{"time":@[1]}"#, "expected a number"),
        (r#"{"time":@NaN}"#, "expected a finite number"),
        (r#"{"time":@nan}"#, "expected a finite number"),
        (r#"{"time":@1e999}"#, "the number is too large"),
        (r#"{"pixels":{@"middle":{}}}"#, "the header names no camera `middle` (known: left, right)"),
        (r#"{"pixels":{@"lft":{}}}"#, "the header names no camera `lft` (did you mean `left`?)"),
        (r#"{"pixels":{"left":{"ü":[1,2],"f0":@[312.4]}}}"#, "expected 2 numbers, found 1"),
        (r#"{"pixels":{"left":{"f0":@[1,2,3]}}}"#, "expected 2 numbers, found 3"),
        (r#"{"pixels":{"left":{"f0":@7}}}"#, "expected an array of 2 numbers"),
        (r#"{"pixels":{"left":{"f0":[1,2],@"f0":[3,4]}}}"#, "`f0` is given twice"),
        (r#"{"pixels":{"left":{@"f.0":[1,2]}}}"#, "has a '.'"),
        (r#"{"pixels":{"left":{},@"left":{}}}"#, "camera `left` is given twice"),
        (r#"{"points":{"left":{"f0":@[1,2]}}}"#, "expected 3 numbers, found 2"),
        (r#"{"points":{"left":{"f0":[1,2,@"3"]}}}"#, "expected a number"),
        (r#"{"points":{@"lft":{}}}"#, "the header names no camera `lft` (did you mean `left`?)"),
        (r#"{"time":1,@"time":2}"#, "`time` is given twice"),
        (r#"{@"pixel":{}}"#, "unknown key `pixel` (did you mean `pixels`?)"),
        (r#"{"pose":{"xyz":[0,0,0],"quat":@[0,0,0,0]}}"#, "a quaternion of length 0"),
        (r#"{"pose":@{"xyz":[0,0,0]}}"#, "this is not a pose"),
        (r#"{"targets":{"left":{"tag":{"xyz":[0,0,0],"quat":@[0,0,1]}}}}"#, "expected 4 numbers, found 3"),
        (
            r#"{"targets":{"left":{"tag":{"xyz":[0,0,0],"rpy":[0,0,0],"covariance":@[1,2]}}}}"#,
            "expected 36 numbers, found 2",
        ),
        (r#"{"pose":{"xyz":[0,0,0],"rpy":[0,0,0],@"covariance":[1,2]}}"#, "unknown key `covariance`"),
        (r#"@[]"#, "expected a sample"),
        (r#"{"time":1} @{}"#, "trailing characters"),
        (r#"{"time":1,@}"#, "trailing comma"),
        (r#"{"time":1@"#, "the line ends in the middle of a sample"),
    ];
    let samples = samples.map(|(sample, words)| (format!("{HEADER}\n{{}}\n\n{sample}\n{{}}\n"), words));
    let cut = format!("{HEADER}\n{{\"time\":1.0}}\n{{\"time\":2.0,\"pixels\":{{\"left\":{{\"f0\":[31@");
    for (marked, words) in whole_files
        .into_iter()
        .chain(samples)
        .chain([(only_header, "has no samples"), (cut, "the last line is cut off")])
    {
        assert_error(Recording::read_from(place(&marked).0.as_bytes(), "file"), &marked, words);
    }
}

#[test]
fn files_that_are_not_there_or_not_text_are_told_by_name() {
    let path = std::env::temp_dir().join(format!("handeye-malformed-{}", std::process::id()));
    for error in [Rig::read(&path).unwrap_err(), Recording::read(&path).unwrap_err()] {
        assert!(error.is_input() && error.to_string().starts_with(&path.display().to_string()), "{error}");
    }
    std::fs::write(&path, b"name = 'a'\n# \xff\xfe\n").unwrap();
    let error = Rig::read(&path).unwrap_err().to_string();
    assert_eq!(error, format!("{}:2:3: this is not UTF-8 text", path.display()));
    std::fs::remove_file(&path).unwrap();
}

#[test]
fn deep_nesting_is_refused_and_not_followed() {
    for text in [
        format!("name = {}", "[".repeat(100_000)),
        format!("{} = 1", vec!["a"; 50_000].join(".")),
        format!("[{}]\n", vec!["estimate"; 50_000].join(".")),
        format!("estimate.prior = {}", "{a=".repeat(50_000)),
        format!("estimate.prior.{} = 1", vec!["a"; 50_000].join(".")),
    ] {
        assert!(matches!(Rig::parse(&text, "deep"), Err(Error::Malformed { .. })), "{}", &text[..40]);
    }
    let text = format!("{HEADER}\n{{\"joints\":{}", "[".repeat(100_000));
    assert!(matches!(Recording::read_from(text.as_bytes(), "deep"), Err(Error::Malformed { line: 2, .. })));
}

/// Flips, deletes, repeats or swaps a few stretches of bytes.
fn mutate(bytes: &mut Vec<u8>, random: &mut ChaCha8Rng) {
    const TELLING: &[u8] = b"0-.e\"'[]{},:=\n# \\N\xff";
    for _ in 0..random.random_range(1..4) {
        if bytes.is_empty() {
            return;
        }
        let start = random.random_range(0..bytes.len());
        let end = (start + random.random_range(1..20)).min(bytes.len());
        match random.random_range(0..6) {
            0 => bytes[start] ^= 1 << random.random_range(0..8),
            1 => bytes[start] = TELLING[random.random_range(0..TELLING.len())],
            2 => drop(bytes.drain(start..end)),
            3 => {
                let copy = bytes[start..end].to_vec();
                let target = random.random_range(0..=bytes.len());
                bytes.splice(target..target, copy);
            }
            4 => {
                let other = random.random_range(0..bytes.len());
                bytes.swap(start, other);
            }
            _ => bytes.truncate(start),
        }
    }
}

/// Reads mutations; returns how many were fine and how many were refused. A refusal has a place inside the text.
pub fn mutations<T>(
    seeds: &[Vec<u8>],
    count: usize,
    read: impl Fn(&[u8]) -> Option<Result<T, Error>>,
) -> (usize, usize) {
    let mut random = ChaCha8Rng::seed_from_u64(7);
    let (mut fine, mut refused) = (0, 0);
    for round in 0..count {
        let mut bytes = seeds[round % seeds.len()].clone();
        mutate(&mut bytes, &mut random);
        match read(&bytes) {
            None => {}
            Some(Ok(_)) => fine += 1,
            Some(Err(Error::Malformed { line, column, problem, .. })) => {
                let text = String::from_utf8_lossy(&bytes);
                let length = text.split('\n').nth(line - 1).map_or(0, |line| line.chars().count());
                assert!(line <= 1 + text.matches('\n').count(), "line {line} of\n{text}\n{problem}");
                assert!(
                    (1..=length + 1).contains(&column),
                    "column {column} of {length} in line {line} of\n{text}\n{problem}"
                );
                assert!(!problem.is_empty());
                refused += 1;
            }
            Some(Err(other)) => panic!("{other:?}"),
        }
    }
    (fine, refused)
}

#[test]
fn no_damage_to_a_rig_file_goes_without_a_place_or_brings_the_program_down() {
    let learned = {
        let mut rig = catalog::rig("ur5").unwrap();
        rig.estimate.fixed = vec!["robot".into(), "cameras.*.cx".into()];
        rig.estimate.prior.insert("cameras.left.fx".into(), 10.0);
        let sd = [("cameras.left.pose".to_owned(), vec![0.1; 6]), ("features.f0.xyz".to_owned(), vec![0.1; 3])];
        rig.fit = Some(handeye::rig::Fit { gauge: vec!["scale".into()], sd: sd.into(), ..Default::default() });
        rig.to_toml()
    };
    let mut seeds: Vec<Vec<u8>> = catalog::ALL.iter().map(|(_, text)| text.as_bytes().to_vec()).collect();
    // The learned one has every kind of table: half of the mutations are its.
    seeds.extend(std::iter::repeat_n(learned.into_bytes(), seeds.len()));
    let (fine, refused) = mutations(&seeds, 10_000, |bytes| {
        let text = std::str::from_utf8(bytes).ok()?;
        let rig = Rig::parse(text, "file");
        if let Ok(rig) = &rig {
            // What is read can be written, and stays what it is; and the damaged file can be updated.
            let again = Rig::parse(&rig.to_toml(), "again").unwrap_or_else(|error| panic!("{error}\n{text}"));
            assert_eq!(again.to_toml(), rig.to_toml());
            let mut changed = rig.clone();
            changed.noise.pixels += 0.125;
            changed.robot.base = Some(handeye::solvers::Pose::identity());
            let updated = changed.update_toml(text).unwrap();
            Rig::parse(&updated, "updated").unwrap_or_else(|error| panic!("{error}\n{text}\n{updated}"));
        }
        Some(rig)
    });
    assert!(fine > 1000 && refused > 3000, "{fine} fine and {refused} refused: the damage tests little");
}

#[test]
fn no_damage_to_a_recording_goes_without_a_place_or_brings_the_program_down() {
    let pose = r#"{"xyz":[0.5,-1e-3,2],"quat":[0,0,0.6,0.8]}"#;
    let text = format!(
        "{HEADER}\n{{\"time\":0.5,\"joints\":[0.1,-2e-3],\"pixels\":{{\"left\":{{\"f0\":[312.4,201.7],\"f10\":[340.0,222.1]}},\"right\":{{\"f2\":[1,2]}}}}}}\n\
         {{\"time\":1.5,\"pose\":{pose},\"joint_action\":[0,0.25],\"pose_action\":{pose},\"points\":{{\"left\":{{\"f0\":[1,2,3]}}}}}}\n\
         {{\"targets\":{{\"right\":{{\"täg\":{pose}}}}}}}\n"
    );
    let (fine, refused) = mutations(&[text.into_bytes()], 10_000, |bytes| {
        let recording = Recording::read_from(bytes, "file");
        if let Ok(recording) = &recording {
            let mut written = Vec::new();
            recording.write_to(&mut written).unwrap();
            let back = Recording::read_from(written.as_slice(), "again").unwrap();
            let mut again = Vec::new();
            back.write_to(&mut again).unwrap();
            assert!(written == again);
        }
        Some(recording)
    });
    assert!(fine > 100 && refused > 5000, "{fine} fine and {refused} refused: the damage tests little");
}

#[test]
fn no_damage_to_a_urdf_goes_without_a_place_or_brings_the_program_down() {
    let seeds = [crate::urdf::ARM.as_bytes().to_vec()];
    let (fine, refused) = mutations(&seeds, 10_000, |bytes| {
        let text = std::str::from_utf8(bytes).ok()?;
        let urdf = match Urdf::parse(text, "file") {
            Ok(urdf) => urdf,
            Err(error) => return Some(Err(error)),
        };
        let arm = urdf.arm("base_link", "tool0");
        if let Ok(arm) = &arm {
            let rig = Rig { robot: arm.clone().into(), ..Rig::default() };
            // A number far out of any arm's range need not come through.
            if let Err(error) = handeye::export::to_urdf(&rig, text, "file") {
                assert!(matches!(error, Error::Unusable(_)), "{error}");
            }
        }
        match arm {
            // The links are whole, and no arm: nothing of the text is wrong by itself.
            Err(Error::Unusable(_)) => None,
            arm => Some(arm),
        }
    });
    assert!(fine > 500 && refused > 1500, "{fine} fine and {refused} refused: the damage tests little");
}

#[test]
fn deeply_nested_xml_brings_nothing_down() {
    for text in
        ["<robot>".repeat(100_000), format!("<robot>{}", "<link name='a'>".repeat(100_000)), "<!--".repeat(100_000)]
    {
        assert!(matches!(Urdf::parse(&text, "deep"), Err(Error::Malformed { .. })));
    }
    let text = format!("{}{}", "<robot>".repeat(50_000), "</robot>".repeat(50_000));
    let _ = Urdf::parse(&text, "deep");
}
