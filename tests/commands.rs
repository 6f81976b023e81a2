//! The offline commands as a user runs them: results, exit codes, and one clear line for
//! everything that is wrong.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

mod common;

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use kreisel::wire::object_list::ObjectList;
use kreisel::wire::status::Status;
use kreisel::wire::{Envelope, Message, Recording};
use serde_json::Value;

fn kreisel<S: AsRef<std::ffi::OsStr>>(arguments: &[S]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_kreisel"));
    command.args(arguments).output().unwrap()
}

fn code(output: &Output) -> i32 {
    output.status.code().unwrap()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn text(&self, name: &str) -> String {
        self.path(name).to_str().unwrap().into()
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> String {
        std::fs::write(self.path(name), content).unwrap();
        self.text(name)
    }
}

fn json_lines(path: &Path) -> Vec<Value> {
    let text = std::fs::read_to_string(path).unwrap();
    text.lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect()
}

fn payloads(bytes: &[u8]) -> Vec<Envelope<'_>> {
    Recording::new(bytes)
        .map(|entry| entry.unwrap().envelope)
        .collect()
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn every_complete_revolution_of_a_real_drive_gives_a_list_above_a_road_1_6_m_below() {
    let Some(input) = common::data("vlp16-sampleShort.rec") else {
        return;
    };
    let bytes = std::fs::read(&input).unwrap();
    let mut pipeline = kreisel::pipeline::Pipeline::new(&Default::default(), 0);
    let mut lists = 0;
    for entry in Recording::new(&bytes) {
        let Ok(kreisel::pipeline::Outcome::Revolution(report)) =
            pipeline.handle(&entry.unwrap().envelope)
        else {
            continue;
        };
        let plane = report.ground.plane;
        assert!((1.5..1.75).contains(&plane.height_m()), "{plane:?}");
        assert!(plane.tilt_rad() < 0.05, "{plane:?}");
        assert!(report.ground.points > 3000, "{report:?}");
        let frames = pipeline.publish_objects(report.time, 0.0);
        let ids = frames.map(|frame| Envelope::from_datagram(frame).unwrap().0.data_type);
        lists += ids.filter(|id| *id == ObjectList::ID).count();
    }
    assert_eq!(lists, 3);
}

#[test]
fn process_gives_the_same_bytes_twice_and_one_list_a_revolution() {
    let folder = Folder::new();
    let (recording, truth) = (folder.text("in.rec"), folder.text("truth.jsonl"));
    let made = kreisel(&[
        "simulate",
        "roundabout",
        "--seed",
        "3",
        "--duration",
        "2.5",
        "--output",
        &recording,
        "--truth",
        &truth,
    ]);
    assert_eq!(code(&made), 0, "{}", stderr(&made));
    let process = |n: usize| {
        let name = |what: &str| folder.text(&format!("{n}.{what}"));
        let arguments = [
            "process",
            &recording,
            "--output",
            &name("rec"),
            "--objects",
            &name("jsonl"),
            "--labels",
            &name("npz"),
            "--appearances",
            &name("looks.npz"),
        ];
        assert_eq!(code(&kreisel(&arguments)), 0);
        ["rec", "jsonl", "npz", "looks.npz"].map(|what| std::fs::read(name(what)).unwrap())
    };
    let (first, second) = (process(1), process(2));
    assert!(first == second, "two runs differ");
    assert!(first[3].starts_with(b"PK"));

    let envelopes = payloads(&first[0]);
    let lists: Vec<ObjectList> = envelopes
        .iter()
        .filter(|envelope| envelope.data_type == ObjectList::ID)
        .map(|envelope| ObjectList::decode(envelope.payload, 0).unwrap())
        .collect();
    assert_eq!(
        lists.iter().map(|list| list.revolution).collect::<Vec<_>>(),
        (0..25).collect::<Vec<_>>()
    );
    assert!(lists.iter().all(|list| list.processing_time == 0.0));
    let statuses = envelopes
        .iter()
        .filter(|envelope| envelope.data_type == Status::ID)
        .count();
    assert!(lists[10..].iter().all(|list| list.count >= 1));
    assert_eq!(statuses, 2);

    let objects = json_lines(&folder.path("1.jsonl"));
    let truth = json_lines(&folder.path("truth.jsonl"));
    for (line, was) in objects.iter().zip(&truth) {
        assert_eq!(line["t"], was["t"]);
        let off = |axis: &str| {
            let known = line["ego"][axis].as_f64().unwrap();
            (known - was["ego"][axis].as_f64().unwrap()).abs()
        };
        assert!(off("x").hypot(off("y")) < 0.3, "{line}");
        assert!(off("yaw") < 0.02, "{line}");
    }
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn convert_gives_the_bytes_of_the_device_service() {
    let (Some(capture), Some(golden)) = (
        common::data("vlp16-sampleShort.pcap"),
        common::data("vlp16-sampleShort-datagrams.rec"),
    ) else {
        return;
    };
    let folder = Folder::new();
    let converted = kreisel(&[
        "convert",
        capture.to_str().unwrap(),
        &folder.text("out.rec"),
    ]);
    assert_eq!(code(&converted), 3, "the capture's last record is cut off");
    assert!(
        stderr(&converted).contains("vlp16-sampleShort.pcap: byte 399768"),
        "{}",
        stderr(&converted)
    );
    let (ours, theirs) = (
        std::fs::read(folder.path("out.rec")).unwrap(),
        std::fs::read(golden).unwrap(),
    );
    let (ours, theirs) = (payloads(&ours), payloads(&theirs));
    assert_eq!(ours.len(), 4);
    for (ours, theirs) in ours.iter().zip(&theirs) {
        assert!(ours.payload == theirs.payload);
    }
    let path = folder.text("whole.rec");
    let whole = kreisel(&["convert", "--whole", capture.to_str().unwrap(), &path]);
    assert_eq!(code(&whole), 3);
    let whole = std::fs::read(path).unwrap();
    let whole = payloads(&whole);
    assert_eq!(whole.len(), 3);
    assert!(whole[0].payload == ours[1].payload);
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn captures_of_other_sensors_and_links_convert_too() {
    for (name, columns) in [
        ("vlp16-mrpt-indoor.pcap", 1811),
        ("vlp16-lidar-utils-outdoor.pcap", 552),
    ] {
        let Some(capture) = common::data(name) else {
            return;
        };
        let folder = Folder::new();
        let converted = kreisel(&[
            "convert",
            capture.to_str().unwrap(),
            &folder.text("out.rec"),
        ]);
        assert!([0, 3].contains(&code(&converted)), "{}", stderr(&converted));
        let inspected = kreisel(&["inspect", "--json", &folder.text("out.rec")]);
        let report: Value = serde_json::from_slice(&inspected.stdout).unwrap();
        let clouds = report["point_clouds"].as_array().unwrap();
        assert_eq!(clouds.last().unwrap()["columns"], columns);
        assert_eq!(clouds.last().unwrap()["byte_order"], "big-endian");
    }
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn inspect_says_what_the_array_cannot_hold() {
    for (name, reason) in [
        ("hdl32e-synthetic.rec", "12 of the 32 layers of a HDL-32E"),
        ("vlp32c-synthetic.rec", "12 of the 32 layers of a VLP-32C"),
        ("vlp16-synthetic-5hz.rec", "partial_revolution"),
        ("vlp16-sampleShort.rec", "first_azimuth"),
    ] {
        let Some(path) = common::data(name) else {
            return;
        };
        let inspected = kreisel(&["inspect", path.to_str().unwrap()]);
        assert_eq!(code(&inspected), 0);
        let text = String::from_utf8_lossy(&inspected.stdout).into_owned();
        assert!(text.contains(reason), "{text}");
        assert!(
            text.contains("big-endian") || text.contains("undecided"),
            "{text}"
        );
    }
}

#[test]
fn process_compares_its_objects_with_truth() {
    let folder = Folder::new();
    let (recording, truth) = (folder.text("in.rec"), folder.text("truth.jsonl"));
    let simulate = ["simulate", "roundabout", "--seed=3", "--duration=6"];
    let files = ["--output", &recording, "--truth", &truth];
    assert_eq!(code(&kreisel(&[&simulate[..], &files[..]].concat())), 0);
    let compared = kreisel(&["process", &recording, "--truth", &truth]);
    assert_eq!(code(&compared), 0, "{}", stderr(&compared));
    let shown = String::from_utf8(compared.stdout).unwrap();
    let found = shown
        .split("returns or more, ")
        .nth(1)
        .and_then(|rest| rest.split(" %").next());
    let found: f64 = found.unwrap().parse().unwrap();
    assert!(shown.contains("truth of 60 revolutions"), "{shown}");
    assert!((75.0..=100.0).contains(&found), "{shown}");
}

#[test]
fn a_damaged_recording_is_processed_around_its_damage() {
    let folder = Folder::new();
    let recording = folder.text("in.rec");
    kreisel(&[
        "simulate",
        "roundabout",
        "--duration",
        "0.5",
        "--output",
        &recording,
    ]);
    let mut bytes = std::fs::read(&recording).unwrap();
    let second = Recording::new(&bytes).nth(1).unwrap().unwrap().offset;
    bytes.splice(second..second, *b"noise");
    bytes.truncate(bytes.len() - 100);
    let damaged = folder.write("damaged.rec", &bytes);
    let processed = kreisel(&["process", &damaged, "--objects", &folder.text("o.jsonl")]);
    assert_eq!(code(&processed), 3);
    assert!(
        stderr(&processed).contains(&format!("damaged.rec: byte {second}: no frame begins here"))
    );
    assert_eq!(json_lines(&folder.path("o.jsonl")).len(), 4);
}

#[test]
fn the_printed_configuration_can_be_fed_back() {
    let folder = Folder::new();
    let recording = folder.text("in.rec");
    kreisel(&[
        "simulate",
        "roundabout",
        "--duration",
        "0.3",
        "--output",
        &recording,
    ]);
    for profile in ["default", "thesis"] {
        let printed = kreisel(&["config", "--profile", profile]);
        let file = folder.write("kreisel.toml", &printed.stdout);
        let processed = kreisel(&["process", &recording, "--config", &file]);
        assert_eq!(code(&processed), 0, "{}", stderr(&processed));
    }
}

#[test]
fn what_is_wrong_is_one_line_that_names_it() {
    let folder = Folder::new();
    let config = folder.write(
        "k.toml",
        "profile = \"default\"\n\n[ground]\niterations = 0\n",
    );
    let empty = folder.write("empty.rec", "");
    let noise = folder.write("noise.pcap", "this is no capture at all");
    let cases: [(&[&str], &str); 7] = [
        (
            &["process", &empty, "--truth", &noise],
            "noise.pcap: no truth in the line at byte 0",
        ),
        (
            &["process", "/no/such.rec"],
            "kreisel: /no/such.rec: No such file",
        ),
        (
            &["process", &empty, "--config", &config],
            "k.toml: line 4: ground.iterations: 0 is outside 1 to 1000",
        ),
        (
            &["process", &empty, "--output", "/no/dir/out.rec"],
            "kreisel: /no/dir/out.rec: No such file",
        ),
        (
            &["convert", &noise, &folder.text("x.rec")],
            "noise.pcap: byte 0: neither pcap nor pcapng",
        ),
        (
            &["replay", &empty, "--cid", "111"],
            "empty.rec: byte 0: no envelope to play",
        ),
        (
            &["health", "--cid", "254"],
            "unhealthy: no daemon runs on this host",
        ),
    ];
    for (arguments, expected) in cases {
        let output = kreisel(arguments);
        assert_eq!(code(&output), 1, "{arguments:?}");
        let text = stderr(&output);
        assert!(text.contains(expected), "{arguments:?}: {text}");
        assert_eq!(text.lines().count(), 1, "{text}");
    }
}

#[test]
fn wrong_usage_exits_with_2() {
    let cases: [&[&str]; 6] = [
        &["run"],
        &["run", "--cid", "256"],
        &["run", "--cid=0"],
        &["simulate", "nowhere", "--output", "/tmp/x"],
        &["replay", "x.rec", "--cid=1", "--speed=0"],
        &["fly"],
    ];
    for arguments in cases {
        assert_eq!(code(&kreisel(arguments)), 2, "{arguments:?}");
    }
}

#[test]
fn scenarios_are_listed() {
    let listed = kreisel(&["simulate", "--list"]);
    assert_eq!(code(&listed), 0);
    assert!(String::from_utf8_lossy(&listed.stdout).starts_with("roundabout: "));
}

#[test]
#[cfg_attr(not(shared_data), ignore = "needs ../shared/data")]
fn a_capture_is_read_like_a_recording_of_its_whole_revolutions() {
    let Some(capture) = common::data("vlp16-sampleShort.pcap") else {
        return;
    };
    let (folder, capture) = (Folder::new(), capture.to_str().unwrap());
    let converted = folder.text("converted.rec");
    assert_eq!(code(&kreisel(&["convert", capture, &converted])), 3);
    // The device service sends the end of a turn as if it were one; what reads packets leaves it out.
    let bytes = std::fs::read(&converted).unwrap();
    let first = Recording::new(&bytes).next().unwrap().unwrap().frame.len();
    let whole = folder.write("whole.rec", &bytes[first..]);
    let (of_capture, of_recording) = (folder.text("a.jsonl"), folder.text("b.jsonl"));
    let output = kreisel(&["process", capture, "--objects", &of_capture]);
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(text.contains("3 answered, 0 refused"), "{text}");
    // Its last record is cut off, and that is said.
    assert_eq!(code(&output), 3, "{}", stderr(&output));
    assert!(stderr(&output).contains("the last record is cut off"));
    assert_eq!(
        code(&kreisel(&["process", &whole, "--objects", &of_recording])),
        0
    );
    // The packets say when and where each firing was, the point clouds only begin and end.
    let times = |path: &str| -> Vec<f64> {
        let text = std::fs::read_to_string(path).unwrap();
        let lines = text
            .lines()
            .map(|line| serde_json::from_str::<Value>(line).unwrap());
        lines.map(|line| line["t"].as_f64().unwrap()).collect()
    };
    let [a, b] = [times(&of_capture), times(&of_recording)];
    assert_eq!((a.len(), b.len()), (3, 3));
    // A GPS receiver keeps the sensor's clock, which is 1.4 s ahead of the one of the capture.
    assert!(
        a.iter().zip(b).all(|(a, b)| (a - b - 1.406).abs() < 0.002),
        "{a:?}"
    );
    let inspected = kreisel(&["inspect", "--json", capture]);
    let report: Value = serde_json::from_slice(&inspected.stdout).unwrap();
    assert_eq!(report["envelopes"], 3);
    assert_eq!(report["packets"]["sensor"], "VLP-16");
    assert_eq!(report["packets"]["revolutions"], 3);
}

#[test]
fn without_an_output_file_it_is_told_what_was_seen() {
    let folder = Folder::new();
    let recording = folder.text("drive.rec");
    let simulate = [
        "simulate",
        "roundabout-waiting",
        "--duration=4",
        "--output",
        &recording,
    ];
    assert_eq!(code(&kreisel(&simulate)), 0);
    let output = kreisel(&["process", &recording]);
    let text = String::from_utf8_lossy(&output.stdout);
    for told in [
        "car=",
        "cyclist=3",
        "most in revolution",
        "ms a revolution",
        "kreisel view",
    ] {
        assert!(text.contains(told), "{told}: {text}");
    }
    let published = folder.text("published.rec");
    let quiet = kreisel(&["process", &recording, "--output", &published]);
    assert_eq!(String::from_utf8_lossy(&quiet.stdout).lines().count(), 1);
    let inspected = kreisel(&["inspect", &published]);
    let text = String::from_utf8_lossy(&inspected.stdout);
    assert!(
        text.contains("kreisel.GridTile") && !text.contains("unknown"),
        "{text}"
    );
}

#[test]
fn too_few_file_descriptors_are_an_error_and_no_panic() {
    for limit in [6, 7, 8, 12, 20] {
        let script = format!(
            "ulimit -n {limit}; exec {} run --cid=9",
            env!("CARGO_BIN_EXE_kreisel")
        );
        let output = Command::new("sh").args(["-c", &script]).output().unwrap();
        assert_eq!(code(&output), 1, "{limit}: {}", stderr(&output));
        let problem = "kreisel: cannot open sockets: Too many open files (os error 24)\n";
        assert_eq!(stderr(&output), problem, "{limit}");
    }
}
