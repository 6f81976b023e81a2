//! A session on the network: UDP multicast 225.0.0.CID, port 12175.

use std::fmt;
use std::io::{self, IoSliceMut};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, UdpSocket};
use std::os::fd::{AsRawFd as _, RawFd};

use nix::sys::socket::{ControlMessageOwned, MsgFlags, SockaddrIn, recvmsg, setsockopt, sockopt};
use socket2::{Domain, Protocol, Socket, Type};
use tokio::io::Interest;

use crate::config::SessionParameters;
use crate::time::Time;
use crate::wire::frame::MAX_DATAGRAM_LEN;

/// Port of every OpenDaVINCI and OpenDLV session.
const PORT: u16 = 12_175;

/// Which session, and through which interface.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Session {
    /// The session's number, the last byte of the group.
    pub cid: u8,
    /// Address of the interface to join on; the routing table's choice if not given, and
    /// loopback if that has none.
    pub interface: Option<Ipv4Addr>,
}

/// Why a session cannot be joined, or was lost.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// A socket call failed.
    #[error("session {group}: cannot {attempt}: {error}")]
    Socket {
        /// The session's group.
        group: SocketAddrV4,
        /// What was tried.
        attempt: &'static str,
        /// What the system says.
        error: io::Error,
    },
}

/// The receiving side.
#[derive(Debug)]
pub struct Receiver {
    socket: tokio::net::UdpSocket,
    group: SocketAddrV4,
    interface: Ipv4Addr,
    own: Option<SocketAddr>,
    buffer_bytes: usize,
    control: Vec<u8>,
}

/// A datagram in a buffer of its own, which the kernel writes into.
pub struct Datagram {
    buffer: Box<[u8]>,
    length: usize,
}

/// The sending side.
#[derive(Debug)]
pub struct Sender {
    socket: UdpSocket,
}

/// What the kernel says about a datagram.
#[derive(Debug, Clone, Copy)]
pub struct Arrival {
    /// When it came in, by the kernel's stamp where there is one.
    pub time: Time,
    /// Who sent it.
    pub source: SocketAddrV4,
    /// Whether that was us.
    pub is_own: bool,
    /// Datagrams that the kernel has dropped on this socket since the beginning.
    pub kernel_dropped: u64,
}

/// What a revolution takes of the receive buffer as the kernel counts it, measured with
/// datagrams of 64,000 bytes on loopback: 6 fit into 425,984 bytes, 129 into 8 MiB.
const BUFFER_PER_REVOLUTION: usize = 70_000;

impl Session {
    /// The multicast group.
    pub fn group(&self) -> SocketAddrV4 {
        SocketAddrV4::new(Ipv4Addr::new(225, 0, 0, self.cid), PORT)
    }

    fn failed(&self, attempt: &'static str) -> impl FnOnce(io::Error) -> SessionError + use<> {
        let group = self.group();
        move |error| SessionError::Socket {
            group,
            attempt,
            error,
        }
    }

    /// Joins the session for receiving and sending. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// [`SessionError::Socket`] with what was tried.
    pub fn join(&self, parameters: &SessionParameters) -> Result<(Receiver, Sender), SessionError> {
        let (socket, interface) = self.receiving_socket()?;
        let buffer_bytes = grown_buffer(&socket, parameters.receive_buffer_mb)
            .map_err(self.failed("read the receive buffer's size"))?;
        for result in [
            setsockopt(&socket, sockopt::ReceiveTimestampns, &true),
            setsockopt(&socket, sockopt::RxqOvfl, &1),
        ] {
            if let Err(error) = result {
                tracing::info!("no kernel time stamps or drop counts: {error}");
            }
        }
        let sender = self.sender_on(interface, parameters.ttl)?;
        let receiver = Receiver {
            socket: tokio::net::UdpSocket::from_std(socket.into())
                .map_err(self.failed("watch the socket"))?,
            group: self.group(),
            interface: interface.unwrap_or(Ipv4Addr::UNSPECIFIED),
            own: sender.socket.local_addr().ok(),
            buffer_bytes,
            control: nix::cmsg_space!(nix::sys::time::TimeSpec, u32),
        };
        Ok((receiver, sender))
    }

    /// A socket that only sends into the session.
    ///
    /// # Errors
    /// [`SessionError::Socket`] with what was tried.
    pub fn sender(&self, parameters: &SessionParameters) -> Result<Sender, SessionError> {
        let (_, interface) = self.receiving_socket()?;
        self.sender_on(interface, parameters.ttl)
    }

    /// Bound to the group, so that other sessions on this host are not heard, and joined.
    fn receiving_socket(&self) -> Result<(Socket, Option<Ipv4Addr>), SessionError> {
        let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))
            .map_err(self.failed("make a socket"))?;
        socket
            .set_reuse_address(true)
            .and_then(|()| socket.set_nonblocking(true))
            .and_then(|()| socket.bind(&self.group().into()))
            .map_err(self.failed("bind to the group"))?;
        // Not every kernel knows it; binding to the group does most of the same.
        let _ = socket.set_multicast_all_v4(false);
        let join = |interface: Ipv4Addr| socket.join_multicast_v4(self.group().ip(), &interface);
        let interface = match self.interface {
            Some(named) => join(named).map(|()| Some(named)),
            None => match join(Ipv4Addr::UNSPECIFIED) {
                Ok(()) => Ok(None),
                Err(_) => join(Ipv4Addr::LOCALHOST).map(|()| Some(Ipv4Addr::LOCALHOST)),
            },
        }
        .map_err(self.failed("join the group on the interface"))?;
        Ok((socket, interface))
    }

    /// Connected to the group, which fixes the source address that our own datagrams have.
    fn sender_on(&self, interface: Option<Ipv4Addr>, ttl: usize) -> Result<Sender, SessionError> {
        let failed = self.failed("make the sending socket");
        let make = || -> io::Result<UdpSocket> {
            let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
            if let Some(interface) = interface {
                socket.set_multicast_if_v4(&interface)?;
                socket.bind(&SocketAddrV4::new(interface, 0).into())?;
            }
            socket.set_multicast_ttl_v4(ttl as u32)?;
            socket.set_multicast_loop_v4(true)?;
            socket.connect(&self.group().into())?;
            Ok(socket.into())
        };
        let socket = make().map_err(failed)?;
        Ok(Sender { socket })
    }
}

/// Asks for a receive buffer: beyond the system's limit where we may, else up to it. Gives what
/// the kernel granted.
fn grown_buffer(socket: &Socket, wanted_mb: f64) -> io::Result<usize> {
    let wanted = (wanted_mb * 1e6) as usize;
    if setsockopt(socket, sockopt::RcvBufForce, &wanted).is_err() {
        socket.set_recv_buffer_size(wanted)?;
    }
    socket.recv_buffer_size()
}

impl Receiver {
    /// The group that was joined.
    pub fn group(&self) -> SocketAddrV4 {
        self.group
    }

    /// The interface that it was joined on; 0.0.0.0 is the routing table's choice.
    pub fn interface(&self) -> Ipv4Addr {
        self.interface
    }

    /// The receive buffer that the kernel granted.
    pub fn buffer_bytes(&self) -> usize {
        self.buffer_bytes
    }

    /// How long the buffer lasts with ten revolutions a second coming in.
    pub fn buffer_seconds(&self) -> f64 {
        0.1 * (self.buffer_bytes / BUFFER_PER_REVOLUTION) as f64
    }

    /// Waits for a datagram. Who stops waiting loses none.
    ///
    /// # Errors
    /// [`SessionError::Socket`] when the socket is of no more use.
    pub async fn receive(&mut self, datagram: &mut Datagram) -> Result<Arrival, SessionError> {
        loop {
            let (control, own) = (&mut self.control, self.own);
            let fd = self.socket.as_raw_fd();
            let taken = self
                .socket
                .async_io(Interest::READABLE, || take(fd, datagram, control, own))
                .await;
            if let Some(arrival) = self.checked(taken)? {
                return Ok(arrival);
            }
        }
    }

    /// The next datagram if it has come already.
    ///
    /// # Errors
    /// As [`Self::receive`].
    pub fn receive_waiting(
        &mut self,
        datagram: &mut Datagram,
    ) -> Result<Option<Arrival>, SessionError> {
        loop {
            let taken = take(
                self.socket.as_raw_fd(),
                datagram,
                &mut self.control,
                self.own,
            );
            if matches!(&taken, Err(error) if error.kind() == io::ErrorKind::WouldBlock) {
                return Ok(None);
            }
            if let Some(arrival) = self.checked(taken)? {
                return Ok(Some(arrival));
            }
        }
    }

    fn checked(&self, taken: io::Result<Option<Arrival>>) -> Result<Option<Arrival>, SessionError> {
        taken.map_err(|error| SessionError::Socket {
            group: self.group,
            attempt: "receive",
            error,
        })
    }
}

impl Datagram {
    /// What was received.
    pub fn bytes(&self) -> &[u8] {
        &self.buffer[..self.length]
    }
}

impl Default for Datagram {
    /// Nothing yet, with room for the longest datagram and a byte that tells a longer one.
    fn default() -> Self {
        Self {
            buffer: vec![0; MAX_DATAGRAM_LEN + 1].into(),
            length: 0,
        }
    }
}

impl From<&[u8]> for Datagram {
    /// A copy that takes no more room than it needs.
    fn from(bytes: &[u8]) -> Self {
        Self {
            buffer: bytes.into(),
            length: bytes.len(),
        }
    }
}

impl fmt::Debug for Datagram {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Datagram of {} bytes", self.length)
    }
}

/// `None` is a datagram from no IPv4 address.
fn take(
    fd: RawFd,
    datagram: &mut Datagram,
    control: &mut [u8],
    own: Option<SocketAddr>,
) -> io::Result<Option<Arrival>> {
    let mut slices = [IoSliceMut::new(&mut datagram.buffer)];
    let message = recvmsg::<SockaddrIn>(fd, &mut slices, Some(control), MsgFlags::empty())?;
    let Some(source) = message.address else {
        return Ok(None);
    };
    let source = SocketAddrV4::from(source);
    let mut arrival = Arrival {
        time: Time::ZERO,
        source,
        is_own: is_own(source, own),
        kernel_dropped: 0,
    };
    for part in message.cmsgs()? {
        match part {
            ControlMessageOwned::ScmTimestampns(stamp) => {
                let micros = stamp.tv_sec() * 1_000_000 + stamp.tv_nsec() / 1000;
                arrival.time = Time::from_micros(micros);
            }
            ControlMessageOwned::RxqOvfl(dropped) => arrival.kernel_dropped = dropped.into(),
            _ => {}
        }
    }
    if arrival.time.is_zero() {
        arrival.time = super::now();
    }
    datagram.length = message.bytes;
    Ok(Some(arrival))
}

/// Whether a datagram is ours. A route without a source address makes it 0.0.0.0.
fn is_own(source: SocketAddrV4, own: Option<SocketAddr>) -> bool {
    own.is_some_and(|own| {
        own.port() == source.port() && (own.ip() == *source.ip() || source.ip().is_unspecified())
    })
}

impl Sender {
    /// Sends one frame.
    ///
    /// # Errors
    /// What the system says.
    pub fn send(&self, frame: &[u8]) -> io::Result<()> {
        self.socket.send(frame).map(|_| ())
    }
}
