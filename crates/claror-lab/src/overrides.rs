//! What a command line changes in a plan.

use crate::plan::{Plan, Size};

/// What a command line changes in a plan.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Overrides {
    /// Number of seeds: the first ones of the plan, and more if it has fewer. Series with seeds of
    /// their own never get more.
    pub seeds: Option<usize>,
    /// Size of the pictures.
    pub size: Option<Size>,
    /// Threads of each run.
    pub threads: Option<u16>,
    /// Samples per pixel of the reference.
    pub reference_spp: Option<u32>,
}

impl Overrides {
    /// Changes the plan.
    pub fn apply(&self, plan: &mut Plan) {
        if let Some(count) = self.seeds {
            let more = (0..).filter(|seed| !plan.seeds.contains(seed));
            let seeds = plan.seeds.iter().copied().chain(more).take(count).collect();
            plan.seeds = seeds;
            for own in plan.series.iter_mut().filter_map(|series| series.seeds.as_mut()) {
                own.truncate(count);
            }
        }
        plan.size = self.size.or(plan.size);
        plan.threads = self.threads.or(plan.threads);
        if let Some(spp) = self.reference_spp {
            plan.reference.spp = spp;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plan::PlanFile;

    #[test]
    fn seeds_are_cut_or_added() {
        let text = "title = 't'\nseeds = [3, 1]\n[[series]]\nname = 'a'\nseeds = [7, 8]";
        let plan = PlanFile::parse("p", text).expect("good").plan;
        for (count, seeds, own) in [(1, vec![3], vec![7]), (4, vec![3, 1, 0, 2], vec![7, 8])] {
            let mut changed = plan.clone();
            Overrides { seeds: Some(count), ..Overrides::default() }.apply(&mut changed);
            assert_eq!(changed.seeds, seeds);
            assert_eq!(changed.series[0].seeds, Some(own));
        }
    }
}
