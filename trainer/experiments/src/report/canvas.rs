//! Figures as files: SVG as drawn, PNG from a larger drawing whose pixels are averaged.

use std::sync::Once;

use plotters::backend::BitMapBackend;
use plotters::prelude::{IntoDrawingArea as _, SVGBackend};
use plotters::style::{FontStyle, register_font};

use super::figure::{FONT, Figure};

/// Pixels of a PNG for each unit of length of a figure: screens show it at half its size, sharp.
const RESOLUTION: u32 = 2;
/// Pixels drawn for each pixel of a PNG, along each side: the library draws edges hard.
const OVERSAMPLING: u32 = 2;

/// Gives the font to the drawing library, once for the process.
fn load_font() {
    static LOADED: Once = Once::new();
    LOADED.call_once(|| {
        let loaded = register_font(FONT, FontStyle::Normal, dejavu::sans::regular());
        assert!(
            loaded.is_ok(),
            "the font that is a part of this program is one"
        );
    });
}

/// The figure as SVG text; programs that show it choose the font.
pub(super) fn svg(figure: &Figure) -> anyhow::Result<Vec<u8>> {
    load_font();
    let mut text = String::new();
    {
        let root = SVGBackend::with_string(&mut text, figure.size()).into_drawing_area();
        figure.draw(&root, 1).map_err(describe)?;
    }
    Ok(text.into_bytes())
}

/// The figure as a PNG file.
pub(super) fn png(figure: &Figure) -> anyhow::Result<Vec<u8>> {
    load_font();
    let (width, height) = figure.size();
    let (width, height) = (width * RESOLUTION, height * RESOLUTION);
    let drawn = (width * OVERSAMPLING, height * OVERSAMPLING);
    let mut pixels = vec![0; (drawn.0 * drawn.1 * 3) as usize];
    {
        let root = BitMapBackend::with_buffer(&mut pixels, drawn).into_drawing_area();
        figure
            .draw(&root, RESOLUTION * OVERSAMPLING)
            .map_err(describe)?;
    }
    let mut file = Vec::new();
    let mut encoder = png::Encoder::new(&mut file, width, height);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.set_compression(png::Compression::High);
    let mut writer = encoder.write_header()?;
    writer.write_image_data(&averaged(&pixels, width, height))?;
    writer.finish()?;
    Ok(file)
}

/// Averages squares of pixels.
fn averaged(drawn: &[u8], width: u32, height: u32) -> Vec<u8> {
    let side = OVERSAMPLING as usize;
    let (width, height) = (width as usize, height as usize);
    let mut pixels = Vec::with_capacity(width * height * 3);
    for y in 0..height {
        for x in 0..width {
            for channel in 0..3 {
                let sum: usize = (0..side * side)
                    .map(|i| {
                        let (row, column) = (y * side + i / side, x * side + i % side);
                        usize::from(drawn[(row * width * side + column) * 3 + channel])
                    })
                    .sum();
                pixels.push((sum / (side * side)) as u8);
            }
        }
    }
    pixels
}

fn describe(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow::anyhow!("cannot draw a figure: {error}")
}
