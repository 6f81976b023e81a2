"""The kreisel program that the scripts drive, and how they are told which seeds."""

import os
import pathlib

ROOT = pathlib.Path(__file__).resolve().parent.parent
KREISEL = pathlib.Path(os.environ.get("KREISEL", ROOT / "target/release/kreisel"))


def seeds(text):
    """Every seed of a range like 1-5, or the one."""
    first, _, last = text.partition("-")
    return range(int(first), int(last or first) + 1)
