"""What pyproject.toml cannot say: README.md as the package index shows it, where no link may be relative."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

from setuptools import setup

ROOT = Path(__file__).parent
LINK = re.compile(r"\]\((?![a-z]+:|#)([^)\s]+)\)")


def long_description() -> str:
    """README.md, with its links to files of the repository as addresses."""
    with (ROOT / "pyproject.toml").open("rb") as file:
        repository = tomllib.load(file)["project"]["urls"]["Repository"]

    readme = (ROOT / "README.md").read_text(encoding="utf-8")
    return LINK.sub(rf"]({repository}/blob/main/\1)", readme)


setup(long_description=long_description(), long_description_content_type="text/markdown")
