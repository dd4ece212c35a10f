//! What the thesis reports, for comparison.

/// T Tab 3.3: best training fitness of 10 runs, by robot and variant.
const TABLE_3_3: [(&str, [(&str, f64); 4]); 3] = [
    (
        "inverted-double-pendulum",
        [
            ("sl-nc", 1630.16),
            ("sl", 9349.37),
            ("sr", 9349.92),
            ("sr-sm", 9350.03),
        ],
    ),
    (
        "hopper",
        [
            ("sl-nc", 1619.82),
            ("sl", 2017.00),
            ("sr", 2165.23),
            ("sr-sm", 3078.25),
        ],
    ),
    (
        "half-cheetah",
        [
            ("sl-nc", 1.58),
            ("sl", 608.98),
            ("sr", 376.77),
            ("sr-sm", 725.97),
        ],
    ),
];

/// The thesis's best training fitness of 10 runs, for a variant under blackouts: it has no others.
///
/// It ran its robots with one step of physics in a control step, as far as can be told (docs/training.md), so tasks with
/// Gymnasium's control periods have none.
pub(super) fn best_fitness(task: &str, variant: &str) -> Option<f64> {
    let task = task.strip_suffix("-skip1")?;
    let variant = ["-b23", "-b13"]
        .iter()
        .find_map(|end| variant.strip_suffix(end))?;
    let (_, variants) = TABLE_3_3.iter().find(|(name, _)| *name == task)?;
    let (_, fitness) = variants.iter().find(|(name, _)| *name == variant)?;
    Some(*fitness)
}

#[cfg(test)]
mod tests {
    use super::best_fitness;

    #[test]
    fn only_what_the_thesis_measured_has_a_number() {
        let whole = |task, variant| best_fitness(task, variant).map(|x| x as u32);
        assert_eq!(whole("hopper-skip1", "sr-sm-b23"), Some(3078));
        assert_eq!(whole("hopper-skip1", "sl-nc-b13"), Some(1619));
        assert_eq!(whole("hopper-skip1", "sr-sm"), None);
        assert_eq!(whole("hopper", "sr-sm-b23"), None, "another period");
        assert_eq!(whole("hopper-skip1", "sr-mm-b23"), None);
        assert_eq!(whole("cartpole", "sr-b23"), None);
    }
}
