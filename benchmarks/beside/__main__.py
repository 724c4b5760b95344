"""The same scenes in every engine that is installed: what a step costs, and what is left of the law.

    python -m beside [--engines NAME ...] [--scenes NAME ...] [--quick] [--steps N ...] [--limit S]
                     [--check beside.csv] [--renew-times] [--list]

Run it in benchmarks/. Each engine runs in an environment of its own (`python -m beside.install`). All engines
of a scene run in turns, part by part, on one core, so that whatever slows the machine slows all of them.
Their motion is measured by us: overlap, creep, lift, gaps of joints, energy, momentum. Writes beside.csv, a
row per scene, engine and step: rows of engines and scenes that were not asked for stay. Figure:
beside_profile.png.

It writes to results/beside and docs/figures; the quick run, and one with --out, elsewhere.

--renew-times: runs the scenes once more, 1 s for each setting, and writes the times of the table only. It
wants a core of its own; errors keep their rows.
--steps: steps of the scene's time step, 1 and 4 by default.
--check: the exit status is 1 if our time over that of MuJoCo is more than twice what it is in a file of
results, for any scene of both, and still so when that is run again.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

from common import RESULTS, arguments, begin, read_csv, tracked, write_csv
from figures import beside as draw

from .compete import REFERENCE, checked, compete, shown
from .engine import NAMES, Engine, engines, stop
from .rows import merged, put_times, unlike_defaults
from .scenes import Case, cases

LIMIT, QUICK_LIMIT, RENEW_LIMIT = 4.0, 1.5, 1.0
"""s of processor time of one engine for one scene; then it makes no further part, and none after the first if
all would take four times as long."""


def chosen_engines(keys: list[str]) -> list[Engine]:
    """Those of the keys; beside ours always the one that our times are compared with."""
    found = list(engines(*keys))
    if "amontons" in keys and "mujoco" not in keys:
        found += [e for e in engines("mujoco") if e.name == REFERENCE]
    return found


def renew_times(chosen: Sequence[Case], keys: Sequence[str], limit: float, path: Path) -> None:
    """Writes the table after each scene, so that a run that is stopped keeps what it has."""
    rows: list[Any] = read_csv(path)
    for case in tracked(chosen, "times"):
        for each in sorted({int(row["steps_per_dt"]) for row in rows if row["task"] == case.key}):
            timed = replace(case, pieces=False, repeats=False)
            put_times(rows, compete(timed, chosen_engines(list(keys)), limit, each))
        write_csv(path, merged(rows, []))


def main() -> int:
    parser = arguments(__doc__)
    parser.add_argument(
        "--engines", nargs="*", choices=NAMES, default=[], metavar="NAME", help=" ".join(NAMES)
    )
    parser.add_argument("--scenes", nargs="*", default=[], help="keys, or beginnings of keys")
    parser.add_argument(
        "--steps", nargs="*", type=int, default=[1, 4], help="steps per time step of the scene"
    )
    parser.add_argument("--limit", type=float, help="s of processor time of a setting on a scene")
    parser.add_argument("--check", type=Path, help="beside.csv of an earlier run")
    parser.add_argument("--renew-times", action="store_true", help="times of the rows that are there")
    parser.add_argument("--list", action="store_true", help="scenes and engines, and nothing else")
    options = parser.parse_args()
    every = cases()
    if options.list:
        print("\n".join(f"{c.key}: {c.name}, {1e3 * c.dt:g} ms, {c.duration:g} s" for c in every))
        print(
            "\n".join(f"{e.key}: {e.name}: {dict(e.variant.options)} ({e.variant.manual})" for e in engines())
        )
        return 0
    keys_of_scenes = [c.key for c in every]
    for wanted in options.scenes:
        if not any(key.startswith(wanted) for key in keys_of_scenes):
            parser.error(f'no scene begins with "{wanted}": there are {", ".join(keys_of_scenes)}')
    begin(options, sample=bool(options.check), home=RESULTS / "beside", needs=())
    limit = options.limit or (QUICK_LIMIT if options.quick else LIMIT)
    chosen = [c for c in every if c.quick or options.scenes or not options.quick]
    chosen = [c for c in chosen if not options.scenes or c.key.startswith(tuple(options.scenes))]
    keys = options.engines or (["amontons", "mujoco", "dart"] if options.quick or options.check else [])
    steps = [1] if options.quick or options.check else options.steps
    path = options.out / "beside.csv"
    if options.renew_times:
        renew_times(chosen, options.engines, options.limit or RENEW_LIMIT, path)
        stop()
        draw(read_csv(path), options.figures / "beside_profile.png")
        return 0
    rows = read_csv(path)
    for case in tracked(chosen, "beside"):
        found = [row for each in steps for row in compete(case, chosen_engines(keys), limit, each)]
        for row in found:
            print(f"beside: {shown(row)}", flush=True)
        rows = merged(rows, found)
        write_csv(path, rows)
    stop()
    draw(rows, options.figures / "beside_profile.png")
    late = checked(rows, read_csv(options.check), chosen, limit) if options.check else 0
    same = unlike_defaults(rows)
    for complaint in same:
        print(f"beside: {complaint}")
    return int(bool(late or same))


if __name__ == "__main__":
    sys.exit(main())
