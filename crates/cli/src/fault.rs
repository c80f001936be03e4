//! Faults on purpose: `--fault KIND@WHERE:PARAMETER`.
//!
//! | fault | what happens |
//! |---|---|
//! | `killed@record:N` | the process is gone when it is to take its N-th record of the run, counted from 1 |
//! | `killed@journal:N` | the same, counting only the records that tell of presses and of the run, not those of streams and motions |
//! | `killed@seal` | the process is gone when the run has ended and its session is to be sealed |
//!
//! Gone means at once and without a word, as by `kill -9` or a power cut: no thread goes on, nothing is closed.

use std::str::FromStr;

use skinrig_model::Record;

/// A fault to be made.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The process is gone.
    Killed(Moment),
}

/// When the process is gone.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Moment {
    /// Before its n-th record, from 1.
    Record(u64),
    /// Before its n-th record of the journal, from 1.
    Journal(u64),
    /// Before the session is sealed.
    Seal,
}

impl FromStr for Fault {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("expected killed@record:N, killed@journal:N or killed@seal, found {text}");
        let place = text.strip_prefix("killed@").ok_or_else(wrong)?;
        let (place, parameter) = match place.split_once(':') {
            Some((place, parameter)) => (place, Some(parameter)),
            None => (place, None),
        };
        let number = || {
            let n = parameter.and_then(|p| p.parse().ok());
            n.filter(|n| *n > 0).ok_or_else(wrong)
        };
        match place {
            "record" => Ok(Self::Killed(Moment::Record(number()?))),
            "journal" => Ok(Self::Killed(Moment::Journal(number()?))),
            "seal" if parameter.is_none() => Ok(Self::Killed(Moment::Seal)),
            _ => Err(wrong()),
        }
    }
}

/// Counts the records of a run and makes its faults.
#[derive(Debug, Clone)]
pub struct Saboteur {
    faults: Vec<Fault>,
    records: u64,
    journal: u64,
}

impl Saboteur {
    /// Makes none.
    #[must_use]
    pub const fn none() -> Self {
        Self {
            faults: Vec::new(),
            records: 0,
            journal: 0,
        }
    }

    /// Makes these faults.
    #[must_use]
    pub fn new(faults: &[Fault]) -> Self {
        Self {
            faults: faults.to_vec(),
            ..Self::none()
        }
    }

    /// The next record is about to be taken.
    pub fn before(&mut self, record: &Record) {
        self.records += 1;
        let streams = matches!(
            record,
            Record::Command { .. }
                | Record::Poses(_)
                | Record::Chunk(_)
                | Record::MarkSent(_)
                | Record::BoxReports { .. }
        );
        self.journal += u64::from(!streams);
        let due = self.faults.iter().any(|fault| match *fault {
            Fault::Killed(Moment::Record(n)) => n == self.records,
            Fault::Killed(Moment::Journal(n)) => !streams && n == self.journal,
            Fault::Killed(Moment::Seal) => false,
        });
        if due {
            gone();
        }
    }

    /// The session is about to be sealed.
    pub fn before_the_seal(&self) {
        if self.faults.contains(&Fault::Killed(Moment::Seal)) {
            gone();
        }
    }
}

/// Ends the process without unwinding.
fn gone() -> ! {
    std::process::abort()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn faults_are_read_or_refused() {
        let killed = |moment| Ok(Fault::Killed(moment));
        assert_eq!("killed@record:7".parse(), killed(Moment::Record(7)));
        assert_eq!("killed@journal:1".parse(), killed(Moment::Journal(1)));
        assert_eq!("killed@seal".parse(), killed(Moment::Seal));
        for wrong in [
            "",
            "killed",
            "killed@record",
            "killed@record:0",
            "killed@record:x",
            "killed@seal:1",
            "asleep@record:1",
        ] {
            let refused = wrong.parse::<Fault>().unwrap_err();
            assert!(refused.contains("expected killed@record:N"), "{refused}");
        }
    }
}
