//! The runtime's transcendental functions, for policies compiled to C.

use tpg_runtime::math;

/// x to the power y, 0 if that is not finite.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_pow(x: f32, y: f32) -> f32 {
    math::pow(x, y)
}

/// Square root, 0 for negative numbers.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_sqrt(x: f32) -> f32 {
    math::sqrt(x)
}

/// Sine of an angle in radians.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_sin(x: f32) -> f32 {
    math::sin(x)
}

/// Cosine of an angle in radians.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_cos(x: f32) -> f32 {
    math::cos(x)
}

/// Tangent of an angle in radians, computed as sine over cosine.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_tan(x: f32) -> f32 {
    math::tan(x)
}

/// Arc sine in radians, 0 outside [-1, 1].
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_asin(x: f32) -> f32 {
    math::asin(x)
}

/// Arc cosine in radians, 0 outside [-1, 1].
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_acos(x: f32) -> f32 {
    math::acos(x)
}

/// Arc tangent in radians.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_atan(x: f32) -> f32 {
    math::atan(x)
}

/// Hyperbolic tangent.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_tanh(x: f32) -> f32 {
    math::tanh(x)
}

/// Exponential, 0 if it overflows.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_exp(x: f32) -> f32 {
    math::exp(x)
}

/// Natural logarithm, 0 if it is undefined.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_log(x: f32) -> f32 {
    math::log(x)
}

/// Cosine of the classic set.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_classic_cos(x: f32) -> f32 {
    math::classic::cos(x)
}

/// Logarithm of the classic set: log y if y > 0, else x.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_classic_log(x: f32, y: f32) -> f32 {
    math::classic::log(x, y)
}

/// Exponential of the classic set, the largest number if it overflows.
// SAFETY: the prefix keeps the name apart from every other function of a program.
#[unsafe(no_mangle)]
pub extern "C" fn tpg_math_classic_exp(x: f32) -> f32 {
    math::classic::exp(x)
}
