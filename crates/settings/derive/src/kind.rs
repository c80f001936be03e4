//! Form, reader, text, range and default of a value, derived from the type of its field.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};
use syn::{Error, Expr, GenericArgument, LitStr, PathArguments, Result, Type};

use crate::attributes::{FieldAttributes, pascal_case};
use crate::unit::{SECONDS, Unit};

/// Kind of a value, from the type of its field.
pub(crate) enum Kind {
    /// `f64`, with its unit.
    Float(Option<Unit>),
    /// An integer type, with its unit.
    Whole(Type, Option<Unit>),
    /// A duration.
    Duration(Type),
    /// A list of values of one kind.
    List(Box<Kind>),
    /// An array of values of one kind.
    Tuple(Box<Kind>, usize),
    /// A type that implements `Setting`.
    Other(Type),
}

/// The last name of a type's path, and its first generic argument.
fn named(ty: &Type) -> Option<(String, Option<&Type>)> {
    let Type::Path(path) = ty else { return None };
    let last = path.path.segments.last()?;
    let inner = match &last.arguments {
        PathArguments::AngleBracketed(list) => list.args.iter().find_map(|a| match a {
            GenericArgument::Type(t) => Some(t),
            _ => None,
        }),
        _ => None,
    };
    Some((last.ident.to_string(), inner))
}

/// The type inside `Option<...>`.
pub(crate) fn inside_option(ty: &Type) -> Option<&Type> {
    match named(ty)? {
        (name, inner) if name == "Option" => inner,
        _ => None,
    }
}

impl Kind {
    /// `unit` is the unit in the field's name, if any.
    pub(crate) fn of(ty: &Type, unit: Option<Unit>) -> Result<Self> {
        if let Type::Array(array) = ty {
            let Expr::Lit(length) = &array.len else {
                return Err(Error::new_spanned(array, "expected a literal length"));
            };
            let syn::Lit::Int(length) = &length.lit else {
                return Err(Error::new_spanned(array, "expected a literal length"));
            };
            let inner = Self::of(&array.elem, unit)?;
            return Ok(Self::Tuple(Box::new(inner), length.base10_parse()?));
        }
        let Some((name, inner)) = named(ty) else {
            return Ok(Self::Other(ty.clone()));
        };
        Ok(match (name.as_str(), inner) {
            ("f64", _) => Self::Float(unit),
            ("u8" | "u16" | "u32" | "u64" | "i64", _) => Self::Whole(ty.clone(), unit),
            ("HostDuration", _) => Self::Duration(ty.clone()),
            ("Vec", Some(inner)) => Self::List(Box::new(Self::of(inner, unit)?)),
            _ => Self::Other(ty.clone()),
        })
    }

    /// Whether the end of the field's name is a unit.
    pub(crate) fn is_measured(&self) -> bool {
        match self {
            Self::Float(_) | Self::Whole(..) => true,
            Self::List(of) | Self::Tuple(of, _) => of.is_measured(),
            Self::Duration(_) | Self::Other(_) => false,
        }
    }

    fn unit(&self) -> Option<Unit> {
        match self {
            Self::Float(unit) | Self::Whole(_, unit) => *unit,
            Self::Duration(_) => Some(SECONDS),
            _ => None,
        }
    }

    /// The declared range in the unit of the field, for numbers.
    pub(crate) fn range(&self, attributes: &FieldAttributes) -> TokenStream {
        let widest = match self {
            Self::Whole(ty, _) => {
                quote!(::skinrig_settings::ValueRange::between(<#ty>::MIN as f64, <#ty>::MAX as f64))
            }
            _ => quote!(::skinrig_settings::ValueRange::between(f64::MIN, f64::MAX)),
        };
        attributes.range(widest)
    }

    /// The `Shape`.
    pub(crate) fn shape(&self, attributes: &FieldAttributes) -> TokenStream {
        let range = self.range(attributes);
        match self {
            Self::Other(ty) => quote!(<#ty as ::skinrig_settings::Setting>::SHAPE),
            Self::List(of) => {
                let (of, items) = (of.shape(attributes), &attributes.items);
                let items = items.as_ref().map_or(quote!(0..=100_000), |i| quote!(#i));
                quote!(::skinrig_settings::Shape::List {
                    of: &#of,
                    min: *(#items).start(),
                    max: *(#items).end(),
                })
            }
            Self::Tuple(of, length) => {
                let of = of.shape(attributes);
                let names: Vec<String> = if attributes.names.is_empty() {
                    ["x", "y", "z"]
                        .iter()
                        .take(*length)
                        .map(ToString::to_string)
                        .collect()
                } else {
                    attributes.names.clone()
                };
                quote!(::skinrig_settings::Shape::Tuple(&#of, &[#(#names),*]))
            }
            _ => match (self.unit(), self) {
                (Some(unit), _) => {
                    let (dimension, per) = (format_ident!("{}", unit.dimension), unit.per);
                    quote!(::skinrig_settings::Shape::Quantity(
                        &[::skinrig_settings::Dimension::#dimension],
                        #range.in_units_of(#per),
                    ))
                }
                (None, Self::Whole(..)) => quote!(::skinrig_settings::Shape::whole(#range)),
                _ => quote!(::skinrig_settings::Shape::Number(#range)),
            },
        }
    }

    /// An expression of type `Option<T>` that reads the field `f`.
    pub(crate) fn read(&self) -> TokenStream {
        match self {
            Self::Float(Some(unit)) => {
                let per = unit.per;
                quote!(f.as_quantity().map(|v| ::skinrig_settings::in_unit(v, #per)))
            }
            Self::Float(None) => quote!(f.as_number()),
            Self::Whole(ty, Some(unit)) => {
                let (name, per) = (unit.name, unit.per);
                quote!(::skinrig_settings::whole_units(f, #name, #per, out)
                    .and_then(|n| <#ty>::try_from(n).ok()))
            }
            Self::Whole(ty, None) => quote!(f.as_whole().and_then(|n| <#ty>::try_from(n).ok())),
            Self::Duration(ty) => quote!(f.as_quantity().map(<#ty>::from_secs_f64)),
            Self::List(of) => {
                let of = of.read();
                // Read all items, so that the findings of each appear.
                quote!(f.items().iter().map(|f| #of).collect::<Vec<_>>()
                    .into_iter().collect::<Option<Vec<_>>>())
            }
            Self::Tuple(of, _) => {
                let of = of.read();
                quote!(f.items().iter().map(|f| #of).collect::<Option<Vec<_>>>()
                    .and_then(|items| items.try_into().ok()))
            }
            Self::Other(ty) => quote!(<#ty as ::skinrig_settings::Setting>::from_field(f, out)),
        }
    }

    /// An expression of type `String`: the value at the reference `v` as typed.
    pub(crate) fn text(&self) -> TokenStream {
        match self {
            Self::Duration(_) => quote!(format!("{} s", v.as_secs_f64())),
            Self::List(of) | Self::Tuple(of, _) => {
                let of = of.text();
                quote!(format!("[{}]", v.iter().map(|v| #of).collect::<Vec<String>>().join(", ")))
            }
            Self::Other(_) => quote!(::skinrig_settings::Setting::text(v)),
            _ => match self.unit() {
                Some(unit) => {
                    let name = unit.name;
                    quote!(format!("{} {}", v, #name))
                }
                None => quote!(v.to_string()),
            },
        }
    }

    /// An expression of type `Option<String>`: the range if the value at `v` is outside it.
    pub(crate) fn expected(&self, attributes: &FieldAttributes) -> TokenStream {
        let range = self.range(attributes);
        let describe = |number: TokenStream, unit: &str| {
            quote!({
                let range = #range;
                (!range.contains(#number)).then(|| range.describe(#unit))
            })
        };
        match self {
            Self::Float(unit) => describe(quote!(*v), unit.map_or("", |u| u.name)),
            Self::Whole(_, unit) => describe(quote!(*v as f64), unit.map_or("", |u| u.name)),
            Self::Duration(_) => describe(quote!(v.as_secs_f64()), "s"),
            Self::List(of) | Self::Tuple(of, _) => {
                let of = of.expected(attributes);
                quote!(v.iter().find_map(|v| #of))
            }
            Self::Other(_) => quote!(None),
        }
    }

    /// The default in Rust.
    pub(crate) fn default_value(&self, text: &LitStr) -> Result<TokenStream> {
        let typed = text.value();
        let wrong = |expected: &str| {
            Error::new_spanned(
                text,
                format!("expected {expected}, or `value = ...` beside it"),
            )
        };
        Ok(match self {
            Self::Float(Some(unit)) => {
                let value = unit.value_of(&typed);
                let value = value.ok_or_else(|| wrong("a quantity such as `5 mm`"))?;
                quote!(#value)
            }
            Self::Float(None) => {
                let value: f64 = typed.parse().map_err(|_| wrong("a number"))?;
                quote!(#value)
            }
            Self::Whole(ty, unit) => {
                let value = match unit {
                    Some(unit) => unit.value_of(&typed),
                    None => typed.parse().ok(),
                };
                let value = value.filter(|v| v.fract() == 0.0);
                let value = value.ok_or_else(|| wrong("a whole number"))? as i64;
                let value = proc_macro2::Literal::i64_unsuffixed(value);
                quote!((#value as #ty))
            }
            Self::Duration(ty) => {
                let value = SECONDS.value_of(&typed);
                let value = value.ok_or_else(|| wrong("a time such as `5 s`"))?;
                quote!(<#ty>::from_secs_f64(#value))
            }
            Self::List(_) if typed == "[]" => quote!(Vec::new()),
            Self::Other(ty) => match typed.as_str() {
                "{}" => quote!(<#ty as Default>::default()),
                "true" => quote!(true),
                "false" => quote!(false),
                word => {
                    let variant = format_ident!("{}", pascal_case(word));
                    quote!(<#ty>::#variant)
                }
            },
            _ => return Err(wrong("an empty list `[]`")),
        })
    }
}
