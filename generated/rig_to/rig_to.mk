# The observer rig_to for a Makefile: `include` this file, compile rig_to_SOURCES with rig_to_CFLAGS and link with
# rig_to_LIBS. Made by stiction 0.1.0 with: stiction generate rig_to.yaml
rig_to_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
rig_to_SOURCES := $(rig_to_DIR)rig_to.c
rig_to_CFLAGS := -std=c99 -ffp-contract=off -I$(rig_to_DIR)
rig_to_LIBS := -lm
