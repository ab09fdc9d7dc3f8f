"""The generated observer over a measured log: compiled C over blocks of samples, or the Python twin."""
