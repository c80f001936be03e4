//! Owns the model of what people read: a [`Document`] has sections, a section has blocks.
//!
//! Pages and terminal texts are built from typed results as documents, and rendered by `html` and `terminal`. Layout is
//! markup's concern: a [`Group`] names CSS classes; a terminal shows its blocks one below the other. Trusted markup is left
//! for drawings and for controls that a script drives.

mod html;
mod table;
mod terminal;
mod text;

pub(crate) use self::html::{SCRIPT, STYLE};
pub(crate) use self::table::{Column, Row, Table};
pub(crate) use self::terminal::{lines, terminal};
pub(crate) use self::text::Text;
use crate::plot::Figure;

/// A page.
#[derive(Debug, Default)]
pub(crate) struct Document {
    /// Title of the window.
    pub title: String,
    /// Kind of page, above the heading.
    pub brand: &'static str,
    pub heading: String,
    /// Test ID of the heading.
    pub heading_id: &'static str,
    /// Lines below the heading.
    pub subheads: Vec<Text>,
    pub badges: Vec<Text>,
    /// Remarks to be read before anything else.
    pub banners: Vec<Banner>,
    /// Link to the main part, and its words.
    pub skip: (&'static str, &'static str),
    pub sections: Vec<Section>,
    /// Footer.
    pub about: String,
    /// True if no number may be used.
    pub is_unusable: bool,
    /// Tables for scripts and downloads.
    pub data: Option<serde_json::Value>,
    /// Style sheets, after those of all pages.
    pub styles: Vec<&'static str>,
    /// Script, after that of all pages.
    pub script: String,
}

/// A remark in the head of a page.
#[derive(Debug)]
pub(crate) struct Banner {
    class: &'static str,
    role: &'static str,
    id: String,
    label: String,
    words: String,
}

impl Banner {
    /// A remark that is true of the whole page.
    pub(crate) fn note(id: &str, label: impl Into<String>, words: impl Into<String>) -> Self {
        Self {
            class: "simulated",
            role: "note",
            id: id.to_owned(),
            label: label.into(),
            words: words.into(),
        }
    }

    /// A warning.
    pub(crate) fn alert(id: &str, label: impl Into<String>, words: impl Into<String>) -> Self {
        Self {
            role: "alert",
            ..Self::note(id, label, words)
        }
    }

    /// The reason why numbers must not be used.
    pub(crate) fn invalid(id: &str, label: impl Into<String>, words: impl Into<String>) -> Self {
        Self {
            class: "simulated invalid",
            ..Self::alert(id, label, words)
        }
    }

    /// Says that a stand-in, `simulated` or `emulated`, replaced the hardware.
    pub(crate) fn stand_in(word: &str) -> Self {
        let source = match word {
            "simulated" => "a simulated rig",
            _ => "software that replaces the hardware behind the real drivers",
        };
        let words = format!("Every number and figure here comes from {source}, not from hardware.");
        Self::note(word, crate::format::capital(word), words)
    }

    /// Adds words.
    pub(crate) fn add(mut self, words: &str) -> Self {
        self.words += words;
        self
    }
}

/// A part of a page with its own heading, or of a terminal text between empty lines.
#[derive(Debug, Default)]
pub(crate) struct Section {
    id: String,
    title: String,
    /// Anchors and names in the contents.
    contents: Vec<(String, String)>,
    class: &'static str,
    test_id: String,
    /// True for a heading that only screen readers show.
    is_hidden: bool,
    /// Trusted markup beside the heading.
    tools: &'static str,
    blocks: Vec<Block>,
}

impl Section {
    /// A section of a page, listed in the contents.
    pub(crate) fn new(id: impl Into<String>, title: impl Into<String>) -> Self {
        let (id, title) = (id.into(), title.into());
        Self {
            contents: vec![(id.clone(), title.clone())],
            id,
            title,
            ..Self::default()
        }
    }

    /// A section of a terminal text.
    pub(crate) fn plain() -> Self {
        Self::default()
    }

    /// Sets the name in the contents.
    pub(crate) fn listed(mut self, name: &str) -> Self {
        self.contents = vec![(self.id.clone(), name.to_owned())];
        self
    }

    /// Lists a part of the section in the contents.
    pub(crate) fn lists(mut self, id: &str, name: &str) -> Self {
        self.contents.push((id.to_owned(), name.to_owned()));
        self
    }

    pub(crate) fn unlisted(self) -> Self {
        Self {
            contents: vec![],
            ..self
        }
    }

    pub(crate) fn hide_heading(self) -> Self {
        Self {
            is_hidden: true,
            ..self
        }
    }

    pub(crate) fn class(self, class: &'static str) -> Self {
        Self { class, ..self }
    }

    pub(crate) fn test_id(self, id: impl Into<String>) -> Self {
        Self {
            test_id: id.into(),
            ..self
        }
    }

    pub(crate) fn tools(self, tools: &'static str) -> Self {
        Self { tools, ..self }
    }

    pub(crate) fn with(mut self, block: impl Into<Block>) -> Self {
        self.blocks.push(block.into());
        self
    }

    pub(crate) fn with_all<B: Into<Block>>(mut self, blocks: impl IntoIterator<Item = B>) -> Self {
        self.blocks.extend(blocks.into_iter().map(Into::into));
        self
    }
}

/// A part of a section.
#[derive(Debug)]
pub(crate) enum Block {
    /// A paragraph in a CSS class.
    Text(&'static str, Text),
    /// A heading inside a section, with its tag.
    Heading(&'static str, Text),
    Note(Note),
    Commands(Vec<String>),
    Table(Table),
    Facts(Vec<Fact>),
    /// A figure, and trusted markup of its controls.
    Figure(Box<Figure>, String),
    Group(Group),
    /// Trusted markup: drawings, and controls that a script drives.
    Markup(String),
}

impl From<Note> for Block {
    fn from(note: Note) -> Self {
        Self::Note(note)
    }
}

impl From<Table> for Block {
    fn from(table: Table) -> Self {
        Self::Table(table)
    }
}

impl From<Figure> for Block {
    fn from(figure: Figure) -> Self {
        Self::Figure(Box::new(figure), String::new())
    }
}

impl From<Group> for Block {
    fn from(group: Group) -> Self {
        Self::Group(group)
    }
}

/// A paragraph.
pub(crate) fn paragraph(text: impl Into<Text>) -> Block {
    Block::Text("", text.into())
}

/// A paragraph of less importance.
pub(crate) fn soft(text: impl Into<Text>) -> Block {
    Block::Text("soft", text.into())
}

/// Severity of a note.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) enum Tone {
    #[default]
    Plain,
    Good,
    Warning,
    Bad,
    /// The answer.
    Answer,
}

/// A remark with a label.
#[derive(Debug, Clone, Default)]
pub(crate) struct Note {
    tone: Tone,
    label: String,
    text: Text,
    test_id: &'static str,
    /// Lines in a terminal; a longer note is cut.
    most_lines: Option<usize>,
}

impl Note {
    pub(crate) fn new(label: impl Into<String>, text: impl Into<Text>) -> Self {
        Self {
            label: label.into(),
            text: text.into(),
            ..Self::default()
        }
    }

    /// A remark without a label; in a terminal, one that belongs to the label above.
    pub(crate) fn of(text: impl Into<Text>) -> Self {
        Self::new("", text)
    }

    pub(crate) fn tone(self, tone: Tone) -> Self {
        Self { tone, ..self }
    }

    pub(crate) fn warning(self) -> Self {
        self.tone(Tone::Warning)
    }

    pub(crate) fn bad(self) -> Self {
        self.tone(Tone::Bad)
    }

    pub(crate) fn good(self) -> Self {
        self.tone(Tone::Good)
    }

    pub(crate) fn test_id(self, test_id: &'static str) -> Self {
        Self { test_id, ..self }
    }

    pub(crate) fn at_most(self, lines: usize) -> Self {
        Self {
            most_lines: Some(lines),
            ..self
        }
    }
}

/// A key and its value.
#[derive(Debug)]
pub(crate) struct Fact {
    key: String,
    value: Text,
    /// True for a value that takes a whole line.
    is_wide: bool,
    /// Shown when pointed at.
    title: String,
}

impl Fact {
    pub(crate) fn new(key: impl Into<String>, value: impl Into<Text>) -> Self {
        Self {
            key: key.into(),
            value: value.into(),
            is_wide: false,
            title: String::new(),
        }
    }

    pub(crate) fn wide(self, is_wide: bool) -> Self {
        Self { is_wide, ..self }
    }

    pub(crate) fn title(self, title: impl Into<String>) -> Self {
        Self {
            title: title.into(),
            ..self
        }
    }
}

/// Blocks that belong together: a card, columns, or a part that opens on request.
#[derive(Debug, Default)]
pub(crate) struct Group {
    class: String,
    attributes: Vec<(&'static str, String)>,
    heading: String,
    /// Words that open the group.
    summary: Option<Text>,
    is_open: bool,
    /// Stem of the file behind the CSV button, and what it holds.
    download: Option<(String, String)>,
    blocks: Vec<Block>,
}

impl Group {
    /// Blocks in a CSS class.
    pub(crate) fn new(class: impl Into<String>) -> Self {
        Self {
            class: class.into(),
            ..Self::default()
        }
    }

    pub(crate) fn card() -> Self {
        Self::new("card")
    }

    /// A card with a heading.
    pub(crate) fn titled(heading: impl Into<String>) -> Self {
        Self {
            heading: heading.into(),
            ..Self::card()
        }
    }

    /// Two columns.
    pub(crate) fn two() -> Self {
        Self::new("two")
    }

    /// Blocks one below the other.
    pub(crate) fn stack() -> Self {
        Self::new("stack")
    }

    /// A part that opens on request.
    pub(crate) fn folded(summary: impl Into<Text>) -> Self {
        Self {
            summary: Some(summary.into()),
            ..Self::default()
        }
    }

    pub(crate) fn open(self, is_open: bool) -> Self {
        Self { is_open, ..self }
    }

    /// Adds a CSS class.
    pub(crate) fn class(mut self, class: &str) -> Self {
        if !self.class.is_empty() && !class.is_empty() {
            self.class.push(' ');
        }
        self.class += class;
        self
    }

    pub(crate) fn attribute(mut self, name: &'static str, value: impl Into<String>) -> Self {
        self.attributes.push((name, value.into()));
        self
    }

    pub(crate) fn id(self, id: impl Into<String>) -> Self {
        self.attribute("id", id)
    }

    pub(crate) fn test_id(self, id: impl Into<String>) -> Self {
        self.attribute("data-testid", id)
    }

    /// A region that scrolls in itself.
    pub(crate) fn region(self, label: &str) -> Self {
        self.attribute("tabindex", "0")
            .attribute("role", "region")
            .attribute("aria-label", label)
    }

    /// Offers a table of the script data, as file `name`.
    pub(crate) fn download(self, name: &str, table: &str, label: &str) -> Self {
        let group = self.attribute("data-figure", name);
        Self {
            download: Some((name.to_owned(), label.to_owned())),
            ..group.attribute("data-table", table)
        }
    }

    pub(crate) fn with(mut self, block: impl Into<Block>) -> Self {
        self.blocks.push(block.into());
        self
    }

    pub(crate) fn with_all<B: Into<Block>>(mut self, blocks: impl IntoIterator<Item = B>) -> Self {
        self.blocks.extend(blocks.into_iter().map(Into::into));
        self
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.blocks.is_empty()
    }
}
