"""The unit of the coherent sum: points, chirps and antennas that every yardstick adds up."""
import argparse
import json
import resource
import time

import numpy as np

C = 299_792_458.0
START_HZ, SLOPE, RATE_HZ, ADC_START_S, LOOP_S = 77e9, 60.012e12, 4.4e6, 6e-6, 216e-6


def arguments(forms):
    parser = argparse.ArgumentParser()
    parser.add_argument("--form", choices=forms, default=forms[0])
    parser.add_argument("--mode", choices=["forward", "amplitudes", "positions"], default="forward")
    parser.add_argument("--points", type=int, default=12_000)
    parser.add_argument("--chirps", type=int, default=128)
    parser.add_argument("--measured-chirps", type=int, help="measure fewer and scale up: time is linear in them")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--receivers", type=int, default=4)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--runs", type=int, default=3)
    options = parser.parse_args()
    options.measured = options.measured_chirps or options.chirps
    return options


class Scene:
    """Float64 geometry: moving points 1 to 5 m away, one transmitter, a row of receivers."""

    def __init__(self, options):
        random = np.random.default_rng(0)
        count = options.points
        self.position = random.uniform([-2, 1, -1.2], [2, 5, 1.2], (count, 3))
        self.velocity = random.uniform(-1.5, 1.5, (count, 3))
        self.amplitude = random.uniform(0.2, 1.0, count)
        half_wave = C / START_HZ / 2
        self.tx = np.zeros(3)
        self.rx = np.array([[(rx - 6) * half_wave, 0, 0] for rx in range(options.receivers)])
        self.carrier_hz = START_HZ + SLOPE * ADC_START_S
        self.sample_s = np.arange(options.samples) / RATE_HZ
        # The measured chirps lie in the middle of the frame.
        self.chirp_s = (np.arange(options.measured) - (options.measured - 1) / 2) * LOOP_S

    def definition(self, chirp, rx):
        """The sum of one chirp at one receiver, complex128."""
        point = self.position + self.velocity * self.chirp_s[chirp]
        legs = [np.linalg.norm(point - antenna, axis=1) for antenna in (self.tx, self.rx[rx])]
        delay = sum(legs) / C
        turns = self.carrier_hz * delay[:, None] + SLOPE * delay[:, None] * self.sample_s
        return (self.amplitude / (legs[0] * legs[1])) @ np.exp(2j * np.pi * (turns - np.round(turns)))

    def relative_error(self, signal):
        """Of a result [chirp, rx, sample], from two of its chirps."""
        chirps = [0, len(self.chirp_s) - 1]
        wanted = np.array([self.definition(chirp, 0) for chirp in chirps])
        found = np.array([signal[chirp, 0] for chirp in chirps])
        return float(np.linalg.norm(found - wanted) / np.linalg.norm(wanted))


def report(who, options, step, error):
    """Times `step` and prints one JSON line with the keys of our benchmark."""
    seconds, start = [], time.process_time()
    for _ in range(options.runs):
        began = time.perf_counter()
        step()
        seconds.append(time.perf_counter() - began)
    scale = options.chirps / options.measured
    print(json.dumps({
        "bench": "unit", "backend": who, "form": options.form, "mode": options.mode, "points": options.points,
        "chirps": options.chirps, "measured_chirps": options.measured, "samples": options.samples,
        "receivers": options.receivers, "median_s": round(float(np.median(seconds)) * scale, 4),
        "least_s": round(min(seconds) * scale, 4), "cpu_s": round((time.process_time() - start) / options.runs * scale, 4),
        "runs": options.runs, "threads": options.threads, "relative_error": error,
        "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024,
    }))
