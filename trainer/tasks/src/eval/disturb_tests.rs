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
    let channel = |name: &str| Channel {
        name: name.into(),
        unit: "m".into(),
        velocity: false,
        range: None,
    };
    let channels = ["x", "y"].map(channel);
    let link = Link {
        inputs: &channels,
        outputs: &channels[..if discrete { 1 } else { 2 }],
        actions,
        period_us: 100_000,
    };
    let mut disturbed = Disturbed::new(echo, &list, &link)?;
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
fn lost_observations_are_missing_and_lost_actions_repeat_the_last() {
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
            let wanted = if expected { MISSING } else { 1.0 };
            assert_eq!(bits(&seen), bits(&[wanted; 2]));
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
}

#[test]
fn what_is_missing_stays_missing() {
    let after = [
        "noise:0.1",
        "quantise:0.5",
        "noise:1:2",
        "bias:x:3",
        "stuck:y",
        "drop:0:1/1",
    ];
    for before in ["loss:1/1", "delay:1"] {
        for text in after {
            let (seen, _) = step(&mut disturbed(false, &[before, text]).unwrap(), [3.3, 3.3]);
            assert_eq!(bits(&seen), bits(&[MISSING; 2]), "{before} {text}");
        }
    }
}

/// The values of the first channel that are seen, of observations that count the steps from 1.
fn seen_of(texts: &[&str], steps: u16) -> Vec<f32> {
    let mut link = disturbed(false, texts).unwrap();
    (1..=steps)
        .map(|k| step(&mut link, [f32::from(k), -1.0]).0[0])
        .collect()
}

#[test]
fn each_fault_disturbs_its_channel_alone() {
    assert_eq!(seen_of(&["stuck:x"], 4), [1.0; 4]);
    assert_eq!(seen_of(&["stuck:1"], 3), [1.0, 2.0, 3.0]);
    assert_eq!(seen_of(&["bias:0:-0.5"], 3), [0.5, 1.5, 2.5]);
    assert!(seen_of(&["nan:x:1/1"], 3).iter().all(|x| x.is_nan()));
    assert_eq!(seen_of(&["nan:x:0/1", "nan:y:1/1"], 3), [1.0, 2.0, 3.0]);
    // Nothing has arrived before a first value that is dropped.
    assert!(seen_of(&["drop:0:1/1"], 3).iter().all(|x| x.is_nan()));
    let dropped = seen_of(&["drop:0:1/2"], 200);
    let mut last = f32::NAN;
    let mut again = 0;
    for (k, x) in (1u16..).zip(&dropped) {
        if x.to_bits() == f32::from(k).to_bits() {
            last = *x;
        } else {
            assert_eq!(x.to_bits(), last.to_bits(), "step {k}");
            again += 1;
        }
    }
    assert!((70..130).contains(&again), "{again} of 200");
    let mut link = disturbed(false, &["noise:1:0.5"]).unwrap();
    let (seen, _) = step(&mut link, [3.3, 3.3]);
    assert_eq!(seen[0].to_bits(), 3.3f32.to_bits());
    assert_ne!(seen[1].to_bits(), 3.3f32.to_bits());
    // Actions have channels too.
    let mut link = disturbed(false, &["action:stuck:x", "action:bias:y:0.25"]).unwrap();
    let told: Vec<Vec<f32>> = [1.0, 2.0].map(|x| step(&mut link, [x, x]).1).into();
    assert_eq!(told, [[1.0, 1.25], [1.0, 2.25]]);
}

/// A step takes 0.1 s.
#[test]
fn a_script_says_when() {
    let script = ["at 0.2s stuck:x for 0.3s", "at 0.7s bias:x:100 for 0.1s"];
    let seen = [1.0, 2.0, 3.0, 3.0, 3.0, 6.0, 7.0, 108.0, 9.0];
    assert_eq!(seen_of(&script, 9), seen);
    let lost = seen_of(&["at 0.1s loss:1/1 for 0.2s"], 4);
    assert_eq!(
        lost.iter().map(|x| x.is_nan()).collect::<Vec<_>>(),
        [false, true, true, false]
    );
    // A missing value is not what sticks.
    let after_loss = seen_of(&["at 0s loss:1/1 for 0.2s", "stuck:x"], 5);
    assert!(after_loss[..2].iter().all(|x| x.is_nan()));
    assert_eq!(after_loss[2..], [3.0; 3]);
    // What happens elsewhere in time changes no random number.
    let whole = seen_of(&["noise:1"], 6);
    let part = seen_of(&["at 0.3s noise:1 for 1s"], 6);
    assert_eq!(bits(&part[3..]), bits(&whole[3..]));
    assert_eq!(part[..3], [1.0, 2.0, 3.0]);
}

#[test]
fn channels_that_do_not_exist_are_named() {
    for text in ["stuck:2", "nan:z:1/2", "action:bias:z:1"] {
        let error = disturbed(false, &[text]).err().map(|e| e.to_string());
        let expected = format!("{text} names no channel of this policy; there are 0 x, 1 y");
        assert_eq!(error, Some(expected));
    }
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
    for text in ["action:noise:1", "action:quantise:1", "action:stuck:0"] {
        let error = disturbed(true, &[text]).err().map(|e| e.to_string());
        assert!(error.is_some_and(|e| e.starts_with(text)));
    }
}
