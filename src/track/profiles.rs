//! What is known of the classes of road users: one table.

use super::Class;

/// The road users that are told apart, in the order of [`super::belief::Belief`].
pub(super) const ROAD_USERS: [Class; 4] = [
    Class::Car,
    Class::Cyclist,
    Class::Pedestrian,
    Class::LargeVehicle,
];

/// No single quality decides alone.
pub(super) const WORST_LOG: f64 = -8.0;
/// What is too fast for a bicycle has a motor.
pub(super) const MOTOR_LOG: f64 = -2.0;

/// An interval with the standard deviation outside of it.
pub(super) struct Within(pub(super) f64, pub(super) f64, pub(super) f64);

impl Within {
    /// Logarithm of the relative probability of a value.
    pub(super) fn log(&self, value: f64) -> f64 {
        self.log_between(value, value)
    }

    /// The same for a value that lies somewhere between two bounds.
    pub(super) fn log_between(&self, low: f64, high: f64) -> f64 {
        let Self(from, to, deviation) = *self;
        let off = (from - high).max(low - to).max(0.0) / deviation;
        (-0.5 * off * off).max(WORST_LOG)
    }
}

/// What is known of a class of road users: sides, top, speed, and how frequent it is.
pub(super) struct Profile {
    pub(super) long_m: Within,
    pub(super) short_m: Within,
    pub(super) whole_m: Within,
    pub(super) wide_m: Within,
    pub(super) across_m: Within,
    pub(super) upper_m: Within,
    pub(super) top_m: Within,
    pub(super) speed_mps: Within,
    /// Logarithm of the probability that is left of it at least, however much faster it moves.
    pub(super) faster_log: f64,
    /// Least that the longer side of what is seen may be while it moves: it may be seen from an end.
    pub(super) end_on_m: f64,
    pub(super) log_prior: f64,
}

/// In the order of [`ROAD_USERS`]. Lengths and widths: cars from the smallest to vans, and for a
/// rear that is all one sees; bicycles with their riders (FGSV, RASt 2006: 1.9 m by 0.8 m at
/// most); people; lorries and buses up to an articulated one (16.5 m, Directive 96/53/EC).
pub(super) const PROFILES: [Profile; 4] = [
    Profile {
        long_m: Within(1.35, 5.3, 0.2),
        short_m: Within(0.1, 2.1, 0.15),
        whole_m: Within(3.1, 5.3, 0.3),
        wide_m: Within(1.2, 2.15, 0.15),
        across_m: Within(0.1, 2.15, 0.15),
        upper_m: Within(0.95, 5.3, 0.12),
        top_m: Within(1.25, 2.1, 0.12),
        speed_mps: Within(0.0, 40.0, 2.0),
        faster_log: WORST_LOG,
        end_on_m: 1.35,
        log_prior: -0.7,
    },
    Profile {
        long_m: Within(0.95, 1.95, 0.14),
        short_m: Within(0.1, 0.85, 0.12),
        whole_m: Within(0.3, 1.95, 0.15),
        wide_m: Within(0.1, 0.95, 0.12),
        across_m: Within(0.1, 0.85, 0.12),
        upper_m: Within(0.1, 0.95, 0.12),
        top_m: Within(1.4, 1.95, 0.12),
        speed_mps: Within(1.9, 8.5, 0.45),
        faster_log: MOTOR_LOG,
        end_on_m: 0.4,
        log_prior: -1.6,
    },
    Profile {
        long_m: Within(0.2, 0.85, 0.09),
        short_m: Within(0.05, 0.7, 0.1),
        whole_m: Within(0.1, 0.95, 0.12),
        wide_m: Within(0.1, 0.95, 0.12),
        across_m: Within(0.1, 0.85, 0.1),
        upper_m: Within(0.1, 0.85, 0.1),
        top_m: Within(1.3, 1.95, 0.12),
        speed_mps: Within(0.0, 2.3, 0.35),
        faster_log: WORST_LOG,
        end_on_m: 0.2,
        log_prior: -1.6,
    },
    Profile {
        long_m: Within(5.0, 16.5, 1.1),
        short_m: Within(0.1, 2.8, 0.2),
        whole_m: Within(5.0, 18.0, 0.5),
        wide_m: Within(1.5, 2.8, 0.2),
        across_m: Within(0.1, 2.8, 0.2),
        upper_m: Within(1.3, 18.0, 0.2),
        top_m: Within(2.3, 4.0, 0.12),
        speed_mps: Within(0.0, 30.0, 2.0),
        faster_log: WORST_LOG,
        end_on_m: 1.7,
        log_prior: -1.3,
    },
];
