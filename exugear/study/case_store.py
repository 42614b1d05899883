"""Folder in which the finished cases of a sweep are kept: a netCDF file for each, whole or absent.

The file `sweep.json` names the function by its fingerprint. The name of a case's file is the fingerprint of its values,
and of its random numbers: a changed case is another file.
"""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import xarray as xr

from exugear.study.fingerprint import fingerprint, program_stamp
from fem.support import netcdf
from fem.support.cache import complete_file
from fem.support.user_warning import warn_user
from fem.support.validation import require

ABOUT, MARK = "sweep.json", "exugear.sweep"
ELSEWHERE = "take an empty folder, or one that does not exist"


class CaseStore:
    """The finished cases of a function in a folder, which is made with the first case.

    Raises ValueError for a folder that holds other files, or cases of another function or of another version of this
    program, and for a function whose content cannot be told.
    """

    def __init__(self, folder: Path, function: Callable):
        self.folder = folder
        try:
            about = {"kind": MARK, "function": fingerprint(function), "program": program_stamp()}
        except TypeError as error:
            remedy = "pass such objects in the cases, or make them inside the function"
            raise ValueError(f"function cannot be recognized in a store: {error}; {remedy}") from None
        require(not folder.exists() or folder.is_dir(), f"store {folder} is a file; {ELSEWHERE}")
        self.about = about
        kept = self._about()
        if kept is None:
            return
        changed = {"function": "another function, or this one before it was changed", "program": "another version"}
        for name, words in changed.items():
            require(kept.get(name) == about[name], f"store {folder} holds cases of {words}; {ELSEWHERE}")

    def _about(self) -> dict[str, Any] | None:
        """What the folder says about its cases; None where it is empty."""
        try:
            about = json.loads((self.folder / ABOUT).read_text(encoding="utf-8"))
        except FileNotFoundError:
            if not self.folder.exists():
                return None
            others = sorted(path.name for path in self.folder.iterdir() if not path.name.endswith(".part"))
            holds = f"store {self.folder} holds other files ({', '.join(others[:3])})"
            require(not others, f"{holds}; {ELSEWHERE}")
            return None
        except ValueError:
            about = None
        known = isinstance(about, dict) and about.get("kind") == MARK
        require(known, f"store {self.folder} holds another {ABOUT}; {ELSEWHERE}")
        return about

    def _path(self, key: Any) -> Path:
        try:
            return self.folder / f"{fingerprint(key)}.nc"
        except TypeError as error:
            raise ValueError(f"cases cannot be recognized in a store: {error}; take numbers and texts") from None

    def load(self, key: Any) -> xr.Dataset | None:
        """The result of a case, None where it is not kept; a damaged file warns and counts as absent."""
        path = self._path(key)
        if not path.exists():
            return None
        try:
            return netcdf.read(path, "it is computed again")
        except (OSError, ValueError) as error:
            warn_user(f"store: {error}")
            return None

    def keep(self, key: Any, result: xr.Dataset) -> None:
        """Write the result of a case; OSError where the folder cannot be written."""
        if not (self.folder / ABOUT).exists():
            self.folder.mkdir(parents=True, exist_ok=True)
            with complete_file(self.folder / ABOUT) as file:
                file.write(json.dumps(self.about).encode())
        netcdf.write(result, self._path(key))
