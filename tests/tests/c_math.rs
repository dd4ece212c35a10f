//! The functions of exported C have the bits of the runtime's: by samples, and by the command below for all arguments.

use std::io::{BufWriter, Read as _, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread;

use tpg_runtime::math;
use tpg_runtime::rng::mix64;

/// The parts of the library of exported C, in the order in which a module has them.
const LIBRARY: [&str; 4] = [
    include_str!("../../runtime/tools/src/export/c/assets/arithmetic.c"),
    include_str!("../../runtime/tools/src/export/c/assets/root.c"),
    include_str!("../../runtime/tools/src/export/c/assets/trigonometry.c"),
    include_str!("../../runtime/tools/src/export/c/assets/transcendental.c"),
];

type Unary = fn(f32) -> f32;

const FUNCTIONS: [(&str, Unary); 12] = [
    ("exp", math::exp),
    ("log", math::log),
    ("atan", math::atan),
    ("asin", math::asin),
    ("acos", math::acos),
    ("tanh", math::tanh),
    ("sin", math::sin),
    ("cos", math::cos),
    ("tan", math::tan),
    ("sqrt", math::sqrt),
    ("classic-exp", math::classic::exp),
    ("classic-log", |x| math::classic::log(0.5, x)),
];

/// Compiles the library with a program that applies one of its functions to what it reads.
fn compile(compiler: &str, options: &[&str]) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("c_math");
    std::fs::create_dir_all(&folder).expect("a folder");
    let name = [&[compiler], options].concat().concat();
    let source = folder.join(format!("{name}.c"));
    let start = "#include <float.h>\n#include <stdbool.h>\n#include <stdint.h>\n\n";
    let main = include_str!("c_math/main.c");
    let text = [&[start], &LIBRARY[..], &[main]].concat().join("\n");
    std::fs::write(&source, text).expect("a source");
    let program = folder.join(name);
    let mut cc = Command::new(compiler);
    cc.args(["-std=c99", "-ffp-contract=off", "-Werror"])
        .args(options);
    cc.arg(&source).arg("-o").arg(&program);
    assert!(cc.status().expect("a C compiler").success());
    program
}

/// Applies a function of the library to `count` arguments, in words, and compares each result with the runtime's.
///
/// # Panics
/// If one has other bits.
fn compare<const N: usize>(
    program: &Path,
    name: &str,
    count: u64,
    argument: impl Fn(u64) -> [u32; N] + Copy + Send,
    expected: impl Fn([f32; N]) -> f32,
) {
    let mut child = Command::new(program)
        .arg(name)
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .expect("the program starts");
    let input = child.stdin.take().expect("piped");
    let mut output = child.stdout.take().expect("piped");
    let difference = thread::scope(|scope| {
        scope.spawn(move || {
            let mut input = BufWriter::with_capacity(1 << 16, input);
            let words = (0..count).flat_map(argument);
            // A program that was ended reads no more.
            words
                .map(u32::to_le_bytes)
                .all(|word| input.write_all(&word).is_ok())
        });
        let mut block = vec![0; 1 << 16];
        let mut done = 0;
        while done < count {
            let words = (count - done).min(1 << 14);
            let bytes = &mut block[..4 * words as usize];
            output.read_exact(bytes).expect("it writes");
            for (k, found) in (done..).zip(bytes.as_chunks().0) {
                let words = argument(k);
                let found = u32::from_le_bytes(*found);
                let expected = expected(words.map(f32::from_bits)).to_bits();
                if found != expected {
                    child.kill().expect("it ends");
                    return Some((words, found, expected));
                }
            }
            done += words;
        }
        None
    });
    if let Some((words, found, expected)) = difference {
        panic!("{name} of {words:08x?} is {found:08x} in C, {expected:08x} in the runtime");
    }
    assert!(child.wait().expect("it ends").success());
}

/// A number that registers can hold, which are finite.
fn finite(bits: u32) -> [u32; 1] {
    [math::finite(f32::from_bits(bits)).to_bits()]
}

/// Arguments of powers: bits at random, ordinary numbers, bases near one with large exponents, whole exponents.
fn powers(k: u64) -> [u32; 2] {
    let bits = mix64(&[k]);
    let (x, y) = ((bits >> 32) as u32, bits as u32);
    // A number between 2^(-low) and 2^high, with the sign of the bits.
    let between = |bits: u32, low: u32, high: u32| {
        bits & 0x807f_ffff | ((127 - low) + (bits >> 23 & 0xff) % (low + high)) << 23
    };
    let special = |bits: u32| {
        let numbers = [
            0.0,
            0.5,
            1.0,
            2.0,
            3.0,
            f32::INFINITY,
            f32::NAN,
            f32::MAX,
            f32::MIN_POSITIVE,
        ];
        let number: f32 = numbers[bits as usize % numbers.len()];
        number.to_bits() | bits & 0x8000_0000
    };
    match k % 8 {
        0 => [x, y],
        1 => [x, special(y)],
        2 => [special(x), y],
        3 => [special(x), special(y)],
        4 => [
            (x & 0x8000_0000 | 0x3f80_0000)
                .wrapping_add(x & 0x1f)
                .wrapping_sub(16),
            between(y, 0, 127),
        ],
        5 => [x, (f32::from((y >> 20) as u16) - 2048.0).to_bits()],
        6 => [between(x, 126, 127), between(y, 20, 9)],
        _ => [between(x, 4, 4), between(y, 4, 8)],
    }
}

fn compare_powers(program: &Path, count: u64) {
    compare(program, "pow", count, powers, |[x, y]| math::pow(x, y));
}

#[test]
fn functions_of_exported_c_have_the_runtimes_bits() {
    // A prime, so that samples fall anywhere within binades.
    const STEP: u64 = 8191;
    for options in [&["-O2"][..], &["-O0", "-DTPG_NO_ASSEMBLY"]] {
        let program = compile("cc", options);
        for (name, expected) in FUNCTIONS {
            let argument = |k: u64| finite((k * STEP) as u32);
            compare(&program, name, (1 << 32) / STEP, argument, |[x]| {
                expected(x)
            });
        }
        compare_powers(&program, 1 << 20);
    }
}

/// All finite arguments: `cargo test --release -p tpg-tests --test c_math -- --ignored --nocapture`.
#[test]
#[ignore = "takes minutes a function"]
fn all_arguments_give_the_runtimes_bits() {
    let program = compile("cc", &["-O3"]);
    for (name, expected) in FUNCTIONS {
        compare(
            &program,
            name,
            1 << 32,
            |k| finite(k as u32),
            |[x]| expected(x),
        );
        println!("{name}: all finite arguments agree");
    }
    compare_powers(&program, 1 << 30);
    println!("pow: 1073741824 pairs agree");
}
