use super::*;
use crate::config::Config;

fn docs() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("docs")
}

/// `hybridsim effects --out docs/effects` makes them anew.
#[test]
fn the_pages_of_the_book_are_those_of_the_library_and_their_configs_are_taken() {
    let folder = docs().join("effects");
    let read = |name: &str| std::fs::read_to_string(folder.join(name)).unwrap_or_default();
    let summary = std::fs::read_to_string(docs().join("SUMMARY.md")).unwrap();
    assert_eq!(read(INDEX), index());
    let scene = Scene::new().unwrap();
    for info in effects::library() {
        let signature = scene.signature(info).unwrap();
        let page = page::markdown(info, signature.as_ref());
        assert_eq!(read(&format!("{}.md", info.id)), page, "{}", info.id);
        assert_eq!(folder.join(format!("{}.png", info.id)).is_file(), signature.is_some(), "{}", info.id);
        assert!(summary.contains(&format!("(effects/{}.md)", info.id)), "docs/SUMMARY.md leaves out {}", info.id);
        taken(info.id, &page);
    }
    let pages = std::fs::read_dir(&folder).unwrap().count();
    assert!(pages <= 2 * effects::library().len() + 1, "{pages} files: some are of no effect");
}

/// The config of a page says what the library understands.
fn taken(id: &str, page: &str) {
    let config = page.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("effect.toml");
    std::fs::write(&path, config).unwrap();
    let config = Config::read(&path, &[]).unwrap_or_else(|error| panic!("{id}: {error}"));
    assert_eq!(config.simulator.effects.len(), 1, "{id}");
    config.simulator.effects[0].check("simulator.effects").unwrap_or_else(|error| panic!("{id}: {error}"));
}

#[test]
fn an_unknown_effect_is_refused_with_the_nearest() {
    let error = described("if_highpas").unwrap_err();
    assert!(error.to_string().contains("if_highpas"), "{error}");
    assert!(error.hint().unwrap().contains("if_highpass"));
    assert!(described("if_highpass").unwrap().contains("corner_hz"));
    assert_eq!(table().lines().filter(|line| line.starts_with("  ")).count(), effects::library().len());
}
