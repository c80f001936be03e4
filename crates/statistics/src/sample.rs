//! Owns [`Sample`]: the data of one prototype for one metric, by location.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use skinrig_model::LocationId;

/// How values of presses become one number.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Kind {
    /// Mean over presses: bias, event rate, bytes per second.
    Mean,
    /// Root mean square over presses: RMSE, along x, along y.
    Rms,
    /// Area / (pi RMSE²): effective taxels.
    Taxels,
    /// Mean over series of the standard deviation between their repetitions.
    RepeatStd,
    /// Share of trials that succeeded: located rate, pass rate.
    Share,
    /// Median of times; a miss is later than every time.
    Median,
    /// 95th percentile; a miss is later than every time.
    Percentile95,
    /// 95th minus 5th percentile of times; a miss is later than every time.
    Width,
    /// Counts per unit of exposure: false alarms per second.
    CountRate,
}

/// Estimated position of one press, skin frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// Presses at one location with the same series (for example the same depth) are repetitions.
    pub series: u32,
    /// Along x, mm.
    pub x_mm: f64,
    /// Along y, mm.
    pub y_mm: f64,
}

/// Events counted during an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Count {
    /// Number of events.
    pub events: u32,
    /// Duration in s, or any other unit of exposure common to all samples.
    pub exposure: f64,
}

/// Values that cannot form a sample.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SampleFault {
    /// A value is NaN or infinite.
    #[error("expected finite values, found {found} at {location}")]
    NotFinite {
        /// Location of the value.
        location: LocationId,
        /// The value.
        found: f64,
    },
    /// An exposure is not positive.
    #[error("expected exposures above 0, found {found} at {location}")]
    Exposure {
        /// Location of the exposure.
        location: LocationId,
        /// The exposure.
        found: f64,
    },
    /// The area is not positive.
    #[error("expected an area above 0 mm², found {0}")]
    Area(f64),
}

/// Values of presses by location. Location numbers are common to all samples of a comparison. The order of presses and
/// locations does not matter.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    data: Data,
    /// The same values by session; empty if they are not told apart.
    sessions: Vec<Data>,
}

/// Values by location, sorted within each location so that input order does not matter.
pub(super) type Clusters<T> = BTreeMap<u32, Vec<T>>;

/// Values of a sample, by kind.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Data {
    Mean(Clusters<f64>),
    Rms(Clusters<f64>),
    Taxels(f64, Clusters<f64>),
    RepeatStd(Clusters<Position>),
    /// Outcomes of trials, each of which was repeated so often on the same data.
    Share(u32, Clusters<bool>),
    /// Quantile of this rank.
    Quantile(f64, Clusters<Option<f64>>),
    Width(Clusters<Option<f64>>),
    CountRate(Clusters<Count>),
}

impl Data {
    /// Locations with a value.
    pub(super) fn locations(&self) -> BTreeSet<u32> {
        match self {
            Self::Mean(c) | Self::Rms(c) | Self::Taxels(_, c) => c.keys().copied().collect(),
            Self::RepeatStd(c) => c.keys().copied().collect(),
            Self::Share(_, c) => c.keys().copied().collect(),
            Self::Quantile(_, c) | Self::Width(c) => c.keys().copied().collect(),
            Self::CountRate(c) => c.keys().copied().collect(),
        }
    }
}

impl From<Data> for Sample {
    fn from(data: Data) -> Self {
        Self {
            data,
            sessions: Vec::new(),
        }
    }
}

impl Sample {
    /// Sample for a mean, from (location, value) of each press.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn mean(values: impl IntoIterator<Item = (u32, f64)>) -> Result<Self, SampleFault> {
        finite(values).map(|v| Data::Mean(v).into())
    }

    /// Sample for a root mean square, from (location, error) of each press. The error is its length for the RMSE, or a
    /// component along an axis.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn rms(values: impl IntoIterator<Item = (u32, f64)>) -> Result<Self, SampleFault> {
        finite(values).map(|v| Data::Rms(v).into())
    }

    /// Sample for taxels, from (location, error length in mm) of each press and the area that the taxels cover, mm².
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`], [`SampleFault::Area`].
    pub fn taxels(
        area_mm2: f64,
        errors_mm: impl IntoIterator<Item = (u32, f64)>,
    ) -> Result<Self, SampleFault> {
        if !(area_mm2 > 0.0 && area_mm2.is_finite()) {
            return Err(SampleFault::Area(area_mm2));
        }
        finite(errors_mm).map(|v| Data::Taxels(area_mm2, v).into())
    }

    /// Sample for the std of repetitions, from (location, estimated position) of each located press. Drops series with one
    /// repetition.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn repeat_std(
        positions: impl IntoIterator<Item = (u32, Position)>,
    ) -> Result<Self, SampleFault> {
        let mut clusters = collect(positions, |location, at| {
            check(location, at.x_mm)?;
            check(location, at.y_mm)
        })?;
        for positions in clusters.values_mut() {
            positions.sort_by(|a, b| {
                let by = a.series.cmp(&b.series);
                by.then(a.x_mm.total_cmp(&b.x_mm))
                    .then(a.y_mm.total_cmp(&b.y_mm))
            });
            let series = positions.chunk_by(|a, b| a.series == b.series);
            *positions = series.filter(|s| s.len() > 1).flatten().copied().collect();
        }
        clusters.retain(|_, positions| !positions.is_empty());
        Ok(Data::RepeatStd(clusters).into())
    }

    /// Sample for a success rate, from (location, success) of each attempted press.
    #[must_use]
    pub fn share(trials: impl IntoIterator<Item = (u32, bool)>) -> Self {
        Self::share_of_repeated(trials, 1)
    }

    /// The same if each trial was repeated `times` (at least once) on the same data, so that only one in `times` may be
    /// independent.
    #[must_use]
    pub fn share_of_repeated(trials: impl IntoIterator<Item = (u32, bool)>, times: u32) -> Self {
        let mut clusters: Clusters<bool> = BTreeMap::new();
        for (location, success) in trials {
            clusters.entry(location).or_default().push(success);
        }
        clusters.values_mut().for_each(|v| v.sort_unstable());
        Data::Share(times.max(1), clusters).into()
    }

    /// Sample for a median time, from (location, time) of each trial; `None` for a trial that was never detected.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn median(
        times: impl IntoIterator<Item = (u32, Option<f64>)>,
    ) -> Result<Self, SampleFault> {
        censored(times).map(|v| Data::Quantile(0.5, v).into())
    }

    /// Sample for a 95th percentile, from (location, value) of each press.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn percentile_95(
        values: impl IntoIterator<Item = (u32, f64)>,
    ) -> Result<Self, SampleFault> {
        let values = values.into_iter().map(|(location, v)| (location, Some(v)));
        censored(values).map(|v| Data::Quantile(0.95, v).into())
    }

    /// Sample for a 5-95 % width, from (location, time) of each trial; `None` for a trial that was never detected.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn width(times: impl IntoIterator<Item = (u32, Option<f64>)>) -> Result<Self, SampleFault> {
        censored(times).map(|v| Data::Width(v).into())
    }

    /// Sample for a count rate, from (location, count) of each exposure.
    ///
    /// # Errors
    /// [`SampleFault::Exposure`].
    pub fn count_rate(counts: impl IntoIterator<Item = (u32, Count)>) -> Result<Self, SampleFault> {
        let mut clusters = collect(counts, |location, count| {
            if count.exposure > 0.0 && count.exposure.is_finite() {
                return Ok(());
            }
            let found = count.exposure;
            let location = LocationId::from_index(location);
            Err(SampleFault::Exposure { location, found })
        })?;
        for counts in clusters.values_mut() {
            counts.sort_by(|a, b| {
                let by = a.events.cmp(&b.events);
                by.then(a.exposure.total_cmp(&b.exposure))
            });
        }
        Ok(Data::CountRate(clusters).into())
    }

    /// Tells apart the sessions of the values: one sample of the same kind for each. Differences then include what varies between
    /// sessions.
    #[must_use]
    pub fn of_sessions(mut self, sessions: impl IntoIterator<Item = Self>) -> Self {
        self.sessions = sessions.into_iter().map(|session| session.data).collect();
        self
    }

    /// The values by session.
    pub(super) fn sessions(&self) -> &[Data] {
        &self.sessions
    }

    /// Kind of the sample.
    #[must_use]
    pub const fn kind(&self) -> Kind {
        match self.data {
            Data::Mean(_) => Kind::Mean,
            Data::Rms(_) => Kind::Rms,
            Data::Taxels(..) => Kind::Taxels,
            Data::RepeatStd(_) => Kind::RepeatStd,
            Data::Share(..) => Kind::Share,
            Data::Quantile(q, _) if q > 0.5 => Kind::Percentile95,
            Data::Quantile(..) => Kind::Median,
            Data::Width(_) => Kind::Width,
            Data::CountRate(_) => Kind::CountRate,
        }
    }

    /// True if values of this kind are never below 0.
    pub(super) const fn is_positive(&self) -> bool {
        matches!(
            self.data,
            Data::Rms(_) | Data::Taxels(..) | Data::RepeatStd(_) | Data::CountRate(_)
        )
    }

    pub(super) const fn data(&self) -> &Data {
        &self.data
    }
}

const fn check(location: u32, found: f64) -> Result<(), SampleFault> {
    if found.is_finite() {
        Ok(())
    } else {
        let location = LocationId::from_index(location);
        Err(SampleFault::NotFinite { location, found })
    }
}

fn collect<T>(
    values: impl IntoIterator<Item = (u32, T)>,
    check: impl Fn(u32, &T) -> Result<(), SampleFault>,
) -> Result<Clusters<T>, SampleFault> {
    let mut clusters: Clusters<T> = BTreeMap::new();
    for (location, value) in values {
        check(location, &value)?;
        clusters.entry(location).or_default().push(value);
    }
    Ok(clusters)
}

fn finite(values: impl IntoIterator<Item = (u32, f64)>) -> Result<Clusters<f64>, SampleFault> {
    let mut clusters = collect(values, |location, v| check(location, *v))?;
    clusters
        .values_mut()
        .for_each(|v| v.sort_by(f64::total_cmp));
    Ok(clusters)
}

fn censored(
    values: impl IntoIterator<Item = (u32, Option<f64>)>,
) -> Result<Clusters<Option<f64>>, SampleFault> {
    let mut clusters = collect(values, |location, v| {
        v.map_or(Ok(()), |v| check(location, v))
    })?;
    for times in clusters.values_mut() {
        times.sort_by(|a, b| late(*a).total_cmp(&late(*b)));
    }
    Ok(clusters)
}

/// Time for sorting: a miss is infinite.
pub(super) fn late(time: Option<f64>) -> f64 {
    time.unwrap_or(f64::INFINITY)
}
