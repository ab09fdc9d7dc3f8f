"""The figures of the thesis that can be computed, and checks of the thesis' statements about them."""
