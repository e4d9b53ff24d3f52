//! The files that backbones and heads come in: torch, safetensors, npz.
//!
//! torchvision calls a tensor `features.3.weight`, the `lpips` package `net.slice2.3.weight`: both are known here by
//! torchvision's name. Heads are `lin0`, `lin0.model.1.weight` or `lins.0.model.1.weight`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use burn::{
    store::{ModuleStore, SafetensorsStore, bridge, burn_pack, pytorch_reader::PytorchReader},
    tensor::TensorData,
};

use super::network::Network;
use crate::{
    data::{
        arrays::{Array, Npz},
        files,
    },
    error::{Error, Result},
};

/// An open file: its tensors stay on the disk until they are asked for.
pub(super) struct WeightFile {
    path: PathBuf,
    tensors: BTreeMap<String, burn_pack::Tensor>,
}

impl WeightFile {
    /// # Errors
    /// A file that is none of the three formats.
    pub fn open(path: &Path) -> Result<Self> {
        // the readers below word a missing file each in their own way
        files::require(path)?;
        let tensors = match path.extension().and_then(|extension| extension.to_str()) {
            Some("safetensors") => SafetensorsStore::from_file(path)
                .get_all_tensors()
                .map_err(|error| unreadable(path, "safetensors", &error))?
                .clone()
                .into_iter()
                .collect(),
            Some("npz") => npz(path)?,
            _ => PytorchReader::new(path)
                .map_err(|error| unreadable(path, "torch", &error))?
                .into_tensors()
                .into_iter()
                .map(|(name, tensor)| (name, bridge::from_pytorch(tensor)))
                .collect::<BTreeMap<_, _>>(),
        };
        let tensors = tensors.into_iter().map(|(name, tensor)| (known_name(&name), tensor)).collect();
        Ok(Self { path: path.into(), tensors })
    }

    /// (shape, values) of every tensor of a backbone, in the network's order.
    pub fn backbone(&self, network: Network) -> Result<Vec<(Vec<usize>, Vec<f32>)>> {
        let read = |(name, shape): (String, Vec<usize>)| {
            self.check(&name, &shape, &[]).map_err(|error| error.with_hint(self.backbone_hint(network)))?;
            let values = self.values(&name)?;
            Ok((shape, values))
        };
        network.tensors().into_iter().map(read).collect()
    }

    /// The weights of a head, one of each channel.
    pub fn head(&self, network: Network, name: &str, channels: usize) -> Result<Vec<f32>> {
        self.check(name, &[channels], &[1, channels, 1, 1]).map_err(|error| error.with_hint(self.heads_hint(network)))?;
        self.values(name)
    }

    fn check(&self, name: &str, shape: &[usize], or: &[usize]) -> Result<()> {
        let found = match self.tensors.get(name) {
            None => "missing".to_string(),
            Some(tensor) if tensor.shape[..] == *shape || tensor.shape[..] == *or => return Ok(()),
            Some(tensor) => format!("{:?}", &tensor.shape[..]),
        };
        Err(Error::field(&self.path, name, found, format!("{shape:?}")))
    }

    fn values(&self, name: &str) -> Result<Vec<f32>> {
        let data = bridge::to_data(&self.tensors[name]).map_err(|error| unreadable(&self.path, "weights", &error))?;
        let values = data.convert::<f32>().try_into_vec::<f32>().expect("converted");
        if let Some(index) = values.iter().position(|value| !value.is_finite()) {
            let found = format!("{} at value {index}", values[index]);
            return Err(Error::field(&self.path, name, found, "finite numbers").with_hint("the file is damaged; get it again"));
        }
        Ok(values)
    }

    fn backbone_hint(&self, wanted: Network) -> String {
        let fits = |network: Network| network.tensors().iter().all(|(name, shape)| self.check(name, shape, &[]).is_ok());
        self.hint(fits, format!("the state dict of the {} backbone, as torchvision has it", wanted.name()))
    }

    fn heads_hint(&self, wanted: Network) -> String {
        let fits = |network: Network| {
            network.heads().iter().all(|(name, channels)| self.check(name, &[*channels], &[1, *channels, 1, 1]).is_ok())
        };
        self.hint(fits, format!("the heads for {}, as the `lpips` package has them", wanted.name()))
    }

    /// What a file that does not fit holds instead.
    fn hint(&self, fits: impl Fn(Network) -> bool, wanted: String) -> String {
        if let Some(network) = Network::ALL.into_iter().find(|network| fits(*network)) {
            return format!("this file is for the network `{}`; give {wanted}", network.name());
        }
        let names: Vec<&str> = self.tensors.keys().take(4).map(String::as_str).collect();
        format!("give {wanted}; this file holds {} tensors: {} …", self.tensors.len(), names.join(", "))
    }
}

/// Heads in NumPy's format, `lin0`, `lin1`, … of one axis each.
fn npz(path: &Path) -> Result<BTreeMap<String, burn_pack::Tensor>> {
    let mut file = Npz::open(path)?;
    let mut tensors = BTreeMap::new();
    for name in file.names() {
        let array: Array<f64> = file.read(&name, &[("channel", None)])?;
        let data = TensorData::new(array.values, array.shape);
        tensors.insert(name.clone(), bridge::from_data(data, name, None));
    }
    Ok(tensors)
}

/// torchvision's name of a backbone's tensor, `lin0` of a head's; other names as they are.
fn known_name(name: &str) -> String {
    const WRAPPERS: [&str; 5] = ["state_dict", "model_state_dict", "module", "model", "net"];
    let mut parts: Vec<&str> = name.split('.').collect();
    while parts.len() > 1 && WRAPPERS.contains(&parts[0]) {
        parts.remove(0);
    }
    match parts[..] {
        [slice, ref rest @ ..] if is_numbered(slice, "slice") && !rest.is_empty() => format!("features.{}", rest.join(".")),
        [head, "model", "1", "weight"] if is_numbered(head, "lin") => head.to_string(),
        ["lins", depth, "model", "1", "weight"] => format!("lin{depth}"),
        _ => parts.join("."),
    }
}

fn is_numbered(text: &str, word: &str) -> bool {
    text.strip_prefix(word).is_some_and(|number| !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit()))
}

fn unreadable(path: &Path, format: &str, error: &dyn std::fmt::Display) -> Error {
    Error::Parse { path: path.into(), message: format!("cannot be read as {format}: {error}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tensor_is_known_by_whatever_name_it_comes_under() {
        for name in
            ["features.3.squeeze.bias", "net.slice2.3.squeeze.bias", "slice2.3.squeeze.bias", "module.features.3.squeeze.bias"]
        {
            assert_eq!(known_name(name), "features.3.squeeze.bias");
        }
        for name in ["lin4", "lin4.model.1.weight", "lins.4.model.1.weight", "state_dict.lin4.model.1.weight"] {
            assert_eq!(known_name(name), "lin4");
        }
        assert_eq!(known_name("classifier.6.weight"), "classifier.6.weight");
        assert_eq!(known_name("linear.weight"), "linear.weight");
    }
}
