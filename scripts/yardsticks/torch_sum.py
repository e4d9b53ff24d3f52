"""The unit with PyTorch on the CPU: as anyone would write it (`naive`), and with exp(j w n) split into a matrix product
over n = 16 a + b (`split`). Delays in float64, the sum in float32; the backward pass recomputes chunks of chirps."""
import math

import torch
from torch.utils.checkpoint import checkpoint

from scene import C, RATE_HZ, SLOPE, Scene, arguments, report

options = arguments(["naive", "split"])
torch.set_num_threads(options.threads)
scene = Scene(options)
CHUNK = 4
BLOCK = 16
position, velocity, tx, rx = (torch.tensor(x) for x in (scene.position, scene.velocity, scene.tx, scene.rx))
amplitude = torch.tensor(scene.amplitude, dtype=torch.float32)
times = torch.tensor(scene.chirp_s)
samples = torch.tensor(scene.sample_s)


def fraction(turns):
    return (turns - torch.floor(turns).detach()).float() * (2 * math.pi)


def geometry(position, chirps):
    """Delay in seconds and spreading, [chirp, rx, point]."""
    point = position + velocity * times[chirps, None, None]
    from_tx = (point - tx).norm(dim=-1)[:, None]
    to_rx = (point[:, None] - rx[:, None]).norm(dim=-1)
    return (from_tx + to_rx) / C, (1 / (from_tx * to_rx)).float()


def naive(amplitude, position, chirps):
    delay, spreading = geometry(position, chirps)
    carrier = fraction(scene.carrier_hz * delay)
    phase = carrier[..., None] + (2 * math.pi * SLOPE) * delay.float()[..., None] * samples.float()
    strength = (amplitude * spreading)[..., None]
    return torch.complex((strength * torch.cos(phase)).sum(-2), (strength * torch.sin(phase)).sum(-2))


def split(amplitude, position, chirps):
    delay, spreading = geometry(position, chirps)
    per_sample = SLOPE * delay / RATE_HZ
    coarse = fraction(per_sample[..., None, :] * (torch.arange(options.samples // BLOCK) * BLOCK).double()[:, None])
    fine = fraction((scene.carrier_hz * delay)[..., None] + per_sample[..., None] * torch.arange(BLOCK).double())
    strength = (amplitude * spreading)[..., None]
    left = torch.complex(torch.cos(coarse), torch.sin(coarse))
    right = torch.complex(strength * torch.cos(fine), strength * torch.sin(fine))
    return (left @ right).flatten(-2)


def signal(amplitude, position, tracked):
    chunks = torch.arange(options.measured).split(CHUNK)
    of = {"naive": naive, "split": split}[options.form]
    if tracked:
        return torch.cat([checkpoint(of, amplitude, position, chunk, use_reentrant=False) for chunk in chunks])
    with torch.no_grad():
        return torch.cat([of(amplitude, position, chunk) for chunk in chunks])


def step():
    if options.mode == "forward":
        return signal(amplitude, position, False)
    a = amplitude.clone().requires_grad_(True)
    x = position.clone().requires_grad_(options.mode == "positions")
    signal(a, x, True).abs().square().sum().backward()


report("torch", options, step, scene.relative_error(signal(amplitude, position, False).numpy()))
