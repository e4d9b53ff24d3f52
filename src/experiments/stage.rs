//! Stages: work that is done once and kept under the hash of all that it depends on.
//!
//! A stage works in `OUT/unfinished/NAME-HASH`, which is renamed to `OUT/stages/NAME-HASH` when it is complete. A killed
//! run leaves the unfinished folder; the next run goes on in it where the work can, and starts it again where it cannot.

use std::fs;
use std::path::{Path, PathBuf};
use std::time::Instant;

use serde::{Deserialize, Serialize};
use serde_json::{Value, json};
use sha2::{Digest, Sha256};

use crate::data::{Claim, atomic, files, hex, program};
use crate::error::{Error, Result};

const RECORD: &str = "stage.json";
/// Says that a stage has been begun.
const BEGUN: &str = "begun";

/// The name of a stage and the hash of its settings, of its parents' keys and of the program's version.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Key {
    pub name: String,
    pub hash: String,
}

impl Key {
    /// `name` may hold slashes: folders to sort stages into.
    pub fn new(name: impl Into<String>, settings: &impl Serialize, parents: &[&Key]) -> Self {
        let name = name.into();
        let parents: Vec<String> = parents.iter().map(|parent| parent.folder()).collect();
        let all = json!({ "name": name, "settings": settings, "parents": parents, "version": env!("CARGO_PKG_VERSION") });
        let digest = Sha256::digest(all.to_string());
        Self { name, hash: hex(&digest[..6]) }
    }

    /// `NAME-HASH`.
    pub fn folder(&self) -> String {
        format!("{}-{}", self.name, self.hash)
    }
}

/// What is kept beside a stage's results.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Record {
    pub name: String,
    pub version: String,
    /// First digits of the hash of the program that did it.
    #[serde(default)]
    pub program: String,
    /// Folders of the stages that this one read.
    pub parents: Vec<String>,
    pub settings: Value,
    pub device: String,
    /// Wall clock.
    pub seconds: f64,
    /// An earlier attempt was killed: `seconds` holds the last one only.
    pub resumed: bool,
}

/// The folder of a reproduction; one process at a time.
pub struct Store {
    root: PathBuf,
    device: String,
    program: String,
    /// Held for as long as this process writes here.
    _claim: Claim,
}

impl Store {
    /// # Errors
    /// A folder that cannot be written, or that another process works in.
    pub fn open(root: &Path, device: impl Into<String>) -> Result<Self> {
        let claim = Claim::take(root)?;
        atomic::sweep_all(root);
        Ok(Self { root: root.into(), device: device.into(), program: program(), _claim: claim })
    }

    /// For one stage, or a piece of one, beside other processes that do others.
    ///
    /// # Errors
    /// A folder that cannot be written, or where another process does the same, or wants all of it.
    pub fn open_for(root: &Path, device: impl Into<String>, piece: &str) -> Result<Self> {
        let claim = Claim::piece(root, piece)?;
        Ok(Self { root: root.into(), device: device.into(), program: program(), _claim: claim })
    }

    /// Where the results of a stage are, or will be.
    pub fn folder(&self, key: &Key) -> PathBuf {
        stage_folder(&self.root, key)
    }

    /// What is known of a stage that is done.
    pub fn done(&self, key: &Key) -> Option<Record> {
        read_record(&self.folder(key))
    }

    /// The folder that a stage works in, and whether it was begun before.
    ///
    /// # Errors
    /// A folder that cannot be written.
    pub fn begin(&self, key: &Key) -> Result<(PathBuf, bool)> {
        let unfinished = self.root.join("unfinished").join(key.folder());
        create(&unfinished)?;
        let begun = unfinished.join(BEGUN).exists();
        atomic::write_text(unfinished.join(BEGUN), "")?;
        Ok((unfinished, begun))
    }

    /// Does a stage, unless it is done already: `work` fills the folder that it is given, which holds what an earlier
    /// attempt left there.
    pub fn perform(
        &self,
        key: &Key,
        settings: Value,
        parents: Vec<String>,
        work: &mut dyn FnMut(&Path) -> Result<()>,
    ) -> Result<Record> {
        if let Some(record) = self.done(key) {
            return Ok(record);
        }
        let (unfinished, resumed) = self.begin(key)?;
        let started = Instant::now();
        work(&unfinished)?;
        let record = Record {
            name: key.name.clone(),
            version: env!("CARGO_PKG_VERSION").into(),
            program: self.program.clone(),
            parents,
            settings,
            device: self.device.clone(),
            seconds: started.elapsed().as_secs_f64(),
            resumed,
        };
        let text = serde_json::to_string_pretty(&record).expect("plain data");
        atomic::write_text(unfinished.join(RECORD), &text)?;
        let begun = unfinished.join(BEGUN);
        fs::remove_file(&begun).map_err(|error| Error::write(&begun, error))?;
        let target = self.folder(key);
        create(target.parent().expect("inside the root"))?;
        // Without a record it is no result.
        let _ = fs::remove_dir_all(&target);
        atomic::rename_folder(&unfinished, &target)?;
        Ok(record)
    }
}

/// Which build this is; empty where the program cannot be read.
fn program() -> String {
    let bytes = program::file().and_then(files::read);
    bytes.map_or(String::new(), |bytes| hex(&Sha256::digest(bytes)[..4]))
}

/// Where a stage's results are below a reproduction's folder.
pub fn stage_folder(root: &Path, key: &Key) -> PathBuf {
    root.join("stages").join(key.folder())
}

/// The record of a finished stage; `None` where there is none.
pub fn read_record(folder: &Path) -> Option<Record> {
    serde_json::from_str(&files::read_text(folder.join(RECORD)).ok()?).ok()
}

fn create(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(|error| Error::write(folder, error))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_key_changes_with_settings_and_parents_and_with_nothing_else() {
        let site = Key::new("site", &json!({"frames": 8}), &[]);
        let train = |epochs: usize, parent: &Key| Key::new("train/ours", &json!({ "epochs": epochs }), &[parent]);
        assert_eq!(train(3, &site), train(3, &site));
        assert_ne!(train(3, &site).hash, train(4, &site).hash);
        let other = Key::new("site", &json!({"frames": 9}), &[]);
        assert_ne!(train(3, &site).hash, train(3, &other).hash);
        assert_eq!(site.folder(), format!("site-{}", site.hash));
    }

    #[test]
    fn a_stage_is_done_once_and_a_killed_one_goes_on_where_it_was() {
        let root = tempfile::tempdir().unwrap();
        let key = Key::new("train/ours", &json!({}), &[]);
        {
            let store = Store::open(root.path(), "flex").unwrap();
            let failed = store.perform(&key, json!({}), vec![], &mut |folder| {
                atomic::write_text(folder.join("half"), "1")?;
                Err(Error::setting("x", 1, "nothing"))
            });
            assert!(failed.is_err() && store.done(&key).is_none());
        }
        let store = Store::open(root.path(), "flex").unwrap();
        let mut works = 0;
        for _ in 0..2 {
            let record = store
                .perform(&key, json!({}), vec![], &mut |folder| {
                    works += 1;
                    assert!(folder.join("half").exists());
                    atomic::write_text(folder.join("whole"), "2")
                })
                .unwrap();
            assert!(record.resumed);
        }
        assert_eq!(works, 1);
        assert!(store.folder(&key).join("whole").exists() && !store.folder(&key).join(BEGUN).exists());
        assert!(!root.path().join("unfinished").join(key.folder()).exists());
    }

    #[test]
    fn two_processes_do_not_share_a_folder() {
        let root = tempfile::tempdir().unwrap();
        let _first = Store::open(root.path(), "flex").unwrap();
        assert!(Store::open(root.path(), "flex").err().unwrap().to_string().contains("another process"));
    }
}
