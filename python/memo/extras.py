"""The packages that a part of memo needs besides numpy, and the command that installs them.

The command names the packages themselves, from memo's metadata: it is valid in a clone and for any source
of memo.
"""

from __future__ import annotations

import re
from importlib import metadata

__all__ = ["install", "packages_of"]

_DISTRIBUTION = "memo-motion"


def packages_of(extra: str) -> list[str]:
    """The packages of an extra with their minimum versions: `av>=14`."""
    try:
        requirements = metadata.requires(_DISTRIBUTION) or []
    except metadata.PackageNotFoundError:  # not installed, but on the path
        return []
    marked = [requirement.partition(";") for requirement in requirements]
    wanted = re.compile(rf"""extra\s*==\s*["']{re.escape(extra)}["']""")
    return [package.replace(" ", "") for package, _, marker in marked if wanted.search(marker)]


def install(extra: str, *absent: str) -> str:
    """The command that installs the packages of an extra; only those `absent` if memo has no metadata."""
    packages = packages_of(extra) or absent
    return " ".join(["pip install", *(f'"{package}"' for package in packages)])
