//! The crate's source files, and which of them uses which: every path in code that is not for tests, through re-exports to the file
//! that defines what it names.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use proc_macro2::{TokenStream, TokenTree};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};

/// Names from the root of the crate on, such as `["heatmap", "map"]`.
pub type Module = Vec<String>;

pub struct Source {
    /// From `src` on.
    pub file: PathBuf,
    /// Without comments and without what only tests compile.
    pub text: String,
    found: Found,
}

/// All of them but those that only tests compile.
pub struct Sources {
    pub files: BTreeMap<Module, Source>,
}

#[derive(Default)]
struct Found {
    /// Modules that this one declares.
    children: BTreeSet<String>,
    /// Of these, those that only tests compile.
    tests: BTreeSet<String>,
    /// As they are written.
    paths: Vec<Vec<String>>,
    /// Name here, and what it is another name for.
    exports: Vec<(String, Vec<String>)>,
    /// First and last lines, from 1, of what only tests compile.
    for_tests: Vec<[usize; 2]>,
}

fn is_for_tests(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg") && attribute.parse_args::<syn::Meta>().is_ok_and(|meta| meta.path().is_ident("test"))
    })
}

fn attributes(item: &syn::Item) -> &[syn::Attribute] {
    use syn::Item::*;
    match item {
        Const(syn::ItemConst { attrs, .. })
        | Enum(syn::ItemEnum { attrs, .. })
        | Fn(syn::ItemFn { attrs, .. })
        | Impl(syn::ItemImpl { attrs, .. })
        | Macro(syn::ItemMacro { attrs, .. })
        | Mod(syn::ItemMod { attrs, .. })
        | Static(syn::ItemStatic { attrs, .. })
        | Struct(syn::ItemStruct { attrs, .. })
        | Trait(syn::ItemTrait { attrs, .. })
        | Type(syn::ItemType { attrs, .. })
        | Use(syn::ItemUse { attrs, .. }) => attrs,
        _ => &[],
    }
}

fn lines(node: &impl Spanned) -> [usize; 2] {
    let span = node.span();
    [span.start().line, span.end().line]
}

impl Found {
    fn walk(&mut self, tree: &syn::UseTree, before: &[String], is_public: bool) {
        let with = |name: &syn::Ident| [before, &[name.to_string()]].concat();
        let mut end = |path: Vec<String>, name: String| {
            if is_public {
                self.exports.push((name, path.clone()));
            }
            self.paths.push(path);
        };
        match tree {
            syn::UseTree::Path(path) => self.walk(&path.tree, &with(&path.ident), is_public),
            syn::UseTree::Group(group) => group.items.iter().for_each(|tree| self.walk(tree, before, is_public)),
            syn::UseTree::Name(name) if name.ident == "self" => {
                end(before.to_vec(), before.last().cloned().unwrap_or_default());
            }
            syn::UseTree::Name(name) => end(with(&name.ident), name.ident.to_string()),
            syn::UseTree::Rename(rename) => end(with(&rename.ident), rename.rename.to_string()),
            syn::UseTree::Glob(_) => end(before.to_vec(), "*".into()),
        }
    }

    /// Macros hold their arguments as tokens.
    fn tokens(&mut self, tokens: TokenStream) {
        let mut path: Vec<String> = vec![];
        let mut colons = 0;
        for token in tokens {
            match token {
                TokenTree::Ident(name) if colons == 2 && !path.is_empty() => path.push(name.to_string()),
                TokenTree::Ident(name) => {
                    self.paths.push(std::mem::replace(&mut path, vec![name.to_string()]));
                }
                TokenTree::Punct(mark) if mark.as_char() == ':' => {
                    colons += 1;
                    continue;
                }
                TokenTree::Group(group) => {
                    self.paths.push(std::mem::take(&mut path));
                    self.tokens(group.stream());
                }
                _ => self.paths.push(std::mem::take(&mut path)),
            }
            colons = 0;
        }
        self.paths.push(path);
    }
}

impl<'ast> Visit<'ast> for Found {
    fn visit_item(&mut self, item: &'ast syn::Item) {
        if let syn::Item::Mod(module) = item
            && module.content.is_none()
        {
            self.children.insert(module.ident.to_string());
            if is_for_tests(&module.attrs) {
                self.tests.insert(module.ident.to_string());
            }
        }
        if is_for_tests(attributes(item)) {
            self.for_tests.push(lines(item));
        } else if let syn::Item::Use(import) = item {
            self.walk(&import.tree, &[], !matches!(import.vis, syn::Visibility::Inherited));
        } else {
            visit::visit_item(self, item);
        }
    }

    fn visit_impl_item_fn(&mut self, function: &'ast syn::ImplItemFn) {
        if is_for_tests(&function.attrs) {
            self.for_tests.push(lines(function));
        } else {
            visit::visit_impl_item_fn(self, function);
        }
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.paths.push(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        self.tokens(call.tokens.clone());
        visit::visit_macro(self, call);
    }
}

fn files(folder: &Path, found: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files(&path, found);
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            found.push(path);
        }
    }
}

/// `heatmap/mod.rs` and `heatmap.rs` are `["heatmap"]`.
fn module(file: &Path) -> Module {
    let mut names: Module = file.with_extension("").iter().map(|name| name.to_str().unwrap().to_string()).collect();
    if names.last().is_some_and(|name| name == "mod") || names == ["lib"] {
        names.pop();
    }
    names
}

impl Sources {
    /// Those under a folder, such as `src`.
    pub fn read(root: &Path) -> Self {
        let mut paths = vec![];
        files(root, &mut paths);
        let read = |path: PathBuf| {
            let text = std::fs::read_to_string(&path).unwrap();
            let parsed = syn::parse_file(&text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
            let mut found = Found::default();
            found.visit_file(&parsed);
            let file = path.strip_prefix(root).unwrap().to_path_buf();
            let is_kept = |number: usize| found.for_tests.iter().all(|[first, last]| !(*first..=*last).contains(&number));
            let code = |(number, line): &(usize, &str)| is_kept(number + 1) && !line.trim_start().starts_with("//");
            let text = text.lines().enumerate().filter(code).map(|(_, line)| line).collect::<Vec<_>>().join("\n");
            (module(&file), Source { file, text, found })
        };
        let all: BTreeMap<Module, Source> = paths.into_iter().filter(|path| !path.ends_with("main.rs")).map(read).collect();
        let is_declared = |module: &Module| {
            (1..=module.len()).all(|length| {
                let (parent, name) = (&module[..length - 1], &module[length - 1]);
                all.get(parent).is_some_and(|source| source.found.children.contains(name) && !source.found.tests.contains(name))
            })
        };
        let kept: BTreeSet<Module> = all.keys().filter(|module| is_declared(module)).cloned().collect();
        Self { files: all.into_iter().filter(|(module, _)| kept.contains(module)).collect() }
    }

    /// Modules that a module uses, each where what is used is defined.
    pub fn uses(&self, user: &Module) -> BTreeSet<&Module> {
        let found = &self.files[user].found;
        let absolute = found.paths.iter().filter_map(|path| self.absolute(user, path));
        absolute.filter_map(|path| self.owner(&path, 0)).filter(|owner| *owner != user).collect()
    }

    /// From the root on; none for what is of another crate, or of the same file.
    fn absolute(&self, module: &Module, path: &[String]) -> Option<Vec<String>> {
        let (first, rest) = path.split_first()?;
        let mut at = match first.as_str() {
            "crate" => vec![],
            "self" => module.clone(),
            "super" => module[..module.len().checked_sub(1)?].to_vec(),
            name if self.files[module].found.children.contains(name) => [module.as_slice(), &[name.to_string()]].concat(),
            _ => return None,
        };
        for name in rest {
            if name == "super" {
                at.pop();
            } else {
                at.push(name.clone());
            }
        }
        Some(at)
    }

    fn owner(&self, path: &[String], depth: usize) -> Option<&Module> {
        let length = (0..=path.len()).rev().find(|length| self.files.contains_key(&path[..*length]))?;
        let (module, source) = self.files.get_key_value(&path[..length])?;
        let Some(name) = path.get(length) else { return Some(module) };
        assert!(depth < 16, "re-exports of {} go round", path.join("::"));
        let renamed = source.found.exports.iter().find(|(known, _)| known == name);
        if let Some((_, target)) = renamed {
            let target = self.absolute(module, target).filter(|target| target[..] != path[..=length])?;
            return self.owner(&[&target[..], &path[length + 1..]].concat(), depth + 1);
        }
        Some(module)
    }

    /// Of the files and folders in a folder: those that use each other in a circle, with the uses that make it.
    pub fn circles(&self) -> BTreeMap<String, Vec<String>> {
        let mut edges: BTreeMap<(Module, String), BTreeMap<String, BTreeSet<String>>> = BTreeMap::new();
        for user in self.files.keys() {
            for used in self.uses(user) {
                let common = user.iter().zip(used).take_while(|(a, b)| a == b).count();
                // A folder's own file holds what its files share.
                if common == user.len() || common == used.len() {
                    continue;
                }
                let how = format!("{} -> {}", user.join("/"), used.join("/"));
                let from = edges.entry((user[..common].to_vec(), user[common].clone())).or_default();
                from.entry(used[common].clone()).or_default().insert(how);
            }
        }
        let folders: BTreeSet<&Module> = edges.keys().map(|(folder, _)| folder).collect();
        let mut circles = BTreeMap::new();
        for folder in folders {
            let next = |name: &String| edges.get(&(folder.clone(), name.clone())).into_iter().flat_map(BTreeMap::keys);
            let reached = |from: &String| {
                let (mut seen, mut open) = (BTreeSet::new(), vec![from.clone()]);
                while let Some(name) = open.pop() {
                    open.extend(next(&name).filter(|name| seen.insert((*name).clone())).cloned().collect::<Vec<_>>());
                }
                seen
            };
            let names: BTreeSet<&String> = edges.keys().filter(|(own, _)| own == folder).map(|(_, name)| name).collect();
            let reach: BTreeMap<&String, BTreeSet<String>> = names.iter().map(|name| (*name, reached(name))).collect();
            let mut told: BTreeSet<&String> = BTreeSet::new();
            for name in names.iter().copied().filter(|name| reach[name].contains(*name)) {
                if told.contains(name) {
                    continue;
                }
                let circle: Vec<&String> =
                    names.iter().copied().filter(|other| reach[name].contains(*other) && reach[other].contains(name)).collect();
                told.extend(&circle);
                let inside = |a: &String| edges[&(folder.clone(), a.clone())].iter().filter(|(b, _)| circle.contains(b));
                let uses = circle.iter().flat_map(|a| inside(a)).flat_map(|(_, how)| how.clone()).collect();
                let list = circle.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(", ");
                circles.insert(format!("{}: {list}", folder.join("/")), uses);
            }
        }
        circles
    }
}
