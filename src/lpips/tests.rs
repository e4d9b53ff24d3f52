//! LPIPS with weights that a test makes itself, and parity with the `lpips` package where its fixture is present.

use std::{fs, io::Write, path::Path};

use burn::tensor::Device;

use super::*;
use crate::support::{numbers, shared};

/// Name, shape, values.
type Tensors = Vec<(String, Vec<usize>, Vec<f32>)>;

fn bytes(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

/// A safetensors file: the header's length, the header, the numbers.
fn write_safetensors(path: &Path, tensors: &Tensors) {
    let mut header = serde_json::Map::new();
    let mut data = Vec::new();
    for (name, shape, values) in tensors {
        let start = data.len();
        data.extend(bytes(values));
        let entry = serde_json::json!({ "dtype": "F32", "shape": shape, "data_offsets": [start, data.len()] });
        header.insert(name.clone(), entry);
    }
    let header = serde_json::to_vec(&header).unwrap();
    let length = (header.len() as u64).to_le_bytes();
    fs::write(path, [&length[..], &header, &data].concat()).unwrap();
}

/// What `torch.save` makes of a state dict: a zip archive with a pickle that refers to the numbers.
fn write_torch(path: &Path, tensors: &Tensors) {
    let text = |text: &str| [&b"X"[..], &(text.len() as u32).to_le_bytes(), text.as_bytes()].concat();
    let number = |value: usize| [&b"J"[..], &(value as i32).to_le_bytes()].concat();
    let tuple = |parts: &[Vec<u8>]| [b"(".to_vec(), parts.concat(), b"t".to_vec()].concat();
    let ordered = b"ccollections\nOrderedDict\n)R".to_vec();
    let mut pickle = [b"\x80\x02".to_vec(), ordered.clone(), b"(".to_vec()].concat();
    let mut archive = zip::ZipWriter::new(fs::File::create(path).unwrap());
    let stored = zip::write::SimpleFileOptions::default().compression_method(zip::CompressionMethod::Stored);
    for (index, (name, shape, values)) in tensors.iter().enumerate() {
        let floats = b"ctorch\nFloatStorage\n".to_vec();
        let storage = tuple(&[text("storage"), floats, text(&index.to_string()), text("cpu"), number(values.len())]);
        let mut strides = vec![1; shape.len()];
        (0..shape.len() - 1).rev().for_each(|axis| strides[axis] = strides[axis + 1] * shape[axis + 1]);
        let numbers = |values: &[usize]| tuple(&values.iter().map(|value| number(*value)).collect::<Vec<_>>());
        let parts =
            [[storage, b"Q".to_vec()].concat(), number(0), numbers(shape), numbers(&strides), b"\x89".to_vec(), ordered.clone()];
        pickle.extend([text(name), b"ctorch._utils\n_rebuild_tensor_v2\n".to_vec(), tuple(&parts), b"R".to_vec()].concat());
        archive.start_file(format!("archive/data/{index}"), stored).unwrap();
        archive.write_all(&bytes(values)).unwrap();
    }
    pickle.extend(b"u.");
    for (name, content) in [("data.pkl", pickle), ("version", b"3\n".to_vec())] {
        archive.start_file(format!("archive/{name}"), stored).unwrap();
        archive.write_all(&content).unwrap();
    }
    archive.finish().unwrap();
}

/// Random weights under torchvision's names, of the size that keeps features alive.
fn backbone(network: Network) -> Tensors {
    let tensor = |(index, (name, shape)): (usize, (String, Vec<usize>))| {
        let inputs: usize = shape[1..].iter().product();
        let size = if shape.len() > 1 { (6.0 / inputs as f64).sqrt() } else { 0.05 };
        let values = numbers(index as u64, shape.iter().product(), -size, size);
        (name, shape, values.into_iter().map(|value| value as f32).collect())
    };
    network.tensors().into_iter().enumerate().map(tensor).collect()
}

fn heads(network: Network) -> Tensors {
    let head =
        |(name, channels): (String, usize)| (format!("{name}.model.1.weight"), vec![1, channels, 1, 1], vec![0.5; channels]);
    network.heads().into_iter().map(head).collect()
}

fn open(network: Network, weights: &Path, heads: &Path) -> Result<Lpips> {
    Lpips::open(&LpipsConfig { network, weights: weights.into(), heads: heads.into() }, &Device::flex())
}

#[test]
fn a_network_of_two_live_channels_gives_what_the_hand_gives() {
    let folder = tempfile::tempdir().unwrap();
    let (weights, head) = (folder.path().join("alex.safetensors"), folder.path().join("heads.safetensors"));
    let mut tensors = backbone(Network::Alex);
    tensors.iter_mut().for_each(|(_, _, values)| values.fill(0.0));
    // the first channel is the red value of a pixel, the second is one; all deeper features are zero
    tensors[0].2[5 * 11 + 5] = 1.0;
    tensors[1].2[1] = 1.0;
    write_safetensors(&weights, &tensors);
    let mut trained = heads(Network::Alex);
    (trained[0].2[0], trained[0].2[1]) = (0.3, 0.7);
    write_safetensors(&head, &trained);
    let lpips = open(Network::Alex, &weights, &head).unwrap();

    let (a, b) = (0.8, 0.6);
    let unit = |grey: f64| {
        let red = (2.0 * grey - 1.0 + 0.030) / 0.458;
        let length = (red * red + 1.0).sqrt();
        [red / length, 1.0 / length]
    };
    let (ua, ub) = (unit(a), unit(b));
    let wanted = 0.3 * (ua[0] - ub[0]).powi(2) + 0.7 * (ua[1] - ub[1]).powi(2);
    let found = lpips.by_depth(&[a; 32 * 40], &[b; 32 * 40], [32, 40]);
    assert!((found[0] - wanted).abs() < 1e-6, "found {}, wanted {wanted}", found[0]);
    assert_eq!(found[1..], [0.0; 4]);
}

#[test]
fn every_network_sees_the_smallest_images_from_either_kind_of_file() {
    let folder = tempfile::tempdir().unwrap();
    let dims = [Lpips::SMALLEST; 2];
    let [a, b] = [1, 2].map(|seed| numbers(seed, dims[0] * dims[1], 0.0, 1.0));
    for network in Network::ALL {
        let file = |name: &str| folder.path().join(format!("{}-{name}", network.name()));
        write_safetensors(&file("weights.safetensors"), &backbone(network));
        write_torch(&file("heads.pth"), &heads(network));
        let lpips = open(network, &file("weights.safetensors"), &file("heads.pth")).unwrap();
        let distance = lpips.distance(&a, &b, dims);
        assert!(distance > 1e-6 && distance.is_finite(), "{}: {distance}", network.name());
        assert_eq!(lpips.distance(&a, &a, dims), 0.0);
        assert!((lpips.distance(&b, &a, dims) / distance - 1.0).abs() < 1e-5);
        if network == Network::Squeeze {
            write_torch(&file("weights.pth"), &backbone(network));
            let again = open(network, &file("weights.pth"), &file("heads.pth")).unwrap();
            assert_eq!(again.distance(&a, &b, dims), distance);
        }
    }
    assert!(Lpips::check_dims(dims).is_ok());
    assert!(Lpips::check_dims([16, 64]).unwrap_err().to_string().contains("16 × 64"));
}

#[test]
fn files_of_another_network_are_refused_with_the_tensor_and_the_network_they_fit() {
    let folder = tempfile::tempdir().unwrap();
    let file = |name: &str| folder.path().join(name);
    write_safetensors(&file("squeeze.safetensors"), &backbone(Network::Squeeze));
    write_safetensors(&file("heads.safetensors"), &heads(Network::Squeeze));
    let refused = |network, weights: &str, heads: &str| {
        let error = open(network, &file(weights), &file(heads)).err().expect("refused");
        (error.to_string(), error.hint().unwrap_or_default())
    };
    let (text, hint) = refused(Network::Alex, "squeeze.safetensors", "heads.safetensors");
    assert!(text.contains("squeeze.safetensors: `features.0.weight` is [64, 3, 3, 3], expected [64, 3, 11, 11]"), "{text}");
    assert!(hint.contains("for the network `squeeze`"), "{hint}");

    write_safetensors(&file("vgg-heads.safetensors"), &heads(Network::Vgg));
    let (text, hint) = refused(Network::Squeeze, "squeeze.safetensors", "vgg-heads.safetensors");
    assert!(text.contains("`lin3` is [1, 512, 1, 1], expected [384]") && hint.contains("`vgg`"), "{text}; {hint}");

    let mut part = backbone(Network::Squeeze);
    part.retain(|(name, _, _)| name != "features.9.expand1x1.bias");
    write_safetensors(&file("part.safetensors"), &part);
    let (text, hint) = refused(Network::Squeeze, "part.safetensors", "heads.safetensors");
    assert!(
        text.contains("`features.9.expand1x1.bias` is missing, expected [192]") && hint.contains("49 tensors"),
        "{text}; {hint}"
    );

    let mut broken = backbone(Network::Squeeze);
    broken[3].2[1] = f32::NAN;
    write_safetensors(&file("broken.safetensors"), &broken);
    let (text, _) = refused(Network::Squeeze, "broken.safetensors", "heads.safetensors");
    assert!(text.contains("`features.3.squeeze.bias` is NaN at value 1"), "{text}");

    fs::write(file("text.pth"), "no weights").unwrap();
    let (text, _) = refused(Network::Squeeze, "text.pth", "heads.safetensors");
    assert!(text.contains("text.pth: cannot be read as torch"), "{text}");
    let (text, _) = refused(Network::Squeeze, "absent.safetensors", "heads.safetensors");
    assert!(text.contains("absent.safetensors: cannot be read"), "{text}");
}

/// splitmix64's uniform numbers, as the fixture draws its weights.
fn uniform(seed: u64, count: usize) -> Vec<f64> {
    let number = |index: u64| {
        let mut z = index.wrapping_mul(0x9E37_79B9_7F4A_7C15).wrapping_add(seed);
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ (z >> 31)) >> 11) as f64 * 2f64.powi(-53)
    };
    (1..=count as u64).map(number).collect()
}

#[test]
fn distances_at_every_depth_are_those_of_the_lpips_package() {
    let Some(folder) = shared("fixtures/metrics") else { return };
    let fixture: serde_json::Value = serde_json::from_slice(&fs::read(folder.join("fixture.json")).unwrap()).unwrap();
    let (rows, columns) = (128, 256);
    assert_eq!((fixture["H"].as_u64(), fixture["W"].as_u64()), (Some(rows), Some(columns)));
    let (rows, columns) = (rows as usize, columns as usize);
    let (texture, error) = (uniform(1, rows * columns), uniform(2, rows * columns));
    let pixel = |index: usize| {
        let (y, x) = ((index / columns) as f64, (index % columns) as f64);
        let blob = |row: f64, height: f64, width: f64| (-((y - row).powi(2) / height + (x - 60.0).powi(2) / width)).exp();
        (0.15 * texture[index] + 0.8 * blob(64.0, 20.0, 90.0) + 0.5 * blob(80.0, 200.0, 60.0)).clamp(0.0, 1.0)
    };
    let a: Vec<f64> = (0..rows * columns).map(pixel).collect();
    let b: Vec<f64> = a.iter().zip(&error).map(|(a, u)| (a + 0.2 * (2.0 * u - 1.0)).clamp(0.0, 1.0)).collect();
    let scratch = tempfile::tempdir().unwrap();
    let (weights, head) = (scratch.path().join("weights.safetensors"), scratch.path().join("heads.safetensors"));
    let mut wrong = Vec::new();
    for network in Network::ALL {
        let wanted = &fixture["nets"][network.name()];
        // under the names of the `lpips` package
        let tensor = |(index, entry): (usize, &serde_json::Value)| {
            let shape: Vec<usize> = serde_json::from_value(entry[1].clone()).unwrap();
            let inputs: usize = shape[1..].iter().product();
            let size = if shape.len() > 1 { (6.0 / inputs as f64).sqrt() } else { 0.05 };
            let values = uniform(1000 + index as u64, shape.iter().product());
            let values = values.into_iter().map(|u| ((2.0 * u - 1.0) * size) as f32).collect();
            (entry[0].as_str().unwrap().to_string(), shape, values)
        };
        write_safetensors(&weights, &wanted["tensors"].as_array().unwrap().iter().enumerate().map(tensor).collect());
        let mut trained = heads(network);
        for (depth, (_, shape, values)) in trained.iter_mut().enumerate() {
            *values = uniform(2000 + depth as u64, shape[1]).into_iter().map(|u| (u / shape[1] as f64) as f32).collect();
        }
        write_safetensors(&head, &trained);
        let found = open(network, &weights, &head).unwrap().by_depth(&a, &b, [rows, columns]);
        let by_depth: Vec<f64> = serde_json::from_value(wanted["per_layer"].clone()).unwrap();
        assert_eq!(found.len(), by_depth.len());
        let total = (found.iter().sum::<f64>(), wanted["distance"].as_f64().unwrap());
        for (depth, (found, wanted)) in found.iter().copied().zip(by_depth).chain([total]).enumerate() {
            println!("{} {depth}: found {found:e}, wanted {wanted:e}, relative {:e}", network.name(), found / wanted - 1.0);
            if (found / wanted - 1.0).abs() > 1e-5 {
                wrong.push(format!("{} at depth {depth}: found {found:e}, wanted {wanted:e}", network.name()));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn the_packages_own_heads_are_read() {
    let Some(folder) = shared("fixtures/metrics/lpips_heads_v0.1_BSD-2") else { return };
    let scratch = tempfile::tempdir().unwrap();
    let weights = scratch.path().join("squeeze.safetensors");
    write_safetensors(&weights, &backbone(Network::Squeeze));
    let lpips = open(Network::Squeeze, &weights, &folder.join("squeeze.npz")).unwrap();
    let [a, b] = [1, 2].map(|seed| numbers(seed, 40 * 50, 0.0, 1.0));
    assert!(lpips.distance(&a, &b, [40, 50]) > 0.0);
    let error = open(Network::Squeeze, &weights, &folder.join("alex.npz")).err().expect("refused");
    assert!(error.to_string().contains("`lin1` is [192], expected [128]"), "{error}");
}
