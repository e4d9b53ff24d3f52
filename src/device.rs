//! What kind of device computes: fast forms differ.

use burn::backend::DispatchDevice;
use burn::tensor::Device;

pub(crate) fn is_flex(device: &Device) -> bool {
    matches!(device.clone().without_autodiff().as_dispatch(), DispatchDevice::Flex(_))
}

/// Whether the processor itself computes: flex, or ndarray where the build has it.
pub(crate) fn is_cpu(device: &Device) -> bool {
    #[cfg(feature = "ndarray")]
    if matches!(device.clone().without_autodiff().as_dispatch(), DispatchDevice::NdArray(_)) {
        return true;
    }
    is_flex(device)
}

/// Whether a GPU computes, or what stands in for one: every backend of CubeCL.
pub(crate) fn is_gpu(device: &Device) -> bool {
    !is_cpu(device)
}
