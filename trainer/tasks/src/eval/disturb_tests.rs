//! Tests of the disturbances, with a controller that echoes what it sees.

use std::convert::Infallible;

use super::*;

/// Answers with the first value that it sees, as index or as value.
struct Echo {
    discrete: bool,
    seen: Vec<f32>,
}

impl Controller for Echo {
    type Error = Infallible;

    fn reset(&mut self, _: Reset, _: u64) -> Result<(), Infallible> {
        Ok(())
    }

    fn decide(&mut self, observation: &[f32]) -> Result<Reply<'_>, Infallible> {
        self.seen = observation.to_vec();
        Ok(Reply {
            action: if self.discrete {
                Action::Discrete(observation[0] as u16)
            } else {
                Action::Continuous(&self.seen)
            },
            instructions: 1,
        })
    }
}

fn disturbed(discrete: bool, texts: &[&str]) -> Result<Disturbed<Echo>, DisturbError> {
    let list = texts
        .iter()
        .map(|t| t.parse().unwrap())
        .collect::<Vec<Disturbance>>();
    let actions = if discrete {
        ActionSpace::Discrete(1000)
    } else {
        ActionSpace::Continuous {
            len: 2,
            low: -8.0,
            high: 8.0,
        }
    };
    let echo = Echo {
        discrete,
        seen: Vec::new(),
    };
    let mut disturbed = Disturbed::new(echo, &list, 2, actions)?;
    disturbed.seed_wrappers(1);
    Ok(disturbed)
}

/// What the controller saw, and what the plant was told, for an observation.
fn step(link: &mut Disturbed<Echo>, observation: [f32; 2]) -> (Vec<f32>, Vec<f32>) {
    let reply = link.decide(&observation).unwrap();
    let told = match reply.action {
        Action::Discrete(index) => vec![f32::from(index)],
        Action::Continuous(values) => values.to_vec(),
    };
    (link.inner.seen.clone(), told)
}

fn bits(values: &[f32]) -> Vec<u32> {
    values.iter().map(|v| v.to_bits()).collect()
}

/// The first values seen and told over steps in which the observation is the number of the step, from 1.
fn counted(link: &mut Disturbed<Echo>, steps: u16) -> (Vec<i32>, Vec<i32>) {
    (1..=steps)
        .map(|k| {
            let (seen, told) = step(link, [f32::from(k), 0.0]);
            (seen[0] as i32, told[0] as i32)
        })
        .unzip()
}

#[test]
fn no_disturbance_changes_no_bit() {
    let mut link = disturbed(false, &[]).unwrap();
    let (seen, told) = step(&mut link, [-0.0, 1e-40]);
    assert_eq!(bits(&seen), bits(&[-0.0, 1e-40]));
    assert_eq!(bits(&told), bits(&[-0.0, 1e-40]));
}

#[test]
fn delays_add_up_and_begin_anew_with_each_episode() {
    let mut link = disturbed(false, &["delay:2", "action:delay:1"]).unwrap();
    for episode in 0..2 {
        link.seed_wrappers(episode);
        let (seen, told) = counted(&mut link, 6);
        assert_eq!(seen, [0, 0, 1, 2, 3, 4]);
        assert_eq!(told, [0, 0, 0, 1, 2, 3]);
    }
    let mut link = disturbed(true, &["delay:1", "delay:2", "action:delay:2"]).unwrap();
    let (seen, told) = counted(&mut link, 7);
    assert_eq!(seen, [0, 0, 0, 1, 2, 3, 4]);
    assert_eq!(told, [0, 0, 0, 0, 0, 1, 2]);
}

#[test]
fn lost_observations_are_zeros_and_lost_actions_repeat_the_last() {
    let mut link = disturbed(true, &["loss:1/3"]).unwrap();
    let (seen, _) = counted(&mut link, 500);
    assert!(
        (1..=500)
            .zip(&seen)
            .all(|(k, seen)| *seen == k || *seen == 0)
    );
    let mut link = disturbed(true, &["action:loss:1/3"]).unwrap();
    let (seen, told) = counted(&mut link, 500);
    assert_eq!(seen, (1..=500).collect::<Vec<_>>());
    let mut last = 0;
    for (k, told) in (1..=500).zip(told) {
        assert!(told == k || told == last, "step {k}: {told} after {last}");
        last = told;
    }
}

/// The words are those of the stream, so the losses can be told in advance, one by one.
#[test]
fn frames_are_lost_exactly_where_the_stream_says() {
    const STEPS: u16 = 20_000;
    for (fraction, p) in [
        ("1/10", 0.1),
        ("2/3", 2.0 / 3.0),
        ("0/1", 0.0),
        ("1/1", 1.0),
    ] {
        let mut link = disturbed(true, &["quantise:1", &format!("loss:{fraction}")]).unwrap();
        link.seed_wrappers(9);
        let mut rng = Rng::new(mix64(&[9, 1]));
        let mut lost = 0;
        for _ in 0..STEPS {
            let (seen, _) = step(&mut link, [1.0, 1.0]);
            let expected = rng.word() as f64 / 2f64.powi(64) < p;
            assert_eq!(bits(&seen), bits(&[f32::from(!expected); 2]));
            lost += u32::from(expected);
        }
        // Five standard deviations of a binomial number; none at all for 0 and 1.
        let bound = 5.0 * (f64::from(STEPS) * p * (1.0 - p)).sqrt();
        assert!(
            (f64::from(lost) - f64::from(STEPS) * p).abs() <= bound,
            "{lost}"
        );
    }
}

#[test]
fn order_of_the_stack_is_the_order_given() {
    // Rounded first, a value stays noisy; rounded last, it is a multiple again.
    let multiple = |v: &f32| (v * 2.0).fract().to_bits() == 0;
    let (seen, _) = step(
        &mut disturbed(false, &["quantise:0.5", "noise:0.1"]).unwrap(),
        [3.3, 3.3],
    );
    assert!(!seen.iter().any(multiple), "{seen:?}");
    let (seen, _) = step(
        &mut disturbed(false, &["noise:0.1", "quantise:0.5"]).unwrap(),
        [3.3, 3.3],
    );
    assert!(seen.iter().all(|v| multiple(&v.abs())), "{seen:?}");
    // A frame lost before noise carries the noise alone, one lost after it nothing.
    let (seen, _) = step(
        &mut disturbed(false, &["loss:1/1", "noise:0.1"]).unwrap(),
        [3.3, 3.3],
    );
    assert!(
        seen.iter().all(|v| v.abs() > 0.0 && v.abs() < 1.0),
        "{seen:?}"
    );
    let (seen, _) = step(
        &mut disturbed(false, &["noise:0.1", "loss:1/1"]).unwrap(),
        [3.3, 3.3],
    );
    assert_eq!(bits(&seen), [0, 0]);
}

#[test]
fn same_seed_same_bits_and_another_seed_others() {
    let texts = [
        "noise:0.5",
        "loss:1/4",
        "action:noise:0.5",
        "action:loss:1/4",
    ];
    let run = |seed: u64, texts: &[&str]| {
        let mut link = disturbed(false, texts).unwrap();
        // An instance that was used before leaves nothing behind.
        counted(&mut link, 7);
        link.seed_wrappers(seed);
        let mut all = Vec::new();
        for k in 0..50u8 {
            let (seen, told) = step(&mut link, [f32::from(k), 1.0]);
            all.push((bits(&seen), bits(&told)));
        }
        all
    };
    assert_eq!(run(3, &texts), run(3, &texts));
    assert_ne!(run(3, &texts), run(4, &texts));
    // Another disturbance at the end leaves the numbers of the others alone.
    let seen =
        |run: Vec<(Vec<u32>, Vec<u32>)>| run.into_iter().map(|(seen, _)| seen).collect::<Vec<_>>();
    assert_eq!(seen(run(3, &texts[..2])), seen(run(3, &texts)));
}

#[test]
fn noise_has_the_size_that_it_says() {
    const STEPS: u32 = 50_000;
    let mut link = disturbed(false, &["noise:0.5"]).unwrap();
    let (mut sum, mut squares) = (0.0, 0.0);
    for _ in 0..STEPS {
        let (seen, _) = step(&mut link, [2.0, 2.0]);
        let x = (f64::from(seen[0]) - 2.0) / 0.5;
        sum += x;
        squares += x * x;
    }
    // Five standard errors: 1/sqrt(n) for the mean, sqrt(2/n) for the variance.
    assert!((sum / f64::from(STEPS)).abs() < 0.023);
    assert!((squares / f64::from(STEPS) - 1.0).abs() < 0.032);
}

#[test]
fn actions_stay_within_their_range() {
    let mut link = disturbed(false, &["action:quantise:5"]).unwrap();
    let (_, told) = step(&mut link, [7.9, -7.4]);
    assert_eq!(bits(&told), bits(&[8.0, -5.0]));
    let mut link = disturbed(false, &["action:noise:100"]).unwrap();
    for _ in 0..100 {
        let (_, told) = step(&mut link, [0.0, 0.0]);
        assert!(told.iter().all(|v| v.abs() <= 8.0), "{told:?}");
    }
}

#[test]
fn index_of_an_action_takes_no_noise() {
    for text in ["action:noise:1", "action:quantise:1"] {
        let error = disturbed(true, &[text]).err().map(|e| e.to_string());
        assert!(error.is_some_and(|e| e.starts_with(text)));
    }
}
