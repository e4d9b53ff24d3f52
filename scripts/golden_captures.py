"""The same words, read as captures of several boards and data sets by the programs that their makers publish, here in NumPy.

Wanted are samples [frame, tx, rx, loop, sample]; each function names the program that reads so. `scripts/golden.py` writes them.
"""

import numpy as np

FRAMES, TX, RX, LOOPS, SAMPLES = 2, 3, 4, 5, 8


def split(name, array):
    """Codes are whole numbers that float32 holds."""
    return {f"{name}_re": array.real.astype(np.float32), f"{name}_im": array.imag.astype(np.float32)}


def rover(words):
    """RadarML/xwr 0.5.1, xwr/rsp/generic.py, iq_from_iiqq: of every two samples Q first."""
    words = words.reshape(FRAMES, LOOPS, TX, RX, 2 * SAMPLES)
    iq = np.zeros((FRAMES, LOOPS, TX, RX, SAMPLES), dtype=complex)
    iq[..., 0::2] = 1j * words[..., 0::4] + words[..., 2::4]
    iq[..., 1::2] = 1j * words[..., 1::4] + words[..., 3::4]
    return iq.transpose(0, 2, 3, 1, 4)


def mmmesh(words):
    """HavocFiXer/mmMesh, pc_generation.py: RawDataReader, bin2np_frame, frameReshape."""
    frames = []
    for frame in words.reshape(FRAMES, -1):
        samples = np.zeros(len(frame) // 2, dtype=complex)
        samples[0::2] = frame[0::4] + 1j * frame[2::4]
        samples[1::2] = frame[1::4] + 1j * frame[3::4]
        frames.append(samples.reshape(LOOPS, TX, RX, SAMPLES).transpose(1, 2, 0, 3))
    return np.stack(frames)


def hupr(words):
    """robert80203/HuPR-A-Benchmark…, process_iwr1843.py: getadcDataFromDCA1000, processRadarDataHoriVert, generateHeatmap."""
    lanes = words.reshape(-1, 4).T
    i, q = (np.stack(lanes[part : part + 2], axis=1).reshape(-1) for part in (0, 2))
    chirps = []
    for start in range(0, len(i), SAMPLES * RX):
        own = slice(start, start + SAMPLES * RX)
        chirps.append((i[own] + 1j * q[own]).reshape(RX, SAMPLES))
    by_rx = np.stack(chirps, axis=1)
    count = LOOPS * TX
    frames = [by_rx[:, count * frame : count * (frame + 1)] for frame in range(FRAMES)]
    # Chirp n is the transmitter n % 3 of the loop n // 3.
    return np.stack([[frame[:, tx::TX] for tx in range(TX)] for frame in frames])


def cubelearn(numbers):
    """zhaoymn/cubelearn, dataset.py, __getitem__: [frame, chirp, virtual antenna, sample], transmitters outer by its README."""
    data = numbers.reshape(2, FRAMES, LOOPS, TX * RX, SAMPLES)
    data = (data[0] + 1j * data[1]).reshape(FRAMES, LOOPS, TX, RX, SAMPLES)
    return data.transpose(0, 2, 3, 1, 4)


def coloradar_single_chip(words):
    """azinke/coloradar, core/radar.py, SCRadar.__init__: one frame a file."""
    raw = words.reshape(FRAMES, TX, RX, LOOPS, SAMPLES, 2)
    return raw[..., 0] + 1j * raw[..., 1]


def infineon(codes):
    """Infineon Radar SDK, radar.npy: [frame, rx, chirp, sample] of one transmitter, without quadrature."""
    return codes.reshape(FRAMES, 1, 3, -1, SAMPLES)


def captures():
    random = np.random.default_rng(41)
    count = FRAMES * TX * RX * LOOPS * SAMPLES
    words = random.integers(-32768, 32768, 2 * count)
    codes = random.integers(0, 4096, FRAMES * 3 * 4 * SAMPLES)
    readers = [rover, mmmesh, hupr, cubelearn, coloradar_single_chip]
    arrays = {"in_words": words, "in_codes": codes, "infineon": infineon(codes).astype(np.float32)}
    for reader in readers:
        arrays |= split(reader.__name__, reader(words))
    return arrays
