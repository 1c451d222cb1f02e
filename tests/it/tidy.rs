//! The rules of ARCHITECTURE.md, each with what to do instead.
use std::fs;
use std::path::{Path, PathBuf};

/// Modules of `src/`, each of which may use those of the ranks before its own. `error` is everybody's.
const ORDER: &[&[&str]] = &[
    &["error"],
    &["geometry", "camera", "chain", "svg"],
    &["urdf", "intrinsics"],
    &["rig"],
    &["export"],
    &["recording"],
    &["detect"],
    &["reach"],
    &["simulate"],
    &["factors"],
    &["calibrate"],
    &["doctor"],
    &["online"],
    &["infer"],
    &["servo"],
    &["scene"],
    &["report"],
    &["experiments"],
    &["cli"],
];

/// Crates that only `solvers/` knows of.
const INSIDE_SOLVERS: &[&str] = &["faer", "clarabel", "argmin", "argmin_math", "num_dual"];

/// A Rust file of the repository: its path from the root with `/`, and its text.
struct Source {
    path: String,
    text: String,
}

impl Source {
    /// Lines that are no comments, numbered from 1, without what follows `//`; without test modules where `tests` is false.
    fn code(&self, tests: bool) -> impl Iterator<Item = (usize, &str)> {
        let end = if tests { None } else { self.text.find("\n#[cfg(test)]\nmod ") };
        // A test module stands last in its file, or is a file of its own.
        let text =
            if !tests && self.path.ends_with("_tests.rs") { "" } else { &self.text[..end.unwrap_or(self.text.len())] };
        let code = text.lines().map(|line| line.find("//").map_or(line, |start| &line[..start]));
        code.enumerate().map(|(index, line)| (index + 1, line))
    }

    fn is_in(&self, folders: &[&str]) -> bool {
        folders.iter().any(|folder| self.path.starts_with(folder))
    }

    /// The module of `src/` that the file belongs to.
    fn module(&self) -> Option<&str> {
        let path = self.path.strip_prefix("src/")?;
        Some(path.split('/').next()?.trim_end_matches(".rs"))
    }
}

fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Folders and files below a folder, by path from the root; without what is built and what is hidden.
fn walk(folder: &Path, folders: &mut Vec<String>, files: &mut Vec<String>) {
    let mut entries: Vec<PathBuf> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    entries.sort();
    for path in entries {
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        let from_root = path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/");
        if name == "target" || name == "__pycache__" || (name.starts_with('.') && name != ".ci") {
            continue;
        }
        if path.is_dir() {
            folders.push(format!("{from_root}/"));
            walk(&path, folders, files);
        } else {
            files.push(from_root);
        }
    }
}

fn sources() -> Vec<Source> {
    let mut files = Vec::new();
    walk(&root(), &mut Vec::new(), &mut files);
    let read = |path: String| Source { text: fs::read_to_string(root().join(&path)).unwrap(), path };
    files.into_iter().filter(|path| path.ends_with(".rs")).map(read).collect()
}

/// Identifiers of a line of code.
fn identifiers(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !c.is_alphanumeric() && c != '_').filter(|word| !word.is_empty())
}

/// Words that identifiers are made of, in lower case: `WorldFromCamera` and `world_from_camera` have three.
fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    let mut was_lower = false;
    for c in line.chars() {
        if !c.is_alphanumeric() || (was_lower && c.is_uppercase()) {
            words.push(String::new());
        }
        if c.is_alphanumeric() {
            words.last_mut().unwrap().extend(c.to_lowercase());
        }
        was_lower = c.is_lowercase();
    }
    words
}

/// Fails with every place where a rule is broken, and what to do instead.
fn none(broken: Vec<String>, instead: &str) {
    assert!(broken.is_empty(), "{instead}:\n  {}\n", broken.join("\n  "));
}

/// Places in code where a line breaks a rule.
fn places(source: &Source, tests: bool, breaks: impl Fn(&str) -> bool) -> Vec<String> {
    let lines = source.code(tests).filter(|(_, line)| breaks(line));
    lines.map(|(number, line)| format!("{}:{number}: {}", source.path, line.trim())).collect()
}

#[test]
fn solvers_know_no_robot_and_touch_no_file() {
    const ROBOTICS: &[&str] = &["robot", "robots", "camera", "cameras", "rig", "rigs", "pixel", "pixels"];
    const OUTSIDE: &[&str] = &["path", "fs", "io", "env", "net", "process", "println", "eprintln", "print", "stdin"];
    let breaks = |line: &str| {
        words(line).iter().any(|word| ROBOTICS.contains(&word.as_str()) || OUTSIDE.contains(&word.as_str()))
    };
    let solvers = sources().into_iter().filter(|source| source.is_in(&["solvers/src/"]));
    none(
        solvers.flat_map(|source| places(&source, false, breaks)).collect(),
        "solvers/ minimises anybody's problem and does no input or output: name it after the mathematics, or put it in \
         src/factors/ or src/calibrate/",
    );
}

#[test]
fn solver_crates_stay_inside_solvers() {
    let is_inside = |word: &str| INSIDE_SOLVERS.contains(&word);
    let sources = sources();
    let outside = sources.iter().filter(|source| !source.is_in(&["solvers/"]) && source.path != "tests/it/tidy.rs");
    none(
        outside.flat_map(|source| places(source, true, |line| identifiers(line).any(is_inside))).collect(),
        "faer, clarabel, argmin and num-dual are solvers/'s own: use what handeye_solvers offers, or add it there",
    );
    // The scalar trait is what residuals are written over, and num-dual's numbers are its instances.
    let public = |line: &str| line.trim_start().starts_with("pub ") && identifiers(line).any(is_inside);
    let solvers = sources.iter().filter(|s| s.is_in(&["solvers/src/"]) && s.path != "solvers/src/scalar.rs");
    none(
        solvers.flat_map(|source| places(source, true, public)).collect(),
        "public signatures of solvers/ speak nalgebra and its own types, so that their crates can be replaced: wrap it",
    );
    let manifest = fs::read_to_string(root().join("Cargo.toml")).unwrap();
    let names = |line: &str| INSIDE_SOLVERS.iter().any(|name| line.starts_with(&name.replace('_', "-")));
    none(
        manifest.lines().filter(|line| names(line)).map(str::to_owned).collect(),
        "these belong into solvers/Cargo.toml alone",
    );
}

#[test]
fn modules_use_only_what_stands_to_their_left() {
    let rank = |module: &str| ORDER.iter().position(|modules| modules.contains(&module));
    let mut broken = Vec::new();
    for source in sources() {
        let Some(module) = source.module().filter(|module| !["lib", "main"].contains(module)) else { continue };
        let Some(own) = rank(module) else {
            broken.push(format!("{}: the module `{module}` has no place in ORDER of tests/it/tidy.rs", source.path));
            continue;
        };
        for (number, statement) in statements(&source) {
            for used in uses(&statement) {
                if used != module && rank(used).is_some_and(|rank| rank >= own) {
                    broken.push(format!("{}:{number}: {module} uses {used}", source.path));
                }
            }
        }
    }
    none(
        broken,
        "a module of src/ may use those to its left alone (geometry camera chain svg -> urdf intrinsics -> rig -> export -> recording -> \
         reach -> simulate -> factors -> calibrate -> doctor -> online -> infer -> servo -> scene -> report -> experiments -> cli): move what is \
         shared to the left, or pass it in",
    );
}

/// Lines of code, those of a `use` in several lines joined, with the number of the first.
fn statements(source: &Source) -> Vec<(usize, String)> {
    let mut statements: Vec<(usize, String)> = Vec::new();
    for (number, line) in source.code(true) {
        match statements.last_mut() {
            Some((_, last)) if last.contains("use ") && last.contains('{') && !last.contains(';') => {
                *last += line.trim()
            }
            _ => statements.push((number, line.to_owned())),
        }
    }
    statements
}

/// Modules of the crate that a line names after `crate::` or `handeye::`, in braces too.
fn uses(line: &str) -> Vec<&str> {
    let mut found = Vec::new();
    for root in ["crate::", "handeye::"] {
        for (start, _) in line.match_indices(root) {
            let rest = &line[start + root.len()..];
            match rest.strip_prefix('{') {
                None => found.extend(identifiers(rest).next()),
                Some(list) => {
                    let mut depth = 0;
                    let parts = list.split(|c: char| {
                        depth += i32::from(c == '{') - i32::from(c == '}');
                        c == ',' && depth == 0
                    });
                    found.extend(parts.filter_map(|part| identifiers(part).next()));
                }
            }
        }
    }
    found
}

#[test]
fn only_the_command_line_prints_and_exits() {
    const TALK: &[&str] =
        &["println!", "eprintln!", "print!", "eprint!", "dbg!", "process::exit", "stdout()", "stderr()"];
    let breaks = |line: &str| TALK.iter().any(|word| line.contains(word));
    let library = sources()
        .into_iter()
        .filter(|source| source.is_in(&["src/", "solvers/src/", "python/src/"]) && !source.is_in(&["src/cli/"]));
    none(
        library.flat_map(|source| places(&source, false, breaks)).collect(),
        "a library does not talk: return it (a report, an error), and print it in src/cli/",
    );
}

#[test]
fn nothing_depends_on_the_order_of_a_hash_map() {
    let breaks = |line: &str| identifiers(line).any(|word| word == "HashMap" || word == "HashSet");
    let others = sources().into_iter().filter(|source| !source.is_in(&["tests/", "solvers/tests/"]));
    none(
        others.flat_map(|source| places(&source, false, breaks)).collect(),
        "the same input gives the same bytes: use BTreeMap, BTreeSet or a sorted Vec",
    );
}

#[test]
fn every_file_begins_with_what_it_is() {
    let silent = sources().into_iter().filter(|source| !source.text.starts_with("//! "));
    none(silent.map(|source| source.path).collect(), "begin the file with a sentence in `//! ` on what it is for");
}

#[test]
fn generic_code_keeps_away_from_what_loses_derivatives() {
    const LOSSY: &[&str] = &["from_scaled_axis", "scaled_axis", ".angle("];
    let is_generic =
        |source: &Source| source.code(false).any(|(_, line)| identifiers(line).any(|word| word == "Scalar"));
    let breaks = |line: &str| LOSSY.iter().any(|word| line.contains(word));
    let generic = sources().into_iter().filter(|source| source.is_in(&["src/", "solvers/src/"]) && is_generic(source));
    none(
        generic.flat_map(|source| places(&source, false, breaks)).collect(),
        "on dual numbers nalgebra loses the derivative at zero here, in silence: use handeye_solvers::manifold::so3",
    );
}

#[test]
fn the_map_names_every_folder_and_no_other() {
    let (mut folders, mut files) = (Vec::new(), Vec::new());
    walk(&root(), &mut folders, &mut files);
    folders.retain(|folder| files.iter().any(|file| file.starts_with(folder.as_str())));
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap();
    let map = text.split("```").nth(1).expect("ARCHITECTURE.md has a map between ``` and ```");
    let named: Vec<&str> =
        map.lines().filter_map(|line| line.split_whitespace().next()).filter(|path| path.ends_with('/')).collect();
    let missing = folders.iter().filter(|folder| !named.contains(&folder.as_str()));
    let gone = named.iter().filter(|path| !folders.iter().any(|folder| folder == *path));
    none(
        missing
            .map(|folder| format!("{folder} is not in the map"))
            .chain(gone.map(|path| format!("{path} is in the map and nowhere else")))
            .collect(),
        "the map in ARCHITECTURE.md has one line per folder, with what it is for",
    );
}

#[test]
fn the_rules_see_what_they_are_for() {
    assert_eq!(words("let WorldFromCamera = rig_file"), ["let", "world", "from", "camera", "", "", "rig", "file"]);
    assert_eq!(uses("use crate::{calibrate::{self, Options}, rig::Rig};"), ["calibrate", "rig"]);
    assert_eq!(uses("let x = crate::recording::join(handeye::cli::y);"), ["recording", "cli"]);
    let text =
        "//! x\nuse crate::{\n    servo,\n    Error,\n};\nlet a = 1; // crate::cli\n#[cfg(test)]\nmod tests {}\n";
    let source = Source { path: "src/rig/x.rs".to_owned(), text: text.to_owned() };
    let used: Vec<String> = statements(&source).iter().flat_map(|(_, line)| uses(line)).map(str::to_owned).collect();
    assert_eq!((source.module(), used), (Some("rig"), vec!["servo".to_owned(), "Error".to_owned()]));
    assert_eq!(source.code(false).count(), 6);
}
