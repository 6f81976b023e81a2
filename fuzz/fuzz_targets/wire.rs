//! Any bytes as any message: none panics, and what is read is read again from what it writes.
#![no_main]

use kreisel::wire::grid_tile::GridTile;
use kreisel::wire::object_list::ObjectList;
use kreisel::wire::point_cloud::{ByteOrder, CompactPointCloud};
use kreisel::wire::status::Status;
use kreisel::wire::velodyne::data::DataPacket;
use kreisel::wire::velodyne::device_service::SweepAssembler;
use kreisel::wire::velodyne::position::PositionPacket;
use kreisel::wire::{Envelope, Message, pose};
use libfuzzer_sys::fuzz_target;

fn again<M: Message + std::fmt::Debug>(payload: &[u8]) {
    let Ok(message) = M::decode(payload, 0) else {
        return;
    };
    let mut bytes = vec![];
    message.encode(&mut bytes);
    let read = M::decode(&bytes, 0).expect("own bytes");
    // As text: a number that is none is not equal to itself.
    assert_eq!(format!("{message:?}"), format!("{read:?}"));
}

fuzz_target!(|bytes: &[u8]| {
    let payload = match Envelope::from_datagram(bytes) {
        Ok((envelope, rest)) => {
            assert!(rest <= bytes.len() && envelope.payload.len() <= bytes.len());
            envelope.payload
        }
        Err(error) => {
            assert!(error.offset() <= bytes.len());
            bytes
        }
    };
    again::<ObjectList>(payload);
    again::<GridTile>(payload);
    again::<Status>(payload);
    again::<pose::ApplanixGroup1>(payload);
    again::<pose::Geolocation>(payload);
    again::<pose::GeodeticWgs84Reading>(payload);
    if let Ok(cloud) = CompactPointCloud::decode(payload, 0) {
        for order in [ByteOrder::Big, ByteOrder::Little] {
            let _ = (
                cloud.columns(),
                cloud.roughness(order),
                cloud.seam_roughness(order),
            );
        }
    }
    if let Ok(tile) = GridTile::decode(payload, 0) {
        let _ = tile.levels(tile.map_id);
    }
    let _ = DataPacket::new(bytes).map(|packet| (packet.return_mode(), packet.azimuth(11)));
    let _ = SweepAssembler::default().take(bytes);
    let _ = PositionPacket::read(bytes);
});
