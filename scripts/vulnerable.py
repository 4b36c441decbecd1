"""Have pip-audit look up known vulnerabilities of all that this package needs, in the versions installed here.

    pip install pip-audit
    python scripts/vulnerable.py

Only what the package needs at run time, without extras, is looked up. The exit status is pip-audit's; 1 also where the
database does not know a package, since that says nothing.
"""

from __future__ import annotations

import shutil
import subprocess
import sys
from argparse import ArgumentParser
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from tempfile import TemporaryDirectory

from environments import normal, project
from packaging.requirements import Requirement


def main() -> int:
    """Look up, and print what is found."""
    ArgumentParser(description=(__doc__ or "").partition("\n")[0]).parse_args()
    tool = shutil.which("pip-audit")
    if tool is None:
        print("pip-audit is not installed: pip install pip-audit", file=sys.stderr)
        return 2
    versions = needed(project()["project"]["dependencies"])
    with TemporaryDirectory() as folder:
        listed = Path(folder) / "needed.txt"
        listed.write_text("".join(f"{name}=={version}\n" for name, version in versions.items()), encoding="utf-8")
        command = [tool, "--strict", "--no-deps", "--disable-pip", "--progress-spinner", "off", "-r", str(listed)]
        return subprocess.run(command, check=False).returncode


def needed(requirements: Iterable[str]) -> dict[str, str]:
    """Versions installed of these and of all that they need in turn, by name; what is not installed is left out."""
    found: dict[str, str] = {}
    waiting = [Requirement(each).name for each in requirements]
    while waiting:
        name = normal(waiting.pop())
        if name in found:
            continue
        try:
            package = distribution(name)
        except PackageNotFoundError:
            continue
        found[name] = package.version
        for each in map(Requirement, package.requires or []):
            if each.marker is None or each.marker.evaluate({"extra": ""}):
                waiting.append(each.name)
    return dict(sorted(found.items()))


if __name__ == "__main__":
    sys.exit(main())
