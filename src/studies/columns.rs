//! A table by columns, as Parquet stores it: every cell of a column has one type, and may be absent.

use std::borrow::Cow;

use crate::physics::Shown;

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Numbers from 1, never absent.
    Count,
    /// Real numbers.
    Number,
    /// Text.
    Text,
}

/// Cells of one column, one after the other.
#[derive(Clone, Debug, PartialEq)]
pub enum Cells {
    /// Of [`Kind::Count`].
    Counts(Vec<u64>),
    /// Of [`Kind::Number`].
    Numbers(Vec<Option<f64>>),
    /// Of [`Kind::Text`].
    Texts(Vec<Option<Cow<'static, str>>>),
}

impl Cells {
    /// No cell of `kind`.
    pub fn empty(kind: Kind) -> Self {
        match kind {
            Kind::Count => Self::Counts(Vec::new()),
            Kind::Number => Self::Numbers(Vec::new()),
            Kind::Text => Self::Texts(Vec::new()),
        }
    }

    /// What they are.
    pub fn kind(&self) -> Kind {
        match self {
            Self::Counts(_) => Kind::Count,
            Self::Numbers(_) => Kind::Number,
            Self::Texts(_) => Kind::Text,
        }
    }

    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Counts(cells) => cells.len(),
            Self::Numbers(cells) => cells.len(),
            Self::Texts(cells) => cells.len(),
        }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Cell `index` as the text of a CSV table: the shortest digits that read back to the same number, empty if absent.
    pub fn text(&self, index: usize) -> Cow<'_, str> {
        let absent = Cow::Borrowed("");
        match self {
            Self::Counts(cells) => Cow::Owned(cells[index].to_string()),
            Self::Numbers(cells) => cells[index].map_or(absent, |value| Cow::Owned(Shown(value).to_string())),
            Self::Texts(cells) => cells[index].as_deref().map_or(absent, Cow::Borrowed),
        }
    }
}
