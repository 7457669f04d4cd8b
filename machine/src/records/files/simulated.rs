//! A disk in memory that fails on demand and loses what was not synced.
//!
//! For tests of what is kept. After a power cut each change that was not synced may be there or not, in any
//! combination: a write also in part, a name without its content. A sync that fails has lost its pages, as on Linux.

use std::collections::BTreeMap;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Files, OpenFile};

/// How a call of a simulated disk goes wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fault {
    /// This error of the operating system, and nothing done.
    Error(i32),
    /// This error, and every second byte of the call's writing done before.
    Partly(i32),
    /// The program ends at this call: no later one does anything.
    End,
}

/// A disk in memory; copies share it.
#[derive(Clone, Debug, Default)]
pub struct SimulatedFiles {
    disk: Arc<Mutex<Disk>>,
}

/// What a file has of content: all that was written, and what a power cut leaves.
#[derive(Clone, Debug, Default)]
struct Content {
    now: Vec<u8>,
    durable: Vec<u8>,
    unsynced: Vec<Change>,
}

#[derive(Clone, Debug)]
enum Change {
    Write { at: usize, bytes: Vec<u8> },
    Length(usize),
}

#[derive(Clone, Debug)]
enum NameChange {
    Set {
        name: PathBuf,
        node: Node,
    },
    Renamed {
        from: PathBuf,
        to: PathBuf,
        node: Node,
    },
    Removed {
        name: PathBuf,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Node {
    Folder,
    File { content: usize, mode: u32 },
}

#[derive(Debug, Default)]
struct Disk {
    contents: Vec<Content>,
    names: BTreeMap<PathBuf, Node>,
    durable_names: BTreeMap<PathBuf, Node>,
    unsynced_names: Vec<NameChange>,
    calls: usize,
    faults: BTreeMap<usize, Fault>,
    has_ended: bool,
}

impl Disk {
    /// Counts a call, and says how much of it happens: all, half with an error, or nothing.
    fn begin_call(&mut self) -> Result<Option<i32>, io::Error> {
        if self.has_ended {
            return Err(io::Error::other("the program has ended"));
        }
        let fault = self.faults.remove(&self.calls);
        self.calls += 1;
        match fault {
            None => Ok(None),
            Some(Fault::Partly(errno)) => Ok(Some(errno)),
            Some(Fault::Error(errno)) => Err(io::Error::from_raw_os_error(errno)),
            Some(Fault::End) => {
                self.has_ended = true;
                Err(io::Error::other("the program has ended"))
            }
        }
    }

    /// A call that happens whole or not at all.
    fn begin_whole_call(&mut self) -> io::Result<()> {
        match self.begin_call()? {
            None => Ok(()),
            Some(errno) => Err(io::Error::from_raw_os_error(errno)),
        }
    }

    fn file(&self, path: &Path) -> io::Result<(usize, u32)> {
        match self.names.get(path) {
            Some(Node::File { content, mode }) => Ok((*content, *mode)),
            Some(Node::Folder) => Err(io::ErrorKind::IsADirectory.into()),
            None => Err(io::ErrorKind::NotFound.into()),
        }
    }

    fn check_folder_above(&self, path: &Path) -> io::Result<()> {
        let above = path.parent().unwrap_or(Path::new(""));
        if !is_made(&above) || self.names.get(above) == Some(&Node::Folder) {
            Ok(())
        } else {
            Err(io::ErrorKind::NotFound.into())
        }
    }

    fn set_name(&mut self, name: &Path, node: Node) {
        self.names.insert(name.to_owned(), node);
        let name = name.to_owned();
        self.unsynced_names.push(NameChange::Set { name, node });
    }
}

impl NameChange {
    fn is_in(&self, folder: &Path) -> bool {
        match self {
            Self::Set { name, .. } | Self::Removed { name } => name.parent() == Some(folder),
            Self::Renamed { to, .. } => to.parent() == Some(folder),
        }
    }

    fn apply(self, names: &mut BTreeMap<PathBuf, Node>) {
        match self {
            Self::Set { name, node } => drop(names.insert(name, node)),
            Self::Removed { name } => drop(names.remove(&name)),
            Self::Renamed { from, to, node } => {
                names.remove(&from);
                names.insert(to, node);
            }
        }
    }
}

impl Change {
    fn apply(&self, bytes: &mut Vec<u8>, share: f64) {
        match self {
            Self::Length(length) => bytes.resize(*length, 0),
            Self::Write { at, bytes: written } => {
                // As many as the share says; all of them at 1.
                let count = (written.len() as f64 * share).ceil() as usize;
                let end = at + count.min(written.len());
                let count = end - at;
                if bytes.len() < end {
                    bytes.resize(end, 0);
                }
                bytes[*at..end].copy_from_slice(&written[..count]);
            }
        }
    }
}

impl SimulatedFiles {
    /// An empty disk.
    pub fn new() -> Self {
        Self::default()
    }

    fn disk(&self) -> MutexGuard<'_, Disk> {
        self.disk.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// How many calls have changed something or could have.
    pub fn calls(&self) -> usize {
        self.disk().calls
    }

    /// Lets call number `call`, counted from 0, go wrong.
    pub fn fail(&self, call: usize, fault: Fault) {
        self.disk().faults.insert(call, fault);
    }

    /// Starts a program anew on the same disk: what the last one wrote is there.
    pub fn restart(&self) {
        let mut disk = self.disk();
        disk.has_ended = false;
        disk.faults.clear();
    }

    /// Cuts the power and starts anew. `share` is asked for each change that was not synced: 0 where it is lost,
    /// 1 where it is there, between them a part of a write.
    pub fn cut_power(&self, mut share: impl FnMut() -> f64) {
        let mut disk = self.disk();
        let changes = core::mem::take(&mut disk.unsynced_names);
        for change in changes {
            if share() >= 0.5 {
                change.apply(&mut disk.durable_names);
            }
        }
        for content in &mut disk.contents {
            for change in core::mem::take(&mut content.unsynced) {
                let share = share();
                if share > 0.0 {
                    change.apply(&mut content.durable, share);
                }
            }
            content.now = content.durable.clone();
        }
        let durable = disk.durable_names.clone();
        let is_reachable = |path: &Path| {
            let mut above = path.ancestors().skip(1).filter(is_made);
            above.all(|folder| durable.get(folder) == Some(&Node::Folder))
        };
        disk.durable_names.retain(|path, _| is_reachable(path));
        disk.names = disk.durable_names.clone();
        disk.has_ended = false;
        disk.faults.clear();
    }
}

/// Whether a folder has to be made: the root and the folder of the program are there.
fn is_made(folder: &&Path) -> bool {
    folder.parent().is_some() && !folder.as_os_str().is_empty()
}

impl Files for SimulatedFiles {
    fn read(&self, path: &Path) -> io::Result<Vec<u8>> {
        let disk = self.disk();
        let (content, _) = disk.file(path)?;
        Ok(disk.contents[content].now.clone())
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        let disk = self.disk();
        if disk.names.get(folder) != Some(&Node::Folder) {
            return Err(io::ErrorKind::NotFound.into());
        }
        let inside = disk
            .names
            .keys()
            .filter(|name| name.parent() == Some(folder));
        Ok(inside
            .filter_map(|name| Some(PathBuf::from(name.file_name()?)))
            .collect())
    }

    fn make_folder(&self, folder: &Path) -> io::Result<()> {
        let missing: Vec<_> = {
            let disk = self.disk();
            let folders = folder.ancestors().filter(is_made);
            let missing = folders.filter(|folder| !disk.names.contains_key(*folder));
            missing.map(Path::to_owned).collect()
        };
        for folder in missing.iter().rev() {
            {
                let mut disk = self.disk();
                disk.begin_whole_call()?;
                disk.set_name(folder, Node::Folder);
            }
            self.sync_folder(folder.parent().unwrap_or(Path::new("")))?;
        }
        Ok(())
    }

    fn create(&self, path: &Path, mode: Option<u32>) -> io::Result<Box<dyn OpenFile>> {
        let mut disk = self.disk();
        disk.begin_whole_call()?;
        disk.check_folder_above(path)?;
        if disk.names.contains_key(path) {
            return Err(io::ErrorKind::AlreadyExists.into());
        }
        let content = disk.contents.len();
        disk.contents.push(Content::default());
        let mode = mode.unwrap_or(0o644);
        disk.set_name(path, Node::File { content, mode });
        let files = self.clone();
        Ok(Box::new(SimulatedFile { files, content }))
    }

    fn open(&self, path: &Path) -> io::Result<Box<dyn OpenFile>> {
        let mut disk = self.disk();
        disk.begin_whole_call()?;
        let (content, _) = disk.file(path)?;
        let files = self.clone();
        Ok(Box::new(SimulatedFile { files, content }))
    }

    fn mode(&self, path: &Path) -> io::Result<u32> {
        Ok(self.disk().file(path)?.1)
    }

    fn identity(&self, path: &Path) -> io::Result<Option<String>> {
        let (content, _) = self.disk().file(path)?;
        Ok(Some(content.to_string()))
    }

    fn rename(&self, from: &Path, to: &Path) -> io::Result<()> {
        let mut disk = self.disk();
        disk.begin_whole_call()?;
        disk.check_folder_above(to)?;
        disk.file(from)?;
        let node = disk.names.remove(from).ok_or(io::ErrorKind::NotFound)?;
        disk.names.insert(to.to_owned(), node);
        let (from, to) = (from.to_owned(), to.to_owned());
        disk.unsynced_names
            .push(NameChange::Renamed { from, to, node });
        Ok(())
    }

    fn remove(&self, path: &Path) -> io::Result<()> {
        let mut disk = self.disk();
        disk.begin_whole_call()?;
        disk.file(path)?;
        disk.names.remove(path);
        let name = path.to_owned();
        disk.unsynced_names.push(NameChange::Removed { name });
        Ok(())
    }

    fn sync_folder(&self, folder: &Path) -> io::Result<()> {
        let mut disk = self.disk();
        disk.begin_whole_call()?;
        let (synced, others) = core::mem::take(&mut disk.unsynced_names)
            .into_iter()
            .partition(|change| change.is_in(folder));
        disk.unsynced_names = others;
        for change in Vec::<NameChange>::into_iter(synced) {
            change.apply(&mut disk.durable_names);
        }
        Ok(())
    }
}

/// A file of a simulated disk.
#[derive(Debug)]
struct SimulatedFile {
    files: SimulatedFiles,
    content: usize,
}

impl SimulatedFile {
    fn change(disk: &mut Disk, content: usize, change: Change) {
        let content = &mut disk.contents[content];
        change.apply(&mut content.now, 1.0);
        content.unsynced.push(change);
    }
}

impl OpenFile for SimulatedFile {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let mut disk = self.files.disk();
        let wrong = disk.begin_call()?;
        let count = if wrong.is_some() {
            bytes.len() / 2
        } else {
            bytes.len()
        };
        let at = disk.contents[self.content].now.len();
        let bytes = bytes[..count].to_vec();
        Self::change(&mut disk, self.content, Change::Write { at, bytes });
        if let Some(errno) = wrong {
            // A disk that is full takes a part; the next write hears the error.
            if count > 0 {
                let next = disk.calls;
                disk.faults.insert(next, Fault::Error(errno));
                return Ok(count);
            }
            return Err(io::Error::from_raw_os_error(errno));
        }
        Ok(count)
    }

    fn sync(&mut self) -> io::Result<()> {
        let mut disk = self.files.disk();
        let begun = disk.begin_whole_call();
        let content = &mut disk.contents[self.content];
        let changes = core::mem::take(&mut content.unsynced);
        // Where the call fails, its pages count as clean from now on, although they are not on the disk.
        begun?;
        for change in changes {
            change.apply(&mut content.durable, 1.0);
        }
        Ok(())
    }

    fn set_len(&mut self, length: u64) -> io::Result<()> {
        let mut disk = self.files.disk();
        disk.begin_whole_call()?;
        let length = usize::try_from(length).map_err(io::Error::other)?;
        Self::change(&mut disk, self.content, Change::Length(length));
        Ok(())
    }

    fn length(&self) -> io::Result<u64> {
        Ok(self.files.disk().contents[self.content].now.len() as u64)
    }
}
