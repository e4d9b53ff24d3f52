#!/usr/bin/env python3
"""Convert an SMPL model (.pkl, as its authors give it out) to the body.npz that hybridsim reads.

    python3 scripts/smpl_to_npz.py basicmodel_m_lbs_10_207_0_v1.0.0.pkl male.npz

Needs NumPy only: neither chumpy nor SciPy nor Python 2. Nothing from the file is executed: it may build NumPy
arrays and plain containers, every other class in it becomes a bag of its attributes.
"""

import argparse
import os
import pickle
import sys
import tempfile

import numpy as np

REQUIRED = ["v_template", "shapedirs", "J_regressor", "weights", "kintree_table", "f"]
OPTIONAL = ["posedirs"]


class Bag:
    """Stands in for a class that is not installed; keeps the attributes."""

    def __init__(self, *arguments, **named):
        self.arguments = arguments
        self.__dict__.update(named)

    def __setstate__(self, state):
        # Some classes pickle a dict, some a tuple of dicts (the second for slots).
        for part in state if isinstance(state, tuple) else (state,):
            if isinstance(part, dict):
                self.__dict__.update(part)


def reconstruct_object(cls, base, state):
    """copyreg's constructor of old-style pickles, for bags only."""
    if cls is not Bag:
        raise pickle.UnpicklingError(f"the file wants to build a {cls}, which no SMPL model needs")
    return Bag()


def reconstruct_array(cls, shape, dtype):
    return np.ndarray.__new__(np.ndarray, shape, dtype)


def array_scalar(dtype, data):
    return np.frombuffer(data.encode("latin1") if isinstance(data, str) else data, dtype=dtype)[0]


def encode(text, encoding="latin1"):
    """How Python 3 writes bytes into old pickles."""
    if encoding != "latin1":
        raise pickle.UnpicklingError(f"bytes written as {encoding}")
    return text.encode("latin1")


SAFE = {
    ("numpy", "ndarray"): np.ndarray,
    ("numpy", "dtype"): np.dtype,
    ("_codecs", "encode"): encode,
    ("copyreg", "_reconstructor"): reconstruct_object,
    ("copy_reg", "_reconstructor"): reconstruct_object,
    ("collections", "OrderedDict"): dict,
}
for module in ["builtins", "__builtin__"]:
    for builtin in [set, frozenset, list, tuple, dict, object, int, float, complex, bool, str, bytes, slice]:
        SAFE[module, builtin.__name__] = builtin
for module in ["numpy.core.multiarray", "numpy._core.multiarray"]:
    SAFE[module, "_reconstruct"] = reconstruct_array
    SAFE[module, "scalar"] = array_scalar


class Unpickler(pickle.Unpickler):
    def find_class(self, module, name):
        return SAFE.get((module, name), Bag)


def to_array(value):
    """The numbers in an array, a chumpy variable or a sparse matrix."""
    if isinstance(value, Bag):
        if hasattr(value, "indptr"):
            return dense(value)
        if hasattr(value, "idxs") and hasattr(value, "a"):  # chumpy.reordering.Select
            picked = to_array(value.a).ravel()[np.asarray(value.idxs)]
            return picked.reshape(getattr(value, "preferred_shape", picked.shape))
        if hasattr(value, "x"):  # chumpy.ch.Ch
            return to_array(value.x)
        raise ValueError(f"holds none of the known kinds of numbers, but {sorted(vars(value))}")
    return np.asarray(value)


def dense(matrix):
    """A compressed sparse matrix (by columns, as SMPL has it) as a full one."""
    rows, columns = getattr(matrix, "_shape", None) or matrix.shape
    indptr, indices, data = (to_array(getattr(matrix, part)) for part in ["indptr", "indices", "data"])
    full = np.zeros((rows, columns), data.dtype)
    if len(indptr) not in (columns + 1, rows + 1):
        raise ValueError(f"is a sparse matrix of {rows} x {columns} with {len(indptr)} starts")
    by_columns = len(indptr) == columns + 1
    for line in range(len(indptr) - 1):
        part = slice(indptr[line], indptr[line + 1])
        if by_columns:
            np.add.at(full[:, line], indices[part], data[part])
        else:
            np.add.at(full[line], indices[part], data[part])
    return full


def read_model(path):
    with open(path, "rb") as file:
        # Python 2 wrote text and bytes alike; latin1 keeps every byte.
        model = Unpickler(file, encoding="latin1").load()
    if isinstance(model, Bag):
        model = vars(model)
    if not isinstance(model, dict):
        raise ValueError(f"holds a {type(model).__name__}, expected SMPL's dictionary")
    missing = [key for key in REQUIRED if key not in model]
    if missing:
        raise ValueError(f"lacks {', '.join(missing)}; it has {', '.join(map(str, sorted(model, key=str)))}")
    body = {}
    for key in REQUIRED + [key for key in OPTIONAL if key in model]:
        try:
            body[key] = to_array(model[key])
        except ValueError as error:
            raise ValueError(f"`{key}` {error}") from error
        if body[key].dtype.kind not in "iuf":
            raise ValueError(f"`{key}` holds {body[key].dtype}, expected numbers")
    tree = body["kintree_table"].astype(np.int64)
    tree[0, tree[0] == 2**32 - 1] = -1  # the root's "none" as an unsigned number
    body["kintree_table"] = tree
    return body


def write_body(path, body):
    """Whole or not at all."""
    handle, temporary = tempfile.mkstemp(suffix=".npz", prefix=".partial-", dir=os.path.dirname(path) or ".")
    try:
        with os.fdopen(handle, "wb") as file:
            np.savez_compressed(file, **body)
        umask = os.umask(0)
        os.umask(umask)
        os.chmod(temporary, 0o666 & ~umask)
        os.replace(temporary, path)
    except BaseException:
        os.unlink(temporary)
        raise


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", help="SMPL model, .pkl")
    parser.add_argument("body", help="file to write, .npz")
    parser.add_argument("--betas", type=int, metavar="N", help="keep the first N shape parameters [default: all]")
    arguments = parser.parse_args()
    try:
        body = read_model(arguments.model)
        body["shapedirs"] = body["shapedirs"][:, :, : arguments.betas]
        write_body(arguments.body, body)
    except (OSError, ValueError, pickle.UnpicklingError, EOFError) as error:
        sys.exit(f"error: {arguments.model}: {error}")
    vertices, _, betas = body["shapedirs"].shape
    joints = body["kintree_table"].shape[1]
    print(f"{arguments.body}: {vertices} vertices, {joints} joints, {betas} shape parameters")


if __name__ == "__main__":
    main()
