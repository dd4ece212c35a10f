//! Between NumPy's arrays and slices, and between our errors and Python's exceptions.

use std::error::Error;
use std::fmt::Write as _;

use numpy::{PyArrayDyn, PyArrayMethods as _, PyReadonlyArrayDyn, PyUntypedArrayMethods as _};
use pyo3::exceptions::{PyRuntimeError, PyTypeError, PyValueError};
use pyo3::prelude::*;

/// An error with all of its causes in one line, as the command `tpg` prints it.
pub(crate) fn text(error: &dyn Error) -> String {
    let mut text = error.to_string();
    let mut source = error.source();
    while let Some(cause) = source {
        // Writing to a string cannot fail.
        let _ = write!(text, ": {cause}");
        source = cause.source();
    }
    text
}

/// What the caller gave makes no sense.
pub(crate) fn bad_value(error: &dyn Error) -> PyErr {
    PyValueError::new_err(text(error))
}

/// Something failed that the caller could not know.
pub(crate) fn failed(error: &dyn Error) -> PyErr {
    PyRuntimeError::new_err(text(error))
}

/// An array of numbers as it came from Python, without a copy where it has a type that can be read.
pub(crate) enum Numbers<'py> {
    F32(PyReadonlyArrayDyn<'py, f32>),
    F64(PyReadonlyArrayDyn<'py, f64>),
}

impl<'py> Numbers<'py> {
    /// An array of float32 or float64, or what NumPy makes one of: integers, booleans, lists. `what` names it in messages.
    pub(crate) fn new(object: &Bound<'py, PyAny>, what: &str) -> PyResult<Self> {
        if let Ok(array) = object.cast::<PyArrayDyn<f32>>() {
            return Ok(Numbers::F32(array.readonly()));
        }
        if let Ok(array) = object.cast::<PyArrayDyn<f64>>() {
            return Ok(Numbers::F64(array.readonly()));
        }
        let numpy = object.py().import("numpy")?;
        let array = numpy.call_method1("asarray", (object,))?;
        let dtype = array.getattr("dtype")?;
        let kind: String = dtype.getattr("kind")?.extract()?;
        if !matches!(kind.as_str(), "f" | "i" | "u" | "b") {
            return Err(PyTypeError::new_err(format!(
                "{what} must be an array of real numbers, such as float32, not of {dtype}"
            )));
        }
        let array = array.call_method1("astype", ("float64",))?;
        Ok(Numbers::F64(array.cast::<PyArrayDyn<f64>>()?.readonly()))
    }

    pub(crate) fn shape(&self) -> &[usize] {
        match self {
            Numbers::F32(array) => array.shape(),
            Numbers::F64(array) => array.shape(),
        }
    }

    /// Writes the numbers in C order to `out`, those of float64 rounded once.
    pub(crate) fn rounded_into(&self, out: &mut Vec<f32>) {
        out.clear();
        // The slice of a view, unlike that of the array itself, is there for C order alone and not for Fortran's.
        match self {
            Numbers::F32(array) => match array.as_array().as_slice() {
                Some(slice) => out.extend_from_slice(slice),
                None => out.extend(array.as_array().iter()),
            },
            Numbers::F64(array) => match array.as_array().as_slice() {
                Some(slice) => out.extend(slice.iter().map(|x| *x as f32)),
                None => out.extend(array.as_array().iter().map(|x| *x as f32)),
            },
        }
    }

    /// The numbers in C order.
    pub(crate) fn to_f64(&self) -> Vec<f64> {
        match self {
            Numbers::F32(array) => array.as_array().iter().map(|x| f64::from(*x)).collect(),
            Numbers::F64(array) => array.as_array().iter().copied().collect(),
        }
    }
}

/// A shape as Python writes it: `(4,)`, `(2, 3)`.
pub(crate) fn shape_text(shape: &[usize]) -> String {
    match shape {
        [n] => format!("({n},)"),
        _ => {
            let parts: Vec<String> = shape.iter().map(ToString::to_string).collect();
            format!("({})", parts.join(", "))
        }
    }
}

/// Refuses an array of another shape.
pub(crate) fn check_shape(what: &str, got: &[usize], wanted: &[usize]) -> PyResult<()> {
    if got == wanted {
        return Ok(());
    }
    Err(PyValueError::new_err(format!(
        "{what} has shape {}, but must have {}",
        shape_text(got),
        shape_text(wanted)
    )))
}

/// One flag for each of `len` things; `None` stands for all of them.
pub(crate) fn flags(
    object: Option<&Bound<'_, PyAny>>,
    what: &str,
    len: usize,
) -> PyResult<Vec<bool>> {
    let Some(object) = object else {
        return Ok(vec![true; len]);
    };
    let array = match object.cast::<PyArrayDyn<bool>>() {
        Ok(array) => array.clone(),
        Err(_) => {
            let numpy = object.py().import("numpy")?;
            let array = numpy.call_method1("asarray", (object, "bool"))?;
            array.cast::<PyArrayDyn<bool>>()?.clone()
        }
    };
    let array = array.readonly();
    check_shape(what, array.shape(), &[len])?;
    Ok(array.as_array().iter().copied().collect())
}
