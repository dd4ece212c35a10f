//! Pictures as an animated GIF of few bytes: one palette for all, of each picture what differs from the one before, and
//! compression with losses.
//!
//! | file | what it holds |
//! |---|---|
//! | `palette` | 255 colours for the whole animation |
//! | `lzw` | the compression |

mod lzw;
mod palette;

use std::borrow::Cow;
use std::io::{self, Write};

use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};

use lzw::{Packed, pack};
pub(crate) use palette::Histogram;
use palette::{COLOURS, Palette};

/// The number of the colour that leaves a pixel as it was.
const AS_BEFORE: u8 = COLOURS as u8;
/// How far a pixel's colour may be from its own where that saves bytes: a squared distance of channels from 0 to 255.
const TOLERANCE: u32 = 8 * 8;
/// The same beside an edge, where the eye sees less.
const TOLERANCE_AT_EDGES: u32 = 28 * 28;
/// How far neighbours differ at an edge.
const EDGE: u32 = 12 * 12;

/// An animated GIF that is being written.
pub(crate) struct Writer<W: Write> {
    encoder: Encoder<W>,
    palette: Palette,
    width: u16,
    height: u16,
    /// The colours that a viewer shows; none before the first picture.
    shown: Vec<u8>,
}

/// A part of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Rectangle {
    left: u16,
    top: u16,
    width: u16,
    height: u16,
}

impl<W: Write> Writer<W> {
    /// Begins an animation that repeats without end.
    pub(crate) fn new(to: W, [width, height]: [u16; 2], palette: Palette) -> io::Result<Self> {
        // All 256 entries, so that colours have eight bits whatever their number is.
        let mut colours = palette.bytes().to_vec();
        colours.resize(3 * (COLOURS + 1), 0);
        let mut encoder = Encoder::new(to, width, height, &colours).map_err(as_io)?;
        encoder.set_repeat(Repeat::Infinite).map_err(as_io)?;
        Ok(Writer {
            encoder,
            palette,
            width,
            height,
            shown: Vec::new(),
        })
    }

    /// Appends a picture, red, green, blue, and so on, that is shown for this many hundredths of a second.
    pub(crate) fn picture(&mut self, picture: &[u8], hundredths: u16) -> io::Result<()> {
        let pixels = picture.as_chunks::<3>().0;
        let nearest: Vec<u8> = pixels.iter().map(|p| self.palette.index(*p)).collect();
        let tolerances = tolerances(pixels, self.width.into());
        let is_first = self.shown.is_empty();
        let Writer { palette, shown, .. } = self;
        // What is lost where a pixel stays as it was.
        let stays = |at: usize| match shown.get(at) {
            Some(colour) if *colour == nearest[at] => 0,
            Some(colour) => palette.distance(*colour, pixels[at]),
            None => u32::MAX,
        };
        let part = match is_first {
            true => Rectangle {
                left: 0,
                top: 0,
                width: self.width,
                height: self.height,
            },
            false => changed(self.width, nearest.len(), |at| stays(at) > tolerances[at]),
        };
        let place = |pixel: usize| part.place(pixel, self.width);
        let best = |pixel: usize| match place(pixel) {
            at if stays(at) <= tolerances[at] => AS_BEFORE,
            at => nearest[at],
        };
        let loss = |pixel: usize, colour: u8| {
            let at = place(pixel);
            let lost = match colour {
                AS_BEFORE => stays(at),
                colour if colour == nearest[at] => 0,
                colour => palette.distance(colour, pixels[at]),
            };
            (lost <= tolerances[at]).then_some(lost)
        };
        let pixels = usize::from(part.width) * usize::from(part.height);
        let Packed { bytes, colours } = pack(pixels, best, loss);
        shown.resize(nearest.len(), 0);
        for (pixel, colour) in colours.into_iter().enumerate() {
            if colour != AS_BEFORE {
                shown[part.place(pixel, self.width)] = colour;
            }
        }
        let frame = Frame {
            left: part.left,
            top: part.top,
            width: part.width,
            height: part.height,
            delay: hundredths,
            dispose: DisposalMethod::Keep,
            transparent: (!is_first).then_some(AS_BEFORE),
            buffer: Cow::Owned(bytes),
            ..Frame::default()
        };
        (self.encoder.write_lzw_pre_encoded_frame(&frame)).map_err(as_io)
    }

    /// Ends the file.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.encoder.into_inner().map_err(as_io)?.flush()
    }
}

impl Rectangle {
    /// Where in a picture of this width one of its pixels is.
    fn place(self, pixel: usize, width: u16) -> usize {
        let [row, column] = [
            pixel / usize::from(self.width),
            pixel % usize::from(self.width),
        ];
        (usize::from(self.top) + row) * usize::from(width) + usize::from(self.left) + column
    }
}

/// How far each pixel's colour may be from its own.
fn tolerances(pixels: &[[u8; 3]], width: usize) -> Vec<u32> {
    let mut tolerances = vec![TOLERANCE; pixels.len()];
    for (row, tolerances) in pixels.chunks(width).zip(tolerances.chunks_mut(width)) {
        for (left, pair) in row.windows(2).enumerate() {
            if palette::distance(pair[0], pair[1]) > EDGE {
                tolerances[left..left + 2].fill(TOLERANCE_AT_EDGES);
            }
        }
    }
    tolerances
}

/// The least part of a picture with everything that differs; one pixel where nothing does.
fn changed(width: u16, pixels: usize, differs: impl Fn(usize) -> bool) -> Rectangle {
    let [mut left, mut top, mut right, mut bottom] = [usize::MAX, usize::MAX, 0, 0];
    for at in (0..pixels).filter(|at| differs(*at)) {
        let [row, column] = [at / usize::from(width), at % usize::from(width)];
        (left, right) = (left.min(column), right.max(column));
        (top, bottom) = (top.min(row), bottom.max(row));
    }
    (left, top) = (left.min(right), top.min(bottom));
    Rectangle {
        left: left as u16,
        top: top as u16,
        width: (right - left + 1) as u16,
        height: (bottom - top + 1) as u16,
    }
}

/// The writer's error, or that the format cannot hold what was given.
fn as_io(error: EncodingError) -> io::Error {
    match error {
        EncodingError::Io(error) => error,
        error => io::Error::other(error),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A picture as a viewer shows it, its time, and the pixels that are stored of it.
    type Found = (Vec<[u8; 3]>, u16, usize);

    /// Pictures written and read again.
    fn there_and_back(size: [u16; 2], pictures: &[Vec<[u8; 3]>]) -> Vec<Found> {
        let mut histogram = Histogram::new();
        for picture in pictures {
            histogram.count(picture.as_flattened());
        }
        let mut file = Vec::new();
        let mut writer = Writer::new(&mut file, size, histogram.palette()).unwrap();
        for (picture, time) in pictures.iter().zip(4..) {
            writer.picture(picture.as_flattened(), time).unwrap();
        }
        writer.finish().unwrap();
        let mut reader = gif::Decoder::new(&file[..]).unwrap();
        let palette = reader.global_palette().unwrap().to_vec();
        let mut screen = vec![[0; 3]; usize::from(size[0]) * usize::from(size[1])];
        let mut found = Vec::new();
        while let Some(frame) = reader.read_next_frame().unwrap() {
            let part = Rectangle {
                left: frame.left,
                top: frame.top,
                width: frame.width,
                height: frame.height,
            };
            for (pixel, colour) in frame.buffer.iter().enumerate() {
                if Some(*colour) != frame.transparent {
                    let colour = palette.as_chunks::<3>().0[usize::from(*colour)];
                    screen[part.place(pixel, size[0])] = colour;
                }
            }
            found.push((screen.clone(), frame.delay, frame.buffer.len()));
        }
        found
    }

    #[test]
    fn pictures_come_back_as_they_were_and_only_changes_are_stored() {
        let (black, red, blue) = ([0, 0, 0], [250, 0, 0], [0, 0, 250]);
        let first = vec![black; 6 * 4];
        let mut second = first.clone();
        (second[6 + 2], second[2 * 6 + 4]) = (red, blue);
        let mut third = second.clone();
        third[2 * 6 + 4] = black;
        let pictures = [first, second.clone(), second, third];
        let found = there_and_back([6, 4], &pictures);
        for ((found, expected), time) in found.iter().zip(&pictures).zip(4..) {
            assert_eq!((&found.0, found.1), (expected, time));
        }
        let stored: Vec<usize> = found.iter().map(|found| found.2).collect();
        assert_eq!(stored, [24, 6, 1, 1]);
    }

    /// However slowly a colour drifts, what is shown is never further from it than a colour may be from its own.
    #[test]
    fn errors_do_not_add_up() {
        let pictures: Vec<_> = (0..100u8).map(|k| vec![[k, 2 * k, 90]; 12]).collect();
        for ((found, ..), picture) in there_and_back([4, 3], &pictures).iter().zip(&pictures) {
            for (found, expected) in found.as_flattened().iter().zip(picture.as_flattened()) {
                assert!(found.abs_diff(*expected) <= 8, "{found} {expected}");
            }
        }
    }
}
