//! What the tests share that make network namespaces for themselves: programs that end with the test, and a peer.
#![allow(unreachable_pub, dead_code, reason = "each test uses a part of it")]

use std::io::Read;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};
use std::os::unix::process::CommandExt as _;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use kreisel::wire::{Envelope, Message};
use nix::sys::signal::{Signal, killpg};
use nix::unistd::Pid;

const CID: u8 = 111;

/// Runs a test in a network namespace of its own, in which loopback carries multicast.
pub fn in_namespace(test: impl FnOnce() + Send) {
    std::thread::scope(|scope| {
        let thread = scope.spawn(|| {
            if !enter_namespace() {
                assert!(
                    std::env::var_os("CI").is_none(),
                    "cannot make a network namespace"
                );
                eprintln!("skipped: cannot make a network namespace");
                return;
            }
            test();
        });
        if let Err(panic) = thread.join() {
            std::panic::resume_unwind(panic);
        }
    });
}

/// Namespaces belong to threads; what this thread starts later lives in its namespace, too.
fn enter_namespace() -> bool {
    let ip = |arguments: &str| {
        let result = Command::new("ip").args(arguments.split(' ')).status();
        result.is_ok_and(|status| status.success())
    };
    nix::sched::unshare(nix::sched::CloneFlags::CLONE_NEWNET).is_ok()
        && ip("link set lo up")
        && ip("route add 225.0.0.0/24 dev lo src 127.0.0.1")
}

/// A command that ends with the test, and what it has started itself: libcluon's tools come in
/// a wrapper.
pub struct Running {
    pub child: Child,
    /// What it prints; read all along, or it would wait for a reader.
    printed: [Option<JoinHandle<String>>; 2],
}

/// Reads to the end in a thread.
fn reading(mut pipe: impl Read + Send + 'static) -> Option<JoinHandle<String>> {
    Some(std::thread::spawn(move || {
        let mut text = vec![];
        let _ = pipe.read_to_end(&mut text);
        String::from_utf8_lossy(&text).into_owned()
    }))
}

impl Running {
    pub fn start(program: &str, arguments: &[&str]) -> Self {
        let mut command = Command::new(program);
        command
            .args(arguments)
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .process_group(0);
        let mut child = command.spawn().unwrap();
        let printed = [
            reading(child.stdout.take().unwrap()),
            reading(child.stderr.take().unwrap()),
        ];
        Self { child, printed }
    }

    pub fn kreisel(arguments: &[&str]) -> Self {
        Self::start(env!("CARGO_BIN_EXE_kreisel"), arguments)
    }

    /// A daemon that is ready to receive.
    pub fn daemon(arguments: &[&str]) -> Self {
        let daemon = Self::kreisel(&[&["run", "--cid=111"], arguments].concat());
        await_true("the daemon's health socket", || {
            let sockets = std::fs::read_to_string("/proc/thread-self/net/unix").unwrap();
            sockets.contains("@kreisel-health-111")
        });
        daemon
    }

    pub fn signal(&self, signal: Signal) {
        killpg(Pid::from_raw(self.child.id() as i32), signal).unwrap();
    }

    /// What it printed, once it has ended.
    pub fn output(mut self) -> (i32, String, String) {
        let texts = self.printed.each_mut().map(Option::take);
        let [out, err] = texts.map(|reader| reader.unwrap().join().unwrap());
        (self.child.wait().unwrap().code().unwrap_or(-1), out, err)
    }

    pub fn stop(self) -> (i32, String, String) {
        self.signal(Signal::SIGTERM);
        self.output()
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        let _ = killpg(Pid::from_raw(self.child.id() as i32), Signal::SIGKILL);
        let _ = self.child.wait();
    }
}

pub fn await_true(what: &str, mut condition: impl FnMut() -> bool) {
    let begin = Instant::now();
    while !condition() {
        assert!(
            begin.elapsed() < Duration::from_secs(10),
            "waited in vain for {what}"
        );
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// A peer in the session: sends datagrams, and hears everything.
pub struct Peer {
    pub socket: UdpSocket,
    pub group: SocketAddrV4,
}

impl Peer {
    pub fn join() -> Self {
        Self::join_on(Ipv4Addr::LOCALHOST)
    }

    pub fn join_on(interface: Ipv4Addr) -> Self {
        use socket2::{Domain, Socket, Type};
        let group = SocketAddrV4::new(Ipv4Addr::new(225, 0, 0, CID), 12_175);
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, None).unwrap();
        socket.set_reuse_address(true).unwrap();
        socket.set_recv_buffer_size(8 << 20).unwrap();
        socket.bind(&group.into()).unwrap();
        socket.join_multicast_v4(group.ip(), &interface).unwrap();
        socket.set_multicast_if_v4(&interface).unwrap();
        socket
            .set_read_timeout(Some(Duration::from_millis(100)))
            .unwrap();
        Self {
            socket: socket.into(),
            group,
        }
    }

    pub fn send(&self, datagram: &[u8]) {
        self.socket.send_to(datagram, self.group).unwrap();
    }

    /// Waits for messages of a type until one pleases.
    pub fn await_message<M: Message>(&self, pleases: impl Fn(&M) -> bool) -> M {
        self.await_payload(M::ID, |payload| {
            Some(M::decode(payload, 0).unwrap()).filter(&pleases)
        })
    }

    /// Waits for messages of a number until something can be made of a payload.
    pub fn await_payload<T>(&self, data_type: i32, make: impl Fn(&[u8]) -> Option<T>) -> T {
        let mut buffer = vec![0; 65_536];
        let begin = Instant::now();
        while begin.elapsed() < Duration::from_secs(10) {
            let Ok(length) = self.socket.recv(&mut buffer) else {
                continue;
            };
            let Ok((envelope, _)) = Envelope::from_datagram(&buffer[..length]) else {
                continue;
            };
            if envelope.data_type != data_type {
                continue;
            }
            if let Some(made) = make(envelope.payload) {
                return made;
            }
        }
        panic!("waited in vain for message {data_type}");
    }
}

pub fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}
