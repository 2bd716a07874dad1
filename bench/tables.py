"""Results as tables for people."""

from __future__ import annotations

from typing import Any

from bench.quantities import QUANTITIES

Row = dict[str, Any]


def group_of(contender: str) -> str:
    """Contenders by tool: ours with either sine is one."""
    return "ours" if contender.startswith("ours") else contender


def best(rows: list[Row], key: str = "ns") -> Row | None:
    """The row with the least of something that is known."""
    known = [row for row in rows if row[key] is not None]
    return min(known, key=lambda row: float(row[key])) if known else None


def print_hand(hand: str, result: dict[str, Any]) -> None:
    """All tools side by side for one hand, each at its better flags and sine, and at the portable ones."""
    said = "agree" if result["agreed"] else "DISAGREE"
    print(f"\n{hand}: results {said} to {result['worst']:.1e}")
    head = f"{'quantity':26}{'tool':18}{'operations':>11}{'sincos':>8}{'bytes':>7}{'instr.':>8}{'ns':>8}{'ratio':>7}  flags"
    print(f"{head:96}| portable: {'instr.':>7}{'ns':>8}{'ratio':>7}")
    for name, quantity in QUANTITIES.items():
        rows = [row for row in result["rows"] if row["quantity"] == name]
        tools = list(dict.fromkeys(group_of(row["contender"]) for row in rows))
        ours = {portable: _pick(rows, "ours", portable) for portable in (False, True)}
        for tool in tools:
            row, plain = _pick(rows, tool, False), _pick(rows, tool, True)
            assert row is not None  # noqa: S101 - a tool is listed because it has rows
            counted = result["operations"].get(row["contender"], {}).get(name)
            text = f"{quantity.title if tool == tools[0] else '':26}{tool:18}"
            text += f"{_text(counted and counted['operations']):>11}{_text(counted and counted['sincos']):>8}"
            text += f"{_text(_bytes(rows, tool)):>7}{_text(row['instructions']):>8}{row['ns']:8.1f}"
            text += f"{_ratio(row, ours[False]):>7}  {_flags(row)}"
            if plain is not None:
                text = f"{text:96}|           {_text(plain['instructions']):>7}"
                text += f"{plain['ns']:8.1f}{_ratio(plain, ours[True]):>7}"
            print(text)
    print()


def goals(results: dict[str, Any]) -> list[Row]:
    """One row per hand, quantity and kind of number: ours, the best peer's, their ratio, and the goal."""
    rows = []
    for hand, result in results.items():
        for name, quantity in QUANTITIES.items():
            mine = [r for r in result["rows"] if r["quantity"] == name]
            peers = [r for r in mine if group_of(r["contender"]) != "ours"]
            mine = [r for r in mine if group_of(r["contender"]) == "ours"]
            entry = {"hand": hand, "quantity": name}
            most = quantity.goal.operations if hand == "index" else None  # a count belongs to a finger, ratios to all
            counts = {c: per[name] for c, per in result["operations"].items() if name in per}
            own = counts[mine[0]["contender"]]["operations"]
            theirs = {c: n["operations"] for c, n in counts.items() if group_of(c) != "ours"}
            least = min(theirs, key=lambda c: theirs[c]) if theirs else None
            rows.append(
                {**entry, "measure": "operations", "ours": own, "peer": least and theirs[least], "name": least}
                | {
                    "goal": most,
                    "aim": quantity.goal.aim if most else None,
                    "met": _met(own, most),
                }
            )
            for measure, goal, portable in _measures(quantity.goal):
                key = "ns" if measure.startswith("time") else "instructions"
                chosen = [[r for r in side if (r["variant"] == "portable") == portable] for side in (mine, peers)]
                a, b = best(chosen[0], key), best(chosen[1], key)
                if a is None or b is None:
                    continue
                ratio = b[key] / a[key]
                rows.append(
                    {**entry, "measure": measure, "ours": a[key], "peer": b[key], "name": b["contender"]}
                    | {"ratio": ratio, "goal": goal, "met": ratio >= goal}
                )
    return rows


def _measures(goal: Any) -> list[tuple[str, float, bool]]:
    portable = 1.0 if goal.time == 2.0 else 1.3
    return [
        ("instructions", goal.instructions, False),
        ("time", goal.time, False),
        ("time, portable", portable, True),
    ]


def print_goals(rows: list[Row]) -> None:
    """Kernel, measure, ours, best peer, ratio, goal."""
    head = f"{'hand':8}{'quantity':20}{'measure':16}{'ours':>8}{'best peer':>11}  {'which':18}{'ratio':>6}{'goal':>14}"
    print(head)
    for row in rows:
        ratio = row.get("ratio") or (row["peer"] / row["ours"] if row["peer"] else None)
        digits = 1 if row["measure"].startswith("time") else 0
        unit = "" if row["measure"] == "operations" else "x"
        goal = "" if row["goal"] is None else f"{row['goal']}{unit}"
        goal += f", aim {row['aim']}" if row.get("aim") else ""
        said = {True: "met", False: "MISSED", None: ""}[row["met"]]
        text = f"{row['hand']:8}{row['quantity']:20}{row['measure']:16}{row['ours']:8.{digits}f}"
        text += f"{(row['peer'] or 0):11.{digits}f}  {row['name'] or '':18}"
        print(f"{text}{(f'{ratio:.2f}' if ratio else ''):>6}{goal:>14}  {said}")


def _met(value: float, goal: float | None) -> bool | None:
    return None if goal is None else value <= goal


def _pick(rows: list[Row], tool: str, portable: bool) -> Row | None:
    mine = [row for row in rows if group_of(row["contender"]) == tool]
    if portable:
        return best([row for row in mine if row["variant"] == "portable"])
    return best(mine)


def _bytes(rows: list[Row], tool: str) -> int | None:
    """Code at -O2: the smaller one where there are two."""
    found = [r["bytes"] for r in rows if group_of(r["contender"]) == tool and r["variant"] == "portable" and r["bytes"]]
    return min(found) if found else None


def _text(number: float | None) -> str:
    return "-" if number is None else f"{number:.0f}"


def _ratio(row: Row, ours: Row | None) -> str:
    return "-" if ours is None else f"{row['ns'] / ours['ns']:.2f}"


def _flags(row: Row) -> str:
    sine = row["contender"].removeprefix("ours-")
    return row["variant"] + (f", {sine} sine" if sine != row["contender"] else "")
