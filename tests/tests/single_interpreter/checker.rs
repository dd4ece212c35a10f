//! Reads one source file as a syntax tree and collects its faults.

use syn::visit::{self, Visit};
use syn::{Attribute, Expr, Meta};

use super::expressions::{
    computes, is_arithmetic, is_float, is_function, names_operation, selects, statement,
};
use super::words::{
    FLOAT_FUNCTIONS, FLOAT_PATHS, is_computing_function, is_float_word, is_operation,
    is_operator_word, macro_words,
};

/// What a file may contain.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    /// The one place for arithmetic.
    Maths,
    /// The rest of the runtime.
    Runtime,
    /// The host's own f64: physics, statistics, and the fit of front ends.
    Host,
    /// Formulas of tasks in f64, whose functions have names of operations. They never see a policy.
    Formulas,
    /// Everything else.
    Outside,
}

/// Folders of [`Place::Host`].
const HOST: [&str; 4] = [
    "trainer/tasks/src/task/",
    "trainer/tasks/src/stats/",
    "trainer/src/front_end/",
    "trainer/src/tune/",
];

/// The file of [`Place::Formulas`]. It may not know the runtime.
const FORMULAS: &str = "trainer/tasks/src/task/mujoco/custom/expression.rs";

fn place(path: &str) -> Place {
    if path == "runtime/src/math.rs" || path.starts_with("runtime/src/math/") {
        Place::Maths
    } else if path.starts_with("runtime/src/") {
        Place::Runtime
    } else if path == FORMULAS {
        Place::Formulas
    } else if HOST.iter().any(|folder| path.starts_with(folder)) {
        Place::Host
    } else {
        Place::Outside
    }
}

fn attribute_text(attribute: &Attribute) -> String {
    match &attribute.meta {
        Meta::List(list) => macro_words(&list.tokens.to_string()).join(" "),
        _ => String::new(),
    }
}

fn named(attribute: &Attribute, names: &[&str]) -> bool {
    names.iter().any(|name| attribute.path().is_ident(name))
}

/// Reads one file and collects its faults.
struct Checker<'a> {
    path: &'a str,
    place: Place,
    /// Names of the functions around the current node.
    functions: Vec<String>,
    /// Branches of the current function that select an operation and compute.
    branches: usize,
    faults: Vec<String>,
}

/// The faults of one source file, whose path is given from the repository's root.
pub fn check(path: &str, source: &str) -> Vec<String> {
    let file = syn::parse_file(source).unwrap_or_else(|fault| panic!("{path}: {fault}"));
    let mut checker = Checker {
        path,
        place: place(path),
        functions: Vec::new(),
        branches: 0,
        faults: Vec::new(),
    };
    let denies = |attribute: &Attribute| {
        named(attribute, &["deny", "forbid"])
            && attribute_text(attribute).contains("float_arithmetic")
    };
    if checker.place == Place::Formulas && source.contains("tpg_runtime") {
        checker.fault("formulas that know the runtime");
    }
    if path == "runtime/src/lib.rs" && !file.attrs.iter().any(denies) {
        checker.fault("clippy::float_arithmetic is not denied for the crate");
    }
    checker.visit_file(&file);
    checker.faults
}

impl Checker<'_> {
    fn fault(&mut self, what: &str) {
        let function = self
            .functions
            .last()
            .map_or_else(String::new, |name| format!(", {name}"));
        self.faults.push(format!("{}{function}: {what}", self.path));
    }

    fn word(&mut self, word: &str) {
        let allowed = matches!(self.place, Place::Maths | Place::Host);
        if word == "libm" && !allowed {
            self.fault("`libm` outside the runtime's maths");
        }
    }

    /// Visits an item with branches of its own.
    fn scope(&mut self, name: String, inside: impl FnOnce(&mut Self)) {
        self.functions.push(name);
        let outer = std::mem::take(&mut self.branches);
        inside(self);
        let exempt = matches!(self.place, Place::Maths | Place::Runtime | Place::Formulas);
        if self.branches >= 3 && !exempt {
            self.fault(&format!(
                "a second interpreter: {} branches select an operation and compute",
                self.branches
            ));
        }
        self.branches = outer;
        self.functions.pop();
    }

    fn is_test(&self, attributes: &[Attribute]) -> bool {
        self.place == Place::Runtime
            && attributes
                .iter()
                .any(|a| a.path().is_ident("cfg") && attribute_text(a) == "test")
    }

    /// The one table that is computed outside the maths, by the compiler.
    fn is_known_table(&self, item: &syn::ItemFn) -> bool {
        self.path == "runtime/src/memory/distribution.rs"
            && item.sig.constness.is_some()
            && item.sig.ident == "cauchy_rows"
    }
}

impl<'ast> Visit<'ast> for Checker<'_> {
    fn visit_ident(&mut self, ident: &'ast syn::Ident) {
        self.word(&ident.to_string());
    }

    fn visit_attribute(&mut self, attribute: &'ast Attribute) {
        let text = attribute_text(attribute);
        let test_only = attribute.path().is_ident("cfg_attr") && text.starts_with("test ,");
        let silences = named(attribute, &["allow", "expect", "warn"])
            || (attribute.path().is_ident("cfg_attr") && !test_only);
        if text.contains("float_arithmetic") && silences && self.place != Place::Maths {
            self.fault("clippy::float_arithmetic is silenced");
        }
    }

    fn visit_item_mod(&mut self, item: &'ast syn::ItemMod) {
        if !self.is_test(&item.attrs) {
            visit::visit_item_mod(self, item);
        }
    }

    fn visit_item_fn(&mut self, item: &'ast syn::ItemFn) {
        if !self.is_test(&item.attrs) && !self.is_known_table(item) {
            self.scope(item.sig.ident.to_string(), |c| {
                visit::visit_item_fn(c, item);
            });
        }
    }

    fn visit_impl_item_fn(&mut self, item: &'ast syn::ImplItemFn) {
        self.scope(item.sig.ident.to_string(), |c| {
            visit::visit_impl_item_fn(c, item);
        });
    }

    fn visit_item_const(&mut self, item: &'ast syn::ItemConst) {
        self.scope(item.ident.to_string(), |c| {
            visit::visit_item_const(c, item);
        });
    }

    fn visit_item_static(&mut self, item: &'ast syn::ItemStatic) {
        self.scope(item.ident.to_string(), |c| {
            visit::visit_item_static(c, item);
        });
    }

    fn visit_expr_binary(&mut self, binary: &'ast syn::ExprBinary) {
        let literal = is_float(&binary.left) || is_float(&binary.right);
        if self.place == Place::Runtime && is_arithmetic(&binary.op) && literal {
            self.fault("arithmetic on a float literal");
        }
        visit::visit_expr_binary(self, binary);
    }

    fn visit_expr_method_call(&mut self, call: &'ast syn::ExprMethodCall) {
        if self.place == Place::Runtime
            && FLOAT_FUNCTIONS.contains(&call.method.to_string().as_str())
        {
            self.fault(&format!("float method `{}`", call.method));
        }
        visit::visit_expr_method_call(self, call);
    }

    fn visit_path(&mut self, path: &'ast syn::Path) {
        let names: Vec<String> = path.segments.iter().map(|s| s.ident.to_string()).collect();
        if let (Place::Runtime, [.., float, name]) = (self.place, names.as_slice())
            && (float == "f32" || float == "f64")
            && !FLOAT_PATHS.contains(&name.as_str())
        {
            self.fault(&format!("`{float}::{name}`"));
        }
        visit::visit_path(self, path);
    }

    fn visit_arm(&mut self, arm: &'ast syn::Arm) {
        self.branches += usize::from(selects(&arm.pat) && computes(&arm.body));
        visit::visit_arm(self, arm);
    }

    fn visit_expr_if(&mut self, expr: &'ast syn::ExprIf) {
        let branch: Vec<&Expr> = expr
            .then_branch
            .stmts
            .iter()
            .filter_map(statement)
            .collect();
        self.branches +=
            usize::from(names_operation(&expr.cond) && branch.into_iter().any(computes));
        visit::visit_expr_if(self, expr);
    }

    fn visit_expr_tuple(&mut self, tuple: &'ast syn::ExprTuple) {
        let (select, compute) = (
            tuple.elems.iter().any(names_operation),
            tuple.elems.iter().any(is_function),
        );
        self.branches += usize::from(select && compute);
        visit::visit_expr_tuple(self, tuple);
    }

    fn visit_expr_call(&mut self, call: &'ast syn::ExprCall) {
        let (select, compute) = (
            call.args.iter().any(names_operation),
            call.args.iter().any(is_function),
        );
        self.branches += usize::from(select && compute);
        visit::visit_expr_call(self, call);
    }

    /// Macros are no syntax tree: the same rules on their words.
    fn visit_macro(&mut self, item: &'ast syn::Macro) {
        let words = macro_words(&item.tokens.to_string());
        for word in &words {
            self.word(word);
        }
        let pairs = || words.iter().zip(words.iter().skip(1));
        let arithmetic = |(x, y): (&String, &String)| {
            (is_float_word(x) && is_operator_word(y))
                || (is_operator_word(x) && is_float_word(y) && *x != "-")
        };
        if self.place == Place::Runtime && pairs().any(arithmetic) {
            self.fault("arithmetic on a float literal in a macro");
        }
        let computes = words
            .iter()
            .any(|w| is_operator_word(w) || is_computing_function(w));
        let selected = pairs().filter(|(name, arrow)| arrow.as_str() == "=>" && is_operation(name));
        if computes && self.place != Place::Maths && self.place != Place::Runtime {
            self.branches += selected.count();
        }
        visit::visit_macro(self, item);
    }
}
