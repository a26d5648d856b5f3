//! Whether a simulation makes progress.

/// Steps within which a motion must advance by a share of its duration.
const PATIENCE: usize = 1000;
/// That share.
const SHARE: f64 = 0.01;

/// More steps than any smooth motion takes.
const MOST_STEPS: f64 = 2e6;

/// The duration for which these are meant, s: a longer motion may take as many for each such part.
const USUAL: f64 = 2.0;

/// The pace of a simulation since it was last looked at.
pub struct Pace {
    /// s.
    duration: f64,
    steps: usize,
    /// s.
    t: f64,
}

impl Pace {
    /// The pace of a simulation of this duration, s, that is about to start.
    pub fn new(duration: f64) -> Self {
        Self { duration, steps: 0, t: 0.0 }
    }

    /// Looks at the pace from here on.
    pub fn restart(&mut self, steps: usize, t: f64) {
        (self.steps, self.t) = (steps, t);
    }

    /// Whether the explicit method hardly advances, as between the ranks of a singular state.
    pub fn is_slow(&mut self, steps: usize, t: f64) -> bool {
        if steps - self.steps < PATIENCE {
            return false;
        }
        let advanced = t - self.t;
        self.restart(steps, t);
        advanced < SHARE * self.duration.min(USUAL)
    }

    /// Whether the motion takes far more steps than a smooth one; the implicit method gives up as
    /// soon as it would at its present pace.
    pub fn is_hopeless(&mut self, steps: usize, t: f64, is_implicit: bool) -> bool {
        if !is_implicit || steps - self.steps < PATIENCE {
            return steps as f64 >= MOST_STEPS * (self.duration / USUAL).max(1.0);
        }
        let pace = (steps - self.steps) as f64 / (t - self.t);
        self.restart(steps, t);
        pace * self.duration.min(USUAL) > MOST_STEPS
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pace_is_judged_after_a_thousand_steps() {
        let mut pace = Pace::new(1.0);
        assert!(!pace.is_slow(999, 0.0));
        assert!(pace.is_slow(1000, 0.009));
        assert!(!pace.is_slow(2000, 0.02));
    }

    #[test]
    fn the_implicit_method_gives_up_early_and_the_explicit_one_after_all_steps() {
        let mut pace = Pace::new(1.0);
        assert!(pace.is_hopeless(1000, 4e-4, true));
        assert!(!pace.is_hopeless(2000, 2e-3, true));
        assert!(!Pace::new(1.0).is_hopeless(1_999_999, 0.5, false));
        assert!(Pace::new(1.0).is_hopeless(2_000_000, 0.5, false));
        assert!(!Pace::new(4.0).is_hopeless(2_000_000, 0.5, false));
    }
}
