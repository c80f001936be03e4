//! Owns [`Sample`]: what one prototype contributes for one metric, by location.

use std::collections::{BTreeMap, BTreeSet};

use serde::{Deserialize, Serialize};
use skinrig_model::LocationId;

/// What a metric is made of: how values of presses become one number.
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
    /// Median of times, a miss being later than every time.
    Median,
    /// 95th minus 5th percentile of times, a miss being later than every time.
    Width,
    /// Counts per unit of exposure: false alarms per second.
    CountRate,
}

/// Where one press was felt.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Position {
    /// What was repeated: presses of one location with the same series (the same depth, say) are repetitions.
    pub series: u32,
    /// Along x, mm.
    pub x_mm: f64,
    /// Along y, mm.
    pub y_mm: f64,
}

/// Events counted during an exposure.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Count {
    /// How many.
    pub events: u32,
    /// During how long, s (or any other unit of exposure, the same in all samples).
    pub exposure: f64,
}

/// Values that make no sample.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum SampleFault {
    /// A value that is no number.
    #[error("expected finite values, found {found} at {location}")]
    NotFinite {
        /// Where.
        location: LocationId,
        /// What.
        found: f64,
    },
    /// An exposure that is none.
    #[error("expected exposures above 0, found {found} at {location}")]
    Exposure {
        /// Where.
        location: LocationId,
        /// What.
        found: f64,
    },
    /// An area that is none.
    #[error("expected an area above 0 mm², found {0}")]
    Area(f64),
}

/// Values of presses by location. Locations are keyed by numbers that the samples of a comparison share: the same
/// number is the same place. Neither the order of presses nor that of locations matters.
#[derive(Debug, Clone, PartialEq)]
pub struct Sample {
    data: Data,
}

/// Values by location, each location's in a fixed order whatever order they came in.
pub(super) type Clusters<T> = BTreeMap<u32, Vec<T>>;

/// What a sample holds.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Data {
    Mean(Clusters<f64>),
    Rms(Clusters<f64>),
    Taxels(f64, Clusters<f64>),
    RepeatStd(Clusters<Position>),
    Share(Clusters<bool>),
    Median(Clusters<Option<f64>>),
    Width(Clusters<Option<f64>>),
    CountRate(Clusters<Count>),
}

impl Data {
    /// The locations with a value.
    pub(super) fn locations(&self) -> BTreeSet<u32> {
        match self {
            Self::Mean(c) | Self::Rms(c) | Self::Taxels(_, c) => c.keys().copied().collect(),
            Self::RepeatStd(c) => c.keys().copied().collect(),
            Self::Share(c) => c.keys().copied().collect(),
            Self::Median(c) | Self::Width(c) => c.keys().copied().collect(),
            Self::CountRate(c) => c.keys().copied().collect(),
        }
    }
}

impl Sample {
    /// (location, value) of each press whose mean is asked for.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn mean(values: impl IntoIterator<Item = (u32, f64)>) -> Result<Self, SampleFault> {
        finite(values).map(|v| Self {
            data: Data::Mean(v),
        })
    }

    /// (location, error) of each press whose root mean square is asked for: the length of the error for the RMSE, a
    /// component for that along an axis.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn rms(values: impl IntoIterator<Item = (u32, f64)>) -> Result<Self, SampleFault> {
        finite(values).map(|v| Self { data: Data::Rms(v) })
    }

    /// (location, length of the error in mm) of each press, and the area that the taxels are to fill, mm².
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
        finite(errors_mm).map(|v| Self {
            data: Data::Taxels(area_mm2, v),
        })
    }

    /// (location, estimated position) of each located press. Series with one repetition say nothing and are left out.
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
        for places in clusters.values_mut() {
            places.sort_by(|a, b| {
                let by = a.series.cmp(&b.series);
                by.then(a.x_mm.total_cmp(&b.x_mm))
                    .then(a.y_mm.total_cmp(&b.y_mm))
            });
            let series = places.chunk_by(|a, b| a.series == b.series);
            *places = series.filter(|s| s.len() > 1).flatten().copied().collect();
        }
        clusters.retain(|_, places| !places.is_empty());
        Ok(Self {
            data: Data::RepeatStd(clusters),
        })
    }

    /// (location, success) of each attempted press.
    #[must_use]
    pub fn share(trials: impl IntoIterator<Item = (u32, bool)>) -> Self {
        let mut clusters: Clusters<bool> = BTreeMap::new();
        for (location, success) in trials {
            clusters.entry(location).or_default().push(success);
        }
        clusters.values_mut().for_each(|v| v.sort_unstable());
        Self {
            data: Data::Share(clusters),
        }
    }

    /// (location, time or `None` when it was never detected) of each trial whose median is asked for.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn median(
        times: impl IntoIterator<Item = (u32, Option<f64>)>,
    ) -> Result<Self, SampleFault> {
        censored(times).map(|v| Self {
            data: Data::Median(v),
        })
    }

    /// (location, time or `None` when it was never detected) of each trial whose 5-95 % width is asked for.
    ///
    /// # Errors
    /// [`SampleFault::NotFinite`].
    pub fn width(times: impl IntoIterator<Item = (u32, Option<f64>)>) -> Result<Self, SampleFault> {
        censored(times).map(|v| Self {
            data: Data::Width(v),
        })
    }

    /// (location, count) of each exposure.
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
        Ok(Self {
            data: Data::CountRate(clusters),
        })
    }

    /// What the sample is of.
    #[must_use]
    pub const fn kind(&self) -> Kind {
        match self.data {
            Data::Mean(_) => Kind::Mean,
            Data::Rms(_) => Kind::Rms,
            Data::Taxels(..) => Kind::Taxels,
            Data::RepeatStd(_) => Kind::RepeatStd,
            Data::Share(_) => Kind::Share,
            Data::Median(_) => Kind::Median,
            Data::Width(_) => Kind::Width,
            Data::CountRate(_) => Kind::CountRate,
        }
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

/// A time that sorts a miss behind every time.
pub(super) fn late(time: Option<f64>) -> f64 {
    time.unwrap_or(f64::INFINITY)
}
