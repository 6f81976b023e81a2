use super::*;

fn cloud(distances: &[u8]) -> CompactPointCloud<'_> {
    CompactPointCloud {
        end_azimuth_deg: 360.0,
        layers: 16,
        distances,
        ..CompactPointCloud::default()
    }
}

#[test]
fn the_wire_type_of_field_seven_tells_the_schema() {
    let lower = CompactPointCloud {
        intensity_bits: 3,
        schema: Schema::OpenDaVinci {
            placement: IntensityPlacement::Lower,
            encoding: DistanceEncoding::TwoMillimetres,
        },
        ..cloud(&[1, 2])
    };
    let vlp32c = CompactPointCloud {
        schema: Schema::OpenDlv {
            vertical_layout: LAYOUT_VLP32C,
            azimuth_angles: &[],
        },
        ..cloud(&[1, 2])
    };
    for sent in [lower, vlp32c, cloud(&[1, 2])] {
        let mut out = vec![];
        sent.encode(&mut out);
        assert_eq!(CompactPointCloud::decode(&out, 0), Ok(sent));
    }
}

#[test]
fn intensity_is_masked_in_either_place() {
    let mut message = CompactPointCloud {
        intensity_bits: 3,
        ..cloud(&[])
    };
    assert_eq!(message.distance_mask(), 0x1fff);
    message.schema = Schema::OpenDaVinci {
        placement: IntensityPlacement::Lower,
        encoding: DistanceEncoding::Centimetre,
    };
    assert_eq!(message.distance_mask(), 0xfff8);
    message.intensity_bits = 16;
    assert_eq!(message.distance_mask(), 0);
}

#[test]
fn the_wrong_byte_order_is_rougher() {
    let distances: Vec<u8> = (0..64u16)
        .flat_map(|column| (0..16).flat_map(move |layer| (900 + column + layer).to_be_bytes()))
        .collect();
    let message = cloud(&distances);
    assert!(message.roughness(ByteOrder::Little) > 10 * message.roughness(ByteOrder::Big));
}

#[test]
fn roughness_is_that_of_every_eighth_pair_of_columns_that_both_return() {
    let column = |column: u16| std::iter::repeat_n((900 + column).to_be_bytes(), 16).flatten();
    let mut distances: Vec<u8> = (0..64).flat_map(column).collect();
    assert_eq!(cloud(&distances).roughness(ByteOrder::Big), 8 * 16);
    // What is left of a column does not count.
    distances.extend([1, 2, 3]);
    assert_eq!(cloud(&distances).roughness(ByteOrder::Big), 8 * 16);
    for odd in distances.chunks_exact_mut(32).skip(1).step_by(2) {
        odd.fill(0);
    }
    assert_eq!(cloud(&distances).roughness(ByteOrder::Big), 0);
}

#[test]
fn a_piece_of_a_turn_is_rough_at_its_seam() {
    let turn: Vec<u8> = (0..360u16)
        .flat_map(|column| std::iter::repeat_n(1000 + column.abs_diff(180), 16))
        .flat_map(u16::to_be_bytes)
        .collect();
    let seam = |distances| cloud(distances).seam_roughness(ByteOrder::Big).unwrap();
    assert!(seam(&turn) < 1.5);
    assert!(seam(&turn[..180 * 32]) > 50.0);
    assert_eq!(cloud(&[0; 320]).seam_roughness(ByteOrder::Big), None);
}

#[test]
fn zero_layers_are_zero_columns() {
    let message = CompactPointCloud {
        layers: 0,
        ..cloud(&[1, 2, 3, 4])
    };
    assert_eq!(
        (message.columns(), message.roughness(ByteOrder::Big)),
        (0, 0)
    );
}
