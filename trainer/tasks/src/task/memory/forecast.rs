//! Time series to be continued.

use std::sync::{Arc, LazyLock};

use super::series::{Series, training_part};
use super::{PERIOD_US, number, step};
use crate::task::spec::round;
use crate::task::{ActionSpace, Rng, Spec, Step, Task};
use tpg_runtime::Action;

/// The most values that an episode can ask for.
pub const LONGEST_FORECAST: u32 = 500;
/// True values that an agent sees before its predictions count.
const PRIMED: usize = 50;
/// Values of a series that is computed here.
const LENGTH: usize = 8000;

/// Mackey and Glass (Science 197, 1977): x' = 0.2 x(t − 17) / (1 + x(t − 17)¹⁰) − 0.1 x, by Runge-Kutta of order 4 with a step of 0.1.
///
/// The delayed value between two steps is the mean of both. It begins with x = 1.2 after zeros. Each tenth step is a value; the
/// first 1000 values are left out.
static MACKEY_GLASS: LazyLock<Arc<Series>> = LazyLock::new(|| {
    const STEP: f64 = 0.1;
    const DELAY: usize = 170;
    const SKIPPED: usize = 1000;
    let slope = |x: f64, delayed: f64| {
        let fifth = delayed * delayed * delayed * delayed * delayed;
        0.2 * delayed / (1.0 + fifth * fifth) - 0.1 * x
    };
    let mut all = vec![1.2];
    while all.len() < 10 * (SKIPPED + LENGTH) {
        let n = all.len();
        let before = |k: usize| n.checked_sub(DELAY + 1 - k).map_or(0.0, |at| all[at]);
        let (x, start, end) = (all[n - 1], before(0), before(1));
        let middle = (start + end) / 2.0;
        let k1 = slope(x, start);
        let k2 = slope(x + STEP / 2.0 * k1, middle);
        let k3 = slope(x + STEP / 2.0 * k2, middle);
        let k4 = slope(x + STEP * k3, end);
        all.push(x + STEP / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4));
    }
    let values = all.into_iter().step_by(10).skip(SKIPPED).take(LENGTH);
    computed(values.collect())
});

/// Lorenz (Journal of the Atmospheric Sciences 20, 1963): the first coordinate at σ = 10, ρ = 28, β = 8/3, from (1, 1, 1), by
/// Runge-Kutta of order 4 with a step of 0.01. Each fifth step is a value; the first 1000 values are left out.
static LORENZ: LazyLock<Arc<Series>> = LazyLock::new(|| {
    const STEP: f64 = 0.01;
    const SKIPPED: usize = 1000;
    let slope = |[x, y, z]: [f64; 3]| [10.0 * (y - x), x * (28.0 - z) - y, x * y - 8.0 / 3.0 * z];
    let moved =
        |[x, y, z]: [f64; 3], [a, b, c]: [f64; 3], by: f64| [x + by * a, y + by * b, z + by * c];
    let (mut state, mut values) = ([1.0; 3], Vec::new());
    for k in 0..5 * (SKIPPED + LENGTH) {
        if k % 5 == 0 && k >= 5 * SKIPPED {
            values.push(state[0]);
        }
        let k1 = slope(state);
        let k2 = slope(moved(state, k1, STEP / 2.0));
        let k3 = slope(moved(state, k2, STEP / 2.0));
        let k4 = slope(moved(state, k3, STEP));
        for (part, weight) in [(k1, 1.0), (k2, 2.0), (k3, 2.0), (k4, 1.0)] {
            state = moved(state, part, STEP / 6.0 * weight);
        }
    }
    computed(values)
});

/// Scales a computed series by all of its values.
fn computed(values: Vec<f64>) -> Arc<Series> {
    let len = values.len();
    Arc::new(Series::scaled(values, len).expect("a chaotic series is not constant"))
}

/// Predicting the next value of a series, again and again.
///
/// The agent sees 50 true values, one a step, and predicts the next one each time, a value from 0 to 1. Then its predictions count. In
/// place of the truth it sees what it predicted: an episode of length 1 asks for one step ahead, one of length 50 lets the agent run
/// freely for 50 values. A step that counts earns −(error²) / (length · variance of the series). So a return of −1 is that of a
/// constant at the mean, and 0 is perfect.
///
/// Training episodes are windows of the first three quarters of a series, 6 000 of 8 000 values where it is computed here. Those of
/// the validation tasks lie in the last quarter, which no training sees.
#[derive(Clone)]
pub struct Forecast {
    spec: Spec,
    series: Arc<Series>,
    /// The first and the last place where an episode may begin, the last one excluded.
    starts: [usize; 2],
    length: usize,
    start: usize,
    time: usize,
    /// What the agent sees.
    shown: f64,
}

impl Forecast {
    /// Mackey-Glass, for a length of 1 to 500. Others count as the nearest.
    #[must_use]
    pub fn mackey_glass(length: u32) -> Self {
        Forecast::of("mackey-glass", &MACKEY_GLASS, length, false)
    }

    /// Windows of Mackey-Glass that no training sees.
    #[must_use]
    pub fn mackey_glass_validation(length: u32) -> Self {
        Forecast::of("mackey-glass-validation", &MACKEY_GLASS, length, true)
    }

    /// Lorenz, for a length of 1 to 500. Others count as the nearest.
    #[must_use]
    pub fn lorenz(length: u32) -> Self {
        Forecast::of("lorenz", &LORENZ, length, false)
    }

    /// Windows of Lorenz that no training sees.
    #[must_use]
    pub fn lorenz_validation(length: u32) -> Self {
        Forecast::of("lorenz-validation", &LORENZ, length, true)
    }

    fn of(name: &str, series: &Arc<Series>, length: u32, validation: bool) -> Self {
        let length = length.clamp(1, LONGEST_FORECAST);
        let name = format!("{name}:{length}-v1");
        Forecast::continuing(name, Arc::clone(series), length, validation)
            .expect("computed series are long enough")
    }

    /// The first and the last place where an episode may begin, the last one excluded, in a series of so many values.
    ///
    /// `None` if the series is too short.
    pub(super) fn starts(len: usize, length: u32, validation: bool) -> Option<[usize; 2]> {
        let (split, window) = (training_part(len), PRIMED + length as usize + 1);
        let [first, end] = if validation {
            [split, len.checked_sub(window)?]
        } else {
            [0, split.checked_sub(window)?]
        };
        (first < end).then_some([first, end])
    }

    /// The task of a series, for a length of 1 to 500. `None` if the series is too short.
    pub(super) fn continuing(
        name: String,
        series: Arc<Series>,
        length: u32,
        validation: bool,
    ) -> Option<Self> {
        let starts = Forecast::starts(series.values.len(), length, validation)?;
        let shown = series.values.get(starts[0]).copied()?;
        Some(Forecast {
            spec: Spec {
                name,
                inputs: vec![number("value")],
                outputs: vec![number("next_value")],
                actions: ActionSpace::Continuous {
                    len: 1,
                    low: 0.0,
                    high: 1.0,
                },
                max_steps: (PRIMED as u32 - 1) + length,
                period_us: PERIOD_US,
            },
            series,
            starts,
            length: length as usize,
            start: starts[0],
            time: 0,
            shown,
        })
    }

    /// The value of the series that comes so many steps after the first one of the episode.
    fn truth(&self, time: usize) -> f64 {
        let value = self.series.values.get(self.start + time);
        value.copied().unwrap_or(0.0)
    }
}

impl Task for Forecast {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn known_series(&self) -> Option<&[f64]> {
        let values = &self.series.values;
        values.get(..training_part(values.len()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        let [first, end] = self.starts;
        self.start = first + rng.below((end - first) as u64) as usize;
        self.time = 0;
        self.shown = self.truth(0);
    }

    fn observe(&self, observation: &mut [f32]) {
        if let [value, ..] = observation {
            *value = round(self.shown);
        }
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        let predicted = match action {
            Action::Continuous([predicted, ..]) => f64::from(*predicted),
            _ => 0.0,
        };
        self.time += 1;
        let truth = self.truth(self.time);
        // The prediction made at the sight of the last true value is the first that counts.
        if self.time < PRIMED {
            self.shown = truth;
            return step(0.0, false);
        }
        self.shown = predicted;
        let error = predicted - truth;
        let reward = -(error * error) / (self.length as f64 * self.series.variance);
        step(reward, self.time + 1 >= PRIMED + self.length)
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// The mean return of an agent that predicts from what it saw, the last value first.
    pub(in crate::task::memory) fn mean_return(
        task: &mut Forecast,
        predict: impl Fn(&[f64]) -> f64,
    ) -> f64 {
        let mut rng = Rng::new(4);
        let mut total = 0.0;
        for _ in 0..200 {
            task.reset(&mut rng);
            let mut seen = Vec::new();
            for t in 0.. {
                let mut observation = [0.0f32];
                task.observe(&mut observation);
                seen.insert(0, f64::from(observation[0]));
                let predicted = predict(&seen).clamp(0.0, 1.0) as f32;
                let step = task.step(Action::Continuous(&[predicted]));
                total += step.reward / 200.0;
                if step.terminated {
                    assert_eq!(t + 1, task.spec.max_steps);
                    break;
                }
            }
        }
        total
    }

    #[test]
    fn series_lie_within_0_and_1_and_do_not_settle() {
        for series in [&MACKEY_GLASS, &LORENZ] {
            assert_eq!(series.values.len(), LENGTH);
            assert!(series.values.iter().all(|x| (0.0..=1.0).contains(x)));
            for part in series.values.chunks(LENGTH / 8) {
                let (low, high) = part.iter().fold((1.0f64, 0.0f64), |(low, high), x| {
                    (low.min(*x), high.max(*x))
                });
                assert!(high - low > 0.8, "{low} to {high}");
            }
        }
    }

    /// By the definition of variance, a constant at the mean has −1.
    #[test]
    fn a_constant_at_the_mean_has_minus_1() {
        for mut task in [Forecast::mackey_glass(50), Forecast::lorenz_validation(100)] {
            let mean = task.series.values.iter().sum::<f64>() / LENGTH as f64;
            let mean = mean_return(&mut task, |_| mean);
            assert!((mean + 1.0).abs() < 0.15, "{mean}");
        }
    }

    #[test]
    fn one_step_ahead_is_easy_and_running_freely_is_not() {
        let persistence = |seen: &[f64]| seen[0];
        let line = |seen: &[f64]| match seen {
            [last, before, ..] => 2.0 * last - before,
            _ => 0.5,
        };
        let short = mean_return(&mut Forecast::mackey_glass(1), persistence);
        assert!((-0.05..0.0).contains(&short), "{short}");
        let line = mean_return(&mut Forecast::mackey_glass(1), line);
        assert!(line > short / 2.0, "{line}");
        let free = mean_return(&mut Forecast::mackey_glass(50), persistence);
        assert!((-3.0..-1.2).contains(&free), "{free}");
    }

    /// Free running shows the agent its own output, and nothing else.
    #[test]
    fn after_50_values_an_agent_sees_what_it_predicted() {
        let mut task = Forecast::mackey_glass(3);
        task.reset(&mut Rng::new(7));
        let mut seen = Vec::new();
        for t in 0..52 {
            let mut observation = [0.0f32];
            task.observe(&mut observation);
            seen.push(observation[0]);
            let step = task.step(Action::Continuous(&[t as f32 / 64.0]));
            assert_eq!(step.terminated, t == 51);
            assert_eq!(step.reward < 0.0, t >= 49, "{t}");
        }
        let expected: Vec<f32> = (0..50).map(|k| round(task.truth(k))).collect();
        assert_eq!(seen[..50], expected);
        assert_eq!(seen[50..], [49.0 / 64.0, 50.0 / 64.0]);
    }
}
