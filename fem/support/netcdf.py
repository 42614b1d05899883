"""Labelled data as netCDF: files are whole or absent, and damage is seen before HDF5 reads them.

A single wrong bit in the global heap of a file can make HDF5 search for ever, deaf to Ctrl-C. Files end with a digest
of all bytes before it, which HDF5 and other programs pass over; a program that changes the file drops it. A file
without digest is first read by a child process, which is stopped if it does not end.
"""

import hashlib
import os
import subprocess
import sys
from contextlib import AbstractContextManager, nullcontext
from errno import ENOENT
from io import BytesIO
from pathlib import Path

import xarray as xr

from fem.support.cache import complete_file
from fem.support.validation import require

#: How files hold numbers: without loss, bytes of equal weight side by side, which halves size and time of a run's file.
PACKED = {"zlib": True, "complevel": 1, "shuffle": True}
#: The end of a file: this mark, then the digest of all before the mark.
MARK, DIGEST = b"\nSHA-256 of exugear:", hashlib.sha256
END = len(MARK) + DIGEST().digest_size
CHUNK = 1 << 20
#: Time that a child process may take to read a file: to begin [s], and for its bytes [s/B].
BEGINS, PER_BYTE = 20.0, 1 / 5e6
#: Reads all that a file holds; ends with status 0, or with CANNOT where h5py is missing.
CANNOT = 77
READS_ALL = f"""
import sys
try:
    import h5py
except Exception:
    sys.exit({CANNOT})
def visit(item):
    [item.attrs[name] for name in item.attrs]
    if isinstance(item, h5py.Dataset):
        item[()]
    else:
        [visit(item[name]) for name in item]
with h5py.File(sys.argv[1], "r") as file:
    visit(file)
"""


def write(data: xr.Dataset, path: Path) -> None:
    """Write compressed netCDF that ends with its digest; OSError where the file cannot be written."""
    content = BytesIO()  # HDF5 itself does not survive a full disk: written in memory first
    packed = {name: PACKED for name, values in data.variables.items() if values.dtype == float}
    with _without_cluster():
        data.to_netcdf(content, engine="h5netcdf", encoding=packed)
    with complete_file(path) as file:
        file.write(content.getbuffer())
        file.write(MARK + DIGEST(content.getbuffer()).digest())


def _without_cluster() -> AbstractContextManager:
    """Context in which xarray takes no lock of a Dask cluster, which would not know a file in memory."""
    config = getattr(sys.modules.get("dask"), "config", None)
    return config.set(scheduler="synchronous") if config else nullcontext()


def read(path, remedy: str) -> xr.Dataset:
    """The data of a netCDF file, in memory; ValueError with a remedy for a damaged or other file."""
    require(not Path(path).is_dir(), f"{path} is a folder; give the name of a file in it")
    if not Path(path).exists():
        raise FileNotFoundError(ENOENT, f"{path} does not exist; {remedy}, or correct the path")
    try:
        _check_whole(Path(path))
        with xr.open_dataset(path, engine="h5netcdf") as data:
            return data.load()
    except (FileNotFoundError, PermissionError):
        raise
    except Exception as error:
        raise ValueError(f"{path} is damaged or no netCDF file; {remedy} ({error})") from None


def _check_whole(path: Path) -> None:
    """ValueError unless the file has the bytes that were written, or HDF5 can read it to the end."""
    size, digest = path.stat().st_size, DIGEST()
    with path.open("rb") as file:
        file.seek(max(size - END, 0))
        end = file.read()
        if not end.startswith(MARK) or len(end) < END:
            _check_readable(path, BEGINS + PER_BYTE * size)
            return
        file.seek(0)
        for start in range(0, size - END, CHUNK):
            digest.update(file.read(min(CHUNK, size - END - start)))
    require(end == MARK + digest.digest(), "its bytes are not those that were written")


def _check_readable(path: Path, seconds: float) -> None:
    """ValueError where a child process fails or does not end within some seconds as it reads a file by HDF5."""
    command = [sys.executable, "-c", READS_ALL, str(path.absolute())]
    surroundings = os.environ | {"PYTHONPATH": os.pathsep.join(filter(None, sys.path))}
    try:
        child = subprocess.run(command, env=surroundings, capture_output=True, text=True, timeout=seconds)
    except subprocess.TimeoutExpired:
        raise ValueError(f"HDF5 could not read it within {seconds:.0f} s") from None
    except OSError:  # no process can be started: read without this check
        return
    cause = (child.stderr.strip().splitlines() or [f"HDF5 ended with status {child.returncode}"])[-1]
    require(child.returncode in (0, CANNOT), cause)
