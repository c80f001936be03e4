//! The C interface of libdrd as declarations: signatures, constants, error codes; no vendor code.
