"""roboplan's RobotBodyFilter on the same postures and clouds; run by an environment of its own."""

import sys
import time
from typing import Any

import numpy as np
import roboplan.core as roboplan

job = np.load(sys.argv[1])
urdf, padding, repeats = str(job["urdf"]), float(job["padding"]), int(job["repeats"])
description = roboplan.loadUrdfSceneDescription(urdf, [str(job["folder"])])
scene = roboplan.Scene("arm", description)
answer: dict[str, Any] = {}
for method in ("Narrowphase", "PaddedObb"):
    kind = getattr(roboplan.RobotBodyFilterMethod, method)
    judge = roboplan.RobotBodyFilter(
        scene, roboplan.RobotBodyFilterOptions(padding, kind, num_threads=1)
    )
    for cloud in ("around", "near", "far"):
        points, q = job[cloud], job["q"]  # (P, n, 3) [m] base frame, (P, n)
        seconds = []
        for i in range(repeats // 5 + repeats):
            k = i % len(q)
            begin = time.perf_counter()
            judge.computeMask(q[k], points[k])
            seconds.append(time.perf_counter() - begin)
        answer[f"{method}_{cloud}_s"] = np.array(seconds[-repeats:])
        answer[f"{method}_{cloud}_mask"] = np.array(
            [judge.computeMask(a, b) for a, b in zip(q, points, strict=True)]
        )
np.savez(sys.argv[2], **answer)
