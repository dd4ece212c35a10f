//! What expressions and patterns do: select an operation, compute.

use syn::visit::{self, Visit};
use syn::{BinOp, Expr, Lit, Pat};

use super::words::{is_computing_function, is_operation};

/// Whether an operator is arithmetic.
pub fn is_arithmetic(op: &BinOp) -> bool {
    use BinOp::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Rem, RemAssign, Sub, SubAssign};
    matches!(
        op,
        Add(_)
            | Sub(_)
            | Mul(_)
            | Div(_)
            | Rem(_)
            | AddAssign(_)
            | SubAssign(_)
            | MulAssign(_)
            | DivAssign(_)
            | RemAssign(_)
    )
}

pub fn statement(statement: &syn::Stmt) -> Option<&Expr> {
    match statement {
        syn::Stmt::Expr(expr, _) => Some(expr),
        syn::Stmt::Local(local) => local.init.as_ref().map(|init| &*init.expr),
        _ => None,
    }
}

/// Whether the expression is a float literal, behind any signs and brackets.
pub fn is_float(expr: &Expr) -> bool {
    match expr {
        Expr::Lit(lit) => matches!(lit.lit, Lit::Float(_)),
        Expr::Unary(unary) => is_float(&unary.expr),
        Expr::Paren(paren) => is_float(&paren.expr),
        _ => false,
    }
}

pub fn is_function(expr: &Expr) -> bool {
    match expr {
        Expr::Closure(closure) => computes(&closure.body),
        Expr::Cast(cast) => is_function(&cast.expr),
        Expr::Path(_) => computes(expr),
        _ => false,
    }
}

/// Whether an expression contains what `found` looks for.
struct Search {
    found: fn(&Expr) -> bool,
    hit: bool,
}

impl<'ast> Visit<'ast> for Search {
    fn visit_expr(&mut self, expr: &'ast Expr) {
        self.hit |= (self.found)(expr);
        visit::visit_expr(self, expr);
    }
}

fn contains(expr: &Expr, found: fn(&Expr) -> bool) -> bool {
    let mut search = Search { found, hit: false };
    search.visit_expr(expr);
    search.hit
}

fn last_name(path: &syn::Path) -> String {
    path.segments
        .last()
        .map(|s| s.ident.to_string())
        .unwrap_or_default()
}

/// Whether an expression computes: an arithmetic operator, a negation, a function named like a mathematical one.
pub fn computes(expr: &Expr) -> bool {
    contains(expr, |expr| match expr {
        Expr::Binary(binary) => is_arithmetic(&binary.op),
        Expr::Unary(unary) => {
            matches!(unary.op, syn::UnOp::Neg(_)) && !matches!(*unary.expr, Expr::Lit(_))
        }
        Expr::MethodCall(call) => is_computing_function(&call.method.to_string()),
        Expr::Path(path) => is_computing_function(&last_name(&path.path)),
        _ => false,
    })
}

/// Whether an expression names an operation, as `Op::Add` or `"add"`.
pub fn names_operation(expr: &Expr) -> bool {
    contains(expr, |expr| match expr {
        Expr::Path(path) => path.path.segments.len() > 1 && is_operation(&last_name(&path.path)),
        Expr::Lit(lit) => matches!(&lit.lit, Lit::Str(text) if is_operation(&text.value())),
        Expr::Let(let_) => selects(&let_.pat),
        _ => false,
    })
}

/// Whether a pattern selects an operation.
pub fn selects(pat: &Pat) -> bool {
    struct Names(bool);
    impl<'ast> Visit<'ast> for Names {
        fn visit_ident(&mut self, ident: &'ast syn::Ident) {
            let name = ident.to_string();
            self.0 |= name.starts_with(|c: char| c.is_ascii_uppercase()) && is_operation(&name);
        }
        fn visit_lit(&mut self, lit: &'ast Lit) {
            self.0 |= matches!(lit, Lit::Str(text) if is_operation(&text.value()));
        }
    }
    let mut names = Names(false);
    names.visit_pat(pat);
    names.0
}
