//! What a road user is.

/// What a road user is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// Nobody can tell.
    Unclassified,
    /// A passenger car or a van.
    Car,
    /// A bicycle or a motorcycle with its rider.
    Cyclist,
    /// Somebody on foot, or a few side by side who cannot be told apart.
    Pedestrian,
    /// A lorry or a bus.
    LargeVehicle,
}

impl Class {
    /// The number on the wire.
    pub const fn number(self) -> u32 {
        match self {
            Self::Unclassified => 0,
            Self::Car => 1,
            Self::Cyclist => 2,
            Self::Pedestrian => 3,
            Self::LargeVehicle => 4,
        }
    }

    /// Every class, in the order of their numbers.
    const ALL: [Self; 5] = [
        Self::Unclassified,
        Self::Car,
        Self::Cyclist,
        Self::Pedestrian,
        Self::LargeVehicle,
    ];

    /// The class with a number on the wire.
    pub fn from_number(number: u32) -> Option<Self> {
        Self::ALL.into_iter().find(|class| class.number() == number)
    }

    /// The word in files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Unclassified => "unclassified",
            Self::Car => "car",
            Self::Cyclist => "cyclist",
            Self::Pedestrian => "pedestrian",
            Self::LargeVehicle => "truck",
        }
    }
}
