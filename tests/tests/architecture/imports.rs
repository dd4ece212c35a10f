//! Finds modules of a crate that import each other in a circle.
//!
//! A module is a file, or a `mod name { … }` within one. It imports another if it names an item that stands there, by
//! `use` or by a path. Re-exports are followed to the file that holds the item, so that a `mod.rs` or `lib.rs` that only
//! declares and re-exports imports nothing. A module may use what the modules around it define, since a file and its
//! folder are one thing cut into parts; only the other direction counts. Left out are tests, and what stands in the
//! tokens of macros.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::fs;
use std::path::{Path, PathBuf};

use syn::visit::{self, Visit};
use syn::{Attribute, Item, UseTree, Visibility};

/// The names from the crate's root to a module or an item.
type Names = Vec<String>;

#[derive(Default)]
struct Module {
    /// Names that stand for items of other modules: the name, where it points to, whether others see it.
    uses: Vec<(String, Names, bool)>,
    /// Where `use path::*` points to.
    globs: Vec<(Names, bool)>,
    /// Paths in the code, as written.
    paths: BTreeSet<Names>,
    /// Names of the items that stand here.
    items: BTreeSet<String>,
}

/// The circles of a crate, each as the names of its modules.
pub fn circles(crate_root: &Path) -> Vec<String> {
    let mut modules = BTreeMap::new();
    let file = fs::read_to_string(crate_root).expect("a crate");
    let folder = crate_root.parent().expect("a folder");
    read(&file, Vec::new(), folder, &mut modules);
    let edges: BTreeMap<&Names, BTreeSet<Names>> = (modules.iter())
        .map(|(name, module)| (name, imports(&modules, name, module)))
        .collect();
    let mut seen = BTreeSet::new();
    let mut found = Vec::new();
    for start in modules.keys() {
        if let Some(circle) = shortest_circle(&edges, start) {
            let members: BTreeSet<Names> = circle.iter().cloned().collect();
            if seen.insert(members) {
                let shown: Vec<String> = circle.iter().map(shown).collect();
                found.push(shown.join(" -> "));
            }
        }
    }
    found
}

fn shown(name: &Names) -> String {
    if name.is_empty() {
        "crate".into()
    } else {
        name.join("::")
    }
}

/// The fewest imports that lead from a module back to it.
fn shortest_circle(edges: &BTreeMap<&Names, BTreeSet<Names>>, start: &Names) -> Option<Vec<Names>> {
    let mut queue = VecDeque::from([vec![start.clone()]]);
    let mut seen = BTreeSet::new();
    while let Some(way) = queue.pop_front() {
        for next in edges.get(way.last()?).into_iter().flatten() {
            let mut longer = way.clone();
            longer.push(next.clone());
            if next == start {
                return Some(longer);
            }
            if seen.insert(next.clone()) {
                queue.push_back(longer);
            }
        }
    }
    None
}

/// Whether an item is left out: of tests, or compiled from another folder.
fn is_left_out(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        let path = attribute.path();
        let tokens = || match &attribute.meta {
            syn::Meta::List(list) => list.tokens.to_string(),
            _ => String::new(),
        };
        path.is_ident("test")
            || path.is_ident("path")
            || path.is_ident("cfg") && tokens().contains("test")
    })
}

/// Reads a file and the modules that it declares; `folder` is where those lie.
fn read(source: &str, name: Names, folder: &Path, modules: &mut BTreeMap<Names, Module>) {
    let file = syn::parse_file(source).expect("Rust");
    gather(&file.items, name, folder, modules);
}

fn gather(items: &[Item], name: Names, folder: &Path, modules: &mut BTreeMap<Names, Module>) {
    let mut module = Module::default();
    for item in items {
        if let Item::Mod(inner) = item {
            if is_left_out(&inner.attrs) {
                continue;
            }
            let child = joined(&name, &inner.ident.to_string());
            let below = folder.join(inner.ident.to_string());
            match &inner.content {
                Some((_, items)) => gather(items, child, &below, modules),
                None => {
                    let candidates: [PathBuf; 2] =
                        [below.with_extension("rs"), below.join("mod.rs")];
                    let path = candidates.iter().find(|path| path.is_file());
                    let path = path.unwrap_or_else(|| panic!("no file of {child:?}"));
                    let source = fs::read_to_string(path).expect("a module");
                    read(&source, child, &below, modules);
                }
            }
            continue;
        }
        module.visit_item(item);
    }
    modules.insert(name, module);
}

fn joined(name: &[String], last: &str) -> Names {
    [name, &[last.to_owned()]].concat()
}

impl Module {
    fn import(&mut self, tree: &UseTree, before: &[String], is_public: bool) {
        match tree {
            UseTree::Path(path) => {
                self.import(
                    &path.tree,
                    &joined(before, &path.ident.to_string()),
                    is_public,
                );
            }
            UseTree::Group(group) => {
                for tree in &group.items {
                    self.import(tree, before, is_public);
                }
            }
            UseTree::Glob(_) => self.globs.push((before.to_vec(), is_public)),
            UseTree::Name(name) if name.ident == "self" => {
                let last = before.last().cloned().unwrap_or_default();
                self.uses.push((last, before.to_vec(), is_public));
            }
            UseTree::Name(name) => {
                let name = name.ident.to_string();
                self.uses
                    .push((name.clone(), joined(before, &name), is_public));
            }
            UseTree::Rename(rename) => {
                let target = joined(before, &rename.ident.to_string());
                self.uses
                    .push((rename.rename.to_string(), target, is_public));
            }
        }
    }
}

impl<'ast> Visit<'ast> for Module {
    fn visit_item(&mut self, item: &'ast Item) {
        let (attributes, name) = match item {
            Item::Const(item) => (&item.attrs, Some(&item.ident)),
            Item::Enum(item) => (&item.attrs, Some(&item.ident)),
            Item::Fn(item) => (&item.attrs, Some(&item.sig.ident)),
            Item::Static(item) => (&item.attrs, Some(&item.ident)),
            Item::Struct(item) => (&item.attrs, Some(&item.ident)),
            Item::Trait(item) => (&item.attrs, Some(&item.ident)),
            Item::Type(item) => (&item.attrs, Some(&item.ident)),
            Item::Impl(item) => (&item.attrs, None),
            Item::Use(item) => (&item.attrs, None),
            _ => return visit::visit_item(self, item),
        };
        if !is_left_out(attributes) {
            self.items.extend(name.map(ToString::to_string));
            visit::visit_item(self, item);
        }
    }

    fn visit_item_use(&mut self, item: &'ast syn::ItemUse) {
        let is_public = !matches!(item.vis, Visibility::Inherited);
        self.import(&item.tree, &[], is_public);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Names = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if names.len() > 1 {
            self.paths.insert(names);
        }
        visit::visit_path(self, path);
    }
}

/// The modules that hold what a module names, without itself and those around it.
fn imports(modules: &BTreeMap<Names, Module>, name: &Names, module: &Module) -> BTreeSet<Names> {
    let private = module.uses.iter().filter(|(_, _, is_public)| !is_public);
    let mut found: BTreeSet<Names> = private
        .filter_map(|(_, target, _)| find(modules, name, target, 0))
        // A module that is imported as a whole counts where a path goes on from it.
        .filter(|(_, whole)| !whole)
        .chain(module.paths.iter().filter_map(|path| {
            let alias = module.uses.iter().find(|(alias, _, _)| *alias == path[0]);
            match alias {
                Some((_, target, _)) => find(modules, name, &[target, &path[1..]].concat(), 0),
                None => find(modules, name, path, 0),
            }
        }))
        .map(|(module, _)| module)
        .collect();
    for (target, is_public) in &module.globs {
        if !is_public {
            found.extend(find(modules, name, target, 0).map(|(module, _)| module));
        }
    }
    found.retain(|found| !name.starts_with(found));
    found
}

/// The module that holds what a path within `from` names, and whether the path is that of a whole module; `None` if it
/// leads out of the crate.
fn find(
    modules: &BTreeMap<Names, Module>,
    from: &[String],
    path: &[String],
    depth: usize,
) -> Option<(Names, bool)> {
    // Re-exports of re-exports end; a circle of globs does not.
    if depth > 8 {
        return None;
    }
    let mut at: Names = from.to_vec();
    let mut rest = path;
    while let Some((first, others)) = rest.split_first() {
        match first.as_str() {
            "crate" => at.clear(),
            "self" => {}
            "super" => drop(at.pop()?),
            _ => break,
        }
        rest = others;
    }
    let is_relative = rest.len() < path.len();
    for (k, name) in rest.iter().enumerate() {
        let child = joined(&at, name);
        if modules.contains_key(&child) {
            at = child;
            continue;
        }
        if k == 0 && !is_relative {
            return None;
        }
        let module = modules.get(&at)?;
        if module.items.contains(name) {
            return Some((at, false));
        }
        let further =
            |target: &[String]| find(modules, &at, &[target, &rest[k + 1..]].concat(), depth + 1);
        if let Some((_, target, _)) = module.uses.iter().find(|(alias, _, _)| alias == name) {
            return further(target);
        }
        let globs = module.globs.iter();
        let through = globs.filter_map(|(target, _)| further(&joined(target, name)));
        return through.into_iter().next().or(Some((at, false)));
    }
    Some((at, true))
}
