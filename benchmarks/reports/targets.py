"""What was wanted and what was reached, from the results of the benchmarks."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from statistics import median

from common import ORIGINS, read_csv
from tables import milliseconds, scientific, table

LARGE = 200  # contacts from which on every file is to be solved faster than by Clarabel
PROFILE_KEYS = ("task", "half", "rows", "law", "tolerance", "warm")
Rows = list[dict[str, str]]


class Results:
    """The rows of every CSV file of a folder."""

    def __init__(self, folder: Path) -> None:
        self.environment = {row["key"]: row["value"] for row in read_csv(folder / "environment.csv")}
        self.files, self.duels = read_csv(folder / "files.csv"), read_csv(folder / "clarabel.csv")
        self.steps, self.methods = read_csv(folder / "steps.csv"), read_csv(folder / "methods.csv")
        self.kernel, self.sets = read_csv(folder / "kernel.csv"), read_csv(folder / "instruction_sets.csv")
        self.profile = read_csv(folder / "profile.csv")
        self.simulation, self.physics = read_csv(folder / "simulation.csv"), read_csv(folder / "physics.csv")
        self.orders = read_csv(folder / "orders.csv")
        self.rollout, self.studies = read_csv(folder / "rollout.csv"), read_csv(folder / "studies.csv")
        self.beside, self.solvers = (
            read_csv(folder.parent / "beside" / f"{name}.csv") for name in ("beside", "solvers")
        )
        self.deadlines, self.budgets = read_csv(folder / "deadlines.csv"), read_csv(folder / "budgets.csv")
        self.growth, self.exponents = read_csv(folder / "growth.csv"), read_csv(folder / "exponents.csv")
        self.broad_phase, self.robots = read_csv(folder / "broad_phase.csv"), read_csv(folder / "robots.csv")
        self.robots_2ms = read_csv(folder / "robots_2ms.csv")

        tables = (at / ORIGINS for at in (folder, folder.parent / "beside"))
        self.origins = {row["table"]: row for path in tables for row in read_csv(path)}

    def origin(self, *names: str) -> str:
        """The revision, the date and the command of each of these tables."""
        known = [self.origins[name] for name in names if name in self.origins]
        return "; ".join(f"`{o['table']}`: revision {o['revision']}, {o['date']}" for o in known)

    def accuracy(self, law: str, tolerance: float) -> Rows:
        return [r for r in self.files if r["law"] == law and float(r["tolerance"]) == tolerance]


Line = tuple[str, str, str, bool]  # what, wanted, reached, whether met


def file_targets(r: Results) -> Iterable[Line]:
    if not r.files:
        return
    for law, tolerance, wanted in (
        ("associated", 1e-4, None), ("associated", 1e-8, 50), ("coulomb", 1e-4, 54), ("coulomb", 1e-6, 45),
        ("coulomb", 1e-8, 54),
    ):  # fmt: skip
        rows = r.accuracy(law, tolerance)
        if not rows:
            continue
        solved = sum(float(row["residual"]) <= tolerance for row in rows)
        wanted = wanted or len(rows)
        # The counts that are wanted are out of the 56 files; of a sample, all.
        enough = solved >= min(wanted, len(rows))
        yield f"files solved to {tolerance:.0e}, {law}", f"{wanted}", f"{solved} of {len(rows)}", enough
    both = [r.accuracy(law, 1e-8) for law in ("coulomb", "associated")]
    if all(both):
        theirs, ours = (sum(float(row["time"]) for row in rows) for rows in both)
        yield "time to 1e-08, coulomb over associated", "5", f"{theirs / ours:.1f}", theirs <= 5 * ours
        # A file that is not solved takes the whole of its deadline.
        solved = {row["file"] for row in both[0] if float(row["residual"]) <= 1e-8}
        if len(solved) < len(both[0]):
            theirs, ours = (sum(float(row["time"]) for row in rows if row["file"] in solved) for rows in both)
            what = f"the same, of the {len(solved)} files that are solved"
            yield what, "5", f"{theirs / ours:.1f}", theirs <= 5 * ours
    trusted = [
        row for row in r.accuracy("associated", 1e-8)
        if row["relative_difference"] and float(row["reference_error"]) < 1e-8
    ]  # fmt: skip
    if trusted:
        worst = max(abs(float(row["relative_difference"])) for row in trusted)
        what = f"objective, relative difference on the {len(trusted)} files with a reference to 1e-08"
        yield what, "1e-06", scientific(worst), worst <= 1e-6
    if r.duels:
        ours, theirs = (sum(float(row[key]) for row in r.duels) for key in ("wall", "clarabel_time"))
        reached = f"{ours / theirs:.2f} ({1e3 * ours:.0f} ms, {1e3 * theirs:.0f} ms)"
        yield "total time to 1e-04 over that of Clarabel", "1", reached, ours <= theirs
        large = [float(row["ratio"]) for row in r.duels if int(row["contacts"]) >= LARGE]
        if large:
            what = f"the same, worst of the {len(large)} files with {LARGE} contacts or more"
            yield what, "below 1", f"{max(large):.2f}", max(large) < 1


def kernel_targets(r: Results) -> Iterable[Line]:
    """Of full iterations on one core: in a cache, and far out of all."""
    for row in (row for row in r.kernel if row["threads"] == "1"):
        contacts, time, ratio = int(row["contacts"]), float(row["ns_per_contact"]), float(row["ratio"])
        if contacts < 20000:
            what = f"iteration at {contacts} contacts, {row['law']}, ns per contact"
            yield what, "8", f"{time:.1f}", time <= 8
        elif contacts > 500000:
            what = f"share of triad bandwidth at {contacts} contacts, {row['law']}"
            yield what, "0.9", f"{ratio:.2f}", ratio >= 0.9
    for row in (row for row in r.sets if row["isa"] == "avx2" and row.get("near_ratio")):
        share = float(row["near_ratio"])
        what = f"share of triad bandwidth in the same cache at {row['contacts']} contacts, {row['law']}, AVX2"
        yield what, "0.75", f"{share:.2f}", share >= 0.75


def step_targets(r: Results) -> Iterable[Line]:
    for row in r.steps:
        by = "" if row["method"] == "auto" else f", {row['method']}"
        what = f"{row['scene']}, {row['law']}, to {float(row['tolerance']):.0e}{by}"
        met = float(row["wall"]) <= float(row["target"]) and float(row["residual"]) <= float(row["tolerance"])
        yield what, f"{milliseconds(row['target'])} ms", f"{milliseconds(row['wall'])} ms", met


def scene_targets(r: Results) -> Iterable[Line]:
    for row in r.simulation:
        wanted, cores = float(row.get("target") or 0), row.get("target_cores")
        speed = row["steps_per_second"] if cores == "1" else row.get("steps_per_second_all")
        if wanted and speed:
            where = "one core" if cores == "1" else f"{cores} cores"
            yield (
                f"{row['name']}, steps/s on {where}",
                f"{wanted:g}",
                f"{float(speed):.3g}",
                float(speed) >= wanted,
            )
            converged, steps = int(row["converged"]), int(row["steps"])
            yield f"{row['name']}, steps that converge", "all", f"{converged} of {steps}", converged == steps


def robot_targets(r: Results) -> Iterable[Line]:
    speeds = sorted(
        (float(row["steps_per_second"]) / float(row["mujoco_steps_per_second"]), row["model"])
        for row in r.robots_2ms
        if row["steps_per_second"] and row["mujoco_steps_per_second"]
    )
    if not speeds:
        return
    middle, (least, slowest) = median(speed for speed, _ in speeds), speeds[0]
    yield (
        f"{len(speeds)} robots at 2 ms, steps/s over MuJoCo's, median",
        "0.4",
        f"{middle:.2g}",
        middle >= 0.4,
    )
    yield "the same, slowest", "0.15", f"{least:.2g} ({slowest})", least >= 0.15


def profile_targets(r: Results) -> Iterable[Line]:
    """auto on problems that it was not tuned on, beside the best single method for each."""
    rows = [row for row in r.profile if row["half"] == "held-out"]
    if not rows:
        return
    methods = [key for key in rows[0] if key not in (*PROFILE_KEYS, "auto")]
    rows = [row for row in rows if any(row[m] for m in methods)]
    near = sum(
        bool(row["auto"]) and float(row["auto"]) <= 1.5 * min(float(row[m]) for m in methods if row[m])
        for row in rows
    )
    failed = sum(not row["auto"] for row in rows)
    yield (
        "held-out solves within 1.5 of the best method",
        "100 %",
        f"{100 * near / len(rows):.0f} %",
        near == len(rows),
    )
    yield "the same, not solved though a method does", "0", f"{failed}", not failed


def targets(r: Results) -> str:
    """The table of what was wanted and what was reached, or nothing without results."""
    parts = (file_targets, step_targets, scene_targets, robot_targets, profile_targets, kernel_targets)
    lines = [line for part in parts for line in part(r)]
    rows = [(what, wanted, reached, "yes" if met else "**no**") for what, wanted, reached, met in lines]
    return table(("Target", "Wanted", "Reached", "Met"), rows) if rows else ""
