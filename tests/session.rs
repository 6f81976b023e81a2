//! The daemon over real sockets, in network namespaces that each test makes for itself: with
//! libcluon's own tools as peers, with hostile datagrams, and with signals.
//!
//! Needs the right to make a namespace, the `ip` command, and for two tests the tools of PyPI's
//! `pycluon` on the PATH. Where something is missing a test says that it was skipped, and fails
//! in CI.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

#[path = "common/network.rs"]
mod network;

use std::net::{Ipv4Addr, SocketAddrV4};
use std::time::{Duration, Instant};

use kreisel::random::Random;
use kreisel::simulate::{Simulation, scenario};
use kreisel::wire::envelope::Postmark;
use kreisel::wire::grid_tile::GridTile;
use kreisel::wire::object_list::ObjectList;
use kreisel::wire::status::Status;
use kreisel::wire::{Message, Recording};
use network::{Peer, Running, await_true, in_namespace, text};
use nix::sys::signal::Signal;

fn revolutions(count: usize) -> Vec<Vec<u8>> {
    let mut simulation = Simulation::new(scenario::find("roundabout-waiting").unwrap(), 1);
    let mut revolve = || {
        let mut frame = vec![];
        simulation.revolve(&mut frame);
        frame
    };
    (0..count).map(|_| revolve()).collect()
}

/// Whether a program of libcluon is there.
fn has_libcluon(program: &str) -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let found = std::env::split_paths(&paths).any(|path| path.join(program).is_file());
    if !found {
        assert!(
            std::env::var_os("CI").is_none(),
            "{program} is not on the PATH"
        );
        eprintln!("skipped: {program} is not on the PATH");
    }
    found
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
#[cfg_attr(not(libcluon), ignore = "needs libcluon's tools: pip install pycluon")]
fn what_libcluon_replays_is_answered_and_libcluon_decodes_the_answer() {
    let Some(recording) = common::data("vlp16-sampleShort.rec") else {
        return;
    };
    if !has_libcluon("cluon-replay") || !has_libcluon("cluon-OD4toJSON") {
        return;
    }
    in_namespace(|| {
        let folder = tempfile::tempdir().unwrap();
        let [config, odvd] = ["all.toml", "all.odvd"].map(|name| folder.path().join(name));
        // In three revolutions hardly anything is sure.
        let least = "[track]\nleast_confidence = 0.2\n";
        let publish = "[publish]\nopendlv = true\nenvironment = true\n";
        std::fs::write(&config, [publish, least].concat()).unwrap();
        let all = [
            include_str!("../proto/kreisel.odvd"),
            include_str!("../proto/opendlv.odvd"),
        ];
        std::fs::write(&odvd, all.concat()).unwrap();
        let config = format!("--config={}", text(&config));
        let _daemon = Running::daemon(&["--id=7", &config]);
        let odvd = format!("--odvd={}", text(&odvd));
        let listener = Running::start("cluon-OD4toJSON", &["--cid=111", &odvd]);
        let peer = Peer::join();
        // Both have joined once a Status has gone out.
        peer.await_message::<Status>(|_| true);
        let player = Running::start("cluon-replay", &["--cid=111", text(&recording)]);
        let last = peer.await_message::<ObjectList>(|list| list.revolution == 2);
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 3);
        assert!(last.count > 0);
        assert_eq!(status.faults, "first_azimuth=1");
        assert!((1.5..1.75).contains(&status.ground_height));
        assert_eq!(status.byte_order, "big-endian");
        drop(player);
        std::thread::sleep(Duration::from_millis(300));
        let (_, json, _) = listener.stop();
        assert!(json.contains("Parsed 18 message(s)."), "{json:.200}");
        for message in [
            "\"kreisel_Object\":{\"objectId\":",
            "\"opendlv_logic_perception_ObjectFrameEnd\":{\"objectFrameId\":2}",
            "\"opendlv_logic_perception_ObjectPosition\":{\"objectId\":",
            "\"opendlv_perception_Environment\":{\"validUntil\":",
        ] {
            assert!(json.contains(message), "{message}");
        }
        assert_eq!(
            json.matches("\"kreisel_ObjectList\":{\"revolution\":")
                .count(),
            3
        );
        assert!(json.contains("\"kreisel_GridTile\":{\"mapId\":"));
        assert!(json.contains("\"senderStamp\":7"));
        assert!(json.contains(&format!("\"count\":{},", last.count)));
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
#[cfg_attr(not(libcluon), ignore = "needs libcluon's tools: pip install pycluon")]
fn the_example_draws_the_map_from_the_session_and_refuses_a_damaged_tile() {
    if !has_libcluon("cluon-OD4toJSON") {
        return;
    }
    in_namespace(|| {
        let _daemon = Running::daemon(&[]);
        let folder = tempfile::tempdir().unwrap();
        let picture = folder.path().join("map.png");
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/scripts/map");
        let arguments = [script, text(&picture), "--cid=111", "--seconds=6"];
        let example = Running::start("python3", &arguments);
        let peer = Peer::join();
        // It compiles the messages before it listens.
        std::thread::sleep(Duration::from_millis(1500));
        for frame in revolutions(15) {
            peer.send(&frame);
            std::thread::sleep(Duration::from_millis(60));
        }
        let mut damaged = peer.await_message::<GridTile>(|_| true);
        damaged.cells.0[0] ^= 1;
        let mut frame = vec![];
        Postmark::default().put(&mut frame, &damaged);
        peer.send(&frame);
        let (code, out, err) = example.output();
        assert_eq!(code, 0, "{err}");
        let words: Vec<&str> = out.split_whitespace().collect();
        assert!(words[2].parse::<usize>().unwrap() > 50, "{out}");
        assert_eq!(words[4..], ["1", "refused"], "{out} {err}");
        assert!(err.contains("refused: checksum of the cells is"), "{err}");
        let png = std::fs::read(&picture).unwrap();
        assert!(png.starts_with(b"\x89PNG") && png.len() > 1000);
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn every_hostile_datagram_is_counted_by_name_and_the_next_revolution_is_answered() {
    in_namespace(|| {
        let _daemon = Running::daemon(&[]);
        let peer = Peer::join();
        let good = revolutions(3);
        peer.send(&good[0]);
        peer.await_message::<ObjectList>(|list| list.revolution == 0);
        for datagram in hostile_datagrams(&good[0]) {
            peer.send(&datagram);
            // A flood would test the kernel's buffer instead.
            std::thread::sleep(Duration::from_micros(200));
        }
        peer.send(&good[1]);
        peer.await_message::<ObjectList>(|list| list.revolution == 1);
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 2);
        for name in [
            "bad_magic",
            "frame_truncated",
            "length_beyond_end",
            "varint_too_long",
            "trailing_bytes",
            "out_of_order",
            "zero_layers",
            "too_many_columns",
            "other_sender",
        ] {
            assert!(
                status.faults.contains(&format!("{name}=")),
                "{name}: {}",
                status.faults
            );
        }
        assert!(status.datagrams_damaged > 0 && status.revolutions_refused > 0);
    });
}

/// The edge cases of the wire, refusals, and two thousand mutations of a revolution's frame.
fn hostile_datagrams(revolution: &[u8]) -> Vec<Vec<u8>> {
    use kreisel::wire::point_cloud::CompactPointCloud;
    let cloud = |layers: u8, columns: usize, sender_stamp: u32| {
        let distances = vec![1; 2 * usize::from(layers.max(1)) * columns];
        let cloud = CompactPointCloud {
            end_azimuth_deg: 359.8,
            layers,
            distances: &distances,
            ..CompactPointCloud::default()
        };
        let mut frame = vec![];
        let postmark = Postmark {
            sender_stamp,
            ..Postmark::default()
        };
        postmark.put_payload(&mut frame, 49, |out| cloud.encode(out));
        frame
    };
    let mut datagrams: Vec<Vec<u8>> = vec![
        vec![],
        vec![0x0d],
        b"no frame at all".to_vec(),
        b"\x0d\xa4\x27\x00\x00\x08\xd4".to_vec(),
        b"\x0d\xa4\x00\x00\x00".to_vec(),
        b"\x0d\xa4\x03\x00\x00\x12\xe8\x07".to_vec(),
        b"\x0d\xa4\x07\x00\x00\x12\x80\x80\x80\x80\x80\x20".to_vec(),
        b"\x0d\xa4\x0d\x00\x00\x08\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\xff\x01".to_vec(),
        [revolution, b"trailing"].concat(),
        revolution.to_vec(),
        cloud(0, 16, 0),
        cloud(16, 2001, 0),
        cloud(16, 1800, 99),
    ];
    // No libcluon listens in this namespace; one of these would end it.
    if let Some(folder) = common::data("edge") {
        let files = std::fs::read_dir(folder).unwrap();
        datagrams.extend(files.map(|file| std::fs::read(file.unwrap().path()).unwrap()));
    }
    let mut random = Random::new(5);
    datagrams.extend((0..2000).map(|_| {
        let mut mutated = revolution.to_vec();
        for _ in 0..=random.below(3) {
            // Mostly where the structure is.
            let range = if random.below(4) == 0 {
                mutated.len()
            } else {
                40
            };
            mutated[random.below(range)] = random.next_u64() as u8;
        }
        // The sender stays, or the daemon would follow another one.
        *mutated.last_mut().unwrap() = 0;
        mutated
    }));
    datagrams
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn either_signal_stops_the_daemon_within_200_ms() {
    in_namespace(|| {
        for signal in [Signal::SIGTERM, Signal::SIGINT] {
            let daemon = Running::daemon(&[]);
            let peer = Peer::join();
            peer.send(&revolutions(1)[0]);
            peer.await_message::<ObjectList>(|_| true);
            let begin = Instant::now();
            daemon.signal(signal);
            let (code, _, log) = daemon.output();
            assert!(
                begin.elapsed() < Duration::from_millis(200),
                "{:?}",
                begin.elapsed()
            );
            assert_eq!(code, 0, "{log}");
            assert!(log.contains("receive buffer"), "{log}");
            assert!(
                log.contains("1 revolutions answered; from arrival to answer median"),
                "{log}"
            );
        }
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn the_daemon_ignores_what_it_sends_and_says_how_it_is() {
    in_namespace(|| {
        let health = |expected: &str| {
            let (code, _, problem) = Running::kreisel(&["health"]).output();
            assert!(problem.contains(expected), "{problem}");
            code
        };
        assert_eq!(health("no daemon runs"), 1);
        let _daemon = Running::daemon(&[]);
        assert_eq!(health("no revolution was answered yet"), 1);
        let peer = Peer::join();
        let revolutions = revolutions(6);
        let (last, first) = revolutions.split_last().unwrap();
        for revolution in first {
            peer.send(revolution);
        }
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 5);
        // So that none is missing meanwhile, however long the status took.
        peer.send(last);
        peer.await_message::<ObjectList>(|_| true);
        assert_eq!(health(""), 0);
        assert!(status.healthy);
        let slower = [
            0.0,
            status.latency_median,
            status.latency_p99,
            status.latency_p999,
            status.latency_max,
        ];
        assert!(slower.is_sorted() && slower[1] > 0.0, "{slower:?}");
        assert!(status.datagrams_own >= 5, "{status:?}");
        assert_eq!(status.faults, "");
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn a_supervisor_hears_that_the_daemon_is_ready_alive_and_how_it_is() {
    in_namespace(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("notify");
        let supervisor = std::os::unix::net::UnixDatagram::bind(&path).unwrap();
        supervisor
            .set_read_timeout(Some(Duration::from_secs(5)))
            .unwrap();
        let socket = format!("NOTIFY_SOCKET={}", text(&path));
        let kreisel = env!("CARGO_BIN_EXE_kreisel");
        let daemon = Running::start(
            "env",
            &[
                &socket,
                kreisel,
                "run",
                "--cid=111",
                "--interface=127.0.0.1",
            ],
        );
        let mut buffer = [0; 200];
        let mut hear = || {
            let length = supervisor.recv(&mut buffer).unwrap();
            String::from_utf8_lossy(&buffer[..length])
                .trim_end()
                .to_owned()
        };
        let mut until = |said: &str| {
            let heard: Vec<String> = std::iter::repeat_with(&mut hear)
                .take(20)
                .take_while(|heard| !heard.starts_with(said))
                .collect();
            assert!(heard.len() < 20, "{said}: {heard:?}");
            heard
        };
        assert!(until("READY=1").is_empty());
        let before_status = until("STATUS=blind: ");
        assert!((2..6).contains(&before_status.len()), "{before_status:?}");
        assert!(before_status.iter().all(|heard| heard == "WATCHDOG=1"));
        daemon.signal(Signal::SIGTERM);
        until("STOPPING=1");
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn a_recording_played_and_recorded_comes_back_byte_for_byte() {
    in_namespace(|| {
        let folder = tempfile::tempdir().unwrap();
        let (played, recorded) = (
            folder.path().join("played.rec"),
            folder.path().join("recorded.rec"),
        );
        std::fs::write(&played, revolutions(8).concat()).unwrap();
        let recorder = Running::kreisel(&[
            "record",
            text(&recorded),
            "--cid=111",
            "--interface=127.0.0.1",
        ]);
        let joined = || {
            std::fs::read_to_string("/proc/thread-self/net/udp")
                .unwrap()
                .contains(":2F8F")
        };
        await_true("the recorder", joined);
        let (code, _, problem) = Running::kreisel(&[
            "replay",
            text(&played),
            "--cid=111",
            "--interface=127.0.0.1",
            "--speed=4",
        ])
        .output();
        assert_eq!(code, 0, "{problem}");
        std::thread::sleep(Duration::from_millis(100));
        assert_eq!(recorder.stop().0, 0);
        assert!(std::fs::read(played).unwrap() == std::fs::read(recorded).unwrap());
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn the_daemon_publishes_what_process_writes() {
    in_namespace(|| {
        let folder = tempfile::tempdir().unwrap();
        let (input, output) = (folder.path().join("in.rec"), folder.path().join("out.rec"));
        let revolutions = revolutions(6);
        std::fs::write(&input, revolutions.concat()).unwrap();
        let (code, ..) =
            Running::kreisel(&["process", text(&input), "--output", text(&output)]).output();
        assert_eq!(code, 0);
        let bytes = std::fs::read(output).unwrap();
        let processed: Vec<ObjectList> = Recording::new(&bytes)
            .map(|entry| entry.unwrap().envelope)
            .filter(|envelope| envelope.data_type == ObjectList::ID)
            .map(|envelope| ObjectList::decode(envelope.payload, 0).unwrap())
            .collect();
        let _daemon = Running::daemon(&[]);
        let peer = Peer::join();
        for (revolution, expected) in revolutions.iter().zip(processed) {
            peer.send(revolution);
            let mut published = peer.await_message::<ObjectList>(|_| true);
            // Only the clock knows this one.
            published.processing_time = 0.0;
            assert_eq!(published, expected);
        }
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn no_revolution_is_lost_at_20_hz_beside_a_busy_process_on_one_core() {
    in_namespace(|| {
        let kreisel = env!("CARGO_BIN_EXE_kreisel");
        let pinned =
            |command: &[&str]| Running::start("taskset", &[&["-c", "0"], command].concat());
        let _busy = pinned(&["sh", "-c", "while :; do :; done"]);
        let _daemon = pinned(&[kreisel, "run", "--cid=111"]);
        await_true("the daemon", || {
            std::fs::read_to_string("/proc/thread-self/net/unix")
                .unwrap()
                .contains("@kreisel-health")
        });
        let peer = Peer::join();
        for revolution in revolutions(100) {
            peer.send(&revolution);
            std::thread::sleep(Duration::from_millis(50));
        }
        let status = peer.await_message::<Status>(|status| status.revolutions_received >= 100);
        assert_eq!(status.revolutions_published, 100);
        assert_eq!(
            (
                status.revolutions_queue_dropped,
                status.datagrams_kernel_dropped
            ),
            (0, 0)
        );
        println!(
            "latency: median {} s, 99th percentile {} s, 99.9th {} s",
            status.latency_median, status.latency_p99, status.latency_p999
        );
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn the_demo_shows_objects_and_ends_by_itself() {
    in_namespace(|| {
        let (code, shown, log) = Running::kreisel(&["demo", "--duration=2.5"]).output();
        assert_eq!(code, 0, "{log}");
        assert!(shown.contains("revolution 10:"), "{shown}");
        assert!(shown.lines().count() > 10, "{shown}");
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn the_examples_print_what_a_daemon_sends() {
    in_namespace(|| {
        let demo = Running::kreisel(&["demo", "--duration=6", "--cid=112"]);
        let script = concat!(env!("CARGO_MANIFEST_DIR"), "/examples/subscribe.py");
        let example = Running::start("python3", &[script, "112", "127.0.0.1"]);
        demo.output();
        example.signal(Signal::SIGTERM);
        let (_, shown, log) = example.output();
        assert!(shown.contains("revolution 50: 7 objects"), "{shown}{log}");
        assert!(shown.contains("  pedestrian "), "{shown}{log}");
    });
}

/// Runs `ip` with these words.
fn ip(words: &str) {
    let result = std::process::Command::new("ip")
        .args(words.split(' '))
        .status();
    assert!(result.unwrap().success(), "ip {words}");
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn an_interface_that_is_made_anew_is_joined_again() {
    in_namespace(|| {
        let make = || {
            ip("link add kreisel0 type veth peer name kreisel1");
            ip("link set kreisel1 up");
            ip("address add 10.9.0.1/24 dev kreisel0");
            ip("link set kreisel0 up multicast on");
        };
        make();
        let daemon = Running::daemon(&["--interface=10.9.0.1"]);
        let peer = Peer::join_on(Ipv4Addr::new(10, 9, 0, 1));
        let revolutions = revolutions(4);
        peer.send(&revolutions[0]);
        peer.await_message::<ObjectList>(|list| list.revolution == 0);
        ip("link delete kreisel0");
        let health = || Running::kreisel(&["health"]).output().2;
        await_true("its blindness", || {
            health().contains("blind: no interface has the address 10.9.0.1")
        });
        make();
        await_true("its return", || !health().contains("no interface"));
        let peer = Peer::join_on(Ipv4Addr::new(10, 9, 0, 1));
        peer.send(&revolutions[1]);
        peer.await_message::<ObjectList>(|list| list.revolution == 1);
        let (code, _, log) = daemon.stop();
        assert_eq!(code, 0);
        assert!(
            log.contains("cut off from the session") && log.contains("joined the session anew"),
            "{log}"
        );
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn another_host_and_a_twin_are_told_and_change_nothing() {
    in_namespace(|| {
        let _daemon = Running::daemon(&["--interface=127.0.0.1"]);
        let peer = Peer::join();
        let revolutions = revolutions(6);
        let other =
            socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None).unwrap();
        let from = SocketAddrV4::new(Ipv4Addr::new(127, 0, 0, 2), 0);
        other.bind(&from.into()).unwrap();
        other.set_multicast_if_v4(&Ipv4Addr::LOCALHOST).unwrap();
        let other: std::net::UdpSocket = other.into();
        let mut twin = vec![];
        Postmark::default().put(&mut twin, &ObjectList::default());
        for revolution in &revolutions {
            peer.send(revolution);
            other.send_to(revolution, peer.group).unwrap();
        }
        other.send_to(&twin, peer.group).unwrap();
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 6);
        assert!(status.faults.contains("other_source="), "{}", status.faults);
        assert!(status.faults.contains("twin=1"), "{}", status.faults);
        assert_eq!(status.revolutions_refused, 0);
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn missed_revolutions_are_counted_and_make_it_degraded() {
    in_namespace(|| {
        let _daemon = Running::daemon(&[]);
        let peer = Peer::join();
        for (number, revolution) in revolutions(20).iter().enumerate() {
            if number % 4 != 2 {
                peer.send(revolution);
                std::thread::sleep(Duration::from_millis(30));
            }
        }
        let status = peer.await_message::<Status>(|status| status.revolutions_published == 15);
        assert_eq!(status.revolutions_missed, 5);
        assert_eq!(
            status.health,
            "degraded: 25 % of the revolutions are missed"
        );
        assert!(!status.healthy);
    });
}

#[test]
#[cfg_attr(not(network_namespaces), ignore = "needs root, for network namespaces")]
fn a_recording_keeps_all_that_came_before_its_terminal_went_and_says_what_it_misses() {
    in_namespace(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("recorded.rec");
        let recorder =
            Running::kreisel(&["record", text(&path), "--cid=111", "--interface=127.0.0.1"]);
        await_true("the recorder", || {
            let sockets = std::fs::read_to_string("/proc/thread-self/net/udp").unwrap();
            sockets.contains(":2F8F")
        });
        let peer = Peer::join();
        let revolutions = revolutions(3);
        revolutions
            .iter()
            .for_each(|revolution| peer.send(revolution));
        peer.send(b"no envelope");
        let length: usize = revolutions.iter().map(Vec::len).sum();
        let written = || std::fs::metadata(&path).is_ok_and(|file| file.len() == length as u64);
        await_true("what it has flushed", written);
        recorder.signal(Signal::SIGHUP);
        let (code, _, log) = recorder.output();
        assert_eq!(code, 3, "{log}");
        assert!(
            log.contains("3 envelopes written, 1 damaged datagrams left out, 0 lost"),
            "{log}"
        );
        assert!(std::fs::read(&path).unwrap() == revolutions.concat());
    });
}
