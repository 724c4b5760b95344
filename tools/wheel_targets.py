"""The table of systems that wheels are for, and what follows from it."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Target:
    """A system and an architecture."""

    name: str
    """as `make wheels TARGETS=...` takes it, and the name of its build folder"""
    zig: str
    """the triple of the compiler, with the oldest system"""
    tag: str
    """the platform of the wheel's name"""
    soabi: str
    """the end of an extension's name for Python 3.11"""
    runner: tuple[str, ...] = ()
    """what runs its programs here, where the processor or the system is another"""

    @property
    def system(self) -> str:
        return self.zig.split("-")[1].split(".")[0]

    @property
    def machine(self) -> str:
        return self.zig.split("-")[0]

    @property
    def oldest(self) -> str:
        """The oldest system by the tag of the wheel."""
        named = {"linux": "glibc {}", "macos": "macOS {}", "windows": "Windows 10"}[self.system]
        return named.format(".".join(self.tag.split("_")[1:3]))

    @property
    def how(self) -> str:
        """By what its programs run here, for the tables of RELEASING.md."""
        if self.system == "macos":
            return "never run"
        return (
            {"qemu-aarch64-static": "qemu", "wine64": "wine"}[self.runner[0]] if self.runner else "natively"
        )

    def module(self, python: str) -> str:
        """The file name of amontons._core for "abi3" or "cp311"."""
        end = "pyd" if self.system == "windows" else "so"
        if python == "abi3":
            return "_core.pyd" if end == "pyd" else "_core.abi3.so"
        return f"_core.{self.soabi}.{end}"

    @property
    def unit(self) -> str:
        """The file name of the library that functional mock-up units take in."""
        return f"amontons_fmu.{'dll' if self.system == 'windows' else 'so'}"

    def program(self, name: str) -> str:
        return f"{name}.exe" if self.system == "windows" else name


# The compiler's triple names the oldest system: glibc 2.28 (2018), macOS 12 (2021).
TARGETS = {
    target.name: target
    for target in (
        Target("linux-x86_64", "x86_64-linux-gnu.2.28", "manylinux_2_28_x86_64",
               "cpython-311-x86_64-linux-gnu"),
        Target("linux-aarch64", "aarch64-linux-gnu.2.28", "manylinux_2_28_aarch64",
               "cpython-311-aarch64-linux-gnu", ("qemu-aarch64-static",)),
        Target("macos-arm64", "aarch64-macos.12.0", "macosx_12_0_arm64", "cpython-311-darwin"),
        Target("macos-x86_64", "x86_64-macos.12.0", "macosx_12_0_x86_64", "cpython-311-darwin"),
        Target("windows-x86_64", "x86_64-windows-gnu", "win_amd64", "cp311-win_amd64", ("wine64",)),
    )
}  # fmt: skip

MOST_BYTES = 8_000_000
"""of a wheel"""

STABLE = (3, 12)
"""The Python whose stable ABI the wheel for all newer ones uses."""

PYTHONS = {"cp311": ("cp311", "cp311"), "abi3": ("cp312", "abi3")}
"""Which wheels there are: the tags of interpreter and ABI."""


def tag(target: Target, python: str) -> str:
    """The three tags in the name of a wheel."""
    return "-".join((*PYTHONS[python], target.tag))
