"""What was wanted of the benchmarks, and what was reached."""

from __future__ import annotations

import math
from collections.abc import Iterable
from statistics import median

from views import Results, Rows, by_task, grouped, in_ms, over_best, power, scientific, table

LARGE = 200  # contacts from which on every file is to be solved faster than by Clarabel
SOLVED = (("associated", 1e-4, None), ("associated", 1e-8, 50), ("coulomb", 1e-4, 54), ("coulomb", 1e-6, 45),
          ("coulomb", 1e-8, 54))  # fmt: skip
"""Law, tolerance, and how many of the 56 files are to be solved; None: all, as of a sample."""
Line = tuple[str, str, str, bool]  # what, wanted, reached, whether met


def level(tolerance: str | float) -> str:
    """A power of ten."""
    return power(f"{float(tolerance):.0e}")


def accuracy(files: Rows, law: str, tolerance: float) -> Rows:
    return [r for r in files if r["law"] == law and float(r["tolerance"]) == tolerance]


def file_targets(r: Results) -> Iterable[Line]:
    files, duels = r["files"], by_task(r["clarabel"])
    for law, tolerance, wanted in SOLVED:
        if rows := accuracy(files, law, tolerance):
            solved, wanted = sum(float(row["error"]) <= tolerance for row in rows), wanted or len(rows)
            what = f"files solved to {level(tolerance)}, {law}"
            yield what, f"{wanted}", f"{solved} of {len(rows)}", solved >= min(wanted, len(rows))
    both = [accuracy(files, law, 1e-8) for law in ("coulomb", "associated")]
    if all(both):
        # A file that is not solved takes the whole of its deadline.
        done = {row["task"] for row in both[0] if float(row["error"]) <= 1e-8}
        what, every = "time to 1e-8, coulomb over associated", {row["task"] for row in both[0]}
        for some in (every, done) if len(done) < len(both[0]) else (every,):
            theirs, ours = (sum(float(row["time"]) for row in rows if row["task"] in some) for rows in both)
            yield what, "5", f"{theirs / ours:.1f}", theirs <= 5 * ours
            what = f"the same, of the {len(done)} files that are solved"
    trusted = [
        abs(float(row["relative_difference"])) for row in accuracy(files, "associated", 1e-8)
        if row["relative_difference"] and float(row["reference_error"]) < 1e-8
    ]  # fmt: skip
    if trusted:
        what = f"objective, relative difference on the {len(trusted)} files with a reference to 1e-8"
        yield what, "1e-6", scientific(max(trusted)), max(trusted) <= 1e-6
    if files and duels:
        ours, theirs = (sum(times[solver] for times in duels.values()) for solver in ("amontons", "Clarabel"))
        reached = f"{ours / theirs:.2f} ({1e3 * ours:.0f} ms, {1e3 * theirs:.0f} ms)"
        yield "total time to 1e-4 over that of Clarabel", "1", reached, ours <= theirs
        contacts = {row["task"]: int(row["contacts"]) for row in files}
        if large := [t["amontons"] / t["Clarabel"] for file, t in duels.items() if contacts[file] >= LARGE]:
            what = f"the same, worst of the {len(large)} files with {LARGE} contacts or more"
            yield what, "below 1", f"{max(large):.2f}", max(large) < 1


def kernel_targets(r: Results) -> Iterable[Line]:
    """Full iterations on one core, of the slower law: in a cache, and far out of all."""
    one = [row for row in r["kernel"] if row["threads"] == "1"]
    for (contacts,), rows in grouped(one, "contacts").items():
        time = max(float(row["ns_per_contact"]) for row in rows)
        if int(contacts) < 20000:
            yield f"iteration at {contacts} contacts, ns per contact", "8", f"{time:.1f}", time <= 8
        elif int(contacts) > 500000:
            share = min(float(row["ratio"]) for row in rows)
            yield f"share of triad bandwidth at {contacts} contacts", "0.9", f"{share:.2f}", share >= 0.9
    near = [row for row in r["instruction_sets"] if row["isa"] == "avx2" and row.get("near_ratio")]
    for (contacts,), rows in grouped(near, "contacts").items():
        share = min(float(row["near_ratio"]) for row in rows)
        what = f"share of triad bandwidth in the same cache at {contacts} contacts, AVX2"
        yield what, "0.75", f"{share:.2f}", share >= 0.75


def step_targets(r: Results) -> Iterable[Line]:
    for row in r["steps"]:
        by = "" if row["method"] == "auto" else f", {row['method']}"
        what = f"{row['task']}, {row['law']}, to {level(row['tolerance'])}{by}"
        met = float(row["wall"]) <= float(row["target"]) and float(row["error"]) <= float(row["tolerance"])
        yield what, f"{in_ms(row['target'])} ms", f"{in_ms(row['wall'])} ms", met


def scene_targets(r: Results) -> Iterable[Line]:
    for row in r["simulation"]:
        wanted, cores = float(row.get("target") or 0), row.get("target_cores")
        told = row["steps_per_second"] if cores == "1" else row.get("steps_per_second_all")
        if wanted and told:
            name, speed = row["task"], float(told)
            where = "one core" if cores == "1" else f"{cores} cores"
            yield f"{name}, steps/s on {where}", f"{wanted:g}", f"{speed:.3g}", speed >= wanted
            converged, steps = int(row["converged"]), int(row["steps"])
            yield f"{name}, steps that converge", "all", f"{converged} of {steps}", converged == steps


def robot_targets(r: Results) -> Iterable[Line]:
    speeds = sorted(
        (float(row["steps_per_second"]) / float(row["mujoco_steps_per_second"]), row["model"])
        for row in r["robots_2ms"]
        if row["steps_per_second"] and row["mujoco_steps_per_second"]
    )
    if speeds:
        middle, (least, slowest) = median(speed for speed, _ in speeds), speeds[0]
        what = f"{len(speeds)} robots at 2 ms, steps/s over MuJoCo's"
        yield f"{what}, median", "0.77", f"{middle:.2g}", middle >= 0.77
        yield f"{what}, slowest", "0.25", f"{least:.2g} ({slowest})", least >= 0.25


def half_profile(rows: Rows, half: str) -> dict[str, list[float]]:
    """Of each method, on a half of the corpus: the time over that of the best single method."""
    return over_best([row for row in rows if row["half"] == half], "auto")


def profile_targets(r: Results) -> Iterable[Line]:
    """auto on problems that it was not tuned on, beside the best single method for each."""
    if found := half_profile(r["profile"], "held-out").get("auto"):
        near, failed = sum(ratio <= 1.5 for ratio in found), sum(map(math.isinf, found))
        what = "held-out solves within 1.5 of the best method"
        yield what, "100 %", f"{100 * near / len(found):.0f} %", near == len(found)
        yield "held-out solves that another method does, and `auto` does not", "0", f"{failed}", not failed


def targets(r: Results) -> str:
    parts = (file_targets, step_targets, scene_targets, robot_targets, profile_targets, kernel_targets)
    lines = [line for part in parts for line in part(r)]
    missed = [line[:3] for line in lines if not line[3]]
    count = f"{len(lines) - len(missed)} of {len(lines)} targets are met."
    return f"{count} The others:\n\n{table(('Target', 'Wanted', 'Reached'), missed)}" if missed else count
