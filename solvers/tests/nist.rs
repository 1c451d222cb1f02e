//! The 27 nonlinear regression problems of NIST's Statistical Reference Datasets, <https://www.itl.nist.gov/div898/strd/>.
//!
//! From both published starting points, by Levenberg-Marquardt, the certified parameters and the residual sum of squares
//! come out to 6 digits and more: 41 of 54 with the default settings, the others with those in `EXCEPTIONS`.
//!
//! The files are as published but for one number: the copy of `Roszman1.dat` at hand certified b1 = `1.20196866396E-0`, its
//! last digit in front. NIST's figure is 2.0196866396E-01, and only that gives the file's own residual sum of squares.
use handeye_solvers::{Factor, Graph, LevenbergMarquardt, Report, Scalar, Vector};
use std::path::Path;

/// A problem as its file gives it.
struct Problem {
    starts: [Vec<f64>; 2],
    certified: Vec<f64>,
    sum_of_squares: f64,
    /// Response, then predictors.
    data: Vec<Vec<f64>>,
}

impl Problem {
    fn read(name: &str) -> Self {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("tests/nist/{name}.dat"));
        let text = std::fs::read_to_string(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
        let number = |word: &str| word.parse::<f64>().unwrap_or_else(|_| panic!("{name}: {word} is not a number"));
        let numbers = |words: &str| words.split_whitespace().map(number).collect::<Vec<f64>>();
        let mut problem =
            Problem { starts: [vec![], vec![]], certified: vec![], sum_of_squares: f64::NAN, data: vec![] };
        let mut lines = text.lines();
        for line in &mut lines {
            if line.starts_with("Data:") && line.contains('y') && line.contains('x') && !line.contains("Response") {
                break;
            }
            if let Some(sum) = line.strip_prefix("Residual Sum of Squares:") {
                problem.sum_of_squares = number(sum.trim());
            }
            if let Some((parameter, values)) = line.split_once('=')
                && parameter.trim().strip_prefix('b').is_some_and(|digits| digits.parse::<usize>().is_ok())
                && let [first, second, certified, _deviation] = numbers(values)[..]
            {
                problem.starts[0].push(first);
                problem.starts[1].push(second);
                problem.certified.push(certified);
            }
        }
        problem.data = lines.map(numbers).filter(|row| !row.is_empty()).collect();
        problem
    }
}

/// One observation of a problem with `N` parameters: y - f(x; b).
struct Observation<const N: usize> {
    name: &'static str,
    y: f64,
    x: Vec<f64>,
}

impl<const N: usize> Factor<1> for Observation<N> {
    type On = (Vector<N>,);

    fn residual<T: Scalar>(&self, (b,): (Vector<N, T>,)) -> [T; 1] {
        [model(self.name, b.as_slice(), &self.x) - self.y]
    }
}

/// The formulas of the files.
fn model<T: Scalar>(name: &str, b: &[T], xs: &[f64]) -> T {
    let x = xs[0];
    let exp = |z: T| z.exp();
    let square = |z: T| z * z;
    let one = T::one();
    match name {
        "Bennett5" => b[0] * (b[1] + x).powf(-one / b[2]),
        "BoxBOD" | "Misra1a" => b[0] * (one - exp(-b[1] * x)),
        "Chwirut1" | "Chwirut2" => exp(-b[0] * x) / (b[1] + b[2] * x),
        "DanWood" => b[0] * T::from(x).powf(b[1]),
        "ENSO" => {
            let turn = std::f64::consts::TAU * x;
            let wave = |period: T, c: T, s: T| c * (T::from(turn) / period).cos() + s * (T::from(turn) / period).sin();
            b[0] + wave(T::from(12.0), b[1], b[2]) + wave(b[3], b[4], b[5]) + wave(b[6], b[7], b[8])
        }
        "Eckerle4" => b[0] / b[1] * exp(square((-b[2] + x) / b[1]) * -0.5),
        "Gauss1" | "Gauss2" | "Gauss3" => {
            let peak = |height: T, at: T, width: T| height * exp(-square((-at + x) / width));
            b[0] * exp(-b[1] * x) + peak(b[2], b[3], b[4]) + peak(b[5], b[6], b[7])
        }
        "Hahn1" | "Thurber" => {
            (b[0] + b[1] * x + b[2] * (x * x) + b[3] * (x * x * x))
                / (one + b[4] * x + b[5] * (x * x) + b[6] * (x * x * x))
        }
        "Kirby2" => (b[0] + b[1] * x + b[2] * (x * x)) / (one + b[3] * x + b[4] * (x * x)),
        "Lanczos1" | "Lanczos2" | "Lanczos3" => b[0] * exp(-b[1] * x) + b[2] * exp(-b[3] * x) + b[4] * exp(-b[5] * x),
        "MGH09" => b[0] * (b[1] * x + x * x) / (b[2] * x + b[3] + x * x),
        "MGH10" => b[0] * exp(b[1] / (b[2] + x)),
        "MGH17" => b[0] + b[1] * exp(-b[3] * x) + b[2] * exp(-b[4] * x),
        "Misra1b" => b[0] * (one - one / square(b[1] * (x / 2.0) + 1.0)),
        "Misra1c" => b[0] * (one - one / (b[1] * (2.0 * x) + 1.0).sqrt()),
        "Misra1d" => b[0] * b[1] * x / (b[1] * x + 1.0),
        "Nelson" => b[0] - b[1] * x * exp(-b[2] * xs[1]),
        "Rat42" => b[0] / (one + exp(b[1] - b[2] * x)),
        "Rat43" => b[0] / (one + exp(b[1] - b[2] * x)).powf(one / b[3]),
        "Roszman1" => b[0] - b[1] * x - (b[2] / (-b[3] + x)).atan() / std::f64::consts::PI,
        _ => panic!("no formula for {name}"),
    }
}

/// Digits that agree: -log10 of the relative error, 11 at most, as many as the files have.
fn digits(found: f64, certified: f64) -> f64 {
    let error = ((found - certified) / certified).abs();
    if error.is_nan() { 0.0 } else { -error.max(1e-11).log10() }
}

/// Fewest digits of the parameters, and those of the residual sum of squares.
fn fit<const N: usize>(
    name: &'static str,
    problem: &Problem,
    start: &[f64],
    settings: &LevenbergMarquardt,
) -> (f64, f64, Report) {
    let mut graph = Graph::new();
    let b = graph.free(Vector::<N>::from_column_slice(start));
    for row in &problem.data {
        // Nelson's response is log y.
        let y = if name == "Nelson" { row[0].ln() } else { row[0] };
        graph.factor(Observation::<N> { name, y, x: row[1..].to_vec() }, (b,));
    }
    let report = settings.minimize(&mut graph).unwrap();
    let found = graph.value(b);
    let parameters =
        found.iter().zip(&problem.certified).map(|(found, certified)| digits(*found, *certified)).fold(11.0, f64::min);
    (parameters, digits(2.0 * graph.cost(), problem.sum_of_squares), report)
}

const NAMES: [&str; 27] = [
    "Bennett5", "BoxBOD", "Chwirut1", "Chwirut2", "DanWood", "ENSO", "Eckerle4", "Gauss1", "Gauss2", "Gauss3", "Hahn1",
    "Kirby2", "Lanczos1", "Lanczos2", "Lanczos3", "MGH09", "MGH10", "MGH17", "Misra1a", "Misra1b", "Misra1c",
    "Misra1d", "Nelson", "Rat42", "Rat43", "Roszman1", "Thurber",
];

/// The default settings stop after 100 iterations, and where the cost stands still to 1e-10: parameters err by less than
/// a thousandth of their standard deviation then, which is less than six digits where that is large.
fn default() -> LevenbergMarquardt {
    LevenbergMarquardt::default()
}

fn exact() -> LevenbergMarquardt {
    LevenbergMarquardt { cost_tolerance: 1e-15, max_iterations: 1_000, ..default() }
}

/// (problem, start, settings that reach six digits, why the default settings do not)
type Exception = (&'static str, usize, fn() -> LevenbergMarquardt, &'static str);

const EXCEPTIONS: [Exception; 13] = [
    ("Bennett5", 1, exact, "285 iterations along a curved valley"),
    ("Bennett5", 2, exact, "267 iterations along a curved valley"),
    ("BoxBOD", 1, short_first_step, "ends at b2 = 69, a plateau where exp(-b2 x) = 0 for every x"),
    ("ENSO", 1, exact, "3.9 digits where the cost stands still"),
    ("ENSO", 2, exact, "4.0 digits where the cost stands still"),
    ("Eckerle4", 1, exact, "220 iterations"),
    ("MGH09", 1, exact, "5.0 digits where the cost stands still"),
    ("MGH09", 2, exact, "5.6 digits where the cost stands still"),
    ("MGH10", 1, exact, "384 iterations along a curved valley, from a cost of 2e15"),
    ("MGH10", 2, exact, "146 iterations along a curved valley"),
    ("MGH17", 1, more_scaling, "ends at b4 = 10, b5 = 5, a plateau where both exponentials are 0; 563 iterations"),
    ("Thurber", 1, exact, "5.6 digits where the cost stands still"),
    ("Thurber", 2, exact, "5.5 digits where the cost stands still"),
];

fn short_first_step() -> LevenbergMarquardt {
    LevenbergMarquardt { initial_damping: 1e3, ..exact() }
}

fn more_scaling() -> LevenbergMarquardt {
    LevenbergMarquardt { scale_memory: 1.0, ..exact() }
}

/// The residuals of Lanczos1 are 8e-14 at the certified minimum and 4e-16 of each is rounding: its sum of squares, 1.4e-25,
/// has 2.6 digits in double precision when every tolerance is 0. Its parameters have all.
const SUM_IS_ROUNDING: &str = "Lanczos1";

#[test]
fn certified_values_come_out_to_six_digits_from_both_starts() {
    let mut by_default = 0;
    for name in NAMES {
        let problem = Problem::read(name);
        for (start, values) in problem.starts.iter().enumerate() {
            let fit = match values.len() {
                2 => fit::<2>,
                3 => fit::<3>,
                4 => fit::<4>,
                5 => fit::<5>,
                6 => fit::<6>,
                7 => fit::<7>,
                8 => fit::<8>,
                9 => fit::<9>,
                n => panic!("{name} has {n} parameters"),
            };
            let reached = |settings: &LevenbergMarquardt| {
                let (parameters, sum, report) = fit(name, &problem, values, settings);
                (parameters >= 6.0 && (sum >= 6.0 || name == SUM_IS_ROUNDING), format!("{parameters} {sum} {report:?}"))
            };
            let (ok, found) = reached(&default());
            let exception = EXCEPTIONS.iter().find(|exception| (exception.0, exception.1) == (name, start + 1));
            assert_eq!(ok, exception.is_none(), "{name} from start {}: {found}", start + 1);
            by_default += usize::from(ok);
            if let Some((.., settings, _)) = exception {
                let (ok, found) = reached(&settings());
                assert!(ok, "{name} from start {}: {found}", start + 1);
            }
        }
    }
    let problem = Problem::read(SUM_IS_ROUNDING);
    let none = LevenbergMarquardt { cost_tolerance: 0.0, gradient_tolerance: 0.0, step_tolerance: 0.0, ..exact() };
    for start in &problem.starts {
        let (parameters, sum, report) = fit::<6>(SUM_IS_ROUNDING, &problem, start, &none);
        assert!(parameters >= 10.0 && sum >= 2.0, "{parameters} {sum} {report:?}");
    }
    assert_eq!(by_default, 2 * NAMES.len() - EXCEPTIONS.len());
}
