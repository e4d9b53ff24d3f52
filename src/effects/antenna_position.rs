//! Antennas that are not where they are declared (card C2).

use burn::tensor::Tensor;

use super::{
    info::{Choice, EffectInfo, Stage},
    operator::Operator,
    parameter::amplitude,
    values::{Values, repeated},
};
use crate::{
    body::Displacement,
    complex::Complex,
    if_signal::{SumForm, direct_signal as signal_of},
    paths::{Dechirp, Points},
    radar::Radar,
};

/// Id of this effect in settings, reports and docs.
pub const ID: &str = "antenna_position";

/// What reports and docs say of `antenna_position`, with its parameters and its operator.
pub static INFO: EffectInfo = EffectInfo {
    id: ID,
    card: "C2",
    stage: Stage::Antenna,
    needs_person: false,
    title: "antennas that are not where they are declared",
    explanation: "An antenna's phase centre is a fraction of a wavelength off its place: a phase that changes with the direction.",
    equation: "τ_p → τ_p with tx_m + offset_m[tx], rx_m + offset_m[rx]",
    parameters: &[amplitude("offset_m", "m", 0.0, -0.002, 0.002)],
    choice: Choice::None,
    look_alikes: &["pose_offset", "mutual_coupling"],
    separate_by: "a target over ±40° of direction; a common rotation of the array cannot be told from a turned room",
    operator: Operator::Direct(|points, values, of| direct_signal(points, values, of.radar, of.tx, of.dechirp, of.form)),
};

/// One transmitter's direct signal with its antennas moved, `[rx, chirp, sample]`.
///
/// `offset_m` holds x, y, z of every transmitter, then of every receiver. An antenna that moves by d shortens its leg by
/// û·d; moving the points by −d/2 shortens both legs by as much together, for arrays that are small against the range. The
/// walls' paths by way of their proxies are left as they are.
///
/// # Gradient
/// Flows to the points and the offsets.
pub fn direct_signal(points: Points, values: &Values, radar: &Radar, tx: usize, dechirp: Dechirp, form: SumForm) -> Complex<3> {
    let (transmitters, receivers) = (radar.tx_m.len(), radar.rx_m.len());
    let offsets = repeated(values.get("offset_m"), 3 * (transmitters + receivers));
    let parts = (0..receivers).map(|rx| {
        let half = |axis: usize| -> Tensor<2> {
            let of = |antenna: usize| offsets.clone().narrow(0, 3 * antenna + axis, 1).reshape([1, 1]);
            (of(tx) + of(transmitters + rx)) * -0.5
        };
        let Displacement { x, y, z } = points.displacement.clone();
        let displacement = Displacement { x: x + half(0), y: y + half(1), z: z + half(2) };
        let one = Radar { rx_m: vec![radar.rx_m[rx]], ..radar.clone() };
        let points = Points { reference_m: points.reference_m, displacement: &displacement, amplitude: points.amplitude };
        signal_of(points, &one, tx, dechirp, form)
    });
    Complex::cat(parts.collect(), 0)
}
