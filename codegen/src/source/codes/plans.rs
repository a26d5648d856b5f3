//! Codes of the plans of sweeps.

codes! {
    BAD_PLAN "bad-plan"
        "The plan of a sweep varies nothing or too much, has a number that is impossible there, or asks for what its \
         task does not have."
        "Correct it as the message says. [SCHEMA.md](SCHEMA.md#the-plan-of-a-sweep) lists the keys of a plan.";
}
