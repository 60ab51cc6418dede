//! The folder of an experiment: finished runs, each in a folder of its own, and a lock.
//!
//! A run is finished when its `run.json` is there: it is written last, and whole or not at all. So
//! whatever ends the program costs the run in progress and nothing else.

use std::fs::{self, File, TryLockError};
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use serde::de::DeserializeOwned;

use crate::error::LabError;

/// The folder, locked.
#[derive(Debug)]
pub(crate) struct Folder {
    root: PathBuf,
    /// Locked as long as the file is open: the system unlocks it whatever ends the program.
    _lock: File,
}

const LOCK: &str = "lock";
/// Holds number and picture of the process that runs.
const RUNNING: &str = "running";

impl Folder {
    /// Makes the folder if there is none, and locks it. A renderer that an experiment left
    /// running when it was killed is ended.
    ///
    /// # Errors
    /// If it cannot be made or written, or if another experiment uses it.
    pub(crate) fn open(root: &Path) -> Result<Self, LabError> {
        fs::create_dir_all(root.join("runs"))
            .map_err(LabError::file("cannot make folder", root))?;
        let folder = Self { root: root.to_owned(), _lock: lock(root)? };
        folder.end_orphan();
        Ok(folder)
    }

    /// The folder itself.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// The folder of a run, made if there is none.
    pub(crate) fn run(&self, id: &str) -> Result<PathBuf, LabError> {
        let path = self.path(id);
        fs::create_dir_all(&path).map_err(LabError::file("cannot make folder", &path))?;
        Ok(path)
    }

    /// Where the folder of a run is or would be.
    pub(crate) fn path(&self, id: &str) -> PathBuf {
        self.root.join("runs").join(id)
    }

    /// Remembers which process runs, so that it can be ended if we cannot wait for it.
    pub(crate) fn note_running(&self, pid: u32, picture: &Path) {
        // Without the note an orphan goes on to its end: no reason to stop.
        let _ = fs::write(self.root.join(RUNNING), format!("{pid}\n{}", picture.display()));
    }

    /// Nothing runs any more.
    pub(crate) fn note_idle(&self) {
        let _ = fs::remove_file(self.root.join(RUNNING));
    }

    /// Ends the process of the note if it still writes that picture.
    fn end_orphan(&self) {
        let Ok(note) = fs::read_to_string(self.root.join(RUNNING)) else { return };
        if let Some((pid, picture)) = note.split_once('\n') {
            kill_if_it_writes(pid, picture);
        }
        self.note_idle();
    }
}

/// A number may belong to another process by now: its command line must name the picture.
#[cfg(unix)]
fn kill_if_it_writes(pid: &str, picture: &str) {
    use rustix::process::{Pid, Signal, kill_process};
    let arguments = fs::read(format!("/proc/{pid}/cmdline")).unwrap_or_default();
    let is_it = arguments.split(|&byte| byte == 0).any(|word| word == picture.as_bytes());
    let pid = pid.parse().ok().and_then(Pid::from_raw);
    if let (true, Some(pid)) = (is_it, pid) {
        let _ = kill_process(pid, Signal::KILL);
    }
}

#[cfg(not(unix))]
fn kill_if_it_writes(_pid: &str, _picture: &str) {}

fn lock(root: &Path) -> Result<File, LabError> {
    let path = root.join(LOCK);
    let options = File::options().read(true).write(true).create(true).truncate(false).open(&path);
    let mut file = options.map_err(LabError::file("cannot write", &path))?;
    match file.try_lock() {
        Ok(()) => {}
        Err(TryLockError::WouldBlock) => {
            let pid = fs::read_to_string(&path).ok().and_then(|text| text.trim().parse().ok());
            return Err(LabError::Locked { folder: root.to_owned(), pid });
        }
        // A file system without locks: better no lock than no experiment.
        Err(TryLockError::Error(_)) => {}
    }
    let note = |file: &mut File| -> io::Result<()> {
        file.set_len(0)?;
        writeln!(file, "{}", std::process::id())
    };
    note(&mut file).map_err(LabError::file("cannot write", &path))?;
    Ok(file)
}

/// A JSON file that is whole or not there.
pub(crate) fn write_json(path: &Path, value: &impl Serialize) -> Result<(), LabError> {
    let mut text = serde_json::to_vec_pretty(value)
        .map_err(io::Error::from)
        .map_err(LabError::file("cannot write", path))?;
    text.push(b'\n');
    write(path, &text)
}

/// A file that is whole or not there.
pub(crate) fn write(path: &Path, bytes: &[u8]) -> Result<(), LabError> {
    let result: io::Result<()> = claror_io::write::atomically(path, |w| w.write_all(bytes));
    result.map_err(LabError::file("cannot write", path))
}

/// What a JSON file holds; nothing if it is not there or means something else: then it is made
/// again.
pub(crate) fn read_json<T: DeserializeOwned>(path: &Path) -> Option<T> {
    serde_json::from_slice(&fs::read(path).ok()?).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_experiments_do_not_share_a_folder() {
        let place = tempfile::tempdir().expect("a folder");
        let root = place.path().join("a/b");
        let first = Folder::open(&root).expect("the first");
        let error = Folder::open(&root).expect_err("the second");
        let pid = format!("(process {})", std::process::id());
        assert!(error.to_string().contains(&pid), "{error}");
        drop(first);
        Folder::open(&root).expect("it is free again");
    }

    #[test]
    fn a_lock_left_by_a_killed_program_does_not_count() {
        let place = tempfile::tempdir().expect("a folder");
        fs::write(place.path().join(LOCK), "1\n").expect("writable");
        Folder::open(place.path()).expect("nobody holds it");
    }

    #[test]
    fn broken_records_are_no_records() {
        let place = tempfile::tempdir().expect("a folder");
        let path = place.path().join("run.json");
        assert_eq!(read_json::<Vec<u32>>(&path), None);
        fs::write(&path, "[1, 2").expect("writable");
        assert_eq!(read_json::<Vec<u32>>(&path), None);
        write_json(&path, &[1, 2]).expect("writable");
        assert_eq!(read_json::<Vec<u32>>(&path), Some(vec![1, 2]));
    }
}
