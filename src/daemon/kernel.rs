//! What the kernel counts of datagrams that never reach this process.

use super::fault_log::FaultLog;
use super::listener::Arrival;

/// Counts of this network namespace.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(super) struct KernelCounts {
    /// Fragmented datagrams that could not be put together.
    pub(super) fragmented_lost: u64,
    /// Datagrams whose checksum is wrong.
    pub(super) checksums_wrong: u64,
}

impl KernelCounts {
    /// As they are now; zeros where the system does not tell.
    pub(super) fn read() -> Self {
        let text = std::fs::read_to_string("/proc/thread-self/net/snmp");
        text.map_or_else(|_| Self::default(), |text| Self::parse(&text))
    }

    /// A protocol has a line of names and a line of numbers.
    fn parse(text: &str) -> Self {
        let count = |protocol: &str, name: &str| {
            let mut lines = text.lines().filter_map(|line| line.strip_prefix(protocol));
            let (names, numbers) = (lines.next()?, lines.next()?);
            let mut both = names.split_whitespace().zip(numbers.split_whitespace());
            both.find(|(found, _)| *found == name)?.1.parse().ok()
        };
        Self {
            fragmented_lost: count("Ip: ", "ReasmFails").unwrap_or(0),
            checksums_wrong: count("Udp: ", "InCsumErrors").unwrap_or(0),
        }
    }

    /// What came since other counts.
    pub(super) fn since(&self, before: &Self) -> Self {
        Self {
            fragmented_lost: self.fragmented_lost.saturating_sub(before.fragmented_lost),
            checksums_wrong: self.checksums_wrong.saturating_sub(before.checksums_wrong),
        }
    }
}

/// What the kernel dropped of what came to a socket.
#[derive(Debug)]
pub(super) struct Drops {
    total: u64,
    /// What was counted of the host when this was told last.
    told: KernelCounts,
}

impl Default for Drops {
    fn default() -> Self {
        Self {
            total: 0,
            told: KernelCounts::read(),
        }
    }
}

impl Drops {
    /// How many so far.
    pub(super) fn total(&self) -> u64 {
        self.total
    }

    /// Notes what a datagram says of those before it, and tells why they were dropped.
    pub(super) fn note(&mut self, arrival: &Arrival, what: &str, log: &mut FaultLog) {
        let lost = arrival.kernel_dropped.saturating_sub(self.total);
        if lost == 0 {
            return;
        }
        self.total = arrival.kernel_dropped;
        let told = &mut self.told;
        log.note("kernel_dropped", || {
            let now = KernelCounts::read();
            let wrong = now.since(told).checksums_wrong;
            *told = now;
            match wrong {
                0 => format!("{lost} {what}: the receive buffer was full"),
                _ => format!("{lost} {what}: the checksums of {wrong} on this host were wrong"),
            }
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_found_by_their_names() {
        let text = "Ip: Forwarding ReasmOKs ReasmFails FragOKs\nIp: 1 18520 463 7\n\
                    Udp: InDatagrams InErrors InCsumErrors\nUdp: 503514 4943 12\n\
                    UdpLite: InDatagrams InCsumErrors\nUdpLite: 0 99\n";
        let expected = KernelCounts {
            fragmented_lost: 463,
            checksums_wrong: 12,
        };
        assert_eq!(KernelCounts::parse(text), expected);
        for damaged in ["", "Ip: ReasmFails\n", "Ip: ReasmFails\nIp: many\n"] {
            assert_eq!(KernelCounts::parse(damaged), KernelCounts::default());
        }
    }
}
