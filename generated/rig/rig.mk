# The observer rig for a Makefile: `include` this file, compile rig_SOURCES with rig_CFLAGS and link with
# rig_LIBS. Made by stiction 0.1.0 with: stiction generate rig.yaml
rig_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
rig_SOURCES := $(rig_DIR)rig.c
rig_CFLAGS := -std=c99 -ffp-contract=off -I$(rig_DIR)
rig_LIBS := -lm
