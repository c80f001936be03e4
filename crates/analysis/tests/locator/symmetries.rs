//! What mirrored, turned, permuted, repeated and merged recordings have in common.
