//! How fast bags are read, and in how much memory: messages a second of CPU time, the peak, and its part of the bag's size.
//!
//! `cargo bench --bench bags -- [MEGABYTES]`
//!
//! A UR5 publishes its joint states; two cameras publish their intrinsics and the tags that they see, 30 times a second. Each bag is
//! written to the folder for temporary files and read by a process of its own, which is asked for its peak. The second bag has as many
//! samples as the first and four times the bytes: what it takes more is not due to its samples.
use cpu_time::ProcessTime;
use handeye::recording::{OpenOptions, Recording};
use mcap::records::MessageHeader;
use mcap::{Compression, WriteOptions};
use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

#[path = "common/cdr.rs"]
mod cdr;

use cdr::Cdr;

const JOINTS: [&str; 6] =
    ["shoulder_pan_joint", "shoulder_lift_joint", "elbow_joint", "wrist_1_joint", "wrist_2_joint", "wrist_3_joint"];
const CAMERAS: [&str; 2] = ["left", "right"];
const TAGS: u32 = 6;
const HEADER: &str = "std_msgs/Header header\n";
const PARTS: &str = "================================================================================\n\
    MSG: std_msgs/Header\nbuiltin_interfaces/Time stamp\nstring frame_id\n\
    ================================================================================\n\
    MSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n";
const STATE: &str = "string[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n";
const INFO: &str =
    "uint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\nfloat64[9] k\nfloat64[9] r\nfloat64[12] p\n";
const ARRAY: &str = "apriltag_msgs/AprilTagDetection[] detections\n";
const ARRAY_PARTS: &str = "================================================================================\n\
    MSG: apriltag_msgs/AprilTagDetection\nstring family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\n\
    apriltag_msgs/Point centre\napriltag_msgs/Point[4] corners\nfloat64[9] homography\n\
    ================================================================================\n\
    MSG: apriltag_msgs/Point\nfloat64 x\nfloat64 y\n";

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| argument != "--bench").collect();
    if let [command, path] = &arguments[..]
        && command == "read"
    {
        return read(Path::new(path));
    }
    let megabytes = arguments.first().and_then(|argument| argument.parse().ok()).unwrap_or(1000.0);
    println!(
        "{:>30} {:>7} {:>10} {:>8} {:>7} {:>7} {:>14} {:>8} {:>9}",
        "joint states", "MB", "messages", "samples", "s", "CPU s", "messages/CPU s", "peak MB", "of size"
    );
    let path = std::env::temp_dir().join(format!("handeye-bags-{}.mcap", std::process::id()));
    let seconds = 1e6 * megabytes / bytes_per_second(500.0);
    for (name, compression, hertz, seconds) in [
        ("500 Hz, a quarter of the time", None, 500.0, 0.25 * seconds),
        ("2.6 kHz, a quarter of the time", None, 2600.0, 0.25 * seconds),
        ("500 Hz", None, 500.0, seconds),
        ("500 Hz, zstd", Some(Compression::Zstd), 500.0, seconds),
        ("500 Hz, lz4", Some(Compression::Lz4), 500.0, seconds),
    ] {
        let file = BufWriter::new(File::create(&path).expect("the folder for temporary files can be written"));
        let messages = write(file, compression, hertz, seconds);
        let size = std::fs::metadata(&path).map_or(0, |data| data.len()) as f64 / 1e6;
        let program = std::env::current_exe().expect("the program knows itself");
        let output = Command::new(program).arg("read").arg(&path).output().expect("the program can be started");
        let text = String::from_utf8_lossy(&output.stdout);
        let numbers: Vec<f64> = text.split_whitespace().filter_map(|number| number.parse().ok()).collect();
        let &[samples, wall, cpu, peak] = &numbers[..] else {
            panic!("{}", String::from_utf8_lossy(&output.stderr));
        };
        let (rate, part) = (f64::from(messages) / cpu, peak / size);
        println!(
            "{name:>30} {size:7.0} {messages:10} {samples:8} {wall:7.2} {cpu:7.2} {rate:14.0} {peak:8.0} {part:9.2}"
        );
    }
    std::fs::remove_file(&path).expect("the bag can be removed");
}

/// Of a bag without compression, nearly, with joint states at this rate [Hz].
fn bytes_per_second(hertz: f64) -> f64 {
    374.0 * hertz + 30.0 * 2.0 * (1326.0 + 442.0)
}

/// Reads a bag and prints samples, seconds, seconds of CPU and the peak [MB].
fn read(path: &Path) {
    let (start, cpu) = (Instant::now(), ProcessTime::now());
    let bag = Recording::open_with(path, &OpenOptions::default()).expect("the bag is whole");
    let (wall, cpu) = (start.elapsed().as_secs_f64(), cpu.elapsed().as_secs_f64());
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
    let peak = line.trim().trim_end_matches(" kB").parse::<f64>().unwrap_or(f64::NAN) / 1e3;
    println!("{} {wall} {cpu} {peak}", bag.recording.samples.len());
}

/// Writes what is recorded in a time [s] with joint states at a rate [Hz], and says how many messages that are.
fn write(file: BufWriter<File>, compression: Option<Compression>, hertz: f64, seconds: f64) -> u32 {
    let mut writer = WriteOptions::new().compression(compression).create(file).expect("a bag can be begun");
    let mut channel = |topic: &str, kind: &str, text: String| {
        let schema = writer.add_schema(kind, "ros2msg", text.as_bytes()).expect("the schema is new");
        writer.add_channel(schema, topic, "cdr", &BTreeMap::new()).expect("the channel is new")
    };
    let joints = channel("/joint_states", "sensor_msgs/msg/JointState", format!("{HEADER}{STATE}{PARTS}"));
    let cameras = CAMERAS.map(|name| {
        let array = format!("{HEADER}{ARRAY}{PARTS}{ARRAY_PARTS}");
        [
            channel(&format!("/{name}/camera_info"), "sensor_msgs/msg/CameraInfo", format!("{HEADER}{INFO}{PARTS}")),
            channel(&format!("/{name}/tags"), "apriltag_msgs/msg/AprilTagDetectionArray", array),
        ]
    });
    let mut messages = 0;
    let mut put = |channel_id: u16, time: u64, cdr: Cdr| {
        let header = MessageHeader { channel_id, sequence: messages, log_time: time, publish_time: time };
        messages += 1;
        writer.write_to_known_channel(&header, &cdr.bytes).expect("the bag can be written");
    };
    let mut noise = Noise(1);
    let mut images = 0.0;
    for index in 0..(seconds * hertz) as u64 {
        let time = (1e9 * index as f64 / hertz) as u64;
        put(joints, time, joint_state(time, &mut noise));
        while images / 30.0 <= index as f64 / hertz {
            for (name, [info, tags]) in CAMERAS.iter().zip(cameras) {
                put(info, time, camera_info(time, name));
                put(tags, time, tags_seen(time, name, &mut noise));
            }
            images += 1.0;
        }
    }
    writer.finish().expect("the bag can be ended");
    messages
}

fn joint_state(time: u64, noise: &mut Noise) -> Cdr {
    let mut cdr = Cdr::stamped(time, "base_link");
    cdr.int(JOINTS.len() as u32);
    JOINTS.iter().for_each(|name| cdr.text(name));
    for _ in 0..3 {
        cdr.int(JOINTS.len() as u32);
        (0..JOINTS.len()).for_each(|joint| cdr.float((1e-9 * time as f64 + joint as f64).sin() + 1e-4 * noise.next()));
    }
    cdr
}

fn camera_info(time: u64, frame: &str) -> Cdr {
    let mut cdr = Cdr::stamped(time, frame);
    cdr.int(480);
    cdr.int(640);
    cdr.text("plumb_bob");
    cdr.int(5);
    (0..5).for_each(|_| cdr.float(0.0));
    [600.0, 0.0, 319.5, 0.0, 600.0, 239.5, 0.0, 0.0, 1.0].iter().for_each(|number| cdr.float(*number));
    (0..21).for_each(|_| cdr.float(0.0));
    cdr
}

fn tags_seen(time: u64, frame: &str, noise: &mut Noise) -> Cdr {
    let mut cdr = Cdr::stamped(time, frame);
    cdr.int(TAGS);
    for tag in 0..TAGS {
        cdr.text("tag36h11");
        cdr.int(tag);
        (0..3).for_each(|_| cdr.int(0));
        (0..19).for_each(|number| cdr.float(300.0 + 40.0 * f64::from(number) + noise.next()));
    }
    cdr
}

/// Numbers of -1 to 1 that do not compress.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}
