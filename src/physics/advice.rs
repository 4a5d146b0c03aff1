//! What does an error say beside its message: who can mend it, how, and how far did the computation get?

use super::problem::State;

/// An error that knows what to do about it.
///
/// The program shows the help below the message and ends with the exit code that follows (`docs/reference.md`, "Exit
/// codes"): 5 for a missing program, 4 for an answer inside its own error bound, 2 for a request at fault, 1 for a
/// computation without an answer.
pub trait Advice: std::error::Error {
    /// The error that this one passes on as it is: its advice applies.
    fn inner(&self) -> Option<&dyn Advice> {
        None
    }

    /// Whether the request was at fault, the input or an option, and not the computation.
    fn is_usage(&self) -> bool {
        self.inner().is_none_or(Advice::is_usage)
    }

    /// Whether the answer lies inside its own error bound.
    fn is_undecided(&self) -> bool {
        self.inner().is_some_and(Advice::is_undecided)
    }

    /// Whether a program that is required is missing.
    fn is_missing(&self) -> bool {
        self.inner().is_some_and(Advice::is_missing)
    }

    /// What to change, for a person. Empty when the message says it all.
    fn help(&self) -> String {
        self.inner().map_or_else(String::new, Advice::help)
    }

    /// State reached, where the error knows one.
    fn last(&self) -> Option<State> {
        self.inner().and_then(Advice::last)
    }
}

impl<E: Advice> Advice for Box<E> {
    fn inner(&self) -> Option<&dyn Advice> {
        Some(self.as_ref())
    }
}
