//! Decodes the 32-bit RISC-V instructions that take stack or leave a function, including compressed ones. See the ISA
//! manual, chapters on RV32I and C.

use super::code::Code;

const RA: u32 = 1;
const SP: u32 = 2;

/// Decodes a function's code. `switches` means that constant data holds addresses within the function. Its jumps
/// through a register then lead to these addresses.
pub(super) fn decode(start: u64, bytes: &[u8], switches: bool) -> Code {
    let mut code = Code::default();
    // The last upper part of an address formed in each register.
    let mut upper = [0u32; 32];
    let mut before = None;
    let (halves, _) = bytes.as_chunks::<2>();
    let half = |k: usize| (halves.get(k)).map_or(0, |h| u32::from(u16::from_le_bytes(*h)));
    let mut k = 0;
    while k < halves.len() {
        let at = start as u32 + 2 * k as u32;
        let (i, size) = match half(k) {
            low if low & 3 == 3 => (half(k + 1) << 16 | low, 2),
            low => (expanded(low), 1),
        };
        k += size;
        let [d, s] = [7, 15].map(|bit| i >> bit & 31);
        let immediate = i as i32 >> 20;
        let mut formed = None;
        match i & 0x7f {
            // lui and auipc.
            0x37 => upper[d as usize] = i & !0xfff,
            0x17 => {
                upper[d as usize] = at.wrapping_add(i & !0xfff);
                formed = Some(d);
            }
            // addi.
            0x13 if i >> 12 & 7 == 0 && d == SP && s == SP => {
                code.frame += u64::from(immediate.min(0).unsigned_abs());
            }
            0x13 if i >> 12 & 7 == 0 && d != SP => {
                let address = upper[s as usize].wrapping_add_signed(immediate);
                code.addresses.insert(u64::from(address));
            }
            // jal.
            0x6f => {
                let offset = (i as i32 >> 31) << 20
                    | (i & 0xff000 | (i >> 20 & 1) << 11 | (i >> 21 & 0x3ff) << 1) as i32;
                leave(&mut code, d, at.wrapping_add_signed(offset));
            }
            // jalr: to an address formed just before, to the return address, in a switch, or through a pointer.
            0x67 if before == Some(s) => {
                let target = upper[s as usize].wrapping_add_signed(immediate);
                leave(&mut code, d, target);
            }
            0x67 if d == 0 && (s == RA || switches) => {}
            0x67 => code.through_pointer = true,
            // Other instructions with a result (loads, arithmetic, counters) must not write the stack pointer.
            0x03 | 0x13 | 0x33 | 0x73 if d == SP => {
                // A function may restore the stack pointer from its frame pointer at its end.
                let restores = i & 0x7f == 0x13 && s == 8;
                code.dynamic = code.dynamic.or((!restores).then_some(u64::from(at)));
            }
            _ => {}
        }
        before = formed;
    }
    code
}

/// Records a call if the instruction keeps a return address, else a jump.
fn leave(code: &mut Code, link: u32, target: u32) {
    let place = if link == 0 {
        &mut code.jumps
    } else {
        &mut code.calls
    };
    place.insert(u64::from(target));
}

/// The full instruction for a compressed one that takes stack or leaves a function. 0 for any other instruction.
const fn expanded(c: u32) -> u32 {
    let d = c >> 7 & 31;
    // Most immediates use bits 12 and 6:2.
    let six = ((c >> 12 & 1) << 5 | c >> 2 & 31) << 26;
    let six = six as i32 >> 26;
    match (c & 3, c >> 13) {
        // c.addi, c.addi16sp, c.lui.
        (1, 0) => addi(d, d, six),
        (1, 3) if d == SP => {
            let parts =
                (c >> 6 & 1) << 4 | (c >> 2 & 1) << 5 | (c >> 5 & 1) << 6 | (c >> 3 & 3) << 7;
            addi(SP, SP, parts as i32 | (six >> 5) << 9)
        }
        (1, 3) => (six << 12) as u32 | d << 7 | 0x37,
        // c.jal, c.j.
        (1, link @ (1 | 5)) => {
            let parts = (c >> 3 & 7) << 1
                | (c >> 11 & 1) << 4
                | (c >> 2 & 1) << 5
                | (c >> 7 & 1) << 6
                | (c >> 6 & 1) << 7
                | (c >> 9 & 3) << 8
                | (c >> 8 & 1) << 10;
            let offset = parts | ((six >> 5) as u32) << 11;
            let scattered = (offset >> 20 & 1) << 31
                | (offset >> 1 & 0x3ff) << 21
                | (offset >> 11 & 1) << 20
                | (offset >> 12 & 0xff) << 12;
            scattered | returning(link == 1) | 0x6f
        }
        // c.jr, c.jalr; c.mv and c.add to the stack pointer.
        (2, 4) if c >> 2 & 31 == 0 && d != 0 => d << 15 | returning(c >> 12 & 1 == 1) | 0x67,
        (2, 4) if d == SP => SP << 7 | 0x33,
        _ => 0,
    }
}

/// The register field for the return address: `ra` for a call, 0 for a jump.
const fn returning(calls: bool) -> u32 {
    if calls { RA << 7 } else { 0 }
}

const fn addi(d: u32, s: u32, immediate: i32) -> u32 {
    (immediate as u32) << 20 | s << 15 | d << 7 | 0x13
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    /// The encodings come from LLVM's assembler.
    #[test]
    fn instructions_that_take_stack_or_leave_are_known() {
        let bytes = [
            0x41, 0x11, // c.addi sp, -16
            0x25, 0x71, // c.addi16sp sp, -416
            0x13, 0x01, 0x01, 0x81, // addi sp, sp, -2032
            0x00, 0x10, // c.addi4spn s0, sp, 32
            0x0d, 0x2c, // c.jal to 0x23c from the start
            0xef, 0x20, 0x20, 0x23, // jal to 0x223e
            0x35, 0xa4, // c.j to 0x23c
            0x6f, 0x20, 0xc0, 0x22, // j to 0x223e
            0x97, 0x20, 0x00, 0x00, // auipc ra, 2
            0xe7, 0x80, 0xc0, 0xf9, // jalr -100(ra)
            0x17, 0x33, 0x00, 0x00, // auipc t1, 3
            0x67, 0x00, 0x83, 0x02, // jr 40(t1)
            0x37, 0x05, 0x00, 0x20, // lui a0, 0x20000
            0x13, 0x05, 0x45, 0x02, // addi a0, a0, 36
            0x8d, 0x65, // c.lui a1, 3
            0xf1, 0x15, // c.addi a1, -4
            0x13, 0x01, 0x04, 0xfe, // addi sp, s0, -32
            0xb2, 0x40, // c.lwsp ra, 12(sp)
            0x41, 0x01, // c.addi sp, 16
            0x82, 0x80, // ret
        ];
        let code = decode(0x8000_0000, &bytes, false);
        assert_eq!(code.frame, 16 + 416 + 2032);
        let calls = [0x8000_023c, 0x8000_1fb2, 0x8000_223e];
        assert_eq!(code.calls, BTreeSet::from(calls));
        let jumps = [0x8000_023c, 0x8000_223e, 0x8000_3046];
        assert_eq!(code.jumps, BTreeSet::from(jumps));
        assert!(
            code.addresses
                .is_superset(&BTreeSet::from([0x2000_0024, 0x2ffc]))
        );
        assert!(!code.through_pointer);
        assert_eq!(code.dynamic, None);
    }

    #[test]
    fn pointers_and_unknown_amounts_are_noticed() {
        assert!(decode(0, &[0x02, 0x99], true).through_pointer, "jalr s2");
        assert!(decode(0, &[0x82, 0x87], false).through_pointer, "jr a5");
        assert!(!decode(0, &[0x82, 0x87], true).through_pointer, "a switch");
        let sub_sp_sp_t0 = [0x33, 0x01, 0x51, 0x40];
        assert_eq!(decode(0, &sub_sp_sp_t0, false).dynamic, Some(0));
    }
}
