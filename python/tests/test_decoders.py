"""Captures of TI's boards against decoders of others: what mmwcore, OpenRadar and xwr made of files that `export` wrote.

`scripts/export_oracles.py --freeze` ran them, of the versions that `goldens/decoders.npz` names, and kept files and arrays: none of them is
needed here.
"""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import hybridsim

BOARDS = {"two_lanes": "AWR1843BOOST", "four_lanes": "IWR1443BOOST"}


@pytest.fixture(scope="module")
def golden() -> dict[str, NDArray[Any]]:
    with np.load(Path(__file__).parent / "goldens" / "decoders.npz") as archive:
        return dict(archive)


@pytest.fixture(scope="module")
def codes(golden: dict[str, NDArray[Any]], tmp_path_factory: pytest.TempPathFactory) -> hybridsim.Recording:
    """A recording of the golden's codes."""
    folder = tmp_path_factory.mktemp("codes")
    np.save(folder / "codes.npy", golden["codes"])
    (folder / "radar.toml").write_text(str(golden["radar"]))
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", hybridsim.Note)
        return hybridsim.import_(
            folder / "codes.npy",
            folder / "codes",
            config=folder / "radar.toml",
            layout="frame tx rx loop sample iq",
            as_stated=True,
            progress=False,
        )


@pytest.mark.filterwarnings("ignore::hybridsim.Note")
@pytest.mark.parametrize("lanes", BOARDS)
def test_a_capture_is_what_others_decode(
    lanes: str, golden: dict[str, NDArray[Any]], codes: hybridsim.Recording, tmp_path: Path
) -> None:
    out = hybridsim.export(codes, "dca1000", tmp_path / "out", board=BOARDS[lanes], progress=False)
    assert np.array_equal(np.fromfile(out / "codes_Raw_0.bin", dtype="<i2"), golden[lanes])
    back = hybridsim.import_(
        out / "codes_Raw_0.bin",
        tmp_path / "back",
        config=next(out.glob("*.mmwave.json")),
        board=BOARDS[lanes],
        as_stated=True,
        progress=False,
    )
    # [frame, loop, tx, rx, sample, iq]: loop after loop, transmitters in firing order.
    by_chirp = back.raw().transpose(0, 3, 1, 2, 4, 5)
    decoders = [name for name in golden if name.startswith(f"{lanes}_by_")]
    assert len(decoders) == {"two_lanes": 2, "four_lanes": 1}[lanes]
    for decoder in decoders:
        assert np.array_equal(by_chirp.reshape(golden[decoder].shape), golden[decoder]), decoder
    assert np.allclose(back.radar.rx_m, codes.radar.rx_m, atol=1e-5)


@pytest.mark.filterwarnings("ignore::hybridsim.Note")
def test_a_trace_is_what_xwr_reads(
    golden: dict[str, NDArray[Any]], codes: hybridsim.Recording, tmp_path: Path
) -> None:
    out = hybridsim.export(codes, "rover", tmp_path / "out", progress=False)
    assert np.array_equal(np.fromfile(out / "codes" / "radar" / "iq", dtype="<i2"), golden["rover"])
    back = hybridsim.import_(out / "codes", tmp_path / "back", as_stated=True, progress=False)
    assert np.array_equal(back.raw().transpose(0, 3, 1, 2, 4, 5), golden["rover_by_xwr"])
