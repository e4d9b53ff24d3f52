"""Units on two worker processes, one of which is killed while it is at one: what comes out is what one process makes, byte for byte."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest

import hybridsim
from hybridsim import _hybridsim

from conftest import SITE

distributed = pytest.importorskip("distributed")

PATIENCE_S = 60.0
FRAMES = {"record.frames": 12}
CASES = {"cases": 3}
DIAGNOSIS: dict[str, Any] = {"diagnosis.epochs": 0, "diagnosis.limits": False}


@contextmanager
def workers(deaths: int = 3) -> Iterator[Any]:
    """Two, of one thread each; a unit may survive so many deaths of workers."""
    import dask

    with (
        dask.config.set({"distributed.scheduler.allowed-failures": deaths}),
        distributed.LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster,
        distributed.Client(cluster) as client,
    ):
        yield client


def killed(folder: Path, undone: Callable[[int], bool], lock: str) -> int:
    """Kills a worker while it holds a unit of a folder, and the unit is not done; its process' number."""
    deadline = time.monotonic() + PATIENCE_S
    while time.monotonic() < deadline:
        for held in folder.glob(lock):
            pid = holder(held)
            if pid is None or pid == os.getpid():
                continue
            # Of a process that stands still it can be told what it is at.
            os.kill(pid, signal.SIGSTOP)
            number = int(held.name.split("-")[1]) if held.name.startswith(".part-") else 1
            if holder(held) == pid and undone(number):
                os.kill(pid, signal.SIGKILL)
                return pid
            os.kill(pid, signal.SIGCONT)
        time.sleep(0.005)
    raise AssertionError(f"no worker was busy in {folder}")


def holder(lock: Path) -> int | None:
    """Who works where a lock lies, once the number is written: a signal to 0 would be one to these tests."""
    try:
        return int(lock.read_text())
    except (OSError, ValueError):
        return None


@contextmanager
def a_death(client: Any, folder: Path, undone: Callable[[int], bool], lock: str = ".part-*.hybridsim-lock") -> Iterator[None]:
    """Meanwhile, one of the workers is killed at a unit that it does not finish."""
    with ThreadPoolExecutor(1) as other:
        death = other.submit(killed, folder, undone, lock)
        yield
        dead = death.result()
    assert dead not in client.run(os.getpid).values()


def tree(folder: Path, without: tuple[str, ...] = ()) -> dict[str, bytes]:
    """Every file below a folder, hidden ones too, whose name it may hold."""
    files = (path for path in sorted(folder.rglob("*")) if path.is_file() and path.name not in without)
    return {str(path.relative_to(folder)): path.read_bytes().replace(bytes(folder), b"") for path in files}


def same(a: Path, b: Path, without: tuple[str, ...] = ()) -> None:
    one, other = tree(a, without), tree(b, without)
    assert sorted(one) == sorted(other)
    assert [name for name in one if one[name] != other[name]] == []


@pytest.fixture(scope="module")
def site_config(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("config") / "site.toml"
    path.write_text(SITE)
    return path


@pytest.fixture(scope="module")
def one_machine(site_config: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    out = tmp_path_factory.mktemp("one") / "site"
    hybridsim.site(site_config, out, set={**FRAMES, "again": ["s3"]}, progress=False)
    return out


def recordings_missing(config: Path, out: Path) -> Callable[[int], bool]:
    folders = _hybridsim.site_look(str(config), str(out), [], False, lambda *_: None)
    return lambda number: not folders[number - 1].exists()


def test_a_site_survives_a_worker(site_config: Path, one_machine: Path, tmp_path: Path) -> None:
    settings = {**FRAMES, "again": ["s3"]}
    with workers() as client:
        with a_death(client, tmp_path / "site", recordings_missing(site_config, tmp_path / "site")):
            made = hybridsim.distributed.site(client, site_config, tmp_path / "site", set=settings)
        assert [recording.folder.name for recording in made] == sorted(os.listdir(tmp_path / "site" / "recordings"))
        threads = client.run(lambda: os.environ.get("RAYON_NUM_THREADS")).values()
        assert "1" in threads and set(threads) <= {"1", None}
    same(one_machine, tmp_path / "site")


def test_without_a_retry_a_death_is_the_end(site_config: Path, tmp_path: Path) -> None:
    with workers(deaths=0) as client:
        with a_death(client, tmp_path / "site", recordings_missing(site_config, tmp_path / "site")):
            with pytest.raises(distributed.KilledWorker):
                hybridsim.distributed.site(client, site_config, tmp_path / "site", set=FRAMES)
    # What was done is whole.
    for folder in (tmp_path / "site" / "recordings").glob("[!.]*"):
        assert len(hybridsim.read(folder)) == 12


def test_who_is_taken_for_dead_is_waited_for(site_config: Path, one_machine: Path, tmp_path: Path) -> None:
    settings: dict[str, Any] = {**FRAMES, "again": ["s3"]}
    code = f"import hybridsim; hybridsim.site({str(site_config)!r}, 'site', shard=(1, 6), set={settings!r}, progress=False)"
    held = tmp_path / "site" / ".part-1-of-6.hybridsim-lock"
    with subprocess.Popen([sys.executable, "-c", code], cwd=tmp_path) as lost, workers() as client:
        deadline = time.monotonic() + PATIENCE_S
        while holder(held) != lost.pid and time.monotonic() < deadline:
            time.sleep(0.005)
        os.kill(lost.pid, signal.SIGSTOP)
        try:
            with pytest.raises(hybridsim.BusyError, match=f"number {lost.pid}, works here") as refused:
                hybridsim.site(site_config, tmp_path / "site", shard=(1, 6), set=settings, progress=False)
            assert refused.value.hint is not None
            with ThreadPoolExecutor(1) as other:
                made = other.submit(hybridsim.distributed.site, client, site_config, tmp_path / "site", set=settings)
                time.sleep(2)
                assert not made.done()
                os.kill(lost.pid, signal.SIGCONT)
                assert len(made.result()) == 6
        finally:
            os.kill(lost.pid, signal.SIGCONT)
    same(one_machine, tmp_path / "site")


def test_a_challenge_survives_workers(tmp_path: Path) -> None:
    config = Path(__file__).parents[2] / "configs" / "challenge_smoke.toml"
    one, many = tmp_path / "one", tmp_path / "many"
    commitment = hybridsim.challenge.seal(config, one / "challenge", seed="a test", set=CASES, progress=False)
    answers = hybridsim.challenge.run(one / "challenge", one / "answers", set=DIAGNOSIS, device="flex", progress=False)
    assert commitment is not None and sorted(answers["reports"]) == sorted(commitment["leaves"]) and answers["complete"]
    score = hybridsim.challenge.score(one / "challenge", one / "answers", out=one / "score", progress=False)

    names = sorted(commitment["leaves"])
    truths = {name: json.loads((one / "challenge" / "sealed" / f"{name}.json").read_text())["truth"] for name in names}
    by_index = sorted(names, key=lambda name: truths[name]["index"])
    unsealed = lambda number: not (many / f"challenge/sealed/{by_index[number - 1]}.json").exists()  # noqa: E731
    unanswered = lambda number: not (many / "answers" / names[number - 1]).exists()  # noqa: E731
    # One dies while cases are sealed, one while they are answered.
    with workers() as client, a_death(client, many / "challenge", unsealed), a_death(client, many / "answers", unanswered):
        scored = hybridsim.distributed.challenge(
            client, config, many, seed="a test", set=CASES, diagnosis=DIAGNOSIS, device="flex"
        )
    assert scored == score
    same(one, many)


REPRODUCTION = """
seed = 2
variants = ["ours"]
baselines = ["mmgpe"]
protocols = []
other_mesh = false
site = "site.toml"
split = { training = "s1", unseen = "s3" }

[simulator.room]
patches = 60

[simulator.triplane]
resolution = 8
features = 2

[simulator.decoders.network]
hidden = [8]

[training]
epochs = 1
"""
TIMES = ("stage.json", "speed.json", "results.md", "results.json")


def test_a_reproduction_survives_a_worker(tmp_path: Path) -> None:
    (tmp_path / "site.toml").write_text(SITE)
    config, one, many = tmp_path / "all.toml", tmp_path / "one", tmp_path / "many"
    config.write_text(REPRODUCTION)
    whole = hybridsim.reproduce(config, one, device="flex", progress=False)
    assert whole is not None
    listed = hybridsim.stages(config, many, device="flex", progress=False)
    assert [stage.pieces for stage in listed if stage.folder.startswith("site-")] == [6]
    assert all(stage.seconds is None for stage in listed)
    with pytest.raises(hybridsim.Error, match="which is not done"):
        hybridsim.reproduce(config, many, stage=listed[-1].folder, device="flex", progress=False)
    with workers() as client:
        undone = lambda _: not list((many / "stages").glob("train/*"))  # noqa: E731
        with a_death(client, many, undone, lock=".stage-*.hybridsim-lock"):
            made = hybridsim.distributed.reproduce(client, config, many, device="flex")
    same(one, many, TIMES)
    assert [method["cross"] for method in made["methods"]] == [method["cross"] for method in whole["methods"]]
    # Nothing is left to do, and the same call says so.
    assert all(stage.seconds is not None for stage in hybridsim.stages(config, many, device="flex", progress=False))


def test_a_sweep_survives_a_worker(config: Path, recording: hybridsim.Recording, tmp_path: Path) -> None:
    shared: dict[str, Any] = {"data.recordings": [str(recording.folder)], "training.epochs": 40}
    one = hybridsim.train(config, out=tmp_path / "one", set=shared, device="flex", progress=False)
    swept = {str(tmp_path / name): {**shared, "training.learning_rate": rate} for name, rate in (("a", 2e-2), ("b", 5e-3))}
    folder = tmp_path / "a"
    with workers() as client:
        begun = lambda _: (folder / "last").exists() and not (folder / "report.md").exists()  # noqa: E731
        with a_death(client, folder, begun, lock=".hybridsim-lock"):
            runs = hybridsim.distributed.sweep(client, hybridsim.train, swept, str(config), device="flex")
    assert list(runs) == list(swept) and [len(run.history) for run in runs.values()] == [40, 40]
    again = hybridsim.train(config, out=tmp_path / "again", set=swept[str(folder)], device="flex", progress=False)
    same(again.last, runs[str(folder)].last)
    assert tree(one.last) != tree(again.last)
    # Of other settings it is another run.
    with pytest.raises(hybridsim.Error, match="config.toml: `training.learning_rate` is 0.02, expected 0.01"):
        hybridsim.train(config, out=folder, go_on=True, set=shared, device="flex", progress=False)
