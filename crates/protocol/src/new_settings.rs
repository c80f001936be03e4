//! Files of settings with which sessions are analysed again.

use skinrig_model::AnalysisSettings;
use skinrig_settings::{Diagnostics, Settings, given, open};

/// What `skinrig reanalyze` changes in the recorded settings of each session.
#[derive(Debug, Clone, PartialEq, Settings)]
#[settings(name = "settings", version = "skinrig_settings")]
pub struct NewSettings {
    /// What they are for.
    pub description: Option<String>,
    /// The settings that change, as in a protocol. Each session keeps its own for all others.
    #[setting(example = "{min_samples: 5}")]
    pub analysis: AnalysisSettings,
    /// The given settings, as `analysis.key=value`.
    #[setting(skip)]
    pub overrides: Vec<String>,
}

impl NewSettings {
    /// Reads settings from the bytes of a file named `name`.
    ///
    /// # Errors
    /// [`Diagnostics`] with every finding at once; also if no setting is given.
    pub fn parse(name: &str, bytes: &[u8]) -> Result<Self, Diagnostics> {
        let (mut out, root) = open(name, bytes, &[], Self::TABLE)?;
        let found = root.and_then(|root| Some((Self::from_mapping(&root, &mut out)?, root)));
        let Some((settings, root)) = found.filter(|_| out.is_clean()) else {
            return Err(out.finish());
        };
        let overrides = given(name, bytes, Self::TABLE, "analysis")?;
        if overrides.is_empty() {
            let field = root.at("analysis");
            out.error(field.span, "analysis", "no setting changes")
                .expected("one setting or more, for example `min_samples: 5`")
                .found("none")
                .help("`skinrig analyze` gives the official analysis");
            return Err(out.finish());
        }
        Ok(Self {
            overrides,
            ..settings
        })
    }
}
