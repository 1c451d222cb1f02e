//! A part of a recording.
use super::Recording;

impl Recording {
    /// The samples whose index, from 0, is kept; in their order, with all names.
    ///
    /// What was commanded in a sample whose successor is not kept leads nowhere, and is dropped.
    pub fn select(&self, keep: impl Fn(usize) -> bool) -> Recording {
        let kept = (0..self.samples.len()).filter(|&index| keep(index));
        let select = |index: usize| {
            let mut sample = self.samples[index].clone();
            if index + 1 >= self.samples.len() || !keep(index + 1) {
                sample.joint_action = None;
                sample.pose_action = None;
            }
            sample
        };
        Recording {
            joints: self.joints.clone(),
            cameras: self.cameras.clone(),
            features: self.features.clone(),
            samples: kept.map(select).collect(),
        }
    }

    /// The same samples with the features alone whose index is kept, numbered anew.
    pub fn select_features(&self, keep: impl Fn(usize) -> bool) -> Recording {
        let mut places = 0..;
        let places: Vec<Option<u32>> =
            (0..self.features.len()).map(|index| keep(index).then(|| places.next()).flatten()).collect();
        let mut selected = self.clone();
        let mut index = 0..;
        selected.features.retain(|_| index.next().is_some_and(&keep));
        let moved = |feature: &mut u32| places[*feature as usize].map(|place| *feature = place).is_some();
        for sample in &mut selected.samples {
            sample.pixels.retain_mut(|seen| moved(&mut seen.feature));
            sample.points.retain_mut(|seen| moved(&mut seen.feature));
        }
        selected
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::recording::Sample;

    #[test]
    fn an_action_is_kept_where_it_leads_to_a_sample_that_is_kept() {
        let action = |index: usize| Some(vec![index as f64]);
        let sample = |index| Sample { joint_action: action(index), ..Sample::default() };
        let recording = Recording { samples: (0..5).map(sample).collect(), ..Recording::default() };
        let part = recording.select(|index| index != 2);
        let actions: Vec<_> = part.samples.into_iter().map(|sample| sample.joint_action).collect();
        assert_eq!(actions, [action(0), None, action(3), None]);
    }
}
