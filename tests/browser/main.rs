//! The pages that handeye writes, in a real browser: every drawing is there, nothing overflows, no script fails. Needs Chromium; says so
//! where there is none.
use handeye::rig::{Camera, catalog};
use std::io::Read;
use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// What the browser is asked: it writes its answer into the page.
const CHECK: &str = "<script>
const extent = (canvas, pixels) => {
  const [across, up] = [new Set(), new Set()];
  pixels.forEach((value, index) => {
    if (index % 4 !== 3 || value === 0) return;
    const pixel = (index - 3) / 4;
    across.add(pixel % canvas.width);
    up.add(Math.floor(pixel / canvas.width));
  });
  const range = (set) => [...set].reduce(([least, most], x) => [Math.min(least, x), Math.max(most, x)], [Infinity, -Infinity]);
  const share = (set, size) => (range(set)[1] - range(set)[0]) / size;
  const filled = Math.max(share(across, canvas.width), share(up, canvas.height));
  const width = canvas.getBoundingClientRect().width / document.querySelector('main').clientWidth;
  const sharp = canvas.width === Math.round(canvas.clientWidth * devicePixelRatio);
  return { filled, width, sharp };
};
addEventListener('load', () => {
  const root = document.documentElement;
  const canvas = document.getElementById('view');
  const pixels = canvas ? canvas.getContext('2d').getImageData(0, 0, canvas.width, canvas.height).data : [];
  const empty = [...document.querySelectorAll('svg')].filter((svg) => svg.getBoundingClientRect().height < 20 || !svg.children.length);
  const wide = [...document.querySelectorAll('main *')].filter((element) =>
    !element.closest('.wide') && !element.closest('svg') && element.getBoundingClientRect().right > root.clientWidth + 1);
  const [slider, dot] = [document.getElementById('moment'), document.querySelector('svg .now')];
  const places = slider && [slider.min, slider.max].map((value) => {
    slider.value = value;
    slider.dispatchEvent(new Event('input'));
    return [dot.getAttribute('cx'), document.getElementById('now').textContent, canvas.toDataURL()];
  });
  if (slider) document.getElementById('play').click();
  document.title = JSON.stringify({
    errors: window.failures,
    overflows: root.scrollWidth > root.clientWidth + 1 || wide.length > 0,
    drawings: document.querySelectorAll('svg').length,
    empty: empty.length,
    drawn: pixels.some((value) => value > 0),
    plays: places && places[0].every((place, index) => place !== places[1][index]) && document.getElementById('play').textContent === 'pause',
    view: canvas && extent(canvas, pixels),
    overlaps: canvas && canvas.labels.some((a, i) => canvas.labels.slice(i + 1).some((b) =>
      a.x < b.x + b.width && b.x < a.x + a.width && Math.abs(a.y - b.y) < a.height - 1)),
    labels: canvas && canvas.labels.map((label) => label.name).sort(),
    ratio: Math.round(1e3 * devicePixelRatio) / 1e3,
    ticks: document.body.innerText.includes('`'),
    folds: [...document.querySelectorAll('details')].every((one) => !one.open && one.querySelector('p').getBoundingClientRect().height === 0),
    cut: [...document.querySelectorAll('.values td')].some((cell) => cell.getBoundingClientRect().right > root.clientWidth + 1),
    ink: getComputedStyle(document.body).color,
  });
});
</script>";

/// Collects what scripts throw, from before the first of them.
const LISTEN: &str =
    "<script>window.failures = []; addEventListener('error', (event) => window.failures.push(event.message));</script>";

fn chromium() -> Option<&'static str> {
    ["chromium", "chromium-browser", "google-chrome"]
        .into_iter()
        .find(|name| Command::new(name).arg("--version").output().is_ok_and(|output| output.status.success()))
}

/// Pixels of the screen in one of the page: not 1, so that a drawing of too few shows, and nothing that a binary fraction is.
const RATIO: f64 = 1.1;

/// How long a page may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// The answer of a page at a width, in light or dark.
fn ask(browser: &str, page: &Path, width: u32, dark: bool) -> serde_json::Value {
    let profile = page.with_extension("profile");
    let mut command = Command::new(browser);
    command.args(["--headless", "--no-sandbox", "--disable-gpu", "--disable-quic", "--no-first-run", "--disable-sync"]);
    command.args(["--disable-background-networking", "--disable-component-update", "--hide-scrollbars", "--dump-dom"]);
    command.arg(format!("--user-data-dir={}", profile.display())).arg(format!("--window-size={width},900"));
    command.arg(format!("--force-device-scale-factor={RATIO}"));
    if dark {
        command.arg("--blink-settings=preferredColorScheme=0");
    }
    command.arg(format!("file://{}", page.display())).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut running = command.spawn().unwrap();
    let mut stdout = running.stdout.take().unwrap();
    let reader = std::thread::spawn(move || {
        let mut dom = Vec::new();
        stdout.read_to_end(&mut dom).map(|_| dom)
    });
    let begun = Instant::now();
    while running.try_wait().unwrap().is_none() {
        if begun.elapsed() > PATIENCE {
            running.kill().unwrap();
            panic!("the page at {width} px hangs");
        }
        std::thread::sleep(Duration::from_millis(20));
    }
    let dom = String::from_utf8_lossy(&reader.join().unwrap().unwrap()).into_owned();
    let title = dom.split("<title>").nth(1).and_then(|rest| rest.split("</title>").next()).unwrap_or_default();
    let title = title.replace("&quot;", "\"").replace("&amp;", "&").replace("&lt;", "<").replace("&gt;", ">");
    serde_json::from_str(&title).unwrap_or_else(|_| panic!("the page gave no answer: {title}"))
}

/// A folder with pages of `handeye`.
struct Pages {
    folder: std::path::PathBuf,
    browser: &'static str,
}

impl Pages {
    /// `None` where there is no browser.
    fn new(name: &str) -> Option<Self> {
        let Some(browser) = chromium() else {
            println!("no Chromium is here (apt-get install chromium): the pages were not looked at");
            return None;
        };
        let folder = std::env::temp_dir().join(format!("handeye-browser-{name}-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        Some(Pages { folder, browser })
    }

    fn run(&self, arguments: &str) {
        let mut command = Command::new(env!("CARGO_BIN_EXE_handeye"));
        let output = command.args(arguments.split_whitespace()).current_dir(&self.folder).output().unwrap();
        assert!(output.status.success(), "{arguments}: {}", String::from_utf8_lossy(&output.stderr));
    }

    /// That page.html is whole on screen and phone, in light and dark, with so many drawings, none of them empty, and the names of all cameras;
    /// and that its player moves features and arm, where there is one.
    fn are_whole(&self, drawings: u64, cameras: &[&str], plays: Option<bool>) {
        let page = std::fs::read_to_string(self.folder.join("page.html")).unwrap();
        let page =
            page.replacen("<head>", &format!("<head>{LISTEN}"), 1).replacen("</body>", &format!("{CHECK}</body>"), 1);
        let path = self.folder.join("checked.html");
        std::fs::write(&path, page).unwrap();
        let mut inks = Vec::new();
        for (width, dark) in [(1100, false), (500, false), (1100, true)] {
            let answer = ask(self.browser, &path, width, dark);
            assert_eq!(answer["errors"], serde_json::json!([]), "{width} px wide");
            assert_eq!(
                (&answer["overflows"], &answer["drawn"]),
                (&false.into(), &true.into()),
                "{width} px wide: {answer}"
            );
            // What was learned can be read without scrolling.
            assert_eq!(answer["cut"], false, "{width} px wide: {answer}");
            assert_eq!((&answer["drawings"], &answer["empty"]), (&drawings.into(), &0.into()), "{answer}");
            assert_eq!((&answer["labels"], &answer["ratio"]), (&cameras.into(), &RATIO.into()), "{answer}");
            // Names are code, and what is folded away takes no room.
            assert_eq!((&answer["ticks"], &answer["folds"]), (&false.into(), &true.into()), "{answer}");
            // As wide as the page but for its margins, filled, with a pixel for every one of the screen, and names that can be read.
            let view = &answer["view"];
            assert!(view["filled"].as_f64().unwrap() > 0.75 && view["width"].as_f64().unwrap() > 0.85, "{answer}");
            assert_eq!((&view["sharp"], &answer["overlaps"]), (&true.into(), &false.into()), "{answer}");
            inks.push(answer["ink"].clone());
            assert_eq!(answer["plays"], serde_json::json!(plays), "{answer}");
        }
        assert!(inks[0] == inks[1] && inks[0] != inks[2], "dark pages have another ink: {inks:?}");
    }
}

impl Drop for Pages {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.folder);
    }
}

#[test]
fn pages_of_calibrations_and_evaluations_are_whole_on_screen_and_phone_in_light_and_dark() {
    let Some(pages) = Pages::new("calibration") else { return };
    pages.run("simulate ur5 --samples 40 --outliers 0.02 -o motions.jsonl");
    pages.run("calibrate motions.jsonl -o learned.toml --report page.html --influence");
    // A scatter and a map of each camera, a histogram, the joints, and images of four bad samples in both cameras.
    pages.are_whole(14, &["left", "right"], None);
    pages.run("evaluate learned.toml motions.jsonl --report page.html");
    pages.are_whole(14, &["left", "right"], None);
}

/// Five cameras within a millimetre: their names go below each other, however the sizes of screens round.
#[test]
fn names_of_cameras_that_are_close_together_are_drawn_apart() {
    let Some(pages) = Pages::new("close") else { return };
    let names = ["a", "b", "c", "d", "e"].map(|letter| format!("camera-{letter}"));
    let mut rig = catalog::rig("ur5").unwrap();
    let first = rig.cameras[0].clone();
    rig.cameras = names
        .iter()
        .enumerate()
        .map(|(index, name)| {
            let mut camera = Camera { name: name.clone(), ..first.clone() };
            camera.pose.as_mut().unwrap().translation.z += 2e-4 * index as f64;
            camera
        })
        .collect();
    rig.write(&pages.folder.join("close.toml"), None).unwrap();
    pages.run("simulate close.toml --samples 20 -o motions.jsonl");
    pages.run("evaluate close.toml motions.jsonl --report page.html");
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    // As of two cameras, of five.
    pages.are_whole(32, &names, None);
}

#[test]
fn pages_of_servo_runs_are_whole_and_play() {
    let Some(pages) = Pages::new("servo") else { return };
    pages.run("servo ur5 ur5-reach --report page.html");
    // An image of each camera, two errors, six joints.
    pages.are_whole(10, &["left", "right"], Some(true));
}
