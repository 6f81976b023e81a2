//! Constant turn rate and velocity: the extended Kalman filter of the thesis' line of work
//! (Schubert, Richter, Wanielik 2008).

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// x, y, yaw, speed along it, rate of turn.
type State = SVector<f64, 5>;
type Covariance = SMatrix<f64, 5, 5>;

/// Standard deviations of what is taken for constant: m/s² and rad/s².
const ACCELERATION_MPS2: f64 = 2.0;
const TURN_RADPS2: f64 = 0.6;
/// Standard deviation of where the middle of a cluster is seen.
const CENTRE_M: f64 = 0.2;
/// Way between two sightings that shows a direction.
const TRAVEL_M: f64 = 0.5;

/// A filter of one object.
#[derive(Debug, Clone)]
pub(super) enum Filter {
    /// Seen, but not moved far enough to know where to.
    Waiting {
        first_m: Vector2<f64>,
        passed_s: f64,
    },
    /// Running.
    Running {
        state: State,
        covariance: Box<Covariance>,
    },
}

impl Filter {
    pub(super) fn new(position_m: Vector2<f64>) -> Self {
        Self::Waiting {
            first_m: position_m,
            passed_s: 0.0,
        }
    }

    /// Carries the state on by `seconds` and takes a position in.
    pub(super) fn step(&mut self, seconds: f64, position_m: Vector2<f64>) {
        match self {
            Self::Waiting { first_m, passed_s } => {
                *passed_s += seconds;
                let travel = position_m - *first_m;
                if travel.norm() > TRAVEL_M && *passed_s > 0.0 {
                    *self = Self::begun(position_m, travel, *passed_s);
                }
            }
            Self::Running { state, covariance } => {
                if seconds > 0.0 {
                    predict(state, covariance, seconds);
                }
                update(state, covariance, position_m);
            }
        }
    }

    fn begun(position_m: Vector2<f64>, travel: Vector2<f64>, passed_s: f64) -> Self {
        let (yaw_rad, speed_mps) = (libm::atan2(travel.y, travel.x), travel.norm() / passed_s);
        let slow = CENTRE_M / travel.norm();
        let variances = [
            CENTRE_M * CENTRE_M,
            CENTRE_M * CENTRE_M,
            slow * slow,
            (CENTRE_M / passed_s) * (CENTRE_M / passed_s),
            0.25,
        ];
        Self::Running {
            state: State::new(position_m.x, position_m.y, yaw_rad, speed_mps, 0.0),
            covariance: Box::new(Covariance::from_diagonal(&State::from(variances))),
        }
    }

    /// Yaw, speed and rate of turn, once they are known.
    pub(super) fn motion(&self) -> Option<[f64; 3]> {
        match self {
            Self::Waiting { .. } => None,
            Self::Running { state, .. } => Some([state[2], state[3], state[4]]),
        }
    }

    /// Standard deviations of yaw and speed.
    pub(super) fn deviations(&self) -> Option<[f64; 2]> {
        match self {
            Self::Waiting { .. } => None,
            Self::Running { covariance, .. } => {
                Some([2, 3].map(|at| libm::sqrt(covariance[(at, at)])))
            }
        }
    }
}

fn predict(state: &mut State, covariance: &mut Covariance, seconds: f64) {
    let (yaw, speed, rate) = (state[2], state[3], state[4]);
    let (sine, cosine) = libm::sincos(yaw);
    let (later_sine, later_cosine) = libm::sincos(yaw + rate * seconds);
    let mut jacobian = Covariance::identity();
    jacobian[(2, 4)] = seconds;
    if rate.abs() < 1e-4 {
        state[0] += speed * cosine * seconds;
        state[1] += speed * sine * seconds;
        (jacobian[(0, 2)], jacobian[(0, 3)]) = (-speed * sine * seconds, cosine * seconds);
        (jacobian[(1, 2)], jacobian[(1, 3)]) = (speed * cosine * seconds, sine * seconds);
    } else {
        let (dx, dy) = ((later_sine - sine) / rate, (cosine - later_cosine) / rate);
        state[0] += speed * dx;
        state[1] += speed * dy;
        (jacobian[(0, 2)], jacobian[(0, 3)]) = (-speed * dy, dx);
        (jacobian[(1, 2)], jacobian[(1, 3)]) = (speed * dx, dy);
        jacobian[(0, 4)] = speed * (seconds * later_cosine - dx) / rate;
        jacobian[(1, 4)] = speed * (seconds * later_sine - dy) / rate;
    }
    state[2] += rate * seconds;
    let mut noise = Covariance::zeros();
    let (push, twist) = (
        0.5 * seconds * seconds * ACCELERATION_MPS2,
        0.5 * seconds * seconds * TURN_RADPS2,
    );
    noise[(0, 0)] = push * push;
    noise[(1, 1)] = push * push;
    noise[(2, 2)] = twist * twist;
    noise[(3, 3)] = (seconds * ACCELERATION_MPS2) * (seconds * ACCELERATION_MPS2);
    noise[(4, 4)] = (seconds * TURN_RADPS2) * (seconds * TURN_RADPS2);
    *covariance = jacobian * *covariance * jacobian.transpose() + noise;
}

fn update(state: &mut State, covariance: &mut Covariance, position_m: Vector2<f64>) {
    let noise = Matrix2::identity() * CENTRE_M * CENTRE_M;
    let spread = covariance.fixed_view::<2, 2>(0, 0) + noise;
    let Some(inverse) = spread.try_inverse() else {
        return;
    };
    let gain = covariance.fixed_view::<5, 2>(0, 0) * inverse;
    let innovation = position_m - state.fixed_rows::<2>(0);
    *state += gain * innovation;
    *covariance -= gain * spread * gain.transpose();
    *covariance = 0.5 * (*covariance + covariance.transpose());
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turn_is_followed() {
        let at = |t: f64| {
            let (sine, cosine) = (0.7 * t).sin_cos();
            Vector2::new(11.0 * cosine, 11.0 * sine)
        };
        let mut filter = Filter::new(at(0.0));
        for revolution in 1..40 {
            filter.step(0.1, at(0.1 * f64::from(revolution)));
        }
        let [_, speed, rate] = filter.motion().unwrap();
        assert!((speed - 7.7).abs() < 0.3, "{speed}");
        assert!((rate - 0.7).abs() < 0.1, "{rate}");
    }

    #[test]
    fn what_stands_has_no_direction() {
        let mut filter = Filter::new(Vector2::new(1.0, 2.0));
        for _ in 0..20 {
            filter.step(0.1, Vector2::new(1.1, 2.0));
        }
        assert_eq!(filter.motion(), None);
    }
}
