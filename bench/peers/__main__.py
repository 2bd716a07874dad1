"""`python -m bench.peers PEER FINGER.json DIRECTORY`, in the peers' environment: one peer's kernels for one finger."""

from __future__ import annotations

import importlib
import json
import sys
from pathlib import Path


def main() -> None:
    """Generate; problems of any kind end as one line on standard error and exit code 1."""
    peer, finger, directory = sys.argv[1], Path(sys.argv[2]), Path(sys.argv[3])
    try:
        importlib.import_module(f"bench.peers.{peer}").main(json.loads(finger.read_text(encoding="utf-8")), directory)
    except Exception as error:
        print(f"{peer}: {type(error).__name__}: {error}", file=sys.stderr)
        raise


main()
