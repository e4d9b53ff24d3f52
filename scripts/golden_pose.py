"""Prints src/body/golden.rs: a body of shared data, shaped and posed by NumPy alone.

    python scripts/golden_pose.py ../shared/bodies/neutral_lite.npz > src/body/golden.rs

SMPL as its paper writes it: template + shape blend, joints, pose blend, kinematic chain, linear blend skinning. It
shares nothing with the Rust code; it does not prove what both might have misread in the paper.
"""

import sys

import numpy as np


def rodrigues(axis_angle):
    angle = np.linalg.norm(axis_angle)
    if angle == 0:
        return np.eye(3)
    x, y, z = axis_angle / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.cos(angle) * np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * np.outer([x, y, z], [x, y, z])


def pose_body(body, betas, pose):
    rest = body["v_template"] + body["shapedirs"] @ betas
    joints = body["J_regressor"] @ rest
    turns = np.stack([rodrigues(joint) for joint in pose])
    blended = rest + body["posedirs"] @ (turns[1:] - np.eye(3)).ravel()
    world = []
    for joint, parent in enumerate(body["kintree_table"][0]):
        local = np.eye(4)
        local[:3, :3] = turns[joint]
        local[:3, 3] = joints[joint] - (joints[parent] if joint else 0)
        world.append(world[parent] @ local if joint else local)
    world = np.stack(world)
    world[:, :3, 3] -= np.einsum("jab,jb->ja", world[:, :3, :3], joints)
    blend = np.einsum("vj,jab->vab", body["weights"], world)
    return rest, np.einsum("vab,vb->va", blend[:, :3, :3], blended) + blend[:, :3, 3]


def main():
    body = {key: value.astype(np.float64 if value.dtype.kind == "f" else np.int64) for key, value in np.load(sys.argv[1]).items()}
    betas = 0.3 * (np.arange(10) - 4.0)
    pose = 0.4 * np.sin(np.arange(72.0)).reshape(24, 3)
    rest, posed = pose_body(body, betas, pose)
    print("//! Written by scripts/golden_pose.py: (vertex, rest position, posed position), metres.\n")
    print("pub const NEUTRAL_LITE: [(usize, [f64; 3], [f64; 3]); 6] = [")
    for vertex in [0, 411, 2000, 3500, 5000, 6889]:
        row = lambda point: "[" + ", ".join(f"{value:.12f}" for value in point) + "]"
        print(f"    ({vertex}, {row(rest[vertex])}, {row(posed[vertex])}),")
    print("];")


if __name__ == "__main__":
    main()
