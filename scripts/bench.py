#!/usr/bin/env python3
"""Times the coherent sum beside PyTorch and FINUFFT in one run and prints one table of ratios.

    scripts/bench.py            our benchmark and the yardsticks (installs those from PyPI into target/yardsticks)
    scripts/bench.py --quick    without PyTorch, whose wheel is large

All lines also go to target/bench.jsonl. Numbers of different runs, or of a busy machine, cannot be compared.
"""
import argparse
import json
import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
YARDSTICKS = ROOT / "scripts" / "yardsticks"
PLACE = ROOT / "target" / "yardsticks"


def lines(command):
    """The JSON lines that a program prints."""
    environment = {**os.environ, "PYTHONDONTWRITEBYTECODE": "1"}
    print("$", " ".join(str(part) for part in command), file=sys.stderr)
    found = subprocess.run(command, check=True, stdout=subprocess.PIPE, text=True, cwd=ROOT, env=environment).stdout
    return [json.loads(line) for line in found.splitlines() if line.startswith("{")]


def python_with(packages):
    """A Python that has the packages, in a virtual environment of its own."""
    python = PLACE / "bin" / "python"
    if not python.exists():
        venv.create(PLACE, with_pip=True)
    for package in packages:
        if subprocess.run([python, "-c", f"import {package}"], capture_output=True).returncode:
            subprocess.run([python, "-m", "pip", "install", "--quiet", package], check=True)
    return python


def yardsticks(with_torch):
    threads = str(os.cpu_count() or 1)
    python = python_with(["numpy", "finufft"] + (["torch"] if with_torch else []))
    yield from lines([python, YARDSTICKS / "finufft_sum.py", "--threads", "1"])
    if not with_torch:
        return
    for mode in ["forward", "amplitudes", "positions"]:
        yield from lines([python, YARDSTICKS / "torch_sum.py", "--form", "split", "--mode", mode, "--threads", threads, "--runs", "1"])
        # Minutes for a frame, so on a few chirps.
        naive = ["--form", "naive", "--mode", mode, "--measured-chirps", "8", "--threads", threads, "--runs", "1"]
        yield from lines([python, YARDSTICKS / "torch_sum.py", *naive])


def table(ours, theirs):
    modes = ["forward", "amplitudes", "positions"]
    best = {line["mode"]: line for line in ours if line["form"] == "fused" and line["bench"] == "unit" and line["dechirp"] == "exact"}
    print("\n12,000 moving points, 128 chirps, 256 samples, 1 TX x 4 RX; seconds (times the fused form's)\n")
    print(f"| {'who':34} | " + " | ".join(f"{mode:>18}" for mode in modes) + " |   error |  peak |")
    print(f"|{'-' * 36}|" + "|".join(["-" * 20] * len(modes)) + "|---------|-------|")
    rows = {}
    for line in ours + theirs:
        if line["bench"] == "unit":
            dechirp = ", paper's phase" if line.get("dechirp") == "paper" else ""
            rows.setdefault(f"{line['backend']}, {line['form']}{dechirp}", {})[line["mode"]] = line
    for who, row in rows.items():
        cells = []
        for mode in modes:
            if mode in row:
                ratio = row[mode]["median_s"] / best[mode]["median_s"]
                cells.append(f"{row[mode]['median_s']:9.3f} ({ratio:5.1f}x)")
            else:
                cells.append("")
        any_line = next(iter(row.values()))
        peak = max(line["peak_mb"] for line in row.values())
        print(f"| {who:34} | " + " | ".join(f"{cell:>18}" for cell in cells) + f" | {any_line['relative_error']:.1e} | {peak:5} |")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="without PyTorch")
    options = parser.parse_args()
    subprocess.run(["cargo", "bench", "--features", "wgpu", "--bench", "coherent_sum", "--no-run"], check=True, cwd=ROOT)
    theirs = list(yardsticks(not options.quick))
    ours = lines(["cargo", "bench", "--features", "wgpu", "--bench", "coherent_sum", "--", "unit"])
    with open(ROOT / "target" / "bench.jsonl", "w") as out:
        out.writelines(json.dumps(line) + "\n" for line in ours + theirs)
    table(ours, theirs)
    print("\na whole training step with the graph convolution drawn, and a frame's inference; seconds\n")
    for line in lines(["cargo", "bench", "--features", "wgpu", "--bench", "training_step"]):
        print(
            f"  {line['paths']:10} {line['vertices']} vertices, {line['room_points']} room points, {line['walls']} walls, "
            f"{line['transmitters']} TX x {line['receivers']} RX: "
            f"step {line['step_s']:.3f}, inference {line['inference_s']:.3f}, visibility {line['visibility_s']:.3f}, "
            f"peak {line['peak_mb']:.0f} MB"
        )
    print(f"\nload of the machine: {os.getloadavg()[0]:.1f}")


if __name__ == "__main__":
    main()
