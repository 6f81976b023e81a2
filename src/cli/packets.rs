//! Packets of a sensor onto the network, as the sensor sends them.

use std::net::{Ipv4Addr, SocketAddr, SocketAddrV4, ToSocketAddrs as _, UdpSocket};
use std::time::Duration;

use anyhow::{Context as _, Result, bail};
use tokio::time::{Instant, sleep_until};

use super::replay::LONGEST_PAUSE_S;
use crate::simulate::Simulation;
use crate::simulate::scenario::Scenario;
use crate::wire::velodyne::captured::SensorPackets;
use crate::wire::velodyne::{DATA_PORT, POSITION_PORT, Packet};

/// Where they go.
#[derive(Debug)]
pub(super) struct PacketSender {
    socket: UdpSocket,
    host: Ipv4Addr,
    port: u16,
}

impl PacketSender {
    /// To a host, by name or address, and a port if it is not the usual one.
    ///
    /// # Errors
    /// What the system says.
    pub(super) fn to(target: &str) -> Result<Self> {
        let with_port = match target.contains(':') {
            true => target.into(),
            false => format!("{target}:{DATA_PORT}"),
        };
        let mut found = with_port
            .to_socket_addrs()
            .with_context(|| format!("cannot send to {target}"))?;
        let ipv4 = found.find_map(|address| match address {
            SocketAddr::V4(address) => Some(address),
            SocketAddr::V6(_) => None,
        });
        let Some(address) = ipv4 else {
            bail!("cannot send to {target}: it has no IPv4 address");
        };
        let socket = UdpSocket::bind(SocketAddrV4::new(Ipv4Addr::UNSPECIFIED, 0))?;
        socket.set_broadcast(true)?;
        Ok(Self {
            socket,
            host: *address.ip(),
            port: address.port(),
        })
    }

    fn send(&self, packet: &Packet<'_>) -> Result<()> {
        let port = match packet.port() {
            POSITION_PORT => POSITION_PORT,
            _ => self.port,
        };
        let sent = self.socket.send_to(packet.bytes, (self.host, port));
        match sent {
            // Nobody listens yet, which a sensor would not know.
            Err(error) if error.kind() == std::io::ErrorKind::ConnectionRefused => Ok(()),
            sent => sent
                .map(|_| ())
                .with_context(|| format!("cannot send to {}:{port}", self.host)),
        }
    }

    /// Sends packets once, at so many times their own pace, from `due` on. Gives when they end.
    pub(super) async fn play(
        &self,
        packets: &SensorPackets,
        speed: f64,
        mut due: Instant,
    ) -> Result<Instant> {
        let mut last = None;
        for packet in packets.iter() {
            let passed_s = last
                .replace(packet.arrival)
                .map_or(0.0, |last| (packet.arrival - last).seconds());
            due += Duration::from_secs_f64(passed_s.clamp(0.0, LONGEST_PAUSE_S) / speed);
            sleep_until(due).await;
            self.send(&packet)?;
        }
        Ok(due)
    }

    /// Sends what a simulated sensor sends, for ever.
    pub(super) async fn simulate(&self, scenario: &Scenario, seed: u64, speed: f64) -> Result<()> {
        let mut simulation = Simulation::in_packets(*scenario, seed);
        let mut due = Instant::now();
        let mut packets = SensorPackets::default();
        let mut last = None;
        loop {
            packets.packets.0.clear();
            simulation.revolve_in_packets(|packet| {
                packets.push(packet);
            });
            // From the last packet of the revolution before on.
            let first = packets.iter().next().map(|packet| packet.arrival);
            if let (Some(first), Some(last)) = (first, last) {
                let passed: crate::time::Span = first - last;
                due += Duration::from_secs_f64(passed.seconds().max(0.0) / speed);
            }
            last = packets.iter().last().map(|packet| packet.arrival);
            due = self.play(&packets, speed, due).await?;
        }
    }
}
