//! Noise that is not white.

use hybridsim_fft::FftPlanner;

use super::context::Context;
use super::effect::Effect;
use super::settings::settings;
use crate::error::Result;
use crate::radar::Radar;
use crate::recorder::draws::Draw;
use crate::recorder::signal::Signal;
use crate::recorder::white::deviate;

settings! {
    /// Density 1 + (knee/f)^power.
    ColouredNoise { knee_hz: f64 [0.0, 1.0e8], power: f64 [0.0, 4.0] }
}

impl Effect for ColouredNoise {
    fn check(&self, context: &Context, key: &str) -> Result<()> {
        context.check_noise(key)
    }
}

impl ColouredNoise {
    /// Colours white noise.
    pub fn shape(&self, radar: &Radar, noise: &mut Signal) {
        self.colour(radar, 1.0, noise);
    }

    /// Adds what white noise of deviation `sigma` per component lacks.
    pub fn add(&self, context: &Context, sigma: f64, signal: &mut Signal) {
        let mut rng = context.draws.random(Draw::Noise { frame: signal.frame });
        let mut noise = signal.clone();
        noise.values.iter_mut().for_each(|sample| *sample = deviate(context.radar.sampling, sigma, &mut rng));
        self.colour(context.radar, 0.0, &mut noise);
        signal.values.iter_mut().zip(noise.values).for_each(|(sample, noise)| *sample += noise);
    }

    /// Every chirp's spectrum times √(white + (knee/f)^power).
    fn colour(&self, radar: &Radar, white: f64, noise: &mut Signal) {
        let count = noise.samples;
        let bin_hz = radar.sample_rate_hz / count as f64;
        let gains: Vec<f64> = (0..count)
            .map(|bin| {
                let frequency = (bin.min(count - bin) as f64).max(0.5) * bin_hz;
                (white + (self.knee_hz / frequency).powf(self.power)).sqrt() / count as f64
            })
            .collect();
        let mut planner = FftPlanner::new();
        let (forward, inverse) = (planner.plan_fft_forward(count), planner.plan_fft_inverse(count));
        for (_, chirp) in noise.chirps_mut() {
            forward.process(chirp);
            chirp.iter_mut().zip(&gains).for_each(|(value, gain)| *value *= gain);
            inverse.process(chirp);
        }
    }
}
