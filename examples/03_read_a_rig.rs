//! Reads a rig file, says what is known of it, predicts a pixel, and shows what a mistake in a file looks like.
//!
//!     cargo run --release --example 03_read_a_rig
use handeye::rig::{Model, Rig};

const RIG: &str = r#"
[[robot.joints]]
name = "pan"
offset = 0.0
d = 0.3
a = 0.2
alpha = 1.5707963267948966

[[cameras]]
name = "left"
size = [640, 480]
fx = 600.0
fy = 600.0
cx = 319.5
cy = 239.5
pose = { xyz = [1.5, 0.0, 0.3], quat = [0.5, 0.5, -0.5, -0.5] }

[[features]]
name = "corner"
xyz = [0.0, 0.05, 0.0]

[estimate]
fixed = ["cameras.*.cx", "cameras.*.cy"]
"#;

fn main() -> Result<(), handeye::Error> {
    let rig = Rig::parse(RIG, "arm.toml")?;
    for parameter in rig.parameters() {
        let state = match (rig.is_fixed(&parameter), rig.has_value(&parameter)) {
            (true, _) => "held",
            (false, true) => "given, refined by calibration",
            (false, false) => "unknown, learned by calibration",
        };
        println!("{:28} {state}", parameter.path(&rig));
    }

    let model = Model::new(&rig)?;
    for pan in [-0.2, 0.0, 0.2] {
        let [u, v] = model.pixel(0, 0, &model.links(&[pan]));
        println!("pan {pan:4.1} rad: `left` sees `corner` at ({u:.1}, {v:.1}) px");
    }

    let mistaken = RIG.replace("fx = 600.0", "fxx = 600.0");
    if let Err(error) = Rig::parse(&mistaken, "arm.toml") {
        println!("a slip of the finger: {error}");
    }
    Ok(())
}
