//! Figures as data, and their drawing: panels of lines with bands, or of bars, with one legend below.

use std::ops::Range;

use plotters::coord::Shift;
use plotters::element::DashedPathElement;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// The family that canvases give a font to.
pub(super) const FONT: &str = "sans-serif";

/// Colours that people with any colour vision tell apart on white (Okabe and Ito's, without their yellow).
const PALETTE: [RGBColor; 7] = [
    RGBColor(0, 114, 178),
    RGBColor(213, 94, 0),
    RGBColor(0, 158, 115),
    RGBColor(204, 121, 167),
    RGBColor(0, 0, 0),
    RGBColor(86, 180, 233),
    RGBColor(230, 159, 0),
];

const INK: RGBColor = RGBColor(60, 60, 60);
const GRID: RGBColor = RGBColor(225, 225, 225);
const WIDTH: u32 = 760;
const ROW_HEIGHT: u32 = 250;
/// Panels below this width have room for fewer labels.
const NARROW: u32 = 240;
const TITLE_HEIGHT: u32 = 26;
const TITLE_LINE: u32 = 18;
const LEGEND_HEIGHT: u32 = 20;
const TEXT: i32 = 13;
const TITLE_TEXT: i32 = TEXT + 2;

/// A look: its colour, and dashes where the colours have run out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Look(usize);

impl Look {
    /// The look of the series with this number.
    pub(super) fn new(series: usize) -> Self {
        Look(series)
    }

    fn color(self) -> RGBColor {
        PALETTE[self.0 % PALETTE.len()]
    }

    fn dashed(self) -> bool {
        self.0 / PALETTE.len() % 2 == 1
    }
}

/// A figure: rows of panels below a title.
#[derive(Debug, Clone)]
pub(super) struct Figure {
    pub(super) title: String,
    pub(super) rows: Vec<Vec<Panel>>,
    pub(super) legend: Vec<(String, Look)>,
}

/// One pair of axes.
#[derive(Debug, Clone)]
pub(super) struct Panel {
    pub(super) title: String,
    pub(super) x_label: String,
    pub(super) y_label: String,
    pub(super) x: Range<f64>,
    /// The ends of the y-axis; by default what is drawn decides.
    pub(super) y: Option<Range<f64>>,
    pub(super) x_ticks: Ticks,
    pub(super) marks: Vec<Mark>,
    /// What stands in the middle, such as why there is nothing to draw.
    pub(super) note: Option<String>,
}

/// What stands below the x-axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Ticks {
    /// Round numbers.
    Numbers,
    /// Round numbers, without fractions.
    Whole,
    /// The numbers whose decimal logarithms the axis shows.
    Logarithms,
    /// Every whole number, modulo this.
    Modulo(usize),
}

/// Something in a panel.
#[derive(Debug, Clone)]
pub(super) enum Mark {
    /// A line through (x, middle) with a band from low to high: (x, low, middle, high).
    Line(Look, Vec<[f64; 4]>),
    /// An upright bar: x from, x to, y from, y to.
    Bar(Look, [f64; 4]),
}

impl Figure {
    /// Width and height in pixels.
    pub(super) fn size(&self) -> (u32, u32) {
        let legend = LEGEND_HEIGHT * self.legend_rows().len() as u32 + 6;
        let panels = ROW_HEIGHT * self.rows.len() as u32;
        (WIDTH, self.title_height() + panels + legend)
    }

    fn title_height(&self) -> u32 {
        TITLE_HEIGHT + TITLE_LINE * (self.title_lines().len() as u32 - 1)
    }

    /// The title in lines that fit the width, at least one.
    fn title_lines(&self) -> Vec<String> {
        let letters = (WIDTH - 16) / letter_width(TITLE_TEXT);
        let mut lines = vec![String::new()];
        for word in self.title.split_whitespace() {
            match lines.last_mut() {
                Some(line) if line.is_empty() => line.push_str(word),
                Some(line) if line.len() + 1 + word.len() <= letters as usize => {
                    line.push(' ');
                    line.push_str(word);
                }
                _ => lines.push(word.to_owned()),
            }
        }
        lines
    }

    /// Draws the figure, all lengths times `scale`.
    pub(super) fn draw<B: DrawingBackend>(
        &self,
        root: &DrawingArea<B, Shift>,
        scale: u32,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        root.fill(&WHITE)?;
        let px = |length: u32| (length * scale) as i32;
        let (title, rest) = root.split_vertically(px(self.title_height()));
        for (row, line) in self.title_lines().into_iter().enumerate() {
            let at = (px(8), px(7 + TITLE_LINE * row as u32));
            title.draw(&Text::new(line, at, font(TITLE_TEXT * scale as i32)))?;
        }
        let (panels, legend) = rest.split_vertically(px(ROW_HEIGHT * self.rows.len() as u32));
        let columns = self.rows.iter().map(Vec::len).max().unwrap_or(1).max(1);
        let areas = panels.split_evenly((self.rows.len(), columns));
        for (row, areas) in self.rows.iter().zip(areas.chunks(columns)) {
            for (panel, area) in row.iter().zip(areas) {
                panel.draw(area, scale)?;
            }
        }
        for (line, entries) in self.legend_rows().into_iter().enumerate() {
            let y = px(LEGEND_HEIGHT * line as u32 + LEGEND_HEIGHT / 2);
            for (x, name, look) in entries {
                let x = px(x);
                let sample = [(x, y), (x + px(22), y)];
                draw_legend_line(&legend, sample, look, scale)?;
                let at = (x + px(28), y - px(TEXT as u32) / 2);
                legend.draw(&Text::new(name, at, font(TEXT * scale as i32)))?;
            }
        }
        root.present()
    }

    /// The legend's entries in lines that fit the width, each with its place.
    fn legend_rows(&self) -> Vec<Vec<(u32, String, Look)>> {
        let mut rows: Vec<Vec<_>> = vec![Vec::new()];
        let mut x = 12;
        for (name, look) in &self.legend {
            let width = 46 + name.len() as u32 * letter_width(TEXT);
            if x + width > WIDTH && x > 12 {
                rows.push(Vec::new());
                x = 12;
            }
            if let Some(row) = rows.last_mut() {
                row.push((x, name.clone(), *look));
            }
            x += width;
        }
        rows.retain(|row| !row.is_empty());
        rows
    }
}

impl Panel {
    fn draw<B: DrawingBackend>(
        &self,
        area: &DrawingArea<B, Shift>,
        scale: u32,
    ) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
        let px = |length: u32| length * scale;
        let text = |size: i32| font(size * scale as i32);
        let narrow = area.dim_in_pixel().0 < px(NARROW);
        let mut chart = ChartBuilder::on(area)
            .margin(px(6))
            .margin_right(px(12))
            .caption(&self.title, text(TEXT))
            .x_label_area_size(px(36))
            .y_label_area_size(px(52))
            .build_cartesian_2d(self.x.clone(), self.y_range())?;
        let x_tick = |x: &f64| match self.x_ticks {
            Ticks::Numbers => tick(*x),
            Ticks::Logarithms => tick(two_digits(10f64.powf(*x))),
            Ticks::Whole if (x - x.round()).abs() > 1e-6 => String::new(),
            Ticks::Whole => tick(x.round()),
            Ticks::Modulo(n) => (x.round() as usize % n).to_string(),
        };
        let x_ticks = match self.x_ticks {
            // More labels would touch in a narrow panel.
            Ticks::Numbers | Ticks::Whole | Ticks::Logarithms if narrow => 3,
            Ticks::Numbers | Ticks::Whole | Ticks::Logarithms => 5,
            Ticks::Modulo(_) => 30,
        };
        let small = match self.x_ticks {
            Ticks::Numbers | Ticks::Whole | Ticks::Logarithms => TEXT - 2,
            Ticks::Modulo(_) => TEXT - 5,
        };
        chart
            .configure_mesh()
            .disable_x_mesh()
            .light_line_style(TRANSPARENT)
            .bold_line_style(GRID.stroke_width(scale))
            .axis_style(INK.stroke_width(scale))
            .set_all_tick_mark_size(px(3))
            .x_labels(x_ticks)
            .y_labels(5)
            .x_label_formatter(&x_tick)
            .y_label_formatter(&|y| tick(*y))
            .x_label_style(text(small))
            .y_label_style(text(TEXT - 2))
            .axis_desc_style(text(TEXT - 1))
            .x_desc(self.x_label.as_str())
            .y_desc(self.y_label.as_str())
            .draw()?;
        // Bands first, so that none hides another's line.
        for mark in &self.marks {
            match mark {
                Mark::Line(look, points) => {
                    let upper = points.iter().map(|[x, _, _, high]| (*x, *high));
                    let lower = points.iter().rev().map(|[x, low, _, _]| (*x, *low));
                    let outline: Vec<_> = upper.chain(lower).collect();
                    chart.draw_series([Polygon::new(outline, look.color().mix(0.15))])?;
                }
                Mark::Bar(look, [x0, x1, y0, y1]) => {
                    let corners = [(*x0, *y0), (*x1, *y1)];
                    chart.draw_series([Rectangle::new(corners, look.color().filled())])?;
                }
            }
        }
        for mark in &self.marks {
            let Mark::Line(look, points) = mark else {
                continue;
            };
            let line = points.iter().map(|[x, _, middle, _]| (*x, *middle));
            let style = look.color().stroke_width(2 * scale);
            if let [[x, low, middle, high]] = points[..] {
                // A line of one point would not be seen.
                let range = [(x, low), (x, high)];
                chart.draw_series([PathElement::new(range, look.color().mix(0.3))])?;
                chart.draw_series([Circle::new((x, middle), px(4), look.color().filled())])?;
            } else if look.dashed() {
                chart.draw_series(DashedLineSeries::new(
                    line,
                    px(6) as i32,
                    px(4) as i32,
                    style,
                ))?;
            } else {
                chart.draw_series(LineSeries::new(line, style))?;
            }
        }
        if let Some(note) = &self.note {
            let range = self.y_range();
            let middle = (
                (self.x.start + self.x.end) / 2.0,
                (range.start + range.end) / 2.0,
            );
            let centred = text(TEXT).pos(Pos::new(HPos::Center, VPos::Center));
            chart.draw_series([Text::new(note.clone(), middle, centred)])?;
        }
        Ok(())
    }

    /// All that is drawn, with some room above and below; bars stand on 0.
    pub(super) fn y_range(&self) -> Range<f64> {
        if let Some(range) = &self.y {
            return range.clone();
        }
        let mut low = f64::INFINITY;
        let mut high = f64::NEG_INFINITY;
        let mut room_below = 0.0;
        for mark in &self.marks {
            match mark {
                Mark::Line(_, points) => {
                    for y in points.iter().flat_map(|point| &point[1..]) {
                        low = low.min(*y);
                        high = high.max(*y);
                    }
                    room_below = 0.05;
                }
                Mark::Bar(_, [_, _, y0, y1]) => {
                    low = low.min(*y0);
                    high = high.max(*y1);
                }
            }
        }
        let height = high - low;
        if !height.is_finite() {
            return 0.0..1.0;
        }
        if height <= 0.0 {
            let half = (0.05 * high.abs()).max(0.5);
            let below = if room_below > 0.0 { half } else { 0.0 };
            return low - below..high + half;
        }
        low - room_below * height..high + 0.05 * height
    }
}

fn font(size: i32) -> TextStyle<'static> {
    (FONT, size).into_font().color(&INK)
}

fn draw_legend_line<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    ends: [(i32, i32); 2],
    look: Look,
    scale: u32,
) -> Result<(), DrawingAreaErrorKind<B::ErrorType>> {
    let style = look.color().stroke_width(4 * scale);
    if look.dashed() {
        let dash = (6 * scale) as i32;
        let gap = (4 * scale) as i32;
        area.draw(&DashedPathElement::new(ends, dash, gap, style))
    } else {
        area.draw(&PathElement::new(ends, style))
    }
}

/// More than the mean letter of any sans-serif takes at this size.
const fn letter_width(size: i32) -> u32 {
    size as u32 * 3 / 5
}

/// A number on an axis, short.
fn tick(value: f64) -> String {
    let (value, unit) = match value.abs() {
        1_000_000.0.. => (value / 1e6, "M"),
        10_000.0.. => (value / 1e3, "k"),
        _ => (value, ""),
    };
    let text = format!("{value:.3}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    // Rounding leaves a sign on nothing.
    let text = if text == "-0" { "0" } else { text };
    format!("{text}{unit}")
}

/// A positive number rounded to two significant digits.
fn two_digits(value: f64) -> f64 {
    let digit = 10f64.powf(value.log10().floor() - 1.0);
    (value / digit).round() * digit
}

#[cfg(test)]
mod tests {
    use super::{Figure, tick, two_digits};

    #[test]
    fn long_titles_take_more_lines() {
        let title = "Mean training score of the best agent so far, over environment steps, of all runs of this experiment";
        let mut figure = Figure {
            title: title.into(),
            rows: Vec::new(),
            legend: Vec::new(),
        };
        let lines = figure.title_lines();
        assert_eq!(lines.join(" "), title);
        assert!(
            lines.len() == 2 && lines.iter().all(|line| line.len() <= 82),
            "{lines:?}"
        );
        let (_, two_lines) = figure.size();
        figure.title.clear();
        assert!(figure.size().1 < two_lines);
    }

    #[test]
    fn numbers_on_axes_are_short() {
        let texts = [0.1 + 0.2, -1e-9, 350.0, 25_000.0, 5e6, -12_500_000.0].map(tick);
        assert_eq!(texts, ["0.3", "0", "350", "25k", "5M", "-12.5M"]);
        let texts = [0.3162, 3.162, 31.62, 1000.0].map(|x| tick(two_digits(x)));
        assert_eq!(texts, ["0.32", "3.2", "32", "1000"]);
    }
}
