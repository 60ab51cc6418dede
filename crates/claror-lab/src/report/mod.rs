//! The report: one page that needs nothing else, and charts for papers.
//!
//! [`fn@write`] makes `report.html`, which holds its pictures, data and programs and asks no network
//! for anything, and `charts/*.svg` with their data as `*.csv`.

mod chart;
mod charts;
mod findings;
mod glossary;
mod number;
mod page;
mod pictures;
mod scene;
mod strips;
mod svg;
mod tables;
#[cfg(test)]
mod testing;
mod ticks;

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use chart::Chart;
use pictures::Pictures;

use crate::study::{SceneStudy, Study};

/// Room for pictures in the page, all scenes together, in bytes.
const PICTURE_BYTES: usize = 40_000_000;

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// A folder or file of the report cannot be written.
    #[error("the report cannot be written to {}: {source}", path.display())]
    Write {
        /// What was to be written.
        path: PathBuf,
        /// What the system says.
        source: io::Error,
    },
}

/// A scene with all that the page shows of it.
struct Scene<'a> {
    study: &'a SceneStudy,
    /// Unique in the page, fit for ids and file names.
    slug: String,
    charts: Vec<Chart>,
    pictures: Pictures,
    /// By series and setting: illustrations as data addresses, or why not.
    illustrations: BTreeMap<(usize, usize), Vec<Result<String, String>>>,
}

impl Scene<'_> {
    fn illustration_bytes(&self) -> usize {
        self.illustrations.values().flatten().flatten().map(String::len).sum()
    }

    fn picture_bytes(&self) -> usize {
        self.illustration_bytes() + self.pictures.bytes()
    }
}

/// Divides room so that who needs less than an equal share leaves the rest to the others.
fn fair_shares(needs: &[usize], mut room: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..needs.len()).collect();
    order.sort_by_key(|&i| needs[i]);
    let mut shares = vec![0; needs.len()];
    for (served, i) in order.into_iter().enumerate() {
        shares[i] = needs[i].min(room / (needs.len() - served));
        room -= shares[i];
    }
    shares
}

/// Writes `report.html` and `charts/` into `folder`, where the pictures are that the study names,
/// each file whole or not at all, and returns the path of the page. Pictures that cannot be read
/// are named in the page; they are no error.
pub fn write(study: &Study, folder: &Path) -> Result<PathBuf, ReportError> {
    let mut scenes: Vec<Scene<'_>> =
        study.scenes.iter().enumerate().map(|(i, s)| prepare(i, s, folder)).collect();
    let needs: Vec<usize> = scenes.iter().map(Scene::picture_bytes).collect();
    for (scene, room) in scenes.iter_mut().zip(fair_shares(&needs, PICTURE_BYTES)) {
        scene.pictures.keep_within(room.saturating_sub(scene.illustration_bytes()), scene.study);
    }
    let chart_folder = folder.join("charts");
    std::fs::create_dir_all(&chart_folder)
        .map_err(|source| ReportError::Write { path: chart_folder.clone(), source })?;
    for scene in &scenes {
        for chart in &scene.charts {
            let name = chart_file(scene, chart);
            write_file(&chart_folder.join(format!("{name}.svg")), &svg::file(chart))?;
            write_file(&chart_folder.join(format!("{name}.csv")), &chart.csv())?;
        }
    }
    let path = folder.join("report.html");
    write_file(&path, &page::page(study, &scenes).into_string())?;
    Ok(path)
}

fn prepare<'a>(index: usize, study: &'a SceneStudy, folder: &Path) -> Scene<'a> {
    let mut illustrations = BTreeMap::new();
    for (i, series) in study.series.iter().enumerate() {
        for (j, setting) in series.settings.iter().enumerate() {
            let all = setting.illustrations.iter();
            let all: Vec<_> =
                all.map(|one| pictures::illustration(&folder.join(&one.picture))).collect();
            illustrations.insert((i, j), all);
        }
    }
    Scene {
        study,
        slug: pictures::scene_slug(index, study),
        charts: charts::of_scene(study),
        pictures: Pictures::of_scene(study, folder),
        illustrations,
    }
}

/// Name of a chart's files without ending.
fn chart_file(scene: &Scene<'_>, chart: &Chart) -> String {
    format!("{}-{}", scene.slug, chart.id)
}

fn write_file(path: &Path, text: &str) -> Result<(), ReportError> {
    claror_io::write::atomically(path, |w| w.write_all(text.as_bytes()))
        .map_err(|source| ReportError::Write { path: path.to_path_buf(), source })
}

/// A command as a POSIX shell reads it.
fn command_line(words: &[String]) -> String {
    let plain = |c: char| c.is_ascii_alphanumeric() || "-_./=:,+@%".contains(c);
    let word = |w: &String| {
        if !w.is_empty() && w.chars().all(plain) {
            w.clone()
        } else {
            format!("'{}'", w.replace('\'', r"'\''"))
        }
    };
    words.iter().map(word).collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_are_shared_fairly() {
        assert_eq!(fair_shares(&[10, 2, 30], 30), [10, 2, 18]);
        assert_eq!(fair_shares(&[10, 20, 30], 30), [10, 10, 10]);
        assert_eq!(fair_shares(&[1, 2], 30), [1, 2]);
        assert!(fair_shares(&[], 30).is_empty());
    }

    #[test]
    fn command_lines_survive_a_shell() {
        let words = ["claror", "a b.xml", "it's", "", "-p", "x=1"].map(String::from);
        assert_eq!(command_line(&words), r"claror 'a b.xml' 'it'\''s' '' -p x=1");
    }
}
