//! What does an accuracy cost? Error, run time and force evaluations of every method and of other programs.
//!
//! - [`timing`]: median and quartiles of a time, warmed.
//! - [`work_precision`]: each method at each tolerance; wrong outcomes and failures are runs like any other.
//! - [`peers`]: the same of programs that speak the peer protocol.
//! - [`step_size`]: the paper's scheme in its nine variants, and the largest step that holds an accuracy.
//! - [`growth`]: time a scene and memory from one scene to millions.
//!
//! Errors come from the numbers alone and are the same in every run; times belong to the machine and the minute.

pub mod growth;
pub mod peers;
pub mod step_size;
pub mod timing;
pub mod work_precision;

pub use timing::{Effort, Timing};
