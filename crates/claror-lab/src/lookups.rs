//! What a look-up costs in caches of growing size.

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::LabError;
use crate::folder::{read_json, write_json};
use crate::lab::{Lab, NOT_RUN, Progress, SceneInfo, text};
use crate::plan::{LookupsPlan, Scalar};
use crate::study::LookupCost;

/// Caches with records within this factor of the wanted number will do.
const CLOSE: f64 = 1.2;
/// Renders at most until a cache has about the wanted number of records.
const TRIES: usize = 4;
/// Pixels of the film per record, at least: records closer than pixels are hard to force.
const PIXELS_PER_RECORD: f64 = 4.0;
const CACHE: &str = "records.cache";
const NOTE: &str = "lookups.json";

/// What is noted of a cache of some size.
#[derive(Debug, Clone, Serialize, Deserialize)]
struct Note {
    costs: Vec<LookupCost>,
}

/// Costs of one scene, and what went wrong.
pub(crate) fn run(
    lab: &Lab,
    scene: &SceneInfo,
    plan: &LookupsPlan,
) -> Result<(Vec<LookupCost>, Vec<String>), LabError> {
    let (mut costs, mut failures) = (Vec::new(), Vec::new());
    for &records in &plan.records {
        match of_size(lab, scene, records)? {
            Ok(note) => {
                let wanted = |cost: &LookupCost| {
                    plan.indices.is_empty() || plan.indices.contains(&cost.index)
                };
                costs.extend(note.costs.into_iter().filter(wanted));
            }
            Err(message) => {
                let message = format!("look-ups in {records} records: {message}");
                failures.push(message);
            }
        }
    }
    Ok((costs, failures))
}

fn of_size(lab: &Lab, scene: &SceneInfo, records: u32) -> Result<Result<Note, String>, LabError> {
    let label = format!("look-ups in {records} records");
    let wanted = records.to_string();
    let id = lab.naming().id(&[&scene.name, "lookups", &wanted], scene, &base(lab));
    if let Some(note) = read_json(&lab.folder.path(&id).join(NOTE)) {
        return Ok(Ok(note));
    }
    if lab.options.report_only {
        return Ok(Err(NOT_RUN.to_owned()));
    }
    let show = |fraction| {
        let task = format!("{}: {label}", scene.name);
        lab.watch.progress(&Progress { task, fraction, remaining: None });
    };
    show(None);
    let folder = lab.folder.run(&id)?;
    let cache = folder.join(CACHE);
    if let Err(message) = make_cache(lab, scene, &cache, f64::from(records), &|f| show(Some(f)))? {
        lab.watch.done(&format!("{label}: {message}"), true);
        return Ok(Err(message));
    }
    let program = text(&lab.options.program);
    let command = [&program, "cache", "lookups", &text(&cache), "--json"].map(str::to_owned);
    let finished = lab.process(&command, &cache, &|_| {})?;
    if finished.stopped {
        return Err(LabError::Interrupted);
    }
    // It may be large, and is made again in little time.
    let _ = std::fs::remove_file(&cache);
    let costs = finished.event("result").and_then(costs).filter(|_| finished.code == Some(0));
    let Some(costs) = costs else {
        let message = match finished.code {
            Some(0) => "`claror cache lookups` told no costs".to_owned(),
            _ => finished.message(),
        };
        lab.watch.done(&format!("{label}: {message}"), true);
        return Ok(Err(message));
    };
    let note = Note { costs };
    write_json(&folder.join(NOTE), &note)?;
    lab.watch.done(&label, false);
    Ok(Ok(note))
}

fn costs(result: &Value) -> Option<Vec<LookupCost>> {
    let records = result["records"].as_u64()?;
    let cost = |entry: &Value| {
        Some(LookupCost {
            index: entry["index"].as_str()?.to_owned(),
            records,
            nanoseconds: entry["nanoseconds"].as_f64()?,
            candidates: entry["candidates"].as_f64()?,
        })
    };
    result["lookups"].as_array()?.iter().map(cost).collect()
}

/// Options of all caches: records with few rays, since only their number matters.
fn base(lab: &Lab) -> Vec<String> {
    let mut arguments = lab.options.scene_arguments.clone();
    arguments.extend(["-i", "irrcache", "--spp", "1", "--seed", "0"].map(str::to_owned));
    let fixed = [("gather_samples", "16"), ("noise", "1000"), ("criterion", "ward92")];
    let shared = &lab.options.plan.plan.set.0;
    let shared = shared.iter().filter(|(name, _)| name == "integrator.max_depth");
    for (name, Scalar(value)) in shared {
        arguments.extend(["-p".to_owned(), format!("{name}={value}")]);
    }
    for (name, value) in fixed {
        arguments.extend(["-p".to_owned(), format!("integrator.{name}={value}")]);
    }
    arguments
}

/// Makes a cache of about so many records: the largest spacing of records in pixels decides, and
/// is corrected by what it led to.
fn make_cache(
    lab: &Lab,
    scene: &SceneInfo,
    cache: &std::path::Path,
    wanted: f64,
    on_fraction: &dyn Fn(f64),
) -> Result<Result<(), String>, LabError> {
    let [width, height] = scene.size.map(|v| v as f64);
    let scale = (PIXELS_PER_RECORD * wanted / (width * height)).sqrt().max(1.0);
    let [width, height] = [width, height].map(|v| (v * scale).ceil());
    let mut spacing = (width * height / wanted).sqrt();
    for _ in 0..TRIES {
        if lab.watch.cancelled() {
            return Err(LabError::Interrupted);
        }
        let mut arguments = base(lab);
        arguments.extend(["--size".to_owned(), format!("{width}x{height}")]);
        let spacings = [("min", 0.5 * spacing), ("max", spacing)];
        for (name, pixels) in spacings {
            let setting = format!("integrator.{name}_pixel_spacing={pixels:.4}");
            arguments.extend(["-p".to_owned(), setting]);
        }
        let picture = cache.with_file_name("picture.pfm");
        let files = ["--cache-mode", "write", "--cache", &text(cache), "-o", &text(&picture)];
        let mut command = lab.command(scene, &arguments);
        command.extend(files.map(str::to_owned));
        command.push("--json".to_owned());
        let finished = lab.process(&command, &picture, on_fraction)?;
        if finished.stopped {
            return Err(LabError::Interrupted);
        }
        let _ = std::fs::remove_file(&picture);
        let found = finished.event("result").and_then(|event| event["cache"]["records"].as_f64());
        let Some(found) = found.filter(|found| *found > 0.0) else {
            return Ok(Err(finished.message()));
        };
        let ratio = found / wanted;
        if (1.0 / CLOSE..=CLOSE).contains(&ratio) {
            return Ok(Ok(()));
        }
        spacing *= ratio.sqrt();
    }
    // The number that the cache has is told with the costs: near enough will do.
    Ok(Ok(()))
}
