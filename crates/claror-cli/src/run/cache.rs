//! `claror cache`: what is in a cache file, and its records for other programs.

use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;

use claror::integrator::CacheStatistics;
use claror::irradiance::Record;
use claror::math::Bounds3;
use claror_io::records::{write_csv, write_ply};
use claror_io::write::atomically;
use serde_json::{Map, Value, json};

use super::cache_file::{self, CacheFile};
use super::cache_lookups;
use super::info::{Info, number, triple};
use super::statistics;
use crate::args::{CacheCommand, ExportArgs};
use crate::exit::{Exit, Failure};
use crate::messages::Console;
use crate::output::check_writable;
use crate::units;

/// Runs one of the commands.
pub(crate) fn run(command: &CacheCommand, console: &Console) -> Result<Exit, Failure> {
    match command {
        CacheCommand::Info { file } => show(file, console),
        CacheCommand::Export(args) => export(args, console),
        CacheCommand::Lookups(args) => cache_lookups::run(args, console),
    }
}

fn show(file: &Path, console: &Console) -> Result<Exit, Failure> {
    let cache = cache_file::read(file)?;
    let mut info = Info::default();
    info.add("cache", file.display().to_string());
    info.list("views", &cache.views);
    records(&mut info, &cache.contents.statistics);
    geometry(&mut info, &cache.contents.records);
    memory(&mut info, &cache);
    let entries = &cache.fingerprint.entries;
    let texts: Vec<String> =
        entries.iter().map(|(name, value)| format!("{name} {value}")).collect();
    info.list("parameters", &texts);
    let object: Map<String, Value> =
        entries.iter().map(|(name, value)| (name.clone(), json!(value))).collect();
    info.json.insert("parameters".to_owned(), Value::Object(object));
    info.finish(console);
    Ok(Exit::Success)
}

fn records(info: &mut Info, statistics: &CacheStatistics) {
    let count = units::grouped(statistics.records as u64);
    let [walks, rays] = [statistics.walks as f64, statistics.rays as f64].map(units::decimal);
    info.line("records", &format!("{count} from {walks}walks and {rays}rays"));
    for line in statistics::records(statistics) {
        info.line("", &line);
    }
    if let Some(levels) = statistics::levels(statistics) {
        info.line("", &levels);
    }
    info.json.insert("statistics".to_owned(), statistics::cache_json(statistics));
}

/// Where the records are, and how far they reach.
fn geometry(info: &mut Info, records: &[Record]) {
    if records.is_empty() {
        return;
    }
    let bounds = records.iter().fold(Bounds3::EMPTY, |b, r| b.including(r.position));
    let [min, max] = [bounds.min, bounds.max].map(|corner| corner.to_array());
    info.line("bounds", &format!("{} to {}", triple(min), triple(max)));
    info.json.insert("bounds".to_owned(), json!([min, max]));
    let mut object = Map::new();
    for (label, way, member) in [("radii", 0, "along_axis"), ("", 1, "across_axis")] {
        let quantiles = quantiles(records.iter().map(|r| r.radii[way]).collect());
        let [least, low, median, high, most] = quantiles.map(number);
        let name = member.replace('_', " ");
        info.line(
            label,
            &format!("{least}, 10 % {low}, half {median}, 90 % {high}, all {most} {name}"),
        );
        object.insert(member.to_owned(), json!(quantiles));
    }
    info.json.insert("radii".to_owned(), Value::Object(object));
}

/// Least, 10 %, median, 90 % and largest of values, of which there is one at least.
fn quantiles(mut values: Vec<f32>) -> [f32; 5] {
    values.sort_unstable_by(f32::total_cmp);
    let last = values.len().saturating_sub(1);
    [0, 10, 50, 90, 100].map(|percent| values[(last * percent + 50) / 100])
}

fn memory(info: &mut Info, cache: &CacheFile) {
    let contents = &cache.contents;
    let records = size_of_val(&contents.records[..]) as u64;
    let surroundings = contents.surroundings_bytes() as u64;
    let hash = contents.memory_bytes() as u64 - records - surroundings;
    let cells = contents.hash_cells();
    let mut text = format!("records {}", units::bytes(records));
    if surroundings > 0 {
        text.push_str(&format!(", what they saw {}", units::bytes(surroundings)));
    }
    if let Some(cells) = cells {
        let cells = units::plural(cells as u64, "cell");
        text.push_str(&format!(", hash {} ({cells})", units::bytes(hash)));
    }
    info.line("memory", &text);
    info.json.insert("hash_cells".to_owned(), json!(cells));
    let bytes = json!({ "records": records, "surroundings": surroundings, "hash": hash });
    info.json.insert("memory_bytes".to_owned(), bytes);
}

fn export(args: &ExportArgs, console: &Console) -> Result<Exit, Failure> {
    let outputs: Vec<&Path> =
        [&args.to.ply, &args.to.csv].into_iter().flatten().map(|p| &**p).collect();
    check_writable(&outputs)?;
    let records = cache_file::read(&args.file)?.contents.records;
    if let Some(file) = &args.to.ply {
        write(file, |w| write_ply(w, &records))?;
    }
    if let Some(file) = &args.to.csv {
        write(file, |w| write_csv(w, &records))?;
    }
    let names: Vec<String> = outputs.iter().map(|path| path.display().to_string()).collect();
    names.iter().for_each(|name| console.result(name));
    console.result(&units::plural(records.len() as u64, "record"));
    console.event(&json!({ "event": "result", "outputs": names, "records": records.len() }));
    Ok(Exit::Success)
}

fn write(
    file: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> io::Result<()>,
) -> Result<(), Failure> {
    atomically(file, fill).map_err(|error| Failure::io("cannot write", file, &error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values() {
        assert_eq!(quantiles(vec![3.0]), [3.0; 5]);
        let values = (0..=100).rev().map(|i| i as f32).collect();
        assert_eq!(quantiles(values), [0.0, 10.0, 50.0, 90.0, 100.0]);
    }
}
