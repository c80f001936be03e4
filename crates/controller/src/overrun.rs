//! How much deeper than it was felt a press comes to rest, learnt from the presses that braked before it.

/// Newest presses that count, per speed: fewer follow a change sooner, more scatter less.
const NEWEST: usize = 5;

/// A press that braked.
#[derive(Debug, Clone, Copy)]
struct Braked {
    speed_mm_s: f64,
    overrun_mm: f64,
}

/// What the presses of a run tell, in their order.
#[derive(Debug, Default)]
pub(crate) struct Overruns(Vec<Braked>);

impl Overruns {
    /// A press at this speed was felt to have reached `felt_mm` when it was told to brake, and rests at `rests_mm`.
    pub(crate) fn learn(&mut self, speed_mm_s: f64, felt_mm: f64, rests_mm: f64) {
        let overrun_mm = rests_mm - felt_mm;
        if overrun_mm.is_finite() {
            self.0.push(Braked {
                speed_mm_s,
                overrun_mm,
            });
        }
    }

    /// The overrun that the next press at this speed is to allow for, mm: the median of the newest ones, never negative (a press does
    /// not go deeper than it is felt to be because an earlier one was felt too deep), 0 without any.
    pub(crate) fn expected_mm(&self, speed_mm_s: f64) -> f64 {
        let of_speed = self.0.iter().rev().filter(|b| b.speed_mm_s == speed_mm_s);
        let mut newest: Vec<f64> = of_speed.take(NEWEST).map(|b| b.overrun_mm).collect();
        newest.sort_by(f64::total_cmp);
        let median = match newest.len() {
            0 => return 0.0,
            n => (newest[(n - 1) / 2] + newest[n / 2]) / 2.0,
        };
        median.max(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_newest_presses_of_the_same_speed_tell() {
        let mut overruns = Overruns::default();
        assert_eq!(overruns.expected_mm(20.0), 0.0);
        overruns.learn(5.0, 1.0, 3.0);
        overruns.learn(20.0, 1.0, f64::NAN);
        assert_eq!(overruns.expected_mm(20.0), 0.0);
        overruns.learn(20.0, 1.0, 1.5);
        overruns.learn(20.0, 1.0, 1.7);
        assert!((overruns.expected_mm(20.0) - 0.6).abs() < 1e-9);
        for _ in 0..3 {
            overruns.learn(20.0, 1.0, 1.25);
        }
        assert_eq!(overruns.expected_mm(20.0), 0.25);
        assert_eq!(overruns.expected_mm(5.0), 2.0);
    }

    #[test]
    fn a_press_is_never_sent_deeper_than_it_is_felt() {
        let mut overruns = Overruns::default();
        overruns.learn(20.0, 1.4, 1.0);
        assert_eq!(overruns.expected_mm(20.0), 0.0);
    }
}
