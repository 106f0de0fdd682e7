"""Make the panel's three.js: what `three_entry.js` names, and what that needs, as one ES module.

    python tools/bundle_three.py            writes dobot_async/panel/static/vendor/three.js and three.LICENSE.txt
    python tools/bundle_three.py --check    says whether they are what this script makes; exit code 1 if not

It needs npm and the network. The versions are exact and the package's hash is checked, so everybody gets the same
bytes. To update: change THREE and THREE_SHA512 (`npm view three@VERSION dist.integrity`), run it, and run
tests/panel/browser.
"""

from __future__ import annotations

import argparse
import base64
import hashlib
import json
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

THREE = "0.187.0"
THREE_SHA512 = "Qiu7R+Cmh8CstZsY1uJOSWnVlfo7ZtNLV7mF8Jltk3LB3AtDu9cRZlcnRKkAk8Y4z6KKw35z7Y7Urd7jWY8etA=="
ESBUILD = "0.28.2"
ENTRY = Path(__file__).with_name("three_entry.js")
VENDOR = Path(__file__).parents[1] / "dobot_async/panel/static/vendor"
HEAD = f"/* three.js {THREE}, bundled by tools/bundle_three.py; licence: three.LICENSE.txt */\n"


def npm(*arguments: str, folder: Path) -> str:
    """Run npm in a folder; return what it printed."""
    program = shutil.which("npm")
    if program is None:
        sys.exit("npm is not installed: https://nodejs.org has it")

    quiet = ("--no-audit", "--no-fund", "--ignore-scripts", "--no-package-lock", "--no-update-notifier")
    command = [program, *arguments, *quiet]
    return subprocess.run(command, cwd=folder, check=True, stdout=subprocess.PIPE, text=True).stdout


def make(folder: Path) -> dict[str, bytes]:
    """Return the files of the vendor folder by their names.

    Args:
        folder: An empty folder to work in.
    """
    (folder / "package.json").write_text('{"private": true}')
    archive = folder / json.loads(npm("pack", f"three@{THREE}", "--json", folder=folder))[0]["filename"]
    found = base64.b64encode(hashlib.sha512(archive.read_bytes()).digest()).decode()
    if found != THREE_SHA512:
        sys.exit(f"three {THREE} is not the package that was pinned: its SHA-512 is {found}")

    npm("install", f"./{archive.name}", f"esbuild@{ESBUILD}", folder=folder)
    shutil.copy(ENTRY, folder / "entry.js")
    options = ["--bundle", "--format=esm", "--minify", "--target=es2020", "--legal-comments=none"]
    result = folder / "three.js"
    esbuild = folder / "node_modules/.bin/esbuild"
    subprocess.run([esbuild, "entry.js", *options, f"--outfile={result}"], cwd=folder, check=True)
    return {
        "three.js": HEAD.encode() + result.read_bytes(),
        "three.LICENSE.txt": (folder / "node_modules/three/LICENSE").read_bytes(),
    }


def main() -> None:
    """Write the files, or compare them."""
    parser = argparse.ArgumentParser(description="Make the panel's three.js")
    parser.add_argument("--check", action="store_true", help="compare the files with what this makes; write nothing")
    check = parser.parse_args().check
    with tempfile.TemporaryDirectory() as folder:
        made = make(Path(folder))

    for name, content in made.items():
        path = VENDOR / name
        if not check:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(content)
        elif not path.exists() or path.read_bytes() != content:
            sys.exit(f"{path} is not what this script makes")


if __name__ == "__main__":
    main()
