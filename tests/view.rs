//! The view as a browser meets it: the page, the stream of pictures, and viewers that misbehave.
#![cfg(feature = "shell")]
#![allow(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

use std::io::{BufRead, BufReader, Read as _, Write as _};
use std::net::TcpStream;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use kreisel::wire::envelope::Postmark;
use kreisel::wire::grid_tile::GridTile;
use kreisel::wire::object_list::ObjectList;
use kreisel::wire::status::Status;
use kreisel::wire::{Message as _, Recording};
use serde_json::Value;
use tungstenite::client::IntoClientRequest as _;
use tungstenite::http::StatusCode;
use tungstenite::{Error, Message, WebSocket};

/// A program that serves a view, stopped at the end.
struct Served {
    program: Child,
    address: String,
}

impl Served {
    /// Starts it at a port of the system's choice, which it names in its first lines.
    fn start(arguments: &[&str]) -> Self {
        let mut command = Command::new(env!("CARGO_BIN_EXE_kreisel"));
        command
            .args(arguments)
            .stderr(Stdio::piped())
            .stdout(Stdio::piped());
        let mut program = command.spawn().unwrap();
        let (sender, lines) = std::sync::mpsc::channel();
        let (out, log) = (
            program.stdout.take().unwrap(),
            program.stderr.take().unwrap(),
        );
        let copy = |lines: Box<dyn BufRead + Send>, sender: std::sync::mpsc::Sender<String>| {
            std::thread::spawn(move || {
                lines
                    .lines()
                    .map_while(Result::ok)
                    .for_each(|line| drop(sender.send(line)));
            })
        };
        copy(Box::new(BufReader::new(out)), sender.clone());
        copy(Box::new(BufReader::new(log)), sender);
        let address = loop {
            let line = lines
                .recv_timeout(Duration::from_secs(20))
                .expect("names its address");
            if let Some((_, rest)) = line.split_once("http://") {
                break rest.split_whitespace().next().unwrap().into();
            }
        };
        Self { program, address }
    }

    fn demo(cid: &str) -> Self {
        Self::start(&["demo", "--duration=60", "--view=127.0.0.1:0", "--cid", cid])
    }

    fn connect(&self) -> TcpStream {
        let stream = TcpStream::connect(&self.address).unwrap();
        stream
            .set_read_timeout(Some(Duration::from_secs(10)))
            .unwrap();
        stream
    }

    fn get(&self, path: &str) -> String {
        self.get_from(path, &self.address)
    }

    fn get_from(&self, path: &str, host: &str) -> String {
        let mut stream = self.connect();
        write!(
            stream,
            "GET {path} HTTP/1.1\r\nHost: {host}\r\nConnection: close\r\n\r\n"
        )
        .unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        answer
    }

    fn watch_from(&self, origin: &str) -> Result<WebSocket<TcpStream>, Error> {
        let mut request = format!("ws://{}/pictures", self.address).into_client_request()?;
        request
            .headers_mut()
            .insert("Origin", origin.parse().unwrap());
        let (socket, _) =
            tungstenite::client(request, self.connect()).map_err(|error| match error {
                tungstenite::HandshakeError::Failure(error) => error,
                interrupted => panic!("{interrupted}"),
            })?;
        Ok(socket)
    }

    fn watch(&self) -> WebSocket<TcpStream> {
        self.watch_from(&format!("http://{}", self.address))
            .unwrap()
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.program.kill();
        let _ = self.program.wait();
    }
}

struct Picture {
    heading: Value,
    points: usize,
    lists: Vec<ObjectList>,
    statuses: Vec<Status>,
    tiles: usize,
    length: usize,
}

fn next(socket: &mut WebSocket<TcpStream>) -> Picture {
    loop {
        let Message::Binary(bytes) = socket.read().unwrap() else {
            continue;
        };
        let length = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
        let json = length(0);
        let points = length(4 + json);
        let bright = 8 + json + 7 * points;
        let frames = &bytes[bright + 4 + length(bright)..];
        let (mut lists, mut statuses, mut tiles) = (vec![], vec![], 0);
        for entry in Recording::new(frames) {
            let envelope = entry.unwrap().envelope;
            match envelope.data_type {
                ObjectList::ID => lists.push(ObjectList::decode(envelope.payload, 0).unwrap()),
                Status::ID => statuses.push(Status::decode(envelope.payload, 0).unwrap()),
                GridTile::ID => tiles += 1,
                _ => {}
            }
        }
        return Picture {
            heading: serde_json::from_slice(&bytes[4..4 + json]).unwrap(),
            points,
            lists,
            statuses,
            tiles,
            length: bytes.len(),
        };
    }
}

#[test]
fn the_demo_serves_a_page_and_a_picture_of_every_revolution() {
    let demo = Served::demo("231");
    let page = demo.get("/");
    assert!(page.starts_with("HTTP/1.1 200 OK"), "{page}");
    assert!(
        page.contains("text/html") && page.contains("<canvas id=\"scene\""),
        "{page}"
    );
    for path in page
        .split(['"', '\''])
        .filter(|text| text.ends_with(".js") || text.ends_with(".css"))
    {
        assert!(demo.get(path).starts_with("HTTP/1.1 200 OK"), "{path}");
    }
    assert!(demo.get("/elsewhere").starts_with("HTTP/1.1 404"));

    let mut viewer = demo.watch();
    let first = next(&mut viewer);
    let mut last = first.lists[0].revolution;
    for _ in 0..10 {
        let picture = next(&mut viewer);
        assert!(picture.length < 200_000, "{}", picture.length);
        assert!(picture.points > 2000, "{}", picture.points);
        let steps = picture.heading["steps_ms"].as_array().unwrap();
        assert_eq!(steps.len(), 6, "{steps:?}");
        let revolution = picture.lists[0].revolution;
        assert!(revolution > last, "{revolution} after {last}");
        last = revolution;
    }
}

#[test]
fn a_machine_reads_counters_and_health() {
    let demo = Served::demo("237");
    assert!(demo.get("/health").starts_with("HTTP/1.1 503"));
    std::thread::sleep(Duration::from_millis(2500));
    assert!(
        demo.get("/health").starts_with("HTTP/1.1 200"),
        "{}",
        demo.get("/health")
    );
    let metrics = demo.get("/metrics");
    let value = |name: &str| -> f64 {
        let mut lines = metrics.lines();
        let line = lines.find_map(|line| line.strip_prefix(name)).expect(name);
        line.trim().parse().unwrap()
    };
    assert!(
        value("kreisel_revolutions_published_total ") > 5.0,
        "{metrics}"
    );
    assert_eq!(value("kreisel_revolutions_queue_dropped_total "), 0.0);
    assert!(value("kreisel_latency_quantile_seconds{quantile=\"0.5\"} ") > 0.0);
    let count = value("kreisel_latency_seconds_count ");
    assert!(count > 5.0);
    for step in ["cloud", "ego", "ground", "cluster", "track", "map"] {
        let own = value(&format!("kreisel_step_seconds_count{{step=\"{step}\"}} "));
        assert!((own - count).abs() < 2.0, "{step}: {own} of {count}");
    }
    assert!(value("kreisel_received_bytes_total ") > 5.0 * 57_000.0);
    assert!(value("kreisel_sent_bytes_total ") > 1000.0);
}

#[test]
fn a_page_from_elsewhere_sees_nothing() {
    let demo = Served::demo("232");
    let Err(Error::Http(answer)) = demo.watch_from("http://elsewhere.example") else {
        panic!("it was let in");
    };
    assert_eq!(answer.status(), StatusCode::FORBIDDEN);
    for path in ["/", "/metrics", "/health"] {
        let answer = demo.get_from(path, "elsewhere.example:8111");
        assert!(answer.starts_with("HTTP/1.1 403"), "{path}: {answer}");
    }
}

#[test]
fn viewers_that_stall_flood_or_talk_nonsense_cost_no_revolution() {
    let demo = Served::demo("233");
    let _stalled: Vec<_> = (0..50).map(|_| demo.watch()).collect();
    let mut rude = demo.watch();
    let mut garbage = demo.connect();
    garbage.write_all(&[0xff; 4096]).unwrap();
    rude.send(Message::text("{\"seek\":")).unwrap();
    rude.send(Message::binary(vec![0; 100])).unwrap();
    // Longer than any message of the page: the viewer is dismissed.
    let _ = rude.send(Message::text("x".repeat(100_000)));
    for _ in 0..300 {
        assert!(demo.get("/").starts_with("HTTP/1.1 200"));
    }
    let mut viewer = demo.watch();
    let began = Instant::now();
    let status = loop {
        assert!(began.elapsed() < Duration::from_secs(20), "no status");
        let picture = next(&mut viewer);
        if let Some(status) = picture
            .statuses
            .into_iter()
            .find(|status| status.uptime > 5.0)
        {
            break status;
        }
    };
    assert_eq!(status.revolutions_queue_dropped, 0);
    assert_eq!(status.datagrams_kernel_dropped, 0);
    assert_eq!(status.revolutions_published, status.revolutions_received);
}

#[test]
fn more_viewers_than_there_is_room_for_are_turned_away() {
    let demo = Served::demo("234");
    let viewers: Vec<_> = (0..64).map(|_| demo.watch()).collect();
    let one_more = demo.watch_from(&format!("http://{}", demo.address));
    assert!(
        matches!(one_more, Err(Error::Http(answer)) if answer.status() == StatusCode::SERVICE_UNAVAILABLE)
    );
    drop(viewers);
    std::thread::sleep(Duration::from_millis(500));
    assert!(next(&mut demo.watch()).points > 2000);
}

/// A recording of a simulated roundabout in which a second sensor speaks between the first one's revolutions, and
/// which a pose ends.
fn recording(folder: &std::path::Path) -> String {
    let path = folder.join("drive.rec");
    let mut simulate = Command::new(env!("CARGO_BIN_EXE_kreisel"));
    simulate
        .args(["simulate", "roundabout", "--duration=6", "--output"])
        .arg(&path);
    assert!(simulate.status().unwrap().success());
    let bytes = std::fs::read(&path).unwrap();
    let mut both = vec![];
    for entry in Recording::new(&bytes).flatten() {
        both.extend_from_slice(entry.frame);
        let (time, payload) = (entry.envelope.time(), entry.envelope.payload);
        let postmark = Postmark {
            sent: time,
            sampled: time,
            sender_stamp: 9,
        };
        postmark.put_payload(&mut both, entry.envelope.data_type, |out| {
            out.extend_from_slice(payload)
        });
    }
    std::fs::write(&path, both).unwrap();
    path.to_str().unwrap().into()
}

#[test]
fn a_recording_is_played_paused_stepped_and_sought() {
    let folder = tempfile::tempdir().unwrap();
    let path = recording(folder.path());
    let view = Served::start(&["view", &path, "--address=127.0.0.1:0"]);
    let mut viewer = view.watch();
    let player = |picture: &Picture, name: &str| picture.heading["player"][name].clone();
    let at_s = |picture: &Picture| player(picture, "at_s").as_f64().unwrap();

    let begin = next(&mut viewer);
    assert!(at_s(&begin) < 1.0, "{}", begin.heading);
    assert!((5.5..6.1).contains(&player(&begin, "duration_s").as_f64().unwrap()));
    let mut until = |controls: &str, wanted: &dyn Fn(&Picture) -> bool| {
        for control in controls.split(' ') {
            viewer.send(Message::text(control)).unwrap();
        }
        let mut pictures = (0..100).map(|_| next(&mut viewer));
        pictures.find(|picture| wanted(picture)).expect(controls)
    };
    until(r#"{"seek":1.0}"#, &|picture| at_s(picture) > 0.95);
    let paused = until(r#"{"play":false}"#, &|picture| {
        player(picture, "is_playing") == false
    });
    let on = until(r#"{"step":1}"#, &|picture| {
        at_s(picture) > at_s(&paused) + 0.05
    });
    assert!((at_s(&on) - at_s(&paused) - 0.1).abs() < 0.01);
    let back = until(r#"{"step":-1}"#, &|picture| {
        at_s(picture) < at_s(&on) - 0.05
    });
    assert!(
        (at_s(&back) - at_s(&paused)).abs() < 0.01,
        "{}",
        back.heading
    );
    // A second step before the first one is done is another step.
    let twice = until(r#"{"step":-1} {"step":-1}"#, &|picture| {
        at_s(picture) < at_s(&back) - 0.15
    });
    assert!(
        (at_s(&back) - at_s(&twice) - 0.2).abs() < 0.01,
        "{}",
        twice.heading
    );
    let late = until(r#"{"seek":5.0}"#, &|picture| at_s(picture) > 4.5);
    assert!((at_s(&late) - 5.0).abs() < 0.11);
    let early = until(r#"{"seek":0.5}"#, &|picture| at_s(picture) < 4.0);
    assert!((at_s(&early) - 0.5).abs() < 0.11);
    let on = until(r#"{"play":true}"#, &|picture| at_s(picture) > 1.0);
    assert_eq!(player(&on, "is_playing"), true);
    until(r#"{"seek":5.8}"#, &|picture| {
        player(picture, "is_playing") == false
    });
    // At its end it begins anew, whatever comes after the last revolution.
    let again = until(r#"{"play":true}"#, &|picture| at_s(picture) < 2.0);
    assert_eq!(player(&again, "is_playing"), true);
}

#[test]
fn who_comes_while_it_is_paused_sees_objects_and_map() {
    let folder = tempfile::tempdir().unwrap();
    let view = Served::start(&["view", &recording(folder.path()), "--address=127.0.0.1:0"]);
    let mut viewer = view.watch();
    viewer.send(Message::text(r#"{"seek":3.0}"#)).unwrap();
    viewer.send(Message::text(r#"{"play":false}"#)).unwrap();
    let mut pictures = (0..50).map(|_| next(&mut viewer));
    let is_there = |picture: &Picture| {
        let player = &picture.heading["player"];
        player["is_playing"] == false && player["at_s"].as_f64().unwrap() > 2.9
    };
    pictures.find(is_there).expect("paused at 3 s");
    let late = next(&mut view.watch());
    assert_eq!(late.lists.len(), 1);
    assert!(
        late.lists[0].count > 3 && late.tiles > 20,
        "{} tiles",
        late.tiles
    );
}

#[test]
fn a_session_is_shown_with_what_a_daemon_in_it_publishes() {
    let _demo = Served::demo("235");
    let arguments = [
        "view",
        "--cid=235",
        "--interface=127.0.0.1",
        "--address=127.0.0.1:0",
    ];
    let view = Served::start(&arguments);
    let mut viewer = view.watch();
    let mut pictures = (0..50).map(|_| next(&mut viewer));
    let picture = pictures.find(|picture| picture.points > 2000 && !picture.statuses.is_empty());
    assert_eq!(picture.expect("points and a status").lists.len(), 1);
}
