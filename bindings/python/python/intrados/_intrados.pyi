import os
from collections.abc import Callable, Sequence

Progress = Callable[[float, str], object]

__version__: str

class Loaded: ...

def load(path: str | os.PathLike[str], allow: Sequence[str | os.PathLike[str]], progress: Progress | None) -> Loaded: ...
def run(words: Sequence[str], scene: Loaded | None, progress: Progress | None) -> str: ...
def detect_array(
    grey: bytes, width: int, height: int, pixel_mm: float | None, method: str, progress: Progress | None
) -> tuple[str, bytes, bytes]: ...
def detect_file(
    path: str | os.PathLike[str], layer: int | None, pixel_mm: float | None, method: str, progress: Progress | None
) -> tuple[str, bytes, bytes]: ...
