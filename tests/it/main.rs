//! The program and the library as somebody outside sees them: one binary, one module a subject.
//!
//! Tests with a main of their own stand beside this folder: whether Python, a browser or a small disk is there (`programs`)
//! is known at run time only, and `allocations` counts every allocation of its process.

mod batch;
mod bench;
mod command_line;
mod dependencies;
mod documents;
mod fuzz_corpus;
mod hostile_input;
#[cfg(unix)]
mod hostile_peers;
mod layers;
#[cfg(feature = "parquet")]
mod parquet;
mod program;
mod properties;
mod schemas;
mod stress;
mod study_reports;
mod suite;
mod sweep;
mod transcript;
