//! The attributes of structs and fields.

use proc_macro2::TokenStream;
use syn::punctuated::Punctuated;
use syn::{Attribute, Expr, Ident, Lit, LitStr, Meta, Path, Result, Token, Type, parenthesized};

/// The attributes of a struct.
#[derive(Default)]
pub(crate) struct StructAttributes {
    pub name: Option<String>,
    pub exactly_one: Vec<Vec<String>>,
    pub version: Option<String>,
    /// Functions and the fields that each needs.
    pub checks: Vec<(Path, Vec<Ident>)>,
    /// The type built from the struct, and the function that builds it.
    pub builds: Option<(Type, Path)>,
    pub finish: Option<Path>,
    pub no_default: bool,
    pub parts: Option<Ident>,
}

/// The default of a key.
pub(crate) enum DefaultText {
    /// A mapping with its own defaults.
    Own,
    /// As typed.
    Typed(LitStr),
}

/// The attributes of a field.
#[derive(Default)]
pub(crate) struct FieldAttributes {
    pub default: Option<DefaultText>,
    pub value: Option<Expr>,
    pub min: Option<Expr>,
    pub above: Option<Expr>,
    pub max: Option<Expr>,
    pub range: Option<Expr>,
    pub items: Option<Expr>,
    pub names: Vec<String>,
    pub key: Option<String>,
    pub unit: Option<String>,
    pub shape: Option<Expr>,
    pub read: Option<Path>,
    pub show: Option<Path>,
    pub through: Option<Type>,
    pub example: Option<Expr>,
    pub at_least_one: bool,
    pub flatten: bool,
    pub skip: bool,
}

fn strings(input: syn::parse::ParseStream<'_>) -> Result<Vec<String>> {
    let content;
    parenthesized!(content in input);
    let list = Punctuated::<LitStr, Token![,]>::parse_terminated(&content)?;
    Ok(list.iter().map(LitStr::value).collect())
}

/// `(path, "field", ...)`
fn check(input: syn::parse::ParseStream<'_>) -> Result<(Path, Vec<Ident>)> {
    let content;
    parenthesized!(content in input);
    let path = content.parse()?;
    let mut fields = Vec::new();
    while content.parse::<Option<Token![,]>>()?.is_some() && !content.is_empty() {
        fields.push(content.parse::<LitStr>()?.parse()?);
    }
    Ok((path, fields))
}

/// `(Type, path)`
fn builds(input: syn::parse::ParseStream<'_>) -> Result<(Type, Path)> {
    let content;
    parenthesized!(content in input);
    let ty = content.parse()?;
    content.parse::<Token![,]>()?;
    Ok((ty, content.parse()?))
}

impl StructAttributes {
    pub(crate) fn parse(attributes: &[Attribute]) -> Result<Self> {
        let mut out = Self::default();
        for attribute in attributes.iter().filter(|a| a.path().is_ident("settings")) {
            attribute.parse_nested_meta(|meta| {
                if meta.path.is_ident("name") {
                    out.name = Some(meta.value()?.parse::<LitStr>()?.value());
                } else if meta.path.is_ident("exactly_one") {
                    out.exactly_one.push(strings(meta.input)?);
                } else if meta.path.is_ident("version") {
                    out.version = Some(meta.value()?.parse::<LitStr>()?.value());
                } else if meta.path.is_ident("check") {
                    out.checks.push(check(meta.input)?);
                } else if meta.path.is_ident("builds") {
                    out.builds = Some(builds(meta.input)?);
                } else if meta.path.is_ident("finish") {
                    out.finish = Some(meta.value()?.parse()?);
                } else if meta.path.is_ident("parts") {
                    out.parts = Some(meta.value()?.parse()?);
                } else if meta.path.is_ident("no_default") {
                    out.no_default = true;
                } else {
                    return Err(meta.error("unknown attribute of settings"));
                }
                Ok(())
            })?;
        }
        Ok(out)
    }
}

impl FieldAttributes {
    pub(crate) fn parse(attributes: &[Attribute]) -> Result<Self> {
        let mut out = Self::default();
        for attribute in attributes.iter().filter(|a| a.path().is_ident("setting")) {
            attribute.parse_nested_meta(|meta| {
                let Some(name) = meta.path.get_ident().map(ToString::to_string) else {
                    return Err(meta.error("expected a single word"));
                };
                match name.as_str() {
                    "default" if meta.input.peek(Token![=]) => {
                        out.default = Some(DefaultText::Typed(meta.value()?.parse()?));
                    }
                    "default" => out.default = Some(DefaultText::Own),
                    "value" => out.value = Some(meta.value()?.parse()?),
                    "min" => out.min = Some(meta.value()?.parse()?),
                    "above" => out.above = Some(meta.value()?.parse()?),
                    "max" => out.max = Some(meta.value()?.parse()?),
                    "range" => out.range = Some(meta.value()?.parse()?),
                    "items" => out.items = Some(meta.value()?.parse()?),
                    "names" => out.names = strings(meta.input)?,
                    "key" => out.key = Some(meta.value()?.parse::<LitStr>()?.value()),
                    "unit" => out.unit = Some(meta.value()?.parse::<LitStr>()?.value()),
                    "shape" => out.shape = Some(meta.value()?.parse()?),
                    "read" => out.read = Some(meta.value()?.parse()?),
                    "show" => out.show = Some(meta.value()?.parse()?),
                    "through" => out.through = Some(meta.value()?.parse()?),
                    "example" => out.example = Some(meta.value()?.parse()?),
                    "at_least_one" => out.at_least_one = true,
                    "flatten" => out.flatten = true,
                    "skip" => out.skip = true,
                    _ => return Err(meta.error("unknown attribute of a setting")),
                }
                Ok(())
            })?;
        }
        Ok(out)
    }

    /// The declared range as a `ValueRange`, in the unit of the field; `otherwise` without a declared range.
    pub(crate) fn range(&self, otherwise: TokenStream) -> TokenStream {
        if let Some(range) = &self.range {
            return quote::quote!(#range);
        }
        let max = self.max.as_ref();
        let max = max.map_or(quote::quote!(f64::MAX), |m| quote::quote!((#m) as f64));
        match (&self.min, &self.above, &self.max) {
            (_, Some(above), _) => {
                quote::quote!(::skinrig_settings::ValueRange::above((#above) as f64, #max))
            }
            (Some(min), ..) => {
                quote::quote!(::skinrig_settings::ValueRange::between((#min) as f64, #max))
            }
            (None, None, Some(_)) => {
                quote::quote!(::skinrig_settings::ValueRange::between(0.0, #max))
            }
            (None, None, None) => otherwise,
        }
    }
}

/// The text of a literal, possibly grouped by a macro.
fn text(value: &Expr) -> Option<String> {
    match value {
        Expr::Lit(lit) => match &lit.lit {
            Lit::Str(text) => Some(text.value().trim().to_owned()),
            _ => None,
        },
        Expr::Group(group) => text(&group.expr),
        _ => None,
    }
}

/// The lines of a doc comment as one text.
pub(crate) fn doc(attributes: &[Attribute]) -> String {
    let lines = attributes.iter().filter_map(|a| match &a.meta {
        Meta::NameValue(pair) if pair.path.is_ident("doc") => text(&pair.value),
        _ => None,
    });
    let lines: Vec<String> = lines.filter(|l| !l.is_empty()).collect();
    lines.join(" ")
}

/// `MotorForce` as `motor_force`.
pub(crate) fn snake_case(name: &str) -> String {
    let mut out = String::new();
    for (i, c) in name.chars().enumerate() {
        if c.is_uppercase() && i > 0 {
            out.push('_');
        }
        out.extend(c.to_lowercase());
    }
    out
}

/// `all_clusters` as `AllClusters`.
pub(crate) fn pascal_case(word: &str) -> String {
    let parts = word.split(['_', '-']).map(|part| {
        let mut letters = part.chars();
        let first = letters.next().map(|c| c.to_uppercase().to_string());
        first.unwrap_or_default() + letters.as_str()
    });
    parts.collect()
}
