//! `handeye detect`: images as a recording.
use super::answer::Answer;
use super::inputs::check_output;
use super::reading::Reading;
use super::written::written;
use clap::{Args, ValueEnum};
use handeye::Error;
use handeye::detect::{Folder, Gray, Pattern, detect_in_folders};
use handeye::recording::{Format, Found, OpenOptions, Opened, Pairing, Recording, Rows};
use rayon::prelude::*;
use std::path::{Path, PathBuf};

/// Find the corners of tags and boards in images, and write them as a recording (JSON Lines)
///
/// Images are PNG or JPEG in a folder per camera, or compressed images (sensor_msgs/CompressedImage) in a ROS 2 bag. Where the robot was is in the
/// bag, or in a recording that --states names: its rows pair with the images in order, by name (a column `image` of a CSV file) or by time.
/// Images of several cameras that have the same name belong together.
///
/// Patterns: a family of tags (tag36h11, tag25h9, tag16h5, DICT_4X4_50 to DICT_7X7_1000), whose corners are called FAMILY:ID/CORNER, of AprilTags in
/// the order of their own detector (from the lower left against the clock), of the others in OpenCV's (from the upper left with the clock);
/// checkerboard=COLUMNSxROWS, of inner corners, which has to be seen whole; charuco=COLUMNSxROWS:FAMILY:RATIO, of squares, with the side of the
/// tags over that of the squares, in OpenCV's layout since 4.6. Corners of boards are called corner:ROW/COLUMN. A checkerboard whose columns and rows
/// are both even or both odd looks the same turned by half: its corner 0/0 is taken to be the higher one in every image.
#[derive(Args)]
#[command(after_help = "\
Examples:
  handeye detect images/left images/right --pattern tag36h11 --states joints.csv -o motions.jsonl
  handeye detect images --pattern checkerboard=9x6 --states joints.csv --pair time -o motions.jsonl
  handeye detect hand=shots --pattern charuco=7x5:DICT_5X5_100:0.75 --camera hand=hand.yaml --side 0.03 --states poses.csv -o motions.jsonl
  handeye detect images --pattern tag36h11 --states joints.csv --degrees --joints q1,q2,q3 -o motions.jsonl
  handeye detect motions.mcap --pattern tag36h11 --camera-topic /left/image_raw/compressed=left -o motions.jsonl")]
pub struct Detect {
    /// Folders of images, each of the camera that is named or called as the folder is; a folder of such folders; or a bag (.mcap)
    #[arg(value_name = "[CAMERA=]FOLDER|BAG", required = true)]
    images: Vec<String>,
    /// What to look for
    #[arg(long, value_name = "PATTERN", required = true)]
    pattern: Vec<String>,
    /// Where the robot was: a recording or a table
    #[arg(long, value_name = "FILE")]
    states: Option<PathBuf>,
    /// How images find their row of the states
    #[arg(long, value_name = "HOW", default_value = "order", requires = "states")]
    pair: How,
    /// The side of a tag, or of a board's squares [m]: writes the poses of targets too, of cameras whose intrinsics are known
    #[arg(long, value_name = "METRES", value_parser = metres)]
    side: Option<f64>,
    #[command(flatten)]
    reading: Reading,
    /// The recording to write
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum How {
    /// The first image with the first row
    Order,
    /// By the names that the rows have
    Name,
    /// By the times that the images are called, interpolated
    Time,
}

impl Detect {
    pub fn run(&self) -> Result<Answer, Error> {
        let inputs: Vec<PathBuf> = self.images.iter().map(PathBuf::from).chain(self.states.clone()).collect();
        check_output(&self.output, &inputs)?;
        let patterns = self.patterns()?;
        let is_bag = |file: &&Path| Format::of(file) == Format::Bag;
        if let Some(bag) = self.states.as_deref().filter(is_bag) {
            let bag = bag.display();
            return Err(Error::Unusable(format!(
                "--states {bag}: a bag says where the robot was at the stamps of its own images, which `handeye detect {bag}` looks at; for images \
                 in folders a table or a recording (JSON Lines) says it"
            )));
        }
        let images = self.images.iter().map(Path::new);
        let read: Vec<&Path> = images.filter(is_bag).chain(self.states.as_deref()).collect();
        let options = self.reading.options(&read)?;
        let (mut recording, mut notes) = match (&read[..], &self.images[..]) {
            ([bag], [_]) if self.states.is_none() => in_bag(bag, &patterns, &options)?,
            (read, _) if read.len() == usize::from(self.states.is_some()) => self.in_folders(&patterns, options)?,
            (bags, _) => {
                let bag = bags[0].display();
                return Err(Error::Unusable(format!(
                    "{bag}: a bag is looked at alone, with the states that it has itself: name no other images and no --states beside it"
                )));
            }
        };
        if recording.samples.is_empty() {
            return Err(Error::NotEnoughData(format!("no image shows {}", self.pattern.join(" or "))));
        }
        if let (Some(side), Some(pattern)) = (self.side, patterns.first()) {
            let (unclear, blind) = recording.add_targets(pattern, side);
            if unclear > 0 {
                notes.push(format!(
                    "{unclear} poses of targets are left out, since their mirror images fit hardly worse"
                ));
            }
            if !blind.is_empty() {
                let cameras = blind.join(", ");
                notes.push(format!(
                    "no targets of cameras without intrinsics: {cameras} (--camera NAME=FILE gives them)"
                ));
            }
        }
        if patterns.iter().any(Pattern::is_ambiguous) {
            notes.push(
                "this checkerboard looks the same turned by half: corner 0/0 is the higher one in each image, which has to be the same corner in all"
                    .to_owned(),
            );
        }
        recording.write(&self.output)?;
        Ok(written(&self.output, &recording, &notes))
    }

    fn patterns(&self) -> Result<Vec<Pattern>, Error> {
        let parse = |text: &String| {
            Pattern::parse(text).map_err(|problem| Error::Unusable(format!("--pattern {text}: {problem}")))
        };
        let patterns: Vec<Pattern> = self.pattern.iter().map(parse).collect::<Result<_, _>>()?;
        let boards = patterns.iter().filter(|pattern| !matches!(pattern, Pattern::Tags(_))).count();
        if boards > 1 || (self.side.is_some() && patterns.len() > 1) {
            let problem = "--pattern: corners of two boards would have the same names, and --side is of one pattern";
            return Err(Error::Unusable(problem.to_owned()));
        }
        Ok(patterns)
    }

    fn in_folders(&self, patterns: &[Pattern], options: OpenOptions) -> Result<(Recording, Vec<String>), Error> {
        let mut folders = Vec::new();
        for image in &self.images {
            let named = image.split_once('=').filter(|_| !Path::new(image).exists());
            let (camera, folder) = named.map_or((None, image.as_str()), |(camera, folder)| (Some(camera), folder));
            folders.extend(Folder::open(Path::new(folder), camera)?);
        }
        // What is known of cameras is known of those of the images, which may be of some rows alone.
        let OpenOptions { cameras: known, still, .. } = options.clone();
        let of_states = OpenOptions { cameras: Vec::new(), still: false, ..options };
        let states = self.states.as_ref().map(|path| Recording::open_with(path, &of_states)).transpose()?;
        let (cameras, seen) = detect_in_folders(&folders, patterns)?;
        let pairing = match self.pair {
            How::Order => Pairing::Order,
            How::Name => Pairing::Name,
            How::Time => Pairing::Time,
        };
        let rows = states.as_ref().map(|opened| Rows { states: &opened.recording, names: &opened.images, pairing });
        let images = self.images.join(", ");
        let place = self.states.as_ref().map_or(images.clone(), |states| format!("{images} and {}", states.display()));
        let (mut recording, mut notes) = Recording::from_images(cameras, &seen, rows)
            .map_err(|problem| Error::Unusable(format!("{place}: {problem}")))?;
        recording.describe_cameras(&known).map_err(|problem| Error::Unusable(format!("--camera: {problem}")))?;
        notes.extend(states.into_iter().flat_map(|Opened { notes, .. }| notes));
        if still {
            recording = recording.still().map_err(|problem| Error::Unusable(format!("{place}: {problem}")))?;
        }
        Ok((recording, notes))
    }
}

fn in_bag(path: &Path, patterns: &[Pattern], options: &OpenOptions) -> Result<(Recording, Vec<String>), Error> {
    let look = |bytes: &&[u8]| {
        let image = Gray::decode(bytes)?;
        let features = patterns.iter().flat_map(|pattern| pattern.detect(&image)).collect();
        Ok(Found { size: image.size(), features })
    };
    let mut detect = |images: &[&[u8]]| images.par_iter().map(look).collect::<Vec<Result<_, String>>>();
    let Opened { recording, notes, .. } = Recording::detect_with(path, options, &mut detect)?;
    Ok((recording, notes))
}

fn metres(text: &str) -> Result<f64, String> {
    match text.parse() {
        Ok(metres) if metres > 0.0 && f64::is_finite(metres) => Ok(metres),
        _ => Err("must be a number of metres above 0".to_owned()),
    }
}
