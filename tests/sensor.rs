//! The daemon beside a sensor, in network namespaces that each test makes for itself: packets over real sockets,
//! with losses, floods and other sensors.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

#[path = "common/network.rs"]
mod network;

use std::net::UdpSocket;
use std::time::{Duration, Instant};

use kreisel::simulate::{Simulation, scenario};
use kreisel::wire::object_list::ObjectList;
use kreisel::wire::point_cloud::POINT_CLOUD_ID;
use kreisel::wire::status::Status;
use kreisel::wire::{Message, Recording};
use network::{Peer, Running, in_namespace, text};

/// Packets of so many revolutions, with their ports and when they are due in seconds.
fn packets(revolutions: usize) -> Vec<(u16, f64, Vec<u8>)> {
    let scenario = scenario::find("roundabout-waiting").unwrap();
    let mut simulation = Simulation::in_packets(scenario, 1);
    let (mut packets, mut first) = (vec![], None);
    let mut take = |packet: &kreisel::wire::velodyne::Packet<'_>| {
        let due = packet.arrival - *first.get_or_insert(packet.arrival);
        packets.push((packet.port(), due.seconds(), packet.bytes.to_vec()));
    };
    for _ in 0..revolutions {
        simulation.revolve_in_packets(&mut take);
    }
    simulation.close_packets(&mut take);
    packets
}

/// A host at an address of loopback.
fn host(address: &str) -> UdpSocket {
    UdpSocket::bind((address, 0)).unwrap()
}

/// Sends packets as they are due, to their ports on loopback.
fn play(socket: &UdpSocket, packets: &[(u16, f64, Vec<u8>)]) {
    let begin = Instant::now();
    for (port, due_s, bytes) in packets {
        let due = Duration::from_secs_f64(*due_s);
        std::thread::sleep(due.saturating_sub(begin.elapsed()));
        let _ = socket.send_to(bytes, ("127.0.0.1", *port));
    }
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn a_capture_that_is_played_is_answered_as_process_answers_it() {
    in_namespace(|| {
        let folder = tempfile::tempdir().unwrap();
        let [capture, output] = ["a.pcap", "a.rec"].map(|name| folder.path().join(name));
        let simulate = ["simulate", "roundabout-waiting", "--duration=2", "--output"];
        let simulated = Running::kreisel(&[&simulate[..], &[text(&capture)]].concat());
        assert_eq!(simulated.output().0, 0);
        let process = ["process", text(&capture), "--output", text(&output)];
        assert_eq!(Running::kreisel(&process).output().0, 0);
        let bytes = std::fs::read(output).unwrap();
        let expected: Vec<u32> = Recording::new(&bytes)
            .map(|entry| entry.unwrap().envelope)
            .filter(|envelope| envelope.data_type == ObjectList::ID)
            .map(|envelope| ObjectList::decode(envelope.payload, 0).unwrap().count)
            .collect();
        assert_eq!(expected.len(), 20);
        let daemon = Running::daemon(&["--velodyne", "--interface=127.0.0.1"]);
        let peer = Peer::join();
        let player = Running::kreisel(&["replay", text(&capture), "--velodyne"]);
        for (number, expected) in expected.iter().enumerate() {
            let list = peer.await_message::<ObjectList>(|list| list.revolution == number as u32);
            // Times of arrival are not those of the sensor's clock, which is of another year.
            assert!(
                list.count.abs_diff(*expected) <= 2,
                "{number}: {} {expected}",
                list.count
            );
        }
        assert_eq!(player.output().0, 0);
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 20);
        assert_eq!((status.packets_lost, status.faults.as_str()), (0, ""));
        assert_eq!(
            (status.sensor_clock.as_str(), status.return_mode.as_str()),
            ("apart", "strongest return")
        );
        assert!(
            status.healthy && status.packets_received > 1600,
            "{status:?}"
        );
        let (code, _, log) = daemon.stop();
        assert_eq!(code, 0);
        assert!(
            log.contains("listening for packets of a VLP-16 on UDP port 2368"),
            "{log}"
        );
    });
}

#[test]
#[cfg_attr(
    not(all(network_namespaces, shared_data)),
    ignore = "needs root, for network namespaces, and ../shared/data"
)]
fn point_clouds_of_real_packets_are_those_of_the_device_service() {
    let (Some(capture), Some(recording)) = (
        common::data("vlp16-sampleShort.pcap"),
        common::data("vlp16-sampleShort-datagrams.rec"),
    ) else {
        return;
    };
    in_namespace(|| {
        let bytes = std::fs::read(&recording).unwrap();
        let expected: Vec<_> = Recording::new(&bytes)
            .map(|entry| entry.unwrap().envelope)
            .filter(|envelope| envelope.data_type == POINT_CLOUD_ID)
            .map(|envelope| envelope.payload)
            .collect();
        assert_eq!(expected.len(), 4);
        let _daemon = Running::daemon(&["--velodyne=3000", "--publish-cloud"]);
        let peer = Peer::join();
        let _player = Running::kreisel(&["replay", text(&capture), "--velodyne=127.0.0.1:3000"]);
        for payload in expected {
            let found = peer.await_payload(POINT_CLOUD_ID, |found| Some(found.to_vec()));
            assert!(found == payload);
        }
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 3);
        // Its own point clouds, heard back, are not taken for others'.
        assert_eq!(status.faults, "");
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn a_flood_and_another_sensor_cost_no_packet() {
    in_namespace(|| {
        let _daemon = Running::daemon(&["--velodyne"]);
        let peer = Peer::join();
        let packets = packets(30);
        let (sensor, other, hostile) = (host("127.0.0.1"), host("127.0.0.2"), host("127.0.0.3"));
        // The first one that is heard is listened to.
        play(&sensor, &packets[..1]);
        std::thread::scope(|scope| {
            scope.spawn(|| play(&other, &packets));
            scope.spawn(|| {
                let mut garbage = vec![0xff; 1206];
                for number in 0..60_000u32 {
                    garbage[..4].copy_from_slice(&number.to_le_bytes());
                    let length = [1206, 512, 0, 7][number as usize % 4];
                    let _ = hostile.send_to(&garbage[..length], "127.0.0.1:2368");
                    let _ = hostile.send_to(&garbage[..length], "127.0.0.1:8308");
                    if number % 20 == 0 {
                        std::thread::sleep(Duration::from_millis(1));
                    }
                }
            });
            play(&sensor, &packets[1..]);
        });
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 30);
        assert_eq!(
            (status.packets_lost, status.revolutions_queue_dropped),
            (0, 0)
        );
        assert!(
            status.faults.contains("packet_other_sensor="),
            "{}",
            status.faults
        );
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn only_the_named_sensor_is_heard_on_the_named_interface() {
    in_namespace(|| {
        let daemon = Running::daemon(&[
            "--velodyne",
            "--sensor=127.0.0.2",
            "--sensor-interface=127.0.0.1",
        ]);
        let peer = Peer::join();
        let packets = packets(3);
        play(&host("127.0.0.1"), &packets[..20]);
        let elsewhere = packets[0].2.as_slice();
        host("127.0.0.2")
            .send_to(elsewhere, ("127.0.0.9", 2368))
            .unwrap();
        play(&host("127.0.0.2"), &packets);
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 3);
        assert_eq!(
            status.faults,
            "packet_other_address=20 packet_other_interface=1"
        );
        let (_, _, log) = daemon.stop();
        assert!(
            log.contains("packet_other_address: packets from 127.0.0.1"),
            "{log}"
        );
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn lost_and_disordered_packets_are_counted_and_every_revolution_is_answered() {
    in_namespace(|| {
        let _daemon = Running::daemon(&["--velodyne"]);
        let peer = Peer::join();
        let all = packets(20);
        let mut data = 0;
        let is_kept = |packet: &&(u16, f64, Vec<u8>)| {
            data += u32::from(packet.0 == 2368);
            packet.0 != 2368 || data % 25 != 10
        };
        let mut packets: Vec<_> = all.iter().filter(is_kept).cloned().collect();
        let lost = (all.len() - packets.len()) as u64;
        // Two neighbours change places, of which none says the time.
        let at = (600..)
            .find(|at| packets[*at].0 == 2368 && packets[at + 1].0 == 2368)
            .unwrap();
        packets.swap(at, at + 1);
        packets.insert(at + 21, packets[at + 20].clone());
        play(&host("127.0.0.1"), &packets);
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 20);
        // The one that comes late was taken for lost before.
        assert_eq!((status.packets_lost, status.packets_late), (lost + 1, 1));
        assert_eq!(status.faults, "packet_doubled=1");
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn a_sensor_alone_needs_no_session() {
    in_namespace(|| {
        let daemon = Running::kreisel(&["run", "--velodyne", "--view=127.0.0.1:8111"]);
        let packets = packets(10);
        let sensor = host("127.0.0.1");
        let begin = Instant::now();
        let picture = loop {
            play(&sensor, &packets);
            let (code, _, problem) = Running::kreisel(&["health"]).output();
            if code == 0 {
                break problem;
            }
            assert!(begin.elapsed() < Duration::from_secs(10), "{problem}");
        };
        assert_eq!(picture, "");
        let (code, _, log) = daemon.stop();
        assert_eq!(code, 0);
        assert!(
            log.contains("VLP-16: 180") && !log.contains("joined"),
            "{log}"
        );
    });
}
