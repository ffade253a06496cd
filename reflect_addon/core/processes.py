"""Is the process that left this lock or this temporary folder behind still running? Signs with host and process id."""

import os
import platform
import re
import time

ABANDONED_AFTER = 24 * 3600  # s: what another machine left on a shared drive cannot be asked; a day is longer than any bake


def signature() -> str:
    """'<pid>-<host>' of this process: letters, digits and one dash."""
    return f"{os.getpid()}-{_host()}"


def is_alive(pid: int) -> bool:
    """Does a process with this id run on this machine? (Ids are reused: True may be a stranger, False is certain.)"""
    if pid <= 0:
        return False
    if os.name == "nt":
        return _is_alive_windows(pid)
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except PermissionError:  # someone else's process: it runs
        return True
    except OverflowError:
        return False
    return True


def is_abandoned(signed: str, modified: float) -> bool:
    """Was the thing with this signature, last changed at `modified` (s since the epoch), left by a dead process?"""
    match = re.fullmatch(r"(\d{1,10})-([A-Za-z0-9]*)", signed)
    if match and match[2] == _host():
        return not is_alive(int(match[1]))
    return time.time() - modified > ABANDONED_AFTER


def _host() -> str:
    return re.sub(r"[^A-Za-z0-9]", "", platform.node())[:32]


def _is_alive_windows(pid: int) -> bool:
    """os.kill(pid, 0) would end the process there; ask for its exit code instead."""
    import ctypes

    query_limited_information, still_active = 0x1000, 259
    kernel32 = ctypes.windll.kernel32
    handle = kernel32.OpenProcess(query_limited_information, False, pid)
    if not handle:
        return False
    code = ctypes.c_ulong()
    known = kernel32.GetExitCodeProcess(handle, ctypes.byref(code))
    kernel32.CloseHandle(handle)
    return bool(known) and code.value == still_active
