"""Every figure of the thesis that can be computed, from a spec each, and what its text says of it, checked."""

from codegen.thesis.gallery.build import GalleryResult, figure_numbers, run_gallery
from codegen.thesis.gallery.page import gallery_json, gallery_page, gallery_summary, write_gallery

__all__ = [
    "GalleryResult",
    "figure_numbers",
    "gallery_json",
    "gallery_page",
    "gallery_summary",
    "run_gallery",
    "write_gallery",
]
