//! Sections of the generated code. A section belongs to one body or loop and to one phase of the
//! derivation.
//!
//! The equation of every phase is defined only here; printers show it above the statements of the
//! phase.
//!
//! Symbols of the equations: R rotation from a body's frame to its parent's, e_x hinge axis,
//! r offset of the frame's origin from the parent's, w angular velocity, v velocity of the origin,
//! alpha and a their velocity-product accelerations (at du/dt = 0), m mass, h first moment,
//! S second moments, I rotational inertia, (f, n) wrench: force and moment about the origin.

use serde::{Deserialize, Serialize};

use crate::topology::{LoopId, NodeId};

/// The place of an intermediate in the generated code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct Section {
    /// The body or loop.
    pub subject: Subject,
    /// The phase of the derivation.
    pub phase: Phase,
}

/// The body or loop that an intermediate describes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Subject {
    /// The whole mechanism.
    Mechanism,
    /// A body of the tree, or the ghost of a body at which a loop is cut.
    Body(NodeId),
    /// A loop.
    Loop(LoopId),
}

impl Subject {
    /// The subject of what belongs to a node, or to the ground.
    pub fn of(node: Option<NodeId>) -> Self {
        node.map_or(Self::Mechanism, Self::Body)
    }
}

impl Section {
    /// Returns the section of a phase of the whole mechanism.
    pub fn mechanism(phase: Phase) -> Self {
        Self { subject: Subject::Mechanism, phase }
    }

    /// Returns the section of a phase of a body.
    pub fn body(node: NodeId, phase: Phase) -> Self {
        Self { subject: Subject::Body(node), phase }
    }

    /// Returns the section of a phase of a loop.
    pub fn closure(closed: LoopId, phase: Phase) -> Self {
        Self { subject: Subject::Loop(closed), phase }
    }

    /// Returns one line for the reader of the generated code,
    /// `south: angular velocity: w = R^T w_parent + u e_x`. `names` are the names of the nodes.
    pub fn heading(self, names: &[String]) -> String {
        let (subject, phase) = (self.subject.name(names), self.phase);
        format!("{subject}: {}: {}", phase.title(), phase.equation())
    }
}

impl Subject {
    /// Returns `mechanism`, the name of the body, or `loop 0`. `names` are the names of the nodes.
    pub fn name(self, names: &[String]) -> String {
        match self {
            Self::Mechanism => "mechanism".to_owned(),
            Self::Body(node) => names[node.index()].clone(),
            Self::Loop(id) => format!("loop {}", id.index()),
        }
    }
}

/// Declares [`Phase`] from one table with variant, title and equation.
macro_rules! phases {
    ($($variant:ident, $title:literal, $equation:literal;)*) => {
        /// A phase of the derivation, in the order of the derivation.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
        pub enum Phase {
            $(
                #[doc = concat!($title, ": `", $equation, "`.")]
                $variant,
            )*
        }

        impl Phase {
            /// Every phase, in order.
            pub const ALL: &[Self] = &[$(Self::$variant),*];

            /// Returns what the phase computes, for example `angular velocity`.
            pub fn title(self) -> &'static str {
                match self {
                    $(Self::$variant => $title,)*
                }
            }

            /// Returns the equation of the phase in readable form, for example
            /// `w = R^T w_parent + u e_x`.
            pub fn equation(self) -> &'static str {
                match self {
                    $(Self::$variant => $equation,)*
                }
            }
        }
    };
}

phases! {
    Drawing, "number of the drawing", "what follows from the parameters alone";
    Formula, "formula of the model", "the model's operations, in their order";
    HingeAngle, "hinge angle", "s = sin q, c = cos q";
    Orientation, "orientation of a free body", "A = 1 + 2 w [v]x + 2 [v]x [v]x, v = (x, y, z)";
    Placement, "placement", "A = A_parent R, p = p_parent + A_parent r";
    AngularVelocity, "angular velocity", "w = R^T w_parent + u e_x";
    Velocity, "velocity", "v = R^T (v_parent + w_parent x r)";
    AngularVelocityProduct, "velocity-product angular acceleration",
        "alpha = R^T alpha_parent + w x u e_x";
    VelocityProduct, "velocity-product acceleration", "a = R^T (a_parent + E_parent r)";
    AccelerationGradient, "acceleration gradient", "E = [alpha]x + w w^T - (w . w) 1";
    PartialVelocity, "partial velocities", "dw/du, dv/du";
    ApparentGravity, "apparent gravity", "g - a = R^T ((g - a)_parent - E_parent r)";
    AppliedForce, "applied force", "f = A^T F, n = p_F x f";
    TendonLength, "length of a tendon", "l = sum |d_k|, d_k = P_(k+1) - P_k, e_k = d_k / |d_k|";
    TendonForce, "force of a tendon", "T = k (l - l0) + b dl/dt, f_k = T A^T (e_k - e_(k-1))";
    TwistAngle, "twist",
        "angle = atan2(z1.n2 - n1.z2, n1.n2 + z1.z2), g = (d1 + d2) / (1 + d1.d2)";
    TwistTorque, "torque of a torsion spring", "n = -(k (angle - rest) + b d(angle)/dt) A^T g";
    MotorTorque, "motor", "i = (V - c N u) / R, torque = N c i";
    AirDrag, "air drag", "f = -(density drag area / 2) |v_n| v_n e_n";
    Contact, "contact", "f = k d max(0, 1 + c d'), along n; -mu f v_t / sqrt(v_t^2 + s^2)";
    BiasForce, "bias force", "f = m (g - a) - E h + applied, n = h x (g - a) - E x S + applied";
    JointTorque, "joint torque", "tau = torque - k (q - rest) - k3 (q - rest)^3 - d u - friction";
    GeneralizedForce, "generalized force",
        "F = dw/du . n + dv/du . f + tau, (f, n) of all beyond the hinge";
    CompositeInertia, "composite inertia", "m, h, S of all beyond the hinge";
    MassMatrix, "mass matrix", "M_rs = dw_r . n_s + dv_r . f_s, (f_s, n_s) = inertia (dw_s, dv_s)";
    KineticEnergy, "kinetic energy", "m v . v / 2 + v . (w x h) + w . I w / 2";
    PotentialEnergy, "potential energy",
        "-g . (m p + A h), k bend^2 / 2 + k3 bend^4 / 4, k d^2 / 2";
    ClosurePoint, "closure points", "P = p + A p_P, from the common ancestor of both sides";
    ClosureResidual, "closure residual", "P_ghost - P_original";
    ClosureJacobian, "closure Jacobian", "J = d(V_ghost - V_original)/du";
    ClosureBias, "closure acceleration bias", "gamma = A_ghost - A_original at du/dt = 0";
    ResidualJacobian, "Jacobian of the closure residual", "dP/dq = e_x x (P - p)";
    ArticulatedInertia, "articulated inertia",
        "D = I_xx, W = (I, H)_x / D, to the parent: (I, H, M) - D W W^T";
    ArticulatedBiasForce, "articulated bias force",
        "y = tau + n_x, to the parent: (f, n) - W y";
    ClosureRowForce, "unit force along a row of the closure", "n = P x f";
    ReducedClosureJacobian, "reduced closure Jacobian", "Y = J L^-1";
    JointAcceleration, "joint acceleration", "du/dt = y / D - W . (a, alpha)_parent";
    GivenAcceleration, "acceleration at given du/dt",
        "alpha = R^T alpha_parent + w x u e_x + du/dt e_x";
    InverseDynamics, "inverse dynamics", "(f, n) of all beyond the hinge at given du/dt";
    ClosureForce, "closure forces", "(f, n) of lambda along the rows of the closure";
    HingeReaction, "hinge reaction", "-(f, n) of all beyond the hinge";
    MassFactor, "factor of the mass matrix", "M = L^T D L";
    ReducedForce, "reduced force", "y = L^-T f";
    ClosureFactor, "factor of the closure", "S = Y D^-1 Y^T = L_S D_S L_S^T";
    ClosureConditioning, "conditioning of the closure", "a lower bound, of the eigenvalues of S";
    Multiplier, "closure multipliers", "S lambda = -gamma - Y D^-1 y";
    Acceleration, "acceleration", "du/dt = L^-1 D^-1 (y + Y^T lambda)";
    Correction, "projection", "L^-1 D^-1 Y^T S^-1 x";
    Elimination, "elimination of the closure", "rows of J less multiples of pivot rows";
    NullSpace, "null space of the closure", "J N = 0";
    DependentPart, "speeds that follow from the closure", "J p = b, zero for independent joints";
    NullSpaceMotion, "motion along the null space", "w, v at u = N e_k, momenta m v + w x h, I w + h x v";
    IndependentInertia, "inertia of the independent speeds", "N^T M N = L D L^T";
    IndependentAcceleration, "independent accelerations", "N^T M N y = N^T (f - M p)";
    Combination, "accelerations of all joints", "du/dt = N y + p";
    EliminationMargin, "margin of the elimination", "its smallest pivot, its largest entry of N";
    Momentum, "momentum", "m v + w x h, I w + h x v + (p - centre) x (m v + w x h)";
    FreeElimination, "factor of a free body's inertia", "(I, H, M) = L^T D L";
    Output, "results", "what the function returns";
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Maximum number of columns in a heading, without the name of the body.
    const WIDEST_HEADING: usize = 88;

    #[test]
    fn headings_name_body_phase_and_equation() {
        let names = ["west".to_owned(), "south".to_owned()];
        let heading = |section: Section| section.heading(&names);
        assert_eq!(
            heading(Section::body(NodeId(1), Phase::AngularVelocity)),
            "south: angular velocity: w = R^T w_parent + u e_x"
        );
        assert_eq!(
            heading(Section::closure(LoopId(0), Phase::ClosureJacobian)),
            "loop 0: closure Jacobian: J = d(V_ghost - V_original)/du"
        );
        assert_eq!(
            heading(Section::mechanism(Phase::MassFactor)),
            "mechanism: factor of the mass matrix: M = L^T D L"
        );
    }

    #[test]
    fn phases_are_told_apart_and_fit_in_one_line() {
        for (index, phase) in Phase::ALL.iter().enumerate() {
            let (title, equation) = (phase.title(), phase.equation());
            assert!(title.len() + equation.len() <= WIDEST_HEADING, "{phase:?} is too long");
            let earlier = &Phase::ALL[..index];
            assert!(earlier.iter().all(|other| other.title() != title), "{phase:?}: {title}");
        }
    }
}
