//! Where the files that a scene names are looked for.

use std::path::{Path, PathBuf};

use super::source::Files;

/// Folders in which files are looked for.
#[derive(Debug, Clone, Default)]
pub(super) struct SearchPath {
    /// Folders of `<path>`, in the order of the file.
    folders: Vec<PathBuf>,
    /// Folder of the scene file.
    root: PathBuf,
}

/// The folder that holds a file.
fn folder_of(file: &Path) -> &Path {
    file.parent().unwrap_or(Path::new(""))
}

impl SearchPath {
    /// For the scene file `scene`.
    pub(super) fn new(scene: &Path) -> Self {
        Self { folders: Vec::new(), root: folder_of(scene).to_path_buf() }
    }

    /// All places where `name`, said in the file `from`, may be, the best first: folders of
    /// `<path>` (the last one first), the scene's folder, the folder of `from`.
    fn candidates(&self, name: &str, from: &Path) -> Vec<PathBuf> {
        let name = Path::new(name);
        let folders = self.folders.iter().rev().map(PathBuf::as_path);
        let mut all: Vec<PathBuf> = folders
            .chain([self.root.as_path(), folder_of(from)])
            .map(|folder| folder.join(name))
            .collect();
        all.dedup();
        all
    }

    /// The file that is meant by `name` in the file `from`.
    pub(super) fn find(&self, files: &dyn Files, name: &str, from: &Path) -> Option<PathBuf> {
        self.candidates(name, from).into_iter().find(|path| files.is_file(path))
    }

    /// The included file that is meant by `name` in the file `from`: there its own folder comes
    /// first.
    pub(super) fn find_include(
        &self,
        files: &dyn Files,
        name: &str,
        from: &Path,
    ) -> Option<PathBuf> {
        let own = folder_of(from).join(name);
        if files.is_file(&own) { Some(own) } else { self.find(files, name, from) }
    }

    /// `<path value=…>` in the file `from`; false when there is no such folder.
    pub(super) fn add_folder(&mut self, files: &dyn Files, name: &str, from: &Path) -> bool {
        let found = self.candidates(name, from).into_iter().find(|path| files.is_dir(path));
        let is_found = found.is_some();
        self.folders.extend(found);
        is_found
    }
}
