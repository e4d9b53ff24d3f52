#!/usr/bin/env python3
"""Tries to break the unpickler of scripts/smpl_to_npz.py, with pickles of our own making.

    python3 scripts/fuzz_smpl_to_npz.py [MUTANTS] [SEED]

Right models in every protocol must come out as they went in. Pickles made to do harm, and seeded mutants of the right
ones, must give a clean error or a body of plain numbers in the right shapes: no code run, no attribute of ours changed,
no other exception, at most SECONDS each and MEMORY more than at the start.
"""

import copy
import importlib.util
import io
import os
import pickle
import random
import resource
import signal
import struct
import sys
import tempfile
import types
from pathlib import Path

import numpy as np

SECONDS = 5
MEMORY = 1 << 29

SCRIPT = os.environ.get("SMPL_TO_NPZ", Path(__file__).with_name("smpl_to_npz.py"))
spec = importlib.util.spec_from_file_location("smpl_to_npz", SCRIPT)
converter = importlib.util.module_from_spec(spec)
spec.loader.exec_module(converter)


# --- right models ---------------------------------------------------------------------------------------------------


def fake(module, name):
    """A class that pickles as if its library were installed."""
    cls = type(name, (), {"__module__": module, "__qualname__": name})
    sys.modules.setdefault(module, types.ModuleType(module))
    parts = module.split(".")
    for end in range(1, len(parts)):
        sys.modules.setdefault(".".join(parts[:end]), types.ModuleType(".".join(parts[:end])))
    setattr(sys.modules[module], name, cls)
    return cls


CHUMPY, SELECT, SPARSE = fake("chumpy.ch", "Ch"), fake("chumpy.reordering", "Select"), fake("scipy.sparse.csc", "csc_matrix")


def instance(cls, **attributes):
    made = cls()
    made.__dict__.update(attributes)
    return made


def body():
    numbers = np.random.default_rng(1)
    vertices, joints, shapes = 9, 3, 2
    weights = numbers.random((vertices, joints))
    return {
        "v_template": numbers.normal(size=(vertices, 3)),
        "shapedirs": numbers.normal(size=(vertices, 3, shapes)).astype(np.float32),
        "posedirs": np.asfortranarray(numbers.normal(size=(vertices, 3, 9 * (joints - 1)))),
        "J_regressor": np.eye(joints, vertices),
        "weights": weights / weights.sum(1, keepdims=True),
        "kintree_table": np.array([[2**32 - 1, 0, 1], [0, 1, 2]], np.uint32),
        "f": np.array([[0, 1, 2], [3, 4, 5]], ">u4"),
    }


def sparse(full):
    columns = [np.nonzero(column)[0] for column in full.T]
    return instance(
        SPARSE,
        _shape=full.shape,
        data=np.concatenate([full[rows, index] for index, rows in enumerate(columns)]),
        indices=np.concatenate(columns).astype(np.int32),
        indptr=np.cumsum([0] + [len(rows) for rows in columns]).astype(np.int32),
        maxprint=50,
    )


def models():
    """(name, bytes), all of one body."""
    plain = {**body(), "bs_type": "lrotmin", "names": np.array(["a", "b"]), "notes": [1, (2.5, None), {"x": True}]}
    learned = {
        **plain,
        "v_template": instance(CHUMPY, x=plain["v_template"], _depends_on_deps=set()),
        "shapedirs": instance(SELECT, a=instance(CHUMPY, x=plain["shapedirs"]), idxs=np.arange(54), preferred_shape=(9, 3, 2)),
        "J_regressor": sparse(plain["J_regressor"]),
    }
    # Sets are no part of a model that we read.
    del learned["v_template"].__dict__["_depends_on_deps"]
    for protocol in range(6):
        yield f"plain, protocol {protocol}", pickle.dumps(plain, protocol)
        yield f"chumpy, protocol {protocol}", pickle.dumps(learned, protocol)


# --- made to do harm ------------------------------------------------------------------------------------------------


def array_pickle(dtype_text, dtype_state, shape, data):
    """A model whose v_template is an array with any type, shape and bytes."""
    class Raw:
        def __reduce__(self):
            return np.core_reconstruct, (np.ndarray, (0,), b"b"), (1, shape, Type(), False, data)

    class Type:
        def __reduce__(self):
            return np.dtype, (dtype_text, False, True), dtype_state

    np.core_reconstruct = __import__("numpy._core.multiarray", fromlist=["_reconstruct"])._reconstruct
    return pickle.dumps({**body(), "v_template": Raw()}, 2)


def attacks(mark):
    """(name, bytes); whatever runs code makes the file `mark`."""
    command = f"touch {mark}"
    text = lambda value: b"X" + struct.pack("<I", len(value)) + value.encode()
    yield "system", f"cos\nsystem\n(S'{command}'\ntR.".encode()
    yield "system by INST", f"(S'{command}'\nios\nsystem\n.".encode()
    yield "system by OBJ", f"(cos\nsystem\nS'{command}'\no.".encode()
    yield "system by NEWOBJ", b"\x80\x02cposix\nsystem\n" + text(command) + b"\x85\x81."
    yield "system by STACK_GLOBAL", b"\x80\x04" + text("os") + text("system") + b"\x93" + text(command) + b"\x85R."
    yield "eval", f"c__builtin__\neval\n(S'__import__(\"os\").system(\"{command}\")'\ntR.".encode()
    yield "a name with dots", b"\x80\x04" + text("builtins") + text("dict.__init__.__globals__") + b"\x93."
    yield "an extension code", b"\x80\x02\x82\x01."
    yield "a persistent id", b"\x80\x02N\x51."
    # Objects by their addresses: a NumPy that believes this reads memory at 0x4141414141414141.
    pointers = b"\x41" * 216
    yield "objects", array_pickle("O8", (3, "|", None, None, None, -1, -1, 63), (9, 3), pointers)
    yield "objects hidden in numbers", array_pickle("f8", (3, "|", None, None, None, -1, -1, 63), (9, 3), pointers)
    fields = {"a": (np.dtype("O"), 0)}
    yield "fields of objects", array_pickle("V8", (3, "|", None, ("a",), fields, 8, 1, 63), (9, 3), pointers)
    yield "numbers with fields of objects", array_pickle("f8", (3, "<", None, ("a",), fields, 8, 1, 63), (9, 3), pointers)
    yield "subarrays", array_pickle("V8", (3, "|", (np.dtype("O"), (1,)), None, None, 8, 1, 63), (9, 3), pointers)
    yield "dates", array_pickle("M8", (4, "<", None, None, None, -1, -1, 0, ({}, (b"us", 1, 1, 1))), (9, 3), pointers)
    yield "a shape beyond the bytes", array_pickle("f8", (3, "<", None, None, None, -1, -1, 0), (9, 3_000_000), pointers)
    yield "a shape beyond everything", array_pickle("f8", (3, "<", None, None, None, -1, -1, 0), (2**62, 2**62), b"")
    yield "a negative shape", array_pickle("f8", (3, "<", None, None, None, -1, -1, 0), (-9, -3), pointers)
    yield "endless axes without numbers", array_pickle("f8", (3, "<", None, None, None, -1, -1, 0), (0, 2**60), b"")
    wide = sparse(np.eye(3, 9))
    wide._shape = (10**6, 10**6)
    yield "a sparse matrix of a terabyte", pickle.dumps({**body(), "J_regressor": wide}, 2)
    for name, change in [("indices", np.array([10**6, -5, 2], np.int32)), ("indptr", np.full(10, 10**9, np.int64))]:
        wrong = sparse(np.eye(3, 9))
        setattr(wrong, name, change)
        yield f"a sparse matrix with wrong {name}", pickle.dumps({**body(), "J_regressor": wrong}, 2)
    yield "a chosen number that is not there", pickle.dumps(
        {**body(), "v_template": instance(SELECT, a=np.zeros(3), idxs=np.array([7] * 27), preferred_shape=(9, 3))}, 2
    )
    round_and_round = instance(CHUMPY)
    round_and_round.x = round_and_round
    yield "a variable of itself", pickle.dumps({**body(), "v_template": round_and_round}, 2)
    doubled = [0.5] * 10
    for _ in range(40):
        doubled = [doubled, doubled]
    yield "a list of 2^40 numbers", pickle.dumps({**body(), "v_template": doubled}, 2)
    yield "a key that takes for ever to hash", b"\x80\x02}" + b"K\x01\x85" + b"2\x86" * 60 + b"K\x01s."
    yield "a set of the same", b"\x80\x04\x8f(" + b"K\x01\x85" + b"2\x86" * 60 + b"\x90."
    yield "two gigabytes of bytes", b"\x80\x05\x96" + struct.pack("<Q", 1 << 31) + b"."
    yield "a text of 2^60 letters", b"\x80\x04\x8d" + struct.pack("<Q", 1 << 60) + b"x."
    yield "a frame of 2^62 bytes", b"\x80\x04\x95" + struct.pack("<Q", 1 << 62) + b"N."
    yield "a memo beyond all memory", b"\x80\x02Nr\xff\xff\xff\x7f."
    yield "a number of a million digits", b"L" + b"9" * 10**6 + b"L\n."
    yield "attributes for a function", b"\x80\x02c_codecs\nencode\n}" + text("__defaults__") + b"(" + text("utf8") + b"tsb."
    yield "attributes for a class", b"\x80\x02cnumpy\nndarray\nN}" + text("make") + b"Ns\x86b."
    yield "bytes in another encoding", b"\x80\x02c_codecs\nencode\n" + text("x") + text("utf7") + b"\x86R."
    yield "ten million steps", b"\x80\x02" + b"N0" * 5_000_000 + b"N."
    # One text, a hundred thousand arrays of it: a copy for each would fill the memory.
    shared = array_pickle("f8", (3, "<", None, None, None, -1, -1, 0), (125_000,), b"\0" * 1_000_000)
    once = b"\x80\x02" + text("x" * 1_000_000) + b"q\x00(" + b"c_codecs\nencode\nh\x00\x85R" * 10_000 + b"t."
    yield "one text in ten thousand encodings", once
    yield "an array of other numbers than its model", shared
    big = b"\x80\x02}q\x00(" + b"".join(b"M" + struct.pack("<H", i) + b"N" for i in range(20_000)) + b"u0("
    yield "one dictionary for twenty thousand objects", big + b"cx\ny\n)Rh\x00b" * 20_000 + b"t."
    yield "nothing", b""
    yield "no pickle", b"PK\x03\x04"


# --- mutants --------------------------------------------------------------------------------------------------------

CODES = bytes(value[0] for name, value in vars(pickle).items() if name.isupper() and isinstance(value, bytes) and len(value) == 1)
NUMBERS = [struct.pack(kind, value) for kind in ["<B", "<H", "<i", "<q"] for value in (0, 1, 127)] + [
    b"\xff" * 2, b"\xff\xff\xff\x7f", b"\xff" * 8, struct.pack("<q", 2**62)]  # fmt: skip


def mutant(draw, parents):
    bytes_ = bytearray(draw.choice(parents))
    for _ in range(draw.choice([1, 1, 1, 2, 3, 8])):
        at = draw.randrange(len(bytes_) + 1)
        match draw.randrange(8):
            case 0 if at < len(bytes_):
                bytes_[at] ^= 1 << draw.randrange(8)
            case 1 if at < len(bytes_):
                bytes_[at] = draw.randrange(256)
            case 2:
                bytes_[at:at] = bytes([draw.choice(CODES)])
            case 3 if at < len(bytes_):
                bytes_[at] = draw.choice(CODES)
            case 4:
                number = draw.choice(NUMBERS)
                bytes_[at : at + len(number)] = number
            case 5:
                del bytes_[at : at + draw.choice([1, 2, 4, 8, 60])]
            case 6:
                other = draw.choice(parents)
                start = draw.randrange(len(other))
                bytes_[at:at] = other[start : start + draw.choice([1, 4, 20, 100])]
            case 7 if draw.random() < 0.2:
                del bytes_[at:]
    return bytes(bytes_)


# --- the judge ------------------------------------------------------------------------------------------------------


class TooSlow(BaseException):
    pass


def too_slow(*_):
    raise TooSlow


def read(path, data):
    """The body or None; anything else than a clean error is a finding."""
    path.write_bytes(data)
    signal.alarm(SECONDS)
    try:
        return converter.read_model(path)
    except (ValueError, pickle.UnpicklingError, EOFError) as error:
        if len(str(error)) > 4000:
            raise AssertionError("an endless message") from error
        return None
    finally:
        signal.alarm(0)


def check_body(found):
    lengths = {}
    for name, axes in [("v_template", "V3"), ("shapedirs", "V3B"), ("J_regressor", "JV"), ("weights", "VJ"), ("kintree_table", "2J"), ("f", "F3")]:
        array = found[name]
        assert type(array) is np.ndarray and array.dtype.kind in "iuf" and array.dtype.fields is None, f"{name}: {array.dtype}"
        assert array.ndim == len(axes), f"{name}: {array.shape}"
        for axis, length in zip(axes, array.shape):
            assert length == (int(axis) if axis.isdigit() else lengths.setdefault(axis, length)), f"{name}: {array.shape}"


def bound_memory():
    with open("/proc/self/statm") as file:
        now = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (now + MEMORY, resource.RLIM_INFINITY))


def main():
    count, seed = (int(value) for value in (sys.argv[1:] + ["3000", "1"][len(sys.argv) - 1 :])[:2])
    signal.signal(signal.SIGALRM, too_slow)
    ours = copy.copy({name: id(value) for name, value in vars(converter).items()})
    with tempfile.TemporaryDirectory() as folder:
        path, mark = Path(folder) / "model.pkl", Path(folder) / "mark"
        right = list(models())
        harmful = list(attacks(mark))
        if sys.platform == "linux":
            bound_memory()
        found = failures = 0

        def tried(name, data, wanted=None):
            nonlocal found, failures
            try:
                result = read(path, data)
                if result is not None:
                    found += 1
                    check_body(result)
                if wanted is not None:
                    assert result is not None, "a right model was refused"
                    for key, array in wanted.items():
                        array = np.where(array == 2**32 - 1, -1, array.astype(int)) if key == "kintree_table" else array
                        assert np.array_equal(result[key], array), f"{key} differs"
                assert not mark.exists(), "code was run"
                assert ours == {name: id(value) for name, value in vars(converter).items()}, "a name of ours was changed"
                assert converter.encode("x") in ("x", b"x"), "a default of ours was changed"
            except (Exception, TooSlow) as error:
                failures += 1
                if failures > 20:
                    sys.exit("too many failures")
                print(f"FAILED {name}: {type(error).__name__}: {str(error)[:200]}", file=sys.stderr)

        for name, data in right:
            tried(name, data, body())
        for name, data in harmful:
            tried(name, data)
        draw = random.Random(seed)
        parents = [data for _, data in right] + [data for _, data in harmful if 0 < len(data) < 20_000]
        for index in range(count):
            tried(f"mutant {index} of seed {seed}", mutant(draw, parents))
    print(f"{len(right)} right models, {len(harmful)} harmful ones, {count} mutants (seed {seed}): {found} read, {failures} failures")
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
