//! What road users look like.

use crate::random::Random;

/// What a road user is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Class {
    /// A passenger car or a van.
    Car,
    /// A lorry or a bus.
    Truck,
    /// A bicycle or a motorcycle with its rider.
    Cyclist,
    /// Somebody on foot.
    Pedestrian,
}

impl Class {
    /// The word in truth files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Car => "car",
            Self::Truck => "truck",
            Self::Cyclist => "cyclist",
            Self::Pedestrian => "pedestrian",
        }
    }
}

/// A road user's looks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Variant {
    /// What it is.
    pub class: Class,
    /// Length, width and height.
    pub size_m: [f64; 3],
    /// Share of the light that its paint or coat throws back.
    pub reflectance: f64,
    /// Share of rays that pass its windows and come back from nothing of it.
    pub glass: f64,
    /// What somebody on foot has along.
    pub load: Load,
    /// How it is built, beyond its sizes.
    pub build: Build,
}

/// How somebody's vehicle is built, beyond its sizes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Build {
    /// As is common for its class and sizes.
    Common,
    /// A car or a van.
    Car(CarBuild),
    /// A lorry.
    Lorry(LorryBuild),
    /// A bus.
    Bus {
        /// Height at which the windows begin.
        belt_m: f64,
    },
    /// A motorcycle or a scooter.
    Motorcycle,
    /// A bicycle with a box before the rider.
    CargoBicycle,
}

/// The outline of a car.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CarBuild {
    /// From the front to where the screen begins, along the car.
    pub bonnet_m: f64,
    /// From the rear to where the rear screen begins.
    pub boot_m: f64,
    /// Height at which the windows begin.
    pub belt_m: f64,
    /// How far the screen reaches along the car.
    pub screen_m: f64,
    /// The same of the rear screen.
    pub rear_screen_m: f64,
    /// How high the body begins.
    pub sill_m: f64,
    /// How far the sides of the cabin lean in.
    pub lean_rad: f64,
    /// How much is cut off its corners.
    pub corner_m: f64,
    /// Whether there is metal instead of windows behind the front doors.
    pub carries_goods: bool,
    /// Height of a box on its roof; 0 if there is none.
    pub roof_box_m: f64,
}

impl CarBuild {
    /// Notchback, hatchback or van, by its sizes.
    pub(super) fn of([length_m, _, height_m]: [f64; 3]) -> Self {
        let is_van = height_m > 1.75;
        let belt_m = 0.62 * height_m;
        Self {
            bonnet_m: if is_van { 0.16 } else { 0.27 } * length_m,
            boot_m: if length_m > 4.5 && !is_van {
                0.14
            } else {
                0.02
            } * length_m,
            belt_m,
            screen_m: 0.9 * (height_m - belt_m),
            rear_screen_m: if is_van { 0.05 } else { 0.35 },
            sill_m: 0.2,
            lean_rad: 0.26,
            corner_m: 0.3,
            carries_goods: is_van,
            roof_box_m: 0.0,
        }
    }
}

/// What a lorry carries its goods in.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Freight {
    /// A box, or tarpaulins.
    Box,
    /// An open trough.
    Tipper {
        /// Height of its sides.
        side_m: f64,
    },
    /// Goods on a platform, from one share of its length to another.
    Platform {
        /// Both shares.
        reach: [f64; 2],
    },
}

/// How a lorry is built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LorryBuild {
    /// Length of the cab.
    pub cab_m: f64,
    /// Height of the cab's roof.
    pub cab_high_m: f64,
    /// Between the cab and what is behind.
    pub gap_m: f64,
    /// Height of the floor on which the goods stand.
    pub floor_m: f64,
    /// What they are in.
    pub freight: Freight,
    /// Share of the light that it throws back.
    pub goods_reflectance: f64,
    /// Whether something hangs between the wheels: tanks, boxes, side guards.
    pub has_skirt: bool,
}

impl LorryBuild {
    /// A box behind a cab, or a semi-trailer.
    pub(super) const fn of(has_trailer: bool) -> Self {
        let (floor_m, gap_m) = if has_trailer { (1.15, 0.8) } else { (0.9, 0.1) };
        Self {
            cab_m: 1.8,
            cab_high_m: 2.6,
            gap_m,
            floor_m,
            freight: Freight::Box,
            goods_reflectance: 0.6,
            has_skirt: false,
        }
    }
}

/// What somebody on foot carries, pushes, pulls or sits in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Load {
    /// Nothing.
    None,
    /// Something on the back that towers above the head.
    Pack,
    /// An open umbrella.
    Umbrella,
    /// A pram ahead.
    Pram,
    /// A suitcase behind.
    Suitcase,
    /// A wheelchair.
    Wheelchair,
}

/// Glass as on most windows.
const GLASS: f64 = 0.6;

/// Small car, two hatchbacks, two notchbacks, an SUV, a van.
const CARS_M: [[f64; 3]; 7] = [
    [3.6, 1.65, 1.48],
    [4.05, 1.75, 1.45],
    [4.3, 1.8, 1.46],
    [4.65, 1.83, 1.44],
    [4.85, 1.87, 1.45],
    [4.6, 1.9, 1.68],
    [4.9, 1.93, 1.97],
];

impl Variant {
    /// One of the cars, with its paint.
    pub(super) fn car(random: &mut Random) -> Self {
        let size_m = CARS_M[random.below(CARS_M.len())];
        Self {
            class: Class::Car,
            size_m: size_m.map(|metres| metres * (0.97 + 0.06 * random.uniform())),
            reflectance: 0.1 + 0.6 * random.uniform(),
            glass: GLASS,
            load: Load::None,
            build: Build::Common,
        }
    }

    pub(super) fn bus() -> Self {
        Self {
            class: Class::Truck,
            size_m: [12.0, 2.55, 3.1],
            reflectance: 0.5,
            glass: GLASS,
            load: Load::None,
            build: Build::Common,
        }
    }

    pub(super) fn lorry() -> Self {
        Self {
            class: Class::Truck,
            size_m: [7.5, 2.45, 3.3],
            reflectance: 0.5,
            glass: GLASS,
            load: Load::None,
            build: Build::Common,
        }
    }

    pub(super) fn cyclist(random: &mut Random) -> Self {
        Self {
            class: Class::Cyclist,
            size_m: [
                1.68 + 0.14 * random.uniform(),
                0.56 + 0.1 * random.uniform(),
                1.62 + 0.24 * random.uniform(),
            ],
            reflectance: 0.2 + 0.5 * random.uniform(),
            glass: GLASS,
            load: Load::None,
            build: Build::Common,
        }
    }

    pub(super) fn pedestrian(random: &mut Random) -> Self {
        Self {
            class: Class::Pedestrian,
            size_m: [
                0.45,
                0.48 + 0.12 * random.uniform(),
                1.58 + 0.3 * random.uniform(),
            ],
            reflectance: 0.15 + 0.5 * random.uniform(),
            glass: GLASS,
            load: Load::None,
            build: Build::Common,
        }
    }
}
