//! What crosses the border of the program: scene files, tables, and other people's solvers.

pub mod abaqus;
#[cfg(feature = "report")]
pub(crate) mod decode;
pub mod diagnostic;
pub mod input;
pub mod interruption;
pub mod peers;
pub mod scene_file;
pub mod tables;

pub use diagnostic::SceneError;
