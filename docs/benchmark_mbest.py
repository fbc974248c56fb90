"""Predict with mBEST (Choi et al., RA-L 2023): python docs/benchmark_mbest.py CHECKOUT INPUTS FOLDER.

CHECKOUT is a clone of github.com/StructuresComp/mBEST, installed as its README says into the Python that runs this file; it needs
numpy below 2. INPUTS is OUT/inputs of `python docs/measure_benchmark.py SET OUT inputs`. The predictions go to FOLDER, for
`doo3d evaluate predictions FOLDER --data SET`. A frame on which mBEST fails gets no file, and counts as an empty prediction. Set
OMP_NUM_THREADS, OPENBLAS_NUM_THREADS and NUMBA_NUM_THREADS to 1 for its time on one core.
"""

from __future__ import annotations

import json
import sys
import time
from pathlib import Path

import cv2
import numpy as np


def main(checkout: Path, inputs: Path, out: Path) -> None:
    """Predict every frame of `inputs`."""
    vars(np).setdefault("int", int)  # mBEST uses this name, which numpy 1.24 no longer has
    sys.path.insert(0, str(checkout))
    from mBEST import mBEST

    cv2.setNumThreads(1)
    failed = []
    for file in sorted(inputs.rglob("*.mask.png")):
        path = out / file.relative_to(inputs)
        stem = file.name.removesuffix(".mask.png")
        mask = cv2.imread(str(file), cv2.IMREAD_GRAYSCALE)
        image = cv2.imread(str(file.with_name(f"{stem}.image.png")))
        colors = [[k % 256, k // 256, 0] for k in range(1, 1 + mask.shape[0])]  # the number of the instance as its color
        program = mBEST(colors)
        start = time.perf_counter()
        try:
            program.set_image(image)
            paths, drawn = program.run(mask, verbose=False)
        except Exception as error:
            failed.append(f"{file.relative_to(inputs)}: {type(error).__name__}: {error}")
            continue
        ms = 1e3 * (time.perf_counter() - start)
        path.parent.mkdir(parents=True, exist_ok=True)
        cv2.imwrite(str(path.with_name(f"{stem}.png")), drawn[..., 0].astype(np.uint16) + 256 * drawn[..., 1].astype(np.uint16))
        chains = [{"points": np.asarray(each)[:, ::-1].tolist()} for each in paths if len(each) > 1]
        path.with_name(f"{stem}.json").write_text(json.dumps({"chains": chains, "ms": ms}))
    print(f"{len(failed)} failed", *failed, sep="\n")


if __name__ == "__main__":
    main(*map(Path, sys.argv[1:4]))
