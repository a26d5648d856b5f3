//! Typed indices into the lists of a model; file order, shared by every later stage.

macro_rules! index {
    ($(#[$doc:meta])* $name:ident) => {
        $(#[$doc])*
        #[derive(
            Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, serde::Serialize, serde::Deserialize,
        )]
        pub struct $name(pub usize);

        impl $name {
            /// Returns the position in the list that it indexes.
            pub fn index(self) -> usize {
                self.0
            }
        }
    };
}
pub(crate) use index;

index!(
    /// A body, in file order.
    BodyId
);
index!(
    /// A joint, in file order: the order of the coordinates q and speeds u.
    JointId
);
index!(
    /// A coordinate, an entry of q: the angles of the joints in file order, then seven of each free body.
    CoordinateId
);
index!(
    /// A speed, an entry of u: those of the joints in file order, then six of each free body.
    SpeedId
);
index!(
    /// A parameter: the declared parameters in file order, then those made by `tunable`.
    ParameterId
);
index!(
    /// An input, in file order.
    InputId
);
index!(
    /// An output point, in file order.
    PointId
);
index!(
    /// A number that a controller remembers, in file order, those of the first controller first.
    MemoryId
);
index!(
    /// A contact, in file order.
    ContactId
);

impl JointId {
    /// Returns its coordinate, the angle.
    pub fn coordinate(self) -> CoordinateId {
        CoordinateId(self.0)
    }

    /// Returns its speed.
    pub fn speed(self) -> SpeedId {
        SpeedId(self.0)
    }
}
