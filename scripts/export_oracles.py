#!/usr/bin/env python3
"""Hold the exports of a recording against programs of others: mmwcore, OpenRadar, xwr, h5py, plyfile, NumPy.

    pip install numpy h5py plyfile mmwcore==0.3.0 xwr scikit-learn matplotlib && pip install --no-deps openradar
    python3 scripts/export_oracles.py target/release/hybridsim RECORDING
    python3 scripts/export_oracles.py target/release/hybridsim --freeze python/tests/goldens/decoders.npz

RECORDING must be one of int16 codes with a quadrature receiver and an even number of samples. Needs Python 3.12 (mmwcore).
Says what was compared and ends with status 1 where anything differs. --freeze keeps the files of a capture of its own, and what the
three decoders make of them, for python/tests/test_decoders.py, which needs none of them.
"""

import argparse
import importlib.metadata
import json
import pathlib
import subprocess
import sys
import tempfile
import tomllib

import numpy as np


def exported(program, recording, target, folder, *more):
    subprocess.run([program, "export", recording, "--to", target, "--out", folder, "--quiet", *more], check=True)
    return pathlib.Path(folder)


def compare(what, found, wanted):
    found, wanted = np.asarray(found), np.asarray(wanted)
    same = found.shape == wanted.shape and np.array_equal(found, wanted)
    print(f"{'ok    ' if same else 'DIFFER'} {what}: {found.shape}")
    return same


def by_mmwcore(folder, name, radar, layout):
    """[frame, chirp, rx, sample] as mmwcore decodes the file."""
    from mmwcore.core import ADCComplexLayout, ADCFrameSpec
    from mmwcore.io import load_adc_cube

    chirps = radar["loops_per_frame"] * len(radar["tx_m"])
    spec = ADCFrameSpec(chirps, len(radar["rx_m"]), radar["samples_per_chirp"], ADCComplexLayout(layout))
    return load_adc_cube(folder / f"{name}_Raw_0.bin", spec).data


def by_openradar(folder, name, radar):
    """The same, frame by frame, as OpenRadar organizes it."""
    from mmwave.dataloader import DCA1000

    words = np.fromfile(folder / f"{name}_Raw_0.bin", dtype=np.int16)
    chirps = radar["loops_per_frame"] * len(radar["tx_m"])
    frames = np.split(words, radar["frames"])
    return np.stack([DCA1000.organize(frame, chirps, len(radar["rx_m"]), radar["samples_per_chirp"]) for frame in frames])


def by_xwr(folder, name):
    """[frame, loop, tx, rx, sample] of a trace, read by its meta.json and ordered by xwr."""
    from xwr.rsp import iq_from_iiqq

    sensor = folder / name / "radar"
    channel = json.loads((sensor / "meta.json").read_text())["iq"]
    words = np.fromfile(sensor / "iq", dtype=channel["type"]).reshape(-1, *channel["shape"])
    return iq_from_iiqq(words)


FROZEN_RADAR = """[radar]
start_frequency_hz = 77.0e9
slope_hz_per_s = 60.0e12
sample_rate_hz = 5.0e6
samples_per_chirp = 8
loops_per_frame = 3
adc_start_s = 6.0e-6
chirp_period_s = 60.0e-6
frame_period_s = 0.05
frames = 2
tx_m = [[0.0, 0.0, 0.0], [0.0077868, 0.0, 0.0]]
rx_m = [[0.0, 0.0, 0.0], [0.0019467, 0.0, 0.0], [0.0038934, 0.0, 0.0], [0.0058401, 0.0, 0.0]]
"""


def frozen_codes():
    """int16 [frame, tx, rx, loop, sample, iq] over the whole range; no other place has the same."""
    shape = (2, 2, 4, 3, 8, 2)
    return (np.arange(np.prod(shape)) * 40_503 % 65_536 - 32_768).astype(np.int16).reshape(shape)


def freeze(program, path):
    """Files that the program writes of known codes, and what others read in them."""
    radar, codes = tomllib.loads(FROZEN_RADAR)["radar"], frozen_codes()
    split = lambda cube: np.stack([cube.real, cube.imag], axis=-1).astype(np.int16)
    with tempfile.TemporaryDirectory() as parent:
        parent = pathlib.Path(parent)
        (parent / "radar.toml").write_text(FROZEN_RADAR)
        np.save(parent / "codes.npy", codes)
        words = ["--config", parent / "radar.toml", "--layout", "frame tx rx loop sample iq", "--as-stated", "--quiet"]
        subprocess.run([program, "import", parent / "codes.npy", "--out", parent / "codes", *words], check=True)
        out = lambda target, name, *more: exported(program, parent / "codes", target, parent / name, *more)
        two = out("dca1000", "two", "--board", "AWR1843BOOST")
        four = out("dca1000", "four", "--board", "IWR1443BOOST")
        trace = out("rover", "trace")
        raw = lambda file: np.fromfile(file, dtype=np.int16)
        made = {
            "radar": FROZEN_RADAR,
            "versions": ", ".join(f"{name} {importlib.metadata.version(name)}" for name in ("mmwcore", "openradar", "xwr")),
            "codes": codes,
            "two_lanes": raw(two / "codes_Raw_0.bin"),
            "two_lanes_by_mmwcore": split(by_mmwcore(two, "codes", radar, "group2_i_then_q")),
            "two_lanes_by_openradar": split(by_openradar(two, "codes", radar)),
            "four_lanes": raw(four / "codes_Raw_0.bin"),
            "four_lanes_by_mmwcore": split(by_mmwcore(four, "codes", radar, "group4_i_then_q")),
            "rover": raw(trace / "codes/radar/iq"),
            "rover_by_xwr": split(by_xwr(trace, "codes")),
        }
    path.parent.mkdir(parents=True, exist_ok=True)
    np.savez_compressed(path, **made)
    print(f"{path}: {path.stat().st_size} bytes, {made['versions']}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("program", metavar="PROGRAM")
    parser.add_argument("recording", nargs="?", metavar="RECORDING")
    parser.add_argument("--freeze", type=pathlib.Path, metavar="FILE.npz")
    arguments = parser.parse_args()
    if arguments.freeze is not None:
        freeze(arguments.program, arguments.freeze)
    if arguments.recording is not None:
        sys.exit(0 if compared(arguments.program, arguments.recording) else 1)
    if arguments.freeze is None:
        parser.error("give RECORDING, --freeze FILE.npz, or both")


def compared(program, recording):
    name = pathlib.Path(recording).resolve().name
    settings = tomllib.loads((pathlib.Path(recording) / "recording.toml").read_text())
    radar = settings["radar"]
    codes = np.load(pathlib.Path(recording) / settings["files"]["if"])
    assert codes.dtype == np.int16 and codes.ndim == 6, "expected int16 [frame, tx, rx, loop, sample, iq]"
    samples = codes[..., 0].astype(np.float32) + 1j * codes[..., 1].astype(np.float32)
    # Chirps in the order in which they are sent.
    chirps = samples.transpose(0, 3, 1, 2, 4)
    by_chirp = chirps.reshape(chirps.shape[0], -1, *chirps.shape[3:])

    ok = True
    with tempfile.TemporaryDirectory() as parent:
        out = lambda target: exported(program, recording, target, f"{parent}/{target}")
        folder = out("dca1000")
        ok &= compare("dca1000, two lanes, by mmwcore", by_mmwcore(folder, name, radar, "group2_i_then_q"), by_chirp)
        ok &= compare("dca1000, two lanes, by OpenRadar", by_openradar(folder, name, radar), by_chirp)
        ok &= compare("rover, by xwr", by_xwr(out("rover"), name), chirps)
        archive = np.load(out("npz") / f"{name}.npz")
        ok &= compare("npz, by NumPy", archive["samples"], samples)
        axes = json.loads(str(archive["axes"]))
        named = all(len(entry["axes"]) == archive[key].ndim for key, entry in axes.items())
        ok &= compare("npz, axes named", named, True)
        ok &= compare("npz, radar", json.loads(str(archive["radar"]))["samples_per_chirp"], radar["samples_per_chirp"])

        import h5py

        with h5py.File(out("hdf5") / f"{name}.h5") as file:
            ok &= compare("hdf5, by h5py", file["samples"][:], samples)
            ok &= compare("hdf5, range axis", file["range_m"][:], archive["range_m"])
            ok &= compare("hdf5, radar", json.loads(file.attrs["radar"])["slope_hz_per_s"], radar["slope_hz_per_s"])

        from plyfile import PlyData

        folder = out("points")
        cloud = np.load(folder / f"{name}_points.npz")
        for frame in range(radar["frames"]):
            vertex = PlyData.read(folder / f"{name}_points/frame_{frame:06d}.ply")["vertex"]
            of_frame = cloud["frame"] == frame
            for column, key in [("x", "x_m"), ("z", "z_m"), ("velocity", "velocity_m_s")]:
                if not np.allclose(vertex[column], cloud[key][of_frame], atol=1e-5):
                    ok &= compare(f"points, {column} of frame {frame}, by plyfile", vertex[column], cloud[key][of_frame])
        print(f"ok     points, by plyfile: {len(cloud['frame'])} points")
        maps = np.load(out("maps") / f"{name}_maps.npz")
        shape = [len(maps[key]) for key in ["time_s", "velocity_m_s", "elevation_deg", "azimuth_deg", "range_m"]]
        ok &= compare("maps, axes of their lengths", maps["power_db"].shape, shape)
    return ok


if __name__ == "__main__":
    main()
