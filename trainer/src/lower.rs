//! Turns a genome into the runtime's tables. Drops what cannot influence an action, renumbers the rest, and never executes it.
//!
//! Policies decide alike in all modes, bit for bit. [`Mode::Compact`] is what is scored and exported. [`Mode::Whole`] keeps
//! everything as evolved. [`Mode::Counting`] keeps what the thesis's counts of executed instructions and memory accesses need.

mod constants;
mod emit;
mod error;
mod liveness;
mod mode;
mod policy_spec;

pub use constants::{ConstantSite, Owner, constant_sites, with_constants};
pub use emit::lower;
pub use error::LowerError;
pub use mode::Mode;
pub use policy_spec::PolicySpec;

#[cfg(test)]
mod properties;

#[cfg(test)]
mod tests {
    use tpg_runtime::blob::{
        InitialValues, MemoryModel, RegisterMode, ResetScope, WriteDistribution,
    };
    use tpg_runtime::isa::Group;
    use tpg_runtime::{Action, HostAgent, Policy, Reset};

    use super::*;
    use crate::evolve::{
        ActionPrograms, Child, Genes, Initial, Population, Shape, TeamId, Variation, linear_team,
        select,
    };
    use tpg_tasks::task::{ActionSpace, Rng};

    pub struct Case {
        pub groups: &'static [Group],
        pub actions: ActionSpace,
        pub action_programs: ActionPrograms,
        pub mode: RegisterMode,
        pub memory: MemoryModel,
        pub constants: bool,
        pub history: u16,
    }

    const VECTORS: ActionSpace = ActionSpace::Continuous {
        len: 2,
        low: -1.0,
        high: 1.0,
    };
    const SCALAR: ActionSpace = ActionSpace::Continuous {
        len: 1,
        low: -2.0,
        high: 2.0,
    };

    pub fn cases() -> [Case; 7] {
        use Group::*;
        [
            Case {
                groups: &[
                    Scalar, Vector, Matrix, Constants, TeamMemory, WholeReads, Copies,
                ],
                actions: VECTORS,
                action_programs: ActionPrograms::Winner,
                mode: RegisterMode::Stateful,
                memory: MemoryModel::Team,
                constants: true,
                history: 1,
            },
            Case {
                groups: &[Scalar, Vector, Matrix],
                actions: SCALAR,
                action_programs: ActionPrograms::Winner,
                mode: RegisterMode::Stateless,
                memory: MemoryModel::None,
                constants: false,
                history: 1,
            },
            Case {
                groups: &[Scalar, Vector, TeamMemory],
                actions: ActionSpace::Discrete(4),
                action_programs: ActionPrograms::Winner,
                mode: RegisterMode::Stateful,
                memory: MemoryModel::Team,
                constants: true,
                history: 1,
            },
            Case {
                groups: &[Classic],
                actions: SCALAR,
                action_programs: ActionPrograms::Winner,
                mode: RegisterMode::Stateful,
                memory: MemoryModel::Indexed,
                constants: false,
                history: 1,
            },
            Case {
                groups: &[Scalar, Vector, TeamMemory],
                actions: VECTORS,
                action_programs: ActionPrograms::Each,
                mode: RegisterMode::Stateful,
                memory: MemoryModel::Team,
                constants: true,
                history: 1,
            },
            Case {
                groups: &[Scalar, Vector, Matrix],
                actions: SCALAR,
                action_programs: ActionPrograms::Winner,
                mode: RegisterMode::Stateless,
                memory: MemoryModel::None,
                constants: false,
                history: 3,
            },
            Case {
                groups: &[Scalar, Vector, Constants, TeamMemory],
                actions: ActionSpace::Discrete(4),
                action_programs: ActionPrograms::Winner,
                mode: RegisterMode::Stateful,
                memory: MemoryModel::Team,
                constants: true,
                history: 2,
            },
        ]
    }

    pub fn genes(case: &Case) -> Genes {
        Genes {
            shape: Shape {
                width: 3,
                inputs: 3,
                history: case.history,
                actions: case.actions,
                action_programs: case.action_programs,
            },
            ops: Genes::ops_of(case.groups),
            constants: case.constants,
            register_mode: case.mode,
            team_memory: case.memory == MemoryModel::Team,
            reset_rules: false,
            copies: 0.0,
        }
    }

    pub fn policy_spec(case: &Case, shape: Shape) -> PolicySpec {
        let labels = usize::from(shape.inputs)
            + match shape.actions {
                ActionSpace::Discrete(_) => 0,
                ActionSpace::Continuous { len, .. } => usize::from(len),
            };
        let stateful = case.mode == RegisterMode::Stateful;
        PolicySpec {
            task: "none-v0".into(),
            observability: "none".into(),
            labels: "x\t1\n".repeat(labels),
            ranges: Vec::new(),
            shape,
            control_period_us: 8000,
            register_mode: case.mode,
            initial_values: if case.constants {
                InitialValues::Evolved
            } else {
                InitialValues::Zero
            },
            reset_scope: if stateful {
                ResetScope::PerEpisode
            } else {
                ResetScope::EveryDecision
            },
            memory_model: case.memory,
            write_distribution: WriteDistribution::Thesis,
            front_end: None,
        }
    }

    /// Actions of two episodes as bits, with the teams visited in all.
    fn decisions(bytes: &[u8], observations: &[[f32; 3]]) -> (Vec<u32>, u32, u64) {
        let policy = Policy::load(bytes).expect("a lowered policy verifies");
        let bound = policy.bounds().instructions;
        let mut agent = Box::new(HostAgent::new(policy).expect("it fits a host"));
        let (mut bits, mut teams, mut instructions) = (Vec::new(), 0, 0);
        for (k, reset) in [Reset::Agent, Reset::Episode].into_iter().enumerate() {
            agent.reset(reset, k as u64);
            for observation in observations {
                let decision = agent.decide(observation).expect("the right length");
                assert!(decision.instructions <= bound);
                teams += u32::from(decision.teams);
                instructions += u64::from(decision.instructions);
                match decision.action {
                    Action::Discrete(action) => bits.push(u32::from(action)),
                    Action::Continuous(values) => bits.extend(values.iter().map(|x| x.to_bits())),
                }
            }
        }
        (bits, teams, instructions)
    }

    /// What a comparison of both modes came across.
    #[derive(Default)]
    struct Coverage {
        /// Most teams per decision.
        depth: u32,
        /// Instructions executed as evolved, and compacted.
        instructions: [u64; 2],
    }

    /// Evolves graphs from a seed and compares what both modes decide, over two episodes of each root.
    fn assert_modes_agree(case: &Case, seed: u64, generations: u32) -> Coverage {
        let mut rng = Rng::new(seed);
        let observations: Vec<[f32; 3]> = (0..20)
            .map(|k| match k % 4 {
                0 => [0.0; 3],
                _ => [(); 3].map(|()| rng.normal() as f32),
            })
            .collect();
        let genes = genes(case);
        let shape = genes.shape;
        let params = crate::evolve::tests::params();
        let policy_spec = policy_spec(case, shape);
        let mut population = Population::random(&genes, &params, &mut rng);
        let mut scores: Vec<(TeamId, f64)> = population.roots.iter().map(|r| (*r, 0.0)).collect();
        for _ in 0..generations {
            let variation = Variation {
                genes: &genes,
                params: &params,
                scores: &scores,
            };
            for Child { team: child, .. } in variation.children(&mut population, &mut rng) {
                // Larger graphs score higher, so that there is something to compare.
                let size = population.reachable(child).len() as f64;
                scores.push((child, size + rng.uniform(0.0, 1.0)));
            }
            select(
                &mut population,
                &mut scores,
                params.population as usize,
                params.ties,
                &[],
            );
        }
        let mut coverage = Coverage::default();
        for root in &population.roots {
            let modes = [Mode::Whole, Mode::Counting, Mode::Compact];
            let [whole, counting, compact] = modes.map(|mode| {
                lower(&population, *root, &policy_spec, [0; 16], None, mode).expect("small enough")
            });
            let (evolved, teams, more) = decisions(&whole, &observations);
            let (exported, _, fewer) = decisions(&compact, &observations);
            assert_eq!(evolved, exported, "{root:?}");
            let counted = decisions(&counting, &observations);
            assert_eq!(counted, (evolved, teams, more), "{root:?}");
            coverage.depth = coverage.depth.max(teams / observations.len() as u32 / 2);
            coverage.instructions[0] += more;
            coverage.instructions[1] += fewer;
        }
        coverage
    }

    #[test]
    fn compaction_meets_deep_graphs_and_drops_much() {
        for case in cases() {
            let Coverage {
                depth,
                instructions: [evolved, exported],
            } = assert_modes_agree(&case, 1, 25);
            let deep = depth >= 2 || case.action_programs == ActionPrograms::Each;
            assert!(deep, "no decision went through several teams");
            assert!(exported < evolved, "compaction dropped nothing");
        }
    }

    proptest::proptest! {
        #![proptest_config(proptest::test_runner::Config { cases: 24, failure_persistence: None, ..Default::default() })]

        #[test]
        fn both_modes_decide_alike_over_random_graphs(seed: u64, case in 0usize..7, generations in 0u32..12) {
            assert_modes_agree(&cases()[case], seed, generations);
        }
    }

    /// A linear policy of Ant-v5's size, 105 inputs and 8 outputs: every input moves every output, by its gains in all windows
    /// that see it.
    #[test]
    fn a_linear_policy_sees_more_inputs_than_a_vector_has() {
        let (inputs, outputs) = (105, 8);
        let case = Case {
            groups: &[Group::Scalar, Group::Vector, Group::Matrix],
            actions: ActionSpace::Continuous {
                len: outputs,
                low: -1000.0,
                high: 1000.0,
            },
            action_programs: ActionPrograms::Winner,
            mode: RegisterMode::Stateless,
            memory: MemoryModel::None,
            constants: true,
            history: 1,
        };
        let shape = Shape {
            width: 32,
            inputs,
            history: case.history,
            actions: case.actions,
            action_programs: case.action_programs,
        };
        let genes = Genes {
            shape,
            ops: Genes::ops_of(case.groups),
            constants: true,
            register_mode: case.mode,
            team_memory: false,
            reset_rules: false,
            copies: 0.0,
        };
        let mut rng = Rng::new(1);
        let mut population = Population::default();
        let root = linear_team(&mut population, &genes, Initial::Linear, &mut rng);
        let spec = policy_spec(&case, shape);
        let zeros = lower(&population, root, &spec, [0; 16], None, Mode::Compact);
        let zeros = zeros.expect("small enough");
        let sites = constant_sites(&population, root, &spec);
        // The gain of a site tells its place: small whole numbers, whose sums are exact.
        let gains: Vec<f32> = (0..sites.len()).map(|k| (k % 251) as f32 + 1.0).collect();
        let blob = with_constants(&zeros, &gains).expect("as many");
        let policy = Policy::load(&blob).expect("valid");
        assert_eq!(
            policy.header().window,
            inputs,
            "no window runs over the end"
        );
        let mut agent = Box::new(HostAgent::new(policy).expect("it fits a host"));
        let mut act = |observation: &[f32]| -> Vec<f32> {
            agent.reset(Reset::Agent, 0);
            match agent.decide(observation).expect("the right length").action {
                Action::Continuous(values) => values.to_vec(),
                Action::Discrete(_) => panic!("continuous"),
            }
        };
        let mut observation = vec![0.0; usize::from(inputs)];
        let offsets = act(&observation);
        for input in 0..usize::from(inputs) {
            observation[input] = 1.0;
            let changed = act(&observation);
            observation[input] = 0.0;
            let moved = changed.iter().zip(&offsets).map(|(x, zero)| x - zero);
            let moved: Vec<f32> = moved.collect();
            assert!(moved.iter().all(|x| *x >= 1.0), "{input}: {moved:?}");
        }
    }
}
