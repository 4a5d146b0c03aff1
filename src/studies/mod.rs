//! Questions that take more than one flight: orders, critical velocities, other people's programs.

pub mod peers;
