//! Questions asked of many flights: what an integrator's answers say together.

pub mod critical_velocity;
