//! The documentation's command lines are ones that this program takes, and the README's numbers are those of the results.

use std::path::{Path, PathBuf};

use clap::{CommandFactory, Parser};

use super::Cli;

/// Lines that a stranger reads.
const LONGEST_README: usize = 120;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

fn text(name: impl AsRef<Path>) -> String {
    let path = root().join(name);
    std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// README.md and every page of docs, configs and models.
fn pages() -> Vec<PathBuf> {
    let mut found = vec![PathBuf::from("README.md")];
    for folder in ["docs", "configs", "models"] {
        let files = std::fs::read_dir(root().join(folder)).unwrap().map(|entry| entry.unwrap().file_name());
        found.extend(
            files.map(|name| Path::new(folder).join(name)).filter(|path| path.extension().is_some_and(|end| end == "md")),
        );
    }
    found
}

/// Words of a line as a shell reads them: quotes, and comments that begin with `#`.
fn words(line: &str) -> Vec<String> {
    let (mut words, mut word, mut quote) = (vec![], None::<String>, None);
    for letter in line.chars() {
        match (quote, letter) {
            (Some(mark), _) if letter == mark => quote = None,
            (None, '\'' | '"') => {
                quote = Some(letter);
                word.get_or_insert_default();
            }
            (None, '#') if word.is_none() => break,
            (None, ' ') => words.extend(word.take()),
            _ => word.get_or_insert_default().push(letter),
        }
    }
    words.extend(word);
    words
}

/// The program's words of a command line, if it is one of this program.
fn command(line: &str) -> Option<Vec<String>> {
    let line = line.trim();
    let rest = line.strip_prefix("hybridsim ").or_else(|| line.strip_prefix("cargo run --release -- "))?;
    Some(words(rest))
}

/// Command lines of blocks, which are whole, and those between backticks in the text, which may leave something out.
fn commands(page: &str) -> (Vec<Vec<String>>, Vec<Vec<String>>) {
    let (mut whole, mut text, mut inside) = (vec![], String::new(), false);
    for line in page.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else if inside {
            whole.extend(command(line));
        } else {
            text += line.trim();
            text += " ";
        }
    }
    let between = text.split('`').skip(1).step_by(2).filter_map(command).collect();
    (whole, between)
}

/// Why the program would not take the verb or an option of these words; what they leave out does not count.
fn unknown(words: &[String]) -> Option<String> {
    let mut program = Cli::command();
    program.build();
    let mut verb = &program;
    for word in words {
        if let Some(option) = word.strip_prefix("--") {
            let name = option.split('=').next().unwrap_or(option);
            let known = verb.get_arguments().any(|argument| {
                let names = argument.get_long_and_visible_aliases().unwrap_or_default();
                names.contains(&name)
            });
            if !known && name != "help" {
                return Some(format!("{} has no --{name}", verb.get_name()));
            }
        } else if let Some(next) = verb.find_subcommand(word) {
            verb = next;
        }
    }
    // `VERB` stands for any.
    let named = words.first().is_some_and(|word| word.starts_with('-') || word.chars().all(char::is_uppercase));
    (verb.get_name() == program.get_name() && !named).then(|| format!("no verb {words:?}"))
}

/// What is wrong with the command lines of a page.
fn wrong(page: &str) -> Vec<String> {
    let (whole, between) = commands(page);
    let refused = whole.iter().filter_map(|words| {
        let typed = std::iter::once("hybridsim").chain(words.iter().map(String::as_str));
        match Cli::try_parse_from(typed) {
            Err(error) if error.use_stderr() => Some(format!("{words:?}: {error}")),
            _ => None,
        }
    });
    refused.chain(between.iter().filter_map(|words| unknown(words))).collect()
}

#[test]
fn every_command_line_of_the_documentation_is_taken() {
    let mut count = 0;
    for page in pages() {
        let text = text(&page);
        let found = wrong(&text);
        assert!(found.is_empty(), "{}:\n{}", page.display(), found.join("\n"));
        count += commands(&text).0.len();
    }
    // the capture's three lines, the quickstart's two, and some more
    assert!(count >= 10, "{count} command lines were found");
}

#[test]
fn a_command_line_that_is_not_taken_is_noticed() {
    let block = |line: &str| wrong(&format!("text\n```\n{line}\n```\n"));
    assert_eq!(block("hybridsim record 'a b.toml' --set 'record.effects={}'   # a comment"), Vec::<String>::new());
    for line in ["hybridsim recrod a.toml", "cargo run --release -- record", "hybridsim record a.toml --distance 2"] {
        assert_eq!(block(line).len(), 1, "{line}");
    }
    assert!(wrong("`hybridsim challenge seal` and `hybridsim align --lag SECONDS` and `hybridsim VERB --help`").is_empty());
    for line in ["`hybridsim challenge sealed --measure`", "`hybridsim align\n  --leg SECONDS`", "`hybridsim aligned RECORDING`"]
    {
        assert_eq!(wrong(line).len(), 1, "{line}");
    }
}

/// Rows of the tables below the headings.
fn rows<'a>(page: &'a str, headings: &[&str]) -> Vec<&'a str> {
    let mut inside = false;
    let mut found = vec![];
    for line in page.lines() {
        if line.starts_with('#') {
            inside = headings.iter().any(|heading| line.ends_with(heading));
        } else if inside && line.starts_with('|') && line.contains(|letter: char| letter.is_ascii_digit()) {
            found.push(line);
        }
    }
    found
}

#[test]
fn the_readme_is_short_and_its_numbers_are_those_of_the_results() {
    let (readme, results) = (text("README.md"), text("docs/results.md"));
    let lines = readme.lines().count();
    assert!(lines <= LONGEST_README, "README.md has {lines} lines");
    let stated = rows(&readme, &["What is found, named, and false", "How fast"]);
    assert!(stated.len() >= 10, "{stated:?}");
    for row in stated {
        assert!(results.lines().any(|line| line == row), "docs/results.md has no row\n{row}");
    }
}
