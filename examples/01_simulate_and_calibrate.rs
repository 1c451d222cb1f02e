//! Simulates a robot before two cameras, learns it from the recording alone, and compares with the truth.
//!
//!     cargo run --release --example 01_simulate_and_calibrate
use handeye::calibrate::{Options, calibrate, evaluate};
use handeye::rig::{Rig, catalog};
use handeye::simulate::{SimulateOptions, simulate};
use std::ops::ControlFlow;

fn main() -> Result<(), handeye::Error> {
    let truth = catalog::rig("ur5")?;
    let record = |seed| simulate(&truth, &SimulateOptions { samples: 50, seed, ..SimulateOptions::default() });
    let (motions, fresh) = (record(1)?.recording, record(2)?.recording);

    let nothing = Rig::default();
    let learned = calibrate(&nothing, &motions, &Options::default(), &mut |_| ControlFlow::Continue(()))?;

    println!("                    rms px, 50 fresh samples");
    println!("the true rig        {:.3}", evaluate(&truth, &fresh)?.total.rms_px);
    println!("the learned rig     {:.3}", evaluate(&learned.rig, &fresh)?.total.rms_px);
    println!("the noise alone     {:.3}", truth.noise.pixels * 2.0_f64.sqrt());
    for line in &learned.report.gauge {
        println!("left open by the data: {line}");
    }
    Ok(())
}
