//! A peer and the processes it starts, ended together.
//!
//! On Unix a peer leads a process group of its own, and its children belong to it unless they leave it. An interrupt at
//! the terminal then reaches this program alone, which ends them ([`crate::exchange::interruption`]). Elsewhere the peer
//! alone is ended.

use std::io;
use std::process::{Child, Command};

#[cfg(unix)]
use std::sync::{Mutex, MutexGuard, PoisonError};

#[cfg(unix)]
use rustix::process::{Pid, Signal, kill_process_group};

#[cfg(unix)]
use crate::exchange::interruption::receive_signals;

/// The groups that run.
#[cfg(unix)]
static RUNNING: Mutex<Vec<Pid>> = Mutex::new(Vec::new());

#[cfg(unix)]
fn running() -> MutexGuard<'static, Vec<Pid>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Ends every peer; none starts as long as what is returned lives.
#[cfg(unix)]
pub(in crate::exchange) fn end_all() -> MutexGuard<'static, Vec<Pid>> {
    let running = running();
    running.iter().copied().for_each(end);
    running
}

/// A peer with the processes that it starts.
#[derive(Debug)]
pub(super) struct Group {
    /// Its leader, until it is ended: a number that is free may become another process.
    #[cfg(unix)]
    leader: Option<Pid>,
}

#[cfg(unix)]
impl Group {
    /// Starts `command` as the leader of a group.
    pub(super) fn spawn(command: &mut Command) -> io::Result<(Child, Self)> {
        use std::os::unix::process::CommandExt;
        // A peer that outlives its program computes on for nobody.
        receive_signals()?;
        // Held while it starts, so that no interrupt falls between the start and the entry.
        let mut running = running();
        let child = command.process_group(0).spawn()?;
        let leader = i32::try_from(child.id()).ok().and_then(Pid::from_raw);
        running.extend(leader);
        Ok((child, Self { leader }))
    }

    /// Ends every process of the group; once.
    pub(super) fn end(&mut self) {
        let Some(leader) = self.leader.take() else { return };
        let mut running = running();
        if let Some(place) = running.iter().position(|pid| *pid == leader) {
            running.swap_remove(place);
            end(leader);
        }
    }
}

#[cfg(unix)]
fn end(leader: Pid) {
    // An error means that none of them is left.
    let _ = kill_process_group(leader, Signal::KILL);
}

#[cfg(not(unix))]
impl Group {
    pub(super) fn spawn(command: &mut Command) -> io::Result<(Child, Self)> {
        Ok((command.spawn()?, Self {}))
    }

    #[expect(clippy::unused_self, reason = "as on Unix")]
    pub(super) fn end(&mut self) {}
}
