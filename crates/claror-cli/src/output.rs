//! Pictures out: which files, whether they can be written, and what they say about themselves.

use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use claror::film::Picture;
use claror_io::image::{self, BitDepth, Format, Layer, MetadataValue, WriteError};
use claror_io::write::atomically;

use crate::exit::{Exit, Failure, describe};
use crate::messages::Stdout;

/// Where a picture goes.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) enum Destination {
    File(PathBuf),
    Stdout,
}

/// A picture to write.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Output {
    pub(crate) destination: Destination,
    pub(crate) format: Format,
}

impl Output {
    /// The output that `-o argument` asks for; `format` is that of standard output.
    pub(crate) fn new(argument: &Path, format: Format) -> Result<Self, Failure> {
        if argument == Path::new("-") {
            return Ok(Self { destination: Destination::Stdout, format });
        }
        let format = Format::of_path(argument).ok_or_else(|| {
            Failure::usage(format!("the ending of {} names no picture format", argument.display()))
                .hint("the endings are .exr, .png, .hdr and .pfm")
        })?;
        Ok(Self { destination: Destination::File(argument.to_owned()), format })
    }

    /// The file it goes to, if it goes to one.
    pub(crate) fn file(&self) -> Option<&Path> {
        match &self.destination {
            Destination::File(path) => Some(path),
            Destination::Stdout => None,
        }
    }

    /// The pictures that are written when none is named.
    pub(crate) fn defaults(scene: &Path) -> Result<Vec<Self>, Failure> {
        let stem = scene.file_stem().ok_or_else(|| {
            Failure::usage(format!("{} is not the name of a scene file", scene.display()))
        })?;
        let named = |ending: &str, format| {
            let mut name = stem.to_owned();
            name.push(ending);
            Self { destination: Destination::File(name.into()), format }
        };
        Ok(vec![named(".exr", Format::Exr), named(".png", Format::Png)])
    }

    /// As the user knows it.
    pub(crate) fn name(&self) -> String {
        match &self.destination {
            Destination::File(path) => path.display().to_string(),
            Destination::Stdout => "standard output".to_owned(),
        }
    }

    /// Writes the picture, whole or not at all.
    pub(crate) fn write(&self, content: &Content, stdout: &Stdout) -> Result<(), Failure> {
        match &self.destination {
            Destination::Stdout => {
                let mut bytes = Vec::new();
                content.encode(self.format, &mut bytes).map_err(|e| self.failure(&e))?;
                stdout.write(&bytes);
                Ok(())
            }
            Destination::File(path) => {
                atomically(path, |w: &mut BufWriter<&File>| content.encode(self.format, w))
                    .map_err(|e: WriteError| self.failure(&e))
            }
        }
    }

    fn failure(&self, error: &WriteError) -> Failure {
        let why = match error {
            WriteError::Io(error) => describe(error),
            WriteError::Unsupported(message) => message.clone(),
        };
        Failure::new(Exit::File, format!("cannot write {}: {why}", self.name()))
    }
}

/// What a picture file holds.
pub(crate) struct Content<'a> {
    pub(crate) picture: &'a Picture,
    /// Whether OpenEXR files get the parts of the light, variance and sample counts.
    pub(crate) layers: bool,
    /// Stops by which 8-bit pictures are made brighter.
    pub(crate) exposure: f32,
    /// What OpenEXR files say about how they were made.
    pub(crate) metadata: Vec<(String, MetadataValue)>,
}

impl Content<'_> {
    fn encode(&self, format: Format, w: &mut impl Write) -> Result<(), WriteError> {
        let beauty = &self.picture.beauty.image;
        match format {
            Format::Exr => image::write_exr(w, &self.exr_layers(), &self.metadata),
            Format::Png => image::write_png(w, beauty, self.exposure, BitDepth::Eight),
            Format::Hdr => image::write_hdr(w, beauty),
            Format::Pfm => image::write_pfm(w, beauty),
        }
    }

    fn exr_layers(&self) -> Vec<Layer<'_>> {
        let picture = self.picture;
        let mut layers = vec![&picture.beauty];
        if self.layers {
            layers.extend(&picture.parts);
            layers.extend([&picture.variance, &picture.samples]);
        }
        layers.extend(&picture.aovs);
        layers
            .into_iter()
            .map(|layer| Layer::with_channels(&*layer.name, &layer.channels, &layer.image))
            .collect()
    }
}

/// Fails if two of the files are the same, or if one of them surely cannot be written. Better
/// said before an hour of work than after.
pub(crate) fn check_writable(files: &[&Path]) -> Result<(), Failure> {
    let mut seen: Vec<PathBuf> = Vec::new();
    for file in files {
        let place = check_place(file)?;
        if seen.contains(&place) {
            return Err(Failure::usage(format!("{} would be written twice", file.display())));
        }
        seen.push(place);
    }
    Ok(())
}

/// The file's unambiguous name, if its folder accepts new files.
fn check_place(file: &Path) -> Result<PathBuf, Failure> {
    let cannot =
        |why: &str| Failure::new(Exit::File, format!("cannot write {}: {why}", file.display()));
    match std::fs::metadata(file) {
        Ok(metadata) if metadata.is_dir() => return Err(cannot("it is a folder")),
        // Pipes and devices are written as they are.
        Ok(metadata) if !metadata.is_file() => return Ok(file.to_owned()),
        _ => {}
    }
    let name = file.file_name().ok_or_else(|| cannot("it names no file"))?;
    let folder = match file.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let resolved = folder.canonicalize().map_err(|error| {
        let folder = folder.display();
        match error.kind() {
            io::ErrorKind::NotFound => cannot(&format!("there is no folder {folder}")),
            _ => cannot(&format!("folder {folder}: {}", describe(&error))),
        }
    })?;
    if !resolved.is_dir() {
        return Err(cannot(&format!("{} is not a folder", folder.display())));
    }
    tempfile::tempfile_in(&resolved).map_err(|error| {
        cannot(&format!("folder {} takes no new file: {}", folder.display(), describe(&error)))
    })?;
    Ok(resolved.join(name))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_decides_on_the_format() {
        let format = |name: &str| Output::new(Path::new(name), Format::Exr).map(|o| o.format);
        assert_eq!(format("a.PNG").ok(), Some(Format::Png));
        assert_eq!(format("-").ok(), Some(Format::Exr));
        assert!(format("a.jpeg").is_err() && format("exr").is_err());
    }

    #[test]
    fn default_names_follow_the_scene() {
        let outputs = Output::defaults(Path::new("scenes/box.v2.xml")).expect("a file name");
        let names: Vec<String> = outputs.iter().map(Output::name).collect();
        assert_eq!(names, ["box.v2.exr", "box.v2.png"]);
        assert!(Output::defaults(Path::new("..")).is_err());
    }

    #[test]
    fn files_are_the_same_however_they_are_written() {
        let folder = tempfile::tempdir().expect("a folder");
        let (plain, dotted) = (folder.path().join("a.exr"), folder.path().join("./a.exr"));
        let failure = check_writable(&[&plain, &dotted]).expect_err("twice the same");
        assert_eq!(failure.exit, Exit::Usage);
        check_writable(&[&plain, &folder.path().join("b.exr")]).expect("two files");
    }

    #[test]
    fn folders_that_take_no_file_are_noticed() {
        let folder = tempfile::tempdir().expect("a folder");
        for impossible in [folder.path().to_owned(), folder.path().join("no/a.exr")] {
            let failure = check_writable(&[&impossible]).expect_err("not writable");
            assert_eq!(failure.exit, Exit::File);
        }
    }
}
