//! What the odometry says of a revolution.

/// What became of a revolution.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct OdometryReport {
    /// Features that were aligned.
    pub features: usize,
    /// Those with a surface of the map near them.
    pub met: usize,
    /// Those that lie on it.
    pub fitting: usize,
    /// Root mean square of how far these lie off it.
    pub off_m: f64,
    /// Standard deviation of the place that the revolution alone gives, in the direction along the ground in which it
    /// tells least.
    pub deviation_m: f64,
    /// How the motion is followed.
    pub quality: Quality,
}

/// How the motion is followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum Quality {
    /// Not from what is seen.
    #[default]
    Off,
    /// A map has begun, and no motion is known yet.
    Begun,
    /// By what is seen.
    Following,
    /// What is seen does not tell all of it: a plain, a tunnel. Prediction and poses tell the rest.
    Degenerate,
    /// What is seen does not fit: prediction and poses alone.
    Lost,
}

impl Quality {
    /// How Status names it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Begun => "begun",
            Self::Following => "following",
            Self::Degenerate => "degenerate",
            Self::Lost => "lost",
        }
    }
}
