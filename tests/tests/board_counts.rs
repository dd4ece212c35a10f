//! Machine instructions for each of the policy's, on the emulated Cortex-M4F with code compiled for short decisions.
//!
//! Counts, not times: the emulator's are the same in every run. They move with the compiler and with the runtime.

use std::fs;

use tpg_runtime::isa::Op;
use tpg_tests::firmware::{self, M4F};
use tpg_tests::shapes::{ARITHMETIC, VECTORS, straight};

/// What one more instruction takes: programs of these lengths are compared, so that what surrounds them cancels out.
const LENGTHS: [usize; 2] = [120, 240];
const WIDTH: u16 = 11;

#[test]
fn instructions_take_so_many_of_the_processor_at_most() {
    if !M4F.is_available() {
        return;
    }
    let ceilings: &[(&str, &[Op], f64)] = &[
        // Nine of these are checks that safe code cannot do without, of the operation's code and of three offsets; four fetch the
        // instruction, one jumps, four read operands, two add, four apply the number rule, two store, three count.
        ("scalar", ARITHMETIC, 29.5),
        ("vector sum", &[Op::VAdd], 170.0),
        ("vectors", VECTORS, 170.0),
        ("matrix x vector", &[Op::MatVec], 520.0),
    ];
    let mixes = ceilings.iter().map(|(_, mix, _)| *mix);
    let policies: Vec<_> = mixes
        .flat_map(|mix| LENGTHS.map(|length| straight(mix, WIDTH, length).encode()))
        .collect();
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("pack");
    fs::write(&file, firmware::pack(&policies, 0)).expect("written");
    let mut options = M4F.emulation().count.clone();
    options.extend(M4F.load(&file));
    let (status, printed) = M4F.run(&M4F.build_fast("count"), &options);
    assert_eq!(status, Some(0), "{printed}");
    let counts: Vec<[f64; 2]> = printed
        .lines()
        .map(|line| {
            let mut numbers = line.split(' ').map(|n| n.parse().expect("a number"));
            [(); 2].map(|()| numbers.next().expect("sums of both kinds"))
        })
        .collect();
    assert_eq!(counts.len(), policies.len(), "{printed}");
    for ((what, _, most), pair) in ceilings.iter().zip(counts.as_chunks::<2>().0) {
        let [[few, short], [many, long]] = pair;
        let seen = (long - short) / (many - few);
        println!("{what}: {seen:.1} machine instructions, at most {most}");
        assert!(seen <= *most, "{what}: {seen:.1}, not {most}");
    }
}
