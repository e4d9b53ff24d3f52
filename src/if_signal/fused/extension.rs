//! How the kernels become operations with gradients.

use std::sync::Arc;

use burn::backend::tensor::FloatTensor;
use burn::backend::{Backend, Flex, backend_extension};
use burn::tensor::{Shape, TensorData};
use burn_autodiff::Autodiff;
use burn_autodiff::checkpoint::{base::Checkpointer, strategy::CheckpointStrategy};
use burn_autodiff::grads::Gradients;
use burn_autodiff::ops::{Backward, Ops, OpsKind};
use burn_flex::FlexTensor;

use super::kernel::{self, Output};
use super::moving::{self, Geometry, Moving, Tensors};
use super::phasors::{self, Inputs};

/// Sums have shape `[2, output, chirp, sample]`: real parts, then imaginary parts. A real amplitude stands in for its
/// imaginary part, which counts only if `complex`. Gradients come in the order of the tensors.
#[backend_extension(Flex, Cube: cfg(any(feature = "wgpu", feature = "cuda")), Autodiff)]
pub trait RadarOps: Backend {
    /// Of phasors, all `[point, chirp]`, at one receiver.
    fn sum_of_phasors(
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        phase: FloatTensor<Self>,
        sweep: FloatTensor<Self>,
        complex: bool,
        samples: usize,
    ) -> FloatTensor<Self>;

    #[allow(clippy::too_many_arguments)]
    fn sum_of_phasors_gradients(
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        phase: FloatTensor<Self>,
        sweep: FloatTensor<Self>,
        upstream: FloatTensor<Self>,
        complex: bool,
        samples: usize,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>);

    /// Of points displaced by x, y, z `[point, chirp]` with amplitudes `[point, chirp]` or `[point, 1]`.
    #[allow(clippy::too_many_arguments)]
    fn sum_of_moving(
        x: FloatTensor<Self>,
        y: FloatTensor<Self>,
        z: FloatTensor<Self>,
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        geometry: Arc<Geometry>,
        complex: bool,
        samples: usize,
    ) -> FloatTensor<Self>;

    #[allow(clippy::too_many_arguments, clippy::type_complexity)]
    fn sum_of_moving_gradients(
        x: FloatTensor<Self>,
        y: FloatTensor<Self>,
        z: FloatTensor<Self>,
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        upstream: FloatTensor<Self>,
        geometry: Arc<Geometry>,
        complex: bool,
        samples: usize,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>);
}

fn shape(tensor: &FlexTensor) -> [usize; 2] {
    let shape = tensor.layout().shape();
    [shape[0], shape[1]]
}

fn expect(name: &str, tensor: &FlexTensor, wanted: [usize; 2]) {
    assert_eq!(shape(tensor), wanted, "coherent sum: {name} {:?}, expected {wanted:?}", shape(tensor));
}

fn tensor<const D: usize>(values: Vec<f32>, shape: [usize; D]) -> FlexTensor {
    FlexTensor::from_data(TensorData::new(values, Shape::from(shape)))
}

fn with_phasors<T>(tensors: [FlexTensor; 4], complex: bool, of: impl FnOnce(Inputs) -> T) -> T {
    let [re, im, phase, sweep] = tensors.map(|tensor| tensor.to_contiguous());
    let [points, chirps] = shape(&phase);
    for (name, tensor) in [("amplitude", &re), ("imaginary amplitude", &im), ("sweep", &sweep)] {
        expect(name, tensor, [points, chirps]);
    }
    let im = complex.then(|| im.storage());
    let outputs = [Output { path: 0, points: 0..points }];
    of(Inputs { outputs, re: re.storage(), im, phase: phase.storage(), sweep: sweep.storage(), points, chirps })
}

fn with_moving<T>(tensors: [FlexTensor; 5], geometry: Arc<Geometry>, complex: bool, of: impl FnOnce(Moving) -> T) -> T {
    let [x, y, z, re, im] = tensors.map(|tensor| tensor.to_contiguous());
    let [points, chirps] = shape(&x);
    let [_, amplitude_chirps] = shape(&re);
    assert_eq!(points, geometry.points(), "coherent sum: displacement of {points} points, {} positions", geometry.points());
    assert!(amplitude_chirps == 1 || amplitude_chirps == chirps, "coherent sum: {amplitude_chirps} amplitudes, {chirps} chirps");
    for (name, tensor) in [("y", &y), ("z", &z)] {
        expect(name, tensor, [points, chirps]);
    }
    for (name, tensor) in [("amplitude", &re), ("imaginary amplitude", &im)] {
        expect(name, tensor, [points, amplitude_chirps]);
    }
    let tensors = Tensors {
        axes: [x.storage(), y.storage(), z.storage()],
        re: re.storage(),
        im: complex.then(|| im.storage()),
        chirps,
        amplitude_chirps,
    };
    of(Moving::new(geometry, tensors))
}

impl RadarOps for Flex {
    fn sum_of_phasors(
        re: FlexTensor,
        im: FlexTensor,
        phase: FlexTensor,
        sweep: FlexTensor,
        complex: bool,
        samples: usize,
    ) -> FlexTensor {
        with_phasors([re, im, phase, sweep], complex, |inputs| {
            tensor(kernel::sum(&inputs, samples), [2, 1, inputs.chirps, samples])
        })
    }

    fn sum_of_phasors_gradients(
        re: FlexTensor,
        im: FlexTensor,
        phase: FlexTensor,
        sweep: FlexTensor,
        upstream: FlexTensor,
        complex: bool,
        samples: usize,
    ) -> (FlexTensor, FlexTensor, FlexTensor, FlexTensor) {
        let upstream = upstream.to_contiguous();
        with_phasors([re, im, phase, sweep], complex, |inputs| {
            let shape = [inputs.points, inputs.chirps];
            let [re, im, phase, sweep] = phasors::gradients(inputs, upstream.storage(), samples);
            let re = tensor(re, shape);
            let im = if complex { tensor(im, shape) } else { re.clone() };
            (re, im, tensor(phase, shape), tensor(sweep, shape))
        })
    }

    fn sum_of_moving(
        x: FlexTensor,
        y: FlexTensor,
        z: FlexTensor,
        re: FlexTensor,
        im: FlexTensor,
        geometry: Arc<Geometry>,
        complex: bool,
        samples: usize,
    ) -> FlexTensor {
        let [_, chirps] = shape(&x);
        let shape = [2, geometry.outputs().len(), chirps, samples];
        with_moving([x, y, z, re, im], geometry, complex, |moving| tensor(kernel::sum(&moving, samples), shape))
    }

    fn sum_of_moving_gradients(
        x: FlexTensor,
        y: FlexTensor,
        z: FlexTensor,
        re: FlexTensor,
        im: FlexTensor,
        upstream: FlexTensor,
        geometry: Arc<Geometry>,
        complex: bool,
        samples: usize,
    ) -> (FlexTensor, FlexTensor, FlexTensor, FlexTensor, FlexTensor) {
        let upstream = upstream.to_contiguous();
        let (moved, amplitude) = (shape(&x), shape(&re));
        with_moving([x, y, z, re, im], geometry, complex, |moving| {
            let [x, y, z, re, im] = moving::gradients(&moving, upstream.storage(), samples);
            let re = tensor(re, amplitude);
            let im = if complex { tensor(im, amplitude) } else { re.clone() };
            (tensor(x, moved), tensor(y, moved), tensor(z, moved), re, im)
        })
    }
}

/// Hands every gradient to its parent, if that is tracked; an imaginary part that does not count has none.
fn register<B: Backend, const N: usize>(
    parents: [Option<burn_autodiff::NodeId>; N],
    of: [FloatTensor<B>; N],
    im: usize,
    complex: bool,
    gradients: &mut Gradients,
) {
    for (index, (parent, gradient)) in parents.into_iter().zip(of).enumerate() {
        if let Some(parent) = parent.filter(|_| complex || index != im) {
            gradients.register::<B>(parent, gradient);
        }
    }
}

impl<B: Backend + RadarOps, C: CheckpointStrategy> RadarOps for Autodiff<B, C> {
    fn sum_of_phasors(
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        phase: FloatTensor<Self>,
        sweep: FloatTensor<Self>,
        complex: bool,
        samples: usize,
    ) -> FloatTensor<Self> {
        #[derive(Debug)]
        struct Sum;

        impl<B: Backend + RadarOps> Backward<B, 4> for Sum {
            type State = ([FloatTensor<B>; 4], bool, usize);

            fn backward(self, ops: Ops<Self::State, 4>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let upstream = gradients.consume::<B>(&ops.node);
                let ([re, im, phase, sweep], complex, samples) = ops.state;
                let (re, im, phase, sweep) = B::sum_of_phasors_gradients(re, im, phase, sweep, upstream, complex, samples);
                let parents = ops.parents.map(|parent| parent.map(|parent| parent.id));
                register::<B, 4>(parents, [re, im, phase, sweep], 1, complex, gradients);
            }
        }

        let nodes = [re.node(), im.node(), phase.node(), sweep.node()];
        let inputs = [re, im, phase, sweep].map(|tensor| tensor.into_primitive());
        let [re, im, phase, sweep] = inputs.clone();
        let value = B::sum_of_phasors(re, im, phase, sweep, complex, samples);
        match Sum.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prepared) => prepared.finish((inputs, complex, samples), value),
            OpsKind::UnTracked(prepared) => prepared.finish(value),
        }
    }

    fn sum_of_phasors_gradients(
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

    fn sum_of_moving(
        x: FloatTensor<Self>,
        y: FloatTensor<Self>,
        z: FloatTensor<Self>,
        re: FloatTensor<Self>,
        im: FloatTensor<Self>,
        geometry: Arc<Geometry>,
        complex: bool,
        samples: usize,
    ) -> FloatTensor<Self> {
        #[derive(Debug)]
        struct Sum;

        impl<B: Backend + RadarOps> Backward<B, 5> for Sum {
            type State = ([FloatTensor<B>; 5], Arc<Geometry>, bool, usize);

            fn backward(self, ops: Ops<Self::State, 5>, gradients: &mut Gradients, _: &mut Checkpointer) {
                let upstream = gradients.consume::<B>(&ops.node);
                let ([x, y, z, re, im], geometry, complex, samples) = ops.state;
                let (x, y, z, re, im) = B::sum_of_moving_gradients(x, y, z, re, im, upstream, geometry, complex, samples);
                let parents = ops.parents.map(|parent| parent.map(|parent| parent.id));
                register::<B, 5>(parents, [x, y, z, re, im], 4, complex, gradients);
            }
        }

        let nodes = [x.node(), y.node(), z.node(), re.node(), im.node()];
        let inputs = [x, y, z, re, im].map(|tensor| tensor.into_primitive());
        let [x, y, z, re, im] = inputs.clone();
        let value = B::sum_of_moving(x, y, z, re, im, geometry.clone(), complex, samples);
        match Sum.prepare::<C>(nodes).compute_bound().stateful() {
            OpsKind::Tracked(prepared) => prepared.finish((inputs, geometry, complex, samples), value),
            OpsKind::UnTracked(prepared) => prepared.finish(value),
        }
    }

    fn sum_of_moving_gradients(
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: FloatTensor<Self>,
        _: Arc<Geometry>,
        _: bool,
        _: usize,
    ) -> (FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>, FloatTensor<Self>) {
        unreachable!("only the inner backend computes gradients: Burn differentiates once")
    }
}
