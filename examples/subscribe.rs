//! A subscriber: joins a session and prints every list of objects that a daemon in it sends.
//!
//! `cargo run --release --example subscribe -- 111 127.0.0.1` beside
//! `kreisel demo --cid 111`

use std::net::{Ipv4Addr, UdpSocket};

use kreisel::wire::object_list::ObjectList;
use kreisel::wire::{Envelope, Message};

/// The port of every session.
const PORT: u16 = 12_175;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let session: u8 = arguments.next().ok_or("which session?")?.parse()?;
    let interface: Ipv4Addr = arguments
        .next()
        .map_or(Ok(Ipv4Addr::UNSPECIFIED), |text| text.parse())?;
    let group = Ipv4Addr::new(225, 0, 0, session);
    // Others in the session listen on this host, too.
    let socket = socket2::Socket::new(socket2::Domain::IPV4, socket2::Type::DGRAM, None)?;
    socket.set_reuse_address(true)?;
    socket.bind(&std::net::SocketAddr::from((group, PORT)).into())?;
    let socket = UdpSocket::from(socket);
    socket.join_multicast_v4(&group, &interface)?;
    let mut datagram = vec![0; 65_536];
    loop {
        let length = socket.recv(&mut datagram)?;
        let Ok((envelope, _)) = Envelope::from_datagram(&datagram[..length]) else {
            continue;
        };
        if envelope.data_type != ObjectList::ID {
            continue;
        }
        let list = ObjectList::decode(envelope.payload, envelope.payload_offset)?;
        println!("revolution {}: {} objects", list.revolution, list.count);
        for object in &list.objects.0 {
            println!(
                "  {} at {:.1}, {:.1} m, {:.1} m/s",
                object.object_id, object.x, object.y, object.speed
            );
        }
    }
}
