//! Checks dependencies between files within each crate: limits cycles.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read the workspace must fail"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::Visit;
use syn::{Attribute, Item, ItemMod, UseTree, Visibility};

/// Present number of cycles of files; none may be added, and none may have more files than [`MAX_FILES`].
const MOST_CIRCLES: usize = 6;
const MOST_FILES: usize = 3;

/// Path of a module from the root of its crate.
type Module = Vec<String>;

/// References from one file to others.
#[derive(Default)]
struct References {
    /// Paths used.
    used: Vec<Vec<String>>,
    /// Paths re-exported under their last name.
    handed_on: Vec<Vec<String>>,
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    let text = |a: &Attribute| a.meta.require_list().map(|l| l.tokens.to_string());
    attributes
        .iter()
        .any(|a| a.path().is_ident("cfg") && text(a).is_ok_and(|t| t.contains("test")))
}

fn leaves(tree: &UseTree, before: &[String], out: &mut Vec<Vec<String>>) {
    let mut path = before.to_vec();
    match tree {
        UseTree::Path(p) => {
            path.push(p.ident.to_string());
            leaves(&p.tree, &path, out);
        }
        UseTree::Name(n) if n.ident == "self" => out.push(path),
        UseTree::Name(n) => {
            path.push(n.ident.to_string());
            out.push(path);
        }
        UseTree::Rename(r) => {
            path.push(r.ident.to_string());
            out.push(path);
        }
        UseTree::Glob(_) => out.push(path),
        UseTree::Group(g) => g.items.iter().for_each(|t| leaves(t, before, out)),
    }
}

impl<'a> Visit<'a> for References {
    fn visit_item(&mut self, item: &'a Item) {
        match item {
            Item::Use(u) if is_for_tests(&u.attrs) => {}
            Item::Use(u) if matches!(u.vis, Visibility::Inherited) => {
                leaves(&u.tree, &[], &mut self.used);
            }
            Item::Use(u) => leaves(&u.tree, &[], &mut self.handed_on),
            Item::Mod(m) if is_for_tests(&m.attrs) => {}
            other => syn::visit::visit_item(self, other),
        }
    }

    fn visit_path(&mut self, path: &'a syn::Path) {
        if path.segments.len() > 1 && path.leading_colon.is_none() {
            let names = path.segments.iter().map(|s| s.ident.to_string());
            self.used.push(names.collect());
        }
        syn::visit::visit_path(self, path);
    }
}

/// Non-test files of a crate, by module.
fn files(root: &Path, file: &Path, module: &Module, out: &mut BTreeMap<Module, References>) {
    let text = fs::read_to_string(file).unwrap();
    let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let mut mentions = References::default();
    mentions.visit_file(&parsed);
    out.insert(module.clone(), mentions);
    let elsewhere = parsed.items.iter().filter_map(|item| match item {
        Item::Mod(ItemMod {
            attrs,
            ident,
            content: None,
            ..
        }) if !is_for_tests(attrs) => Some(ident.to_string()),
        _ => None,
    });
    for name in elsewhere {
        let mut child = module.clone();
        child.push(name);
        let place: PathBuf = child.iter().fold(root.to_owned(), |p, part| p.join(part));
        let candidates = [place.with_extension("rs"), place.join("mod.rs")];
        if let Some(found) = candidates.iter().find(|p| p.is_file()) {
            files(root, found, &child, out);
        }
    }
}

/// The file that defines `path`, as seen from `from`; follows re-exports.
fn defined_in(
    all: &BTreeMap<Module, References>,
    from: &Module,
    path: &[String],
) -> Option<Module> {
    let mut rest = path;
    let mut at: Module = match rest.first()?.as_str() {
        "crate" => Vec::new(),
        "self" | "super" => from.clone(),
        child => {
            let mut inner = from.clone();
            inner.push(child.to_owned());
            all.contains_key(&inner).then(|| from.clone())?
        }
    };
    while let Some(word @ ("crate" | "self" | "super")) = rest.first().map(String::as_str) {
        if word == "super" {
            at.pop();
        }
        rest = &rest[1..];
    }
    while let Some(next) = rest.first() {
        let mut inner = at.clone();
        inner.push(next.clone());
        if !all.contains_key(&inner) {
            break;
        }
        (at, rest) = (inner, &rest[1..]);
    }
    let onward = rest.first().and_then(|name| {
        let handed = all.get(&at)?.handed_on.iter();
        let mut named = handed.filter(|p| p.last() == Some(name));
        named.find_map(|p| defined_in(all, &at, p).filter(|to| *to != at))
    });
    onward.or(Some(at))
}

fn reached<'a>(
    from: &'a Module,
    uses: &'a BTreeMap<Module, BTreeSet<Module>>,
) -> BTreeSet<&'a Module> {
    let (mut observed, mut todo) = (BTreeSet::new(), vec![from]);
    while let Some(module) = todo.pop() {
        for next in uses.get(module).into_iter().flatten() {
            if observed.insert(next) {
                todo.push(next);
            }
        }
    }
    observed
}

/// Cycles of a crate, each as the names of its files.
fn circles(root: &Path) -> Vec<Vec<String>> {
    let mut all = BTreeMap::new();
    let start = ["lib.rs", "main.rs"].map(|f| root.join(f));
    let Some(start) = start.iter().find(|p| p.is_file()) else {
        return Vec::new();
    };
    files(root, start, &Vec::new(), &mut all);
    let uses: BTreeMap<Module, BTreeSet<Module>> = all
        .iter()
        .map(|(module, mentions)| {
            let of = |p: &Vec<String>| defined_in(&all, module, p).filter(|to| to != module);
            (
                module.clone(),
                mentions.used.iter().filter_map(of).collect(),
            )
        })
        .collect();
    let reach: BTreeMap<&Module, BTreeSet<&Module>> =
        all.keys().map(|m| (m, reached(m, &uses))).collect();
    let mut found: BTreeSet<Vec<String>> = BTreeSet::new();
    for module in all.keys().filter(|m| reach[m].contains(m)) {
        let both = |other: &&&Module| reach[**other].contains(module);
        let files = reach[module].iter().filter(both);
        found.insert(files.map(|m| m.join("/")).collect());
    }
    found.into_iter().collect()
}

fn sources() -> Vec<PathBuf> {
    let top = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let folders = ["crates", "crates/drivers", "hil/emulated"].map(|f| top.join(f));
    let inner = folders.iter().flat_map(|f| fs::read_dir(f).unwrap());
    let inner = inner.map(|entry| entry.unwrap().path().join("src"));
    let all = inner.chain([top.join("hil/src")]);
    let mut all: Vec<PathBuf> = all.filter(|p| p.is_dir()).collect();
    all.sort();
    all
}

#[test]
fn few_files_use_each_other_in_a_circle() {
    let found: Vec<String> = sources()
        .iter()
        .flat_map(|root| {
            circles(root)
                .into_iter()
                .map(|files| format!("{} in {}: {files:?}", files.len(), root.display()))
        })
        .collect();
    let large = found.iter().filter(|c| {
        let n = c.split(' ').next().and_then(|n| n.parse::<usize>().ok());
        n.is_none_or(|n| n > MOST_FILES)
    });
    let large: Vec<_> = large.collect();
    assert!(
        large.is_empty() && found.len() <= MOST_CIRCLES,
        "expected at most {MOST_CIRCLES} circles of at most {MOST_FILES} files, found {}: {found:#?}\n\
         next: what several files share gets a file of its own, below them",
        found.len()
    );
}

#[test]
fn a_cycle_through_reexports_is_found() {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path();
    let write = |name: &str, text: &str| fs::write(root.join(name), text).unwrap();
    write(
        "lib.rs",
        "mod a; mod b; mod c; pub use b::B; #[cfg(test)] mod t;",
    );
    write("a.rs", "use crate::B; pub struct A(B);");
    write("b.rs", "pub struct B; fn f(c: crate::c::C) {}");
    write(
        "c.rs",
        "pub struct C; #[cfg(test)] mod tests { use crate::a::A; }",
    );
    write("t.rs", "use crate::a::A;");
    assert_eq!(circles(root), [[""; 0]; 0]);
    write("c.rs", "pub struct C(super::a::A);");
    assert_eq!(circles(root), [["a", "b", "c"]]);
}
