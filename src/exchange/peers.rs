//! What do other programs say? Peers: programs that solve the same stages and answer over a line protocol
//! (`docs/reference.md`, "Peer protocol").
//!
//! ```text
//! {"hello": 1}                          -> {"name", "version", "method"}
//! {"id", "mass_kg", ..., "stages": []}  -> {"id", "outcome", "depth_m", "time_s", "velocity_m_s", "events", ...}
//! ```
//!
//! - [`wire`]: the objects on the line, and how far two answers differ.
//! - [`process`]: a peer as a child process that may die, hang, babble or print megabytes, and is then named.
//! - [`environment`]: the peers that ship with the program, and the Python packages they need.
//! - [`references`]: answers recorded earlier, with provenance, so that a comparison needs no Python.
//!
//! A peer gets every number of the problem and is trusted with nothing: every wait, line and buffer has a bound.

pub mod environment;
pub mod process;
pub mod references;
pub mod wire;

pub use environment::{BundledPeer, Environment, PeerSetupError};
#[cfg(unix)]
pub(super) use process::end_all;
pub use process::{ORDER_OF_ALL, ORDER_QUANTITIES, Peer, PeerFailure, PeerFault, PeerIdentity, PeerStartError};
pub use references::{RecordedFlight, Recording, recordings};
#[cfg(feature = "report")]
pub(crate) use wire::NO_LAWS;
pub use wire::{Difference, PeerAnswer, PeerRequest, PeerScene};
