//! Antennas behind a mirror: what a wave by way of a flat boundary seems to start from or to arrive at.

use crate::{radar::Radar, room::Boundary};

/// The radar with its receivers mirrored in a boundary, `distance_m` from the origin.
pub fn mirrored_rx(radar: &Radar, boundary: Boundary, distance_m: f64) -> Radar {
    let rx_m = (0..radar.rx_m.len()).map(|rx| image(radar, radar.rx_position_m(rx), boundary, distance_m)).collect();
    Radar { rx_m, ..radar.clone() }
}

/// The radar with its transmitters mirrored in a boundary.
pub fn mirrored_tx(radar: &Radar, boundary: Boundary, distance_m: f64) -> Radar {
    let tx_m = (0..radar.tx_m.len()).map(|tx| image(radar, radar.tx_position_m(tx), boundary, distance_m)).collect();
    Radar { tx_m, ..radar.clone() }
}

/// A place's image behind a boundary, metres, radar frame.
pub fn mirrored(place_m: [f64; 3], boundary: Boundary, distance_m: f64) -> [f64; 3] {
    let (axis, sign) = boundary.axis();
    let mut image = place_m;
    image[axis] = 2.0 * sign * distance_m - place_m[axis];
    image
}

/// An antenna's image, from the antennas' reference.
fn image(radar: &Radar, antenna_m: [f64; 3], boundary: Boundary, distance_m: f64) -> [f64; 3] {
    let image = mirrored(antenna_m, boundary, distance_m);
    std::array::from_fn(|i| image[i] - radar.position_m[i])
}
