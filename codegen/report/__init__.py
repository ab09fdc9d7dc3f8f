"""The diagnosis report (`page.py`): one self-contained HTML page, without scripts or external files; pages of laws."""
