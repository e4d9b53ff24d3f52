//! The effects of a simulator, in the order in which the signal meets them.

use burn::{
    module::Module,
    tensor::{DType, Device, Tensor},
};

use super::{
    context::Context,
    effect::Effect,
    library,
    operator::{Chirps, DirectReturns, Operator},
    points::BodyPoints,
    setting::EffectSetting,
};
use crate::{body::Displacement, complex::Complex, if_signal::direct_signal, paths::Points, radar::Radar};

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
        self.switch_off_where(|operator| matches!(operator, Operator::Nonlinear(_)));
    }

    /// Switches off what adds to silence.
    pub fn switch_off_additive(&mut self) {
        self.switch_off_where(Operator::adds_to_silence);
    }

    fn switch_off_where(&mut self, which: impl Fn(Operator) -> bool) {
        self.list.iter_mut().filter(|effect| which(effect.operator())).for_each(|effect| effect.enable(false));
    }

    fn enabled(&self) -> impl Iterator<Item = &Effect> {
        self.list.iter().filter(|effect| effect.is_enabled())
    }

    /// Whether anything of this kind is on.
    fn any(&self, kind: impl Fn(Operator) -> bool) -> bool {
        self.enabled().any(|effect| kind(effect.operator()))
    }

    /// How many frames later than its number a frame shows the scene.
    pub fn frame_shift(&self, frame: usize, device: &Device) -> usize {
        let shifts = self.enabled().filter_map(|effect| match effect.operator() {
            Operator::Frame(shift) => Some(shift(&effect.values(device, DType::F32), frame)),
            _ => None,
        });
        shifts.sum()
    }

    /// Whether [`BodyPoints::velocity`] is needed.
    pub fn needs_velocity(&self) -> bool {
        self.any(|operator| matches!(operator, Operator::Time(_)))
    }

    /// Whether anything acts on the body's points one by one.
    pub fn acts_on_points(&self) -> bool {
        self.any(|operator| operator.on_displacement().is_some() || matches!(operator, Operator::Amplitude(_)))
    }

    /// Whether there are objects that are not in the scene.
    pub fn has_reflectors(&self) -> bool {
        self.any(|operator| matches!(operator, Operator::Reflector(_) | Operator::Carried(_)))
    }

    /// Where the body's points are, `[point, chirp]`.
    ///
    /// # Gradient
    /// Flows to the displacement and the values.
    pub fn displace(&self, mut displacement: Displacement, points: &BodyPoints<'_>) -> Displacement {
        let (device, dtype) = (displacement.x.device(), displacement.x.dtype());
        for effect in self.enabled() {
            if let Some(displace) = effect.operator().on_displacement() {
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
            if let Operator::Amplitude(weigh) = effect.operator() {
                amplitude = weigh(amplitude, &effect.values(&device, dtype), points);
            }
        }
        amplitude
    }

    /// The direct signal of points, with the antennas where they are: `[rx, chirp, sample]`.
    pub fn direct_signal(&self, points: Points, chirps: &Chirps<'_>) -> Complex<3> {
        let found = self.enabled().find_map(|effect| match effect.operator() {
            Operator::Direct(signal) => {
                let values = effect.values(&points.displacement.x.device(), points.displacement.x.dtype());
                Some(signal(points, &values, chirps))
            }
            _ => None,
        });
        found.unwrap_or_else(|| direct_signal(points, chirps.radar, chirps.tx, chirps.dechirp, chirps.form))
    }

    /// What else one transmitter receives of the body's points: by way of mirrors, and late.
    ///
    /// # Gradient
    /// Flows to the returns and the values.
    pub fn further_paths(&self, returns: &DirectReturns<'_>) -> Option<Complex<3>> {
        let (device, dtype) = (returns.direct.device(), returns.direct.re.dtype());
        let parts = self.enabled().filter_map(|effect| match effect.operator() {
            Operator::Paths(signal) => signal(returns, &effect.values(&device, dtype)),
            _ => None,
        });
        parts.reduce(Complex::add)
    }

    /// One transmitter's echoes of objects that are not in the scene, `[rx, chirp, sample]` or `[rx, 1, sample]`. `times_s`: of its
    /// chirps, radar time.
    ///
    /// # Gradient
    /// Flows to the values.
    pub fn reflectors(&self, times_s: &[f64], chirps: &Chirps<'_>, (device, dtype): (&Device, DType)) -> Option<Complex<3>> {
        let parts = self.enabled().filter_map(|effect| match effect.operator() {
            Operator::Reflector(signal) => Some(signal(&effect.values(device, dtype), times_s, chirps)),
            _ => None,
        });
        parts.reduce(Complex::add)
    }

    /// One transmitter's echoes of objects that the body carries, `[rx, chirp, sample]`. `at`: from a part of the body to its place,
    /// metres, and how that moves; none without a body.
    ///
    /// # Gradient
    /// Flows to the displacement and the values.
    pub fn carried(
        &self,
        chirps: &Chirps<'_>,
        (device, dtype): (&Device, DType),
        at: impl Fn(Option<&str>) -> Option<([f64; 3], Displacement)>,
    ) -> Option<Complex<3>> {
        let parts = self.enabled().filter_map(|effect| match effect.operator() {
            Operator::Carried(signal) => {
                let (place_m, moved) = at(effect.choice())?;
                Some(signal(&effect.values(device, dtype), place_m, &moved, chirps))
            }
            _ => None,
        });
        parts.reduce(Complex::add)
    }

    /// All that happens to the sum of the paths, `[tx, rx, loop, sample]`.
    ///
    /// # Gradient
    /// Flows to the signal and the values.
    pub fn apply(&self, mut signal: Complex<4>, context: &Context<'_>) -> Complex<4> {
        let (device, dtype) = (signal.device(), signal.re.dtype());
        for effect in self.enabled() {
            if let Some(apply) = effect.operator().on_signal() {
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
            if let Operator::Noise(shape) = effect.operator() {
                normals = shape(normals, &effect.values(&device, dtype), radar, seed);
            }
        }
        normals
    }
}
