//! Tests with a main of their own: checks that end in an error and not in a panic, and may be ignored at run time.

use std::env;
use std::error::Error;

use libtest_mimic::{Failed, Trial};

/// What makes a check fail; every error of ours chains into it.
pub(crate) type Failure = Box<dyn Error>;

pub(crate) type Check = Result<(), Failure>;

/// Ends a check with the message unless `holds`.
macro_rules! ensure {
    ($holds:expr, $($message:tt)*) => {
        if !$holds {
            return Err(format!($($message)*).into());
        }
    };
}
pub(crate) use ensure;

/// Whether nothing may be ignored.
pub(crate) fn required() -> bool {
    env::var("CI").is_ok_and(|value| value == "true")
}

/// The test `name`.
pub(crate) fn trial(name: &str, check: impl FnOnce() -> Check + Send + 'static) -> Trial {
    Trial::test(name, || check().map_err(|error| Failed::from(error.to_string())))
}
