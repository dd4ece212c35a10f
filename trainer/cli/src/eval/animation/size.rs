//! How large an animation is.

use std::ops::RangeInclusive;
use std::str::FromStr;

/// Width and height of an animation, in pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) struct Size(pub(super) [u16; 2]);

/// Pixels along a side.
const SIDES: RangeInclusive<u16> = 16..=2048;

impl FromStr for Size {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| text.parse().ok().filter(|side| SIDES.contains(side));
        let sides = text.split_once('x');
        let sides = sides.and_then(|(width, height)| Some([side(width)?, side(height)?]));
        let [least, most] = [SIDES.start(), SIDES.end()];
        sides.map(Size).ok_or_else(|| {
            format!("wanted WIDTHxHEIGHT, such as 320x240, each from {least} to {most}")
        })
    }
}
