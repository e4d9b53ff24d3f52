"""Eq. 2 and 3 of the paper end to end, for scripts/golden.py: from materials, patches and geometry to IF samples.

A body of twelve vertices turns and walks within one frame before three walls. For every chirp, transmitter, receiver and
scatterer: where the scatterer is, how it is turned, L_p or SH_{p,k} there and then, the delay, the phasor. The visible sets
are given. Formulas in other forms than the crate's, where there are others: Fresnel's from the field amplitudes, Smith's from
Lambda, the aperture from the patch's covariance, spherical harmonics from angles.
"""

import numpy as np

C = 299792458.0

# as in tests/parity/equations.rs
F0, SLOPE, RATE, ADC_START, CHIRP_PERIOD = 77e9, 60e12, 4e6, 6e-6, 2e-3
LOOPS, SAMPLES = 6, 10
# far apart, so that every pair of antennas sees other angles
TX = np.array([[-0.4, 0.0, 0.0], [0.3, 0.0, 0.2]])
RX = np.array([[0.0, 0.1, 0.0], [0.5, 0.0, -0.1], [-0.1, 0.0, 0.3]])
CARRIER = F0 + SLOPE * ADC_START
WAVELENGTH = C / (CARRIER + 0.5 * SLOPE * SAMPLES / RATE)
# distances of the walls that there are; the others are open, OPEN metres away
LEFT, FRONT, FLOOR, OPEN, SPACING = 1.9, 4.2, 1.1, 2.0, 1.0
# the two poses of the motion, seconds
POSES_S = np.array([-0.01, 0.05])


def unit(x):
    return x / np.linalg.norm(x, axis=-1, keepdims=True)


def icosahedron():
    """Vertices and faces, counter-clockwise from outside."""
    golden = (1 + 5**0.5) / 2
    corners = np.array([(0, s, t * golden) for s in (-1, 1) for t in (-1, 1)])
    vertices = unit(np.concatenate([np.roll(corners, shift, axis=1) for shift in range(3)]).astype(float))
    side = min(np.linalg.norm(vertices[0] - other) for other in vertices[1:])
    near = lambda a, b: np.linalg.norm(vertices[a] - vertices[b]) < 1.01 * side
    faces = []
    for a in range(12):
        for b in range(a + 1, 12):
            for c in range(b + 1, 12):
                if near(a, b) and near(b, c) and near(a, c):
                    outward = np.dot(np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a]), vertices[a]) > 0
                    faces.append((a, b, c) if outward else (a, c, b))
    assert len(faces) == 20
    return vertices, np.array(faces)


def turn(axis, angle):
    x, y, z = unit(np.array(axis, float))
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross


def normals_of(vertices, faces):
    """Of the facets around a vertex, weighted by area."""
    sums = np.zeros_like(vertices)
    for a, b, c in faces:
        facet = np.cross(vertices[b] - vertices[a], vertices[c] - vertices[a])
        for vertex in (a, b, c):
            sums[vertex] += facet
    return unit(sums)


def walls():
    """Centres of the patches, their inward normals and walls, and every wall's virtual receiver in its centre."""
    low, high = np.array([-LEFT, -OPEN, -FLOOR]), np.array([OPEN, FRONT, OPEN])
    patches, normals, owner, proxies = [], [], [], []
    for wall, (axis, level, inward) in enumerate([(0, -LEFT, 1), (1, FRONT, -1), (2, -FLOOR, 1)]):
        first, second = (axis + 1) % 3, (axis + 2) % 3
        size = high - low
        counts = [max(1, int(np.floor(size[a] / SPACING + 0.5))) for a in (first, second)]
        for i in range(counts[0]):
            for j in range(counts[1]):
                patch = np.zeros(3)
                patch[axis] = level
                patch[first] = low[first] + size[first] * (i + 0.5) / counts[0]
                patch[second] = low[second] + size[second] * (j + 0.5) / counts[1]
                patches.append(patch)
                normals.append(inward * np.eye(3)[axis])
                owner.append(wall)
        centre = 0.5 * (low + high)
        centre[axis] = level
        proxies.append(centre)
    return np.array(patches), np.array(normals), np.array(owner), np.array(proxies)


def materials(random, count):
    """alpha, metallic, eta, k, weight of s."""
    ranges = [(0.2, 0.8), (0.0, 0.4), (1.5, 4.0), (0.1, 2.0), (0.0, 1.0)]
    return np.column_stack([random.uniform(low, high, count) for low, high in ranges])


def microfacet(material, normal, incident, outgoing):
    """L_p = f_r = D G F / (4 |n·i| |n·o|): Trowbridge-Reitz, height-correlated Smith, Fresnel's powers mixed by w."""
    alpha, metallic, eta, k, weight = material
    cosines = np.array([normal @ incident, normal @ outgoing])
    if (cosines <= 0).any():
        return 0.0
    half = unit(incident + outgoing)
    cosine = normal @ half
    tangent2 = 1 / cosine**2 - 1
    distribution = 1 / (np.pi * alpha**2 * cosine**4 * (1 + tangent2 / alpha**2) ** 2)
    slope2 = 1 / cosines**2 - 1
    shadowing = 1 / (1 + 0.5 * (np.sqrt(1 + alpha**2 * slope2) - 1).sum())
    index, c = eta - 1j * k, incident @ half
    inside = np.sqrt(1 - (1 - c**2) / index**2)
    s = (c - index * inside) / (c + index * inside)
    p = (index * c - inside) / (index * c + inside)
    power = weight * abs(s) ** 2 + (1 - weight) * abs(p) ** 2
    power = metallic + (1 - metallic) * power
    return distribution * shadowing * power / (4 * cosines[0] * cosines[1])


def harmonics(direction):
    """Real, orthonormal, degrees 0 to 2, orders from −l to l, without the Condon-Shortley phase; from polar angles."""
    polar, azimuth = np.arccos(np.clip(direction[2], -1, 1)), np.arctan2(direction[1], direction[0])
    sine, cosine = np.sin(polar), np.cos(polar)
    root = lambda numerator, denominator: np.sqrt(numerator / (denominator * np.pi))
    return np.array(
        [
            root(1, 4),
            root(3, 4) * sine * np.sin(azimuth),
            root(3, 4) * cosine,
            root(3, 4) * sine * np.cos(azimuth),
            root(15, 16) * sine**2 * np.sin(2 * azimuth),
            root(15, 4) * sine * cosine * np.sin(azimuth),
            root(5, 16) * (3 * cosine**2 - 1),
            root(15, 4) * sine * cosine * np.cos(azimuth),
            root(15, 16) * sine**2 * np.cos(2 * azimuth),
        ]
    )


def patch(lobes, reflectance, scales, rotation, axes, incident, outgoing):
    """SH_{p,k}: lobes in the patch's frame (tangent, bitangent, normal), times the Fourier transform of its flat Gaussian."""
    tangent, bitangent, normal = axes
    turned = [np.cos(rotation) * tangent + np.sin(rotation) * bitangent, np.cos(rotation) * bitangent - np.sin(rotation) * tangent]
    covariance = sum(scale**2 * np.outer(axis, axis) for scale, axis in zip(scales, turned))
    wave = 2 * np.pi / WAVELENGTH * (incident + outgoing)
    local = np.array([axis @ outgoing for axis in axes])
    return reflectance * (lobes @ harmonics(local)) * np.exp(-0.5 * wave @ covariance @ wave)


def still_frame(normal):
    """A wall's tangents, from its normal alone (Duff et al. 2017)."""
    x, y, z = normal
    sign = 1.0 if z >= 0 else -1.0
    a = -1 / (sign + z)
    b = x * y * a
    return np.array([1 + sign * x * x * a, sign * b, -sign * x]), np.array([b, sign + y * y * a, -y]), normal


def phasor(delay, sample):
    return np.exp(2j * np.pi * (CARRIER * delay + SLOPE * sample / RATE * delay))


def equations():
    random = np.random.default_rng(12)
    ball, faces = icosahedron()
    rest = ball * [0.35, 0.25, 0.8] + 0.02 * random.normal(size=ball.shape)
    turns = [np.eye(3), turn([0.3, -0.2, 1.0], 0.9)]
    origins = [np.array([0.2, 2.3, 0.1]), np.array([0.35, 2.2, 0.12])]
    meshes = np.array([rest @ rotation.T + origin for rotation, origin in zip(turns, origins)])
    room, inward, owner, proxies = walls()
    bodies, points = len(rest), len(rest) + len(room)
    material = materials(random, points)
    offset = 0.01 * random.uniform(-1, 1, (points, 3))
    rotation = random.uniform(-3, 3, points)
    scales = random.uniform(2e-4, 1.5e-3, (points, 2))
    reflectance = random.uniform(0.1, 0.9, points)
    lobes = random.normal(size=(points, 9))
    # the canonical axis that lies flattest on the rest mesh, about its middle
    flattest = np.abs(normals_of(meshes[0], faces)).argmin(axis=1)

    def body_at(time):
        share = (time - POSES_S[0]) / (POSES_S[1] - POSES_S[0])
        blended = (1 - share) * turns[0] + share * turns[1]
        vertices = (1 - share) * meshes[0] + share * meshes[1]
        normal = normals_of(vertices, faces)
        tangent = np.array([blended[:, axis] for axis in flattest])
        tangent = unit(tangent - normal * (tangent * normal).sum(1, keepdims=True))
        return vertices, normal, tangent, offset[:bodies] @ blended.T

    # all that could be seen, and what is: some points are left out, some are turned away
    seen = [random.random(points) < 0.8 for _ in range(4)]
    for wall in range(3):
        seen[1 + wall][bodies:] &= owner != wall

    transmitters, receivers = len(TX), len(RX)
    direct = np.zeros((transmitters, receivers, LOOPS, SAMPLES), complex)
    indirect = np.zeros_like(direct)
    smallest = 1.0
    for tx in range(transmitters):
        for loop in range(LOOPS):
            time = (loop * transmitters + tx) * CHIRP_PERIOD + ADC_START + (SAMPLES // 2) / RATE
            vertices, normal, tangent, moved = body_at(time)
            position = np.concatenate([vertices, room])
            normals = np.concatenate([normal, inward])
            shifted = np.concatenate([vertices + moved, room + offset[bodies:]])
            for p in range(points):
                if seen[0][p]:
                    incident, first = unit(TX[tx] - position[p]), np.linalg.norm(TX[tx] - position[p])
                    for rx in range(receivers):
                        outgoing, second = unit(RX[rx] - position[p]), np.linalg.norm(RX[rx] - position[p])
                        smallest = min(smallest, abs(normals[p] @ incident), abs(normals[p] @ outgoing))
                        amplitude = microfacet(material[p], normals[p], incident, outgoing)
                        delay = (first + second) / C
                        for sample in range(SAMPLES):
                            direct[tx, rx, loop, sample] += amplitude * phasor(delay, sample) / (first * second)
                x = shifted[p]
                axes = (tangent[p], np.cross(normal[p], tangent[p]), normal[p]) if p < bodies else still_frame(normals[p])
                incident, first = unit(TX[tx] - x), np.linalg.norm(TX[tx] - x)
                for wall, proxy in enumerate(proxies):
                    if not seen[1 + wall][p]:
                        continue
                    outgoing, second = unit(proxy - x), np.linalg.norm(proxy - x)
                    amplitude = patch(lobes[p], reflectance[p], scales[p], rotation[p], axes, incident, outgoing)
                    for rx in range(receivers):
                        third = np.linalg.norm(RX[rx] - proxy)
                        delay = (first + second + third) / C
                        for sample in range(SAMPLES):
                            indirect[tx, rx, loop, sample] += amplitude * phasor(delay, sample) / (first * second * third)
    # nothing is so near to edge-on that f32 cannot tell its side
    assert smallest > 2e-3, smallest
    return {
        "in_mesh_m": meshes,
        "in_face": faces.astype(np.int64),
        "in_room_m": room,
        "in_proxy_m": proxies,
        "in_material": material,
        "in_offset_m": offset,
        "in_rotation_rad": rotation,
        "in_scale_m": scales,
        "in_reflectance": reflectance,
        "in_lobes": lobes,
        "in_seen": np.array(seen).astype(np.uint8),
        "direct_re": direct.real,
        "direct_im": direct.imag,
        "indirect_re": indirect.real,
        "indirect_im": indirect.imag,
    }
