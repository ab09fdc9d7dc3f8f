# The observer rig_dfob for a Makefile: `include` this file, compile rig_dfob_SOURCES with rig_dfob_CFLAGS and link with
# rig_dfob_LIBS. Made by stiction 0.1.0 with: stiction generate rig_dfob.yaml
rig_dfob_DIR := $(dir $(lastword $(MAKEFILE_LIST)))
rig_dfob_SOURCES := $(rig_dfob_DIR)rig_dfob.c
rig_dfob_CFLAGS := -std=c99 -ffp-contract=off -I$(rig_dfob_DIR)
rig_dfob_LIBS := -lm
