//! The largest gradient of a step: where training begins to break, it shows first.

use burn::{
    module::{Module, ModuleVisitor, Param},
    optim::GradientsParams,
    tensor::Tensor,
};

use crate::simulator::Simulator;

/// Largest absolute derivative of the loss by any number that learns, before anything is clipped; zero without any.
pub fn largest_gradient(simulator: &Simulator, gradients: &GradientsParams) -> f64 {
    struct Largest<'a> {
        gradients: &'a GradientsParams,
        found: Vec<Tensor<1>>,
    }
    impl ModuleVisitor for Largest<'_> {
        fn visit_float<const D: usize>(&mut self, param: &Param<Tensor<D>>) {
            if let Some(gradient) = self.gradients.get::<D>(param.id) {
                self.found.push(gradient.abs().max().reshape([1]));
            }
        }
    }
    let mut largest = Largest { gradients, found: vec![] };
    simulator.visit(&mut largest);
    if largest.found.is_empty() {
        return 0.0;
    }
    // One wait for the device, not one for each parameter.
    let each: Vec<f32> = Tensor::cat(largest.found, 0).into_data().convert::<f32>().try_into_vec().expect("converted");
    // Unlike `f64::max`, a comparison that keeps what is not a number.
    each.into_iter().map(f64::from).fold(0.0, |most, value| if value <= most { most } else { value })
}

#[cfg(test)]
mod tests {
    use burn::tensor::Device;

    use super::*;
    use crate::{features::Extent, simulator::SimulatorConfig};

    #[test]
    fn the_largest_derivative_of_all_parameters_is_found_whatever_its_sign() {
        let config: SimulatorConfig =
            toml::from_str("[triplane]\nresolution = 4\nfeatures = 2\n[noise]\nlaw = \"learned\"").unwrap();
        let extent = Extent { low_m: [-1.0; 3], high_m: [1.0; 3] };
        let simulator = config.init(extent, 1, &Device::flex().autodiff());
        let rate = simulator.noise.raw_rate.as_ref().unwrap().val();
        let gain = simulator.decoders.body_gain.log_gain.val();
        let loss = rate.sum() * 2.0 - gain.sum() * 7.0;
        let gradients = GradientsParams::from_module(&mut loss.backward(), &simulator);
        assert_eq!(largest_gradient(&simulator, &gradients), 7.0);
        assert_eq!(largest_gradient(&simulator, &GradientsParams::new()), 0.0);
        let broken = gain_times(&simulator, f32::NAN);
        assert!(largest_gradient(&simulator, &broken).is_nan());
    }

    fn gain_times(simulator: &Simulator, factor: f32) -> GradientsParams {
        let loss = simulator.decoders.body_gain.log_gain.val().sum() * factor;
        GradientsParams::from_module(&mut loss.backward(), simulator)
    }
}
