"""The pieces of work that the stages of `pipeline` hand to other processes: each reads the cache and writes into it."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from typing import TYPE_CHECKING, Any

from awiwi_gen.cache import Cache
from awiwi_gen.emit.options import Options
from awiwi_gen.errors import OutputError
from awiwi_gen.parallel import split

if TYPE_CHECKING:
    from awiwi_gen.judge import PartLaws

# A kernel, what its record is made from (fingerprints of graphs, keys of other kernels' records), and its key.
Task = tuple[Any, Mapping[str, Any], str]


def cached(store: Cache, kind: str, digest: str) -> Any:
    """What an earlier stage has cached. Raises OutputError if it was removed or damaged since."""
    found = store.get(kind, digest)
    if found is None:
        raise OutputError(f"{store.directory / kind / digest} was removed or changed during the run; run it again")
    return found


def derive(piece: tuple[str, Mapping[str, Any], Cache]) -> None:
    """Derive kernels of one structure by one route, and check their dimensions."""
    from awiwi_gen.derive import Deriver, check_dimensions

    route, kernels, store = piece
    deriver = Deriver(next(iter(kernels.values())).part)
    for digest, kernel in kernels.items():
        graph = deriver.derive(kernel, route)
        check_dimensions(kernel, graph)
        store.put("derived", digest, graph)


def ordered(tasks: Collection[Task]) -> tuple[list[list[Task]], list[set[int]]]:
    """Tasks in pieces of one part each, those that others wait for first; and for each the pieces it waits for."""
    parts: dict[tuple[str, str], list[Task]] = {}
    for task in tasks:
        # The whole hand and a hand of one finger, for its measured lengths, have the same path.
        part = (task[0].path, task[0].structure) if task[0].solver is None else (task[0].name, "")
        parts.setdefault(part, []).append(task)
    pieces = split(list(parts.values()), _size)
    awaited = {digest for members in pieces for task in members for digest in _needs(task)}
    pieces.sort(key=lambda members: (awaited.isdisjoint(task[2] for task in members), -sum(map(_size, members))))
    place = {digest: number for number, members in enumerate(pieces) for _, _, digest in members}
    return pieces, [{place[one] for task in members for one in _needs(task) if one in place} for members in pieces]


def _needs(task: Task) -> Collection[str]:
    """Keys of the records that a record is made from."""
    return task[1].values() if task[0].solver is not None else ()


def _size(task: Task) -> int:
    """Number of nodes of the graphs a record is made from."""
    return sum(getattr(graph, "size", 0) for graph in task[1].values())


def make_records(piece: tuple[list[Task], str, Options, Cache]) -> None:
    """Bind, compare, optimise and print kernels of one part."""
    from awiwi_gen import records

    members, prefix, options, store = piece
    if members[0][0].solver is None:
        loaded = [(kernel, records.load_graphs(kernel, store), digest) for kernel, _, digest in members]
        made = records.make_records(loaded, prefix, options)
    else:
        made = []
        for kernel, needs, digest in members:
            used = {family: cached(store, "records", one) for family, one in needs.items()}
            made.append(records.make_solver_record(kernel, used, digest, prefix, options))
    for record in made:
        store.put("records", record.digest, record)


def check_laws(piece: tuple[PartLaws, list[str], Cache]) -> None:
    """Check laws of physics on the kernels of one part."""
    part, names, store = piece
    for name, law in part.check(names).items():
        store.put("laws", part.keys[name], law)
