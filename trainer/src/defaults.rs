//! What serialised settings leave out.

/// Whether a setting has its type's default; configurations leave out those that the thesis does not know.
pub(crate) fn is_default<T: Default + PartialEq>(value: &T) -> bool {
    *value == T::default()
}
