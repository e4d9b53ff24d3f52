//! Which device computes, chosen by name.

use burn::tensor::Device;
#[cfg(feature = "wgpu")]
use burn::tensor::DeviceKind;

use crate::error::{Error, Result};

/// The device of a name: `flex` (or `cpu`), `auto`, or of a backend of this build: `ndarray`, `wgpu`, `wgpu-cpu`, `cuda`, `cuda:1`.
///
/// `auto` is CUDA or wgpu only where a real adapter answers, never a software driver; else flex.
pub fn device(name: &str) -> Result<Device> {
    let (kind, index) = match name.split_once(':') {
        Some((kind, index)) => (kind, index.parse::<usize>().map_err(|_| unknown(name))?),
        None => (name, 0),
    };
    match kind {
        "auto" => Ok(fastest()),
        "flex" | "cpu" => Ok(Device::flex()),
        // Deprecated in Burn 0.22, kept as a second CPU implementation to compare with.
        #[cfg(feature = "ndarray")]
        #[allow(deprecated)]
        "ndarray" => Ok(Device::ndarray()),
        #[cfg(feature = "wgpu")]
        "wgpu" => real_adapter(index).ok_or_else(|| unknown(name)),
        #[cfg(feature = "wgpu")]
        "wgpu-cpu" => software_adapter().ok_or_else(|| unknown(name)),
        #[cfg(feature = "cuda")]
        "cuda" => cuda(index).ok_or_else(|| unknown(name)),
        _ => {
            let _ = index;
            Err(unknown(name))
        }
    }
}

/// Devices of names between commas: the first holds what is trained, the others share its frames.
pub fn devices(names: &str) -> Result<Vec<Device>> {
    names.split(',').map(|name| device(name.trim())).collect()
}

fn fastest() -> Device {
    #[cfg(feature = "cuda")]
    if let Some(device) = cuda(0) {
        return device;
    }
    #[cfg(feature = "wgpu")]
    if let Some(device) = real_adapter(0) {
        return device;
    }
    Device::flex()
}

/// Backends that work here, for `--device` and messages.
pub fn available() -> Vec<String> {
    #[allow(unused_mut)]
    let mut names = vec!["flex".to_string()];
    #[cfg(feature = "ndarray")]
    names.push("ndarray".into());
    #[cfg(feature = "wgpu")]
    {
        if real_adapter(0).is_some() {
            names.push("wgpu".into());
        }
        if software_adapter().is_some() {
            names.push("wgpu-cpu".into());
        }
    }
    #[cfg(feature = "cuda")]
    if cuda(0).is_some() {
        names.push("cuda".into());
    }
    names
}

fn unknown(name: &str) -> Error {
    let available = available().join(", ");
    let missing = match name.split(':').next().unwrap_or(name) {
        "wgpu" | "wgpu-cpu" if !cfg!(feature = "wgpu") => " (this build lacks it: add `--features wgpu`)",
        "ndarray" if !cfg!(feature = "ndarray") => " (this build lacks it: add `--features ndarray`)",
        "cuda" if !cfg!(feature = "cuda") => " (this build lacks it: add `--features cuda`)",
        _ => "",
    };
    Error::Device { name: name.into(), available: format!("{available}{missing}") }
}

/// A device opens its adapter on first use and panics where there is none; asked here once, so that a missing
/// driver is an answer instead.
#[cfg(any(feature = "wgpu", feature = "cuda"))]
fn opens(open: impl FnOnce() -> Device + std::panic::UnwindSafe) -> Option<Device> {
    let hook = std::panic::take_hook();
    std::panic::set_hook(Box::new(|_| {}));
    let device = std::panic::catch_unwind(|| {
        let device = open();
        let sum = burn::tensor::Tensor::<1>::ones([4], &device).sum().into_scalar::<f32>();
        (sum == 4.0).then_some(device)
    });
    std::panic::set_hook(hook);
    device.ok().flatten()
}

#[cfg(feature = "wgpu")]
fn real_adapter(index: usize) -> Option<Device> {
    opens(move || Device::wgpu(DeviceKind::DiscreteGpu(index)))
        .or_else(|| opens(move || Device::wgpu(DeviceKind::IntegratedGpu(index))))
}

#[cfg(feature = "wgpu")]
fn software_adapter() -> Option<Device> {
    opens(|| Device::wgpu(DeviceKind::Cpu))
}

#[cfg(feature = "cuda")]
fn cuda(index: usize) -> Option<Device> {
    opens(move || Device::cuda(index))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unknown_device_is_refused_with_what_there_is() {
        assert_eq!(devices("flex, cpu").unwrap().len(), 2);
        assert!(devices("flex,").is_err());
        let error = device("abacus").unwrap_err().to_string();
        assert!(error.starts_with("no device `abacus` here, available: flex"), "{error}");
    }

    #[test]
    fn the_default_is_never_a_software_driver() {
        // Where a machine has a real adapter this says nothing; without one, the answer must be flex.
        #[cfg(feature = "wgpu")]
        if real_adapter(0).is_some() {
            return;
        }
        assert_eq!(format!("{:?}", device("auto").unwrap()), format!("{:?}", Device::flex()));
    }
}
