//! One hypothesis of how a road user moves: a Kalman filter.
//!
//! The state is Cartesian, so that a first sighting, whose heading nobody knows, is a velocity
//! of 0 with an honest variance rather than a heading that must be made up.

use std::ops::AddAssign;

use nalgebra::{Matrix2, SMatrix, SVector, Vector2};

/// x, y, their velocities, and the rate of turn.
pub(super) type State = SVector<f64, 5>;
pub(super) type Covariance = SMatrix<f64, 5, 5>;

/// A hypothesis of motion.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Model {
    /// It stands.
    Standing,
    /// It goes straight on.
    Straight,
    /// It turns at a rate of its own.
    Turning,
}

/// How lively each hypothesis is: drift of the place, m/√s; acceleration along either axis,
/// m/s²; change of the rate of turn, rad/s². Who goes straight on does so evenly, and who brakes is rather taken for
/// one who turns: with 1.0 instead of 0.3 the speed of people is off by 0.13 instead of 0.08 m/s, that of cyclists by 0.29
/// instead of 0.23 (`scripts/evaluate --seeds 31-32`).
const DRIFT: f64 = 0.03;
const STRAIGHT_MPS2: f64 = 0.3;
const TURNING_MPS2: f64 = 2.0;
const TURNING_RADPS2: f64 = 0.7;
/// Velocity that a standing object has at most, m/s, and rate of turn of a straight one, rad/s.
const STILL_MPS: f64 = 0.02;
const STRAIGHT_RADPS: f64 = 0.01;
/// Standard deviation of the speed of what turns: at 100 km/h nothing does.
const TURNING_MPS: f64 = 6.0;
/// Of a rate of turn that was not measured yet: a car in a small roundabout has 0.7.
const UNKNOWN_RADPS: f64 = 0.4;
/// Tighter turns are noise.
const TIGHTEST_RADPS: f64 = 1.5;

/// What an object does, if it moves as the model says, and how likely that is.
#[derive(Debug, Clone)]
pub(super) struct Hypothesis {
    pub(super) state: State,
    pub(super) covariance: Covariance,
    pub(super) probability: f64,
}

impl Hypothesis {
    /// Of something seen for the first time, which may move at any speed of
    /// `speed_deviation_mps`; certain for now.
    pub(super) fn new(
        model: Model,
        position_m: Vector2<f64>,
        noise: Matrix2<f64>,
        speed_deviation_mps: f64,
    ) -> Self {
        let mut state = State::zeros();
        state.fixed_rows_mut::<2>(0).copy_from(&position_m);
        let mut covariance = Covariance::zeros();
        covariance.fixed_view_mut::<2, 2>(0, 0).copy_from(&noise);
        let (speed, turn) = match model {
            Model::Standing => (STILL_MPS, STRAIGHT_RADPS),
            Model::Straight => (speed_deviation_mps, STRAIGHT_RADPS),
            Model::Turning => (speed_deviation_mps.min(TURNING_MPS), UNKNOWN_RADPS),
        };
        covariance[(2, 2)] = speed * speed;
        covariance[(3, 3)] = speed * speed;
        covariance[(4, 4)] = turn * turn;
        Self {
            state,
            covariance,
            probability: 1.0,
        }
    }

    /// Carries it on by some seconds.
    pub(super) fn predict(&mut self, model: Model, seconds: f64) {
        match model {
            Model::Standing => self.stay(),
            Model::Straight => self.go_straight(seconds),
            Model::Turning => {
                let (state, jacobian) = turned(&self.state, seconds);
                self.state = state;
                self.covariance = jacobian * self.covariance * jacobian.transpose();
            }
        }
        let (acceleration, turn) = match model {
            Model::Standing => (0.0, 0.0),
            Model::Straight => (STRAIGHT_MPS2, 0.0),
            Model::Turning => (TURNING_MPS2, TURNING_RADPS2),
        };
        let mut noise = Covariance::zeros();
        let (a, t) = (acceleration * acceleration * seconds, seconds);
        for (at, speed) in [(0, 2), (1, 3)] {
            // White acceleration (Bar-Shalom, Li, Kirubarajan 2001, section 6.2.2).
            noise[(at, at)] = a * t * t / 3.0 + DRIFT * DRIFT * t;
            noise[(at, speed)] = a * t / 2.0;
            noise[(speed, at)] = a * t / 2.0;
            noise[(speed, speed)] = a;
        }
        noise[(4, 4)] = turn * turn * seconds;
        if model == Model::Standing {
            (noise[(2, 2)], noise[(3, 3)]) = (STILL_MPS * STILL_MPS, STILL_MPS * STILL_MPS);
        }
        if model != Model::Turning {
            noise[(4, 4)] = STRAIGHT_RADPS * STRAIGHT_RADPS;
        }
        self.covariance += noise;
    }

    /// Keeps only the place.
    fn stay(&mut self) {
        let place = self.covariance.fixed_view::<2, 2>(0, 0).into_owned();
        self.covariance = Covariance::zeros();
        self.covariance
            .fixed_view_mut::<2, 2>(0, 0)
            .copy_from(&place);
        self.state.fixed_rows_mut::<3>(2).fill(0.0);
    }

    /// Goes on without a turn: the transition adds ways to places and forgets the rate of turn.
    fn go_straight(&mut self, seconds: f64) {
        for (at, speed) in [(0, 2), (1, 3)] {
            self.state[at] += seconds * self.state[speed];
            let way = seconds * self.covariance.row(speed);
            self.covariance.row_mut(at).add_assign(&way);
        }
        for (at, speed) in [(0, 2), (1, 3)] {
            let way = seconds * self.covariance.column(speed);
            self.covariance.column_mut(at).add_assign(&way);
        }
        self.state[4] = 0.0;
        self.covariance.row_mut(4).fill(0.0);
        self.covariance.column_mut(4).fill(0.0);
    }

    /// Takes a position in; gives its likelihood.
    pub(super) fn measure_position(
        &mut self,
        position_m: Vector2<f64>,
        noise: Matrix2<f64>,
    ) -> f64 {
        let innovation = position_m - self.state.fixed_rows::<2>(0);
        let spread = self.covariance.fixed_view::<2, 2>(0, 0) + noise;
        let determinant = spread.determinant().max(1e-12);
        let Some(inverse) = spread.try_inverse() else {
            return 0.0;
        };
        let gain = self.covariance.fixed_view::<5, 2>(0, 0) * inverse;
        self.state += gain * innovation;
        self.state[4] = self.state[4].clamp(-TIGHTEST_RADPS, TIGHTEST_RADPS);
        self.covariance -= gain * spread * gain.transpose();
        self.settle();
        let squared = (innovation.transpose() * inverse * innovation)[0];
        libm::exp(-0.5 * squared) / libm::sqrt(determinant)
    }

    /// Takes in that a combination of the state is 0.
    pub(super) fn measure_zero(&mut self, row: &SMatrix<f64, 1, 5>, variance: f64) {
        let spread = (row * self.covariance * row.transpose())[0] + variance;
        let gain = self.covariance * row.transpose() / spread;
        let measured = (row * self.state)[0];
        self.state -= gain * measured;
        self.covariance -= gain * spread * gain.transpose();
        self.settle();
    }

    /// Takes over a velocity, as sure as it is.
    pub(super) fn go_on(&mut self, velocity_mps: Vector2<f64>, deviation_mps: f64) {
        self.state.fixed_rows_mut::<2>(2).copy_from(&velocity_mps);
        for at in 2..4 {
            self.covariance.row_mut(at).fill(0.0);
            self.covariance.column_mut(at).fill(0.0);
            self.covariance[(at, at)] = deviation_mps * deviation_mps;
        }
    }

    /// Keeps the covariance symmetric and its diagonal positive, against rounding.
    fn settle(&mut self) {
        self.covariance = 0.5 * (self.covariance + self.covariance.transpose());
        for at in 0..5 {
            self.covariance[(at, at)] = self.covariance[(at, at)].max(1e-8);
        }
    }
}

/// A turn at a constant rate, and its derivative by the state (Bar-Shalom, Li, Kirubarajan 2001,
/// section 11.7.1).
fn turned(state: &State, seconds: f64) -> (State, Covariance) {
    let (vx, vy, rate) = (state[2], state[3], state[4]);
    let turn = rate * seconds;
    let (sine, cosine) = libm::sincos(turn);
    let mut jacobian = Covariance::identity();
    // Ways ahead and aside for a unit of speed, and their derivatives by the rate.
    let (ahead, aside, ahead_rate, aside_rate) = if turn.abs() < 1e-4 {
        let t = seconds;
        (t, 0.5 * turn * t, -turn * t * t / 3.0, 0.5 * t * t)
    } else {
        (
            sine / rate,
            (1.0 - cosine) / rate,
            (turn * cosine - sine) / (rate * rate),
            (turn * sine - 1.0 + cosine) / (rate * rate),
        )
    };
    jacobian[(0, 2)] = ahead;
    jacobian[(0, 3)] = -aside;
    jacobian[(1, 2)] = aside;
    jacobian[(1, 3)] = ahead;
    jacobian[(2, 2)] = cosine;
    jacobian[(2, 3)] = -sine;
    jacobian[(3, 2)] = sine;
    jacobian[(3, 3)] = cosine;
    let next = jacobian * state;
    jacobian[(0, 4)] = vx * ahead_rate - vy * aside_rate;
    jacobian[(1, 4)] = vx * aside_rate + vy * ahead_rate;
    jacobian[(2, 4)] = seconds * (-sine * vx - cosine * vy);
    jacobian[(3, 4)] = seconds * (cosine * vx - sine * vy);
    (next, jacobian)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_derivative_of_a_turn_is_its_difference() {
        let state = State::new(1.0, 2.0, 5.0, -3.0, 0.4);
        let (next, jacobian) = turned(&state, 0.1);
        for at in 0..5 {
            let mut moved = state;
            moved[at] += 1e-6;
            let difference = (turned(&moved, 0.1).0 - next) / 1e-6;
            assert!((difference - jacobian.column(at)).norm() < 1e-4, "{at}");
        }
    }
}
