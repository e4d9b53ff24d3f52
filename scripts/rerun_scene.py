#!/usr/bin/env python3
"""Show exports of one recording over time in rerun: body, room, points and maps, as one .rrd file.

    pip install rerun-sdk numpy
    hybridsim export RECORDING --to npz --out a && hybridsim export RECORDING --to points --out b && hybridsim export RECORDING --to maps --out c
    python3 scripts/rerun_scene.py a/NAME.npz b/NAME_points.npz c/NAME_maps.npz --out scene.rrd
    rerun scene.rrd

Any of the three may be left out. Reads only what `hybridsim export` writes (docs/export.md).
"""

import argparse
import json

import numpy as np
import rerun as rr


def log_room(archive):
    """The room as a box; a side without a boundary is drawn ten metres away."""
    if "room" not in archive:
        return
    room = json.loads(str(archive["room"]))
    far = 10.0
    low = [-room.get("left_m", far), -room.get("back_m", far), -room.get("floor_m", far)]
    high = [room.get("right_m", far), room.get("front_m", far), room.get("ceiling_m", far)]
    rr.log("world/room", rr.Boxes3D(mins=[low], sizes=[np.subtract(high, low)]), static=True)


def log_body(archive):
    for time, vertices in zip(archive["time_s"], archive["vertices"]):
        rr.set_time("recording", duration=float(time))
        rr.log("world/body", rr.Mesh3D(vertex_positions=vertices, triangle_indices=archive["faces"]))


def log_points(archive):
    """Receding points red, approaching ones blue, and larger the more they stand out."""
    places = np.stack([archive[f"{axis}_m"] for axis in "xyz"], axis=-1)
    velocity, snr_db = archive["velocity_m_s"], archive["snr_db"]
    fastest = max(np.abs(velocity).max(initial=0.0), 1e-9)
    red, blue = np.clip(velocity / fastest, 0, 1), np.clip(-velocity / fastest, 0, 1)
    colours = (255 * np.stack([red, 0.3 + 0 * red, blue], axis=-1)).astype(np.uint8)
    for frame, time in enumerate(archive["time_s"]):
        of_frame = archive["frame"] == frame
        rr.set_time("recording", duration=float(time))
        radii = 0.01 + 0.001 * snr_db[of_frame]
        rr.log("world/points", rr.Points3D(places[of_frame], colors=colours[of_frame], radii=radii))


def log_maps(archive):
    """The strongest cell over the other axes, 60 dB down to black."""
    power_db = archive["power_db"] if "power_db" in archive else 10 * np.log10(np.maximum(archive["power"], 1e-38))
    peak = power_db.max()
    grey = lambda image: (255 * np.clip((image - peak + 60) / 60, 0, 1)).astype(np.uint8)[::-1]
    for frame, time in enumerate(archive["time_s"]):
        rr.set_time("recording", duration=float(time))
        rr.log("maps/velocity_by_range", rr.Image(grey(power_db[frame].max(axis=(1, 2)))))
        rr.log("maps/range_by_azimuth", rr.Image(grey(power_db[frame].max(axis=(0, 1)).T)))


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("exports", nargs="+", metavar="FILE.npz")
    parser.add_argument("--out", required=True, metavar="FILE.rrd")
    arguments = parser.parse_args()
    rr.init("hybridsim")
    rr.save(arguments.out)
    rr.log("world", rr.ViewCoordinates.RIGHT_HAND_Z_UP, static=True)
    for path in arguments.exports:
        archive = np.load(path)
        log_room(archive)
        if "vertices" in archive:
            log_body(archive)
        if "snr_db" in archive:
            log_points(archive)
        if "power_db" in archive or "power" in archive:
            log_maps(archive)
    print(f"scene: {arguments.out}")


if __name__ == "__main__":
    main()
