//! A corridor between a cue and a choice.

use super::{PERIOD_US, chosen, index, number, step};
use crate::task::{ActionSpace, Rng, Spec, Step, Task};
use tpg_runtime::Action;

/// The longest corridor, and the most steps between a cue and a question.
pub const LONGEST: u32 = 100_000;

/// A corridor that ends in a junction, up or down. The way to go is shown once, at its start: the passive T-maze of Ni et al. (NeurIPS
/// 2023).
///
/// The actions are right, up, left and down; a step into a wall stays. Of length + 1 steps the last one earns 1 if the agent then
/// stands in the goal. Each other one costs 1 / length if the agent has fallen behind one that always went right. So the best
/// return is 1, and 0.5 without memory.
///
/// The observation is whether the agent is at the junction or beyond, and the goal as −1 (down) or 1 (up). The second element is 0
/// after the first observation; from the junction on it says whether the agent went up or down. In the noisy maze, which is ours,
/// it is −1 or 1 at random everywhere between.
#[derive(Debug, Clone)]
pub struct TMaze {
    spec: Spec,
    length: u32,
    noise: Noise,
    x: u32,
    y: i8,
    goal: i8,
    time: u32,
}

/// What the goal's element shows in the corridor.
#[derive(Debug, Clone)]
enum Noise {
    Silent,
    /// What it shows now, and the stream of what comes.
    Signs(i8, Rng),
}

impl TMaze {
    /// Makes the maze with a corridor of 1 to 100 000 steps. Other lengths count as the nearest.
    #[must_use]
    pub fn new(length: u32) -> Self {
        TMaze::of("tmaze", length, Noise::Silent)
    }

    /// Makes the noisy maze, of the same lengths.
    #[must_use]
    pub fn noisy(length: u32) -> Self {
        TMaze::of("noisy-tmaze", length, Noise::Signs(0, Rng::new(0)))
    }

    fn of(name: &str, length: u32, noise: Noise) -> Self {
        let length = length.clamp(1, LONGEST);
        TMaze {
            spec: Spec {
                name: format!("{name}:{length}-v1"),
                inputs: vec![number("junction"), number("goal")],
                outputs: vec![index("direction")],
                actions: ActionSpace::Discrete(4),
                max_steps: length + 1,
                period_us: PERIOD_US,
            },
            length,
            noise,
            x: 0,
            y: 0,
            goal: 1,
            time: 0,
        }
    }
}

/// A random sign, by one word.
fn sign(rng: &mut Rng) -> i8 {
    if rng.chance(0.5) { 1 } else { -1 }
}

impl Task for TMaze {
    fn spec(&self) -> &Spec {
        &self.spec
    }

    fn twin(&self) -> Option<Box<dyn Task>> {
        Some(Box::new(self.clone()))
    }

    fn reset(&mut self, rng: &mut Rng) {
        self.goal = sign(rng);
        (self.x, self.y, self.time) = (0, 0, 0);
        if let Noise::Signs(now, stream) = &mut self.noise {
            (*now, *stream) = (0, Rng::new(rng.word()));
        }
    }

    fn observe(&self, observation: &mut [f32]) {
        let at_junction = self.x == self.length;
        let second = match &self.noise {
            _ if at_junction => self.y,
            _ if self.time == 0 => self.goal,
            Noise::Silent => 0,
            Noise::Signs(now, _) => *now,
        };
        let values = [i8::from(at_junction), second];
        for (out, value) in observation.iter_mut().zip(values) {
            *out = f32::from(value);
        }
    }

    fn step(&mut self, action: Action<'_>) -> Step {
        self.time += 1;
        let at_junction = self.x == self.length;
        match chosen(action) {
            0 if self.y == 0 && !at_junction => self.x += 1,
            1 if at_junction && self.y < 1 => self.y += 1,
            2 if self.y == 0 && self.x > 0 => self.x -= 1,
            3 if at_junction && self.y > -1 => self.y -= 1,
            _ => {}
        }
        if let Noise::Signs(now, stream) = &mut self.noise {
            *now = sign(stream);
        }
        if self.time > self.length {
            return step(f64::from(u8::from(self.y == self.goal)), true);
        }
        let behind = self.x < self.time;
        step(
            if behind {
                -1.0 / f64::from(self.length)
            } else {
                0.0
            },
            false,
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs an episode: what was observed, and the sum of the rewards.
    fn episode(task: &mut TMaze, seed: u64, act: impl Fn(u32, i8) -> u16) -> (Vec<[i8; 2]>, f64) {
        task.reset(&mut Rng::new(seed));
        let (mut seen, mut total) = (Vec::new(), 0.0);
        for time in 0.. {
            let mut observation = [0.0f32; 2];
            task.observe(&mut observation);
            seen.push(observation.map(|x| x as i8));
            let step = task.step(Action::Discrete(act(time, task.goal)));
            total += step.reward;
            if step.terminated {
                assert_eq!(time, task.length);
                break;
            }
        }
        (seen, total)
    }

    #[test]
    fn right_along_the_corridor_and_then_to_the_goal_earns_1() {
        let mut task = TMaze::new(5);
        let mut goals = [0, 0];
        for seed in 0..100 {
            let best = |time, goal| match (time, goal) {
                (0..5, _) => 0,
                (_, 1) => 1,
                _ => 3,
            };
            let (seen, total) = episode(&mut task, seed, best);
            assert!((total - 1.0).abs() < 1e-12, "{total}");
            goals[usize::from(task.goal > 0)] += 1;
            let cue = [0, task.goal];
            assert_eq!(seen, [cue, [0, 0], [0, 0], [0, 0], [0, 0], [1, 0]]);
            let (_, wrong) = episode(&mut task, seed, |time, goal| best(time, -goal));
            assert!(wrong.abs() < 1e-12, "{wrong}");
        }
        assert!(goals.iter().all(|n| *n > 30), "{goals:?}");
    }

    /// Standing still costs 1/5 in each of five steps. The sixth is the last, which costs nothing.
    #[test]
    fn who_falls_behind_pays_in_every_step() {
        let mut task = TMaze::new(5);
        let (seen, total) = episode(&mut task, 3, |_, _| 2);
        assert!((total + 1.0).abs() < 1e-12, "{total}");
        assert_eq!(seen[1..], [[0, 0]; 5], "the cue is shown once");
        // Left once and back: two steps behind from the second step on, so four steps cost.
        let (_, total) = episode(&mut task, 3, |time, _| if time == 1 { 2 } else { 0 });
        assert!((total + 0.8).abs() < 1e-12, "{total}");
    }

    #[test]
    fn walls_hold_and_the_junction_has_two_arms() {
        let mut task = TMaze::new(1);
        task.reset(&mut Rng::new(1));
        let mut go = |direction| {
            task.step(Action::Discrete(direction));
            (task.x, task.y)
        };
        let way = [1, 3, 2, 0, 0, 1, 1, 0, 2, 3, 3, 3, 1, 2].map(&mut go);
        let at_start = [(0, 0); 3];
        assert_eq!(way[..3], at_start);
        assert_eq!(way[3..9], [(1, 0), (1, 0), (1, 1), (1, 1), (1, 1), (1, 1)]);
        assert_eq!(way[9..], [(1, 0), (1, -1), (1, -1), (1, 0), (0, 0)]);
    }

    #[test]
    fn noise_is_a_coin_in_the_corridor_alone() {
        let mut task = TMaze::noisy(1000);
        let (seen, _) = episode(&mut task, 9, |_, _| 0);
        assert_eq!(seen[0], [0, task.goal]);
        assert_eq!(seen[1000], [1, 0]);
        let up = seen[1..1000].iter().filter(|o| **o == [0, 1]).count();
        let down = seen[1..1000].iter().filter(|o| **o == [0, -1]).count();
        assert_eq!(up + down, 999);
        assert!((400..600).contains(&up), "{up}");
    }
}
