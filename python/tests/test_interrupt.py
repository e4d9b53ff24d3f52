"""Ctrl-C, and watchers that raise: the work ends, and nothing half-written stays."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import textwrap
import threading
import time
from pathlib import Path

import pytest

import hybridsim


def interrupted(code: str, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    """Runs a script that says `ready` when it is at work, and sends it Ctrl-C then."""
    script = textwrap.dedent(code)
    process = subprocess.Popen(
        [sys.executable, "-c", script],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        # A shell starts what it puts into the background with Ctrl-C ignored, and so would this be.
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )
    assert process.stdout is not None
    assert process.stdout.readline().strip() == "ready"
    process.send_signal(signal.SIGINT)
    out, err = process.communicate(timeout=120)
    return subprocess.CompletedProcess(process.args, process.returncode, out, err)


def left(folder: Path) -> list[str]:
    return sorted(name for name in os.listdir(folder))


def test_ctrl_c_while_recording_leaves_nothing(config: Path, tmp_path: Path) -> None:
    code = f"""
        import sys, hybridsim
        def watch(now):
            if now.done == 1:
                print("ready", flush=True)
        try:
            hybridsim.record({str(config)!r}, "out", set={{"record.frames": 100}}, progress=watch)
        except KeyboardInterrupt:
            print("interrupted")
    """
    done = interrupted(code, tmp_path)
    assert done.stdout == "interrupted\n" and done.returncode == 0, done.stderr
    assert left(tmp_path) == []


def test_ctrl_c_while_training_keeps_whole_epochs(config: Path, tmp_path: Path) -> None:
    code = f"""
        import hybridsim
        def watch(now):
            if now.epoch and now.epoch["epoch"] == 1:
                print("ready", flush=True)
        try:
            hybridsim.train({str(config)!r}, out="run", set={{"training.epochs": 5000}}, device="flex", progress=watch)
        except KeyboardInterrupt:
            print("interrupted")
    """
    done = interrupted(code, tmp_path)
    assert done.stdout == "interrupted\n" and done.returncode == 0, done.stderr
    assert not [name for name in left(tmp_path / "run") if name.startswith(".")]
    assert {"best", "config.toml", "last"} <= set(left(tmp_path / "run"))
    assert "epochs = 5000" in (tmp_path / "run" / "config.toml").read_text()


def test_a_watcher_that_raises_ends_the_work(config: Path, tmp_path: Path) -> None:
    def watch(now: hybridsim.Progress) -> None:
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        hybridsim.record(config, tmp_path / "out", set={"record.frames": 500}, progress=watch)
    deadline = time.monotonic() + 60
    while os.listdir(tmp_path) and time.monotonic() < deadline:
        time.sleep(0.05)
    assert os.listdir(tmp_path) == []


def test_other_threads_run_meanwhile(config: Path, tmp_path: Path) -> None:
    counted, done = [0], threading.Event()

    def count() -> None:
        while not done.is_set():
            counted[0] += 1
            time.sleep(0.001)

    thread = threading.Thread(target=count)
    thread.start()
    hybridsim.record(config, tmp_path / "out", progress=False)
    done.set()
    thread.join()
    assert counted[0] > 5
