//! A scene: projectile, target, resistance and criterion in SI units, and the stages it resolves into.
//!
//! Reading a scene from a file is [`super::scene_file`]; here every number is already admissible.

use super::stage::Stage;

/// What the projectile meets.
#[derive(Clone, Debug, PartialEq)]
pub enum Resistance {
    /// Eq. 4-5: a crater `F = c x` to k d, then a tunnel `F = P + Q V²`.
    Concrete(Concrete),
    /// Stages given outright.
    Stages(Vec<Stage>),
}

/// The numbers of Eq. 4-5, 13 and 14.
#[derive(Clone, Debug, PartialEq)]
pub struct Concrete {
    /// Projectile diameter d [m].
    pub diameter: f64,
    /// Nose factor N*, 0 to 1.
    pub nose_factor: f64,
    /// Unconfined compressive strength fc [Pa].
    pub strength: f64,
    /// Density rho [kg/m³].
    pub density: f64,
    /// Static strength over fc, S (Eq. 14 when not given).
    pub static_factor: f64,
    /// Inertia factor B.
    pub inertia_factor: f64,
    /// Crater depth in diameters, k.
    pub crater_ratio: f64,
    /// How the crater constant c is chosen.
    pub crater_stiffness: CraterStiffness,
    /// Layers in place of one strength and density; empty for a homogeneous target.
    pub layers: Vec<Layer>,
}

/// The crater constant c (theory section 1).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CraterStiffness {
    /// The force is continuous at x = k d: `c = M (P + Q V0²)/(k d (M + k d Q))`.
    Continuous,
    /// A given value [N/m]; the force generally jumps at k d.
    Given(f64),
}

/// One layer of a target.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Layer {
    /// Thickness [m]; infinite in a semi-infinite last layer.
    pub thickness: f64,
    /// Unconfined compressive strength fc [Pa]; 0 is an air gap.
    pub strength: f64,
    /// Density rho [kg/m³].
    pub density: f64,
    /// Static strength over fc, S.
    pub static_factor: f64,
    /// Linear viscosity r [kg/s].
    pub viscosity: f64,
}

/// When the target counts as perforated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Criterion {
    /// x = H, the paper's.
    #[default]
    FullDepth,
    /// x = x_p(H), the penetration that perforates by the ACE/NDRC relation (theory section 4).
    Ndrc,
}

/// A scene in SI units, admissible throughout.
#[derive(Clone, Debug, PartialEq)]
pub struct Scene {
    /// Title for people.
    pub title: Option<String>,
    /// Projectile mass M [kg].
    pub mass: f64,
    /// What it meets.
    pub resistance: Resistance,
    /// Target thickness H [m]; `None` for a semi-infinite target.
    pub thickness: Option<f64>,
    /// When it counts as perforated.
    pub criterion: Criterion,
    /// Impact velocity V0 [m/s], where the scene gives one.
    pub velocity: Option<f64>,
}
