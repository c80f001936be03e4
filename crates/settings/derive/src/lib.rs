//! `derive(Settings)` and `derive(Choice)`: turn the declarations of `skinrig-settings` into code. That crate shows their use.
//!
//! # Attributes of a struct: `#[settings(...)]`
//! - `name = "motion"`: name in the JSON Schema; by default the struct's name in snake case.
//! - `exactly_one("depth", "depths")`: exactly one of these keys must be given. May be repeated.
//! - `finish = path`: a function `(Self, &Field, &mut Collector) -> Option<Self>` that checks keys against each other.
//! - `parts = NAME`: a struct of that name with each field as an `Option`, and `Self::read_parts(&Field, &mut Collector)`: the
//!   readable values of an invalid mapping, so that its keys can still be checked against each other.
//! - `version = "skinrig_rig"`: a first key with the version of the file's language, 1.
//! - `check(path, "a", "b")`: a function `(&A, &B, &Field, &mut Collector)` that checks these fields against each other. It runs
//!   whenever they are readable, even if other keys are not; without fields always. May be repeated.
//! - `builds(Type, path)`: the mapping is the file form of `Type`, which gets an `impl Setting`; the function
//!   `(Self, &Field, &mut Collector) -> Option<Type>` converts. `Type` has no rows.
//! - `no_default`: no `impl Default`, which is otherwise generated if no key is required.
//!
//! # Attributes of a field: `#[setting(...)]`
//! - `default = "5 mm"`: the value of an absent key, as typed. `default` alone: a mapping with its own defaults.
//! - `value = EXPR`: the same value in Rust, if the text is neither a number, a quantity, a flag nor a word of a choice.
//! - `min`, `above`, `max`: the range in the unit of the field; of a duration in seconds. `range = EXPR` replaces them with a
//!   constant of type `ValueRange`.
//! - `items = 1..=100`: length of a list. `names("x", "y")`: the names of a tuple's items.
//! - `key = "..."`: the key, if it is not the field's name without its unit. `unit = "mm"`: the unit, if the name does not end
//!   in it; `unit = ""`: a number without a unit.
//! - `shape = EXPR, read = PATH, show = PATH`: a custom form, its reader `(&Field, &mut Collector) -> Option<T>` and its text
//!   `(&T) -> String`. A value with a `shape` and without `show` has no row.
//! - `through = TYPE`: read as this type, which converts into the field's by `Into`. Such a value has no row.
//! - `example = EXPR`: the value that the help for a missing key suggests.
//! - `at_least_one`: at least one of the optional keys with this attribute must be given.
//! - `flatten`: the keys of a struct with `derive(Settings)` belong to this mapping; its groups of keys do not apply.
//! - `skip`: no key; the field has its type's default.
//!
//! `Option<T>` is an optional key, a field without a default a required one.

mod attributes;
mod choice;
mod expand;
mod kind;
mod unit;

use proc_macro::TokenStream;
use syn::{DeriveInput, parse_macro_input};

/// A struct whose fields are the keys of a mapping.
#[proc_macro_derive(Settings, attributes(settings, setting))]
pub fn settings(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    expand::settings(&input)
        .unwrap_or_else(syn::Error::into_compile_error)
        .into()
}

/// An enum whose variants are the words of a choice.
#[proc_macro_derive(Choice, attributes(choice))]
pub fn choice(input: TokenStream) -> TokenStream {
    let input = parse_macro_input!(input as DeriveInput);
    choice::choice(&input)
        .unwrap_or_else(syn::Error::into_compile_error)
        .into()
}
