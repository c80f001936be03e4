//! Owns [`Figure`] and the canvas that all figures are drawn on.

use crate::markup::Markup;
use crate::svg::{Px, plain_css};

/// A figure.
#[derive(Debug, Clone, serde::Serialize)]
pub struct Figure {
    /// Identifier, unique in a page; also the stem of downloaded files.
    pub id: String,
    /// Title, plain text.
    pub title: String,
    /// What the figure shows and how to read it, plain text.
    pub caption: String,
    /// The `<svg>` element, without style (see [`Figure::standalone`]).
    pub svg: String,
    /// Name of the data table behind the figure in the page's script data.
    pub table: &'static str,
    /// Interaction in the page: `select` (presses), `zoom` (time axis) or empty.
    pub interaction: &'static str,
}

impl Figure {
    /// The figure as a stand-alone file, with XML declaration and style.
    #[must_use]
    pub fn standalone(&self) -> String {
        let style = format!("</title><style>{}</style>", plain_css());
        let styled = self.svg.replacen("</title>", &style, 1);
        format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{styled}\n")
    }

    /// Names the interaction in the page.
    #[must_use]
    pub(crate) fn interactive(self, interaction: &'static str) -> Self {
        Self {
            interaction,
            ..self
        }
    }
}

/// Size of a figure, px, and of its texts relative to a page, on a phone.
type PhoneLayout = ((f64, f64), f64);

/// A figure under construction.
pub(crate) struct Canvas {
    pub(crate) svg: Markup,
    pub(crate) id: String,
    title: String,
    caption: String,
    size: (f64, f64),
    narrow: Option<PhoneLayout>,
}

impl Canvas {
    /// Opens the `<svg>` element with its title and description. `narrow`: size, and size of texts, on a phone.
    pub(crate) fn new(
        [id, title, caption]: [String; 3],
        size: (f64, f64),
        narrow: Option<PhoneLayout>,
    ) -> Self {
        let mut svg = Markup::new();
        let view = |(w, h): (f64, f64)| format!("0 0 {} {}", Px(w), Px(h));
        let (wide, labelled) = (view(size), format!("{id}-title {id}-desc"));
        let view_on_phone = narrow.map(|(size, texts)| (view(size), texts));
        let mut attributes: Vec<(&str, &dyn std::fmt::Display)> = vec![
            ("xmlns", &"http://www.w3.org/2000/svg"),
            ("class", &"fig"),
            ("id", &id),
            ("viewBox", &wide),
            ("role", &"img"),
            ("aria-labelledby", &labelled),
        ];
        if let Some((view, texts)) = &view_on_phone {
            attributes.extend([("data-narrow", view as _), ("data-texts", texts as _)]);
        }
        svg.open("svg", &attributes);
        svg.holding("title", &[("id", &format!("{id}-title"))], &title);
        svg.holding("desc", &[("id", &format!("{id}-desc"))], &caption);
        Self {
            svg,
            id,
            title,
            caption,
            size,
            narrow,
        }
    }

    /// Opens a group that moves by this many px on a phone.
    pub(crate) fn moving(&mut self, by: (f64, f64)) {
        let by = format!("{} {}", Px(by.0), Px(by.1));
        self.svg.open("g", &[("data-to", &by)]);
    }

    /// Writes the reason for an empty figure into its middle.
    pub(crate) fn empty(&mut self, why: &str) {
        let (w, h) = self.size;
        self.svg.text((w / 2.0, h / 2.0), "empty", "middle", why);
    }

    /// Writes the footer (origin, number of samples) and closes the figure. `table`: the data behind it.
    pub(crate) fn finish(mut self, foot: &str, n: &str, table: &'static str) -> Figure {
        let (w, h) = self.size;
        for (x, text, class, anchor) in [
            (10.0, foot, "foot", "start"),
            (w - 10.0, n, "foot count", "end"),
        ] {
            let at = (x, h - 8.0);
            if let Some(((width, height), texts)) = self.narrow {
                // A line each on a phone.
                let to = match anchor {
                    "start" => (x, height - 8.0 - 15.0 * texts),
                    _ => (width - 10.0, height - 8.0),
                };
                self.moving((to.0 - at.0, to.1 - at.1));
                self.svg.text(at, class, anchor, text).close();
            } else {
                self.svg.text(at, class, anchor, text);
            }
        }
        Figure {
            id: self.id,
            title: self.title,
            caption: self.caption,
            svg: self.svg.finish(),
            table,
            interaction: "",
        }
    }
}
