//! Means, RMSE and variance of ten million values, and of a thousand million on request.

use skinrig_analysis::sums::{mean, root_mean_square, sum, variance};

use crate::numerics::bounds::{self, UNIT, Watch};
use crate::numerics::precise::{self, Real, real};

/// `centre + step * ((i * 7) mod 11 - 5)`, rounded to doubles: eleven equally frequent values.
#[derive(Clone, Copy)]
struct Sequence {
    centre: f64,
    step: f64,
    n: u64,
}

impl Sequence {
    fn value(self, i: u64) -> f64 {
        self.centre + self.step * (((i % 11) * 7 % 11) as f64 - 5.0)
    }

    fn values(self) -> impl Iterator<Item = f64> + Clone {
        (0..self.n).map(move |i| self.value(i))
    }

    /// Exact sum of `f` over all values, to 70 digits: whole periods of eleven plus the rest.
    fn exact(self, f: impl Fn(Real) -> Real) -> Real {
        (0..11).fold(real(0.0), |sum, k| {
            let times = self.n / 11 + u64::from(k < self.n % 11);
            sum + f(real(self.value(k))) * real(times as f64)
        })
    }
}

fn hold(n: u64) {
    let watch = [
        Watch::new(&bounds::SUM),
        Watch::new(&bounds::RMS),
        Watch::new(&bounds::VARIANCE),
    ];
    for (centre, step) in [
        (0.1, 0.0),
        (4.26, 0.7),
        (1e6 + 0.3, 1e-3),
        (1e-9, 1e-10),
        (-3.0, 1e4),
    ] {
        let s = Sequence { centre, step, n };
        let at = format!("{n} values about {centre}, steps of {step}");
        let count = real(n as f64);
        let exact_sum = s.exact(|x| x);
        let size = precise::near(&s.exact(|x| if x < real(0.0) { -x } else { x }));
        watch[0].record(
            precise::error(sum(s.values()), &exact_sum) / size / UNIT,
            &at,
        );
        let exact_rms = (s.exact(|x| &x * &x) / &count).sqrt();
        let rms = root_mean_square(s.values()).unwrap();
        watch[1].record(
            precise::error(rms, &exact_rms) / precise::near(&exact_rms) / UNIT,
            &at,
        );
        let centre = exact_sum / &count;
        let exact = s.exact(|x| (&x - &centre) * (&x - &centre)) / &count;
        let found = variance(s.values()).unwrap();
        if step == 0.0 {
            // Equal values have no spread except the error of their mean.
            let (mean, rounding) = (mean(s.values()).unwrap(), 4.0 * UNIT * 0.1);
            assert!(
                (mean - 0.1).abs() <= rounding && found <= rounding * rounding,
                "{at}"
            );
        } else {
            watch[2].record(
                precise::error(found, &exact) / precise::near(&exact) / UNIT,
                &at,
            );
        }
    }
}

#[test]
fn ten_million_values() {
    hold(10_000_003);
}

#[test]
#[ignore = "a minute or two: cargo test --release -p skinrig-tests -- --ignored thousand_million"]
fn a_thousand_million_values() {
    hold(1_000_000_007);
}
