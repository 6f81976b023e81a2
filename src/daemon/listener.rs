//! A UDP socket that is listened to: datagrams into buffers of their own, with what the kernel knows of them.

use std::fmt;
use std::io::{self, IoSliceMut};
use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4};
use std::os::fd::{AsRawFd as _, RawFd};

use nix::sys::socket::{ControlMessageOwned, MsgFlags, SockaddrIn, recvmsg, setsockopt, sockopt};
use socket2::Socket;
use tokio::io::Interest;

use crate::time::Time;
use crate::wire::frame::MAX_DATAGRAM_LEN;

/// A socket with a large receive buffer, kernel time stamps and drop counts.
#[derive(Debug)]
pub struct Listener {
    socket: tokio::net::UdpSocket,
    own: Option<SocketAddr>,
    buffer_bytes: usize,
    control: Vec<u8>,
}

/// A datagram in a buffer of its own, which the kernel writes into.
pub struct Datagram {
    buffer: Box<[u8]>,
    length: usize,
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
    /// Address of the interface that it came to, where that is asked for.
    pub local: Option<Ipv4Addr>,
}

impl Listener {
    /// Listens to a socket that does not block. What comes from the address `own` is ours. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// What the system says.
    pub fn new(socket: Socket, buffer_mb: f64, own: Option<SocketAddr>) -> io::Result<Self> {
        let buffer_bytes = grown_buffer(&socket, buffer_mb)?;
        for result in [
            setsockopt(&socket, sockopt::ReceiveTimestampns, &true),
            setsockopt(&socket, sockopt::RxqOvfl, &1),
        ] {
            if let Err(error) = result {
                tracing::info!("no kernel time stamps or drop counts: {error}");
            }
        }
        Ok(Self {
            socket: tokio::net::UdpSocket::from_std(socket.into())?,
            own,
            buffer_bytes,
            control: nix::cmsg_space!(nix::sys::time::TimeSpec, u32, nix::libc::in_pktinfo),
        })
    }

    /// The receive buffer that the kernel granted.
    pub fn buffer_bytes(&self) -> usize {
        self.buffer_bytes
    }

    /// Waits for a datagram. Who stops waiting loses none.
    ///
    /// # Errors
    /// What the system says.
    pub async fn receive(&mut self, datagram: &mut Datagram) -> io::Result<Arrival> {
        loop {
            let (control, own) = (&mut self.control, self.own);
            let fd = self.socket.as_raw_fd();
            let taken = self
                .socket
                .async_io(Interest::READABLE, || take(fd, datagram, control, own))
                .await?;
            if let Some(arrival) = taken {
                return Ok(arrival);
            }
        }
    }

    /// The next datagram if it has come already.
    ///
    /// # Errors
    /// What the system says.
    pub fn receive_waiting(&mut self, datagram: &mut Datagram) -> io::Result<Option<Arrival>> {
        loop {
            let fd = self.socket.as_raw_fd();
            match take(fd, datagram, &mut self.control, self.own) {
                Ok(None) => {}
                Err(error) if error.kind() == io::ErrorKind::WouldBlock => return Ok(None),
                taken => return taken,
            }
        }
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
        local: None,
    };
    for part in message.cmsgs()? {
        match part {
            ControlMessageOwned::ScmTimestampns(stamp) => {
                let micros = stamp.tv_sec() * 1_000_000 + stamp.tv_nsec() / 1000;
                arrival.time = Time::from_micros(micros);
            }
            ControlMessageOwned::Ipv4PacketInfo(info) => {
                arrival.local = Some(Ipv4Addr::from_bits(u32::from_be(info.ipi_spec_dst.s_addr)));
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
