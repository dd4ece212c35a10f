//! The colours of an animation: chosen once, so that what stands still keeps its colour.

/// Colours that a palette has at most; one more number stands for "as before".
pub(super) const COLOURS: usize = 255;
/// Bits of each channel by which colours are told apart.
const BITS: u32 = 6;
/// Colours that are told apart.
const CELLS: usize = 1 << (3 * BITS);

/// The number of the cell that a colour lies in.
fn cell([red, green, blue]: [u8; 3]) -> usize {
    let part = |channel: u8| usize::from(channel >> (8 - BITS));
    (part(red) << (2 * BITS)) | (part(green) << BITS) | part(blue)
}

/// How often each colour was seen.
pub(crate) struct Histogram {
    cells: Vec<Cell>,
}

/// Pixels of almost the same colour.
#[derive(Debug, Clone, Copy, Default)]
struct Cell {
    pixels: u64,
    /// Sums of their channels.
    sums: [u64; 3],
}

impl Cell {
    fn mean(self, channel: usize) -> f64 {
        self.sums[channel] as f64 / self.pixels.max(1) as f64
    }

    fn join(self, other: Cell) -> Cell {
        Cell {
            pixels: self.pixels + other.pixels,
            sums: std::array::from_fn(|k| self.sums[k] + other.sums[k]),
        }
    }
}

impl Histogram {
    pub(crate) fn new() -> Self {
        Histogram {
            cells: vec![Cell::default(); CELLS],
        }
    }

    /// Counts the pixels of a picture: red, green, blue, and so on.
    pub(crate) fn count(&mut self, picture: &[u8]) {
        for &pixel in picture.as_chunks::<3>().0 {
            let one = Cell {
                pixels: 1,
                sums: pixel.map(u64::from),
            };
            let cell = &mut self.cells[cell(pixel)];
            *cell = cell.join(one);
        }
    }

    /// The palette: colours are parted, again and again, where parting leaves them nearest to their means.
    pub(crate) fn palette(self) -> Palette {
        let seen = self.cells.into_iter().filter(|cell| cell.pixels > 0);
        let mut groups = vec![Group::new(seen.collect())];
        while groups.len() < COLOURS {
            let widest = groups.iter().enumerate();
            let widest = widest.max_by(|(_, a), (_, b)| a.spread.total_cmp(&b.spread));
            let Some((widest, true)) = widest.map(|(k, group)| (k, group.spread > 0.0)) else {
                break;
            };
            let [low, high] = groups.swap_remove(widest).part();
            groups.extend([low, high]);
        }
        let colours = groups.iter().map(Group::mean).collect();
        Palette {
            colours,
            nearest: vec![None; CELLS],
        }
    }
}

/// Colours that share an entry of the palette.
struct Group {
    cells: Vec<Cell>,
    /// The channel along which the colours differ most.
    channel: usize,
    /// Sum of the squared differences from the mean along it.
    spread: f64,
}

impl Group {
    fn new(cells: Vec<Cell>) -> Self {
        let all = cells.iter().copied().fold(Cell::default(), Cell::join);
        let spread = |channel: usize| -> f64 {
            let mean = all.mean(channel);
            let squares = cells.iter().map(|cell| {
                let off = cell.mean(channel) - mean;
                cell.pixels as f64 * off * off
            });
            squares.sum()
        };
        let spreads = [0, 1, 2].map(|channel| (channel, spread(channel)));
        let widest = spreads.into_iter().max_by(|a, b| a.1.total_cmp(&b.1));
        let (channel, spread) = widest.unwrap_or_default();
        // A single cell cannot be parted.
        let spread = if cells.len() > 1 { spread } else { 0.0 };
        Group {
            cells,
            channel,
            spread,
        }
    }

    /// Those below the mean of the widest channel, and the others.
    fn part(self) -> [Group; 2] {
        let all = self.cells.iter().copied().fold(Cell::default(), Cell::join);
        let mean = all.mean(self.channel);
        let below = |cell: &Cell| cell.mean(self.channel) < mean;
        let (low, high) = self.cells.iter().partition(|cell| below(cell));
        [Group::new(low), Group::new(high)]
    }

    fn mean(&self) -> [u8; 3] {
        let all = self.cells.iter().copied().fold(Cell::default(), Cell::join);
        [0, 1, 2].map(|channel| all.mean(channel).round() as u8)
    }
}

/// The colours of an animation.
pub(crate) struct Palette {
    colours: Vec<[u8; 3]>,
    /// For each cell the entry that stands for it, once that was asked for.
    nearest: Vec<Option<u8>>,
}

impl Palette {
    /// The colours: red, green, blue, and so on.
    pub(super) fn bytes(&self) -> &[u8] {
        self.colours.as_flattened()
    }

    /// The number of the entry that stands for a colour.
    pub(super) fn index(&mut self, pixel: [u8; 3]) -> u8 {
        let cell = cell(pixel);
        if let Some(index) = self.nearest[cell] {
            return index;
        }
        let entries = (0..=u8::MAX).zip(&self.colours);
        let nearest = entries.min_by_key(|(_, colour)| distance(**colour, pixel));
        let index = nearest.map_or(0, |(index, _)| index);
        self.nearest[cell] = Some(index);
        index
    }

    /// The [`distance`] of an entry from a colour.
    pub(super) fn distance(&self, index: u8, pixel: [u8; 3]) -> u32 {
        let colour = self.colours.get(usize::from(index));
        colour.map_or(u32::MAX, |colour| distance(*colour, pixel))
    }
}

/// The sum of the channels' squared differences.
pub(super) fn distance(a: [u8; 3], b: [u8; 3]) -> u32 {
    let squares = a.iter().zip(b).map(|(a, b)| {
        let off = u32::from(a.abs_diff(b));
        off * off
    });
    squares.sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn few_colours_are_kept() {
        let colours = [[255, 0, 0], [0, 255, 0], [10, 20, 30], [200, 200, 200]];
        let mut histogram = Histogram::new();
        // A colour that is seen rarely has an entry as well.
        histogram.count(&colours.as_flattened().repeat(2));
        histogram.count(&[9, 9, 9].repeat(10_000));
        let mut palette = histogram.palette();
        for colour in colours {
            let index = usize::from(palette.index(colour));
            assert_eq!(palette.colours[index], colour);
        }
    }

    #[test]
    fn many_colours_have_one_nearby() {
        let all = (0..=255u8).flat_map(|red| (0..=255u8).map(move |blue| [red, 128, blue]));
        let all: Vec<[u8; 3]> = all.collect();
        let mut histogram = Histogram::new();
        histogram.count(all.as_flattened());
        let mut palette = histogram.palette();
        assert_eq!(palette.colours.len(), COLOURS);
        for colour in all {
            let index = palette.index(colour);
            let found = palette.colours[usize::from(index)];
            for (a, b) in found.iter().zip(colour) {
                assert!(a.abs_diff(b) < 24, "{colour:?} as {found:?}");
            }
        }
    }

    #[test]
    fn a_picture_without_pixels_has_a_palette() {
        let mut palette = Histogram::new().palette();
        assert_eq!(palette.index([1, 2, 3]), 0);
    }
}
