//! Where somebody leaves the circle: nobody says so, but he has more exits before him when he has just come in.

use super::site::Site;

/// Probability that one stays at an exit of whom it is not known where he came in: unknown.
const STAYS: f64 = 0.6;
/// Of those who leave where they came in, and of those who go round once more, beside one who leaves at any other
/// arm, all of which are as probable: unknown, one in twenty at four arms.
const TURNS_BACK: f64 = 0.15;
const GOES_ON: f64 = 0.15;

/// So far into an exit one may have come from the circle.
pub(super) const MOUTH_M: f64 = 6.0;

/// Probability that somebody who is at a direction from the middle, and came in by an arm, is still on the circle so
/// much further round.
pub(super) fn still_there(site: &Site, angle_rad: f64, round_rad: f64, from: Option<usize>) -> f64 {
    let away_rad = |arm: usize| {
        let exit = site.arms[arm].exits.first()?;
        Some(site.round_rad(angle_rad, exit.mouth_rad))
    };
    let own = from.and_then(|own| Some((own, away_rad(own)?)));
    let share = |arm: usize, away_rad: f64| match own {
        Some((own, _)) if arm == own => TURNS_BACK,
        Some((_, own_rad)) if away_rad > own_rad => 0.0,
        _ => 1.0,
    };
    let (mut all, mut left) = (GOES_ON, 0.0);
    for arm in 0..site.arms.len() {
        let Some(away_rad) = away_rad(arm) else {
            continue;
        };
        let share = share(arm, away_rad);
        all += share;
        if away_rad < round_rad {
            left += share;
        }
    }
    match own {
        Some(_) => 1.0 - left / all,
        None => libm::pow(STAYS, left),
    }
}

/// Probability that somebody on the circle takes the exit of an arm when he comes to it.
pub(super) fn takes(site: &Site, arm: usize, from: Option<usize>) -> f64 {
    /// Only this exit is passed so soon.
    const JUST_BEHIND_RAD: f64 = 1e-6;
    let exit = site.arms[arm].exits.first();
    exit.map_or(0.0, |exit| {
        1.0 - still_there(site, exit.mouth_rad, JUST_BEHIND_RAD, from)
    })
}
