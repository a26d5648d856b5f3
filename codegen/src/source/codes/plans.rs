//! Codes of the plans of sweeps, and of the goals of optimisations.

codes! {
    BAD_PLAN "bad-plan"
        "The plan of a sweep varies nothing or too much, has a number that is impossible there, or asks for what its \
         task does not have."
        "Correct it as the message says. [SCHEMA.md](SCHEMA.md#the-plan-of-a-sweep) lists the keys of a plan.";
    BAD_GOALS "bad-goals"
        "The goals of an optimisation vary nothing, aim at nothing, have a range that is empty or in which the drawing is \
         not possible, or ask for what the mechanism does not have."
        "Correct it as the message says. [SCHEMA.md](SCHEMA.md#the-goals-of-an-optimisation) lists the keys of such a file.";
}
