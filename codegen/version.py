"""The one place that knows the version: package metadata, or pyproject.toml in a source tree that was never installed."""

from importlib.metadata import PackageNotFoundError, version

try:
    VERSION = version("stiction")
except PackageNotFoundError:
    VERSION = "0+source"
