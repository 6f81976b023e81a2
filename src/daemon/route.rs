//! The route into a session: through which interface, from which address.

use std::io;
use std::net::{Ipv4Addr, SocketAddr, UdpSocket};

use nix::ifaddrs::getifaddrs;
use nix::net::if_::if_nametoindex;

use super::session::Session;

/// Where a session is joined. An interface that is made anew has another number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Route {
    address: Ipv4Addr,
    interface: u32,
}

impl std::fmt::Display for Route {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{} (interface {})", self.address, self.interface)
    }
}

impl Route {
    /// The route that joining takes now: over the named interface, else the routing table's choice, else loopback.
    ///
    /// # Errors
    /// When no interface has the address.
    pub(super) fn to(session: &Session) -> io::Result<Self> {
        let address = session.interface.unwrap_or_else(|| routed(session));
        let named = |found: &nix::ifaddrs::InterfaceAddress| {
            let found = found.address?.as_sockaddr_in()?.ip();
            (found == address).then_some(())
        };
        let mut interfaces = getifaddrs()?;
        let interface = interfaces.find(|found| named(found).is_some());
        let interface = interface.ok_or_else(|| {
            let message = format!("no interface has the address {address}");
            io::Error::new(io::ErrorKind::AddrNotAvailable, message)
        })?;
        Ok(Self {
            address,
            interface: if_nametoindex(&interface.interface_name[..])?,
        })
    }
}

/// The source address that the routing table chooses for the session.
fn routed(session: &Session) -> Ipv4Addr {
    let chosen = || -> io::Result<SocketAddr> {
        let socket = UdpSocket::bind((Ipv4Addr::UNSPECIFIED, 0))?;
        socket.connect(session.group())?;
        socket.local_addr()
    };
    match chosen() {
        Ok(SocketAddr::V4(address)) if !address.ip().is_unspecified() => *address.ip(),
        _ => Ipv4Addr::LOCALHOST,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_address_that_no_interface_has_leads_nowhere() {
        let route = |interface| {
            Route::to(&Session {
                cid: 111,
                interface: Some(interface),
            })
        };
        let loopback = route(Ipv4Addr::LOCALHOST).unwrap();
        assert_eq!(loopback, route(Ipv4Addr::LOCALHOST).unwrap());
        let problem = route(Ipv4Addr::new(192, 0, 2, 77)).unwrap_err().to_string();
        assert_eq!(problem, "no interface has the address 192.0.2.77");
    }
}
