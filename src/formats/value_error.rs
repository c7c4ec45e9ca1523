//! What is wrong with a value of a file. Where it stands is added by who reads the record that it belongs to.

/// What is wrong with a value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum ValueError {
    /// The file ends before it.
    End,
    /// It is not what it should be.
    Value(String),
}

impl ValueError {
    /// A number that is to be a whole one, and is none.
    pub fn broken(number: f64) -> Self {
        Self::Value(format!("{number} is no whole number"))
    }
}
