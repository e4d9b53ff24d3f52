"""Golden arrays for tests/parity, from the formulas alone: NumPy in f64, seeded, sharing no code with the crate.

    python scripts/golden.py            writes tests/golden/*.npz
    python scripts/golden.py --check    fails when those files differ from what would be written, also src/body/golden.rs
                                        where ../shared or $HYBRIDSIM_SHARED has the body that it is made from

Every array is named; what is an input of a formula starts with `in_`. Axes as in the crate: frame, tx, rx, loop, sample;
point, xyz; after the transforms doppler, range. Slow loops are welcome here: they are hard to get wrong in the same way.
"""

import os
import re
import subprocess
import sys
from pathlib import Path

import numpy as np

from golden_captures import captures
from golden_equations import equations

FOLDER = Path(__file__).resolve().parent.parent / "tests" / "golden"
C = 299792458.0


def split(name, array):
    return {f"{name}_re": array.real, f"{name}_im": array.imag}


# --- heatmaps, loss -------------------------------------------------------------------------------------------------


def hann(length):
    """Periodic, with sum 1."""
    window = np.array([np.sin(np.pi * n / length) ** 2 for n in range(length)])
    return window / window.sum()


def range_doppler(signal, real=False):
    """[…, loop, sample] -> […, doppler, range]; zero Doppler at row loops // 2."""
    loops, samples = signal.shape[-2:]
    spectrum = np.fft.fft(signal * hann(samples), axis=-1)
    if real:
        spectrum = 2 * spectrum[..., : (samples + 1) // 2]
    return np.fft.fftshift(np.fft.fft(spectrum * hann(loops)[:, None], axis=-2), axes=-2)


def to_db(power, floor):
    return 10 * np.log10(power + floor**2)


# 77 GHz, two transmitters and two receivers, lengths that are no powers of two; also written in tests/parity
RADAR = dict(f0=77e9, slope=60e12, rate=4e6, adc_start=6e-6, chirp_period=80e-6, frame_period=0.05)
TX = np.array([[0.0, 0.0, 0.0], [0.0038, 0.0, 0.0]])
RX = np.array([[0.0, 0.0, 0.0], [0.0019, 0.0, 0.0]])
CARRIER = RADAR["f0"] + RADAR["slope"] * RADAR["adc_start"]


def heatmap():
    random = np.random.default_rng(1)
    shape = (2, 2, 2, 15, 18)
    complex_noise = lambda: random.normal(size=shape) + 1j * random.normal(size=shape)
    # something strong that stands still, and noise
    still = 5 * np.exp(2j * np.pi * 3.4 * np.arange(18) / 18)
    round_to_f32 = lambda x: x.astype(np.complex64).astype(complex)
    signal, simulated = round_to_f32(complex_noise() + still), round_to_f32(complex_noise() + 0.5 * still)
    maps = range_doppler(signal)
    loops = signal - signal.mean(axis=3, keepdims=True)
    frames = signal - signal.mean(axis=(0, 3), keepdims=True)
    mean_power = lambda x: (np.abs(x) ** 2).mean(axis=(1, 2))

    peak = np.abs(maps).max()
    floor = peak * 10 ** (-60 / 20)
    level = 20 * np.log10(peak) - 25
    each = lambda x: to_db(np.abs(range_doppler(x)) ** 2, floor)
    mean = lambda x: to_db(mean_power(range_doppler(x)), floor)
    without = lambda x: x - x.mean(axis=3, keepdims=True)
    clamped = lambda x: np.maximum(each(x), level)
    loss = lambda of: np.array([((of(simulated) - of(signal)) ** 2).mean()])

    # beams at 0° elevation, each Doppler bin freed from what it turns between the transmitters
    degrees = np.arange(-60, 61, 10.0)
    wavelength = C / (CARRIER + 0.5 * RADAR["slope"] * 18 / RADAR["rate"])
    beams = np.zeros((len(degrees), 18))
    for index, degree in enumerate(degrees):
        direction = np.array([np.sin(np.radians(degree)), np.cos(np.radians(degree)), 0])
        for doppler in range(15):
            beam = 0
            for tx in range(2):
                for rx in range(2):
                    turns = (TX[tx] + RX[rx]) @ direction / wavelength - (doppler - 7) / 15 * tx / 2
                    beam = beam + maps[0, tx, rx, doppler] * np.exp(2j * np.pi * turns) / 4
            beams[index] += np.abs(beam) ** 2

    return {
        **split("in_signal", signal.astype(np.complex64)),
        **split("in_simulated", simulated.astype(np.complex64)),
        **split("map", maps[0]),
        **split("real_map", range_doppler(signal[0].real, real=True)),
        "power": mean_power(maps),
        "power_without_loop_mean": mean_power(range_doppler(loops)),
        "power_without_frame_mean": mean_power(range_doppler(frames)),
        "velocity_mps": (np.arange(15) - 7) / 15 * wavelength / 2 / (2 * RADAR["chirp_period"]),
        "range_m": np.arange(18) * RADAR["rate"] / 18 * C / 2 / RADAR["slope"],
        "in_azimuth_deg": degrees,
        "azimuth_power": beams,
        "peak_amplitude": np.array([peak]),
        "loss_each": loss(each),
        "loss_mean": loss(mean),
        "loss_clamped": loss(clamped),
        "loss_without_static": loss(lambda x: each(without(x))),
    }


# --- metrics --------------------------------------------------------------------------------------------------------


def ssim_map(a, b):
    """Wang et al. 2004, window by window."""
    offsets = np.arange(-5, 6)
    window = np.exp(-(offsets[:, None] ** 2 + offsets[None] ** 2) / (2 * 1.5**2))
    window /= window.sum()
    rows, columns = a.shape
    result = np.zeros((rows - 10, columns - 10))
    for row in range(rows - 10):
        for column in range(columns - 10):
            x, y = (image[row : row + 11, column : column + 11] for image in (a, b))
            mx, my = (window * x).sum(), (window * y).sum()
            vx, vy = (window * (x - mx) ** 2).sum(), (window * (y - my) ** 2).sum()
            cov = (window * (x - mx) * (y - my)).sum()
            result[row, column] = ((2 * mx * my + 1e-4) * (2 * cov + 9e-4)) / ((mx**2 + my**2 + 1e-4) * (vx + vy + 9e-4))
    return result


def metrics():
    random = np.random.default_rng(2)
    measured = -70 + 60 * random.random((22, 27)) ** 3
    simulated = measured + 6 * random.normal(size=measured.shape)
    low, high = -65.0, -5.0
    image = lambda db: np.clip((db - low) / (high - low), 0, 1)
    a, b = image(measured), image(simulated)
    mask = measured > -40
    similarity = ssim_map(a, b)
    return {
        "in_measured_db": measured,
        "in_simulated_db": simulated,
        "in_window_db": np.array([low, high]),
        "in_mask": mask.astype(np.uint8),
        "psnr_db": np.array([-10 * np.log10(((a - b) ** 2).mean())]),
        "ssim": np.array([similarity.mean()]),
        "mean_absolute_error_db": np.array([np.abs(measured - simulated).mean()]),
        "masked_psnr_db": np.array([-10 * np.log10(((a - b)[mask] ** 2).mean())]),
        "masked_ssim": np.array([similarity[mask[5:-5, 5:-5]].mean()]),
        "masked_mean_absolute_error_db": np.array([np.abs(measured - simulated)[mask].mean()]),
    }


# --- paths and sums -------------------------------------------------------------------------------------------------


def length(a, b):
    return np.sqrt(((a - b) ** 2).sum(axis=-1))


def moving_points(random, points, chirps):
    """Positions in the middle of the sampling window of every chirp of transmitter 0, and their velocities."""
    start = np.array([0.3, 3.0, -0.2]) + random.uniform(-0.6, 0.6, size=(points, 3))
    velocity = random.uniform(-1.5, 1.5, size=(points, 3))
    times = np.arange(chirps) * 2 * RADAR["chirp_period"]
    return start[:, None] + velocity[:, None] * (times - times.mean())[None, :, None], velocity


def direct():
    """Eq. 1 and 2, sample by sample; also with the residual video phase and the motion within a chirp."""
    random = np.random.default_rng(3)
    points, chirps, samples = 30, 11, 20
    position, velocity = moving_points(random, points, chirps)
    amplitude = random.normal(size=(points, chirps))
    paper = np.zeros((2, chirps, samples), complex)
    exact = np.zeros_like(paper)
    for rx in range(2):
        for n in range(samples):
            t = n / RADAR["rate"]
            first, second = length(position, TX[0]), length(position, RX[rx])
            delay = (first + second) / C
            spreading = amplitude / (first * second)
            paper[rx, :, n] = (spreading * np.exp(2j * np.pi * (CARRIER * delay + RADAR["slope"] * t * delay))).sum(0)
            moved = position + velocity[:, None] * (t - 0.5 * samples / RADAR["rate"])
            delay = (length(moved, TX[0]) + length(moved, RX[rx])) / C
            phase = CARRIER * delay + RADAR["slope"] * (t * delay - 0.5 * delay**2)
            exact[rx, :, n] = (spreading * np.exp(2j * np.pi * phase)).sum(0)
    return {
        "in_position_m": position,
        "in_amplitude": amplitude,
        **split("paper", paper),
        **split("exact", exact),
    }


def indirect():
    """Eq. 3 for two wall receivers, `paper` `[wall, rx, chirp, sample]`."""
    random = np.random.default_rng(4)
    points, chirps, samples = 25, 9, 20
    position, _ = moving_points(random, points, chirps)
    proxies = np.array([[-1.9, 2.1, 0.3], [0.4, 3.2, -1.1]])
    amplitude = random.normal(size=(2, points, chirps))
    paper = np.zeros((2, 2, chirps, samples), complex)
    for wall in range(2):
        for rx in range(2):
            first, second = length(position, TX[0]), length(position, proxies[wall])
            third = length(proxies[wall], RX[rx])
            delay = (first + second + third) / C
            for n in range(samples):
                phase = CARRIER * delay + RADAR["slope"] * n / RADAR["rate"] * delay
                terms = amplitude[wall] * np.exp(2j * np.pi * phase) / (first * second * third)
                paper[wall, rx, :, n] = terms.sum(0)
    return {
        "in_position_m": position,
        "in_proxy_m": proxies,
        "in_amplitude": amplitude,
        **split("paper", paper),
    }


# --- surface --------------------------------------------------------------------------------------------------------


def reflection(n, cosine):
    """Amplitude reflection (s, p) from air onto n = eta − jk (time as exp(+jωt)), from Maxwell's boundary conditions.

    For each polarisation the tangential fields of incoming, reflected and transmitted plane wave are matched by solving
    the 2 × 2 system, rather than by quoting the formulas. s follows E, p follows H: at normal incidence s = −p.
    """
    sine = np.sqrt(1 - cosine**2)
    inside = np.sqrt(1 - (sine / n) ** 2 + 0j)
    # s: E continuous, H tangential continuous:  1 + r = t,  cosine (1 − r) = n inside t
    s = np.linalg.solve([[1, -1], [-cosine, -n * inside]], [-1, -cosine])[0]
    # p: H continuous, E tangential continuous:  1 + r = n t,  cosine (1 − r) = inside t
    p = np.linalg.solve([[1, -n], [-cosine, -inside]], [-1, -cosine])[0]
    return s, p


def fresnel():
    eta = np.array([1.0, 1.5, 2.6, 3.0, 6.0, 1.2])
    k = np.array([0.0, 0.0, 0.8, 2.5, 7.0, 0.05])
    cosines = np.array([1.0, 0.9, 0.7, 0.5, 0.3, 0.1, 0.01])
    pairs = np.array([[reflection(n, cosine) for cosine in cosines] for n in eta - 1j * k])
    s, p = pairs[..., 0], pairs[..., 1]
    return {
        "in_eta": eta,
        "in_k": k,
        "in_cosine": cosines,
        **split("s", s),
        **split("p", p),
        "power_s": np.abs(s) ** 2,
        "power_p": np.abs(p) ** 2,
    }


def microfacet():
    """Trowbridge-Reitz distribution and Smith shadowing in tangent-free form, from slopes.

    D is built from the slope distribution of an ellipsoid (P22 / cos⁴), and Smith's G1 by integrating the projected
    visible area numerically, so that neither is the closed form quoted back. alpha is the slope roughness itself.
    """
    random = np.random.default_rng(5)
    count = 24
    unit = lambda x: x / np.linalg.norm(x, axis=-1, keepdims=True)
    hemisphere = lambda: unit(np.column_stack([random.uniform(-1, 1, (count, 2)), random.uniform(0.1, 1.2, count)]))
    incident, outgoing = hemisphere(), hemisphere()
    alpha = random.uniform(0.15, 0.9, count)
    half = unit(incident + outgoing)
    tangent2 = (half[:, 0] ** 2 + half[:, 1] ** 2) / half[:, 2] ** 2
    slopes = 1 / (np.pi * alpha**2 * (1 + tangent2 / alpha**2) ** 2)
    distribution = slopes / half[:, 2] ** 4

    def one_direction(direction, alpha):
        # G1 = cos θ / ∫ max(ω·m, 0) D(m) dm: over the slopes s along the direction, the other one integrated out, which
        # leaves α² / (2 (α² + s²)^1.5); with s = α tan φ, up to where the slope turns away
        sine, cosine = np.sqrt(1 - direction[2] ** 2), direction[2]
        nodes, weights = np.polynomial.legendre.leggauss(60)
        first, last = -np.pi / 2, np.arctan2(cosine, alpha * sine)
        angle = first + (last - first) * (nodes + 1) / 2
        slope = alpha * np.tan(angle)
        marginal = alpha**2 / (2 * (alpha**2 + slope**2) ** 1.5) * alpha / np.cos(angle) ** 2
        projected = (cosine - slope * sine) * marginal
        return cosine / ((projected * weights).sum() * (last - first) / 2)

    shadow_in = np.array([one_direction(*pair) for pair in zip(incident, alpha)])
    shadow_out = np.array([one_direction(*pair) for pair in zip(outgoing, alpha)])
    auxiliary = lambda g: 1 / g - 1
    correlated = 1 / (1 + auxiliary(shadow_in) + auxiliary(shadow_out))

    eta, k = random.uniform(1.2, 6, count), random.uniform(0, 4, count)
    weight, metallic = random.uniform(0, 1, count), random.uniform(0, 0.5, count)
    cosine_half = (incident * half).sum(-1)
    pairs = np.array([reflection(n, cosine) for n, cosine in zip(eta - 1j * k, cosine_half)])
    power = weight * np.abs(pairs[:, 0]) ** 2 + (1 - weight) * np.abs(pairs[:, 1]) ** 2
    # a metal reflects all
    power = metallic + (1 - metallic) * power
    return {
        "in_incident": incident,
        "in_outgoing": outgoing,
        "in_alpha": alpha,
        "distribution": distribution,
        "shadow_in": shadow_in,
        "shadow_out": shadow_out,
        "shadow_separable": shadow_in * shadow_out,
        "shadow_correlated": correlated,
        "cosine_half": cosine_half,
        "in_eta": eta,
        "in_k": k,
        "in_weight_s": weight,
        "in_metallic": metallic,
        "reflected_power": power,
        "amplitude": distribution * correlated * power / (4 * incident[:, 2] * outgoing[:, 2]),
    }


# --- what is learned ------------------------------------------------------------------------------------------------


def triplane():
    """Bilinear samples of the planes xy, yz, zx: rows along the second named axis, columns along the first."""
    random = np.random.default_rng(6)
    resolution, features, points = 6, 3, 20
    texels = random.normal(size=(3, resolution, resolution, features))
    low, high = np.array([-0.5, -0.9, -0.2]), np.array([0.5, 0.9, 0.3])
    position = random.uniform(low - 0.1, high + 0.1, size=(points, 3))
    fraction = np.clip((position - low) / (high - low), 0, 1)
    result = np.zeros((points, 3, features))
    for point in range(points):
        for plane, (across, along) in enumerate([(0, 1), (1, 2), (2, 0)]):
            x, y = fraction[point, across] * (resolution - 1), fraction[point, along] * (resolution - 1)
            for row in range(resolution):
                for column in range(resolution):
                    # a tent around every texel
                    weight = max(0, 1 - abs(x - column)) * max(0, 1 - abs(y - row))
                    result[point, plane] += weight * texels[plane, row, column]
    return {
        "in_texels": texels.reshape(3 * resolution * resolution, features),
        "in_low_m": low,
        "in_high_m": high,
        "in_position_m": position,
        "concatenated": result.reshape(points, 3 * features),
        "summed": result.sum(1),
    }


def encoding():
    """γ: the coordinates, then all sines, then all cosines, octave after octave."""
    position = np.random.default_rng(7).uniform(-1, 1, size=(10, 3))
    phases = [2.0**octave * np.pi * position for octave in range(5)]
    columns = [position] + [np.sin(phase) for phase in phases] + [np.cos(phase) for phase in phases]
    return {"in_position": position, "encoded": np.concatenate(columns, axis=1)}


def harmonics():
    """Real spherical harmonics up to degree 3, (l, m) with m from −l to l, from associated Legendre functions without the
    Condon-Shortley phase. Gaussian splatting's have it: theirs are these times (−1)^m.
    """
    random = np.random.default_rng(8)
    direction = random.normal(size=(30, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    x, y, z = direction.T
    azimuth = np.arctan2(y, x)
    factorial = lambda n: float(np.prod(np.arange(1, n + 1))) if n > 0 else 1.0

    def legendre(degree, order):
        # P_l^m = (1 − z²)^(m/2) d^m/dz^m P_l, P_l from Rodrigues' formula
        polynomial = np.polynomial.Polynomial([-1, 0, 1]) ** degree
        polynomial = polynomial.deriv(degree + order) / (2**degree * factorial(degree))
        return (1 - z**2) ** (order / 2) * polynomial(z)

    columns = []
    for degree in range(4):
        for order in range(-degree, degree + 1):
            m = abs(order)
            norm = np.sqrt((2 * degree + 1) / (4 * np.pi) * factorial(degree - m) / factorial(degree + m))
            if order == 0:
                columns.append(norm * legendre(degree, 0))
            else:
                wave = np.cos(m * azimuth) if order > 0 else np.sin(m * azimuth)
                columns.append(np.sqrt(2) * norm * legendre(degree, m) * wave)
    return {"in_direction": direction, "basis": np.stack(columns, axis=1)}


# --- body -----------------------------------------------------------------------------------------------------------


def skinning():
    """Linear blend skinning with shape and pose blend shapes (SMPL), by 4 × 4 matrices; a body of 4 joints."""
    random = np.random.default_rng(9)
    vertices, joints, shapes, poses = 14, 4, 2, 3
    parents = np.array([-1, 0, 1, 1])
    template = random.uniform(-1, 1, (vertices, 3))
    shape_directions = 0.1 * random.normal(size=(vertices, 3, shapes))
    pose_directions = 0.02 * random.normal(size=(vertices, 3, 9 * (joints - 1)))
    rows = lambda shape: (lambda x: x / x.sum(1, keepdims=True))(random.random(shape))
    regressor, weights = rows((joints, vertices)), rows((vertices, joints))
    betas = np.array([0.7, -1.3])
    pose = random.normal(size=(poses, joints, 3))
    pose[0] = 0
    translation = random.normal(size=(poses, 3))

    def rotation(vector):
        # the exponential of the cross product matrix, as a series
        x, y, z = vector
        cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
        total, term = np.eye(3), np.eye(3)
        for n in range(1, 40):
            term = term @ cross / n
            total = total + term
        return total

    shaped = template + shape_directions @ betas
    rest = regressor @ shaped
    posed = np.zeros((poses, vertices, 3))
    for index in range(poses):
        rotations = [rotation(vector) for vector in pose[index]]
        feature = np.concatenate([(r - np.eye(3)).ravel() for r in rotations[1:]])
        blended = shaped + pose_directions @ feature
        world = []
        for joint in range(joints):
            local = np.eye(4)
            local[:3, :3] = rotations[joint]
            local[:3, 3] = rest[joint] - (rest[parents[joint]] if joint else 0)
            world.append(local if joint == 0 else world[parents[joint]] @ local)
        for vertex in range(vertices):
            for joint in range(joints):
                from_rest = np.eye(4)
                from_rest[:3, 3] = -rest[joint]
                moved = world[joint] @ from_rest @ np.append(blended[vertex], 1)
                posed[index, vertex] += weights[vertex, joint] * moved[:3]
        posed[index] += translation[index]
    return {
        "in_template": template,
        "in_shape_directions": shape_directions,
        "in_pose_directions": pose_directions,
        "in_joint_regressor": regressor,
        "in_weights": weights,
        "in_parents": parents,
        "in_betas": betas,
        "in_pose": pose,
        "in_translation": translation,
        "rest_joints": rest,
        "posed": posed,
    }


TOPICS = [heatmap, metrics, direct, indirect, fresnel, microfacet, triplane, encoding, harmonics, skinning, equations, captures]


def differs(stored, made):
    """What two arrays of one golden differ in. Another NumPy may order sums differently: 1e-9 of the largest value."""
    if stored.shape != made.shape or stored.dtype != made.dtype:
        return f"is {stored.dtype} {stored.shape}, expected {made.dtype} {made.shape}"
    if made.size == 0:
        return None
    error = np.abs(stored.astype(complex) - made).max() / max(np.abs(made).max(), np.finfo(float).tiny)
    return None if error <= 1e-9 else f"differs by {error:.1e} of its largest value"


def check_topic(path, arrays):
    """One line for every array that is not what the formulas give."""
    if not path.exists():
        return [f"{path.name}: is missing"]
    stored = dict(np.load(path))
    rows = [f"{path.name}: {name} is {word}" for names, word in [(arrays.keys() - stored.keys(), "missing"), (stored.keys() - arrays.keys(), "of no formula")] for name in sorted(names)]
    both = [(name, differs(stored[name], np.asarray(arrays[name]))) for name in arrays if name in stored]
    return rows + [f"{path.name}: {name} {difference}" for name, difference in both if difference]


def check_pose():
    """src/body/golden.rs, from the shared body; None where that is absent."""
    root = FOLDER.parent.parent
    body = Path(os.environ.get("HYBRIDSIM_SHARED", root.parent / "shared")) / "bodies" / "neutral_lite.npz"
    if not body.exists():
        return None
    printed = subprocess.run([sys.executable, root / "scripts" / "golden_pose.py", body], capture_output=True, check=True, text=True).stdout
    numbers = lambda text: np.array([float(number) for number in re.findall(r"-?\d+\.?\d*", text.split("=", 1)[1])])
    stored = numbers((root / "src" / "body" / "golden.rs").read_text())
    made = numbers(printed)
    # Printed with twelve decimals.
    same = stored.shape == made.shape and np.abs(stored - made).max() <= 2e-12
    return [] if same else ["src/body/golden.rs: differs from scripts/golden_pose.py"]


def main():
    check = "--check" in sys.argv[1:]
    FOLDER.mkdir(parents=True, exist_ok=True)
    wrong = []
    for topic in TOPICS:
        path, arrays = FOLDER / f"{topic.__name__}.npz", topic()
        if not check:
            # zip entries carry a fixed date: equal numbers make equal files
            np.savez(path, **arrays)
            continue
        wrong += check_topic(path, arrays)
    if not check:
        return
    known = {f"{topic.__name__}.npz" for topic in TOPICS}
    wrong += [f"{path.name}: is of no topic" for path in sorted(FOLDER.iterdir()) if path.name not in known]
    pose = check_pose()
    wrong += pose or []
    if wrong:
        sys.exit("goldens differ from scripts/golden.py:\n" + "\n".join(wrong))
    print(f"{len(TOPICS)} goldens are those of their formulas" + (", skipped: src/body/golden.rs needs shared material" if pose is None else ", and src/body/golden.rs"))


if __name__ == "__main__":
    main()
