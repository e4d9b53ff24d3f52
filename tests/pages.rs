//! The pages that verbs leave, in a browser: nothing is missing, nothing is said on its console, and nothing is wider than the window
//! of a desktop or of a phone.

use crate::support;

use std::{
    path::{Path, PathBuf},
    process::Command,
};

/// Of the windows, pixels.
const WIDTHS: [usize; 2] = [1100, 400];
/// Writes what the windows show into an attribute of the page, and takes them away, so that the page can be printed.
const LOOK: &str = "onload = () => {
    const look = page => [page.documentElement.clientWidth, page.documentElement.scrollWidth, page.images.length,
        [...page.images].filter(image => !image.naturalWidth).length];
    const windows = [...document.querySelectorAll('iframe')];
    document.body.dataset.found = windows.map(one => look(one.contentDocument).join(' ')).join(';');
    windows.forEach(one => one.remove());
}";

/// What a window shows.
#[derive(Debug)]
struct Shown {
    width: usize,
    content_width: usize,
    pictures: usize,
    broken_pictures: usize,
}

fn browser() -> Option<PathBuf> {
    let names = ["chromium", "chromium-browser", "google-chrome"];
    let folders: Vec<PathBuf> = std::env::var_os("PATH").iter().flat_map(std::env::split_paths).collect();
    let found = folders.iter().flat_map(|folder| names.map(|name| folder.join(name))).find(|file| file.is_file());
    if found.is_none() {
        support::skip("chromium");
    }
    found
}

/// What both windows show, and what the browser's console says.
fn look(browser: &Path, page: &str) -> (Vec<Shown>, Vec<String>) {
    let folder = tempfile::tempdir().unwrap();
    let escaped = page.replace('&', "&amp;").replace('"', "&quot;");
    let windows = WIDTHS.map(|width| format!("<iframe width={width} height=900 srcdoc=\"{escaped}\"></iframe>")).concat();
    let host = folder.path().join("host.html");
    std::fs::write(&host, format!("<!doctype html><meta charset=utf-8><body>{windows}<script>{LOOK}</script></body>")).unwrap();
    let output = Command::new(browser)
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--enable-logging=stderr", "--virtual-time-budget=10000"])
        .arg(format!("--user-data-dir={}", folder.path().join("profile").display()))
        .args(["--dump-dom", &format!("file://{}", host.display())])
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&output.stdout).into_owned();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    let found = printed.split("data-found=\"").nth(1).and_then(|rest| rest.split('"').next());
    let found = found.unwrap_or_else(|| panic!("the page was not looked at:\n{printed}\n{said}"));
    let window = |text: &str| {
        let numbers: Vec<usize> = text.split(' ').map(|number| number.parse().unwrap()).collect();
        Shown { width: numbers[0], content_width: numbers[1], pictures: numbers[2], broken_pictures: numbers[3] }
    };
    (found.split(';').map(window).collect(), said.lines().filter(|line| line.contains("CONSOLE")).map(String::from).collect())
}

fn hybridsim(folder: &Path, arguments: &[&str]) {
    let output = Command::new(env!("CARGO_BIN_EXE_hybridsim")).args(arguments).args(["-q"]).current_dir(folder).output().unwrap();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
}

#[test]
fn every_page_opens_without_errors_and_fits_a_desktop_and_a_phone() {
    let Some(browser) = browser() else { return };
    let folder = tempfile::tempdir().unwrap();
    let at = folder.path();
    let config = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs/test.toml").display().to_string();
    hybridsim(at, &["record", &config, "--out", "recording"]);
    let data = format!("data.recordings=[{:?}]", at.join("recording").display().to_string());
    hybridsim(at, &["train", &config, "--device", "flex", "--set", "training.epochs=2", "--set", &data, "--out", "run"]);
    hybridsim(at, &["infer", "--checkpoint", "run/best", "--device", "flex", "--recording", "recording", "--out", "again"]);
    let new =
        ["infer", "--checkpoint", "run/best", "--device", "flex", "--action", "walk_back_forth", "--frames", "2", "--out", "new"];
    hybridsim(at, &new);
    hybridsim(at, &["evaluate", "--checkpoint", "run/best", "--device", "flex", "recording", "--out", "scores"]);
    hybridsim(at, &["diagnose", "recording", "--device", "flex", "--set", "diagnosis.epochs=0", "--out", "why"]);
    for (run, pictures) in [("run", 4), ("again", 5), ("new", 5), ("scores", 2), ("why", 1)] {
        let page = std::fs::read_to_string(at.join(run).join("report.html")).unwrap();
        let (windows, console) = look(&browser, &page);
        assert!(console.is_empty(), "{run}: {console:?}");
        assert_eq!(windows.len(), WIDTHS.len());
        for shown in windows {
            assert!(shown.content_width <= shown.width && shown.width > 300, "{run}: {shown:?}");
            assert!(shown.pictures >= pictures && shown.broken_pictures == 0, "{run}: {shown:?}");
        }
    }
}

/// The test above can fail.
#[test]
fn a_page_that_is_wrong_is_seen() {
    let Some(browser) = browser() else { return };
    let wrong = "<!doctype html><body><div style=\"width:700px\">wide</div><img src=\"data:image/png;base64,AAEC\">\
                 <script>absent()</script></body>";
    let (windows, console) = look(&browser, wrong);
    assert!(windows[0].content_width <= windows[0].width && windows[1].content_width > windows[1].width, "{windows:?}");
    assert!(windows.iter().all(|shown| shown.broken_pictures == 1), "{windows:?}");
    assert!(console.iter().any(|line| line.contains("absent")), "{console:?}");
}
