"""Keypoints of a detector: read from its files, written back in the same or in another format.

Formats, recognised by their content:

- MediaPipe: the results of its Pose Landmarker as JSON, one entry per frame (`mediapipe`).
- RTMPose and all models of MMPose: JSON of its demos and inferencer (`mmpose`); ViTPose: the same, or the
  JSON of easy_ViTPose (`vitpose`).
- YOLO-pose of Ultralytics: a folder of label files or of JSON, or one JSON list (`yolo`).
- OpenPose: a folder with one JSON file per frame; the last number in a file's name is its frame number.
- COCO results, also AlphaPose (COCO-17, Halpe-26): one JSON list of `{image_id, keypoints, score}`.
- AlphaPose in the forms of OpenPose and CMU: one JSON object of frames by the name of their image.
- COCO annotations: one JSON object with `annotations`; visibility 0, 1, 2 becomes the score 0, 0.5, 1.
- DeepLabCut: CSV or H5 (`deeplabcut`); SLEAP: analysis files, H5 or CSV (`sleap`). H5 needs the extra `h5`.
- Tables: CSV, wide (`frame` or `time_s`, `<joint>_x`, `<joint>_y`, optionally `<joint>_score`) or long
  (`frame` or `time_s`, `joint`, `x`, `y`, optionally `score`), either with `person` for several people. The
  projected joints of `track.csv` are such a table; a folder that holds one may be given. The same as
  Parquet.
- TRC in pixels, as Sports2D writes it (`*_px_*.trc`).

A point at (0, 0) or without coordinates is missing: NaN here. Missing frames inside the sequence become
missing points. Toes, heels and points of the face are kept where the layout has them. `Keypoints.write`
changes the points that differ from the input, and nothing else in the file; `write_openpose`, `write_coco`,
`write_csv` write only this person and what the format can store.

Limits: it knows people by their places alone (see `read_keypoints`), reads no 3D points and guesses no rate.
"""

from memo.keypoints.coco import write_coco
from memo.keypoints.openpose import write_openpose
from memo.keypoints.points import Keypoints, KeypointsError, OptionError, Someone, layouts
from memo.keypoints.reading import read_keypoints
from memo.keypoints.table import write_csv
from memo.keypoints.track import keypoints_of_track
from memo.keypoints.writing import WRITERS, write_keypoints

__all__ = [
    "WRITERS",
    "Keypoints",
    "KeypointsError",
    "OptionError",
    "Someone",
    "keypoints_of_track",
    "layouts",
    "read_keypoints",
    "write_coco",
    "write_csv",
    "write_keypoints",
    "write_openpose",
]
