#!/usr/bin/env python3
"""Writes tests/containers: one small cube in every container that `hybridsim import` reads.

Needs numpy, scipy and h5py. The cube is [frame 2, chirp 3, rx 4, sample 8]; number n in C order is (3 n - 200) + j (150 - 2 n).
"""

import pathlib

import h5py
import numpy as np
import scipy.io

FOLDER = pathlib.Path(__file__).parent.parent / "tests/containers"
FOLDER.mkdir(parents=True, exist_ok=True)

n = np.arange(2 * 3 * 4 * 8).reshape(2, 3, 4, 8)
re, im = (3 * n - 200).astype(np.int16), (150 - 2 * n).astype(np.int16)
cube = (re + 1j * im).astype(np.complex64)
pairs = np.stack([re, im], axis=-1)

for name, compressed in [("v6.mat", False), ("v7.mat", True)]:
    variables = {"cube": cube, "pairs": pairs, "note": "not a number", "rate": 2e6}
    scipy.io.savemat(FOLDER / name, variables, do_compression=compressed)

# Structures, arrays of structures, and cells.
frames = np.zeros(2, dtype=[("adc", object), ("time", object)])
cells = np.empty(2, dtype=object)
for index in range(2):
    frames[index] = (cube[index], 0.1 * index)
    cells[index] = cube[index]
nested = {"radar": {"rate": 2e6, "board": "none", "data": {"cube": cube}}, "frames": frames, "cells": cells, "note": "not a number"}
for name, compressed in [("structures_v6.mat", False), ("structures_v7.mat", True)]:
    scipy.io.savemat(FOLDER / name, nested, do_compression=compressed)

# As MATLAB 7.3 does: a block of its own first, axes in reverse, complex numbers as a compound of real and imag.
with h5py.File(FOLDER / "v73.mat", "w", userblock_size=512, libver="earliest") as file:
    parts = np.empty(cube.T.shape, dtype=[("real", "<i2"), ("imag", "<i2")])
    parts["real"], parts["imag"] = re.T, im.T
    file.create_dataset("cube", data=parts, chunks=(8, 4, 3, 1), compression="gzip").attrs["MATLAB_class"] = np.bytes_("int16")
    file.create_dataset("rate", data=np.array([[2e6]])).attrs["MATLAB_class"] = np.bytes_("double")
with h5py.File(FOLDER / "structures_v73.mat", "w", userblock_size=512, libver="earliest") as file:
    file.create_dataset("radar/data/cube", data=parts).attrs["MATLAB_class"] = np.bytes_("int16")
    cell = file.create_dataset("#refs#/a", data=parts)
    file.create_dataset("cells", data=np.array([[cell.ref]], dtype=h5py.ref_dtype)).attrs["MATLAB_class"] = np.bytes_("cell")
for name in ["v73.mat", "structures_v73.mat"]:
    with open(FOLDER / name, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64, HDF5 schema 1.00 .".ljust(124) + b"\x00\x02IM")

with h5py.File(FOLDER / "h5py.h5", "w") as file:
    file.create_dataset("radar/cube", data=cube, chunks=(1, 3, 2, 8), compression="gzip", shuffle=True)
    file.create_dataset("radar/re", data=re)
    file.create_dataset("radar/im", data=im)

# Every index of chunks that the library has (one chunk, fixed array, extensible array, B-tree), filters, byte orders and complex types.
for name, libver in [("latest.h5", "latest"), ("earliest.h5", "earliest")]:
    with h5py.File(FOLDER / name, "w", libver=libver) as file:
        file.create_dataset("one_chunk", data=cube, chunks=cube.shape, compression="gzip")
        file.create_dataset("fixed", data=cube, chunks=(1, 2, 3, 5), compression="gzip", shuffle=True)
        file.create_dataset("unfiltered", data=cube, chunks=(1, 3, 4, 8))
        file.create_dataset("growing", data=cube, chunks=(1, 3, 4, 4), maxshape=(None, 3, 4, 8), compression="gzip")
        file.create_dataset("growing_twice", data=cube, chunks=(1, 2, 4, 4), maxshape=(None, None, 4, 8), compression="gzip")
        file.create_dataset("checked", data=cube, chunks=(1, 3, 4, 8), fletcher32=True, shuffle=True, compression="gzip")
        file.create_dataset("lzf", data=cube, chunks=(1, 3, 4, 8), compression="lzf")
        file.create_dataset("double", data=cube.astype(np.complex128))
        file.create_dataset("big_endian", data=cube.astype(">c8"), chunks=(1, 3, 4, 8), compression="gzip", shuffle=True)
        for part, values in [("re", re), ("im", im)]:
            file.create_dataset(f"scaled/{part}", data=values, chunks=(1, 3, 4, 8), scaleoffset=0)
            file.create_dataset(f"swapped/{part}", data=values.astype(">i2"))

np.savez(FOLDER / "parts.npz", real=re, imag=im)
np.savez_compressed(FOLDER / "cube.npz", cube=cube, rate=2e6, names=np.array(["a", "b"]))
