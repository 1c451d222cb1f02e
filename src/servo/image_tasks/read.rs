//! Reading task files, with a place for every mistake.
use super::{
    Feature, ImageTask, Kind, LineAngle, LineToLine, ParallelLines, Part, Place, PointToConic, PointToLine,
    PointToPoint, PointToPoint3d, Trackers, line_angle, line_to_line, parallel_lines, point_to_conic, point_to_line,
    point_to_point,
};
use crate::Error;
use crate::error::suggestion;
use crate::rig::read::document::{Fields, Node, Source, parse};
use crate::rig::read::named::read_named;
use crate::rig::{problem_of_name, read_text};
use std::path::Path;

impl ImageTask {
    /// Reads a task file.
    ///
    /// Errors: [`Error::Io`], and [`Error::Malformed`] for whatever is wrong inside.
    pub fn read(path: &Path) -> Result<ImageTask, Error> {
        ImageTask::parse(&read_text(path)?, &path.display().to_string())
    }

    /// Reads the text of a task file, which messages call `file_name`.
    pub fn parse(text: &str, file_name: &str) -> Result<ImageTask, Error> {
        let source = Source { file: file_name, text };
        let document = parse(&source)?;
        ImageTask::of_node(Node::root(&source, document.as_table()))
    }

    /// A whole task, as a file or as a table of another.
    pub(crate) fn of_node(node: Node) -> Result<ImageTask, Error> {
        let root = node.table(&["name", "cameras", "noise", "features", "tasks"])?;
        let listed = root.field("cameras").ok_or_else(|| root.error("has no `cameras` (their names)"))?.value;
        let cameras = read_cameras(&listed)?;
        let features = root.field("features").map(|field| field.value);
        let features = read_named(features.as_ref(), "feature", &["name", "on", "xyz", "pixels"], problem_of_name)?
            .into_iter()
            .map(|(name, fields)| Ok(Feature { place: read_place(&fields, &cameras)?, name }))
            .collect::<Result<Vec<_>, Error>>()?;
        let list = root.field("tasks").ok_or_else(|| root.error("has no [[tasks]], which say what shall meet what"))?;
        let names = Names { cameras: &cameras, features: &features };
        let parts = list.value.list()?.into_iter().enumerate().map(|(index, node)| names.read_part(node, index));
        let parts = parts.collect::<Result<Vec<_>, Error>>()?;
        let trackers = root.optional("noise", read_noise)?.unwrap_or_default();
        let name = root.optional("name", |node| node.text().map(str::to_owned))?;
        ImageTask::new(name, cameras, features, parts, trackers).map_err(|error| list.value.error(error))
    }
}

/// What a file has named so far.
struct Names<'a> {
    cameras: &'a [String],
    features: &'a [Feature],
}

impl Names<'_> {
    fn problem(&self, part: &Part) -> Option<String> {
        ImageTask::problem_of(part, self.cameras, self.features)
    }

    fn read_part(&self, node: Node, index: usize) -> Result<Part, Error> {
        let known =
            ["kind", "cameras", "point", "line", "to", "conic", "angle_deg", "directed", "px_per_metre"].as_slice();
        let fields = node.table(known)?.labelled(format!("task {}", index + 1));
        let word = fields
            .field("kind")
            .ok_or_else(|| fields.error(format!("has no `kind` (known: {})", Kind::NAMES.join(", "))))?;
        let word = word.value.word("kind", Kind::NAMES, |name| name)?;
        let takes: &[&str] = match word {
            point_to_point::NAME => &["point", "to"],
            point_to_line::NAME => &["point", "line"],
            line_to_line::NAME => &["line", "to"],
            parallel_lines::NAME => &["line", "to", "directed"],
            line_angle::NAME => &["line", "angle_deg", "directed"],
            point_to_conic::NAME => &["point", "conic"],
            _ => &["point", "to", "px_per_metre"],
        };
        let is_strange = |key: &str| !takes.contains(&key) && key != "kind" && key != "cameras";
        if let Some(field) = fields.iter().find(|field| is_strange(field.key)) {
            return Err(field.value.error(format!("a {word} takes {}", takes.join(", "))));
        }
        let need = |key: &str| fields.field(key).ok_or_else(|| fields.error(format!("a {word} needs `{key}`")));
        let point = |key: &str| self.feature(&need(key)?.value);
        let line = |key: &str| self.line(&need(key)?.value);
        let directed = || fields.optional("directed", Node::flag).map(|flag| flag.unwrap_or(false));
        let kind = match word {
            point_to_point::NAME => Kind::PointToPoint(PointToPoint { point: point("point")?, to: point("to")? }),
            point_to_line::NAME => Kind::PointToLine(PointToLine { point: point("point")?, line: line("line")? }),
            line_to_line::NAME => Kind::LineToLine(LineToLine { line: line("line")?, to: line("to")? }),
            parallel_lines::NAME => {
                Kind::ParallelLines(ParallelLines { line: line("line")?, to: line("to")?, directed: directed()? })
            }
            line_angle::NAME => {
                let angle = need("angle_deg")?.value.number()?.to_radians();
                Kind::LineAngle(LineAngle { line: line("line")?, angle, directed: directed()? })
            }
            point_to_conic::NAME => {
                let conic = need("conic")?.value.list()?;
                let conic = conic.iter().map(|node| self.feature(node)).collect::<Result<_, _>>()?;
                Kind::PointToConic(PointToConic { point: point("point")?, conic })
            }
            _ => {
                let px_per_metre = need("px_per_metre")?.value.positive()?;
                Kind::PointToPoint3d(PointToPoint3d { point: point("point")?, to: point("to")?, px_per_metre })
            }
        };
        let cameras = match fields.field("cameras") {
            Some(field) => field.value.list()?.iter().map(|node| self.camera(node)).collect::<Result<Vec<_>, _>>()?,
            None => (0..self.cameras.len()).collect(),
        };
        let part = Part { kind, cameras };
        self.problem(&part).map_or(Ok(part), |problem| Err(fields.error(problem)))
    }

    fn line(&self, node: &Node) -> Result<[usize; 2], Error> {
        match node.list()?.as_slice() {
            [from, to] => Ok([self.feature(from)?, self.feature(to)?]),
            other => Err(node.error(format!("a line goes through 2 features, found {}", other.len()))),
        }
    }

    fn feature(&self, node: &Node) -> Result<usize, Error> {
        let name = node.text()?;
        let found = self.features.iter().position(|feature| feature.name == name);
        found.ok_or_else(|| {
            let known = self.features.iter().map(|feature| feature.name.as_str());
            node.error(format!("no feature is called `{name}` {}", suggestion(name, known)))
        })
    }

    fn camera(&self, node: &Node) -> Result<usize, Error> {
        camera_of(node.text()?, self.cameras).map_err(|problem| node.error(problem))
    }
}

fn camera_of(name: &str, cameras: &[String]) -> Result<usize, String> {
    let found = cameras.iter().position(|camera| camera == name);
    found
        .ok_or_else(|| format!("no camera is called `{name}` {}", suggestion(name, cameras.iter().map(String::as_str))))
}

fn read_cameras(node: &Node) -> Result<Vec<String>, Error> {
    let mut cameras: Vec<String> = Vec::new();
    for entry in node.list()? {
        let name = entry.text()?;
        if let Some(problem) = problem_of_name(name) {
            return Err(entry.error(problem));
        }
        if cameras.iter().any(|camera| camera == name) {
            return Err(entry.error(format!("another camera is called `{name}`")));
        }
        cameras.push(name.to_owned());
    }
    if cameras.is_empty() { Err(node.error("a task needs a camera")) } else { Ok(cameras) }
}

fn read_place(fields: &Fields, cameras: &[String]) -> Result<Place, Error> {
    let word = fields.field("on").ok_or_else(|| fields.error("has no `on` (hand, target or image)"))?;
    let word = word.value.word("place", Place::NAMES, |name| name)?;
    let strange = if word == "image" { "xyz" } else { "pixels" };
    if let Some(field) = fields.field(strange) {
        return Err(field
            .value
            .error(format!("is for features on {}", if word == "image" { "hand or target" } else { "image" })));
    }
    let xyz = fields.optional("xyz", |node| node.numbers::<3>().map(Into::into))?;
    match word {
        "hand" => Ok(Place::Hand(xyz)),
        "target" => Ok(Place::Target(xyz)),
        _ => {
            let given = fields
                .field("pixels")
                .ok_or_else(|| fields.error("is on the image and has no `pixels`, such as { left = [320, 240] }"))?;
            let mut pixels = vec![[f64::NAN; 2]; cameras.len()];
            for field in given.value.any_table()?.iter() {
                let camera = camera_of(field.key, cameras).map_err(|problem| field.value.error(problem))?;
                pixels[camera] = field.value.numbers()?;
            }
            Ok(Place::Image(pixels))
        }
    }
}

fn read_noise(node: &Node) -> Result<Trackers, Error> {
    let fields = node.clone().table(&["pixels", "points"])?.labelled("noise");
    let default = Trackers::default();
    Ok(Trackers {
        pixels: fields.optional("pixels", Node::not_negative)?.unwrap_or(default.pixels),
        points: fields.optional("points", Node::not_negative)?.unwrap_or(default.points),
    })
}
