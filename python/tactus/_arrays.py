"""Arrays for libraries that know no read-only memory."""
from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:  # it takes a fifth of the time of this import
    from numpy.typing import NDArray


class _Shared:
    def __init__(self, array: NDArray[Any]) -> None:
        self.array = array
        self.__array_interface__ = array.__array_interface__ | {"data": (array.ctypes.data, False)}


def shared(array: NDArray[Any]) -> NDArray[Any]:
    """The same memory, kept alive, as an array that DLPack takes: torch.from_dlpack(tactus.shared(mesh.positions)). What
    is written there changes the mesh under others that look at it."""
    if not isinstance(array, np.ndarray):
        raise TypeError(f"array is a {type(array).__name__}, expected a numpy array, as mesh.positions")
    return np.asarray(_Shared(array))
