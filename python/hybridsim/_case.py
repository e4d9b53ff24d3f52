"""A case of a challenge, diagnosed in a process of its own as the program does it:
``python -m hybridsim._case diagnose RECORDING --out DIR --quiet --device NAME --set KEY=VALUE``."""

from __future__ import annotations

import argparse
import sys

from ._errors import Error
from ._verbs.diagnose import diagnose


def main() -> int:
    parser = argparse.ArgumentParser()
    parser.add_argument("verb", choices=["diagnose"])
    parser.add_argument("recording")
    parser.add_argument("--out", required=True)
    parser.add_argument("--quiet", action="store_true")
    parser.add_argument("--device", default="auto")
    parser.add_argument("--set", action="append", default=[])
    given = parser.parse_args()
    try:
        diagnose(given.recording, out=given.out, set=given.set, device=given.device, progress=not given.quiet)
    except Error as error:
        # The last line is what is kept of a failure.
        print(f"error: {error}" if error.hint is None else f"error: {error}\nhint: {error.hint}", file=sys.stderr)
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
