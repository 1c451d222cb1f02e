//! Mistakes of whole recordings, undone: poses that are inverted or written otherwise, rows that belong to other samples, readings that belong to
//! other joints.
use super::{About, arm};
use crate::recording::{Recording, Sample, is_in_another_order};
use crate::rig::Rig;
use handeye_solvers::Pose;
use handeye_solvers::manifold::so3;

/// A mistake of poses: what it is about, how it is called, what to change, and the change.
type OfPoses = (About, &'static str, &'static str, fn(&Pose) -> Pose);

/// What may be wrong with poses.
pub(super) const OF_POSES: [OfPoses; 3] = [
    (About::Order, "inverted", "write the inverse of each", Pose::inverse),
    (About::Order, "quaternions in the order w, x, y, z", "write quaternions as [x, y, z, w]", reorder),
    (About::Units, "in millimetres", "divide their positions by 1000", metres),
];

/// The pose whose quaternion was written w first and read w last.
fn reorder(pose: &Pose) -> Pose {
    let [w, x, y, z] = so3::quaternion(&pose.rotation);
    Pose { rotation: so3::from_quaternion([x, y, z, w]), ..*pose }
}

fn metres(pose: &Pose) -> Pose {
    Pose { translation: pose.translation / 1000.0, ..*pose }
}

/// How rows may be paired with images: how it is called, what to change, and for each sample the row that belongs to it.
type Pairing = (String, String, Vec<Option<usize>>);

/// The ways in which n rows may be paired.
pub(super) fn pairings(what: &str, n: usize) -> Vec<Pairing> {
    let mut all: Vec<_> = [1, -1, 2, -2, 3, -3]
        .into_iter()
        .map(|shift: isize| {
            let (by, side) = (shift.unsigned_abs(), if shift > 0 { "early" } else { "late" });
            let by = match by {
                1 => "one sample".to_owned(),
                _ => format!("{by} samples"),
            };
            let change =
                format!("pair each image with the {what} {by} {}", if shift < 0 { "later" } else { "earlier" });
            let rows = (0..n).map(|i| i.checked_add_signed(-shift).filter(|row| *row < n)).collect();
            (format!("{what} are {by} {side}"), change, rows)
        })
        .collect();
    let reversed = (0..n).rev().map(Some).collect();
    all.push((format!("rows of {what} are in reverse order"), format!("reverse the order of the {what}"), reversed));
    all
}

/// The recording with the state of another sample in each; samples without one are left out.
pub(super) fn paired(recording: &Recording, rows: &[Option<usize>]) -> Recording {
    let samples = rows.iter().zip(&recording.samples).filter_map(|(row, sample)| {
        let read = &recording.samples[(*row)?];
        Some(Sample { joints: read.joints.clone(), pose: read.pose, ..sample.clone() })
    });
    Recording { samples: samples.collect(), ..recording.clone() }
}

/// Arms of more joints have too many pairs to try.
const MOST_JOINTS: usize = 8;

/// How readings may be of other joints than those at whose places they stand: how it is called, what to change, and for each joint the place of its
/// reading.
type JointOrder = (String, String, Vec<usize>);

/// Orders in which drivers write joints, and any two joints in each other's place, where the rig gives the chain: one that is learned says nothing
/// of the joints' order.
pub(super) fn joint_orders(rig: &Rig, recording: &Recording) -> Vec<JointOrder> {
    let n = recording.joints.len();
    if n > MOST_JOINTS || arm(rig, recording).is_none() {
        return Vec::new();
    }
    let of_rig = rig.robot.joint_names();
    let names = |order: &[usize]| order.iter().map(|place| recording.joints[*place].clone()).collect::<Vec<String>>();
    let change = |order: &[usize]| {
        let names = names(order);
        if is_in_another_order(&names, &of_rig) {
            let moved = order.iter().enumerate().filter(|(joint, place)| joint != *place);
            let calls =
                moved.map(|(joint, place)| format!("{} is {}", recording.joints[*place], recording.joints[joint]));
            format!("what is called {}: exchange names, or readings", calls.collect::<Vec<_>>().join(", "))
        } else {
            format!("from base to tip they are {}: --joints {} reads them so", names.join(", "), names.join(","))
        }
    };
    let as_is: Vec<usize> = (0..n).collect();
    let swapped = (0..n).flat_map(|i| (i + 1..n).map(move |j| (i, j))).map(|(i, j)| {
        let mut order = as_is.clone();
        order.swap(i, j);
        (format!("joints {} and {} are swapped", recording.joints[i], recording.joints[j]), order)
    });
    // Of two joints all of these are one exchange, and of three the reverse is.
    let turned = (1..n).filter(|_| n > 2).map(|first| {
        let mut order = as_is.clone();
        order.rotate_left(first);
        (format!("joints begin with another than the base's, which is {}", recording.joints[first]), order)
    });
    let reversed = (n > 3).then(|| ("joints go from tip to base".to_owned(), as_is.iter().rev().copied().collect()));
    let all = swapped.chain(turned).chain(reversed);
    all.map(|(name, order)| (name, change(&order), order)).collect()
}

/// The recording with the readings, and commanded motions, of joints at other places.
pub(super) fn reordered(recording: &Recording, order: &[usize]) -> Recording {
    let mut reordered = recording.clone();
    for joints in
        reordered.samples.iter_mut().flat_map(|sample| [&mut sample.joints, &mut sample.joint_action]).flatten()
    {
        *joints = order.iter().map(|place| joints[*place]).collect();
    }
    reordered
}
