//! Plans that come with the program.

/// A plan that comes with the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ReadyPlan {
    /// As the command line calls it.
    pub name: &'static str,
    /// What it measures, one line.
    pub about: &'static str,
    /// The plan itself.
    pub text: &'static str,
}

/// All of them.
pub const READY: &[ReadyPlan] = &[
    ReadyPlan {
        name: "quick",
        about: "path tracing and irradiance caching in small pictures: a few minutes",
        text: include_str!("../../plans/quick.toml"),
    },
    ReadyPlan {
        name: "thesis",
        about: "all of it, as in a thesis on irradiance caching: a night",
        text: include_str!("../../plans/thesis.toml"),
    },
    ReadyPlan {
        name: "equal-time",
        about: "pictures that took 15 s, 60 s and 5 min",
        text: include_str!("../../plans/equal-time.toml"),
    },
    ReadyPlan {
        name: "equal-error",
        about: "time until an error is reached",
        text: include_str!("../../plans/equal-error.toml"),
    },
    ReadyPlan {
        name: "ladder",
        about: "from a grid to today's method, one cure at a time, with pictures",
        text: include_str!("../../plans/ladder.toml"),
    },
];

impl ReadyPlan {
    /// The plan of this name.
    pub fn find(name: &str) -> Option<&'static Self> {
        READY.iter().find(|plan| plan.name == name)
    }
}
