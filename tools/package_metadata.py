"""README and addresses in the metadata of packages: a provider of [[tool.dynamic-metadata]] (pyproject.toml).

An index of packages shows the README without the repository: relative links lead nowhere there. With
AMONTONS_URL, the address of the repository (RELEASING.md), links and pictures become absolute, to files of
the version, and the metadata gets the addresses of the project. Without it the README stays as it is.
"""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).resolve().parent.parent
LINK = re.compile(r"(?P<picture>!?)\[(?P<text>[^\]]*)\]\((?P<target>[^)\s]+)\)")


def absolute(text: str, address: str, version: str) -> str:
    """The text with its relative links absolute: to files of the repository at the tag of the version."""

    def replaced(match: re.Match[str]) -> str:
        target = match["target"]
        if re.match(r"[a-z]+:|#", target):
            return match[0]
        kind = "raw" if match["picture"] else "blob"
        return f"{match['picture']}[{match['text']}]({address}/{kind}/v{version}/{target})"

    return LINK.sub(replaced, text)


def addresses(address: str) -> dict[str, str]:
    """Addresses by labels that indexes know (packaging.python.org, "Well-known Project URLs")."""
    return {
        "Source": address,
        "Issues": f"{address}/issues",
        "Changelog": f"{address}/blob/main/CHANGELOG.md",
        "Documentation": os.environ.get("AMONTONS_DOCS_URL", f"{address}/blob/main/docs/index.md"),
    }


def dynamic_metadata(settings: Mapping[str, Any], project: Mapping[str, Any]) -> dict[str, Any]:
    """The fields `readme` and `urls` of [project]."""
    address = os.environ.get("AMONTONS_URL", "").rstrip("/")
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    if not address:
        return {"readme": {"text": text, "content-type": "text/markdown"}, "urls": {}}
    if not re.fullmatch(r"https://[^\s/]+/\S+", address):
        raise ValueError(
            f"AMONTONS_URL is {address!r}; give the address of the repository, https://HOST/OWNER/NAME"
        )
    text = absolute(text, address, project["version"])
    return {"readme": {"text": text, "content-type": "text/markdown"}, "urls": addresses(address)}
