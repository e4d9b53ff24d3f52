use super::*;
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
    fs::rename(&target, parent.path().join(".last.old-abc")).unwrap();
    recover(&target).unwrap();
    assert_eq!(names(&target), ["second"]);
}

#[test]
fn leftovers_of_a_killed_writer_go_and_those_of_a_living_one_stay() {
    let folder = tempfile::tempdir().unwrap();
    let target = folder.path().join("a.txt");
    let long_ago = SystemTime::now() - Duration::from_secs(3600);
    let dead = folder.path().join(".a.txt.partial-dead");
    let other = folder.path().join(".b.txt.partial-dead");
    for path in [&dead, &other] {
        File::create(path).unwrap().set_modified(long_ago).unwrap();
    }
    let living = AtomicFile::create(&target).unwrap();
    living.file.get_ref().as_file().set_modified(long_ago).unwrap();
    assert!(!dead.exists() && other.exists());
    write_text(&target, "second").unwrap();
    living.finish().unwrap();
    assert_eq!(names(folder.path()), [".b.txt.partial-dead", "a.txt"]);
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
    let leftovers = [siblings(&file, "partial"), siblings(&last, "partial")].concat();
    assert_eq!(leftovers.len(), 2);
    for path in leftovers {
        File::open(path).unwrap().set_modified(SystemTime::now() - Duration::from_secs(3600)).unwrap();
    }
    write_text(&file, "new").unwrap();
    AtomicFolder::replacing(&last).unwrap().finish().unwrap();
    assert_eq!(names(folder.path()), ["a.txt", "last", "ready"]);
}
