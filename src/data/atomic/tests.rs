use std::fs::File;
use std::time::{Duration, SystemTime};

use super::*;
use crate::data::leftovers::siblings;
use crate::data::test_support::names;

#[test]
fn a_file_appears_whole_and_leaves_no_temporary() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a.txt");
    let mut file = AtomicFile::create(&target).unwrap();
    file.write_all(b"half").unwrap();
    file.flush().unwrap();
    assert!(!target.exists());
    file.write_all(b" and half").unwrap();
    file.finish().unwrap();
    assert_eq!(fs::read_to_string(&target).unwrap(), "half and half");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
fn a_writer_that_fails_leaves_the_old_file_and_no_temporary() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a.txt");
    write_text(&target, "old").unwrap();
    let error = write_file(&target, |file| {
        file.write_all(&vec![0; 3 << 20])?;
        Err(io::Error::new(io::ErrorKind::StorageFull, "no space left on device"))
    })
    .unwrap_err();
    assert_eq!(error.to_string(), format!("{}: cannot be written: no space left on device", target.display()));
    assert!(error.hint().unwrap().contains("nothing half-written was left"));
    assert_eq!(fs::read_to_string(&target).unwrap(), "old");
    assert_eq!(names(folder.path()), ["a.txt"]);
}

#[test]
#[cfg(target_os = "linux")]
fn a_full_disk_is_an_error_that_names_the_file() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a.bin");
    let mut full = File::options().write(true).open("/dev/full").unwrap();
    let error = write_file(&target, |_| full.write_all(&[1; 64])).unwrap_err();
    assert!(matches!(&error, Error::Write { path, source } if *path == target && source.kind() == io::ErrorKind::StorageFull));
    assert!(names(folder.path()).is_empty());
}

#[test]
fn a_folder_that_cannot_be_written_into_is_an_error() {
    let error = write_text("/no/such/folder/a.txt", "x").unwrap_err();
    assert!(error.to_string().starts_with("/no/such/folder/a.txt: cannot be written: "), "{error}");
    assert!(matches!(AtomicFile::create("/"), Err(Error::Write { .. })));
}

#[test]
fn a_dropped_folder_vanishes_and_a_finished_one_appears_whole() {
    let parent = tempfile::tempdir().unwrap();
    let target = parent.path().join("above").join("recording");
    let folder = AtomicFolder::create(&target).unwrap();
    write_text(folder.path().join("a.txt"), "x").unwrap();
    drop(folder);
    assert!(names(target.parent().unwrap()).is_empty());

    let folder = AtomicFolder::create(&target).unwrap();
    write_text(folder.path().join("a.txt"), "x").unwrap();
    assert!(!target.exists());
    folder.finish().unwrap();
    assert_eq!(names(target.parent().unwrap()), ["recording"]);
    assert_eq!(names(&target), ["a.txt"]);
}

#[test]
fn a_folder_with_something_in_it_is_not_overwritten() {
    let parent = tempfile::tempdir().unwrap();
    write_text(parent.path().join("a.txt"), "x").unwrap();
    let error = AtomicFolder::create(parent.path()).err().unwrap();
    assert_eq!(error.to_string(), format!("{}: exists already and is not an empty folder", parent.path().display()));
}

#[test]
fn a_replaced_folder_is_the_old_or_the_new_one() {
    let parent = tempfile::tempdir().unwrap();
    let target = parent.path().join("last");
    for text in ["first", "second"] {
        let folder = AtomicFolder::replacing(&target).unwrap();
        write_text(folder.path().join(text), text).unwrap();
        folder.finish().unwrap();
        assert_eq!(names(&target), [text]);
    }
    assert_eq!(names(parent.path()), ["last"]);
    // As if killed between the two renames.
    fs::rename(&target, parent.path().join(".last.hybridsim-old-abc")).unwrap();
    recover(&target).unwrap();
    assert_eq!(names(&target), ["second"]);
}

#[test]
fn leftovers_of_a_killed_writer_go_and_those_of_a_living_one_stay() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a.txt");
    let dead = folder.path().join(".a.txt.hybridsim-partial-dead");
    let other = folder.path().join(".b.txt.hybridsim-partial-dead");
    for path in [&dead, &other] {
        File::create(path).unwrap();
    }
    let living = AtomicFile::create(&target).unwrap();
    assert!(!dead.exists() && other.exists());
    write_text(&target, "second").unwrap();
    living.finish().unwrap();
    assert_eq!(names(folder.path()), [".b.txt.hybridsim-partial-dead", "a.txt"]);
}

#[test]
fn a_sweep_takes_what_the_dead_left_at_any_depth_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let below = folder.path().join("stages/site/recordings");
    fs::create_dir_all(below.join(".s1.hybridsim-partial-dead")).unwrap();
    fs::create_dir_all(below.join(".last.hybridsim-old-dead")).unwrap();
    fs::create_dir_all(below.join(".best.hybridsim-old-only")).unwrap();
    fs::create_dir_all(below.join("last")).unwrap();
    for name in [".s2.hybridsim-lock", ".gitignore", ".s3.partial-x", "s.hybridsim-partial-x"] {
        fs::write(below.join(name), "").unwrap();
    }
    let living = AtomicFolder::create(below.join("s4")).unwrap();
    sweep(folder.path());
    assert_eq!(names(&below).len(), 10);
    sweep_all(folder.path());
    let left = names(&below);
    assert_eq!(left.len(), 7, "{left:?}");
    for name in [".s1.hybridsim-partial-dead", ".last.hybridsim-old-dead", ".s2.hybridsim-lock"] {
        assert!(!left.contains(&name.to_string()), "{name}");
    }
    living.finish().unwrap();
    assert_eq!(names(&below), [".best.hybridsim-old-only", ".gitignore", ".s3.partial-x", "last", "s.hybridsim-partial-x", "s4"]);
}

#[test]
fn two_writers_of_one_folder_are_not_let_begin() {
    let parent = tempfile::tempdir().unwrap();
    let target = parent.path().join("result");
    let first = AtomicFolder::create(&target).unwrap();
    let error = AtomicFolder::create(&target).err().unwrap();
    assert!(error.to_string().contains("another process"), "{error}");
    first.finish().unwrap();
    assert_eq!(names(parent.path()), ["result"]);
}

/// An empty folder stays what it is (a mount point cannot be replaced): its mode tells.
#[test]
#[cfg(unix)]
fn an_empty_folder_is_filled_where_it_is_and_so_is_one_that_a_link_leads_to() {
    use std::os::unix::fs::{MetadataExt, PermissionsExt};
    let parent = tempfile::tempdir().unwrap();
    let (real, link) = (parent.path().join("real"), parent.path().join("link"));
    fs::create_dir(&real).unwrap();
    fs::set_permissions(&real, fs::Permissions::from_mode(0o750)).unwrap();
    fs::write(real.join(".keep"), "").unwrap();
    let number = fs::metadata(&real).unwrap().ino();
    std::os::unix::fs::symlink("real", &link).unwrap();
    let fill = || {
        let folder = AtomicFolder::create(&link).unwrap();
        fs::create_dir(folder.path().join("recording")).unwrap();
        write_text(folder.path().join("a.txt"), "x").unwrap();
        write_text(folder.path().join("a.toml"), "x").unwrap();
        assert_eq!(folder.seen_from(), real.canonicalize().unwrap());
        folder
    };
    drop(fill());
    assert_eq!(names(&real), [".keep"]);
    fill().finish().unwrap();
    assert_eq!(names(&real), [".keep", "a.toml", "a.txt", "recording"]);
    let metadata = fs::metadata(&real).unwrap();
    assert_eq!((metadata.ino(), metadata.mode() & 0o777), (number, 0o750));
    assert!(link.is_symlink());
    let error = AtomicFolder::create(&link).err().unwrap();
    assert!(error.to_string().contains("not an empty folder"), "{error}");
    fs::remove_dir_all(&real).unwrap();
    let error = AtomicFolder::create(&link).err().unwrap();
    assert!(error.to_string().ends_with("link: is a link that leads nowhere"), "{error}");
}

#[test]
fn a_folder_whose_writer_was_killed_while_it_moved_the_entries_is_completed() {
    let folder = tempfile::tempdir().unwrap();
    let ready = folder.path().join(".hybridsim-ready-dead");
    fs::create_dir(&ready).unwrap();
    for path in [folder.path().join("if.npy"), ready.join("motion.npz"), ready.join("recording.toml")] {
        fs::write(path, "").unwrap();
    }
    sweep(folder.path());
    assert_eq!(names(folder.path()), ["if.npy", "motion.npz", "recording.toml"]);
}

#[test]
fn what_gets_its_name_was_brought_to_the_disk_before_and_its_name_after() {
    let parent = tempfile::tempdir().unwrap();
    let target = parent.path().join("result");
    let folder = AtomicFolder::create(&target).unwrap();
    fs::write(folder.path().join("a"), "x").unwrap();
    let temporary = folder.path().to_path_buf();
    sync::SYNCED.with_borrow_mut(Vec::clear);
    folder.finish().unwrap();
    let synced = sync::SYNCED.with_borrow(Clone::clone);
    assert_eq!(synced, [temporary.join("a"), temporary, parent.path().to_path_buf()]);
    sync::SYNCED.with_borrow_mut(Vec::clear);
    rename_folder(&target, &parent.path().join("moved")).unwrap();
    let synced = sync::SYNCED.with_borrow(Clone::clone);
    assert_eq!(synced[..2], [target.join("a"), target]);
    assert!(synced.len() > 2);
    sync::SYNCED.with_borrow_mut(Vec::clear);
    write_text(parent.path().join("text"), "x").unwrap();
    assert_eq!(sync::SYNCED.with_borrow(Clone::clone), [parent.path().join("text"), parent.path().to_path_buf()]);
}

/// Where the writer that is going to be killed works; unset in every other run.
const VICTIM: &str = "HYBRIDSIM_TEST_VICTIM";

#[test]
fn a_victim_writes_half_and_waits() {
    let Some(folder) = std::env::var_os(VICTIM).map(PathBuf::from) else { return };
    let mut file = AtomicFile::create(folder.join("a.txt")).unwrap();
    file.write_all(&[0; 3 << 20]).unwrap();
    let partial = AtomicFolder::replacing(folder.join("last")).unwrap();
    write_text(partial.path().join("half.txt"), "half").unwrap();
    write_text(folder.join("ready"), "").unwrap();
    std::thread::sleep(Duration::from_secs(600));
}

#[test]
fn a_killed_writer_leaves_the_old_ones_and_the_next_writer_cleans_up() {
    let folder = tempfile::tempdir().unwrap();
    let (file, last) = (folder.path().join("a.txt"), folder.path().join("last"));
    write_text(&file, "old").unwrap();
    fs::create_dir(&last).unwrap();
    write_text(last.join("old.txt"), "old").unwrap();
    let test = "data::atomic::tests::a_victim_writes_half_and_waits";
    let mut victim = std::process::Command::new(std::env::current_exe().unwrap())
        .args(["--exact", test])
        .env(VICTIM, folder.path())
        .stdout(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let started = SystemTime::now();
    while !folder.path().join("ready").exists() {
        assert!(started.elapsed().unwrap() < Duration::from_secs(60), "the victim does not start");
        std::thread::sleep(Duration::from_millis(10));
    }
    victim.kill().unwrap();
    victim.wait().unwrap();

    assert_eq!(fs::read_to_string(&file).unwrap(), "old");
    assert_eq!(names(&last), ["old.txt"]);
    assert_eq!([siblings(&file, PARTIAL), siblings(&last, PARTIAL)].concat().len(), 2);
    write_text(&file, "new").unwrap();
    AtomicFolder::replacing(&last).unwrap().finish().unwrap();
    assert_eq!(names(folder.path()), ["a.txt", "last", "ready"]);
}
