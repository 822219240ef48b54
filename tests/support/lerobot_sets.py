# SPDX-FileCopyrightText: 2026 the truing authors
# SPDX-License-Identifier: BSD-3-Clause
"""LeRobot data sets (version 3.0), as `lerobot record` leaves one without cameras."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
from numpy.typing import NDArray

Floats = NDArray[np.float64]


def write_lerobot(
    folder: Path, motors: Sequence[str], fps: float, episodes: Sequence[tuple[Floats, Floats]], test: int
) -> None:
    """episodes: state and action of each, shape=(rows, motors) [deg]. test: so many of them, the last."""
    names = [f"{motor}.pos" for motor in motors]
    feature = {"dtype": "float32", "names": names, "shape": [len(names)]}
    scalar = {"dtype": "int64", "shape": [1], "names": None}
    train = len(episodes) - test
    info: dict[str, Any] = {
        "codebase_version": "v3.0",
        "robot_type": "so101_follower",
        "total_episodes": len(episodes),
        "total_frames": int(sum(len(state) for state, _ in episodes)),
        "fps": fps,
        "splits": {"train": f"0:{train}", "test": f"{train}:{len(episodes)}"},
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet",
        "features": {
            "action": feature,
            "observation.state": feature,
            "timestamp": {"dtype": "float32", "shape": [1], "names": None},
            "frame_index": scalar,
            "episode_index": scalar,
        },
    }
    (folder / "meta").mkdir(parents=True)
    (folder / "meta" / "info.json").write_text(json.dumps(info, indent=4) + "\n", encoding="utf-8")
    rows = [np.arange(len(state)) for state, _ in episodes]
    state, action = (np.concatenate([e[k] for e in episodes]).astype(np.float32) for k in (0, 1))
    table = pa.table(
        {
            "action": pa.FixedSizeListArray.from_arrays(pa.array(action.ravel()), len(names)),
            "observation.state": pa.FixedSizeListArray.from_arrays(pa.array(state.ravel()), len(names)),
            "timestamp": pa.array(np.concatenate(rows).astype(np.float32) / np.float32(fps)),
            "frame_index": pa.array(np.concatenate(rows)),
            "episode_index": pa.array(np.repeat(np.arange(len(rows)), [len(r) for r in rows])),
        }
    )
    data = folder / "data" / "chunk-000"
    data.mkdir(parents=True)
    parquet.write_table(table, data / "file-000.parquet", compression="zstd")
