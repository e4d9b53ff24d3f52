//! Every config that ships is valid, and says the same after a round trip through its resolved form.

use std::path::Path;

use hybridsim::challenge::ChallengeConfig;
use hybridsim::config::Config;
use hybridsim::experiments::ReproduceConfig;
use hybridsim::site::{SiteConfig, sequences};

#[test]
fn all_configs_parse_and_resolve_to_themselves() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("configs");
    let mut count = 0;
    for entry in std::fs::read_dir(&folder).unwrap() {
        let path = entry.unwrap().path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let again = tempfile::tempdir().unwrap();
        let resolved = again.path().join("config.toml");
        let name = path.file_name().unwrap().to_str().unwrap();
        // A challenge, a site and a reproduction are no experiments and have settings of their own.
        if name.starts_with("site") {
            let config = SiteConfig::read(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            std::fs::write(&resolved, config.to_toml()).unwrap();
            assert_eq!(SiteConfig::read(&resolved, &[]).unwrap(), config, "{}", path.display());
            // Everybody stays in the room; five minutes of motion take too long to look at here.
            if !name.contains("mmmesh") && !name.contains("paper") {
                sequences(&config, &folder).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            }
        } else if name.starts_with("reproduce") {
            // Its site is a path, which the resolved form has from here.
            let config = ReproduceConfig::read(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            assert!(config.site.is_file() && config.second_room.as_ref().is_none_or(|room| room.is_file()));
            assert!(config.second_scene.as_ref().is_none_or(|scene| scene.site.is_file()), "{}", path.display());
            std::fs::write(&resolved, config.to_toml()).unwrap();
            assert_eq!(ReproduceConfig::read(&resolved, &[]).unwrap(), config, "{}", path.display());
        } else if name.starts_with("challenge") {
            let config = ChallengeConfig::read(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            std::fs::write(&resolved, config.to_toml()).unwrap();
            assert_eq!(ChallengeConfig::read(&resolved, &[]).unwrap(), config, "{}", path.display());
        } else {
            let config = Config::read(&path, &[]).unwrap_or_else(|error| panic!("{error}"));
            std::fs::write(&resolved, config.to_toml()).unwrap();
            assert_eq!(Config::read(&resolved, &[]).unwrap(), config, "{}", path.display());
        }
        let listed = std::fs::read_to_string(folder.join("README.md")).unwrap();
        assert!(listed.contains(&format!("`{name}`")), "configs/README.md does not list {name}");
        count += 1;
    }
    assert!(count >= 3);
}
