//! Decodes the Thumb-2 instructions that take stack or leave a function. See the Armv7-M Architecture Reference Manual,
//! A7.7.

use super::code::Code;

const SP: u32 = 13;
const PC: u32 = 15;
/// The frame pointer. A function may restore the stack pointer from it at its end.
const FP: u32 = 7;

/// Decodes a function's code. `is_data` tells which addresses hold constants.
pub(super) fn decode(start: u64, bytes: &[u8], is_data: impl Fn(u64) -> bool) -> Code {
    let mut code = Code::default();
    let mut low_halves = [0; 16];
    let (halves, _) = bytes.as_chunks::<2>();
    let half = |k: usize| (halves.get(k)).map_or(0, |h| u32::from(u16::from_le_bytes(*h)));
    let mut k = 0;
    while k < halves.len() {
        let at = start + 2 * k as u64;
        let (first, second) = (half(k), half(k + 1));
        if is_data(at) {
            // A constant within the code may be an address.
            if at.is_multiple_of(4) {
                code.addresses.insert(u64::from(second << 16 | first));
            }
            k += 1;
            continue;
        }
        let taken = if first >> 11 >= 0b11101 {
            k += 2;
            wide(&mut code, &mut low_halves, at, first, second)
        } else {
            k += 1;
            let before = [half(k.wrapping_sub(2)), half(k.wrapping_sub(3))];
            let constant = |address: u64| {
                let place = (address.checked_sub(start)? / 2) as usize;
                (place + 1 < halves.len()).then(|| half(place + 1) << 16 | half(place))
            };
            match first & 0xff87 {
                0x4485 => added(before, at, first >> 3 & 15, constant),
                0x4685 if is_below_frame(before, first >> 3 & 15) => Some(0),
                _ => narrow(&mut code, at, first),
            }
        };
        match taken {
            Some(bytes) => code.frame += u64::from(bytes),
            None => code.dynamic = code.dynamic.or(Some(at)),
        }
    }
    // Armv6-M has no other branch that goes far within a function. A call of itself goes to its start.
    let within = start + 1..start + bytes.len() as u64;
    let inner: Vec<u64> = code.calls.range(within).copied().collect();
    for to in inner {
        code.calls.remove(&to);
        code.jumps.insert(to);
    }
    code
}

/// The bytes that `add sp` takes with a register into which the instruction before has loaded a constant: Armv6-M has no
/// other way to take more than 508 bytes at once. `None` if there is no such instruction.
fn added(
    [before, _]: [u32; 2],
    at: u64,
    register: u32,
    constant: impl Fn(u64) -> Option<u32>,
) -> Option<u32> {
    // ldr with an address relative to pc, which is that of the next but one and a multiple of 4.
    let loads = before >> 11 == 0b01001 && before >> 8 & 7 == register;
    let address = ((at + 2) & !3) + 4 * u64::from(before & 0xff);
    let taken = (constant(address).filter(|_| loads)? as i32).checked_neg()?;
    Some(taken.max(0) as u32)
}

/// Whether a register was made of the frame pointer by subtracting one or two constants, as Armv6-M does it before it
/// restores the stack pointer.
fn is_below_frame([before, earlier]: [u32; 2], register: u32) -> bool {
    let from_frame = |i: u32| i & 0xfe3f == 0x1e00 | FP << 3 | register;
    let again = before & 0xff00 == 0x3800 | register << 8;
    from_frame(before) || (again && from_frame(earlier))
}

/// The bytes that a 16-bit instruction takes from the stack. `None` if the amount is unknown.
fn narrow(code: &mut Code, at: u64, i: u32) -> Option<u32> {
    let register = i >> 3 & 15;
    match i {
        // push; sub sp.
        _ if i & 0xfe00 == 0xb400 => return Some(4 * (i & 0x1ff).count_ones()),
        _ if i & 0xff80 == 0xb080 => return Some(4 * (i & 0x7f)),
        // blx; bx, except to the return address; mov pc; add pc.
        _ if i & 0xff87 == 0x4780 => code.through_pointer = true,
        _ if i & 0xff87 == 0x4700 => code.through_pointer |= register != 14,
        _ if matches!(i & 0xff87, 0x4687 | 0x4487) => code.through_pointer = true,
        // mov sp, except from the frame pointer; add sp with a register.
        _ if i & 0xff87 == 0x4685 => return (register == FP).then_some(0),
        _ if i & 0xff87 == 0x4485 => return None,
        // b, with and without condition.
        _ if i & 0xf000 == 0xd000 && i >> 8 & 15 < 14 => jump(code, at, signed(i << 1, 9)),
        _ if i & 0xf800 == 0xe000 => jump(code, at, signed(i << 1, 12)),
        _ => {}
    }
    Some(0)
}

/// Like [`narrow`], for a 32-bit instruction.
fn wide(code: &mut Code, low: &mut [u32; 16], at: u64, i: u32, j: u32) -> Option<u32> {
    let (n, t, d) = (i & 15, j >> 12, j >> 8 & 15);
    let immediate = (i >> 10 & 1) << 11 | (j >> 12 & 7) << 8 | j & 0xff;
    match i {
        // stmdb sp!; vpush; strd and str with the stack pointer moved before.
        0xe92d => return Some(4 * j.count_ones()),
        _ if i & 0xffbf == 0xed2d => return Some(4 * (j & 0xff)),
        0xe96d => return Some(4 * (j & 0xff)),
        0xf84d if j & 0xf00 == 0xd00 => return Some(j & 0xff),
        // ldr pc and ldm with pc, except to return.
        _ if i & 0xff70 == 0xf850 && t == PC => {
            code.through_pointer |= !(n == SP && j & 0xf00 == 0xb00);
        }
        _ if i & 0xffd0 == 0xe890 && j >> 15 == 1 => code.through_pointer |= n != SP,
        // movw, movt: the halves of an address.
        _ if i & 0xfbf0 == 0xf240 => low[d as usize] = n << 12 | immediate,
        _ if i & 0xfbf0 == 0xf2c0 => {
            let high = n << 12 | immediate;
            code.addresses
                .insert(u64::from(high << 16 | low[d as usize]));
        }
        // bl, b; b with condition.
        _ if i & 0xf800 == 0xf000 && matches!(j & 0xd000, 0xd000 | 0x9000) => {
            let sign = i >> 10 & 1;
            let [j1, j2] = [13, 11].map(|bit| !(j >> bit ^ sign) & 1);
            let offset = sign << 24 | j1 << 23 | j2 << 22 | (i & 0x3ff) << 12 | (j & 0x7ff) << 1;
            let calls = j & 0x4000 != 0;
            let place = if calls {
                &mut code.calls
            } else {
                &mut code.jumps
            };
            place.insert((at + 4).wrapping_add_signed(signed(offset, 25)));
        }
        _ if i & 0xf800 == 0xf000 && j & 0xd000 == 0x8000 && i >> 6 & 15 < 14 => {
            let (j1, j2) = (j >> 13 & 1, j >> 11 & 1);
            let sign = i >> 10 & 1;
            let offset = sign << 20 | j2 << 19 | j1 << 18 | (i & 0x3f) << 12 | (j & 0x7ff) << 1;
            jump(code, at, signed(offset, 21));
        }
        // Arithmetic that writes the stack pointer. Allowed are: subtract a constant, add a constant, or subtract a
        // constant from the frame pointer.
        _ if i & 0xf800 == 0xf000 && j >> 15 == 0 && d == SP => {
            return match (i & 0xfbf0, n) {
                (0xf1a0, SP) => Some(expanded(immediate)),
                (0xf2a0, SP) => Some(immediate),
                (0xf100 | 0xf200, SP) | (0xf1a0 | 0xf2a0, FP) => Some(0),
                _ => None,
            };
        }
        _ if i & 0xfe00 == 0xea00 && d == SP => return None,
        _ => {}
    }
    Some(0)
}

fn jump(code: &mut Code, at: u64, offset: i64) {
    code.jumps.insert((at + 4).wrapping_add_signed(offset));
}

/// The lowest `bits` bits as a signed number.
const fn signed(value: u32, bits: u32) -> i64 {
    ((value << (32 - bits)) as i32 >> (32 - bits)) as i64
}

/// The value of a constant that an instruction encodes (A5.3.2).
const fn expanded(immediate: u32) -> u32 {
    let byte = immediate & 0xff;
    match immediate >> 8 {
        0 => byte,
        1 => byte << 16 | byte,
        2 => byte << 24 | byte << 8,
        3 => byte * 0x0101_0101,
        _ => (byte | 0x80).rotate_right(immediate >> 7),
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::*;

    fn code(halves: &[u16]) -> Code {
        let bytes: Vec<u8> = halves.iter().flat_map(|half| half.to_le_bytes()).collect();
        decode(0x8000, &bytes, |_| false)
    }

    /// The encodings come from GNU as.
    #[test]
    fn instructions_that_take_stack_or_leave_are_known() {
        let code = code(&[
            0xb5b0, // push {r4, r5, r7, lr}
            0xaf02, // add r7, sp, #8
            0xf84d, 0x8d04, // str r8, [sp, #-4]!
            0xe92d, 0x0f00, // stmdb sp!, {r8, r9, sl, fp}
            0xe96d, 0x0102, // strd r0, r1, [sp, #-8]!
            0xed2d, 0x8b10, // vpush {d8-d15}
            0xb091, // sub sp, #68
            0xf5ad, 0x6d95, // sub.w sp, sp, #1192
            0xf6ad, 0x3db8, // subw sp, sp, #3000
            0xf000, 0xf9ef, // bl to 0x400 from the start
            0xf7ff, 0xfded, // bl to -0x400
            0xf000, 0xbbeb, // b.w to 0x800
            0xf000, 0x87e9, // beq.w to 0x1000
            0xd007, // beq to 0x40
            0xe016, // b to 0x60
            0xf241, 0x2035, // movw r0, #0x1235
            0xf2c2, 0x0000, // movt r0, #0x2000
            0x4568, // cmp r0, sp
            0xb001, // add sp, #4
            0xecbd, 0x8b10, // vpop {d8-d15}
            0xf1a7, 0x0408, // sub.w r4, r7, #8
            0x46bd, // mov sp, r7
            0xf85d, 0x8b04, // ldr r8, [sp], #4
            0xbdb0, // pop {r4, r5, r7, pc}
        ]);
        assert_eq!(code.frame, 16 + 4 + 16 + 8 + 64 + 68 + 1192 + 3000);
        assert_eq!(code.calls, BTreeSet::from([0x7c00, 0x8400]));
        assert_eq!(code.jumps, BTreeSet::from([0x8040, 0x8060, 0x8800, 0x9000]));
        assert_eq!(code.addresses, BTreeSet::from([0x2000_1235]));
        assert!(!code.through_pointer);
        assert_eq!(code.dynamic, None);
    }

    /// As the compiler does it for a Cortex-M0, which has no wide instructions for it.
    #[test]
    fn large_frames_of_armv6_m_are_known() {
        let code = code(&[
            0xb5f0, // push {r4, r5, r6, r7, lr}
            0xaf03, // add r7, sp, #12
            0x4c02, // ldr r4, [pc, #8]
            0x44a5, // add sp, r4
            0x1ffc, // subs r4, r7, #7
            0x3c05, // subs r4, #5
            0x46a5, // mov sp, r4
            0xbdf0, // pop {r4, r5, r6, r7, pc}
            0xfce0, 0xffff, // -800
        ]);
        assert_eq!((code.frame, code.dynamic), (20 + 800, None));
    }

    /// As the compiler does it for a Cortex-M0, whose branches reach 2 KB.
    #[test]
    fn a_call_into_the_function_is_a_branch() {
        let far = code(&[
            0xb5f0, // push {r4, r5, r6, r7, lr}
            0xf000, 0xf801, // bl to the other bl
            0x46c0, // nop
            0xf7ff, 0xfffa, // bl to the start
            0xbdf0, // pop {r4, r5, r6, r7, pc}
        ]);
        assert_eq!(far.calls, BTreeSet::from([0x8000]));
        assert_eq!(far.jumps, BTreeSet::from([0x8008]));
    }

    #[test]
    fn pointers_and_unknown_amounts_are_noticed() {
        for halves in [
            &[0x4798][..],     // blx r3
            &[0x4718],         // bx r3
            &[0x469f],         // mov pc, r3
            &[0xf8d3, 0xf000], // ldr.w pc, [r3]
        ] {
            assert!(code(halves).through_pointer, "{halves:x?}");
        }
        for halves in [
            &[0x46a5][..],     // mov sp, r4
            &[0x44a5],         // add sp, r4
            &[0xebad, 0x0d04], // sub.w sp, sp, r4
            &[0xf1a4, 0x0d08], // sub.w sp, r4, #8
        ] {
            assert_eq!(code(halves).dynamic, Some(0x8000), "{halves:x?}");
        }
    }
}
