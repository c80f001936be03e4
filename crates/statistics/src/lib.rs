//! Statistics of skins: intervals, tests, verdicts and sample sizes, with locations as clusters; distributions, seeded draws.
//!
//! Presses at one location share an error and are not independent, so everything here resamples or counts whole locations.
//! `docs/explanation/comparison.md` explains which interval and test serves which kind of metric, and how they perform on
//! simulated skins.
//!
//! A [`Sample`] holds the data of one prototype for one metric. [`estimate`] gives its value, [`compare`] the difference
//! between two samples, [`compare_all`] the corrected differences between several, and [`power::plan`] the presses needed to
//! detect a given difference.
//!
//! # Sources
//!
//! Barker 2002, Am. Stat. 56:85. Berger 1982, Technometrics 24:295. Cochran 1977, Sampling Techniques, 3rd ed. Davison and
//! Hinkley 1997, Bootstrap Methods and their Application. Deville 1999, Survey Methodology 25:193. Efron 1981, Can. J. Stat.
//! 9:139. Hall 1988, Ann. Stat. 16:927. Hall and Sheather 1988, J. R. Stat. Soc. B 50:381. Hampel 1974, J. Am. Stat. Assoc.
//! 69:383. Holm 1979, Scand. J. Stat. 6:65. Hurlbert 1984, Ecol. Monogr. 54:187. Hyndman and Fan 1996, Am. Stat. 50:361. Korn
//! and Graubard 1998, Survey Methodology 24:193. Newcombe 1998a, Stat. Med. 17:857; 1998b, 17:873; 1998c, 17:2635. Rao and
//! Scott 1992, Biometrics 48:577. Schuirmann 1987, J. Pharmacokinet. Biopharm. 15:657. Searle, Casella and McCulloch 1992,
//! Variance Components. Tukey 1958, Ann. Math. Stat. 29:614. Welch 1947, Biometrika 34:28. Wilson 1927, J. Am. Stat. Assoc.
//! 22:209. Woodruff 1952, J. Am. Stat. Assoc. 47:635. Zou and Donner 2008, Stat. Med. 27:1693.

mod bootstrap;
mod compare;
mod comparison;
mod components;
pub mod distributions;
mod error;
mod failures;
mod family;
mod inference;
mod influence;
mod measure;
mod mover;
mod notes;
mod percentile;
pub mod power;
mod presses_needed;
mod quantiles;
mod question;
mod sample;
mod scores;
pub mod seeded;
mod sessions;
mod spending;
mod spread;
mod stopping;

pub use compare::{compare, estimate};
pub use comparison::{
    Comparison, Components, Design, Interval, Note, PressesNeeded, RequiredDesign, Tost, Verdict,
};
pub use error::{ComparisonError, Side};
pub use failures::rms_with_failures;
pub use family::{AdjustedComparison, Pair, PairSelection, compare_all, holm};
pub use question::{ComparisonTarget, ImprovementDirection, Pairing, Settings};
pub use sample::{Count, Kind, Position, Sample, SampleFault};
pub use sessions::SessionSpread;
pub use spending::{AlphaSpending, MOST_LOOKS, Outlook};
pub use stopping::{LookEstimate, StoppingRule, stop_sample};
