//! Checks the public surface: a `pub` item is named by another package or by tests, is part of the signature of such an item, or is
//! listed here with its reason.
#![expect(
    clippy::unwrap_used,
    reason = "a test that cannot read the workspace must fail"
)]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, ImplItem, Item, ItemMod, Visibility};

/// Greatest number of `pub` items that no other package names.
const MOST_UNNAMED: usize = 150;

/// Items that no other package and no public signature names, and why they are public.
const EXCEPTIONS: &[(&str, &str)] = &[(
    "Symbol",
    "type of the elements of SYMBOLS, which a macro declares",
)];

/// Public items of a package, and the names in their signatures.
#[derive(Default)]
struct Surface {
    items: BTreeSet<String>,
    signatures: BTreeSet<String>,
}

const fn is_public(visibility: &Visibility) -> bool {
    matches!(visibility, Visibility::Public(_))
}

fn is_for_tests(attributes: &[Attribute]) -> bool {
    let text = |a: &Attribute| a.meta.require_list().map(|l| l.tokens.to_string());
    attributes
        .iter()
        .any(|a| a.path().is_ident("cfg") && text(a).is_ok_and(|t| t.contains("test")))
}

/// Collects all names in a part of a signature.
struct Names<'a>(&'a mut BTreeSet<String>);

impl Visit<'_> for Names<'_> {
    fn visit_ident(&mut self, name: &syn::Ident) {
        self.0.insert(name.to_string());
    }
}

impl<'a> Visit<'a> for Surface {
    fn visit_item_mod(&mut self, module: &'a ItemMod) {
        if !is_for_tests(&module.attrs) {
            visit::visit_item_mod(self, module);
        }
    }

    fn visit_item(&mut self, item: &'a Item) {
        let mut names = Names(&mut self.signatures);
        let (visibility, name) = match item {
            Item::Fn(i) => {
                names.visit_signature(&i.sig);
                (&i.vis, &i.sig.ident)
            }
            Item::Struct(i) => {
                let public = i.fields.iter().filter(|field| is_public(&field.vis));
                public.for_each(|field| names.visit_type(&field.ty));
                (&i.vis, &i.ident)
            }
            Item::Enum(i) => {
                let variants = i.variants.iter().flat_map(|variant| &variant.fields);
                variants.for_each(|field| names.visit_type(&field.ty));
                (&i.vis, &i.ident)
            }
            Item::Trait(i) => {
                i.items.iter().for_each(|item| names.visit_trait_item(item));
                (&i.vis, &i.ident)
            }
            Item::Const(i) => {
                names.visit_type(&i.ty);
                (&i.vis, &i.ident)
            }
            Item::Type(i) => {
                names.visit_type(&i.ty);
                (&i.vis, &i.ident)
            }
            Item::Mod(i) => (&i.vis, &i.ident),
            _ => return visit::visit_item(self, item),
        };
        if is_public(visibility) {
            self.items.insert(name.to_string());
        }
        visit::visit_item(self, item);
    }

    fn visit_impl_item(&mut self, item: &'a ImplItem) {
        let mut names = Names(&mut self.signatures);
        let named = match item {
            ImplItem::Fn(i) => {
                names.visit_signature(&i.sig);
                is_public(&i.vis).then_some(&i.sig.ident)
            }
            ImplItem::Type(i) => {
                names.visit_type(&i.ty);
                None
            }
            ImplItem::Const(i) => {
                names.visit_type(&i.ty);
                is_public(&i.vis).then_some(&i.ident)
            }
            _ => None,
        };
        self.items.extend(named.map(ToString::to_string));
    }
}

/// Files of a package.
#[derive(Default)]
struct Package {
    /// Its library, without tests and examples.
    library: Vec<PathBuf>,
    /// Everything else that names its items like another package does.
    users: Vec<PathBuf>,
}

fn collect(folder: &Path, package: Option<&Path>, to: &mut BTreeMap<PathBuf, Package>) {
    let own = folder.join("Cargo.toml").exists().then_some(folder);
    let package = own.or(package);
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if name != "target" && !name.starts_with('.') {
                collect(&path, package, to);
            }
        } else if let Some(package) =
            package.filter(|_| name.ends_with(".rs") && !path.ends_with(file!()))
        {
            let inside = path.strip_prefix(package).unwrap();
            let library = inside.starts_with("src")
                && !inside.starts_with("src/bin")
                && inside != Path::new("src/main.rs")
                && !inside.iter().any(|part| part == "tests");
            let files = to.entry(package.to_owned()).or_default();
            if library {
                files.library.push(path);
            } else {
                files.users.push(path);
            }
        }
    }
}

fn words(files: &[PathBuf]) -> BTreeSet<String> {
    let mut found = BTreeSet::new();
    for file in files {
        let text = std::fs::read_to_string(file).unwrap();
        let words = text.split(|c: char| !c.is_alphanumeric() && c != '_');
        found.extend(words.map(str::to_owned));
    }
    found
}

#[test]
fn public_items_have_users_or_a_reason() {
    let root = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."));
    let mut packages = BTreeMap::new();
    collect(root, None, &mut packages);
    let used: BTreeMap<&PathBuf, [BTreeSet<String>; 2]> = packages
        .iter()
        .map(|(at, files)| (at, [words(&files.library), words(&files.users)]))
        .collect();
    let mut unnamed = 0;
    let mut faults = Vec::new();
    let mut excused = BTreeSet::new();
    for (at, files) in &packages {
        let inside = at.strip_prefix(root).unwrap();
        if !inside.starts_with("crates")
            && inside != Path::new("hil")
            && inside != Path::new("hil/nightly")
        {
            continue;
        }
        let mut surface = Surface::default();
        for file in &files.library {
            let text = std::fs::read_to_string(file).unwrap();
            surface.visit_file(&syn::parse_file(&text).unwrap());
        }
        for item in &surface.items {
            let elsewhere = used.iter().any(|(other, [library, users])| {
                users.contains(item) || (*other != at && library.contains(item))
            });
            if elsewhere {
                continue;
            }
            unnamed += 1;
            let reason = EXCEPTIONS.iter().find(|(name, _)| name == item);
            if let Some((name, _)) = reason {
                excused.insert(*name);
            } else if !surface.signatures.contains(item) {
                faults.push(format!("{}: {item}", inside.display()));
            }
        }
    }
    for (name, _) in EXCEPTIONS {
        if !excused.contains(name) {
            faults.push(format!("{name}: an exception that is not needed"));
        }
    }
    assert!(
        faults.is_empty(),
        "public, but named by no other package, test or public signature; make them `pub(crate)` or state a reason:\n{}",
        faults.join("\n")
    );
    assert!(
        unnamed <= MOST_UNNAMED,
        "{unnamed} items that no other package names, at most {MOST_UNNAMED}"
    );
}
