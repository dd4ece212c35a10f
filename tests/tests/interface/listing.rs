//! A crate's public interface as text, from its sources: one line for each thing that others can name or implement.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use quote::ToTokens;
use syn::{Attribute, Fields, ImplItem, Item, ItemImpl, Signature, TraitItem, UseTree, Visibility};

/// The lines of a crate's interface, in order, without those of its tests.
///
/// Things of a private module count if a public one takes over their names. So a few lines too many may be there, none too few.
///
/// # Panics
/// If a source file cannot be read or is not Rust.
pub fn interface(lib: &Path) -> BTreeSet<String> {
    let mut listing = Listing::default();
    let root = Module {
        path: "crate".into(),
        folder: lib.parent().expect("a folder").to_owned(),
        public: true,
    };
    let items = read(lib);
    listing.collect_exports(&items, &root);
    listing.list(&items, &root);
    listing.lines
}

fn read(file: &Path) -> Vec<Item> {
    let text = fs::read_to_string(file).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    let parsed = syn::parse_file(&text).unwrap_or_else(|e| panic!("{}: {e}", file.display()));
    parsed.items
}

/// Where the walk is.
struct Module {
    path: String,
    /// Of the modules below it.
    folder: PathBuf,
    /// Whether others can name it.
    public: bool,
}

#[derive(Default)]
struct Listing {
    /// Names that public modules take over from others.
    exported: BTreeSet<String>,
    lines: BTreeSet<String>,
}

impl Listing {
    fn collect_exports(&mut self, items: &[Item], module: &Module) {
        for item in items {
            match item {
                Item::Use(item) if is_public(&item.vis) => names(&item.tree, &mut self.exported),
                _ => {}
            }
            if let Some((inner, items)) = module.below(item) {
                self.collect_exports(&items, &inner);
            }
        }
    }

    fn list(&mut self, items: &[Item], module: &Module) {
        for item in items {
            if let Some((inner, items)) = module.below(item) {
                if inner.public {
                    self.line(module, attributes(item), &format!("mod {}", inner.name()));
                }
                self.list(&items, &inner);
            }
            self.item(item, module);
        }
    }

    fn line(&mut self, module: &Module, attributes: &[Attribute], text: &str) {
        let conditions = attributes.iter().filter(|a| a.path().is_ident("cfg"));
        let conditions: String = conditions.map(|a| format!(" {}", tokens(a))).collect();
        self.lines
            .insert(format!("{}: {text}{conditions}", module.path));
    }

    /// Whether others can name what has this name in this module.
    fn reachable(&self, module: &Module, vis: &Visibility, name: &str) -> bool {
        is_public(vis) && (module.public || self.exported.contains(name))
    }

    fn item(&mut self, item: &Item, module: &Module) {
        let attributes = attributes(item);
        if is_test(attributes) {
            return;
        }
        match item {
            Item::Use(item) if is_public(&item.vis) && module.public => {
                self.line(module, attributes, &format!("use {}", tokens(&item.tree)));
            }
            Item::Fn(item) if self.reachable(module, &item.vis, &item.sig.ident.to_string()) => {
                self.line(module, attributes, &signature(&item.sig));
            }
            Item::Const(item) if self.reachable(module, &item.vis, &item.ident.to_string()) => {
                let text = format!("const {}: {}", item.ident, tokens(&item.ty));
                self.line(module, attributes, &text);
            }
            Item::Static(item) if self.reachable(module, &item.vis, &item.ident.to_string()) => {
                let text = format!("static {}: {}", item.ident, tokens(&item.ty));
                self.line(module, attributes, &text);
            }
            Item::Type(item) if self.reachable(module, &item.vis, &item.ident.to_string()) => {
                let generics = tokens(&item.generics);
                let text = format!("type {}{generics} = {}", item.ident, tokens(&item.ty));
                self.line(module, attributes, &text);
            }
            Item::Struct(item) if self.reachable(module, &item.vis, &item.ident.to_string()) => {
                let generics = tokens(&item.generics) + &tokens(&item.generics.where_clause);
                let text = format!("{}struct {}{generics}", marks(attributes), item.ident);
                self.line(module, attributes, &text);
                self.fields(&item.fields, &item.ident.to_string(), module);
            }
            Item::Enum(item) if self.reachable(module, &item.vis, &item.ident.to_string()) => {
                let generics = tokens(&item.generics) + &tokens(&item.generics.where_clause);
                let text = format!("{}enum {}{generics}", marks(attributes), item.ident);
                self.line(module, attributes, &text);
                for variant in &item.variants {
                    let mut bare = variant.clone();
                    bare.attrs.clear();
                    for field in &mut bare.fields {
                        field.attrs.clear();
                    }
                    let text = format!("enum {}::{}", item.ident, tokens(&bare));
                    self.line(module, &variant.attrs, &text);
                }
            }
            Item::Trait(item) if self.reachable(module, &item.vis, &item.ident.to_string()) => {
                let generics = tokens(&item.generics) + &tokens(&item.generics.where_clause);
                let text = format!(
                    "trait {}{generics}: {}",
                    item.ident,
                    tokens(&item.supertraits)
                );
                self.line(module, attributes, &text);
                for inner in &item.items {
                    let (attributes, text) = match inner {
                        TraitItem::Fn(item) => (&item.attrs, signature(&item.sig)),
                        TraitItem::Const(item) => (
                            &item.attrs,
                            format!("const {}: {}", item.ident, tokens(&item.ty)),
                        ),
                        TraitItem::Type(item) => (&item.attrs, format!("type {}", item.ident)),
                        _ => continue,
                    };
                    self.line(module, attributes, &format!("trait {}::{text}", item.ident));
                }
            }
            Item::Macro(item) if attributes.iter().any(|a| a.path().is_ident("macro_export")) => {
                if let Some(name) = &item.ident {
                    self.line(module, attributes, &format!("macro {name}!"));
                }
            }
            Item::Impl(item) => self.implementation(item, module),
            _ => {}
        }
    }

    fn fields(&mut self, fields: &Fields, name: &str, module: &Module) {
        let public = fields.iter().enumerate().filter(|(_, f)| is_public(&f.vis));
        for (k, field) in public {
            let field_name = field
                .ident
                .as_ref()
                .map_or(k.to_string(), ToString::to_string);
            let text = format!("struct {name}.{field_name}: {}", tokens(&field.ty));
            self.line(module, &field.attrs, &text);
        }
    }

    /// Public functions and constants of a type, and which traits it has.
    fn implementation(&mut self, item: &ItemImpl, module: &Module) {
        let of = tokens(&item.self_ty);
        let name: String = of
            .chars()
            .take_while(|c| c.is_alphanumeric() || *c == '_')
            .collect();
        if !module.public && !self.exported.contains(&name) {
            return;
        }
        let generics = tokens(&item.generics) + &tokens(&item.generics.where_clause);
        if let Some((path, _)) = &item.trait_ {
            let text = format!("impl{generics} {} for {of}", tokens(path));
            self.line(module, &item.attrs, &text);
            return;
        }
        for inner in &item.items {
            match inner {
                ImplItem::Fn(inner) if is_public(&inner.vis) => {
                    let text = format!("impl{generics} {of}::{}", signature(&inner.sig));
                    self.line(module, &inner.attrs, &text);
                }
                ImplItem::Const(inner) if is_public(&inner.vis) => {
                    let ty = tokens(&inner.ty);
                    let text = format!("impl{generics} {of}::const {}: {ty}", inner.ident);
                    self.line(module, &inner.attrs, &text);
                }
                _ => {}
            }
        }
    }
}

impl Module {
    fn name(&self) -> &str {
        self.path.rsplit("::").next().unwrap_or_default()
    }

    /// The module that an item begins, with its items; `None` for everything else and for tests.
    fn below(&self, item: &Item) -> Option<(Module, Vec<Item>)> {
        let Item::Mod(item) = item else { return None };
        if is_test(&item.attrs) {
            return None;
        }
        let name = item.ident.to_string();
        let module = Module {
            path: format!("{}::{name}", self.path),
            folder: self.folder.join(&name),
            public: self.public && is_public(&item.vis),
        };
        let items = match &item.content {
            Some((_, items)) => items.clone(),
            None => {
                let file = self.folder.join(format!("{name}.rs"));
                let file = if file.exists() {
                    file
                } else {
                    module.folder.join("mod.rs")
                };
                read(&file)
            }
        };
        Some((module, items))
    }
}

const fn is_public(vis: &Visibility) -> bool {
    matches!(vis, Visibility::Public(_))
}

fn is_test(attributes: &[Attribute]) -> bool {
    attributes
        .iter()
        .any(|a| tokens(a).contains("cfg (test)") || tokens(a).contains("cfg(test)"))
}

/// The last names of a `use`.
fn names(tree: &UseTree, out: &mut BTreeSet<String>) {
    match tree {
        UseTree::Path(path) => names(&path.tree, out),
        UseTree::Name(name) => drop(out.insert(name.ident.to_string())),
        UseTree::Rename(rename) => drop(out.insert(rename.ident.to_string())),
        UseTree::Group(group) => group.items.iter().for_each(|tree| names(tree, out)),
        UseTree::Glob(_) => {}
    }
}

/// What of a type's attributes others depend on: what it derives, and whether it may grow.
fn marks(attributes: &[Attribute]) -> String {
    let kept = |a: &&Attribute| {
        ["derive", "non_exhaustive", "repr"]
            .iter()
            .any(|name| a.path().is_ident(name))
    };
    attributes
        .iter()
        .filter(kept)
        .map(|a| tokens(a) + " ")
        .collect()
}

fn signature(signature: &Signature) -> String {
    tokens(signature)
}

fn attributes(item: &Item) -> &[Attribute] {
    match item {
        Item::Const(item) => &item.attrs,
        Item::Enum(item) => &item.attrs,
        Item::Fn(item) => &item.attrs,
        Item::Impl(item) => &item.attrs,
        Item::Macro(item) => &item.attrs,
        Item::Mod(item) => &item.attrs,
        Item::Static(item) => &item.attrs,
        Item::Struct(item) => &item.attrs,
        Item::Trait(item) => &item.attrs,
        Item::Type(item) => &item.attrs,
        Item::Use(item) => &item.attrs,
        _ => &[],
    }
}

/// Tokens as text, spaced in one way whatever the source does.
fn tokens(tree: &impl ToTokens) -> String {
    let text = tree.to_token_stream().to_string();
    let mut text = text.split_whitespace().collect::<Vec<_>>().join(" ");
    for (from, to) in [
        (" :: ", "::"),
        (" : ", ": "),
        (" < ", "<"),
        ("< ", "<"),
        (" >", ">"),
        (" ,", ","),
        ("& ", "&"),
        (" (", "("),
        ("( ", "("),
        (" )", ")"),
        ("[ ", "["),
        (" ]", "]"),
        ("# [", "#["),
        (" ;", ";"),
        (" ! ", "!"),
        (",)", ")"),
        (", }", " }"),
    ] {
        text = text.replace(from, to);
    }
    text
}
