//! The tree of frames that TF describes, and the pose of one frame in another.
use super::kinds::{frame, need, pose, stamp};
use super::value::Value;
use crate::recording::track::{At, Track};
use handeye_solvers::Pose;
use std::collections::BTreeMap;

/// Each frame's parent and its pose in it.
#[derive(Default)]
pub(super) struct Frames {
    tracks: BTreeMap<String, (String, Edge)>,
}

enum Edge {
    Static(Pose),
    Moving(Track<Pose>),
}

/// Longest way to a root: a longer one goes in circles.
const LONGEST: usize = 1000;

impl Frames {
    /// Takes a geometry_msgs/TransformStamped.
    pub(super) fn add(&mut self, moments: &[i64], transform: &Value, is_static: bool) -> Result<(), String> {
        let child = need(transform.text("child_frame_id"), "child_frame_id")?.trim_start_matches('/');
        let pose = pose(transform, "transform.translation", "transform.rotation")?;
        if !self.tracks.contains_key(child) {
            let edge = if is_static { Edge::Static(pose) } else { Edge::Moving(Track::new(moments.len())) };
            self.tracks.insert(child.to_owned(), (frame(transform).to_owned(), edge));
        }
        if let Some((_, Edge::Moving(track))) = self.tracks.get_mut(child) {
            track.add(moments, stamp(transform)?, &pose);
        }
        Ok(())
    }

    /// `base_from_tip` at all moments.
    ///
    /// Errors: in words, where there is no way from one to the other.
    pub(super) fn poses(&self, moments: &[i64], base: &str, tip: &str) -> Result<Vec<Option<At<Pose>>>, String> {
        let [mut up_from_base, mut up_from_tip] = [self.way_up(base)?, self.way_up(tip)?];
        let root = |way: &[&str], start: &str| {
            way.last()
                .map_or(start.to_owned(), |last| self.tracks.get(*last).map_or(String::new(), |edge| edge.0.clone()))
        };
        if root(&up_from_base, base) != root(&up_from_tip, tip) {
            let known: Vec<&str> = self.tracks.keys().map(String::as_str).collect();
            return Err(format!("TF has no way from `{base}` to `{tip}`; it has the frames {}", known.join(", ")));
        }
        while up_from_base.last().is_some() && up_from_base.last() == up_from_tip.last() {
            up_from_base.pop();
            up_from_tip.pop();
        }
        let common_from_tip = self.along(moments, &up_from_tip);
        let common_from_base = self.along(moments, &up_from_base);
        let compose = |(tip, base): (Option<At<Pose>>, Option<At<Pose>>)| {
            let (tip, base) = (tip?, base?);
            Some(At { value: base.value.inverse() * tip.value, gap: tip.gap.max(base.gap) })
        };
        Ok(common_from_tip.into_iter().zip(common_from_base).map(compose).collect())
    }

    /// Frames from one up to the last that has a parent.
    fn way_up<'a>(&'a self, start: &'a str) -> Result<Vec<&'a str>, String> {
        let mut way = Vec::new();
        let mut at = start;
        while let Some((parent, _)) = self.tracks.get(at) {
            way.push(at);
            at = parent;
            if way.len() > LONGEST {
                return Err(format!("TF goes in circles above `{start}`"));
            }
        }
        Ok(way)
    }

    /// The pose of the first frame of a way in the parent of the last.
    fn along(&self, moments: &[i64], way: &[&str]) -> Vec<Option<At<Pose>>> {
        let identity = || Some(At { value: Pose::identity(), gap: 0 });
        let mut poses: Vec<Option<At<Pose>>> = moments.iter().map(|_| identity()).collect();
        for (_, edge) in way.iter().filter_map(|name| self.tracks.get(*name)) {
            let edges = match edge {
                Edge::Static(pose) => moments.iter().map(|_| Some(At { value: *pose, gap: 0 })).collect::<Vec<_>>(),
                Edge::Moving(track) => track.at(moments),
            };
            for (pose, edge) in poses.iter_mut().zip(edges) {
                *pose = match (pose.take(), edge) {
                    (Some(pose), Some(edge)) => {
                        Some(At { value: edge.value * pose.value, gap: edge.gap.max(pose.gap) })
                    }
                    _ => None,
                };
            }
        }
        poses
    }
}
