//! `derive(Choice)`: an enum of unit variants as words.

use proc_macro2::TokenStream;
use quote::quote;
use syn::{Data, DeriveInput, Error, Fields, LitStr, Result};

use crate::attributes::{doc, snake_case};

pub(crate) fn choice(input: &DeriveInput) -> Result<TokenStream> {
    let Data::Enum(data) = &input.data else {
        return Err(Error::new_spanned(&input.ident, "expected an enum"));
    };
    let ident = &input.ident;
    let (mut variants, mut words, mut docs) = (Vec::new(), Vec::new(), Vec::new());
    for variant in &data.variants {
        if !matches!(variant.fields, Fields::Unit) {
            return Err(Error::new_spanned(
                variant,
                "expected a variant without fields",
            ));
        }
        let mut word = snake_case(&variant.ident.to_string());
        for attribute in variant.attrs.iter().filter(|a| a.path().is_ident("choice")) {
            attribute.parse_nested_meta(|meta| {
                if !meta.path.is_ident("word") {
                    return Err(meta.error("expected word"));
                }
                word = meta.value()?.parse::<LitStr>()?.value();
                Ok(())
            })?;
        }
        let text = doc(&variant.attrs);
        if text.is_empty() {
            return Err(Error::new_spanned(
                variant,
                "expected a doc comment: the meaning of the word",
            ));
        }
        variants.push(&variant.ident);
        words.push(word);
        docs.push(text);
    }
    Ok(quote! {
        impl ::skinrig_settings::Choice for #ident {
            const ALL: &'static [Self] = &[#(Self::#variants),*];
            const WORDS: &'static [::skinrig_settings::Word] = &[#((#words, #docs)),*];

            fn word(self) -> &'static str {
                match self {
                    #(Self::#variants => #words,)*
                }
            }
        }

        impl ::skinrig_settings::Setting for #ident {
            const SHAPE: ::skinrig_settings::Shape =
                ::skinrig_settings::Shape::Choice(<Self as ::skinrig_settings::Choice>::WORDS);

            fn from_field(
                field: &::skinrig_settings::Field,
                _: &mut ::skinrig_settings::Collector,
            ) -> Option<Self> {
                field.as_word().and_then(<Self as ::skinrig_settings::Choice>::from_word)
            }

            fn text(&self) -> String {
                <Self as ::skinrig_settings::Choice>::word(*self).to_owned()
            }
        }
    })
}
