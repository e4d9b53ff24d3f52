from __future__ import annotations

import os
import pickle
import subprocess
import sys
from pathlib import Path

import pytest

import hybridsim

ROOT = Path(__file__).resolve().parents[2]


def test_a_missing_recording_is_a_missing_file(tmp_path: Path) -> None:
    with pytest.raises(hybridsim.MissingFileError) as caught:
        hybridsim.read(tmp_path / "nothing")
    error = caught.value
    assert isinstance(error, (hybridsim.Error, OSError)) and isinstance(error, FileNotFoundError)
    assert str(error).startswith(f"{tmp_path}/nothing/recording.toml: cannot be read")
    assert error.filename == f"{tmp_path}/nothing/recording.toml"
    assert error.hint is not None and error.__notes__ == [f"hint: {error.hint}"]
    assert str(pickle.loads(pickle.dumps(error))) == str(error)


def test_a_setting_is_refused_in_the_words_of_the_program(config: Path, tmp_path: Path) -> None:
    with pytest.raises(hybridsim.Error) as caught:
        hybridsim.train(config, out=tmp_path / "run", set={"training.learning_rat": 1.0}, progress=False)
    assert "unknown key `training.learning_rat`" in str(caught.value)
    assert "learning_rate" in str(caught.value)
    assert caught.value.hint == "remove the key or correct its name"
    assert not (tmp_path / "run").exists()


def test_the_program_and_the_module_say_the_same(recording: hybridsim.Recording, tmp_path: Path) -> None:
    program = os.environ.get("HYBRIDSIM_PROGRAM", str(ROOT / "target" / "release" / "hybridsim"))
    if not Path(program).is_file():
        pytest.skip("needs the program: cargo build --release")
    text = (recording.folder / "recording.toml").read_text()
    (tmp_path / "recording.toml").write_text(text.replace("frames = 5", "frames = 6"))
    (tmp_path / "if.npy").write_bytes((recording.folder / "if.npy").read_bytes())
    said = subprocess.run([program, "check", str(tmp_path)], capture_output=True, text=True, check=False)
    with pytest.raises(hybridsim.Error) as caught:
        hybridsim.read(tmp_path)
    lines = [f"error: {caught.value}"] + ([f"hint: {caught.value.hint}"] if caught.value.hint else [])
    assert said.returncode == 2 and said.stderr.splitlines() == lines


def test_a_folder_that_holds_something_is_not_written_into(config: Path, tmp_path: Path) -> None:
    (tmp_path / "mine").write_text("")
    with pytest.raises(hybridsim.Error, match="exists already and is not an empty folder"):
        hybridsim.record(config, tmp_path, progress=False)
    assert os.listdir(tmp_path) == ["mine"]


def test_an_import_of_nothing_known_is_refused(tmp_path: Path) -> None:
    (tmp_path / "capture.wav").write_bytes(b"")
    with pytest.raises(hybridsim.Error, match="a capture of type `wav`"):
        hybridsim.import_(tmp_path / "capture.wav", tmp_path / "out", progress=False)
    with pytest.raises(hybridsim.Error, match="--layout"):
        hybridsim.import_(tmp_path / "capture.npy", tmp_path / "out", layout="sideways", progress=False)


def test_import_hybridsim_brings_no_torch() -> None:
    code = "import sys, hybridsim; assert 'torch' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)
