//! The arithmetic of the health signal.

/// Share of a step's weight that is left after the next one: a memory of some 32 steps.
const KEPT: f32 = 1.0 - 1.0 / 32.0;
/// The least change that a step counts, in standard deviations. It keeps the noise of a channel at rest below the threshold.
const LEAST: f32 = 0.02;

/// Adds a step to a channel's sums of squares: `residuals`, and `changes`, which are those predicted and those seen.
///
/// Old steps lose weight.
pub fn add_step(residuals: &mut f32, changes: &mut f32, change: f32, residual: f32) {
    let seen = change + residual;
    let counted = |x: f32| (x * x).max(LEAST * LEAST);
    *residuals = *residuals * KEPT + residual * residual;
    *changes = *changes * KEPT + counted(change) + counted(seen);
}

/// Residuals in relation to changes: 0 for a perfect prediction, 1 for one that has nothing to do with what is seen.
#[must_use]
pub fn unexplained(residuals: f32, changes: f32) -> f32 {
    if changes > 0.0 {
        residuals / changes
    } else {
        0.0
    }
}

/// The larger one of two numbers that are not NaN.
#[must_use]
pub fn larger(a: f32, b: f32) -> f32 {
    if b > a { b } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The share after many steps, each of which predicts and then shows a change.
    fn share(steps: impl Fn(u32) -> (f32, f32)) -> f32 {
        let (mut residuals, mut changes) = (0.0, 0.0);
        for k in 0..200 {
            let (predicted, seen) = steps(k);
            add_step(&mut residuals, &mut changes, predicted, seen - predicted);
        }
        unexplained(residuals, changes)
    }

    #[test]
    fn a_share_tells_healthy_stuck_noisy_and_resting_channels_apart() {
        let wave = |k: u32| [0.5, -0.25, -1.0, 0.75][k as usize % 4];
        let noise = |k: u32| [1.0, 1.0, -1.0][k as usize % 3];
        assert!(share(|k| (wave(k), wave(k))) == 0.0);
        assert!(share(|k| (wave(k), 0.8 * wave(k))) < 0.1);
        assert!(share(|k| (wave(k), 0.0)) > 0.98, "stuck");
        assert!(share(|k| (0.01 * wave(k), noise(k))) > 0.98, "noisy");
        assert!(share(|k| (0.001 * wave(k), 0.0)) < 0.01, "at rest");
        assert!(
            share(|k| (0.0, 0.005 * noise(k))) < 0.05,
            "at rest with noise"
        );
        assert!(unexplained(0.0, 0.0) == 0.0);
    }
}
