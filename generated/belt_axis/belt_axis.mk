# The observer belt_axis for a Makefile: `include` this file, compile belt_axis_SOURCES with belt_axis_CFLAGS and link with
# belt_axis_LIBS. Made by stiction 0.1.0 with: stiction generate belt_axis.yaml
belt_axis_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
belt_axis_SOURCES := $(belt_axis_DIR)belt_axis.c
belt_axis_CFLAGS := -std=c99 -ffp-contract=off -I$(belt_axis_DIR)
belt_axis_LIBS := -lm
