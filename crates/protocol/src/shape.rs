//! Names of the settings crate that this crate uses, and readers of single keys.

pub(crate) use skinrig_settings::{
    Field, Key, Need, Shape, Table, Value, ValueRange as Range, Word,
};

/// Readers of single keys of a mapping.
pub(crate) trait Keys {
    fn text(&self, key: &str) -> Option<String>;
    fn word(&self, key: &str) -> Option<&'static str>;
    fn whole(&self, key: &str) -> Option<i64>;
    fn count(&self, key: &str) -> Option<u32>;
    fn number(&self, key: &str) -> Option<f64>;
    fn flag(&self, key: &str) -> Option<bool>;
    fn quantity(&self, key: &str) -> Option<f64>;
    fn pair(&self) -> Option<[f64; 2]>;
    fn triple(&self) -> Option<[f64; 3]>;
}

impl Keys for Field {
    fn text(&self, key: &str) -> Option<String> {
        self.get(key)?.as_text().map(str::to_owned)
    }
    fn word(&self, key: &str) -> Option<&'static str> {
        self.get(key)?.as_word()
    }
    fn whole(&self, key: &str) -> Option<i64> {
        self.get(key)?.as_whole()
    }
    fn count(&self, key: &str) -> Option<u32> {
        self.whole(key).and_then(|n| u32::try_from(n).ok())
    }
    fn number(&self, key: &str) -> Option<f64> {
        self.get(key)?.as_number()
    }
    fn flag(&self, key: &str) -> Option<bool> {
        self.get(key)?.as_flag()
    }
    fn quantity(&self, key: &str) -> Option<f64> {
        self.get(key)?.as_quantity()
    }
    fn pair(&self) -> Option<[f64; 2]> {
        self.as_quantities()
    }
    fn triple(&self) -> Option<[f64; 3]> {
        self.as_quantities()
    }
}
