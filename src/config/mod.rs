//! What a user may set: the parameters of all stages together, and their text form.

#[cfg(feature = "text")]
pub mod text;

use crate::cloud::CloudParameters;
use crate::cluster::ClusterParameters;
use crate::ego::EgoParameters;
use crate::grid::GridParameters;
use crate::ground::GroundParameters;
use crate::parameter::{Addresses, Profile, Section, Value, parameters};
use crate::publish::PublishParameters;
use crate::roundabout::RoundaboutParameters;
use crate::track::TrackParameters;

parameters! {
    /// The session on the network. Nothing here changes what is perceived.
    pub struct SessionParameters "session" {
        /// Hops that our datagrams may take. 1 keeps them on the local network.
        ttl: usize = 1, in 0..=255, "hops";
        /// Receive buffer to ask of the kernel, which doubles it for its own needs and grants no
        /// more than net.core.rmem_max to a process without privileges. 4 MB hold 11 s of a
        /// VLP-16 at 10 Hz, the usual limit of 0.2 MB holds 0.6 s.
        receive_buffer_mb: f64 = 4.0, in 0.2..=256.0, "MB";
        /// Revolutions that may wait for the pipeline. When another one comes, the oldest is
        /// dropped and counted.
        queue_revolutions: usize = 8, in 1..=64, "revolutions";
        /// Share of the revolutions of the last 10 to 20 s that may be missed, by their time stamps, before the service says
        /// that it is degraded.
        most_missed_share: f64 = 0.05, in 0.0..=1.0, "";
        /// Hosts whose point clouds and poses are taken, as "10.0.0.1, 10.0.0.2". If empty, of each message and
        /// senderStamp those of the first host that sends a sound one, until it is silent for a second.
        sources: Addresses = Addresses::default(), "";
    }
}

/// Every parameter of the service. A value that came through [`text`] is within its range.
#[derive(Debug, Clone, PartialEq)]
pub struct Configuration {
    /// Where values that are not given come from.
    pub profile: Profile,
    /// Step one behind the wire.
    pub cloud: CloudParameters,
    /// Poses of the vehicle.
    pub ego: EgoParameters,
    /// Ground plane.
    pub ground: GroundParameters,
    /// DBSCAN.
    pub cluster: ClusterParameters,
    /// Identities and objects.
    pub track: TrackParameters,
    /// The map of the static world.
    pub grid: GridParameters,
    /// Roundabouts and the gap.
    pub roundabout: RoundaboutParameters,
    /// What is sent.
    pub publish: PublishParameters,
    /// The network.
    pub session: SessionParameters,
}

/// Pairs of parameters, as section and name, of which the first may not be above the second.
pub const RELATIONS: [[&str; 2]; 14] = [
    ["cloud.minimum_range_m", "cloud.maximum_range_m"],
    ["cloud.vehicle_x_low_m", "cloud.vehicle_x_high_m"],
    ["cloud.vehicle_y_low_m", "cloud.vehicle_y_high_m"],
    ["cloud.vehicle_z_low_m", "cloud.vehicle_z_high_m"],
    ["ground.height_low_m", "ground.height_high_m"],
    ["cluster.min_points_far", "cluster.min_points"],
    ["track.lowest_object_m", "track.highest_object_m"],
    ["track.lowest_object_m", "cluster.highest_m"],
    ["grid.obstacle_low_m", "grid.obstacle_high_m"],
    ["grid.low_pass_m", "grid.obstacle_high_m"],
    ["grid.cell_m", "grid.reach_m"],
    ["grid.nearest_m", "grid.reach_m"],
    ["grid.reach_m", "grid.keep_m"],
    ["grid.lowest_probability", "grid.highest_probability"],
];

/// Most memory that a map may take, in megabytes.
pub const MOST_MAP_MB: f64 = 2000.0;

impl Configuration {
    /// The value of a parameter by section and name, as in [`RELATIONS`].
    pub fn value(&self, name: &str) -> Option<Value> {
        let (section, key) = name.split_once('.')?;
        let sections = self.sections();
        let section = sections.iter().find(|found| found.name() == section)?;
        let descriptions = section.descriptions();
        let index = descriptions.iter().position(|found| found.key == key)?;
        Some(section.get(index))
    }

    /// The first pair of [`RELATIONS`] that does not hold.
    pub fn contradiction(&self) -> Option<[&'static str; 2]> {
        RELATIONS.into_iter().find(|names| {
            let [low, high] = names.map(|name| self.value(name).and_then(|value| value.number()));
            low > high
        })
    }

    /// A built-in profile.
    pub fn profile(profile: Profile) -> Self {
        Self {
            profile,
            cloud: CloudParameters::profile(profile),
            ego: EgoParameters::profile(profile),
            ground: GroundParameters::profile(profile),
            cluster: ClusterParameters::profile(profile),
            track: TrackParameters::profile(profile),
            grid: GridParameters::profile(profile),
            roundabout: RoundaboutParameters::profile(profile),
            publish: PublishParameters::profile(profile),
            session: SessionParameters::profile(profile),
        }
    }

    /// The sections in the order in which a revolution meets them.
    pub fn sections(&self) -> [&dyn Section; 9] {
        let Self {
            profile: _,
            cloud,
            ego,
            ground,
            cluster,
            track,
            grid,
            roundabout,
            publish,
            session,
        } = self;
        [
            cloud, ego, ground, cluster, track, grid, roundabout, publish, session,
        ]
    }

    /// The same, to be set.
    pub fn sections_mut(&mut self) -> [&mut dyn Section; 9] {
        let Self {
            profile: _,
            cloud,
            ego,
            ground,
            cluster,
            track,
            grid,
            roundabout,
            publish,
            session,
        } = self;
        [
            cloud, ego, ground, cluster, track, grid, roundabout, publish, session,
        ]
    }
}

impl Default for Configuration {
    fn default() -> Self {
        Self::profile(Profile::Default)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_profiles_lie_within_every_range() {
        for profile in [Profile::Default, Profile::Thesis] {
            let mut configuration = Configuration::profile(profile);
            for section in configuration.sections_mut() {
                for (index, description) in section.descriptions().iter().enumerate() {
                    let value = section.get(index);
                    let result = section.set(index, value);
                    assert!(result.is_ok(), "{} {result:?}", description.key);
                }
            }
            assert_eq!(configuration, Configuration::profile(profile));
        }
    }

    #[test]
    fn relations_are_between_numbers_and_hold_in_both_profiles() {
        for profile in [Profile::Default, Profile::Thesis] {
            let configuration = Configuration::profile(profile);
            for name in RELATIONS.as_flattened() {
                let value = configuration.value(name);
                assert!(value.and_then(|value| value.number()).is_some(), "{name}");
            }
            assert_eq!(configuration.contradiction(), None);
            assert!(configuration.grid.most_mb() < MOST_MAP_MB);
        }
    }

    #[test]
    fn every_parameter_says_what_it_means() {
        for section in Configuration::default().sections() {
            for description in section.descriptions() {
                assert!(!description.meaning.is_empty(), "{}", description.key);
            }
        }
    }

    #[test]
    fn a_value_out_of_range_is_refused_with_range_and_unit() {
        let mut configuration = Configuration::default();
        let [.., session] = configuration.sections_mut();
        let problem = session.set(0, Value::Integer(256)).unwrap_err();
        assert_eq!(problem.to_string(), "256 is outside 0 to 255 hops");
        let problem = session.set(0, Value::Text("one".into())).unwrap_err();
        assert_eq!(
            problem.to_string(),
            "\"one\" is not a whole number, 0 to 255 hops"
        );
    }
}
