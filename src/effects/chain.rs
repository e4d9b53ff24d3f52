//! The effects of a simulator, in the order in which the signal meets them.

use burn::{
    module::Module,
    tensor::{DType, Device, Tensor},
};

use super::*;
use crate::{
    body::Displacement,
    complex::Complex,
    if_signal::{SumForm, direct_signal},
    paths::{Dechirp, Points},
    radar::Radar,
    room::Room,
};

/// What acts on the summed signal.
type SignalOperator = fn(Complex<4>, &Values, &Context<'_>) -> Complex<4>;
/// What moves points of the body.
type DisplacementOperator = fn(Displacement, &Values, &BodyPoints<'_>) -> Displacement;
/// What weighs points of the body.
type AmplitudeOperator = fn(Tensor<2>, &Values, &BodyPoints<'_>) -> Tensor<2>;
/// What shapes noise.
type NoiseOperator = fn(Complex<4>, &Values, &Radar, u64) -> Complex<4>;

/// Where an effect enters the simulator.
pub(super) enum Operator {
    Signal(SignalOperator),
    Displacement(DisplacementOperator),
    Amplitude(AmplitudeOperator),
    Noise(NoiseOperator),
    /// Adds paths, or changes how they are found.
    Paths,
    /// Chooses the frame that is seen.
    Frame,
}

pub(super) fn operator(id: &str) -> Operator {
    use Operator::{Amplitude, Displacement, Frame, Noise, Paths, Signal};
    match id {
        frame_drop::ID => Frame,
        clock_offset::ID => Displacement(clock_offset::displace),
        clock_drift::ID => Displacement(clock_drift::displace),
        tdm_phase::ID => Displacement(tdm_phase::displace),
        pose_offset::ID => Displacement(pose_offset::displace),
        breathing::ID => Displacement(breathing::displace),
        heartbeat::ID => Displacement(heartbeat::displace),
        clothing_delay::ID => Displacement(clothing_delay::displace),
        part_reflectivity::ID => Amplitude(part_reflectivity::weigh),
        soft_occlusion::ID => Amplitude(soft_occlusion::weigh),
        antenna_pattern::ID => Amplitude(antenna_pattern::weigh),
        static_reflector::ID
        | moving_reflector::ID
        | carried_reflector::ID
        | wall_ghost::ID
        | floor_bounce::ID
        | body_multibounce::ID
        | antenna_position::ID => Paths,
        range_bias::ID => Signal(range_bias::apply),
        radar_vibration::ID => Signal(radar_vibration::apply),
        object_radar_object::ID => Signal(object_radar_object::apply),
        range_alias::ID => Signal(range_alias::apply),
        start_frequency_error::ID => Signal(start_frequency_error::apply),
        adc_start_error::ID => Signal(adc_start_error::apply),
        slope_error::ID => Signal(slope_error::apply),
        chirp_nonlinearity::ID => Signal(chirp_nonlinearity::apply),
        chirp_ripple::ID => Signal(chirp_ripple::apply),
        phase_noise::ID => Signal(phase_noise::apply),
        chirp_start_jitter::ID => Signal(chirp_start_jitter::apply),
        channel_mismatch::ID => Signal(channel_mismatch::apply),
        mutual_coupling::ID => Signal(mutual_coupling::apply),
        tx_leakage::ID => Signal(tx_leakage::apply),
        chirp_droop::ID => Signal(chirp_droop::apply),
        chirp_settling::ID => Signal(chirp_settling::apply),
        gain_drift::ID => Signal(gain_drift::apply),
        interference::ID => Signal(interference::apply),
        second_harmonic::ID => Signal(second_harmonic::apply),
        compression::ID => Signal(compression::apply),
        if_delay::ID => Signal(if_delay::apply),
        if_highpass::ID => Signal(if_highpass::apply),
        if_lowpass::ID => Signal(if_lowpass::apply),
        spur::ID => Signal(spur::apply),
        ramp_edge_transient::ID => Signal(ramp_edge_transient::apply),
        iq_imbalance::ID => Signal(iq_imbalance::apply),
        dc_offset::ID => Signal(dc_offset::apply),
        adc_saturation::ID => Signal(adc_saturation::apply),
        coloured_noise::ID => Noise(coloured_noise::shape),
        impulsive_noise::ID => Noise(impulsive_noise::shape),
        correlated_noise::ID => Noise(correlated_noise::shape),
        _ => panic!("no effect {id}"),
    }
}

/// The effects that are part of a simulator; none by default.
#[derive(Module, Debug)]
pub struct Effects {
    /// In the library's order; an id may be there more than once.
    pub list: Vec<Effect>,
}

impl Effects {
    /// # Panics
    /// For settings that [`EffectSetting::check`] refuses.
    pub fn new(settings: &[EffectSetting], device: &Device) -> Self {
        let place = |id: &str| library().iter().position(|info| info.id == id);
        let mut sorted: Vec<&EffectSetting> = settings.iter().collect();
        sorted.sort_by_key(|setting| place(&setting.id));
        Self { list: sorted.into_iter().map(|setting| Effect::new(setting, device)).collect() }
    }

    /// Whether none of them is switched on.
    pub fn is_empty(&self) -> bool {
        self.enabled().next().is_none()
    }

    /// The settings with the values as they are now.
    pub fn settings(&self) -> Vec<EffectSetting> {
        self.list.iter().map(Effect::setting).collect()
    }

    /// Switches all effects of an id off, or all there are; whether there was one.
    pub fn switch_off(&mut self, id: Option<&str>) -> bool {
        let mut found = false;
        for effect in self.list.iter_mut().filter(|effect| id.is_none_or(|id| effect.id() == id)) {
            effect.enable(false);
            found = true;
        }
        found
    }

    /// Switches off what is not linear in the signal.
    pub fn switch_off_nonlinear(&mut self) {
        for id in [object_radar_object::ID, second_harmonic::ID, compression::ID, adc_saturation::ID] {
            self.switch_off(Some(id));
        }
    }

    /// Switches off what adds to silence.
    pub fn switch_off_additive(&mut self) {
        for id in [
            static_reflector::ID,
            moving_reflector::ID,
            carried_reflector::ID,
            range_alias::ID,
            tx_leakage::ID,
            interference::ID,
            spur::ID,
            ramp_edge_transient::ID,
            dc_offset::ID,
        ] {
            self.switch_off(Some(id));
        }
    }

    fn enabled(&self) -> impl Iterator<Item = &Effect> {
        self.list.iter().filter(|effect| effect.is_enabled())
    }

    fn named(&self, id: &str) -> impl Iterator<Item = &Effect> {
        self.enabled().filter(move |effect| effect.id() == id)
    }

    /// Whether an effect of this id is on.
    pub fn has(&self, id: &str) -> bool {
        self.named(id).next().is_some()
    }

    /// How many frames later than its number a frame shows the scene.
    pub fn frame_shift(&self, frame: usize, device: &Device) -> usize {
        self.named(frame_drop::ID).map(|effect| frame_drop::shift(&effect.values(device, DType::F32), frame)).sum()
    }

    /// Whether [`BodyPoints::velocity`] is needed.
    pub fn needs_velocity(&self) -> bool {
        [clock_offset::ID, clock_drift::ID, tdm_phase::ID].into_iter().any(|id| self.has(id))
    }

    /// Whether anything acts on the body's points one by one.
    pub fn acts_on_points(&self) -> bool {
        self.enabled().any(|effect| matches!(operator(effect.id()), Operator::Displacement(_) | Operator::Amplitude(_)))
    }

    /// Where the body's points are, `[point, chirp]`.
    ///
    /// # Gradient
    /// Flows to the displacement and the values.
    pub fn displace(&self, mut displacement: Displacement, points: &BodyPoints<'_>) -> Displacement {
        let (device, dtype) = (displacement.x.device(), displacement.x.dtype());
        for effect in self.enabled() {
            if let Operator::Displacement(displace) = operator(effect.id()) {
                displacement = displace(displacement, &effect.values(&device, dtype), points);
            }
        }
        displacement
    }

    /// How strong the body's points are, `[point, 1]`.
    ///
    /// # Gradient
    /// Flows to the amplitude and the values.
    pub fn weigh(&self, mut amplitude: Tensor<2>, points: &BodyPoints<'_>) -> Tensor<2> {
        let (device, dtype) = (amplitude.device(), amplitude.dtype());
        for effect in self.enabled() {
            if let Operator::Amplitude(weigh) = operator(effect.id()) {
                amplitude = weigh(amplitude, &effect.values(&device, dtype), points);
            }
        }
        amplitude
    }

    /// The direct signal of points, with the antennas where they are: `[rx, chirp, sample]`.
    pub fn direct_signal(&self, points: Points, radar: &Radar, tx: usize, dechirp: Dechirp, form: SumForm) -> Complex<3> {
        match self.named(antenna_position::ID).next() {
            Some(effect) => {
                let values = effect.values(&points.displacement.x.device(), points.displacement.x.dtype());
                antenna_position::direct_signal(points, &values, radar, tx, dechirp, form)
            }
            None => direct_signal(points, radar, tx, dechirp, form),
        }
    }

    /// What else one transmitter receives of the body's points: by way of mirrors, and late. `direct` is their direct
    /// signal, `[rx, chirp, sample]`.
    ///
    /// # Gradient
    /// Flows to the points and the values.
    pub fn further_paths(
        &self,
        points: Points,
        direct: &Complex<3>,
        room: Option<&Room>,
        radar: &Radar,
        tx: usize,
        (dechirp, form): (Dechirp, SumForm),
    ) -> Option<Complex<3>> {
        let (device, dtype) = (direct.device(), direct.re.dtype());
        let parts = self.enabled().filter_map(|effect| {
            let values = || effect.values(&device, dtype);
            match effect.id() {
                wall_ghost::ID => wall_ghost::signal(points, &values(), room?, radar, tx, dechirp, form),
                floor_bounce::ID => floor_bounce::signal(points, &values(), room?, radar, tx, dechirp, form),
                body_multibounce::ID => Some(body_multibounce::echo(direct.clone(), &values(), radar)),
                _ => None,
            }
        });
        parts.reduce(Complex::add)
    }

    /// One transmitter's echoes of objects that are not in the scene, `[rx, chirp, sample]` or `[rx, 1, sample]`.
    ///
    /// # Gradient
    /// Flows to the values.
    pub fn reflectors(
        &self,
        times_s: &[f64],
        radar: &Radar,
        tx: usize,
        dechirp: Dechirp,
        form: SumForm,
        options: (&Device, DType),
    ) -> Option<Complex<3>> {
        let parts = self.enabled().filter_map(|effect| {
            let values = || effect.values(options.0, options.1);
            match effect.id() {
                static_reflector::ID => Some(static_reflector::signal(&values(), radar, tx, dechirp, form)),
                moving_reflector::ID => Some(moving_reflector::signal(&values(), times_s, radar, tx, dechirp, form)),
                _ => None,
            }
        });
        parts.reduce(Complex::add)
    }

    /// Objects that the body carries, each with its part of the body.
    pub fn carried(&self) -> impl Iterator<Item = (&Effect, Option<&str>)> {
        self.named(carried_reflector::ID).map(|effect| (effect, effect.choice()))
    }

    /// All that happens to the sum of the paths, `[tx, rx, loop, sample]`.
    ///
    /// # Gradient
    /// Flows to the signal and the values.
    pub fn apply(&self, mut signal: Complex<4>, context: &Context<'_>) -> Complex<4> {
        let (device, dtype) = (signal.device(), signal.re.dtype());
        for effect in self.enabled() {
            if let Operator::Signal(apply) = operator(effect.id()) {
                signal = apply(signal, &effect.values(&device, dtype), context);
            }
        }
        signal
    }

    /// All that happens to the noise before its level, `[tx, rx, loop, sample]`.
    ///
    /// # Gradient
    /// Flows to the values.
    pub fn shape_noise(&self, mut normals: Complex<4>, radar: &Radar, seed: u64) -> Complex<4> {
        let (device, dtype) = (normals.device(), normals.re.dtype());
        for effect in self.enabled() {
            if let Operator::Noise(shape) = operator(effect.id()) {
                normals = shape(normals, &effect.values(&device, dtype), radar, seed);
            }
        }
        normals
    }
}
