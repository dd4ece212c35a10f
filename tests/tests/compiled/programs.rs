//! Programs made of compiled policies: built once, run on a script.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use tpg_tests::process::pipe;
use tpg_tools::export::CSource;

/// A policy as source code, with the sizes that the program around it needs.
pub struct Compiled {
    pub name: String,
    pub inputs: usize,
    /// Zero where actions are discrete.
    pub outputs: usize,
    /// Words of shared memory.
    pub memory: usize,
    pub rust: String,
    pub c: CSource,
}

fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Reads the script for one policy after the other; what differs between policies comes in macros.
const RUST_MAIN: &str = r#"
use std::io::{BufRead as _, BufWriter, Lines, StdinLock, Write};
use tpg_runtime::Reset;

trait Bits {
    fn bits(&self) -> Vec<u32>;
}
impl Bits for u16 {
    fn bits(&self) -> Vec<u32> {
        vec![u32::from(*self)]
    }
}
impl<const N: usize> Bits for [f32; N] {
    fn bits(&self) -> Vec<u32> {
        self.iter().map(|x| x.to_bits()).collect()
    }
}

fn print(out: &mut impl Write, start: &str, words: &[u32]) {
    write!(out, "{start}").unwrap();
    words.iter().for_each(|word| write!(out, " {word:08x}").unwrap());
}

fn floats<const N: usize>(line: &str) -> [f32; N] {
    let words = line.split_whitespace().skip(1).map(|w| f32::from_bits(u32::from_str_radix(w, 16).unwrap()));
    words.collect::<Vec<_>>().try_into().unwrap()
}

/// Follows the script up to the next policy; returns that policy's number.
macro_rules! run {
    ($name:ident, $lines:ident, $out:ident, $memory:tt) => {{
        let mut policy = $name::Policy::new();
        loop {
            let Some(line) = $lines.next() else { break None };
            let line: String = line.unwrap();
            let seed = || u64::from_str_radix(&line[2..], 16).unwrap();
            match line.as_bytes()[0] {
                b'P' => break Some(line[2..].parse::<usize>().unwrap()),
                b'A' => policy.reset(Reset::Agent, seed()),
                b'E' => policy.reset(Reset::Episode, seed()),
                b'D' => {
                    let decision = policy.decide(&floats(&line));
                    print(&mut $out, "D", &decision.action.bits());
                    let (winner, instructions, teams) = (decision.winner, decision.instructions, decision.teams);
                    writeln!($out, " | {winner} {instructions} {teams}").unwrap();
                }
                b'S' => run!(@set $memory policy line),
                _ => run!(@print $memory policy $out),
            }
        }
    }};
    (@set true $policy:ident $line:ident) => { $policy.set_memory(&floats(&$line)) };
    (@set false $policy:ident $line:ident) => { () };
    (@print true $policy:ident $out:ident) => {{
        print(&mut $out, "M", &$policy.memory().bits());
        writeln!($out).unwrap();
    }};
    (@print false $policy:ident $out:ident) => { writeln!($out, "M").unwrap() };
}
"#;

/// Builds a program of all policies as Rust, without debug checks as firmware would be, and returns what it prints.
pub fn run_rust(folder: &Path, policies: &[Compiled], script: &str) -> String {
    let package = folder.join("rust");
    fs::create_dir_all(package.join("src")).expect("a folder");
    let runtime = repository().join("runtime");
    let manifest = format!(
        "[package]\nname = \"compiled\"\nversion = \"0.0.0\"\nedition = \"2024\"\n[workspace]\n\
         [dependencies]\ntpg-runtime = {{ path = {runtime:?} }}\n\
         [profile.release]\nopt-level = 2\ncodegen-units = 16\n"
    );
    fs::write(package.join("Cargo.toml"), manifest).expect("a manifest");
    // The versions that the workspace was tested with, and no look at the network.
    fs::copy(repository().join("Cargo.lock"), package.join("Cargo.lock")).expect("a lock file");
    let (mut modules, mut arms) = (String::new(), String::new());
    for (number, policy) in policies.iter().enumerate() {
        let name = &policy.name;
        write_if_new(&package.join(format!("src/{name}.rs")), &policy.rust);
        let _ = writeln!(modules, "mod {name};");
        let _ = writeln!(
            arms,
            "            {number} => run!({name}, lines, out, {}),",
            policy.memory > 0
        );
    }
    let main = format!(
        "{modules}{RUST_MAIN}\nfn main() {{\n    let mut lines: Lines<StdinLock> = std::io::stdin().lock().lines();\n    \
         let mut out = BufWriter::new(std::io::stdout().lock());\n    let mut next = lines.next().map(|_| 0);\n    \
         while let Some(number) = next {{\n        writeln!(out, \"P {{number}}\").unwrap();\n        \
         next = match number {{\n{arms}            _ => unreachable!(),\n        }};\n    }}\n}}\n"
    );
    write_if_new(&package.join("src/main.rs"), &main);
    let mut build = Command::new(env!("CARGO"));
    build
        .args(["build", "--quiet", "--release", "--offline"])
        .current_dir(&package);
    build.env("CARGO_TARGET_DIR", folder.join("target"));
    assert!(
        build.status().expect("cargo runs").success(),
        "the compiled policies do not build"
    );
    pipe(Command::new(folder.join("target/release/compiled")), script)
}

fn write_if_new(path: &Path, text: &str) {
    if fs::read_to_string(path).is_ok_and(|old| old == text) {
        return;
    }
    fs::write(path, text).expect("a file");
}

/// What users may hold foreign code to.
const WARNINGS: [&str; 6] = [
    "-Wall",
    "-Wextra",
    "-Werror",
    "-Wpedantic",
    "-Wconversion",
    "-Wshadow",
];

const C_MAIN: &str = r#"
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static char line[1 << 20];

static int next_line(void) { return fgets(line, sizeof line, stdin) != NULL; }

static void floats(float *x, int n)
{
    char *at = line + 1;
    for (int k = 0; k < n; k++) {
        const uint32_t bits = (uint32_t)strtoul(at, &at, 16);
        memcpy(&x[k], &bits, sizeof bits);
    }
}

static void print(const float *x, int n)
{
    for (int k = 0; k < n; k++) {
        uint32_t bits;
        memcpy(&bits, &x[k], sizeof bits);
        printf(" %08x", (unsigned)bits);
    }
}
"#;

/// A compiler with options, the first of which is the language.
pub type Toolchain<'a> = (&'a str, &'a [&'a str]);

/// Compiles all policies as C without a warning and without a library, and returns what they print.
pub fn run_c(
    folder: &Path,
    policies: &[Compiled],
    script: &str,
    (compiler, options): Toolchain<'_>,
) -> String {
    let sources = folder.join("c");
    fs::create_dir_all(&sources).expect("a folder");
    let (mut main, mut cases) = (String::new(), String::new());
    let mut files = vec![sources.join("main.c")];
    for (number, policy) in policies.iter().enumerate() {
        let name = &policy.name;
        fs::write(sources.join(format!("{name}.h")), &policy.c.header).expect("a header");
        fs::write(sources.join(format!("{name}.c")), &policy.c.source).expect("a source");
        files.push(sources.join(format!("{name}.c")));
        let _ = writeln!(main, "#include \"{name}.h\"");
        let _ = writeln!(cases, "    case {number}: run_{name}(); break;");
    }
    main.push_str(C_MAIN);
    policies.iter().for_each(|policy| c_run(&mut main, policy));
    let _ = writeln!(
        main,
        "int main(void)\n{{\n    if (!next_line()) return 1;\n    while (line[0] == 'P') {{\n    \
         const int number = atoi(line + 2);\n    printf(\"P %d\\n\", number);\n    line[0] = 0;\n    \
         switch (number) {{\n{cases}    }}\n    }}\n    return 0;\n}}"
    );
    fs::write(sources.join("main.c"), main).expect("a source");
    let program = sources.join("program");
    let mut cc = Command::new(compiler);
    cc.args(options).args(WARNINGS).args(&files);
    cc.arg("-o").arg(&program);
    assert!(
        cc.status().expect("a C compiler").success(),
        "the compiled policies do not build with {compiler} {options:?}"
    );
    pipe(Command::new(&program), script)
}

fn c_run(main: &mut String, policy: &Compiled) {
    let (name, upper) = (&policy.name, policy.name.to_uppercase());
    let (inputs, outputs, memory) = (policy.inputs, policy.outputs, policy.memory);
    let decide = match outputs {
        0 => format!("printf(\"D %08x\", (unsigned){name}_decide(&policy, x));"),
        n => format!(
            "float action[{n}]; {name}_decide(&policy, x, action); printf(\"D\"); print(action, {n});"
        ),
    };
    let (set, get) = match memory {
        0 => (String::new(), String::new()),
        n => (
            format!("float memory[{n}]; floats(memory, {n}); {name}_set_memory(&policy, memory);"),
            format!("float memory[{n}]; {name}_memory(&policy, memory); print(memory, {n});"),
        ),
    };
    let _ = writeln!(
        main,
        "static void run_{name}(void)\n{{\n    static {name} policy;\n    {name}_init(&policy);\n    \
         while (next_line()) {{\n        switch (line[0]) {{\n        case 'P': return;\n        \
         case 'A': {name}_reset(&policy, {upper}_AGENT, strtoull(line + 2, NULL, 16)); break;\n        \
         case 'E': {name}_reset(&policy, {upper}_EPISODE, strtoull(line + 2, NULL, 16)); break;\n        \
         case 'D': {{\n            float x[{inputs}]; floats(x, {inputs});\n            {decide}\n            \
         printf(\" | %u %u %u\\n\", policy.winner, (unsigned)policy.instructions, policy.teams);\n            break;\n        }}\n        \
         case 'S': {{ {set} break; }}\n        case 'M': {{ printf(\"M\"); {get} printf(\"\\n\"); break; }}\n        }}\n    }}\n    \
         line[0] = 0;\n}}\n"
    );
}
