//! How time and memory of `calibrate` from nothing grow with the recording: CPU time, peak memory, and the bytes learned with
//! one thread and with two.
//!
//! `cargo bench --bench scale -- [SAMPLES]...`
use cpu_time::ProcessTime;
use handeye::calibrate::{Options, calibrate};
use handeye::rig::Rig;
use handeye::simulate::{SimulateOptions, random_rig, simulate};
use std::ops::ControlFlow;

fn main() {
    let sizes: Vec<usize> = std::env::args().skip(1).filter_map(|argument| argument.parse().ok()).collect();
    let sizes = if sizes.is_empty() { vec![50, 2_000, 20_000] } else { sizes };
    let truth = random_rig(6, 2, 12, 1);
    println!(
        "{:>8} {:>12} {:>12} {:>12} {:>10}  two threads",
        "samples", "CPU s, one", "ms / sample", "peak MB", "rms px"
    );
    for samples in sizes {
        let options = SimulateOptions { samples, seed: 7, ..Default::default() };
        let recording = simulate(&truth, &options).expect("the rig is complete and in view").recording;
        let rig = Rig { noise: truth.noise, ..Rig::default() };
        let learn = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads can be started");
            let start = ProcessTime::now();
            let learned = pool.install(|| {
                calibrate(&rig, &recording, &Options::default(), &mut |_| ControlFlow::Continue(()))
                    .expect("there is enough data")
            });
            (start.elapsed().as_secs_f64(), learned)
        };
        let (seconds, one) = learn(1);
        let (_, two) = learn(2);
        let same = one.rig.to_toml() == two.rig.to_toml();
        println!(
            "{samples:8} {seconds:12.3} {:12.4} {:12.0} {:10.4}  {}",
            1e3 * seconds / samples as f64,
            peak_megabytes(),
            one.report.rms_px,
            if same { "the same bytes" } else { "OTHER BYTES" },
        );
        if std::env::var_os("HANDEYE_STAGES").is_some() {
            for stage in &one.report.stages {
                println!("    {stage:?}");
            }
        }
    }
}

/// Most memory that the process has held.
fn peak_megabytes() -> f64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:")).unwrap_or("0");
    line.trim().trim_end_matches(" kB").parse::<f64>().unwrap_or(f64::NAN) / 1e3
}
