//! Pictures as an animated GIF: one palette for all of them, and of each picture what differs from the one before.

use std::borrow::Cow;
use std::io::{self, Write};

use color_quant::NeuQuant;
use gif::{DisposalMethod, Encoder, EncodingError, Frame, Repeat};

/// Colours of a palette.
const COLOURS: usize = 255;
/// The number after theirs: it leaves a pixel as it was.
const AS_BEFORE: u8 = COLOURS as u8;
/// One of so many pixels takes part in the choice of a palette.
const SAMPLED: i32 = 10;
/// A pixel stays as it was if no channel has changed by more than this.
const TOLERANCE: u8 = 8;

/// The colours of an animation.
pub(crate) struct Palette(NeuQuant);

impl Palette {
    /// The palette that suits these pictures: red, green, blue, and so on.
    pub(crate) fn of(pictures: &[u8]) -> Self {
        let pixels = pictures.as_chunks::<3>().0;
        let pixels: Vec<u8> = pixels.iter().copied().flat_map(opaque).collect();
        Palette(NeuQuant::new(SAMPLED, COLOURS, &pixels))
    }
}

/// A colour with the opacity that the palette wants to know.
fn opaque([red, green, blue]: [u8; 3]) -> [u8; 4] {
    [red, green, blue, u8::MAX]
}

/// An animated GIF that is being written.
pub(crate) struct Writer<W: Write> {
    encoder: Encoder<W>,
    palette: Palette,
    width: u16,
    height: u16,
    /// What a viewer shows, before the palette; empty before the first picture.
    shown: Vec<[u8; 3]>,
}

impl<W: Write> Writer<W> {
    /// Begins an animation that repeats without end.
    pub(crate) fn new(to: W, [width, height]: [u16; 2], palette: Palette) -> io::Result<Self> {
        // All 256 entries, so that colours have eight bits whatever their number is.
        let mut colours = palette.0.color_map_rgb();
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
        let is_first = self.shown.is_empty();
        if is_first {
            self.shown = pixels.to_vec();
        }
        let Writer { palette, shown, .. } = self;
        let colour = |(pixel, shown): (&[u8; 3], &mut [u8; 3])| {
            let near = |(a, b): (&u8, &u8)| a.abs_diff(*b) <= TOLERANCE;
            if !is_first && pixel.iter().zip(&*shown).all(near) {
                return AS_BEFORE;
            }
            *shown = *pixel;
            palette.0.index_of(&opaque(*pixel)) as u8
        };
        let colours: Vec<u8> = pixels.iter().zip(shown).map(colour).collect();
        let frame = Frame {
            width: self.width,
            height: self.height,
            delay: hundredths,
            dispose: DisposalMethod::Keep,
            transparent: (!is_first).then_some(AS_BEFORE),
            buffer: Cow::Owned(colours),
            ..Frame::default()
        };
        self.encoder.write_frame(&frame).map_err(as_io)
    }

    /// Ends the file.
    pub(crate) fn finish(self) -> io::Result<()> {
        self.encoder.into_inner().map_err(as_io)?.flush()
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

    #[test]
    fn pictures_come_back_and_only_changes_are_stored() {
        let (black, red, blue) = ([0; 3], [250, 0, 0], [0, 0, 250]);
        // Enough pixels for a palette.
        let first = vec![black; 60 * 40];
        let mut second = first.clone();
        second[..600].fill(red);
        second[600..1200].fill(blue);
        let mut third = second.clone();
        third[..300].fill([TOLERANCE, 0, 0]);
        third[1200..].fill([TOLERANCE, 0, 0]);
        let pictures = [first, second, third];
        let all: Vec<u8> = pictures.iter().flatten().flatten().copied().collect();
        let mut file = Vec::new();
        let mut writer = Writer::new(&mut file, [60, 40], Palette::of(&all)).unwrap();
        for (picture, time) in pictures.iter().zip(4..) {
            writer.picture(picture.as_flattened(), time).unwrap();
        }
        writer.finish().unwrap();
        let mut reader = gif::Decoder::new(&file[..]).unwrap();
        let palette = reader.global_palette().unwrap().to_vec();
        let mut screen = vec![black; 60 * 40];
        for (picture, (time, stored)) in pictures.iter().zip([(4, 2400), (5, 1200), (6, 300)]) {
            let frame = reader.read_next_frame().unwrap().expect("a picture");
            assert_eq!(frame.delay, time);
            let kept = |colour: &u8| Some(*colour) != frame.transparent;
            assert_eq!(frame.buffer.iter().filter(|c| kept(c)).count(), stored);
            for (pixel, colour) in screen.iter_mut().zip(&*frame.buffer) {
                if kept(colour) {
                    *pixel = palette.as_chunks::<3>().0[usize::from(*colour)];
                }
            }
            for (found, wanted) in screen.iter().zip(picture) {
                let near = |(a, b): (&u8, &u8)| a.abs_diff(*b) <= 2 * TOLERANCE;
                assert!(
                    found.iter().zip(wanted).all(near),
                    "{found:?} for {wanted:?}"
                );
            }
        }
        assert!(reader.read_next_frame().unwrap().is_none());
    }
}
