"""The command ``tune``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from awiwi_gen.arguments import HandFile, Json
from awiwi_gen.certificates import SUFFIX, certificate_text
from awiwi_gen.errors import InputError
from awiwi_gen.patterns import ALL, matches


def tune(
    hand: HandFile = None, as_json: Json = False,
    output: Annotated[Path, typer.Option("--output", "-o", help="File of gains to write.")] = Path("gains.toml"),
    costs: Annotated[
        Path | None, typer.Option("--costs", help="File of costs: the optimum of the plant as known instead.")
    ] = None,
    only: Annotated[str, typer.Option("--only", metavar="GLOB", help="Only joints such as index_pip,thumb_*.")] = ALL,
    seed: Annotated[int, typer.Option("--seed", help="Of the search: the same seed gives the same gains.")] = 1,
    tries: Annotated[int, typer.Option("--tries", help="Of the search, for each joint.")] = 400,
) -> int:  # fmt: skip
    """Find gains that hold on a family of wrong plants, for each joint, and write a file that the hand file can name."""
    from awiwi_gen.hand import Hand
    from awiwi_gen.report import Progress, print_json
    from awiwi_gen.tables import print_table

    read = Hand.load(hand)
    if costs is not None:
        return _from_costs(read, costs, output, as_json)
    if seed < 0:
        raise InputError(f"--seed {seed}: a search has a seed of 0 or more")
    from awiwi_gen.cache import Cache
    from awiwi_gen.loops.search import require_tries
    from awiwi_gen.tune import family, hand_gains

    require_tries(tries)
    store, progress = Cache(), Progress()
    found, without = family.tune_family(read, store, seed, tries, lambda name: matches(name, only), progress)
    own, refused = hand_gains.holding(read, found, store, progress)
    without += refused
    if not found:
        raise InputError("; ".join(without))
    family.write(output, family.gains_text(found, seed, tries))
    certificate = certificate_text(own, hand_gains.require_running_gains(own, store))
    family.write(output.with_suffix(SUFFIX), certificate)
    if as_json:
        print_json({"joints": family.as_data(found), "without": without})
    else:
        print_table(family.COLUMNS, family.rows(found), "As known, and the worst of the family")
        print("".join(f"{each}\n" for each in without), end="")
        count = sum(len(each.tendons) for each, _ in found)
        print(f"{output}: gains of {count} tendons; {output.with_suffix(SUFFIX)}: their certificate")
    return 0


def _from_costs(hand: object, costs: Path, output: Path, as_json: bool) -> int:
    from awiwi_gen.report import print_json
    from awiwi_gen.tune.tendons import tune_hand, write_gains

    tuned = tune_hand(hand, costs)  # type: ignore[arg-type]
    write_gains(output, tuned)
    if as_json:
        print_json([each.as_dict() for each in tuned])
    else:
        radius, margin = max(e.sampled_radius for e in tuned), min(e.delay_margin for e in tuned)
        print(f"{output}: gains of {len(tuned)} tendons; spectral radius {radius:.4f} at most at 3 kHz and one sample")
        print(f"of delay, delay margin {margin * 1e6:.0f} us at least")
    return 0
