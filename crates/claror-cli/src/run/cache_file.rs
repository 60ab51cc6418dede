//! Irradiance caches as files: what the records depend on, which views they were made for, then
//! the records.

use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use claror::integrator::{CacheContents, IrradianceCache};
use claror::render::Fingerprint;
use claror::sensor::Sensor;
use claror_io::container::{self, Container, Header, Kind};
use claror_io::diagnostic::Subject;
use claror_io::{Limits, ReadError};

use super::info::triple;
use crate::exit::{Exit, Failure};
use crate::units;

/// Name of the block with the records.
const CACHE: &str = "cache";
/// Begin of the names of fields that tell a view; a number follows.
const VIEW: &str = "view ";

/// The content of a file.
#[derive(Debug)]
pub(crate) struct CacheFile {
    /// What the records depend on.
    pub(crate) fingerprint: Fingerprint,
    /// Where they were made, for people.
    pub(crate) views: Vec<String>,
    pub(crate) contents: CacheContents,
}

/// Reads a cache.
pub(crate) fn read(path: &Path) -> Result<CacheFile, Failure> {
    let error = |message: String| ReadError {
        file: path.to_owned(),
        subject: Subject::File,
        line: None,
        message,
        hint: None,
    };
    let container = container::read(path, Kind::Cache, &Limits::default())?;
    // The layout of the records is that of a version.
    let (version, now) = (container.header.get("version"), env!("CARGO_PKG_VERSION"));
    if version != Some(now) {
        let (path, version) = (path.display(), version.unwrap_or("unknown"));
        let message = format!("{path} is a cache of claror {version}, this is claror {now}");
        return Err(Failure::new(Exit::Mismatch, message).hint(REPLACE));
    }
    let bytes = container
        .block(CACHE)
        .ok_or_else(|| error("the file holds no records of a cache".to_owned()))?;
    let contents = CacheContents::from_bytes(bytes)
        .map_err(|e| error(format!("the irradiance cache: {e}")))?;
    let (views, entries): (Vec<_>, Vec<_>) =
        container.header.fields.into_iter().partition(|(name, _)| name.starts_with(VIEW));
    let views = views.into_iter().map(|(_, view)| view).collect();
    Ok(CacheFile { fingerprint: Fingerprint { entries }, views, contents })
}

/// What to do about a cache that does not fit.
pub(super) const REPLACE: &str =
    "give the options that it was made with, or replace it by --cache-mode write";

/// Writes the cache of a render when it is complete, whole or not at all.
#[derive(Debug)]
pub(crate) struct CacheWriter<'a> {
    file: &'a Path,
    fingerprint: Fingerprint,
    /// The views of the records that there were before, how many those were, and the new view.
    views: Vec<String>,
    earlier: usize,
    view: String,
    is_written: AtomicBool,
}

impl<'a> CacheWriter<'a> {
    pub(crate) fn new(
        file: &'a Path,
        fingerprint: Fingerprint,
        sensor: &Sensor,
        first: Option<&CacheFile>,
    ) -> Self {
        Self {
            file,
            fingerprint,
            views: first.map_or_else(Vec::new, |first| first.views.clone()),
            earlier: first.map_or(0, |first| first.contents.records.len()),
            view: view(sensor),
            is_written: AtomicBool::new(false),
        }
    }

    /// False after a failure, and when there was nothing to write yet.
    pub(crate) fn is_written(&self) -> bool {
        self.is_written.load(Ordering::Relaxed)
    }

    pub(crate) fn write(&self, cache: &IrradianceCache) -> Result<(), Failure> {
        let added = cache.records.len().saturating_sub(self.earlier);
        let view = format!("{}: {}", self.view, units::plural(added as u64, "record"));
        let views = self.views.iter().chain((added > 0).then_some(&view));
        let views = views.zip(1..).map(|(view, n)| (format!("{VIEW}{n}"), view.clone()));
        let fields = self.fingerprint.entries.iter().cloned().chain(views).collect();
        let blocks = vec![(CACHE.to_owned(), cache.to_bytes())];
        let container = Container { header: Header { fields }, blocks };
        container::write(self.file, Kind::Cache, &container)
            .map_err(|error| Failure::io("cannot write", self.file, &error))?;
        self.is_written.store(true, Ordering::Relaxed);
        Ok(())
    }
}

/// `"front" at (0, 1, 5) looking along (0, -0.1, -1), 640x480 pixels`.
fn view(sensor: &Sensor) -> String {
    let to_world = &sensor.to_world.to_world;
    let [at, along] = [to_world.translation, to_world.matrix3.z_axis.normalize_or_zero()]
        .map(|v| triple(v.to_array()));
    let name = match sensor.name.as_str() {
        "" => "sensor".to_owned(),
        name => format!("\"{name}\""),
    };
    let crop = sensor.film.crop;
    format!("{name} at {at} looking along {along}, {}x{} pixels", crop.width, crop.height)
}
