//! Writing files whole or not at all.

use std::fs::{File, Metadata, Permissions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file so that at every moment, also after a crash or on a full disk, `path` names
/// either the old file or the whole new one: `fill` writes to a temporary file in the same folder,
/// which is synchronised with the disk and then renamed. On an error the temporary file is
/// removed. Symbolic links are followed, permissions of an old file kept. What is no regular file,
/// such as a pipe or `/dev/null`, is written to directly.
pub fn atomically<E: From<io::Error>>(
    path: &Path,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<(), E>,
) -> Result<(), E> {
    let target = resolve_links(path)?;
    let old = std::fs::metadata(&target).ok();
    if old.as_ref().is_some_and(|m| !m.is_file()) {
        let file = File::options().write(true).open(&target)?;
        return fill_and_flush(&file, fill);
    }
    let temporary = create_temporary(&target, old.as_ref())?;
    fill_and_flush(temporary.as_file(), fill)?;
    temporary.as_file().sync_all()?;
    temporary.persist(&target).map_err(|e| e.error)?;
    sync_folder(&target);
    Ok(())
}

fn fill_and_flush<E: From<io::Error>>(
    file: &File,
    fill: impl FnOnce(&mut BufWriter<&File>) -> Result<(), E>,
) -> Result<(), E> {
    let mut writer = BufWriter::with_capacity(1 << 16, file);
    let filled = fill(&mut writer);
    if filled.is_err() {
        // What is still in the buffer belongs to a file that nobody wants.
        let _ = writer.into_parts();
        return filled;
    }
    writer.flush()?;
    Ok(())
}

/// Where the links at the end of `path` lead, also when nothing is there yet.
fn resolve_links(path: &Path) -> io::Result<PathBuf> {
    const MAX_LINKS: usize = 40;
    let mut target = path.to_path_buf();
    for _ in 0..MAX_LINKS {
        match std::fs::read_link(&target) {
            Ok(link) => {
                let folder = target.parent().unwrap_or(Path::new(""));
                target = folder.join(link);
            }
            Err(_) => return Ok(target),
        }
    }
    Err(io::Error::other("too many symbolic links"))
}

fn create_temporary(target: &Path, old: Option<&Metadata>) -> io::Result<tempfile::NamedTempFile> {
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut builder = tempfile::Builder::new();
    builder.prefix(".claror-").suffix(".tmp");
    if let Some(permissions) = new_file_permissions() {
        builder.permissions(permissions);
    }
    let temporary = builder.tempfile_in(folder)?;
    if let Some(old) = old {
        temporary.as_file().set_permissions(old.permissions())?;
    }
    Ok(temporary)
}

/// What the system gives new files: all may read and write, less the user's mask.
fn new_file_permissions() -> Option<Permissions> {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        Some(Permissions::from_mode(0o666))
    }
    #[cfg(not(unix))]
    None
}

/// Makes the rename itself durable. Failure is no reason to report one: the file is whole.
fn sync_folder(target: &Path) {
    if let Some(folder) = target.parent().filter(|f| !f.as_os_str().is_empty()) {
        let _ = File::open(folder).and_then(|f| f.sync_all());
    }
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn entries(folder: &Path) -> Vec<String> {
        let name = |e: io::Result<fs::DirEntry>| e.unwrap().file_name().into_string().unwrap();
        let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
        names.sort();
        names
    }

    #[test]
    fn a_failed_write_leaves_the_old_file_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        fs::write(&path, "old").unwrap();
        let full = |w: &mut BufWriter<&File>| {
            w.write_all(&vec![b'x'; 1 << 17])?;
            Err(io::Error::from(io::ErrorKind::StorageFull))
        };
        let error = atomically(&path, full).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
        assert_eq!(fs::read(&path).unwrap(), b"old");
        assert_eq!(entries(folder.path()), ["out"]);
        let panics = || atomically(&path, |_| -> io::Result<()> { panic!("a bug in the writer") });
        assert!(std::panic::catch_unwind(panics).is_err());
        assert_eq!(entries(folder.path()), ["out"]);
        assert_eq!(fs::read(&path).unwrap(), b"old");
    }

    #[test]
    fn the_new_file_is_whole() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("out");
        for text in ["first", "second, longer"] {
            atomically(&path, |w| w.write_all(text.as_bytes())).unwrap();
            assert_eq!(fs::read(&path).unwrap(), text.as_bytes());
        }
        assert_eq!(entries(folder.path()), ["out"]);
        let nowhere = folder.path().join("none/out");
        let error = atomically(&nowhere, |w| w.write_all(b"x")).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::NotFound);
    }

    #[cfg(unix)]
    #[test]
    fn links_are_followed_and_permissions_kept() {
        use std::os::unix::fs::{PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (real, link) = (folder.path().join("real"), folder.path().join("link"));
        symlink("real", &link).unwrap();
        // Through a link that leads nowhere yet.
        atomically(&link, |w| w.write_all(b"1")).unwrap();
        fs::set_permissions(&real, Permissions::from_mode(0o640)).unwrap();
        atomically(&link, |w| w.write_all(b"2")).unwrap();
        assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
        assert_eq!(fs::read(&real).unwrap(), b"2");
        assert_eq!(fs::metadata(&real).unwrap().permissions().mode() & 0o777, 0o640);
        let circle = folder.path().join("circle");
        symlink("circle", &circle).unwrap();
        assert!(atomically(&circle, |w| w.write_all(b"3")).is_err());
    }

    #[cfg(target_os = "linux")]
    #[test]
    fn devices_are_written_to_directly() {
        atomically(Path::new("/dev/null"), |w| w.write_all(b"x")).unwrap();
        let error = atomically(Path::new("/dev/full"), |w| w.write_all(b"x")).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::StorageFull);
    }
}
