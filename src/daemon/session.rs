//! A session on the network: UDP multicast 225.0.0.CID, port 12175.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4, UdpSocket};

use socket2::{Domain, Protocol, Socket, Type};

use super::listener::{Arrival, Datagram, Listener};
use crate::config::SessionParameters;

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
    listener: Listener,
    group: SocketAddrV4,
    interface: Ipv4Addr,
}

/// The sending side.
#[derive(Debug)]
pub struct Sender {
    socket: UdpSocket,
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
        let sender = self.sender_on(interface, parameters.ttl)?;
        // A stalled interface must not hold up what comes in.
        sender
            .socket
            .set_nonblocking(true)
            .map_err(self.failed("make the sending socket"))?;
        let own = sender.socket.local_addr().ok();
        let listener = Listener::new(socket, parameters.receive_buffer_mb, own)
            .map_err(self.failed("watch the socket"))?;
        let receiver = Receiver {
            listener,
            group: self.group(),
            interface: interface.unwrap_or(Ipv4Addr::UNSPECIFIED),
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
        self.listener.buffer_bytes()
    }

    /// How long the buffer lasts with ten revolutions a second coming in.
    pub fn buffer_seconds(&self) -> f64 {
        0.1 * (self.listener.buffer_bytes() / BUFFER_PER_REVOLUTION) as f64
    }

    /// Waits for a datagram. Who stops waiting loses none.
    ///
    /// # Errors
    /// [`SessionError::Socket`] when the socket is of no more use.
    pub async fn receive(&mut self, datagram: &mut Datagram) -> Result<Arrival, SessionError> {
        let taken = self.listener.receive(datagram).await;
        taken.map_err(self.failed())
    }

    /// The next datagram if it has come already.
    ///
    /// # Errors
    /// As [`Self::receive`].
    pub fn receive_waiting(
        &mut self,
        datagram: &mut Datagram,
    ) -> Result<Option<Arrival>, SessionError> {
        let taken = self.listener.receive_waiting(datagram);
        taken.map_err(self.failed())
    }

    fn failed(&self) -> impl FnOnce(io::Error) -> SessionError + use<> {
        let group = self.group;
        move |error| SessionError::Socket {
            group,
            attempt: "receive",
            error,
        }
    }
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
