//! Small studies for tests.

use crate::study::{Reference, SceneStudy, Series, SeriesKind, Setting, Spread, Summary};

pub(super) fn summary(cpu: f64, rel_mse: f64, bias: f64) -> Summary {
    let one = |v: f64| Spread { median: v, low: v, high: v };
    Summary {
        seconds: one(cpu),
        cpu_seconds: one(cpu),
        peak_memory_bytes: one(1e6),
        records: None,
        mse: one(rel_mse),
        rel_mse: one(rel_mse),
        mape: one(0.1),
        bias: one(bias),
        ssim: one(0.9),
        flip: one(0.1),
    }
}

pub(super) fn series(name: &str, label: &str, summaries: Vec<Option<Summary>>) -> Series {
    let setting = |(i, summary): (usize, Option<Summary>)| Setting {
        label: format!("s{i}"),
        note: String::new(),
        x: Some(i as f64),
        runs: Vec::new(),
        failures: if summary.is_none() { vec!["exit code 5".into()] } else { Vec::new() },
        summary,
        illustrations: Vec::new(),
    };
    Series {
        name: name.into(),
        label: label.into(),
        note: String::new(),
        kind: SeriesKind::Sweep { parameter: "spp".into() },
        settings: summaries.into_iter().enumerate().map(setting).collect(),
        slope: None,
    }
}

pub(super) fn scene(series: Vec<Series>) -> SceneStudy {
    SceneStudy {
        name: "box".into(),
        file: "box.xml".into(),
        hash: "0".repeat(32),
        size: [8, 8],
        reference: Reference {
            halves: ["a.exr".into(), "b.exr".into()],
            spp: 64,
            cpu_seconds: 1.0,
            rel_mse: 1e-6,
            commands: Vec::new(),
        },
        series,
        equal_time: Vec::new(),
        equal_error: Vec::new(),
        lookups: Vec::new(),
    }
}
