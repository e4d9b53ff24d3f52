#!/usr/bin/env python3
"""Convert an SMPL model (.pkl, as its authors give it out) to the body.npz that hybridsim reads.

    python3 scripts/smpl_to_npz.py basicmodel_m_lbs_10_207_0_v1.0.0.pkl male.npz

Needs NumPy only: neither chumpy nor SciPy nor Python 2. Nothing from the file is executed or imported: its bytes become
arrays of plain numbers, its containers lists and dictionaries, every object in it a bag of its attributes. Memory and time
are bounded by the file's size. scripts/fuzz_smpl_to_npz.py tries to break that.
"""

import argparse
import io
import math
import os
import pickle
import re
import sys
import tempfile

import numpy as np

REQUIRED = ["v_template", "shapedirs", "J_regressor", "weights", "kintree_table", "f"]
OPTIONAL = ["posedirs"]
AXES = {
    "v_template": ["vertex", 3],
    "shapedirs": ["vertex", 3, "shape"],
    "J_regressor": ["joint", "vertex"],
    "weights": ["vertex", "joint"],
    "kintree_table": [2, "joint"],
    "f": ["face", 3],
    "posedirs": ["vertex", 3, "entry"],
}

# SMPL's own files have up to 250 MB, SMPL-X's 530 MB.
LARGEST_FILE = 1 << 30
# A model pickles to a few thousand steps: its numbers lie in a few large blocks.
MOST_STEPS = 1_000_000
# One array: four times the pose blend shapes of SMPL-X, 10,475 x 3 x 486.
MOST_NUMBERS = 1 << 26
DEEPEST = 20


# --- what a pickle may build: placeholders that hold references to its own values and nothing else -------------------


class Name:
    """A class or function that the pickle names. It is never looked up."""

    __slots__ = ("module", "name")

    def __init__(self, module, name):
        self.module, self.name = module, name


class Bag:
    """Stands in for an object of whatever class; `parts` are the dictionaries of its attributes."""

    __slots__ = ("parts",)

    def __init__(self):
        self.parts = ()

    def get(self, name):
        return next((part[name] for part in reversed(self.parts) if name in part), None)

    def names(self):
        return sorted({str(name)[:30] for part in self.parts for name in list(part)[:20]})


class DType:
    """NumPy's type; `plain` only if it is one of numbers, without fields and without objects."""

    __slots__ = ("plain",)

    def __init__(self, text):
        match = re.fullmatch(r"([<>|=]?)([biufc])(\d{1,2})", text) if isinstance(text, str) else None
        known = {"b1", "i1", "i2", "i4", "i8", "u1", "u2", "u4", "u8", "f2", "f4", "f8", "c8", "c16"}
        name = match and match[2] + match[3]
        self.plain = np.dtype((match[1].replace("|", "=") or "<") + name) if name in known else None

    def set_state(self, state):
        # (version, byte order, subarray, names, fields, size, alignment, flags): numbers have none of the inner ones
        if not isinstance(state, tuple) or len(state) < 5 or any(part is not None for part in state[2:5]):
            self.plain = None
        elif self.plain is not None and state[1] in ("<", ">"):
            self.plain = self.plain.newbyteorder(state[1])


class Array:
    """NumPy's array, not made yet: its bytes are those of the file."""

    __slots__ = ("shape", "dtype", "fortran", "data")

    def __init__(self):
        self.shape = self.dtype = self.fortran = self.data = None

    def set_state(self, state):
        if not isinstance(state, tuple) or len(state) not in (4, 5):
            raise pickle.UnpicklingError("an array whose state is no tuple of four or five")
        self.shape, self.dtype, self.fortran, self.data = state[-4:]

    def make(self):
        """The numbers, copied out of the file's bytes. The number of bytes must be that of the shape."""
        shape, dtype, data = self.shape, self.dtype, self.data
        if not isinstance(dtype, DType) or dtype.plain is None:
            raise ValueError("is an array of something else than plain numbers")
        if not isinstance(data, (str, bytes)) or not is_shape(shape):
            raise ValueError("is an array without its bytes or its shape")
        count = math.prod(shape)
        if count > MOST_NUMBERS:
            raise ValueError(f"has {count} numbers, expected at most {MOST_NUMBERS}")
        if len(data) != count * dtype.plain.itemsize:
            raise ValueError(f"has {len(data)} bytes, expected {count * dtype.plain.itemsize} for its shape {shape}")
        data = data.encode("latin1") if isinstance(data, str) else data
        flat = np.frombuffer(data, dtype.plain, count) if count else np.zeros(0, dtype.plain)
        return flat.reshape(shape, order="F" if self.fortran is True or self.fortran == 1 else "C").copy()


def is_shape(shape):
    return isinstance(shape, tuple) and len(shape) <= 8 and all(type(n) is int and 0 <= n <= MOST_NUMBERS for n in shape)


def construct(function, arguments):
    """What calling a name gives. Numbers of NumPy and a few containers are known, everything else is a bag."""
    if not isinstance(function, Name):
        raise pickle.UnpicklingError("a call of something that is no name")
    known = CALLS.get((function.module, function.name))
    return known(*arguments) if known else Bag()


def reconstruct_array(cls, shape, dtype):
    return Array()


def array_from_buffer(data, dtype, shape, order):
    array = Array()
    array.set_state((shape, dtype, order == "F", data))
    return array


def array_scalar(dtype, data):
    array = Array()
    array.set_state(((), dtype, False, data))
    return array


def encode(text, encoding="latin1"):
    """How Python 3 writes bytes into old pickles. The text stays one, with a letter for each byte: see Array.make."""
    if encoding != "latin1" or not isinstance(text, str):
        raise pickle.UnpicklingError("bytes in another encoding than latin1")
    return text


CALLS = {
    ("numpy", "dtype"): lambda text, align=False, copy=True: DType(text),
    ("_codecs", "encode"): encode,
    ("collections", "OrderedDict"): lambda: {},
    ("builtins", "dict"): lambda: {},
    ("__builtin__", "dict"): lambda: {},
}
for module in ["numpy.core.multiarray", "numpy._core.multiarray"]:
    CALLS[module, "_reconstruct"] = reconstruct_array
    CALLS[module, "scalar"] = array_scalar
for module in ["numpy.core.numeric", "numpy._core.numeric"]:
    CALLS[module, "_frombuffer"] = array_from_buffer


class Unpickler(pickle._Unpickler):
    """The unpickler of the standard library that is written in Python, with every step replaced that calls, imports,
    sets attributes, allocates by a number of the file, or hashes what may be nested."""

    def __init__(self, file):
        # Python 2 wrote text and bytes alike; latin1 keeps every byte.
        super().__init__(file, encoding="latin1")
        self.steps = 0

    def find_class(self, module, name):
        return Name(module, name)

    def load_reduce(self):
        arguments = self.stack.pop()
        if not isinstance(arguments, tuple):
            raise pickle.UnpicklingError("a call without a tuple of arguments")
        self.stack[-1] = construct(self.stack[-1], arguments)

    def load_object(self, cls):
        self.append(construct(cls, ()))

    def load_newobj(self):
        self.stack.pop()
        self.load_object(self.stack.pop())

    def load_newobj_ex(self):
        self.stack.pop()
        self.load_newobj()

    def load_inst(self):
        module, name = (self.readline()[:-1].decode("ascii") for _ in range(2))
        self.pop_mark()
        self.load_object(Name(module, name))

    def load_obj(self):
        self.load_object(self.pop_mark()[0])

    def load_build(self):
        state = self.stack.pop()
        instance = self.stack[-1]
        if isinstance(instance, (Array, DType)):
            instance.set_state(state)
        elif isinstance(instance, Bag):
            # Some classes pickle a dict, some a tuple of dicts (the second for slots).
            parts = state if isinstance(state, tuple) else (state,)
            instance.parts = tuple(part for part in parts[:2] if isinstance(part, dict))
        elif not isinstance(instance, dict):
            raise pickle.UnpicklingError("attributes for something that has none")

    def load_setitem(self):
        value, key = self.stack.pop(), self.stack.pop()
        self.set_items([key, value])

    def load_setitems(self):
        self.set_items(self.pop_mark())

    def load_dict(self):
        items = self.pop_mark()
        self.append({})
        self.set_items(items)

    def set_items(self, items):
        target = self.stack[-1]
        # Ordered dictionaries of other classes are bags: what they hold is not needed.
        if isinstance(target, dict):
            for key, value in zip(items[::2], items[1::2], strict=True):
                # A tuple of tuples of tuples … takes for ever to hash.
                if not isinstance(key, (str, bytes, int, float)):
                    raise pickle.UnpicklingError("a dictionary whose keys are no names")
                target[key] = value
        elif not isinstance(target, Bag):
            raise pickle.UnpicklingError("entries for something that is no dictionary")

    def load_append(self):
        value = self.stack.pop()
        self.extend([value])

    def load_appends(self):
        self.extend(self.pop_mark())

    def extend(self, values):
        target = self.stack[-1]
        if isinstance(target, list):
            target.extend(values)
        elif not isinstance(target, Bag):
            raise pickle.UnpicklingError("entries for something that is no list")

    def load_bytearray8(self):
        # Bytes are all that is needed of them, and reading gives no more than there are.
        self.load_binbytes8()

    def allowed(name):
        """The step of this name; how many there were is counted."""

        def step(self):
            self.steps += 1
            if self.steps > MOST_STEPS:
                raise pickle.UnpicklingError(f"more than {MOST_STEPS} steps, which no SMPL model needs")
            getattr(self, name)()

        return step

    # Left out: sets, extension codes, persistent ids, buffers outside the file.
    STEPS = """
        proto frame mark stop pop pop_mark dup none false true int binint binint1 binint2 long long1 long4 float binfloat
        string binstring short_binstring binbytes short_binbytes binbytes8 unicode binunicode short_binunicode binunicode8
        tuple empty_tuple tuple1 tuple2 tuple3 list empty_list dict empty_dict append appends setitem setitems
        get binget long_binget put binput long_binput memoize global stack_global
        reduce newobj newobj_ex inst obj build bytearray8
    """
    CODES = {"false": "NEWFALSE", "true": "NEWTRUE", "empty_dict": "EMPTY_DICT", "pop_mark": "POP_MARK"}
    dispatch = {}
    for name in STEPS.split():
        code = getattr(pickle, CODES.get(name, name.upper()))
        handler = {"empty_dict": "load_empty_dictionary", "pop_mark": "load_pop_mark"}.get(name, f"load_{name}")
        dispatch[code[0]] = allowed(handler)
    del name, code, handler, allowed


# --- from placeholders to arrays ------------------------------------------------------------------------------------


def to_array(value, depth=0):
    """The numbers in an array, a chumpy variable or a sparse matrix."""
    if depth > DEEPEST:
        raise ValueError("is nested too deeply")
    if isinstance(value, Array):
        return value.make()
    if isinstance(value, Bag):
        if value.get("indptr") is not None:
            return dense(value, depth)
        if value.get("idxs") is not None and value.get("a") is not None:  # chumpy.reordering.Select
            return select(value, depth)
        if value.get("x") is not None:  # chumpy.ch.Ch
            return to_array(value.get("x"), depth + 1)
        raise ValueError(f"holds none of the known kinds of numbers, but {', '.join(value.names()) or 'nothing'}")
    if type(value) in (int, float, list, tuple):
        return np.asarray(value if type(value) in (int, float) else plain_list(value, depth))
    raise ValueError(f"is a {type(value).__name__}, expected numbers")


def plain_list(values, depth):
    """A list of numbers, or of such lists; lists that share their parts can stand for more than any memory holds."""
    left = [MOST_NUMBERS // 16]

    def copy(values, depth):
        left[0] -= len(values)
        if left[0] < 0 or depth > DEEPEST:
            raise ValueError("is a list of too many numbers")
        return [value if type(value) in (int, float) else copy(value, depth + 1) for value in check(values)]

    def check(values):
        if not all(type(value) in (int, float, list, tuple) for value in values):
            raise ValueError("is a list of something else than numbers")
        return values

    return copy(values, depth)


def indices(value, depth, below):
    """Whole numbers in 0 … below."""
    array = to_array(value, depth + 1).ravel()
    if array.dtype.kind not in "iu" or (array.size and not (0 <= array.min() and array.max() < below)):
        raise ValueError(f"has indices that are not in 0 to {below - 1}")
    return array.astype(np.int64)


def select(value, depth):
    from_array = to_array(value.get("a"), depth + 1).ravel()
    picked = from_array[indices(value.get("idxs"), depth, from_array.size)]
    shape = value.get("preferred_shape")
    if shape is None:
        return picked
    if not is_shape(shape) or math.prod(shape) != picked.size:
        raise ValueError(f"has {picked.size} chosen numbers of another shape")
    return picked.reshape(shape)


def dense(matrix, depth):
    """A compressed sparse matrix (by columns, as SMPL has it) as a full one."""
    shape = matrix.get("_shape") if matrix.get("_shape") is not None else matrix.get("shape")
    shape = tuple(shape) if isinstance(shape, list) else shape
    if not is_shape(shape) or len(shape) != 2 or math.prod(shape) > MOST_NUMBERS:
        raise ValueError(f"is a sparse matrix without two lengths of together at most {MOST_NUMBERS} numbers")
    rows, columns = shape
    data = to_array(matrix.get("data"), depth + 1).ravel()
    starts = indices(matrix.get("indptr"), depth, data.size + 1)
    if len(starts) not in (columns + 1, rows + 1):
        raise ValueError(f"is a sparse matrix of {rows} x {columns} with {len(starts)} starts")
    by_columns = len(starts) == columns + 1
    places = indices(matrix.get("indices"), depth, rows if by_columns else columns)
    if starts[0] != 0 or starts[-1] != data.size or places.size != data.size or (np.diff(starts) < 0).any():
        raise ValueError("is a sparse matrix whose starts do not fit its numbers")
    lines = np.repeat(np.arange(len(starts) - 1), np.diff(starts))
    full = np.zeros(shape, data.dtype)
    np.add.at(full, (places, lines) if by_columns else (lines, places), data)
    return full


def whole(key, array):
    """Indices, which some write as floats."""
    if array.dtype.kind == "f" and not (np.isfinite(array).all() and (array == np.round(array)).all() and (abs(array) < 2**53).all()):
        raise ValueError(f"`{key}` holds numbers that are not whole")
    return array.astype(np.int64)


def check_shapes(body):
    lengths = {}
    for key, array in body.items():
        axes = AXES[key]
        fits = array.ndim == len(axes) and all(
            (lengths.setdefault(axis, length) if isinstance(axis, str) else axis) == length
            for axis, length in zip(axes, array.shape)
        )
        if not fits:
            raise ValueError(f"`{key}` is of shape {array.shape}, expected [{', '.join(map(str, axes))}] with {lengths}")


def load(path):
    """The pickle's top, as placeholders."""
    if os.path.exists(path) and not os.path.isfile(path):
        raise ValueError("is no regular file")
    with open(path, "rb") as file:
        size = os.fstat(file.fileno()).st_size
        if size > LARGEST_FILE:
            raise ValueError(f"has {size} bytes, expected at most {LARGEST_FILE}")
        data = file.read(size)
    try:
        return Unpickler(io.BytesIO(data)).load()
    except (pickle.UnpicklingError, EOFError) as error:
        raise ValueError(f"is not a whole pickle of a model: {str(error)[:200] or 'it ends too early'}") from None
    except Exception as error:  # whatever a damaged pickle makes the steps do
        raise ValueError(f"is no pickle of a model, or is damaged ({type(error).__name__})") from None


def read_model(path):
    model = load(path)
    if isinstance(model, Bag):
        model = {key: value for part in model.parts for key, value in part.items()}
    if not isinstance(model, dict):
        raise ValueError(f"holds a {type(model).__name__}, expected SMPL's dictionary")
    missing = [key for key in REQUIRED if key not in model]
    if missing:
        names = ", ".join(sorted(str(key)[:30] for key in list(model)[:50]))
        raise ValueError(f"lacks {', '.join(missing)}; it has {names or 'nothing'}")
    body = {}
    for key in REQUIRED + [key for key in OPTIONAL if key in model]:
        try:
            body[key] = to_array(model[key])
        except (ValueError, OverflowError) as error:
            raise ValueError(f"`{key}` {str(error)[:300]}") from error
        if body[key].dtype.kind not in "iuf":
            raise ValueError(f"`{key}` holds {body[key].dtype}, expected numbers")
    check_shapes(body)
    tree = whole("kintree_table", body["kintree_table"])
    tree[0, tree[0] == 2**32 - 1] = -1  # the root's "none" as an unsigned number
    body["kintree_table"] = tree
    whole("f", body["f"])
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
    except (OSError, ValueError) as error:
        sys.exit(f"error: {arguments.model}: {error}")
    except MemoryError:
        sys.exit(f"error: {arguments.model}: needs more memory than there is")
    vertices, _, betas = body["shapedirs"].shape
    joints = body["kintree_table"].shape[1]
    print(f"{arguments.body}: {vertices} vertices, {joints} joints, {betas} shape parameters")


if __name__ == "__main__":
    main()
