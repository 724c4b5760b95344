"""Scenes in other engines: a file each (`in_X.py`), the scenes (`cases.py`), the judge of what came out."""
