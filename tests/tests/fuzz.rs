//! The fuzz targets without a fuzzer: over their seeds, over inputs that once broke a promise, and over small changes of both.

#[path = "../fuzz/src/lib.rs"]
#[allow(
    dead_code,
    unused_imports,
    reason = "the fuzzer's programs use the rest"
)]
mod targets;

use targets::{TARGETS, regressions, seeds};
use tpg_tasks::task::Rng;

/// Changed inputs of each target.
const CHANGED: u64 = 400;

/// One to four changes: a byte, a copied part, a cut.
fn change(input: &[u8], rng: &mut Rng) -> Vec<u8> {
    let mut input = input.to_vec();
    for _ in 0..=rng.below(3) {
        if input.is_empty() {
            break;
        }
        let place = |rng: &mut Rng, input: &[u8]| rng.below(input.len() as u64) as usize;
        let at = place(rng, &input);
        match rng.below(8) {
            0 => input.truncate(at),
            1 => {
                let end = (at + 8).min(input.len());
                let part = input[at..end].to_vec();
                let to = place(rng, &input);
                input.splice(to..to, part);
            }
            2 => input[at] = [0, 1, 0x7f, 0x80, 0xff][rng.below(5) as usize],
            3 => input[at] = input[at].wrapping_add(1),
            _ => input[at] ^= 1 << rng.below(8),
        }
    }
    input
}

#[test]
fn targets_keep_their_promises() {
    for (name, target) in TARGETS {
        let inputs: Vec<Vec<u8>> = seeds(name).into_iter().chain(regressions(name)).collect();
        assert!(!inputs.is_empty(), "{name} has no seeds");
        for input in &inputs {
            target(input);
        }
        let mut rng = Rng::new(11);
        for _ in 0..CHANGED {
            let input = &inputs[rng.below(inputs.len() as u64) as usize];
            target(&change(input, &mut rng));
        }
        println!("{name}: {} inputs, {CHANGED} changed ones", inputs.len());
    }
}
