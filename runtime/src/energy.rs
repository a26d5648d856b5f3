//! Energies and momenta of a mechanism.

/// Energy of the whole mechanism, J.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Energy<S> {
    /// Of motion.
    pub kinetic: S,
    /// Of gravity and springs.
    pub potential: S,
}

/// Momentum of all moving bodies together, in the base frame.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Momentum<S> {
    /// Their centre of mass, m.
    pub centre: [S; 3],
    /// Linear momentum, kg m/s.
    pub linear: [S; 3],
    /// Angular momentum about that centre, kg m^2/s.
    pub angular: [S; 3],
}
