"""Before a release: the tag is the version, its changes are told, and the addresses are those of this repository.

Reads GITHUB_REF_NAME, GITHUB_SERVER_URL and GITHUB_REPOSITORY, as GitHub sets them; ends with a line for what is wrong.
"""

from __future__ import annotations

import os
import sys
import tomllib
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]


def problems(project: Mapping[str, Any], changelog: str, environment: Mapping[str, str]) -> Iterator[str]:
    """What stands in the way of a release; nothing if all is well."""
    version, urls = project["version"], project["urls"]
    tag = environment["GITHUB_REF_NAME"]
    here = f"{environment['GITHUB_SERVER_URL']}/{environment['GITHUB_REPOSITORY']}"
    if tag != f"v{version}":
        yield f"the tag is {tag}, and the version in pyproject.toml {version}"

    if f"## [{version}]" not in changelog:
        yield f"CHANGELOG.md has no heading for {version}"

    for name in ("Homepage", "Repository", "Issues", "Changelog"):
        if urls[name] != here and not urls[name].startswith(f"{here}/"):
            yield f"{name} in pyproject.toml is {urls[name]}, and this is {here}"


def main() -> None:
    """Look, and say what is wrong."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    found = list(problems(project, (ROOT / "CHANGELOG.md").read_text(encoding="utf-8"), os.environ))
    sys.exit("\n".join(found) if found else 0)


if __name__ == "__main__":
    main()
