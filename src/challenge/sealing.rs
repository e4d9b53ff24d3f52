//! What every sealed folder has: a secret that everything is drawn from, cases beside truths, and one commitment for each part.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use serde_json::Value;

use super::commitment::{Commitment, Sealed, hash_file, hash_folder, leaf, merkle_root, sha256};
use super::secret::Secret;
use crate::data::atomic::write_text;
use crate::data::entries::entries;
use crate::data::files::read_json;
use crate::data::{Shard, files, program, read_toml};
use crate::error::{Error, Result};

/// All files of all cases were last changed then (1 January 2026), so that nothing is learned from when.
const TIME_OF_FILES: u64 = 1_767_225_600;

/// Where a part's commitment is published.
pub fn published(out: &Path, shard: Shard) -> PathBuf {
    out.join(match shard.of {
        1 => "commitment.json".to_string(),
        of => format!("commitment_{}_of_{of}.json", shard.number),
    })
}

/// The folders, and the secret that everything is drawn from. `settings`: what is drawn, which must be the same when it goes on.
pub fn begin(out: &Path, settings: &str, seed: Option<&str>, shard: Shard) -> Result<Secret> {
    let sealed = out.join("sealed");
    create(&sealed)?;
    create(&out.join("cases"))?;
    private(&sealed);
    settle_secret(&sealed, settings, seed, shard)
}

/// Publishes what commits to the cases of a part. `left_out`: effects that cases are to be diagnosed without, by their names.
pub fn commit(
    out: &Path,
    settings: &str,
    secret: &Secret,
    shard: Shard,
    leaves: BTreeMap<String, String>,
    left_out: BTreeMap<String, String>,
) -> Result<Commitment> {
    let commitment = Commitment {
        format: 1,
        shard: [shard.number, shard.of],
        cases: leaves.len(),
        config_sha256: sha256(settings),
        executable_sha256: executable_hash()?,
        secret_sha256: sha256(&secret.seed),
        root: merkle_root(&leaves),
        leaves,
        left_out,
    };
    set_time(&out.join("cases"))?;
    let text = format!("{:#}\n", serde_json::to_value(&commitment).expect("plain data"));
    write_text(published(out, shard), &text)?;
    Ok(commitment)
}

/// Of the program that runs.
pub fn executable_hash() -> Result<String> {
    hash_file(&program::file()?)
}

fn create(folder: &Path) -> Result<()> {
    fs::create_dir_all(folder).map_err(|source| Error::write(folder, source))
}

/// For the owner alone, where the system knows owners.
fn private(folder: &Path) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        let _ = fs::set_permissions(folder, fs::Permissions::from_mode(0o700));
    }
    #[cfg(not(unix))]
    let _ = folder;
}

/// The secret of this folder: begun before, given, or new.
fn settle_secret(sealed: &Path, text: &str, seed: Option<&str>, shard: Shard) -> Result<Secret> {
    let path = sealed.join("secret.toml");
    let settings = sealed.join("config.toml");
    if path.exists() {
        let begun: Secret = read_toml(&path)?;
        let same_config = files::read_text(&settings).is_ok_and(|begun| begun == text);
        if !same_config || seed.is_some_and(|seed| Secret::new(Some(seed)) != begun) {
            return Err(Error::Usage {
                message: format!("{}: was begun with another seed or other settings", sealed.display()),
                hint: Some("seal into another folder".into()),
            });
        }
        return Ok(begun);
    }
    if shard.of > 1 && seed.is_none() {
        return Err(Error::Usage {
            message: "shards without a seed would be different challenges".into(),
            hint: Some("give all shards the same --seed, and keep it secret".into()),
        });
    }
    let secret = Secret::new(seed);
    write_text(&settings, text)?;
    write_text(&path, &toml::to_string(&secret).expect("a text"))?;
    Ok(secret)
}

/// Has one case made, unless it is there already, and returns its leaf. `make` fills the folder that it is given and says the truth.
pub fn one_case(out: &Path, secret: &Secret, index: usize, make: impl FnOnce(&Path) -> Result<Value>) -> Result<String> {
    let name = secret.name(index);
    let (case, truth_file) = (out.join("cases").join(&name), out.join("sealed").join(format!("{name}.json")));
    if case.is_dir() && truth_file.is_file() {
        return Ok(leaf(&read_json(&truth_file)?, &hash_folder(&case)?));
    }
    if case.is_dir() {
        fs::remove_dir_all(&case).map_err(|source| Error::write(&case, source))?;
    }
    let sealed = Sealed { salt: secret.salt(index), truth: make(&case)? };
    write_text(&truth_file, &format!("{:#}\n", serde_json::to_value(&sealed).expect("plain data")))?;
    // As it will be read again: the last digit of a number may not survive being written.
    Ok(leaf(&read_json(&truth_file)?, &hash_folder(&case)?))
}

/// Makes a case and its files as old as all others.
pub fn set_times(case: &Path) -> Result<()> {
    for path in entries(case)? {
        set_time(&path)?;
    }
    set_time(case)
}

fn set_time(path: &Path) -> Result<()> {
    let time = SystemTime::UNIX_EPOCH + Duration::from_secs(TIME_OF_FILES);
    File::open(path).and_then(|file| file.set_modified(time)).map_err(|source| Error::write(path, source))
}
