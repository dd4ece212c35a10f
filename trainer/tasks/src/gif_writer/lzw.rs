//! The compression of a GIF (LZW), with losses: a pixel takes a colour near its own where a longer match comes of that.
//!
//! The edges of a moving ground are noise to a lossless encoder: without losses, files are half as large again.

/// Bits of a colour's number.
const COLOUR_BITS: u8 = 8;
/// The code that empties the table.
const CLEAR: u16 = 1 << COLOUR_BITS;
/// The code that ends the pixels.
const END: u16 = CLEAR + 1;
/// Codes that a table holds.
const CODES: usize = 1 << 12;
/// Bits of a code at most.
const CODE_BITS: u32 = 12;
/// No code.
const NONE: u16 = u16::MAX;

/// The strings of colours that have a code, as a tree: each is its parent's and one colour more.
struct Table {
    nodes: Vec<Node>,
}

#[derive(Clone, Copy)]
struct Node {
    colour: u8,
    first_child: u16,
    next_sibling: u16,
}

impl Table {
    fn new() -> Self {
        let node = |code: u16| Node {
            colour: code as u8,
            first_child: NONE,
            next_sibling: NONE,
        };
        Table {
            nodes: (0..=END).map(node).collect(),
        }
    }

    /// The strings with one colour more than this one.
    fn children(&self, code: u16) -> impl Iterator<Item = (u16, u8)> {
        let mut next = self.nodes[usize::from(code)].first_child;
        std::iter::from_fn(move || {
            let node = self.nodes.get(usize::from(next))?;
            let child = (next, node.colour);
            next = node.next_sibling;
            Some(child)
        })
    }

    fn add(&mut self, parent: u16, colour: u8) {
        let code = self.nodes.len() as u16;
        let parent = &mut self.nodes[usize::from(parent)];
        let next_sibling = std::mem::replace(&mut parent.first_child, code);
        self.nodes.push(Node {
            colour,
            first_child: NONE,
            next_sibling,
        });
    }
}

/// Codes of different widths in bytes, the lowest bits first.
struct Bits {
    bytes: Vec<u8>,
    pending: u32,
    count: u32,
}

impl Bits {
    fn write(&mut self, code: u16, width: u32) {
        self.pending |= u32::from(code) << self.count;
        self.count += width;
        while self.count >= 8 {
            self.bytes.push(self.pending as u8);
            self.pending >>= 8;
            self.count -= 8;
        }
    }
}

/// What was made of pixels.
pub(super) struct Packed {
    /// As a GIF has them, but for their division into blocks.
    pub(super) bytes: Vec<u8>,
    /// The colour that each pixel took.
    pub(super) colours: Vec<u8>,
}

/// Compresses pixels.
///
/// `loss` says what is lost if a pixel takes a colour, `None` if it may not; `best` is the colour by which least is lost.
pub(super) fn pack(
    pixels: usize,
    best: impl Fn(usize) -> u8,
    loss: impl Fn(usize, u8) -> Option<u32>,
) -> Packed {
    let mut bits = Bits {
        bytes: vec![COLOUR_BITS],
        pending: 0,
        count: 0,
    };
    let mut colours = Vec::with_capacity(pixels);
    let (mut table, mut width) = (Table::new(), u32::from(COLOUR_BITS) + 1);
    bits.write(CLEAR, width);
    while colours.len() < pixels {
        let first = best(colours.len());
        colours.push(first);
        let mut code = u16::from(first);
        while colours.len() < pixels {
            let pixel = colours.len();
            let children = table.children(code);
            let matches = children
                .filter_map(|(code, colour)| loss(pixel, colour).map(|lost| (lost, code, colour)));
            let Some((_, next, colour)) = matches.min() else {
                break;
            };
            colours.push(colour);
            code = next;
        }
        bits.write(code, width);
        // The reader's table is one string behind, so a width holds for one code more.
        if table.nodes.len() == 1 << width && width < CODE_BITS {
            width += 1;
        }
        if colours.len() == pixels {
            break;
        }
        if table.nodes.len() < CODES {
            table.add(code, best(colours.len()));
        } else {
            bits.write(CLEAR, width);
            (table, width) = (Table::new(), u32::from(COLOUR_BITS) + 1);
        }
    }
    bits.write(END, width);
    // What is left of the last byte.
    bits.write(0, 7);
    Packed {
        bytes: bits.bytes,
        colours,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use gif::{Decoder, Encoder, Frame};
    use std::borrow::Cow;

    /// What a reader makes of packed pixels.
    fn read(width: u16, packed: &Packed) -> Vec<u8> {
        let mut file = Vec::new();
        let height = (packed.colours.len() / usize::from(width)) as u16;
        let mut encoder = Encoder::new(&mut file, width, height, &[0; 768]).unwrap();
        let frame = Frame {
            width,
            height,
            buffer: Cow::Borrowed(&packed.bytes),
            ..Frame::default()
        };
        encoder.write_lzw_pre_encoded_frame(&frame).unwrap();
        drop(encoder);
        let mut decoder = Decoder::new(&file[..]).unwrap();
        let frame = decoder.read_next_frame().unwrap().unwrap();
        frame.buffer.to_vec()
    }

    /// Numbers without a pattern, below a bound.
    fn noise(count: usize, bound: u32) -> Vec<u8> {
        let mut state = 1u32;
        let next = std::iter::from_fn(|| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            Some(((state >> 16) % bound) as u8)
        });
        next.take(count).collect()
    }

    fn pack_within(pixels: &[u8], tolerance: u8) -> Packed {
        let loss = |pixel: usize, colour: u8| {
            let lost = pixels[pixel].abs_diff(colour);
            (lost <= tolerance).then_some(lost.into())
        };
        pack(pixels.len(), |pixel| pixels[pixel], loss)
    }

    #[test]
    fn without_losses_a_reader_finds_the_pixels() {
        // Tables that fill several times, widths that change, and ends at every place of a table.
        for bound in [1, 2, 7, 256] {
            for count in (1..1200).chain([40_000]) {
                let pixels = noise(count, bound);
                let packed = pack_within(&pixels, 0);
                assert_eq!(packed.colours, pixels);
                assert!(read(1, &packed) == pixels, "{count} pixels below {bound}");
            }
        }
    }

    #[test]
    fn losses_stay_within_the_tolerance_and_save_bytes() {
        let pixels = noise(40_000, 256);
        let exact = pack_within(&pixels, 0);
        let packed = pack_within(&pixels, 40);
        assert_eq!(read(200, &packed), packed.colours);
        let off = |(a, b): (&u8, &u8)| a.abs_diff(*b);
        let most = packed.colours.iter().zip(&pixels).map(off).max();
        assert!(most.is_some_and(|most| (20..=40).contains(&most)));
        assert!(packed.bytes.len() * 10 < exact.bytes.len() * 9);
    }
}
