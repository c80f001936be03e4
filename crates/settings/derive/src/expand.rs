//! `derive(Settings)`: table, reader, rows and default of a struct.

use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Field, Fields, Ident, Path, Result, Type};

use crate::attributes::{DefaultText, FieldAttributes, StructAttributes, doc, snake_case};
use crate::kind::{Kind, inside_option};
use crate::unit;

/// The code of one field.
struct Parts {
    ident: Ident,
    /// A list of keys as an expression; `None`: no key.
    keys: Option<TokenStream>,
    read: TokenStream,
    rows: TokenStream,
    /// `None`: required.
    default: Option<TokenStream>,
}

pub(crate) fn settings(input: &DeriveInput) -> Result<TokenStream> {
    let Data::Struct(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "expected a struct"));
    };
    let Fields::Named(fields) = &data.fields else {
        return Err(Error::new_spanned(&input.ident, "expected named fields"));
    };
    let attributes = StructAttributes::parse(&input.attrs)?;
    let ident = &input.ident;
    let name = attributes.name;
    let name = name.unwrap_or_else(|| snake_case(&ident.to_string()));
    let text = doc(&input.attrs);
    let parts: Vec<Parts> = fields.named.iter().map(parts).collect::<Result<_>>()?;
    let version = attributes.version.map(|key| {
        quote!(&[::skinrig_settings::Key {
            name: #key,
            doc: "Version of the language of this file: 1.",
            shape: ::skinrig_settings::Shape::Whole { min: 1, max: 1 },
            need: ::skinrig_settings::Need::Required,
            example: None,
        }])
    });
    let keys: Vec<&TokenStream> = version
        .iter()
        .chain(parts.iter().filter_map(|p| p.keys.as_ref()))
        .collect();
    let checks = attributes
        .checks
        .iter()
        .map(|(path, fields)| match fields.as_slice() {
            [] => quote!(#path(field, out);),
            fields => quote! {
                if let (#(Some(#fields),)*) = (#(&#fields,)*) {
                    #path(#(#fields,)* field, out);
                }
            },
        });
    let built = attributes
        .builds
        .map(|(target, path)| built(ident, &target, &path));
    let reads = parts.iter().map(|p| &p.read);
    let rows = parts.iter().map(|p| &p.rows);
    let idents: Vec<&Ident> = parts.iter().map(|p| &p.ident).collect();
    let groups = attributes.exactly_one.iter();
    let groups = groups.map(|group| quote!(&[#(#group),*]));
    let finish = match attributes.finish {
        Some(path) => quote!(#path(value, field, out)),
        None => quote!(Some(value)),
    };
    let types = fields.named.iter().map(|f| &f.ty);
    let visibility = &input.vis;
    let parts_struct = attributes.parts.map(|parts| {
        let reads = reads.clone();
        let (idents, types) = (&idents, types);
        let doc = format!("The readable fields of a [`{ident}`].");
        quote! {
            #[doc = #doc]
            #visibility struct #parts {
                #(#visibility #idents: Option<#types>,)*
            }

            impl #ident {
                /// Reads each key, even if others cannot be read.
                #visibility fn read_parts(
                    field: &::skinrig_settings::Field,
                    out: &mut ::skinrig_settings::Collector,
                ) -> #parts {
                    #(#reads)*
                    #parts { #(#idents),* }
                }
            }
        }
    });
    let defaults: Option<Vec<&TokenStream>> = parts.iter().map(|p| p.default.as_ref()).collect();
    let default = defaults.filter(|_| !attributes.no_default).map(|values| {
        quote! {
            impl Default for #ident {
                fn default() -> Self {
                    Self { #(#idents: #values),* }
                }
            }
        }
    });
    Ok(quote! {
        impl ::skinrig_settings::Settings for #ident {
            const TABLE: &'static ::skinrig_settings::Table = {
                static TABLE: ::skinrig_settings::Table = ::skinrig_settings::Table {
                    name: #name,
                    doc: #text,
                    keys: {
                        const PARTS: &[&[::skinrig_settings::Key]] = &[#(#keys),*];
                        const COUNT: usize = ::skinrig_settings::count_keys(PARTS);
                        const KEYS: [::skinrig_settings::Key; COUNT] =
                            ::skinrig_settings::join_keys(PARTS);
                        &KEYS
                    },
                    exactly_one: &[#(#groups),*],
                };
                &TABLE
            };

            fn from_mapping(
                field: &::skinrig_settings::Field,
                out: &mut ::skinrig_settings::Collector,
            ) -> Option<Self> {
                #(#reads)*
                #(#checks)*
                let value = Self { #(#idents: #idents?),* };
                #finish
            }

            fn add_rows(&self, path: &str, rows: &mut Vec<::skinrig_settings::Row>) {
                #(#rows)*
            }
        }

        impl ::skinrig_settings::Setting for #ident {
            const SHAPE: ::skinrig_settings::Shape =
                ::skinrig_settings::Shape::Map(<Self as ::skinrig_settings::Settings>::TABLE);

            fn from_field(
                field: &::skinrig_settings::Field,
                out: &mut ::skinrig_settings::Collector,
            ) -> Option<Self> {
                <Self as ::skinrig_settings::Settings>::from_mapping(field, out)
            }

            fn text(&self) -> String {
                let rows = ::skinrig_settings::Settings::rows(self);
                let pairs: Vec<String> =
                    rows.iter().map(|row| format!("{}: {}", row.key, row.value)).collect();
                format!("{{{}}}", pairs.join(", "))
            }

            fn add_rows(
                &self,
                key: &str,
                _: &'static str,
                rows: &mut Vec<::skinrig_settings::Row>,
            ) {
                ::skinrig_settings::Settings::add_rows(self, key, rows);
            }
        }

        #default

        #parts_struct
        #built
    })
}

/// The type that is built from a mapping.
fn built(keys: &Ident, target: &Type, path: &Path) -> TokenStream {
    quote! {
        impl ::skinrig_settings::Setting for #target {
            const SHAPE: ::skinrig_settings::Shape =
                ::skinrig_settings::Shape::Map(<#keys as ::skinrig_settings::Settings>::TABLE);

            fn from_field(
                field: &::skinrig_settings::Field,
                out: &mut ::skinrig_settings::Collector,
            ) -> Option<Self> {
                let keys = <#keys as ::skinrig_settings::Settings>::from_mapping(field, out)?;
                #path(keys, field, out)
            }

            fn text(&self) -> String {
                String::new()
            }

            fn add_rows(&self, _: &str, _: &'static str, _: &mut Vec<::skinrig_settings::Row>) {}
        }
    }
}

/// A struct whose keys belong to the mapping of another one.
fn flattened(ident: Ident, ty: &Type) -> Parts {
    Parts {
        keys: Some(quote!(<#ty as ::skinrig_settings::Settings>::TABLE.keys)),
        read: quote!(let #ident = <#ty as ::skinrig_settings::Settings>::from_mapping(field, out);),
        rows: quote!(::skinrig_settings::Settings::add_rows(&self.#ident, path, rows);),
        default: None,
        ident,
    }
}

fn parts(field: &Field) -> Result<Parts> {
    let Some(ident) = field.ident.clone() else {
        return Err(Error::new_spanned(field, "expected a name"));
    };
    let attributes = FieldAttributes::parse(&field.attrs)?;
    if attributes.skip {
        return Ok(Parts {
            keys: None,
            read: quote!(let #ident = Some(Default::default());),
            rows: quote!(),
            default: Some(quote!(Default::default())),
            ident,
        });
    }
    if attributes.flatten {
        return Ok(flattened(ident, &field.ty));
    }
    let optional = inside_option(&field.ty);
    let ty = optional.unwrap_or(&field.ty);
    let name = ident.to_string();
    let in_name = match &attributes.unit {
        Some(text) if text.is_empty() => None,
        Some(text) => {
            let unit = unit::of_text(text);
            Some((
                unit.ok_or_else(|| Error::new_spanned(field, "unknown unit"))?,
                name.as_str(),
            ))
        }
        None => unit::of_name(&name),
    };
    let kind = Kind::of(ty, in_name.map(|(u, _)| u))?;
    let key = match (&attributes.key, in_name) {
        (Some(key), _) => key.clone(),
        (None, Some((_, key))) if kind.is_measured() && attributes.shape.is_none() => {
            key.to_owned()
        }
        _ => name,
    };
    let text = doc(&field.attrs);
    let shape = match (&attributes.shape, &attributes.through) {
        (Some(shape), _) => quote!(#shape),
        (None, Some(through)) => quote!(<#through as ::skinrig_settings::Setting>::SHAPE),
        (None, None) => kind.shape(&attributes),
    };
    let (need, default) = match (&attributes.default, optional) {
        (None, Some(_)) if attributes.at_least_one => (
            quote!(::skinrig_settings::Need::AtLeastOne),
            Some(quote!(None)),
        ),
        (None, Some(_)) => (
            quote!(::skinrig_settings::Need::Optional),
            Some(quote!(None)),
        ),
        (None, None) => (quote!(::skinrig_settings::Need::Required), None),
        (Some(DefaultText::Own), _) => (
            quote!(::skinrig_settings::Need::Default("{}")),
            Some(quote!(<#ty as Default>::default())),
        ),
        (Some(DefaultText::Typed(typed)), _) => {
            let value = match (&attributes.value, &attributes.through) {
                (Some(value), _) => quote!(#value),
                (None, Some(through)) => {
                    let value = Kind::Other(through.clone()).default_value(typed)?;
                    quote!(<#ty>::from(#value))
                }
                (None, None) => kind.default_value(typed)?,
            };
            (
                quote!(::skinrig_settings::Need::Default(#typed)),
                Some(value),
            )
        }
    };
    let reader = match (&attributes.read, &attributes.through) {
        (Some(path), _) => quote!(#path(f, out)),
        (None, Some(through)) => quote!(
            <#through as ::skinrig_settings::Setting>::from_field(f, out).map(<#ty>::from)
        ),
        (None, None) => kind.read(),
    };
    let read = if optional.is_some() {
        quote! {
            let #ident = match field.get(#key) {
                Some(f) => #reader.map(Some),
                None => Some(None),
            };
        }
    } else {
        quote!(let #ident = field.get(#key).and_then(|f| #reader);)
    };
    let one = match (&attributes.show, &kind) {
        (Some(show), _) => quote!(::skinrig_settings::Row {
            key: ::skinrig_settings::key_path(path, #key),
            doc: #text,
            value: #show(v),
            expected: None,
        }),
        (None, _) => {
            let (shown, expected) = (kind.text(), kind.expected(&attributes));
            quote!(::skinrig_settings::Row {
                key: ::skinrig_settings::key_path(path, #key),
                doc: #text,
                value: #shown,
                expected: #expected,
            })
        }
    };
    let is_hidden = attributes.shape.is_some() || attributes.through.is_some();
    let add = match (&attributes.show, &kind) {
        (None, _) if is_hidden => quote!(()),
        (None, Kind::Other(_)) => quote!(::skinrig_settings::Setting::add_rows(
            v,
            &::skinrig_settings::key_path(path, #key),
            #text,
            rows,
        )),
        _ => quote!(rows.push(#one)),
    };
    let rows = if optional.is_some() {
        quote! {
            match &self.#ident {
                Some(v) => #add,
                None => rows.push(::skinrig_settings::Row {
                    key: ::skinrig_settings::key_path(path, #key),
                    doc: #text,
                    value: String::new(),
                    expected: None,
                }),
            }
        }
    } else {
        quote!({
            let v = &self.#ident;
            #add;
        })
    };
    let example = match &attributes.example {
        Some(example) => quote!(Some(#example)),
        None => quote!(None),
    };
    Ok(Parts {
        ident,
        keys: Some(quote!(&[::skinrig_settings::Key {
            name: #key,
            doc: #text,
            shape: #shape,
            need: #need,
            example: #example,
        }])),
        read,
        rows,
        default,
    })
}
