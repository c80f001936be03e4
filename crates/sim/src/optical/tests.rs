//! Laws of the optical model.
