"""The unit with FINUFFT: per chirp and receiver one type-1 transform in one dimension. No gradients."""
import finufft
import numpy as np

from scene import C, RATE_HZ, SLOPE, Scene, arguments, report

options = arguments(["1e-6", "1e-4"])
scene = Scene(options)
plan = finufft.Plan(1, (options.samples,), 1, float(options.form), 1, nthreads=options.threads, dtype="complex64", modeord=0)


def step():
    signal = np.empty((options.measured, options.receivers, options.samples), np.complex64)
    middle_s = (options.samples // 2) / RATE_HZ
    for chirp, time_s in enumerate(scene.chirp_s):
        point = scene.position + scene.velocity * time_s
        from_tx = np.linalg.norm(point - scene.tx, axis=1)
        for rx, antenna in enumerate(scene.rx):
            to_rx = np.linalg.norm(point - antenna, axis=1)
            delay = (from_tx + to_rx) / C
            turns = (scene.carrier_hz + SLOPE * middle_s) * delay
            strength = scene.amplitude / (from_tx * to_rx) * np.exp(2j * np.pi * (turns - np.floor(turns)))
            angle = 2 * np.pi * SLOPE * delay / RATE_HZ
            plan.setpts((np.mod(angle + np.pi, 2 * np.pi) - np.pi).astype(np.float32))
            signal[chirp, rx] = plan.execute(strength.astype(np.complex64))
    return signal


report("finufft", options, step, scene.relative_error(step()))
