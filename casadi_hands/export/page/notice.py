"""What others made that a page holds: names, versions and licences, for its top."""

from __future__ import annotations

import json
import re
from functools import cache
from importlib.resources import files

_BUNDLE = "viewer/dist/main.min.js"
_PARTS = f"{_BUNDLE}.THIRD_PARTY_LICENSES.json"


@cache
def notice() -> str:
    """Of meshcat's bundle, a line a part; it ends no comment of HTML.

    A bundle that does not list its parts is named alone.
    """
    folder, lines = files("meshcat"), ["meshcat's viewer: MIT licence, (c) Robin Deits"]
    if (listed := folder.joinpath(_PARTS)).is_file():
        for part in json.loads(listed.read_text(encoding="utf-8")):
            licence = f"{part['name']} {part['version']}: {part['license']}"
            # Names without addresses: a page that names none can be seen to fetch none.
            copyright_ = _copyright(part.get("licenseText") or "") or re.sub(
                r"[<(].*", "", str(part.get("author") or "")
            )
            lines.append(f"{licence}, {copyright_}" if copyright_ else licence)
    return "\n  ".join(" ".join(line.replace("--", "- -").replace(">", "").split()) for line in lines)


def _copyright(text: str) -> str:
    """The line of a licence that says whose the work is; empty where none does."""
    lines = (line.strip() for line in text.splitlines())
    return next((line for line in lines if line.startswith("Copyright") and any(c.isdigit() for c in line)), "")
