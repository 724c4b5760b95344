"""amontons doctor: what is installed, and whether it works."""

from __future__ import annotations

from typing import Any

import typer

from .common import NOT_CONVERGED, AsJson, facts_table, print_json, say


def doctor(as_json: AsJson = False) -> None:
    """Show versions, processor and optional parts, and test in a second that simulations come out right.

    Send its output along with a report of a fault. The exit code is 0 if all tests passed, 1 if some did not.
    """
    from ..device import devices
    from ..device.found import remedies
    from ..report import health

    found = {"found": [vars(device) for device in devices()], "missing": remedies()}
    told = {"versions": health.versions(), "machine": health.machine(), "parts": health.parts()}
    told |= {"devices": found}
    if not as_json:
        _tell(told)
    checks = []
    for check in health.self_test():
        checks.append(check)
        if not as_json:
            say(f"{'passed' if check['passed'] else 'FAILED'}  {check['check']}: {check['measured']}",
                "" if check["passed"] else "red")  # fmt: skip
    passed = all(check["passed"] for check in checks)
    if as_json:
        print_json({**told, "tests": checks, "passed": passed})
    elif not passed:
        say("This build does not work here. Install it anew; if that does not help, report all of this.")
    if not passed:
        raise typer.Exit(NOT_CONVERGED)


def _tell(told: dict[str, Any]) -> None:
    machine = told["machine"]
    limited = f", lowered by AMONTONS_ISA={machine['limited_by']}" if machine["limited_by"] else ""
    facts = {
        **told["versions"],
        "system": machine["system"],
        "processor": machine["processor"],
        "cores": machine["cores"],
        "instruction set": machine["instruction_set"] + limited,
    }
    facts_table(facts.items())
    say("")
    for name, part in told["parts"].items():
        have = ", ".join(f"{module} {version}" for module, version in part["versions"].items() if version)
        state = have or "installed" if part["installed"] else f"missing: {part['remedy']}"
        say(f"{name:9s}{part['purpose']}: {state}")
    for kind, missing in told["devices"]["missing"].items():
        found = [d for d in told["devices"]["found"] if d["name"].startswith(kind)]
        say(f"{kind:9s}large problems on devices: {', '.join(map(_device, found)) or missing}")
    say("")


def _device(device: dict[str, Any]) -> str:
    precision = "" if device["doubles"] else ", without double precision"
    name, hardware, kind = device["name"], device["hardware"], device["kind"]
    return f"{name} ({hardware}, {kind}, {device['memory'] / 1e9:.3g} GB{precision})"
