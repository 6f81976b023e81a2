//! How road users move: three hypotheses side by side (interacting multiple model; Blom,
//! Bar-Shalom 1988), each a Kalman filter on the same state (`hypothesis`).

use nalgebra::{Matrix2, SMatrix, Vector2};

use super::hypothesis::{Covariance, Hypothesis, Model, State};

const MODELS: [Model; 3] = [Model::Standing, Model::Straight, Model::Turning];

/// Probability of each hypothesis after a measurement, given the one before. They mix with
/// measurements rather than with time: a car that is hidden goes on turning.
const TRANSITION: [[f64; 3]; 3] = [
    [0.975, 0.015, 0.010],
    [0.010, 0.960, 0.030],
    [0.010, 0.020, 0.970],
];
/// What a new object does.
const AT_BIRTH: [f64; 3] = [0.5, 0.25, 0.25];

/// What somebody does who was seen to move, and is most likely the same.
const GOING_ON: [f64; 3] = [0.04, 0.48, 0.48];

/// What is slower than this may stand a tenth of a second later.
const STOPPING_MPS: f64 = 0.8;

/// Weight of a measurement in the innovation ratio: the last second of ten a second.
const RATIO_SHARE: f64 = 0.1;

/// Where an object is and how it moves.
#[derive(Debug, Clone)]
pub(super) struct Motion {
    hypotheses: [Hypothesis; 3],
    innovation_ratio: f64,
}

/// What all hypotheses say together.
#[derive(Debug, Clone, Copy)]
pub(super) struct Estimate {
    pub(super) position_m: Vector2<f64>,
    pub(super) velocity_mps: Vector2<f64>,
    pub(super) yaw_rate_radps: f64,
    pub(super) position_covariance: Matrix2<f64>,
    pub(super) velocity_covariance: Matrix2<f64>,
    /// Probability that it stands.
    pub(super) standing: f64,
}

impl Estimate {
    /// Standard deviation of the velocity along either axis, in the mean.
    pub(super) fn velocity_deviation_mps(&self) -> f64 {
        libm::sqrt(0.5 * self.velocity_covariance.trace())
    }
}

impl Motion {
    /// Something seen for the first time, which may move at any speed of `speed_deviation_mps`.
    pub(super) fn new(
        position_m: Vector2<f64>,
        noise: Matrix2<f64>,
        speed_deviation_mps: f64,
    ) -> Self {
        Self {
            hypotheses: std::array::from_fn(|number| Hypothesis {
                probability: AT_BIRTH[number],
                ..Hypothesis::new(MODELS[number], position_m, noise, speed_deviation_mps)
            }),
            innovation_ratio: 1.0,
        }
    }

    /// Carries everything on by some seconds, 0 or more.
    pub(super) fn predict(&mut self, seconds: f64) {
        if seconds <= 0.0 {
            return;
        }
        for (hypothesis, model) in self.hypotheses.iter_mut().zip(MODELS) {
            hypothesis.predict(model, seconds);
        }
    }

    /// Every hypothesis begins with what the others think, as far as they may have turned into it.
    fn mix(&mut self) {
        let before = self.hypotheses.clone();
        // Nothing stops at once: the faster it is, the less likely it stands a moment later.
        let stopping = before.clone().map(|from| {
            let speed_squared = from.state.fixed_rows::<2>(2).norm_squared();
            libm::exp(-0.5 * speed_squared / (STOPPING_MPS * STOPPING_MPS))
        });
        let turning = |from: usize, to: usize| {
            let stops = if from != 0 && to == 0 {
                stopping[from]
            } else {
                1.0
            };
            stops * TRANSITION[from][to]
        };
        for (to, hypothesis) in self.hypotheses.iter_mut().enumerate() {
            let weights: [f64; 3] =
                std::array::from_fn(|from| turning(from, to) * before[from].probability);
            let total: f64 = weights.iter().sum();
            let mut state = State::zeros();
            for (weight, other) in weights.iter().zip(&before) {
                state += other.state * (weight / total);
            }
            let mut covariance = Covariance::zeros();
            for (weight, other) in weights.iter().zip(&before) {
                let apart = other.state - state;
                covariance += (other.covariance + apart * apart.transpose()) * (weight / total);
            }
            *hypothesis = Hypothesis {
                state,
                covariance,
                probability: total,
            };
        }
    }

    /// How large the squares of innovations are beside what covariances say of them, in the mean of the last second: the
    /// variance of the velocity times this is as it should be (covariance matching; Mehra 1972). That of the position is
    /// not: what is seen of a box changes slowly, which no innovation shows.
    pub(super) fn innovation_ratio(&self) -> f64 {
        self.innovation_ratio
    }

    /// Takes in how far off a position is.
    fn note_innovation(&mut self, position_m: Vector2<f64>, noise: Matrix2<f64>) {
        let innovation = position_m - self.position_m();
        if let Some(inverse) = (self.position_covariance() + noise).try_inverse() {
            // Its mean is the number of dimensions.
            let squared = 0.5 * (innovation.transpose() * inverse * innovation)[0];
            self.innovation_ratio += RATIO_SHARE * (squared - self.innovation_ratio);
        }
    }

    /// Takes a position in.
    pub(super) fn measure_position(&mut self, position_m: Vector2<f64>, noise: Matrix2<f64>) {
        self.note_innovation(position_m, noise);
        let mut likelihoods = [0.0; 3];
        for (hypothesis, likelihood) in self.hypotheses.iter_mut().zip(&mut likelihoods) {
            *likelihood = hypothesis.measure_position(position_m, noise);
        }
        self.weigh(likelihoods);
        self.mix();
    }

    /// A wheeled vehicle does not slip: its velocity across `yaw_rad` is 0 within a deviation.
    pub(super) fn measure_no_slip(&mut self, yaw_rad: f64, deviation_mps: f64) {
        let (sine, cosine) = libm::sincos(yaw_rad);
        let mut row = SMatrix::<f64, 1, 5>::zeros();
        (row[2], row[3]) = (-sine, cosine);
        for (hypothesis, model) in self.hypotheses.iter_mut().zip(MODELS) {
            if model != Model::Standing {
                hypothesis.measure_zero(&row, deviation_mps * deviation_mps);
            }
        }
    }

    fn weigh(&mut self, likelihoods: [f64; 3]) {
        /// No hypothesis is ever quite given up.
        const LEAST: f64 = 1e-4;
        let mut total = 0.0;
        for (hypothesis, likelihood) in self.hypotheses.iter_mut().zip(likelihoods) {
            hypothesis.probability *= likelihood;
            total += hypothesis.probability;
        }
        if total < 1e-30 {
            // So far off that rounding decides: what moves freely is right.
            for (hypothesis, probability) in self.hypotheses.iter_mut().zip([0.02, 0.49, 0.49]) {
                hypothesis.probability = probability;
            }
            return;
        }
        for hypothesis in &mut self.hypotheses {
            hypothesis.probability = (hypothesis.probability / total).max(LEAST);
        }
    }

    /// Turns and shifts everything with the frame.
    pub(super) fn reframe(&mut self, sine: f64, cosine: f64, moved: impl Fn([f64; 2]) -> [f64; 2]) {
        let mut turn = Covariance::identity();
        for at in [0, 2] {
            turn[(at, at)] = cosine;
            turn[(at, at + 1)] = -sine;
            turn[(at + 1, at)] = sine;
            turn[(at + 1, at + 1)] = cosine;
        }
        for hypothesis in &mut self.hypotheses {
            let [x, y] = moved([hypothesis.state[0], hypothesis.state[1]]);
            hypothesis.state = turn * hypothesis.state;
            (hypothesis.state[0], hypothesis.state[1]) = (x, y);
            hypothesis.covariance = turn * hypothesis.covariance * turn.transpose();
        }
    }

    /// Believes from now on that it stands: what was never seen to move does not begin to where
    /// nobody sees it.
    pub(super) fn halt(&mut self) {
        for (hypothesis, probability) in self.hypotheses.iter_mut().zip([0.98, 0.01, 0.01]) {
            hypothesis.probability = probability;
            for at in 2..5 {
                hypothesis.state[at] = 0.0;
            }
        }
    }

    /// Goes on, from where it is, as somebody did who turned at a rate: its own velocity is not
    /// known yet.
    pub(super) fn go_on(
        &mut self,
        velocity_mps: Vector2<f64>,
        yaw_rate_radps: f64,
        deviation_mps: f64,
    ) {
        let hypotheses = self.hypotheses.iter_mut().zip(MODELS);
        for ((hypothesis, model), probability) in hypotheses.zip(GOING_ON) {
            hypothesis.probability = probability;
            if model != Model::Standing {
                hypothesis.go_on(velocity_mps, deviation_mps);
            }
            if model == Model::Turning {
                hypothesis.state[4] = yaw_rate_radps;
            }
        }
    }

    /// Shifts the place without a motion: the box turned out to be larger than was thought.
    pub(super) fn shift(&mut self, by_m: Vector2<f64>) {
        for hypothesis in &mut self.hypotheses {
            hypothesis.state[0] += by_m.x;
            hypothesis.state[1] += by_m.y;
        }
    }

    fn total(&self) -> f64 {
        self.hypotheses.iter().map(|one| one.probability).sum()
    }

    /// The state that all hypotheses agree on.
    fn state(&self) -> State {
        let total = self.total();
        let mut state = State::zeros();
        for hypothesis in &self.hypotheses {
            state += hypothesis.state * (hypothesis.probability / total);
        }
        state
    }

    pub(super) fn position_m(&self) -> Vector2<f64> {
        self.state().fixed_rows::<2>(0).into()
    }

    pub(super) fn velocity_mps(&self) -> Vector2<f64> {
        self.state().fixed_rows::<2>(2).into()
    }

    pub(super) fn yaw_rate_radps(&self) -> f64 {
        self.state()[4]
    }

    /// Probability that it stands.
    pub(super) fn standing(&self) -> f64 {
        self.hypotheses[0].probability / self.total()
    }

    pub(super) fn estimate(&self) -> Estimate {
        let total = self.total();
        let state = self.state();
        Estimate {
            position_m: state.fixed_rows::<2>(0).into(),
            velocity_mps: state.fixed_rows::<2>(2).into(),
            yaw_rate_radps: state[4],
            position_covariance: self.spread::<0>(&state, total),
            velocity_covariance: self.spread::<2>(&state, total),
            standing: self.hypotheses[0].probability / total,
        }
    }

    /// Covariance of position or velocity, which are at `AT` in the state that all agree on: what
    /// each hypothesis says, and how far they are apart.
    fn spread<const AT: usize>(&self, state: &State, total: f64) -> Matrix2<f64> {
        let mut covariance = Matrix2::zeros();
        for hypothesis in &self.hypotheses {
            let apart = hypothesis.state.fixed_rows::<2>(AT) - state.fixed_rows::<2>(AT);
            covariance += (hypothesis.covariance.fixed_view::<2, 2>(AT, AT)
                + apart * apart.transpose())
                * (hypothesis.probability / total);
        }
        covariance
    }

    /// Covariance of the position.
    pub(super) fn position_covariance(&self) -> Matrix2<f64> {
        self.spread::<0>(&self.state(), self.total())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Random;

    fn noise(deviation_m: f64) -> Matrix2<f64> {
        Matrix2::identity() * deviation_m * deviation_m
    }

    fn follow(path: impl Fn(f64) -> [f64; 2], seconds: f64) -> Motion {
        follow_with(path, seconds, 0.05)
    }

    /// Somebody whose place is seen within a deviation, and said to be within 0.1 m.
    fn follow_with(path: impl Fn(f64) -> [f64; 2], seconds: f64, off_m: f64) -> Motion {
        let mut random = Random::new(9);
        let mut seen = |at_s: f64| {
            let [x, y] = path(at_s);
            Vector2::new(x + off_m * random.normal(), y + off_m * random.normal())
        };
        let mut motion = Motion::new(seen(0.0), noise(0.1), 6.0);
        for revolution in 1..=(seconds * 10.0) as usize {
            motion.predict(0.1);
            motion.measure_position(seen(0.1 * revolution as f64), noise(0.1));
        }
        motion
    }

    #[test]
    fn what_stands_has_no_speed() {
        let estimate = follow(|_| [3.0, 4.0], 2.0).estimate();
        assert!(estimate.velocity_mps.norm() < 0.05, "{estimate:?}");
        assert!(estimate.standing > 0.8, "{}", estimate.standing);
    }

    #[test]
    fn a_straight_drive_is_known_after_a_second() {
        let estimate = follow(|t| [8.0 * t, 1.0], 1.0).estimate();
        assert!((estimate.velocity_mps.x - 8.0).abs() < 0.4, "{estimate:?}");
        assert!(estimate.standing < 0.01);
    }

    #[test]
    fn innovations_show_whether_noise_is_said_as_it_is() {
        let ratio = |off_m| follow_with(|t| [8.0 * t, 1.0], 5.0, off_m).innovation_ratio();
        assert!(ratio(0.03) < 0.3, "{}", ratio(0.03));
        assert!((0.5..1.5).contains(&ratio(0.1)), "{}", ratio(0.1));
        assert!(ratio(0.2) > 2.0, "{}", ratio(0.2));
    }

    #[test]
    fn a_roundabout_is_a_turn_and_goes_on_unseen() {
        let round = |t: f64| {
            let (sine, cosine) = (0.7 * t).sin_cos();
            [11.0 * cosine, 11.0 * sine]
        };
        let motion = follow(round, 3.0);
        assert!((motion.estimate().yaw_rate_radps - 0.7).abs() < 0.15);
        let mut unseen = motion.clone();
        for _ in 0..10 {
            unseen.predict(0.1);
        }
        let later = unseen.estimate();
        let [x, y] = round(4.0);
        let missed = later.position_m - Vector2::new(x, y);
        assert!(missed.norm() < 1.5, "{missed}");
        assert!(later.position_covariance[(0, 0)] > motion.estimate().position_covariance[(0, 0)]);
    }
}
