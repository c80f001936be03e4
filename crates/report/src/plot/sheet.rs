//! Owns [`Sheet`]: places legend, plots in rows and footer, on a page and on a phone.

use super::axis::LeftTexts;
use super::canvas::{Canvas, Figure};
use super::legend::{self, Sample};
use super::marks::Plot;
use super::scale::Place;

/// Widths of a figure over half and over all of a page, px.
pub(crate) const HALF: f64 = 620.0;
pub(crate) const WIDE: f64 = 1240.0;

const LEFT: f64 = 66.0;
const RIGHT: f64 = 16.0;
/// Left margin of a single plot over the whole page; leaves room for the larger texts of a phone.
const BROAD_LEFT: f64 = 96.0;
/// Width that a phone shows legibly, px.
const PHONE: f64 = 650.0;

/// A row of plots: height of the frames, px.
struct Row<'a> {
    height: f64,
    plots: Vec<Plot<'a>>,
}

/// A figure of plots.
pub(crate) struct Sheet<'a> {
    head: [String; 3],
    width: f64,
    weights: Vec<f64>,
    left: f64,
    right: f64,
    gap: f64,
    shares_y: bool,
    legend: Vec<(Sample, &'a str)>,
    rows: Vec<Row<'a>>,
}

/// Positions of everything for one width.
struct Layout {
    legend: Vec<(f64, f64)>,
    /// Left end and top of each frame, by row.
    frames: Vec<Vec<(f64, f64)>>,
    size: (f64, f64),
}

impl<'a> Sheet<'a> {
    /// A figure without plots.
    pub(crate) fn new(id: &str, title: &str, caption: String, width: f64) -> Self {
        Self {
            head: [id.to_owned(), title.to_owned(), caption],
            width,
            weights: vec![1.0],
            left: if width > HALF { BROAD_LEFT } else { LEFT },
            right: RIGHT,
            gap: LEFT + RIGHT,
            shares_y: false,
            legend: vec![],
            rows: vec![],
        }
    }

    /// Columns of these relative widths.
    pub(crate) fn columns(mut self, weights: &[f64]) -> Self {
        self.weights = weights.to_vec();
        self.left = LEFT;
        self
    }

    /// Equally wide columns with the left axis of the first one.
    pub(crate) fn shared_columns(self, n: usize) -> Self {
        let sheet = self.columns(&vec![1.0; n.max(1)]);
        Self {
            gap: RIGHT,
            shares_y: true,
            ..sheet
        }
    }

    /// Left and right margin, px.
    pub(crate) fn margins(self, left: f64, right: f64) -> Self {
        Self {
            left,
            right,
            ..self
        }
    }

    /// Frames of this width, px, from the left of their columns.
    pub(crate) fn frames(self, width: f64) -> Self {
        let n = self.weights.len() as f64;
        let room = self.width - self.left - self.right;
        Self {
            gap: (room - n * width) / (n - 1.0).max(1.0),
            ..self
        }
    }

    /// Legend above the plots.
    pub(crate) fn legend(mut self, entries: impl IntoIterator<Item = (Sample, &'a str)>) -> Self {
        self.legend.extend(entries);
        self
    }

    /// A row of plots whose frames are `height` px high.
    pub(crate) fn row(mut self, height: f64, plots: impl IntoIterator<Item = Plot<'a>>) -> Self {
        let plots = plots.into_iter().collect();
        self.rows.push(Row { height, plots });
        self
    }

    /// Rows of one plot per column.
    pub(crate) fn rows(mut self, height: f64, plots: impl IntoIterator<Item = Plot<'a>>) -> Self {
        let mut plots = plots.into_iter().peekable();
        while plots.peek().is_some() {
            let row: Vec<Plot<'a>> = plots.by_ref().take(self.weights.len()).collect();
            self = self.row(height, row);
        }
        self
    }

    fn widths(&self) -> Vec<f64> {
        let gaps = self.gap * (self.weights.len() - 1) as f64;
        let room = self.width - self.left - self.right - gaps;
        let sum: f64 = self.weights.iter().sum();
        self.weights.iter().map(|w| room * w / sum).collect()
    }

    /// Number of columns, and width, on a phone.
    fn phone(&self) -> (usize, f64) {
        let widths = self.widths();
        let with = |n: usize| {
            let gaps = self.gap * (n - 1) as f64;
            let widest = widths.iter().copied().fold(0.0, f64::max);
            self.left + self.right + gaps + widest * n as f64
        };
        let fits = (1..=widths.len()).rev().find(|n| with(*n) <= PHONE);
        let n = fits.unwrap_or(1);
        (n, with(n))
    }

    /// Size of texts on a phone, relative to a page: legible, unless long names at the left limit it.
    fn phone_texts(&self) -> f64 {
        let most = if self.left > BROAD_LEFT { 1.55 } else { 1.9 };
        (self.phone().1 / 470.0).clamp(1.0, most)
    }

    fn layout(&self, columns: usize, width: f64, texts: f64) -> Layout {
        let mut legend = vec![];
        let (mut x, mut y) = (self.left, 12.0 * texts);
        for (_, name) in &self.legend {
            let wide = legend::width(name) * texts.sqrt();
            if x + wide > width && x > self.left {
                (x, y) = (self.left, y + 24.0 * texts);
            }
            legend.push((x, y));
            x += wide;
        }
        y = if legend.is_empty() { 0.0 } else { y + 16.0 };
        let widths = self.widths();
        let mut frames = vec![];
        for row in &self.rows {
            let heads = row.plots.iter().any(Plot::has_head);
            let names = row.plots.iter().any(|p| p.has_names());
            let head = if heads { 24.0 * texts } else { 12.0 };
            let head = head + if names { 22.0 * texts } else { 0.0 };
            let feet = row.plots.iter().map(Plot::foot);
            let foot = texts * feet.fold(0.0, f64::max);
            let mut lefts = vec![];
            for i in 0..row.plots.len() {
                if i % columns == 0 {
                    y += head + if i > 0 { row.height + foot } else { 0.0 };
                }
                let before = &widths[i - i % columns..i];
                let left = self.left + before.iter().map(|w| w + self.gap).sum::<f64>();
                lefts.push((left, y));
            }
            y += row.height + foot;
            frames.push(lefts);
        }
        Layout {
            legend,
            frames,
            size: (width, y + 24.0 * texts),
        }
    }

    /// Draws everything. `foot`: origin; `n`: number of samples; `table`: the data behind it.
    pub(crate) fn finish(self, foot: &str, n: &str, table: &'static str) -> Figure {
        let (columns, width) = self.phone();
        let texts = self.phone_texts();
        let wide = self.layout(self.weights.len(), self.width, 1.0);
        let mut phone = self.layout(columns, width, texts);
        // Origin and number of samples have a line each.
        phone.size.1 += 16.0 * texts;
        let widths = self.widths();
        let mut canvas = Canvas::new(self.head, wide.size, Some((phone.size, texts)));
        let away = |to: (f64, f64), from: (f64, f64)| (to.0 - from.0, to.1 - from.1);
        for (i, (sample, name)) in self.legend.into_iter().enumerate() {
            canvas.moving(away(phone.legend[i], wide.legend[i]));
            legend::entry(&mut canvas.svg, wide.legend[i], sample, name);
            canvas.svg.close();
        }
        for (row, (wide, phone)) in self
            .rows
            .into_iter()
            .zip(wide.frames.iter().zip(&phone.frames))
        {
            for (i, plot) in row.plots.into_iter().enumerate() {
                let (left, top) = wide[i];
                let place = Place {
                    x: plot.axes.0.scale((left, left + widths[i])),
                    y: plot.axes.1.scale((top + row.height, top)),
                };
                let left_texts = match i {
                    _ if !self.shares_y || i == 0 => LeftTexts::Shown,
                    _ if i % columns == 0 => LeftTexts::OnPhone,
                    _ => LeftTexts::None,
                };
                canvas.moving(away(phone[i], wide[i]));
                plot.render(&mut canvas.svg, &place, left_texts);
                canvas.svg.close();
            }
        }
        canvas.finish(foot, n, table)
    }
}
