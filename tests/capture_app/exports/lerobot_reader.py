"""Reads a data set with lerobot, joins it with itself, and writes all as npz; runs in another environment.

Usage: python lerobot_reader.py FOLDER OUTPUT
"""

import sys
from pathlib import Path

import numpy as np
from lerobot.datasets.dataset_tools import delete_episodes, merge_datasets
from lerobot.datasets.lerobot_dataset import LeRobotDataset

folder, output = sys.argv[1:]
whole = LeRobotDataset("omocap/test", root=folder)
step = 1 / whole.fps
windows = {"observation.state": [-step, 0.0], "action": [0.0, step, 2 * step]}
last = LeRobotDataset(
    "omocap/test", root=folder, episodes=[whole.num_episodes - 1], delta_timestamps=windows
)
frames = [whole[k] for k in range(len(whole))]
values = {key: np.array([np.asarray(frame[key]) for frame in frames]) for key in whole.features}
beside = Path(output).parent
merged = merge_datasets([whole, whole], output_repo_id="omocap/two", output_dir=beside / "two")
fewer = delete_episodes(merged, [0], output_dir=beside / "fewer", repo_id="omocap/fewer")
first_window, last_window = last[0], last[len(last) - 1]
np.savez(
    output,
    **values,
    tasks=np.array([frame["task"] for frame in frames]),
    episodes=whole.num_episodes,
    lengths=np.array(whole.meta.episodes["length"]),
    names=np.array(whole.features["observation.state"]["names"]),
    mean=whole.meta.stats["action"]["mean"],
    last_length=len(last),
    edited=[merged.num_episodes, len(merged), fewer.num_episodes, len(fewer)],
    before=first_window["observation.state"],
    before_is_pad=first_window["observation.state_is_pad"],
    after=last_window["action"],
    after_is_pad=last_window["action_is_pad"],
)
