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

/// docs/report.md lists what a report can name by its stage: all of the library, and nothing else.
#[test]
fn the_page_of_the_report_lists_every_effect_at_its_stage() {
    let page = std::fs::read_to_string(docs().join("report.md")).unwrap();
    let (_, table) = page.split_once("| stage | id: parameters |").unwrap();
    let mut listed: Vec<(String, String)> = vec![];
    for row in table.lines().skip(2).take_while(|line| line.starts_with('|')) {
        let mut cells = row.trim_matches('|').splitn(2, '|').map(str::trim);
        let (stage, effects) = (cells.next().unwrap(), cells.next().unwrap());
        // `id`: `parameters` · `id`, `id`: `parameters`
        for ids in effects.split(" · ").map(|entry| entry.split(": ").next().unwrap()) {
            listed.extend(ids.split(", ").map(|id| (stage.to_string(), id.trim_matches('`').to_string())));
        }
    }
    let mut known: Vec<(String, String)> =
        effects::library().iter().map(|info| (info.stage.name().to_string(), info.id.to_string())).collect();
    listed.sort();
    known.sort();
    assert_eq!(listed, known);
}
