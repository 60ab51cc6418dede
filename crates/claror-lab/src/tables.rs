//! The runs of a study as tables for other programs.

use std::fmt::Write;

use serde_json::json;

use crate::study::{Run, SceneStudy, Series, Setting, Study};

/// All runs with where they belong.
fn runs(study: &Study) -> impl Iterator<Item = (&SceneStudy, &Series, &Setting, &Run)> {
    study.scenes.iter().flat_map(|scene| {
        scene.series.iter().flat_map(move |series| {
            series.settings.iter().flat_map(move |setting| {
                setting.runs.iter().map(move |run| (scene, series, setting, run))
            })
        })
    })
}

const HEADER: &str = "scene,series,setting,x,seed,seconds,cpu_seconds,peak_memory_bytes,records,\
spp,rays,mse,rel_mse,mape,bias,ssim,flip,load,started,id";

/// One line per run, numbers separated by commas (RFC 4180, but for the ends of lines).
pub(crate) fn csv(study: &Study) -> String {
    let mut text = format!("{HEADER}\n");
    for (scene, series, setting, run) in runs(study) {
        let e = &run.errors;
        let optional = |value: Option<String>| value.unwrap_or_default();
        let words = [
            quoted(&scene.name),
            quoted(&series.name),
            quoted(&setting.label),
            optional(setting.x.map(|x| x.to_string())),
            run.seed.to_string(),
            run.seconds.to_string(),
            run.cpu_seconds.to_string(),
            run.peak_memory_bytes.to_string(),
            optional(run.records.map(|n| n.to_string())),
            run.spp.to_string(),
            run.rays.to_string(),
        ];
        let errors = [e.mse, e.rel_mse, e.mape, e.bias, e.ssim, e.flip, run.load];
        let errors = errors.map(|v| v.to_string());
        let last = [run.started.clone(), run.id.clone()];
        let line = [&words[..], &errors, &last].concat().join(",");
        // Writing to memory does not fail.
        let _ = writeln!(text, "{line}");
    }
    text
}

fn quoted(text: &str) -> String {
    if text.contains([',', '"', '\n']) {
        return format!("\"{}\"", text.replace('"', "\"\""));
    }
    text.to_owned()
}

/// One JSON object per run and line: all that is known of it.
pub(crate) fn jsonl(study: &Study) -> String {
    let mut text = String::new();
    for (scene, series, setting, run) in runs(study) {
        let mut object = json!(run);
        object["scene"] = json!(scene.name);
        object["series"] = json!(series.name);
        object["setting"] = json!(setting.label);
        object["x"] = json!(setting.x);
        let _ = writeln!(text, "{object}");
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_with_commas_and_quotes_are_quoted() {
        assert_eq!(quoted("a=1"), "a=1");
        assert_eq!(quoted("a=1, b"), "\"a=1, b\"");
        assert_eq!(quoted("the \"best\""), "\"the \"\"best\"\"\"");
    }
}
