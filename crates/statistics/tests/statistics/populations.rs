//! Simulates skins: locations with their own errors, repetitions with noise, and known true values.

use skinrig_statistics::seeded;
use skinrig_statistics::{Count, ImprovementDirection, Kind, Position, Sample};

/// Seeded random numbers.
pub(crate) struct Draws(Box<dyn FnMut() -> f64>);

impl Draws {
    pub(crate) fn new(seed: u64, stream: u64) -> Self {
        let mut rng = seeded::generator(seed, stream);
        Self(Box::new(move || 0.5 + 0.5 * seeded::signed_unit(&mut rng)))
    }

    /// Uniform in 0..1.
    pub(crate) fn uniform(&mut self) -> f64 {
        (self.0)()
    }

    /// Standard normal (Box and Muller 1958).
    pub(crate) fn normal(&mut self) -> f64 {
        let (u, v) = (1.0 - self.uniform(), self.uniform());
        (-2.0 * libm::log(u)).sqrt() * libm::cos(2.0 * std::f64::consts::PI * v)
    }

    /// Poisson of this mean (Knuth 1969).
    pub(crate) fn poisson(&mut self, mean: f64) -> u32 {
        let (mut product, mut n) = (self.uniform(), 0);
        while product > libm::exp(-mean) {
            product *= self.uniform();
            n += 1;
        }
        n
    }
}

/// Two skins and one metric.
#[derive(Debug, Clone, Copy)]
pub(crate) struct SimulatedPair {
    pub kind: Kind,
    /// Locations, and repetitions at each.
    pub locations: u32,
    pub repetitions: u32,
    /// Difference of B from A in the measured quantity: see [`SimulatedPair::truth`].
    pub shift: f64,
    /// Events per second of A, for counts.
    pub rate_per_s: f64,
}

/// Standard deviations: location effect shared by both skins, location effect of each skin, and press noise.
pub(crate) const SHARED: f64 = 0.6;
pub(crate) const OWN: f64 = 0.8;
pub(crate) const NOISE: f64 = 0.5;
/// Share of missed trials.
const MISSED: f64 = 0.02;
/// Mean exposure of a count, s.
const EXPOSURE_S: f64 = 2.0;
const AREA_MM2: f64 = 2000.0;
/// Series at a location, for the standard deviation between repetitions.
const SERIES: u32 = 3;

/// A press on both skins at one location, before conversion to a metric.
struct Press {
    location: u32,
    repetition: u32,
    /// Location effect along two axes.
    place: [f64; 2],
    noise: [f64; 2],
    uniform: f64,
}

impl SimulatedPair {
    pub(crate) fn new(kind: Kind) -> Self {
        Self {
            kind,
            locations: 24,
            repetitions: if kind == Kind::Width { 8 } else { 5 },
            shift: 0.0,
            rate_per_s: 0.5,
        }
    }

    /// The pair with a difference as large as a typical margin.
    pub(crate) fn shifted(self) -> Self {
        let shift = match self.kind {
            Kind::Share => 0.9,
            Kind::CountRate => 0.8,
            Kind::RepeatStd => 0.25,
            Kind::Width => 0.5,
            _ => 0.6,
        };
        Self { shift, ..self }
    }

    pub(crate) fn better(&self) -> ImprovementDirection {
        match self.kind {
            Kind::Share | Kind::Taxels => ImprovementDirection::Higher,
            Kind::Mean => ImprovementDirection::NearerZero,
            _ => ImprovementDirection::Lower,
        }
    }

    /// Draws a pair of samples. With `naive` every press is its own location, as if presses were independent.
    pub(crate) fn draw(&self, draws: &mut Draws, naive: bool) -> [Sample; 2] {
        let presses = self.draw_presses(draws);
        self.samples(&presses, self.presses(), draws, naive)
    }

    /// Draws a pair of skins and returns their samples after each repetition.
    pub(crate) fn draw_looks(&self, draws: &mut Draws) -> Vec<[Sample; 2]> {
        let presses = self.draw_presses(draws);
        let looks = 1..=self.presses();
        looks
            .map(|look| self.samples(&presses, look, draws, false))
            .collect()
    }

    fn draw_presses(&self, draws: &mut Draws) -> [Vec<Press>; 2] {
        let mut presses: [Vec<Press>; 2] = [Vec::new(), Vec::new()];
        for location in 0..self.locations {
            let shared = [SHARED * draws.normal(), SHARED * draws.normal()];
            for side in &mut presses {
                let place = shared.map(|s| s + OWN * draws.normal());
                for repetition in 0..self.presses() {
                    side.push(Press {
                        location,
                        repetition,
                        place,
                        noise: [draws.normal(), draws.normal()],
                        uniform: draws.uniform(),
                    });
                }
            }
        }
        presses
    }

    /// Samples of the first repetitions.
    fn samples(
        &self,
        presses: &[Vec<Press>; 2],
        repetitions: u32,
        draws: &mut Draws,
        naive: bool,
    ) -> [Sample; 2] {
        let key = |p: &Press| match (naive, self.kind) {
            (false, _) => p.location,
            (true, Kind::RepeatStd) => p.location * SERIES + p.repetition / self.repetitions,
            (true, _) => p.location * self.presses() + p.repetition,
        };
        let mut side = 0.0;
        presses.each_ref().map(|presses| {
            let first = presses.iter().filter(|p| p.repetition < repetitions);
            let presses: Vec<&Press> = first.collect();
            let sample = self.sample(&presses, key, side * self.shift, draws);
            side += 1.0;
            sample
        })
    }

    fn presses(&self) -> u32 {
        match self.kind {
            Kind::RepeatStd => SERIES * self.repetitions,
            _ => self.repetitions,
        }
    }

    fn sample(
        &self,
        presses: &[&Press],
        key: impl Fn(&Press) -> u32,
        shift: f64,
        draws: &mut Draws,
    ) -> Sample {
        let x = |p: &Press| 1.0 + shift + p.place[0] + NOISE * p.noise[0];
        let y = |p: &Press| p.place[1] + NOISE * p.noise[1];
        let length = |p: &Press| libm::hypot(x(p), y(p));
        let time = |p: &Press| {
            let spread = if self.kind == Kind::Width {
                1.0 + shift
            } else {
                1.0
            };
            let later = if self.kind == Kind::Width { 0.0 } else { shift };
            let t = 20.0 + later + spread * (p.place[0] + NOISE * p.noise[0]);
            (p.uniform >= MISSED).then_some(t)
        };
        let each = |f: &dyn Fn(&Press) -> f64| -> Vec<(u32, f64)> {
            presses.iter().map(|p| (key(p), f(p))).collect()
        };
        match self.kind {
            Kind::Mean => Sample::mean(each(&x)).unwrap(),
            Kind::Rms => Sample::rms(each(&length)).unwrap(),
            Kind::Taxels => Sample::taxels(AREA_MM2, each(&length)).unwrap(),
            Kind::Share => Sample::share(presses.iter().map(|p| (key(p), x(p) - p.place[1] < 3.0))),
            Kind::Median => Sample::median(presses.iter().map(|p| (key(p), time(p)))).unwrap(),
            Kind::Percentile95 => {
                Sample::percentile_95(each(&|p| 20.0 + shift + p.place[0] + NOISE * p.noise[0]))
                    .unwrap()
            }
            Kind::Width => Sample::width(presses.iter().map(|p| (key(p), time(p)))).unwrap(),
            Kind::RepeatStd => Sample::repeat_std(presses.iter().map(|p| {
                // Some locations are noisier than others.
                let noise = (1.0 + shift) * libm::exp(0.5 * p.place[0]);
                let [x_mm, y_mm] = p.noise.map(|n| noise * n);
                let series = p.repetition / self.repetitions;
                (key(p), Position { series, x_mm, y_mm })
            }))
            .unwrap(),
            Kind::CountRate => Sample::count_rate(presses.iter().map(|p| {
                let rate = self.rate_per_s * (1.0 + shift) * libm::exp(0.6 * p.place[0]);
                let exposure = EXPOSURE_S * (0.75 + 0.5 * p.uniform);
                let events = draws.poisson(rate * exposure);
                (key(p), Count { events, exposure })
            }))
            .unwrap(),
        }
    }

    /// Population value of the metric, of A and of B.
    pub(crate) fn truth(&self) -> [f64; 2] {
        [0.0, self.shift].map(|shift| {
            let place = SHARED * SHARED + OWN * OWN;
            let press = place + NOISE * NOISE;
            let square = (1.0 + shift).powi(2) + 2.0 * press;
            // Misses are later than every time.
            let rank = |q: f64| press.sqrt() * quantile(q / (1.0 - MISSED));
            match self.kind {
                Kind::Mean => 1.0 + shift,
                Kind::Rms => square.sqrt(),
                Kind::Taxels => AREA_MM2 / (std::f64::consts::PI * square),
                Kind::Share => normal((2.0 - shift) / (press + place).sqrt()),
                Kind::Median => 20.0 + shift + rank(0.5),
                Kind::Percentile95 => 20.0 + shift + press.sqrt() * quantile(0.95),
                Kind::Width => (1.0 + shift) * (rank(0.95) - rank(0.05)),
                Kind::RepeatStd => {
                    let free = f64::from(self.repetitions - 1);
                    let chi = libm::lgamma(free + 0.5) - libm::lgamma(free);
                    let of_few = (2.0 / free).sqrt() * libm::exp(chi);
                    (1.0 + shift) * of_few * libm::exp(0.125 * place)
                }
                Kind::CountRate => self.rate_per_s * (1.0 + shift) * libm::exp(0.18 * place),
            }
        })
    }
}

fn normal(z: f64) -> f64 {
    0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2)
}

/// Quantile of the standard normal distribution, by bisection.
fn quantile(p: f64) -> f64 {
    let (mut low, mut high) = (-9.0, 9.0);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if normal(middle) < p {
            low = middle;
        } else {
            high = middle;
        }
    }
    low
}
