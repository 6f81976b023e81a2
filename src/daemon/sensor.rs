//! A sensor's own packets from the network: UDP, unicast or broadcast, on two ports.

use std::io;
use std::net::{Ipv4Addr, SocketAddrV4};

use nix::sys::socket::{setsockopt, sockopt};
use socket2::{Domain, Protocol, Socket, Type};

use super::fault_log::FaultLog;
use super::kernel::Drops;
use super::listener::{Arrival, Datagram, Listener};
use crate::tally::Tally;
use crate::wire::velodyne::POSITION_PORT;

/// Where a sensor's packets come in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SensorPort {
    /// UDP port of data packets.
    pub port: u16,
    /// Address of the interface that they must come to; any if not given.
    pub interface: Option<Ipv4Addr>,
    /// Address that they must come from; that of the first sensor that is heard if not given.
    pub address: Option<Ipv4Addr>,
}

/// Why a sensor cannot be listened to.
#[derive(Debug, thiserror::Error)]
#[error("sensor's port {port}: cannot {attempt}: {error}")]
pub struct SensorError {
    port: u16,
    attempt: &'static str,
    error: io::Error,
}

/// The ports as they are listened to.
#[derive(Debug)]
pub(super) struct SensorPorts {
    at: SensorPort,
    data: Listener,
    /// `None` where another program has the port.
    position: Option<Listener>,
    pub(super) counts: SensorCounts,
    log: FaultLog,
}

/// What was counted at a sensor's ports.
#[derive(Debug, Default)]
pub(super) struct SensorCounts {
    pub(super) datagrams: u64,
    /// Bytes of them.
    pub(super) bytes: u64,
    pub(super) drops: Drops,
    pub(super) faults: Tally,
}

impl SensorPort {
    /// Listens. Must be called within a tokio runtime.
    ///
    /// # Errors
    /// [`SensorError`] when the port of data packets cannot be had.
    pub(super) fn open(self, buffer_mb: f64) -> Result<SensorPorts, SensorError> {
        let failed = |error| SensorError {
            port: self.port,
            attempt: "listen",
            error,
        };
        let position = listen(POSITION_PORT, buffer_mb);
        if let Err(error) = &position {
            tracing::info!("no position packets: port {POSITION_PORT}: {error}");
        }
        Ok(SensorPorts {
            at: self,
            data: listen(self.port, buffer_mb).map_err(failed)?,
            position: position.ok(),
            counts: SensorCounts::default(),
            log: FaultLog::default(),
        })
    }
}

/// Bound to all addresses: what is bound to one hears no broadcast.
fn listen(port: u16, buffer_mb: f64) -> io::Result<Listener> {
    let socket = Socket::new(Domain::IPV4, Type::DGRAM, Some(Protocol::UDP))?;
    socket.set_reuse_address(true)?;
    socket.set_nonblocking(true)?;
    socket.bind(&SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, port).into())?;
    setsockopt(&socket, sockopt::Ipv4PacketInfo, &true)?;
    Listener::new(socket, buffer_mb, None)
}

impl SensorPorts {
    /// The receive buffer that the kernel granted.
    pub(super) fn buffer_bytes(&self) -> usize {
        self.data.buffer_bytes()
    }

    /// Waits for a data packet. Who stops waiting loses none.
    ///
    /// # Errors
    /// [`SensorError`] when the socket is of no more use.
    pub(super) async fn receive(
        &mut self,
        datagram: &mut Datagram,
    ) -> Result<Arrival, SensorError> {
        loop {
            let arrival = self.data.receive(datagram).await;
            let arrival = arrival.map_err(|error| self.lost(error))?;
            if self.is_for_us(&arrival, datagram) {
                return Ok(arrival);
            }
        }
    }

    /// The next data packet if it has come already.
    ///
    /// # Errors
    /// As [`Self::receive`].
    pub(super) fn receive_waiting(
        &mut self,
        datagram: &mut Datagram,
    ) -> Result<Option<Arrival>, SensorError> {
        loop {
            let arrival = self.data.receive_waiting(datagram);
            let arrival = arrival.map_err(|error| self.lost(error))?;
            if arrival.is_none_or(|arrival| self.is_for_us(&arrival, datagram)) {
                return Ok(arrival);
            }
        }
    }

    /// The next position packet if it has come already. They can be done without.
    pub(super) fn position_waiting(&mut self, datagram: &mut Datagram) -> Option<Arrival> {
        let arrival = self.position.as_mut()?.receive_waiting(datagram).ok()??;
        self.is_for_us(&arrival, datagram).then_some(arrival)
    }

    fn lost(&self, error: io::Error) -> SensorError {
        SensorError {
            port: self.at.port,
            attempt: "receive",
            error,
        }
    }

    /// Counts a datagram, and says whether it comes from where it should.
    fn is_for_us(&mut self, arrival: &Arrival, datagram: &Datagram) -> bool {
        self.counts.datagrams += 1;
        self.counts.bytes += datagram.bytes().len() as u64;
        self.counts
            .drops
            .note(arrival, "packets of the sensor", &mut self.log);
        let source = arrival.source;
        let (is_expected, name) = if self
            .at
            .address
            .is_some_and(|address| address != *source.ip())
        {
            (false, "packet_other_address")
        } else {
            let is_there = |interface| arrival.local.is_none_or(|local| local == interface);
            (
                self.at.interface.is_none_or(is_there),
                "packet_other_interface",
            )
        };
        if !is_expected {
            self.counts.faults.count(name);
            self.log
                .note(name, || format!("packets from {source} are passed over"));
        }
        is_expected
    }
}
