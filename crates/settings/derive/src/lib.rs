//! `derive(Settings)` and `derive(Choice)`: the declarations of `skinrig-settings` as code. See there for their use.
//!
//! # Attributes of a struct: `#[settings(...)]`
//! - `name = "motion"`: name in the JSON Schema; the struct's own name in snake case when absent.
//! - `exactly_one("depth", "depths")`: of these keys exactly one must be given. May be repeated.
//! - `finish = path`: a function `(Self, &Field, &mut Collector) -> Option<Self>` that holds keys against each other.
//! - `parts = NAME`: a struct of that name with each field as an `Option`, and `Self::read_parts(&Field, &mut Collector)`: what
//!   could be read of a mapping with mistakes, so that its keys can still be held against each other.
//! - `version = "skinrig_rig"`: a first key with the version of the file's language, 1.
//! - `check(path, "a", "b")`: a function `(&A, &B, &Field, &mut Collector)` that holds these fields against each other. It runs
//!   whenever they could be read, even when other keys could not; without fields always. May be repeated.
//! - `builds(Type, path)`: the mapping is the file form of `Type`, which gets an `impl Setting`; the function
//!   `(Self, &Field, &mut Collector) -> Option<Type>` converts. `Type` has no rows.
//! - `no_default`: no `impl Default`, which there is otherwise when no key is required.
//!
//! # Attributes of a field: `#[setting(...)]`
//! - `default = "5 mm"`: the value of an absent key, as typed. `default` alone: a mapping with its own defaults.
//! - `value = EXPR`: the same value in Rust, where the text is neither a number, a quantity, a flag nor a word of a choice.
//! - `min`, `above`, `max`: the range in the unit of the field; of a duration in seconds. `range = EXPR` is a constant of type
//!   `ValueRange` in their place.
//! - `items = 1..=100`: how long a list may be. `names("x", "y")`: the names of a tuple's items.
//! - `key = "..."`: the key, when it is not the field's name without its unit. `unit = "mm"`: the unit, when the name does not end
//!   in it; `unit = ""`: a number without a unit.
//! - `shape = EXPR, read = PATH, show = PATH`: a form of its own, its reader `(&Field, &mut Collector) -> Option<T>` and its text
//!   `(&T) -> String`. A value with a `shape` and without `show` has no row.
//! - `through = TYPE`: read as this type, which converts into the field's by `Into`. Such a value has no row.
//! - `example = EXPR`: the value that the help for a missing key suggests.
//! - `at_least_one`: of the optional keys with this attribute at least one must be given.
//! - `flatten`: the keys of a struct with `derive(Settings)` stand in this mapping; its groups of keys do not apply.
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
