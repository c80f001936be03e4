//! Three-dimensional vectors.

/// A vector in the robot frame.
pub type Vector = [f64; 3];

/// The zero vector.
pub const ZERO: Vector = [0.0; 3];

/// a + b.
pub fn add(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] + b[i])
}

/// a - b.
pub fn sub(a: Vector, b: Vector) -> Vector {
    std::array::from_fn(|i| a[i] - b[i])
}

/// a times a scalar.
pub fn scale(a: Vector, by: f64) -> Vector {
    a.map(|x| x * by)
}

/// Inner product.
pub fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Euclidean length.
pub fn norm(a: Vector) -> f64 {
    dot(a, a).sqrt()
}

/// The vector, shortened to `length` if it is longer.
pub fn shorten(a: Vector, length: f64) -> Vector {
    let long = norm(a);
    if long > length {
        scale(a, length / long)
    } else {
        a
    }
}
