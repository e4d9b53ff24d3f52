//! The coherent sum as one operation of the flex backend, with its own backward pass.
//!
//! Burn's backend extension: a trait of operations, implemented for flex and for the autodiff decorator around it. The
//! tape keeps the inputs only, whatever the number of samples.

mod fourier;
mod kernel;
mod lanes;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Dispatch, Flex, backend_extension};
use burn::tensor::{Shape, Tensor, TensorData};
use burn_autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind};
use burn_autodiff::Autodiff;
use burn_flex::FlexTensor;

use crate::complex::Complex;
use crate::paths::Phasors;

/// Flex in f32 only; the caller sees to it.
pub fn sum(phasors: &Phasors, samples: usize) -> Complex<2> {
    let [_, chirps] = phasors.dims();
    let complex = phasors.amplitude_im.is_some();
    let im = phasors.amplitude_im.as_ref().unwrap_or(&phasors.amplitude);
    let input = |tensor: &Tensor<2>| tensor.clone().into_dispatch();
    let both = <Dispatch as CoherentSum>::coherent_sum(
        input(&phasors.amplitude),
        input(im),
        input(&phasors.phase_turns),
        input(&phasors.sweep_turns),
        complex,
        samples,
    );
    let both = Tensor::<3>::from_dispatch(both);
    let part = |index: usize| both.clone().narrow(0, index, 1).reshape([chirps, samples]);
    Complex::new(part(0), part(1))
}

/// Inputs `[point, chirp]`, result `[2, chirp, sample]`. The imaginary amplitude counts only if `complex`.
#[backend_extension(Flex, Autodiff)]
pub trait CoherentSum: Backend {
    fn coherent_sum(
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        phase: FloatTensor<Self>,
        sweep: FloatTensor<Self>,
        complex: bool,
        samples: usize,
    ) -> FloatTensor<Self>;

    /// Gradients to the four inputs, stacked: `[4, point, chirp]`.
    #[allow(clippy::too_many_arguments)]
    fn coherent_sum_gradients(
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        phase: FloatTensor<Self>,
        sweep: FloatTensor<Self>,
        upstream: FloatTensor<Self>,
        complex: bool,
        samples: usize,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>);
}

fn with_inputs<T>(tensors: [FlexTensor; 4], complex: bool, of: impl FnOnce(kernel::Inputs) -> T) -> T {
    let [re, im, phase, sweep] = tensors.map(|tensor| tensor.to_contiguous());
    let [points, chirps] = [phase.layout().shape()[0], phase.layout().shape()[1]];
    for (name, tensor) in [("amplitude", &re), ("imaginary amplitude", &im), ("sweep", &sweep)] {
        let shape = tensor.layout().shape().to_vec();
        assert_eq!(shape, [points, chirps], "coherent sum: {name} {shape:?}, phase {:?}", [points, chirps]);
    }
    of(kernel::Inputs {
        re: re.storage(),
        im: complex.then(|| im.storage()),
        phase: phase.storage(),
        sweep: sweep.storage(),
        points,
        chirps,
    })
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, Shape::from(shape)))
}

impl CoherentSum for Flex {
    fn coherent_sum(re: FlexTensor, im: FlexTensor, phase: FlexTensor, sweep: FlexTensor, complex: bool, samples: usize) -> FlexTensor {
        with_inputs([re, im, phase, sweep], complex, |inputs| {
            tensor(kernel::sum(inputs, samples), [2, inputs.chirps, samples])
        })
    }

    fn coherent_sum_gradients(
        re: FlexTensor,
        im: FlexTensor,
        phase: FlexTensor,
        sweep: FlexTensor,
        upstream: FlexTensor,
        complex: bool,
        samples: usize,
    ) -> (FlexTensor, FlexTensor, FlexTensor, FlexTensor) {
        let upstream = upstream.to_contiguous();
        with_inputs([re, im, phase, sweep], complex, |inputs| {
            let shape = [inputs.points, inputs.chirps];
            let gradients = kernel::gradients(inputs, upstream.storage(), samples);
            let re = tensor(gradients.re, shape);
            let im = gradients.im.map_or_else(|| re.clone(), |im| tensor(im, shape));
            (re, im, tensor(gradients.phase, shape), tensor(gradients.sweep, shape))
        })
    }
}

impl<B: Backend + CoherentSum, C: CheckpointStrategy> CoherentSum for Autodiff<B, C> {
    fn coherent_sum(
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        phase: FloatTensor<Self>,
        sweep: FloatTensor<Self>,
        complex: bool,
        samples: usize,
    ) -> FloatTensor<Self> {
        #[derive(Debug)]
        struct Sum;

        impl<B: Backend + CoherentSum> Backward<B, 4> for Sum {
            type State = ([FloatTensor<B>; 4], bool, usize);

            fn backward(self, ops: Ops<Self::State, 4>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let upstream = gradients.consume::<B>(&ops.node);
                let ([re, im, phase, sweep], complex, samples) = ops.state;
                let (re, im, phase, sweep) = B::coherent_sum_gradients(re, im, phase, sweep, upstream, complex, samples);
                // A real amplitude stands in for its imaginary part, which then has no gradient of its own.
                let [to_re, to_im, to_phase, to_sweep] = ops.parents;
                let to_im = to_im.filter(|_| complex);
                for (parent, gradient) in [(to_re, re), (to_im, im), (to_phase, phase), (to_sweep, sweep)] {
                    if let Some(parent) = parent {
                        gradients.register::<B>(parent.id, gradient);
                    }
                }
            }
        }

        let nodes = [re.node(), im.node(), phase.node(), sweep.node()];
        let inputs = [re, im, phase, sweep].map(|tensor| tensor.into_primitive());
        let [re, im, phase, sweep] = inputs.clone();
        let value = B::coherent_sum(re, im, phase, sweep, complex, samples);
        match Sum.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prepared) => prepared.finish((inputs, complex, samples), value),
            OpsKind::UnTracked(prepared) => prepared.finish(value),
        }
    }

    fn coherent_sum_gradients(
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: bool,
        _: usize,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>) {
        unreachable!("only the inner backend computes gradients: Burn differentiates once")
    }
}
